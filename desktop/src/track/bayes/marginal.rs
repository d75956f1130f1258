//! Marginal posterior of the bearings: the unbalance is integrated out.
//!
//! On given bearings the readings are linear in the planes' unbalance, `y = A u + noise`, so that u is Gaussian
//! there: with columns and readings in noise units, its precision is `N = AᴴA` and its mean `û = N⁻¹Aᴴy`, and what
//! is left for the bearings is `exp(−½|y − Aû|²)/det N` times their prior. Coordinates z are those in which the
//! prior is a standard Gaussian, `logs = centre + L z`.
//!
//! Without prior knowledge of the unbalance its prior is scale-free: a prior flat in u itself would prefer large
//! unbalance on bearings with a small response.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rayon::prelude::*;

use super::mixture::{COMPONENTS, Component, Mixture};
use crate::fit::descent::{Objective, Stop, descend};
use crate::track::coefficients::Logs;
use crate::track::record::Day;

type C = Complex<f64>;

/// Search for a centre of the proposals, which need not be exact.
const STOP: Stop = Stop::after(5, 0.01);

#[derive(Debug, Clone)]
pub struct BearingGaussian {
    /// Mean of the logarithms of their coefficients.
    pub logs: Logs,
    pub covariance: DMatrix<f64>,
}

/// Posterior density of the bearings, for readings with common bearings and unbalance.
pub struct Marginal<'a> {
    days: &'a [&'a Day],
    centre: Logs,
    factor: DMatrix<f64>,
    /// Prior of each plane's unbalance: mean and standard deviation in each direction, kg·m; `None` if unknown.
    unbalance: Option<&'a [(C, f64)]>,
    planes: usize,
}

/// Gaussian of the unbalance on given bearings.
pub struct ConditionalUnbalance {
    /// Logarithms of the bearing coefficients.
    pub logs: Logs,
    /// Its mean, kg·m.
    pub unbalance_kg_m: DVector<C>,
    precision: Cholesky<C, Dyn>,
}

impl ConditionalUnbalance {
    /// An unbalance drawn from its Gaussian, kg·m.
    pub fn draw(&self, random: &mut StdRng) -> Vec<C> {
        let mut part = || random.sample::<f64, _>(StandardNormal);
        let mut drawn = DVector::from_fn(self.unbalance_kg_m.len(), |_, _| C::new(part(), part()));
        // the factor of a Cholesky decomposition has no zero on its diagonal
        self.precision.l_dirty().ad_solve_lower_triangular_mut(&mut drawn);
        drawn += &self.unbalance_kg_m;
        drawn.data.into()
    }

    /// Logarithm of the determinant of the precision.
    fn log_det(&self) -> f64 {
        2.0 * self.precision.l_dirty().diagonal().iter().map(|d| d.re.ln()).sum::<f64>()
    }

    /// Logarithm of the scale-free prior: minus that of the mean square of every plane's unbalance.
    fn log_scale_free(&self) -> f64 {
        let inverse = self.precision.inverse();
        let square = |(j, u): (usize, &C)| u.norm_sqr() + 2.0 * inverse[(j, j)].re;
        -self.unbalance_kg_m.iter().enumerate().map(square).map(f64::ln).sum::<f64>()
    }
}

/// Linear system of the unbalance on given bearings, in noise units.
struct WeightedSystem {
    columns: DMatrix<C>,
    target: DVector<C>,
}

/// Least-squares solution of such a system.
struct Solved {
    unbalance_kg_m: DVector<C>,
    precision: Cholesky<C, Dyn>,
    misfit: f64,
}

impl WeightedSystem {
    fn solved(&self) -> Option<Solved> {
        let precision = self.columns.ad_mul(&self.columns).cholesky()?;
        let right = self.columns.ad_mul(&self.target);
        let unbalance_kg_m = precision.solve(&right);
        let misfit = self.target.norm_squared() - right.dotc(&unbalance_kg_m).re;
        Some(Solved { unbalance_kg_m, precision, misfit })
    }
}

impl<'a> Marginal<'a> {
    /// Of these readings with this prior of the bearings. `None` if its covariance is not positive definite.
    pub fn new(
        days: &'a [&'a Day],
        planes: usize,
        before: &BearingGaussian,
        unbalance: Option<&'a [(C, f64)]>,
    ) -> Option<Self> {
        let factor = before.covariance.clone().cholesky()?.unpack();
        Some(Self { days, centre: before.logs.clone(), factor, unbalance, planes })
    }

    fn logs(&self, z: &DVector<f64>) -> Logs {
        let mut logs = self.centre.clone();
        for (column, z) in self.factor.column_iter().zip(z) {
            logs.iter_mut().zip(&column).for_each(|(log, factor)| *log += factor * z);
        }
        logs
    }

    fn rows(&self) -> usize {
        let measured: usize = self.days.iter().map(|d| d.measured_m.iter().flatten().count()).sum();
        measured + self.unbalance.map_or(0, <[_]>::len)
    }

    fn system(&self, logs: &[f64]) -> Option<WeightedSystem> {
        let rows = self.rows();
        let (mut columns, mut target) = (DMatrix::zeros(rows, self.planes), DVector::zeros(rows));
        let mut row = 0;
        for day in self.days {
            let shown = day.point.motions_on(logs)?;
            let count = day.measured_m.len();
            for (p, y) in day.measured_m.iter().enumerate() {
                let Some(y) = y else { continue };
                target[row] = (y - shown[self.planes * count + p]) / day.sigma_m[p];
                for j in 0..self.planes {
                    columns[(row, j)] = shown[j * count + p] / day.sigma_m[p];
                }
                row += 1;
            }
        }
        for (j, (was, sd)) in self.unbalance.into_iter().flatten().enumerate() {
            (columns[(row, j)], target[row]) = (C::from(1.0 / sd), was / *sd);
            row += 1;
        }
        Some(WeightedSystem { columns, target })
    }

    /// The unbalance on these bearings, and the remaining squared misfit in noise units.
    pub fn given(&self, logs: Logs) -> Option<(ConditionalUnbalance, f64)> {
        let Solved { unbalance_kg_m, precision, misfit } = self.system(&logs)?.solved()?;
        Some((ConditionalUnbalance { logs, unbalance_kg_m, precision }, misfit))
    }

    /// Logarithm of the density up to a constant, and the unbalance there; `None` where the machine is singular.
    pub fn log_density(&self, z: &DVector<f64>) -> Option<(f64, ConditionalUnbalance)> {
        let (given, misfit) = self.given(self.logs(z))?;
        let sizes = if self.unbalance.is_none() { given.log_scale_free() } else { 0.0 };
        Some((sizes - 0.5 * (misfit + z.norm_squared()) - given.log_det(), given))
    }

    /// Proposals that cover the posterior: a mixture of what the linearised model has at points drawn from nearly the posterior.
    pub fn proposals(&self, seed: u64) -> Option<Mixture> {
        let components: Vec<Option<Component>> =
            (0..COMPONENTS as u64).into_par_iter().map(|k| self.component(seed, k)).collect();
        Mixture::new(components.into_iter().flatten().collect())
    }

    /// Gaussian of the posterior in the model linearised at a point, the optimum of a posterior whose data and prior are perturbed by
    /// their own noise: such a point is a draw where the model is linear (Oliver, He and Reynolds 1996; Bardsley and others 2014,
    /// SIAM Journal on Scientific Computing 36, A1895).
    fn component(&self, seed: u64, k: u64) -> Option<Component> {
        let mut random = StdRng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9).wrapping_add(k));
        let mut part = || random.sample::<f64, _>(StandardNormal);
        let centre = DVector::from_fn(self.centre.len(), |_, _| part());
        let noise = DVector::from_fn(self.rows(), |_, _| C::new(part(), part()));
        let mut perturbed = Profile { of: self, z: centre.clone(), centre, noise };
        descend(&mut perturbed, STOP);
        let mut profile = Profile {
            centre: DVector::zeros(perturbed.z.len()),
            noise: perturbed.noise * C::from(0.0),
            ..perturbed
        };
        let (curvature, slope) = profile.normal_equations()?;
        let curvature = curvature.cholesky()?;
        Some(Component {
            share: 1.0,
            centre: profile.z - curvature.solve(&slope),
            scale: curvature.inverse(),
        })
    }
}

/// Misfit and prior at the best unbalance, the negative log density without its determinants, which hardly change; with other data and
/// another centre of the prior.
struct Profile<'m, 'a> {
    of: &'m Marginal<'a>,
    z: DVector<f64>,
    /// Centre of the prior.
    centre: DVector<f64>,
    /// What is added to the readings, in noise units.
    noise: DVector<C>,
}

impl Profile<'_, '_> {
    fn system(&self, logs: &[f64]) -> Option<WeightedSystem> {
        let WeightedSystem { columns, target } = self.of.system(logs)?;
        Some(WeightedSystem { columns, target: target + &self.noise })
    }
}

impl Objective for Profile<'_, '_> {
    fn position(&self) -> DVector<f64> {
        self.z.clone()
    }

    fn move_to(&mut self, x: &DVector<f64>) {
        self.z = x.clone();
    }

    fn value(&self) -> f64 {
        let found = self.system(&self.of.logs(&self.z)).and_then(|system| system.solved());
        found.map_or(f64::INFINITY, |solved| solved.misfit + (&self.z - &self.centre).norm_squared())
    }

    /// Variable projection (Kaufman 1975): slopes at the best unbalance, less what the unbalance takes up of them.
    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let logs = self.of.logs(&self.z);
        let system = self.system(&logs)?;
        let Solved { unbalance_kg_m, precision, .. } = system.solved()?;
        let WeightedSystem { columns, target } = system;
        let mut slopes = DMatrix::<C>::zeros(target.len(), logs.len());
        let mut row = 0;
        for day in self.of.days {
            let motion = day.point.on(&logs)?;
            let of_probes = day.point.slopes(&logs, &motion, unbalance_kg_m.as_slice());
            for (p, of_probe) in of_probes.row_iter().enumerate() {
                if day.measured_m[p].is_some() {
                    slopes.row_mut(row).copy_from(&of_probe.unscale(day.sigma_m[p]));
                    row += 1;
                }
            }
        }
        let taken_up = precision.solve(&columns.ad_mul(&slopes));
        let free = (slopes - &columns * taken_up) * self.of.factor.map(C::from);
        let left = &columns * unbalance_kg_m - target;
        let n = logs.len();
        let gram = free.ad_mul(&free).map(|g| g.re);
        let slope = free.ad_mul(&left).map(|s| s.re);
        let gram = DMatrix::from_fn(n, n, |i, j| gram[(i, j)] + f64::from(u8::from(i == j)));
        Some((gram, slope + &self.z - &self.centre))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::Noise;
    use crate::measurement::Reading;
    use crate::testing::sample_rotor;
    use crate::track::coefficients::logs_of;
    use crate::track::record;

    /// A reading of the sample machine with some unbalance.
    fn day() -> Day {
        let rotor = sample_rotor();
        let noise = Noise { relative: 0.02, floor_um: 0.03, ..Noise::default() };
        let mut reading =
            Reading { speed_rpm: 9000.0, probes: vec![Some(C::new(1e-5, 0.0)); 4], ..Reading::default() };
        let still = record::days(&rotor, &noise, std::slice::from_ref(&reading)).unwrap().remove(0);
        let shown = still.point.on(&logs_of(&rotor)).unwrap().at(&[C::new(3e-4, 1e-4), C::new(-2e-4, 2e-4)]);
        reading.probes = shown.into_iter().map(Some).collect();
        record::days(&rotor, &noise, &[reading]).unwrap().remove(0)
    }

    fn before() -> BearingGaussian {
        let mut covariance = DMatrix::identity(8, 8) * 0.04;
        covariance[(0, 1)] = 0.02;
        covariance[(1, 0)] = 0.02;
        BearingGaussian { logs: logs_of(&sample_rotor()), covariance }
    }

    #[test]
    fn marginal_density_equals_gaussian_with_unbalance_covariance() {
        let (day, before) = (day(), before());
        let (days, known) = ([&day], [(C::new(2.5e-4, 0.0), 1e-4), (C::new(-1e-4, 1e-4), 5e-5)]);
        let target = Marginal::new(&days, 2, &before, Some(&known)).unwrap();
        let directly = |z: &DVector<f64>| {
            let logs = target.logs(z);
            let shown = day.point.on(&logs).unwrap();
            let mean = shown.at(&known.map(|(u, _)| u));
            let columns = DMatrix::from_fn(4, 2, |p, j| shown.probes[4 * j + p] * known[j].1);
            let noise =
                DMatrix::from_fn(4, 4, |p, q| C::from(if p == q { day.sigma_m[p].powi(2) } else { 0.0 }));
            let covariance = (&columns * columns.adjoint() + noise).cholesky().unwrap();
            let off = DVector::from_fn(4, |p, _| day.all_m()[p] - mean[p]);
            let log_det = 2.0 * covariance.l().diagonal().iter().map(|d| d.re.ln()).sum::<f64>();
            -0.5 * (off.dotc(&covariance.solve(&off)).re + z.norm_squared()) - log_det
        };
        let points = [DVector::zeros(8), DVector::from_fn(8, |i, _| 0.4 * (i as f64 - 3.0))];
        let ours: Vec<f64> = points.iter().map(|z| target.log_density(z).unwrap().0).collect();
        let difference = ours[1] - ours[0];
        let expected = directly(&points[1]) - directly(&points[0]);
        assert!((difference - expected).abs() < 1e-6 * expected.abs(), "{difference} {expected}");
    }

    #[test]
    fn draws_on_given_bearings_equal_weighted_least_squares() {
        let (day, before) = (day(), before());
        let days = [&day];
        let target = Marginal::new(&days, 2, &before, None).unwrap();
        let (given, misfit) = target.given(before.logs.clone()).unwrap();
        assert!(misfit < 1e-9, "the bearings are the true ones: {misfit}");
        let mut random = StdRng::seed_from_u64(1);
        let drawn: Vec<Vec<C>> = (0..20_000).map(|_| given.draw(&mut random)).collect();
        let WeightedSystem { columns, .. } = target.system(&before.logs).unwrap();
        let covariance = columns.ad_mul(&columns).try_inverse().unwrap();
        for j in 0..2 {
            let mean = drawn.iter().map(|u| u[j]).sum::<C>() / 20_000.0;
            let sd = covariance[(j, j)].re.sqrt();
            assert!((mean - [C::new(3e-4, 1e-4), C::new(-2e-4, 2e-4)][j]).norm() < 0.05 * sd, "{mean}");
            let variance = drawn.iter().map(|u| (u[j] - mean).re.powi(2)).sum::<f64>() / 20_000.0;
            assert!((variance.sqrt() / sd - 1.0).abs() < 0.03, "{} {sd}", variance.sqrt());
        }
        let cross =
            drawn.iter().map(|u| (u[0] - given.unbalance_kg_m[0]) * (u[1] - given.unbalance_kg_m[1]).conj());
        let cross = cross.sum::<C>() / 40_000.0;
        assert!((cross - covariance[(0, 1)]).norm() < 0.05 * covariance[(0, 1)].norm(), "{cross}");
    }

    #[test]
    fn components_of_nearly_linear_model_are_its_posterior() {
        let (mut day, mut before) = (day(), before());
        before.covariance *= 0.01;
        day.sigma_m.iter_mut().for_each(|s| *s *= 0.05);
        let days = [&day];
        let target = Marginal::new(&days, 2, &before, None).unwrap();
        let all: Vec<Component> = (0..COMPONENTS as u64).filter_map(|k| target.component(1, k)).collect();
        assert_eq!(all.len(), COMPONENTS);
        for c in &all {
            // the bearings that the reading was made with are the mean of the prior: there is the mode
            assert!(c.centre.amax() < 0.1, "{}", c.centre);
            assert!((&c.scale - &all[0].scale).amax() < 0.15, "{} {}", c.scale, all[0].scale);
        }
        // the reading determines some directions and leaves the others to the prior
        let variances = all[0].scale.clone().symmetric_eigenvalues();
        assert!(variances.min() < 0.1 && (variances.max() - 1.0).abs() < 1e-6, "{variances}");
    }

    #[test]
    fn proposals_cover_posterior_in_wide_prior() {
        let (day, mut before) = (day(), before());
        before.covariance *= 4.0;
        let days = [&day];
        let target = Marginal::new(&days, 2, &before, None).unwrap();
        let density = |z: &DVector<f64>| Some(target.log_density(z)?.0);
        let mixture = target.proposals(1).unwrap().matched(&density, 400, 2).unwrap();
        let mut random = StdRng::seed_from_u64(3);
        let weight = |_| {
            let z = mixture.draw(1.0, &mut random);
            (target.log_density(&z).unwrap().0 - mixture.log_density(&z)).exp()
        };
        let weights: Vec<f64> = (0..4000).map(weight).collect();
        let squares: f64 = weights.iter().map(|w| w * w).sum();
        let effective = weights.iter().sum::<f64>().powi(2) / squares;
        assert!(effective > 1000.0, "{effective} of 4000");
    }
}

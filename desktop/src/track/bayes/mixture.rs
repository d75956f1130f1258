//! Mixture of Student distributions that covers a target, and adapts to it by weighted draws.
//!
//! A mixture follows a target that is bent or has two modes, where one distribution around one mode does not. Population Monte Carlo
//! matches it to the target (Cappé, Douc, Guillin, Marin and Robert 2008, Statistics and Computing 18, 447): draws weighed by
//! importance are shared among the components, and each takes the moments of its share.

use std::array::from_fn;

use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rayon::prelude::*;

/// Components: enough for the bends of a posterior of eight coefficients, few enough for some hundred draws to match.
pub const COMPONENTS: usize = 24;
/// Degrees of freedom: the tails of the target are nearly those of its Gaussian prior.
const FREEDOM: i32 = 20;
/// Effective draws for each coordinate that a component's moments before a match count as.
const KEPT: f64 = 5.0;
/// Factor on a scale that draws estimate, which are few in the tails: a target that is wider than its proposals holds a chain there.
const WIDENED: f64 = 1.2;
/// Draws that a component's share before a match counts as (Jeffreys).
const KEPT_SHARE: f64 = 0.5;
/// Independent random streams of a match.
const STREAMS: usize = 8;

/// A number for each component.
type Lanes = [f64; COMPONENTS];

/// Student distribution of a share of the mixture.
#[derive(Debug, Clone)]
pub struct Component {
    pub share: f64,
    pub centre: DVector<f64>,
    pub scale: DMatrix<f64>,
}

/// A mixture of [`COMPONENTS`] of them. The arrays that their densities need hold the components side by side, so that the compiler can
/// vectorise over them.
#[derive(Debug, Clone)]
pub struct Mixture {
    components: Vec<Component>,
    /// Lower factor of each scale matrix.
    factors: Vec<DMatrix<f64>>,
    /// Inverses of the factors, their lower triangles row by row.
    inverses: Vec<Lanes>,
    /// The same times the centres.
    middles: Vec<Lanes>,
    /// Share over the determinant of the factor.
    heights: Lanes,
    squares: ChiSquared<f64>,
}

/// A draw weighed by importance.
struct Weighed {
    z: DVector<f64>,
    weight: f64,
}

impl Mixture {
    /// Of so many components or fewer, whose shares need not sum to one; those whose scale is not positive definite are left out.
    /// `None` if none remains.
    pub fn new(components: Vec<Component>) -> Option<Self> {
        let factor = |c: Component| Some((c.scale.clone().cholesky()?.unpack(), c));
        let (factors, mut components): (Vec<_>, Vec<_>) =
            components.into_iter().take(COMPONENTS).filter_map(factor).unzip();
        let sum: f64 = components.iter().map(|c| c.share).sum();
        components.iter_mut().for_each(|c| c.share /= sum);
        let n = components.first()?.centre.len();
        let (mut inverses, mut middles) = (vec![[0.0; COMPONENTS]; place(n, 0)], vec![[0.0; COMPONENTS]; n]);
        let mut heights = [0.0; COMPONENTS];
        for (k, (factor, component)) in factors.iter().zip(&components).enumerate() {
            let inverse = factor.solve_lower_triangular(&DMatrix::identity(n, n))?;
            let middle = &inverse * &component.centre;
            for i in 0..n {
                (0..=i).for_each(|j| inverses[place(i, j)][k] = inverse[(i, j)]);
                middles[i][k] = middle[i];
            }
            heights[k] = component.share * inverse.diagonal().product();
        }
        let squares = ChiSquared::new(f64::from(FREEDOM)).ok()?;
        Some(Self { components, factors, inverses, middles, heights, squares })
    }

    /// Squared distance of a point from each centre, in units of the scale.
    fn distances(&self, z: &DVector<f64>) -> Lanes {
        let mut distances = [0.0; COMPONENTS];
        let mut rows = self.inverses.iter();
        for (i, middle) in self.middles.iter().enumerate() {
            let mut along = middle.map(|m| -m);
            for (x, row) in z.iter().zip(rows.by_ref().take(i + 1)) {
                add(&mut along, *x, row);
            }
            distances.iter_mut().zip(&along).for_each(|(sum, along)| *sum += along * along);
        }
        distances
    }

    /// Density of each component at these distances, up to a common constant.
    fn densities(&self, distances: &Lanes) -> Lanes {
        let power = FREEDOM + self.middles.len() as i32;
        let base: Lanes = distances.map(|d| (1.0 + d / f64::from(FREEDOM)).sqrt().recip());
        from_fn(|k| self.heights[k] * base[k].powi(power))
    }

    /// Logarithm of the density up to a constant.
    pub fn log_density(&self, z: &DVector<f64>) -> f64 {
        let sum: f64 = self.densities(&self.distances(z)).iter().sum();
        sum.max(f64::MIN_POSITIVE).ln()
    }

    /// A point drawn with every scale times `width`.
    pub fn draw(&self, width: f64, random: &mut StdRng) -> DVector<f64> {
        let mut lot = random.random_range(0.0..1.0);
        let chosen = self.components.iter().position(|c| {
            lot -= c.share;
            lot < 0.0
        });
        let k = chosen.unwrap_or(self.components.len() - 1);
        let length = width / (self.squares.sample(random) / f64::from(FREEDOM)).sqrt();
        let n = self.middles.len();
        let mut point = DVector::from_fn(n, |_, _| length * random.sample::<f64, _>(StandardNormal));
        // in place from the last row up, which alone needs the last coordinate
        for i in (0..n).rev() {
            let off: f64 = (0..=i).map(|j| self.factors[k][(i, j)] * point[j]).sum();
            point[i] = self.components[k].centre[i] + off;
        }
        point
    }

    /// The same with the moments that `count` draws weighed by importance give each component. Weights are truncated (Ionides 2008,
    /// Journal of Computational and Graphical Statistics 17, 295). `None` if the density is zero at all draws.
    pub fn matched(
        &self,
        log_density: &(impl Fn(&DVector<f64>) -> Option<f64> + Sync),
        count: usize,
        seed: u64,
    ) -> Option<Self> {
        let stream = |k: usize| {
            let mut random = StdRng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9).wrapping_add(k as u64));
            let draw = |_| {
                let z = self.draw(1.0, &mut random);
                let weight = log_density(&z)? - self.log_density(&z);
                Some(Weighed { z, weight })
            };
            (0..count.div_ceil(STREAMS)).filter_map(draw).collect::<Vec<Weighed>>()
        };
        let mut draws: Vec<Weighed> = (0..STREAMS).into_par_iter().flat_map_iter(stream).collect();
        if draws.is_empty() {
            return None;
        }
        let most = draws.iter().map(|d| d.weight).fold(f64::NEG_INFINITY, f64::max);
        draws.iter_mut().for_each(|d| d.weight = (d.weight - most).exp());
        let mean = draws.iter().map(|d| d.weight).sum::<f64>() / count as f64;
        let limit = mean * (count as f64).sqrt();
        draws.iter_mut().for_each(|d| d.weight = d.weight.min(limit));
        let sum: f64 = draws.iter().map(|d| d.weight).sum();
        draws.iter_mut().for_each(|d| d.weight /= sum);
        self.with_moments(&draws)
    }

    /// Each component with its moments in these draws, as far as they are worth more than those before.
    fn with_moments(&self, draws: &[Weighed]) -> Option<Self> {
        let n = self.middles.len();
        let mut sums = MomentSums::new(n);
        let freedom = f64::from(FREEDOM);
        for draw in draws {
            let distances = self.distances(&draw.z);
            let densities = self.densities(&distances);
            let sum = densities.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            let shares = densities.map(|density| draw.weight * density / sum);
            // remote draws count less in the moments of a Student distribution
            let weights = from_fn(|k| shares[k] * (freedom + n as f64) / (freedom + distances[k]));
            sums.add(&draw.z, &shares, &weights);
        }
        let effective = draws.iter().map(|d| d.weight * d.weight).sum::<f64>().recip();
        let component = |(k, before): (usize, &Component)| {
            let share = sums.shares[k].max(f64::MIN_POSITIVE);
            let own = share * share / sums.squares[k].max(f64::MIN_POSITIVE);
            let trusted = own / (own + KEPT * n as f64);
            let weight = sums.weights[k].max(f64::MIN_POSITIVE);
            let centre = DVector::from_fn(n, |i, _| sums.first[i][k] / weight);
            let second = DMatrix::from_fn(n, n, |i, j| sums.second[place(i.max(j), i.min(j))][k]);
            let scale = (second - &centre * centre.transpose() * weight) / share;
            Component {
                share: effective * share + KEPT_SHARE,
                centre: centre * trusted + &before.centre * (1.0 - trusted),
                scale: scale * (WIDENED * trusted) + &before.scale * (1.0 - trusted),
            }
        };
        Self::new(self.components.iter().enumerate().map(component).collect())
    }
}

/// Weighted sums over draws, of each component.
struct MomentSums {
    shares: Lanes,
    /// Squares of the shares.
    squares: Lanes,
    /// Weights of the moments, and the moments.
    weights: Lanes,
    first: Vec<Lanes>,
    /// Lower triangle row by row.
    second: Vec<Lanes>,
}

impl MomentSums {
    fn new(n: usize) -> Self {
        let zero = [0.0; COMPONENTS];
        Self {
            shares: zero,
            squares: zero,
            weights: zero,
            first: vec![zero; n],
            second: vec![zero; place(n, 0)],
        }
    }

    fn add(&mut self, z: &DVector<f64>, shares: &Lanes, weights: &Lanes) {
        add(&mut self.shares, 1.0, shares);
        self.squares.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share * share);
        add(&mut self.weights, 1.0, weights);
        let mut second = self.second.iter_mut();
        for (i, x) in z.iter().enumerate() {
            add(&mut self.first[i], *x, weights);
            for (sums, y) in second.by_ref().take(i + 1).zip(z) {
                add(sums, x * y, weights);
            }
        }
    }
}

/// Adds multiples of other numbers to sums.
fn add(sums: &mut Lanes, factor: f64, more: &Lanes) {
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += factor * more);
}

/// Place of an element of a lower triangle that is stored row by row.
fn place(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::bayes::independence::Walker;

    fn component(share: f64, centre: &[f64], scale: &[f64]) -> Component {
        let n = centre.len();
        let (centre, scale) = (DVector::from_column_slice(centre), DMatrix::from_row_slice(n, n, scale));
        Component { share, centre, scale }
    }

    /// Two components in three dimensions.
    fn pair() -> Vec<Component> {
        let scale = [0.5, 0.3, 0.0, 0.3, 0.8, -0.1, 0.0, -0.1, 0.2];
        vec![
            component(3.0, &[1.0, 0.0, -0.5], &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
            component(1.0, &[-0.5, 0.4, 0.2], &scale),
        ]
    }

    const BEND: f64 = 1.5;
    const ACROSS: f64 = 0.3;

    /// A bent target: the second coordinate follows the square of the first, which is standard.
    fn banana(x: &DVector<f64>) -> Option<f64> {
        let across = (x[1] - BEND * (x[0] * x[0] - 1.0)) / ACROSS;
        Some(-0.5 * (x[0] * x[0] + across * across))
    }

    /// Gaussians of the linearised banana at points along it.
    fn along_banana() -> Mixture {
        let at = |k: usize| {
            let x = -2.3 + 0.2 * k as f64;
            let slope = 2.0 * BEND * x;
            // the linearised target pulls the first coordinate to zero along the tangent
            let centre = [0.0, BEND * (x * x - 1.0) - slope * x];
            component(1.0, &centre, &[1.0, slope, slope, slope * slope + ACROSS * ACROSS])
        };
        Mixture::new((0..COMPONENTS).map(at).collect()).unwrap()
    }

    /// Effective sample size of weighted draws over their number.
    fn efficiency(mixture: &Mixture, target: impl Fn(&DVector<f64>) -> Option<f64>) -> f64 {
        let mut random = StdRng::seed_from_u64(7);
        let weight = |_| {
            let z = mixture.draw(1.0, &mut random);
            (target(&z).unwrap() - mixture.log_density(&z)).exp()
        };
        let weights: Vec<f64> = (0..20_000).map(weight).collect();
        let squares: f64 = weights.iter().map(|w| w * w).sum();
        weights.iter().sum::<f64>().powi(2) / squares / 20_000.0
    }

    #[test]
    fn density_equals_sum_of_students() {
        let (mixture, components) = (Mixture::new(pair()).unwrap(), pair());
        let directly = |z: &DVector<f64>| {
            let of = |c: &Component| {
                let off = z - &c.centre;
                let distance = off.dot(&(c.scale.clone().try_inverse().unwrap() * &off));
                c.share / c.scale.determinant().sqrt() * (1.0 + distance / 20.0).powf(-11.5)
            };
            components.iter().map(of).sum::<f64>().ln()
        };
        let [a, b] = [[0.3, -1.0, 0.5], [-4.0, 2.0, 7.0]].map(|z| DVector::from_row_slice(&z));
        let difference = mixture.log_density(&a) - mixture.log_density(&b);
        let expected = directly(&a) - directly(&b);
        assert!((difference - expected).abs() < 1e-10, "{difference} {expected}");
    }

    #[test]
    fn draws_have_the_stated_density() {
        // means of functions of a standard Gaussian, from weighted draws: biased if draws and density disagree
        let mixture = Mixture::new(pair()).unwrap();
        let mut random = StdRng::seed_from_u64(3);
        let [mut sum, mut mean, mut square] = [0.0; 3];
        for _ in 0..200_000 {
            let z = mixture.draw(1.0, &mut random);
            let weight = (-0.5 * z.norm_squared() - mixture.log_density(&z)).exp();
            (sum, mean, square) = (sum + weight, mean + weight * z[0], square + weight * z[2] * z[2]);
        }
        assert!(
            (mean / sum).abs() < 0.02 && (square / sum - 1.0).abs() < 0.03,
            "{} {}",
            mean / sum,
            square / sum
        );
    }

    #[test]
    fn matched_mixture_recovers_moments_of_banana() {
        let mixture = along_banana();
        let matched = (0..3).fold(mixture.clone(), |m, k| m.matched(&banana, 2000, k).unwrap());
        let [before, after] = [&mixture, &matched].map(|m| efficiency(m, banana));
        assert!(after > 0.7 && after > before, "{before} {after}");
        // one Student with the moments of the target, which has Var x₁ = 1, Var x₂ = 2 b² + s², covariance zero
        let variance = 2.0 * BEND * BEND + ACROSS * ACROSS;
        let one = Mixture::new(vec![component(1.0, &[0.0, 0.0], &[1.0, 0.0, 0.0, variance])]).unwrap();
        assert!(efficiency(&one, banana) < 0.3);
        let target = |x: &DVector<f64>| Some((banana(x)?, x.clone()));
        let mut walker = Walker::start(&matched, 2.0, StdRng::seed_from_u64(5), &target).unwrap();
        let [mut mean, mut square, mut bend] = [0.0; 3];
        walker.go(&matched, 100_000, &target, &mut |x, _| {
            (mean, square, bend) = (mean + x[1], square + x[1] * x[1], bend + x[0] * x[0] * x[1]);
        });
        let [mean, square, bend] = [mean, square, bend].map(|sum| sum / 100_000.0);
        assert!(mean.abs() < 0.05 && (square / variance - 1.0).abs() < 0.08, "{mean} {square}");
        // E x₁² x₂ = b (E x₁⁴ − 1)
        assert!((bend / (2.0 * BEND) - 1.0).abs() < 0.08, "{bend}");
    }

    #[test]
    fn match_finds_shares_of_two_modes() {
        let modes = |x: &DVector<f64>| {
            let [a, b] = [-3.0, 3.0].map(|middle| (-0.5 * (x[0] - middle).powi(2)).exp());
            Some((0.8 * a + 0.2 * b).ln())
        };
        let even = vec![component(1.0, &[-2.5], &[1.5]), component(1.0, &[2.5], &[1.5])];
        let mixture = Mixture::new(even).unwrap();
        let matched = (0..4).fold(mixture, |m, k| m.matched(&modes, 4000, k).unwrap());
        let first = &matched.components[0];
        assert!((first.share - 0.8).abs() < 0.03 && (first.centre[0] + 3.0).abs() < 0.05, "{first:?}");
        assert!(efficiency(&matched, modes) > 0.9);
    }

    #[test]
    fn mixture_is_not_matched_where_target_is_zero_at_all_draws() {
        assert!(along_banana().matched(&|_| None, 400, 1).is_none());
    }

    #[test]
    fn component_without_width_is_left_out() {
        let flat = component(1.0, &[0.0, 0.0], &[1.0, 1.0, 1.0, 1.0]);
        let round = component(1.0, &[0.0, 0.0], &[1.0, 0.0, 0.0, 1.0]);
        assert!(Mixture::new(vec![flat.clone()]).is_none());
        assert_eq!(Mixture::new(vec![flat, round]).unwrap().components.len(), 1);
    }
}

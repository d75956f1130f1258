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
/// Degrees of freedom: the target's tails are those of its Gaussian prior, nearly.
const FREEDOM: i32 = 20;
/// Effective draws for each coordinate that a component's moments before a match count as.
const KEPT: f64 = 5.0;
/// Draws that a component's share before a match counts as (Jeffreys).
const KEPT_SHARE: f64 = 0.5;
/// Independent random streams of a match.
const STREAMS: usize = 8;

/// One number of each component.
type Lanes = [f64; COMPONENTS];

/// Student distribution of a share of the mixture.
#[derive(Debug, Clone)]
pub struct Component {
    pub share: f64,
    pub centre: DVector<f64>,
    pub scale: DMatrix<f64>,
}

/// A mixture of [`COMPONENTS`] of them. What their densities need is stored by component innermost, so that one instruction serves
/// several.
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
        let (mut inverses, mut middles) =
            (vec![[0.0; COMPONENTS]; n * (n + 1) / 2], vec![[0.0; COMPONENTS]; n]);
        let mut heights = [0.0; COMPONENTS];
        for (k, (factor, component)) in factors.iter().zip(&components).enumerate() {
            let inverse = factor.solve_lower_triangular(&DMatrix::identity(n, n))?;
            let middle = &inverse * &component.centre;
            for i in 0..n {
                (0..=i).for_each(|j| inverses[i * (i + 1) / 2 + j][k] = inverse[(i, j)]);
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
                along.iter_mut().zip(row).for_each(|(along, f)| *along += f * x);
            }
            distances.iter_mut().zip(&along).for_each(|(sum, along)| *sum += along * along);
        }
        distances
    }

    /// Density of each component at these distances, up to a common constant.
    fn densities(&self, distances: &Lanes) -> Lanes {
        let mut power = FREEDOM + self.middles.len() as i32;
        let mut base: Lanes = distances.map(|d| (1.0 + d / f64::from(FREEDOM)).sqrt().recip());
        let mut densities = self.heights;
        while power > 0 {
            if power & 1 == 1 {
                densities.iter_mut().zip(&base).for_each(|(density, base)| *density *= base);
            }
            base.iter_mut().for_each(|base| *base *= *base);
            power >>= 1;
        }
        densities
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
        let standard = DVector::from_fn(n, |_, _| length * random.sample::<f64, _>(StandardNormal));
        let mut point = self.components[k].centre.clone();
        point.gemv(1.0, &self.factors[k], &standard, 1.0);
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
        // weight of each draw in each component's share and in its moments, where remote draws count less
        let shares = |draw: &Weighed| -> (Lanes, Lanes) {
            let distances = self.distances(&draw.z);
            let densities = self.densities(&distances);
            let sum = densities.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            let shares: Lanes = densities.map(|density| draw.weight * density / sum);
            let freedom = f64::from(FREEDOM);
            (shares, from_fn(|k| shares[k] * (freedom + n as f64) / (freedom + distances[k])))
        };
        let shared: Vec<(Lanes, Lanes)> = draws.iter().map(shares).collect();
        let effective = draws.iter().map(|d| d.weight * d.weight).sum::<f64>().recip();
        let component = |(k, before): (usize, &Component)| {
            let share: f64 = shared.iter().map(|(shares, _)| shares[k]).sum();
            let squares: f64 = shared.iter().map(|(shares, _)| shares[k] * shares[k]).sum();
            let own = share * share / squares.max(f64::MIN_POSITIVE);
            let trusted = own / (own + KEPT * n as f64);
            let sum: f64 = shared.iter().map(|(_, weights)| weights[k]).sum::<f64>().max(f64::MIN_POSITIVE);
            let weighed = || draws.iter().zip(&shared).map(|(draw, (_, weights))| (&draw.z, weights[k]));
            let mut centre = DVector::zeros(n);
            weighed().for_each(|(z, weight)| centre.axpy(weight / sum, z, 1.0));
            let mut scale = DMatrix::zeros(n, n);
            for (z, weight) in weighed() {
                let off = z - &centre;
                scale.ger(weight / share.max(f64::MIN_POSITIVE), &off, &off, 1.0);
            }
            Component {
                share: effective * share + KEPT_SHARE,
                centre: centre * trusted + &before.centre * (1.0 - trusted),
                scale: scale * trusted + &before.scale * (1.0 - trusted),
            }
        };
        Self::new(self.components.iter().enumerate().map(component).collect())
    }
}

//! Independence Metropolis sampler: proposals are drawn from one fixed distribution that covers the target, every ninth from around
//! the present point instead.
//!
//! Each accepted independent proposal is independent of the previous point; a random walk in as many dimensions needs hundreds of
//! steps for that. Where the distribution is too thin, such a chain stands still for long (Mengersen and Tweedie 1996, Annals of
//! Statistics 24, 101): so it is Student's, whose tails are long, and short steps lead away from what it hardly covers (a mixture of
//! kernels, Tierney 1994, Annals of Statistics 22, 1701).

use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rayon::prelude::*;

use super::ridge::Ridge;

/// Degrees of freedom of the proposals: along the ridge the target's tails are those of its prior, nearly.
const FREEDOM: f64 = 20.0;

/// Student's distribution in the coordinates of a ridge.
#[derive(Debug, Clone)]
pub struct Student {
    ridge: Ridge,
    centre: DVector<f64>,
    /// Lower factor of its scale matrix.
    factor: DMatrix<f64>,
    squares: ChiSquared<f64>,
}

/// Effective draws for each coordinate from which on their moments count alone.
const ENOUGH: f64 = 10.0;
/// Factor on the covariance that draws estimate, which are few in the tails.
const WIDENED: f64 = 1.3;

/// One proposal of so many is a step from the present point.
const LOCAL: usize = 9;
/// Its length along each coordinate, times the root of their number (Roberts, Gelman and Gilks 1997, Annals of Applied Probability 7,
/// 110).
const LOCAL_STEP: f64 = 2.38;

/// A point, and the coordinates in which the proposals are standard.
#[derive(Clone)]
struct ProposedPoint {
    z: DVector<f64>,
    standard: DVector<f64>,
    /// Logarithms of the proposals' density in these coordinates and of the volume there, each up to a constant.
    log_density: f64,
    log_volume: f64,
}

impl ProposedPoint {
    /// What is added to the logarithm of the target's density in the ratio of acceptance: the volume, and for a point drawn by itself
    /// the density of the proposals, which is the same both ways for a step.
    fn log_weight(&self, local: bool) -> f64 {
        self.log_volume - if local { 0.0 } else { self.log_density }
    }
}

impl Student {
    /// Standard in the coordinates of a ridge.
    pub fn along(ridge: Ridge) -> Option<Self> {
        let n = ridge.dimensions();
        Self::new(ridge, DVector::zeros(n), DMatrix::identity(n, n))
    }

    /// Around a point of these coordinates, with a scale matrix; `None` if that is not positive definite.
    pub fn new(ridge: Ridge, centre: DVector<f64>, scale: DMatrix<f64>) -> Option<Self> {
        let squares = ChiSquared::new(FREEDOM).ok()?;
        Some(Self { ridge, centre, factor: scale.cholesky()?.unpack(), squares })
    }

    /// The same with the moments of the target as `count` draws weighed by importance estimate them; weights are truncated (Ionides
    /// 2008, Journal of Computational and Graphical Statistics 17, 295). `None` if the density is zero at all of them.
    pub fn matched<T>(
        &self,
        target: &(impl Fn(&DVector<f64>) -> Option<(f64, T)> + Sync),
        count: usize,
        seed: u64,
    ) -> Option<Self> {
        let draw = |k: usize| {
            let mut random = StdRng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9).wrapping_add(k as u64));
            let point = self.draw(1.0, &mut random)?;
            let (height, _) = target(&point.z)?;
            Some((self.coordinates(&point.standard), height + point.log_weight(false)))
        };
        let drawn: Vec<(DVector<f64>, f64)> = (0..count).into_par_iter().filter_map(draw).collect();
        let most = drawn.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
        let mean = drawn.iter().map(|(_, log)| (log - most).exp()).sum::<f64>() / count as f64;
        let weigh = |log: f64| ((log - most).exp() / mean).min((count as f64).sqrt());
        let sum: f64 = drawn.iter().map(|(_, log)| weigh(*log)).sum();
        let weighed = || drawn.iter().map(|(s, log)| (s, weigh(*log) / sum));
        let n = self.centre.len();
        let mean = weighed().fold(DVector::zeros(n), |sum, (s, share)| sum + s * share);
        let mut covariance = DMatrix::zeros(n, n);
        for (s, share) in weighed() {
            let off = s - &mean;
            covariance.ger(share, &off, &off, 1.0);
        }
        // moments count as far as the draws are worth enough samples for them
        let effective = weighed().map(|(_, share)| share * share).sum::<f64>().recip();
        let trusted = (effective / (ENOUGH * n as f64)).min(1.0);
        let before = &self.factor * self.factor.transpose();
        let skewness = |i: usize| {
            let cubes: f64 = weighed().map(|(s, share)| (s[i] - mean[i]).powi(3) * share).sum();
            trusted * cubes / covariance[(i, i)].powf(1.5)
        };
        let skewness: Vec<f64> = (0..n).map(skewness).collect();
        Self::new(
            self.ridge.clone().with_skewness(&skewness),
            mean * trusted + &self.centre * (1.0 - trusted),
            covariance * (WIDENED * trusted) + before * (1.0 - trusted),
        )
    }

    /// A point drawn with the scale times `width`; the density is that at width one.
    fn draw(&self, width: f64, random: &mut StdRng) -> Option<ProposedPoint> {
        let shrunk = (self.squares.sample(random) / FREEDOM).sqrt();
        let standard = DVector::from_fn(self.centre.len(), |_, _| {
            width * random.sample::<f64, _>(StandardNormal) / shrunk
        });
        self.point(standard)
    }

    /// A point drawn around another.
    fn draw_near(&self, from: &ProposedPoint, random: &mut StdRng) -> Option<ProposedPoint> {
        let length = LOCAL_STEP / (self.centre.len() as f64).sqrt();
        self.point(from.standard.map(|s| s + length * random.sample::<f64, _>(StandardNormal)))
    }

    /// Of the ridge, from those in which the proposals are standard.
    fn coordinates(&self, standard: &DVector<f64>) -> DVector<f64> {
        &self.centre + &self.factor * standard
    }

    fn point(&self, standard: DVector<f64>) -> Option<ProposedPoint> {
        let n = standard.len() as f64;
        let log_density = -0.5 * (FREEDOM + n) * (standard.norm_squared() / FREEDOM).ln_1p();
        let (z, log_volume) = self.ridge.point(&self.coordinates(&standard))?;
        Some(ProposedPoint { z, standard, log_density, log_volume })
    }
}

/// Logarithm of the target density with the data `T` of the point; `None` where the density is zero.
pub type LogDensity<'t, T> = dyn Fn(&DVector<f64>) -> Option<(f64, T)> + 't;

/// The present point of a chain; `T` is the target's data there.
pub struct Walker<T> {
    random: StdRng,
    point: ProposedPoint,
    /// Logarithm of the target density there.
    height: f64,
    at: T,
    accepted: usize,
    proposed: usize,
}

impl<T> Walker<T> {
    /// Starts from a point drawn at `width` times the proposals' scale; `None` if the density is zero at every try.
    pub fn start(
        proposals: &Student,
        width: f64,
        mut random: StdRng,
        target: &LogDensity<T>,
    ) -> Option<Self> {
        const TRIES: usize = 100;
        (0..TRIES).find_map(|_| {
            let point = proposals.draw(width, &mut random)?;
            let (height, at) = target(&point.z)?;
            Some(Self { random: random.clone(), point, height, at, accepted: 0, proposed: 0 })
        })
    }

    /// Makes `count` proposals and calls `see` with the point after each.
    pub fn go(
        &mut self,
        proposals: &Student,
        count: usize,
        target: &LogDensity<T>,
        see: &mut dyn FnMut(&T, &mut StdRng),
    ) {
        for k in self.proposed..self.proposed + count {
            let local = k % LOCAL == LOCAL - 1;
            let drawn = if local {
                proposals.draw_near(&self.point, &mut self.random)
            } else {
                proposals.draw(1.0, &mut self.random)
            };
            let lot = self.random.random_range(f64::MIN_POSITIVE..1.0).ln();
            if let Some(drawn) = drawn
                && let Some((height, at)) = target(&drawn.z)
                && height - self.height + drawn.log_weight(local) - self.point.log_weight(local) >= lot
            {
                (self.height, self.point, self.at) = (height, drawn, at);
                self.accepted += 1;
            }
            see(&self.at, &mut self.random);
        }
        self.proposed += count;
    }

    /// Accepted share of its proposals.
    pub fn acceptance(&self) -> f64 {
        self.accepted as f64 / self.proposed.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::bayes::sampling::Quality;

    /// A Gaussian of means 1 and −2, standard deviations 1 and 0.2, correlated by 0.9.
    fn target(x: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let (a, b, rho) = (x[0] - 1.0, (x[1] + 2.0) / 0.2, 0.9);
        Some((-0.5 * (a * a - 2.0 * rho * a * b + b * b) / (1.0 - rho * rho), x.clone()))
    }

    /// Coordinates that do not bend.
    fn straight(dimensions: usize) -> Ridge {
        let identity = DMatrix::identity(dimensions, dimensions);
        Ridge::new(DVector::zeros(dimensions), &identity, |_| Some(identity.clone())).unwrap()
    }

    #[test]
    fn gaussian_moments_are_recovered_with_offset_proposals() {
        let centre = DVector::from_vec(vec![0.6, -2.1]);
        let scale = DMatrix::from_row_slice(2, 2, &[1.3, 0.15, 0.15, 0.05]);
        let proposals = Student::new(straight(2), centre, scale).unwrap();
        let chain = |seed: u64| {
            let mut walker = Walker::start(&proposals, 2.0, StdRng::seed_from_u64(seed), &target).unwrap();
            let mut seen: Vec<DVector<f64>> = Vec::new();
            walker.go(&proposals, 10_000, &target, &mut |x, _| seen.push(x.clone()));
            (seen, walker.acceptance())
        };
        let (chains, acceptance): (Vec<_>, Vec<_>) = (0..4).map(chain).unzip();
        let all = || chains.iter().flatten();
        let mean = all().sum::<DVector<f64>>() / 40_000.0;
        let moment =
            |i: usize, j: usize| all().map(|x| (x[i] - mean[i]) * (x[j] - mean[j])).sum::<f64>() / 40_000.0;
        // worth some 7,000 independent samples: two and a half standard deviations of a mean are 0.03
        assert!((mean[0] - 1.0).abs() < 0.03 && (mean[1] + 2.0).abs() < 0.006, "{mean}");
        assert!((moment(0, 0) - 1.0).abs() < 0.05, "{}", moment(0, 0));
        assert!((moment(1, 1) / 0.04 - 1.0).abs() < 0.05, "{}", moment(1, 1));
        assert!((moment(0, 1) / 0.18 - 1.0).abs() < 0.05, "{}", moment(0, 1));
        let quantities: Vec<Vec<Vec<f64>>> =
            (0..2).map(|i| chains.iter().map(|c| c.iter().map(|x| x[i]).collect()).collect()).collect();
        let quality = Quality::of(acceptance.iter().sum::<f64>() / 4.0, &quantities).unwrap();
        assert!(quality.r_hat < 1.005 && quality.effective_bulk > 6000.0, "{quality:?}");
    }

    #[test]
    fn chain_never_visits_points_of_zero_density() {
        let above = |x: &DVector<f64>| (x[0] > 0.0).then(|| (-0.5 * x[0] * x[0], x[0]));
        let proposals = Student::along(straight(1)).unwrap();
        let mut walker = Walker::start(&proposals, 2.0, StdRng::seed_from_u64(1), &above).unwrap();
        let (mut sum, mut least) = (0.0, f64::INFINITY);
        walker.go(&proposals, 20_000, &above, &mut |x, _| {
            sum += x;
            least = least.min(*x);
        });
        // mean of half a Gaussian: √(2/π)
        assert!(least > 0.0 && (sum / 20_000.0 - 0.798).abs() < 0.03, "{}", sum / 20_000.0);
    }
}

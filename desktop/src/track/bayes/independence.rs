//! Independence Metropolis sampler: proposals are drawn from one fixed distribution that covers the target, every third from around
//! the present point instead.
//!
//! Each accepted independent proposal is independent of the previous point; a random walk in as many dimensions needs hundreds of
//! steps for that. Where the distribution is too thin, such a chain stands still for long (Mengersen and Tweedie 1996, Annals of
//! Statistics 24, 101): so it is Student's, whose tails are long, and short steps lead away from what it hardly covers (a mixture of
//! kernels, Tierney 1994, Annals of Statistics 22, 1701).

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand::rngs::StdRng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

/// Degrees of freedom of the proposals.
const FREEDOM: f64 = 8.0;

#[derive(Debug, Clone)]
pub struct Student {
    centre: DVector<f64>,
    /// Lower factor of its scale matrix.
    factor: DMatrix<f64>,
    squares: ChiSquared<f64>,
}

/// One proposal of so many is a step from the present point.
const LOCAL: usize = 3;
/// Its length along each coordinate, times the root of their number (Roberts, Gelman and Gilks 1997, Annals of Applied Probability 7,
/// 110).
const LOCAL_STEP: f64 = 2.38;

/// A point in the coordinates in which the proposals are standard, with the logarithm of their density up to a constant.
#[derive(Clone)]
struct ProposedPoint {
    standard: DVector<f64>,
    log_density: f64,
}

impl Student {
    /// Around a point, with a scale matrix; `None` if that is not positive definite.
    pub fn new(centre: DVector<f64>, scale: DMatrix<f64>) -> Option<Self> {
        let squares = ChiSquared::new(FREEDOM).ok()?;
        Some(Self { centre, factor: scale.cholesky()?.unpack(), squares })
    }

    /// A point drawn with the scale times `width`; the density is that at width one.
    fn draw(&self, width: f64, random: &mut StdRng) -> ProposedPoint {
        let shrunk = (self.squares.sample(random) / FREEDOM).sqrt();
        self.point(DVector::from_fn(self.centre.len(), |_, _| {
            width * random.sample::<f64, _>(StandardNormal) / shrunk
        }))
    }

    /// A point drawn around another.
    fn draw_near(&self, from: &ProposedPoint, random: &mut StdRng) -> ProposedPoint {
        let length = LOCAL_STEP / (self.centre.len() as f64).sqrt();
        self.point(from.standard.map(|s| s + length * random.sample::<f64, _>(StandardNormal)))
    }

    fn point(&self, standard: DVector<f64>) -> ProposedPoint {
        let n = standard.len() as f64;
        let log_density = -0.5 * (FREEDOM + n) * (standard.norm_squared() / FREEDOM).ln_1p();
        ProposedPoint { standard, log_density }
    }

    fn x(&self, point: &ProposedPoint) -> DVector<f64> {
        &self.centre + &self.factor * &point.standard
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
            let point = proposals.draw(width, &mut random);
            let (height, at) = target(&proposals.x(&point))?;
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
            // of the proposal densities there and back, which are equal for a step
            let log_ratio = if local { 0.0 } else { self.point.log_density - drawn.log_density };
            if let Some((height, at)) = target(&proposals.x(&drawn))
                && height - self.height + log_ratio >= lot
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
    use rand::SeedableRng;

    /// A Gaussian of means 1 and −2, standard deviations 1 and 0.2, correlated by 0.9.
    fn target(x: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let (a, b, rho) = (x[0] - 1.0, (x[1] + 2.0) / 0.2, 0.9);
        Some((-0.5 * (a * a - 2.0 * rho * a * b + b * b) / (1.0 - rho * rho), x.clone()))
    }

    #[test]
    fn gaussian_moments_are_recovered_with_offset_proposals() {
        let centre = DVector::from_vec(vec![0.6, -2.1]);
        let scale = DMatrix::from_row_slice(2, 2, &[1.3, 0.15, 0.15, 0.05]);
        let proposals = Student::new(centre, scale).unwrap();
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
        let proposals = Student::new(DVector::zeros(1), DMatrix::identity(1, 1)).unwrap();
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

//! Independence Metropolis sampler: proposals are drawn from one fixed mixture that covers the target.
//!
//! Each accepted proposal is independent of the previous point; a random walk in as many dimensions needs hundreds of steps for that.
//! Where the mixture is too thin, such a chain stands still for long (Mengersen and Tweedie 1996, Annals of Statistics 24, 101).

use nalgebra::DVector;
use rand::Rng;
use rand::rngs::StdRng;

use super::mixture::Mixture;

/// Logarithm of the target density with the data `T` of the point; `None` where the density is zero.
pub type LogDensity<'t, T> = dyn Fn(&DVector<f64>) -> Option<(f64, T)> + 't;

/// The present point of a chain; `T` is the target's data there.
pub struct Walker<T> {
    random: StdRng,
    /// Logarithm of the target density over that of the proposals.
    log_weight: f64,
    at: T,
    accepted: usize,
    proposed: usize,
}

impl<T> Walker<T> {
    /// Starts from a point drawn at `width` times the proposals' scale; `None` if the density is zero at every try.
    pub fn start(
        proposals: &Mixture,
        width: f64,
        mut random: StdRng,
        target: &LogDensity<T>,
    ) -> Option<Self> {
        const TRIES: usize = 100;
        let (log_weight, at) = (0..TRIES).find_map(|_| weighed(proposals, width, &mut random, target))?;
        Some(Self { random, log_weight, at, accepted: 0, proposed: 0 })
    }

    /// Makes `count` proposals and calls `see` with the point after each.
    pub fn go(
        &mut self,
        proposals: &Mixture,
        count: usize,
        target: &LogDensity<T>,
        see: &mut dyn FnMut(&T, &mut StdRng),
    ) {
        for _ in 0..count {
            let drawn = weighed(proposals, 1.0, &mut self.random, target);
            let lot = self.random.random_range(f64::MIN_POSITIVE..1.0).ln();
            if let Some((log_weight, at)) = drawn
                && log_weight - self.log_weight >= lot
            {
                (self.log_weight, self.at) = (log_weight, at);
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

/// Draws a point; `None` where the density is zero.
fn weighed<T>(
    proposals: &Mixture,
    width: f64,
    random: &mut StdRng,
    target: &LogDensity<T>,
) -> Option<(f64, T)> {
    let z = proposals.draw(width, random);
    let (height, at) = target(&z)?;
    Some((height - proposals.log_density(&z), at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::bayes::mixture::Component;
    use crate::track::bayes::sampling::Quality;
    use nalgebra::DMatrix;
    use rand::SeedableRng;

    /// A Gaussian of means 1 and −2, standard deviations 1 and 0.2, correlated by 0.9.
    fn target(x: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let (a, b, rho) = (x[0] - 1.0, (x[1] + 2.0) / 0.2, 0.9);
        Some((-0.5 * (a * a - 2.0 * rho * a * b + b * b) / (1.0 - rho * rho), x.clone()))
    }

    /// Proposals of one component.
    fn student(centre: &[f64], scale: &[f64]) -> Mixture {
        let n = centre.len();
        let (centre, scale) = (DVector::from_column_slice(centre), DMatrix::from_row_slice(n, n, scale));
        Mixture::new(vec![Component { share: 1.0, centre, scale }]).unwrap()
    }

    #[test]
    fn gaussian_moments_are_recovered_with_offset_proposals() {
        let proposals = student(&[0.6, -2.1], &[1.3, 0.15, 0.15, 0.05]);
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
        let proposals = student(&[0.0], &[1.0]);
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

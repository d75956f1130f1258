//! Markov chains: the Metropolis sampler of Sensors 2024, 24, 8123, an adaptive one to hold beside it, and
//! how good their samples are.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand::rngs::StdRng;
use rand_distr::StandardNormal;

/// Share of a chain that is thrown away at its beginning.
const BURN_IN: f64 = 0.25;
/// Optimal scale of a proposal's covariance is this over the number of dimensions (Roberts and others 1997).
const OPTIMAL: f64 = 2.38 * 2.38;

/// How proposals are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proposal {
    /// A random walk of one step size in all coordinates, adapted to the acceptance rate.
    Metropolis,
    /// A random walk with the covariance of what was sampled before (Haario and others 2001).
    AdaptiveMetropolis,
}

/// One sampler: its step, and what it has learned. Learning takes place between chains, so that each chain
/// keeps the target's distribution.
#[derive(Debug, Clone)]
pub struct Sampler {
    proposal: Proposal,
    step: f64,
    mean: DVector<f64>,
    outer: DMatrix<f64>,
    weight: f64,
}

/// Samples after burn-in.
#[derive(Debug, Clone)]
pub struct Chain {
    /// One row a sample.
    pub samples: Vec<DVector<f64>>,
    /// Share of all proposals that was accepted.
    pub acceptance: f64,
}

/// How good some chains are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Share of proposals accepted.
    pub acceptance: f64,
    /// Effective number of independent samples of the worst coordinate, all chains together.
    pub effective: f64,
    /// Potential scale reduction of the worst coordinate (split chains; 1 when they agree).
    pub r_hat: f64,
}

/// Acceptance that the step aims at, the optimum in many dimensions.
const AIM: f64 = 0.234;
/// Samples that what was learned counts for at most: older ones fade.
const MEMORY: f64 = 20_000.0;

impl Sampler {
    /// For so many coordinates, of about unit size.
    pub fn new(proposal: Proposal, dimensions: usize) -> Self {
        Self {
            proposal,
            step: (OPTIMAL / dimensions as f64).sqrt() * 0.3,
            mean: DVector::zeros(dimensions),
            outer: DMatrix::identity(dimensions, dimensions),
            weight: 1.0,
        }
    }

    /// A chain of `proposals` from a start; `log_density` is minus infinity where there is nothing.
    pub fn chain(
        &self,
        start: &DVector<f64>,
        proposals: usize,
        random: &mut StdRng,
        log_density: &mut dyn FnMut(&DVector<f64>) -> f64,
    ) -> Chain {
        let n = start.len();
        let factor = match self.proposal {
            Proposal::Metropolis => None,
            Proposal::AdaptiveMetropolis => (&self.outer / self.weight + DMatrix::identity(n, n) * 1e-6)
                .cholesky()
                .map(|c| c.l() * (OPTIMAL / n as f64).sqrt()),
        };
        let mut at = start.clone();
        let mut here = log_density(&at);
        let mut accepted = 0;
        let mut samples = Vec::with_capacity(proposals);
        for _ in 0..proposals {
            let normal = DVector::from_fn(n, |_, _| random.sample::<f64, _>(StandardNormal));
            let to = match &factor {
                Some(factor) => &at + factor * normal * self.step,
                None => &at + normal * self.step,
            };
            let there = log_density(&to);
            if there - here >= random.random_range(f64::MIN_POSITIVE..1.0).ln() {
                (at, here) = (to, there);
                accepted += 1;
            }
            samples.push(at.clone());
        }
        samples.drain(..(proposals as f64 * BURN_IN) as usize);
        Chain { samples, acceptance: f64::from(accepted) / proposals.max(1) as f64 }
    }

    /// Learns from chains: the step from their acceptance, the covariance from their samples around their
    /// own mean.
    pub fn learn(&mut self, chains: &[Chain]) {
        let acceptance = chains.iter().map(|c| c.acceptance).sum::<f64>() / chains.len().max(1) as f64;
        self.step *= ((acceptance - AIM) * 1.5).exp();
        if self.proposal == Proposal::Metropolis {
            return;
        }
        let all = || chains.iter().flat_map(|c| &c.samples);
        let count = all().count() as f64;
        self.mean = all().fold(DVector::zeros(self.mean.len()), |sum, s| sum + s) / count;
        let fade = (MEMORY / (self.weight + count)).min(1.0);
        self.outer *= fade;
        self.weight = (self.weight + count) * fade;
        for s in all() {
            let d = s - &self.mean;
            self.outer.ger(1.0, &d, &d, 1.0);
        }
    }
}

/// Mean of all samples.
pub fn mean(chains: &[Chain]) -> DVector<f64> {
    let all = || chains.iter().flat_map(|c| &c.samples);
    let zero = DVector::zeros(chains[0].samples[0].len());
    all().fold(zero, |sum, s| sum + s) / all().count() as f64
}

/// Quality of chains of equal length (Gelman and others 2013, section 11).
pub fn quality(chains: &[Chain]) -> Quality {
    let acceptance = chains.iter().map(|c| c.acceptance).sum::<f64>() / chains.len() as f64;
    let dimensions = chains[0].samples[0].len();
    let (mut effective, mut r_hat) = (f64::INFINITY, 1.0_f64);
    for k in 0..dimensions {
        let coordinate: Vec<Vec<f64>> =
            chains.iter().map(|c| c.samples.iter().map(|s| s[k]).collect()).collect();
        let (e, r) = of_coordinate(&coordinate);
        (effective, r_hat) = (effective.min(e), r_hat.max(r));
    }
    Quality { acceptance, effective, r_hat }
}

/// Effective number of samples (Geyer's initial positive sequence) and split R-hat.
fn of_coordinate(chains: &[Vec<f64>]) -> (f64, f64) {
    let halves: Vec<&[f64]> = chains.iter().flat_map(|c| c[..c.len() / 2 * 2].chunks(c.len() / 2)).collect();
    let n = halves[0].len() as f64;
    let mean = |c: &[f64]| c.iter().sum::<f64>() / c.len() as f64;
    let means: Vec<f64> = halves.iter().map(|c| mean(c)).collect();
    let grand = mean(&means);
    let between = n * means.iter().map(|m| (m - grand).powi(2)).sum::<f64>() / (means.len() as f64 - 1.0);
    let squares = |c: &[f64], m: f64| c.iter().map(|x| (x - m).powi(2)).sum::<f64>() / (n - 1.0);
    let within = halves.iter().zip(&means).map(|(c, m)| squares(c, *m)).sum::<f64>() / means.len() as f64;
    if within <= 0.0 {
        return (halves.len() as f64, f64::INFINITY);
    }
    let pooled = (n - 1.0) / n * within + between / n;
    let correlation = |lag: usize| {
        let one = |c: &&[f64]| {
            (lag..c.len()).map(|t| (c[t] - c[t - lag]).powi(2)).sum::<f64>() / (c.len() - lag) as f64
        };
        1.0 - halves.iter().map(one).sum::<f64>() / halves.len() as f64 / (2.0 * pooled)
    };
    let mut sum = 0.0;
    let mut lag = 1;
    while lag + 1 < halves[0].len() {
        let pair = correlation(lag) + correlation(lag + 1);
        if pair < 0.0 {
            break;
        }
        sum += pair;
        lag += 2;
    }
    let total = n * halves.len() as f64;
    ((total / (1.0 + 2.0 * sum)).min(total), (pooled / within).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// A Gaussian, correlated by 0.9, of standard deviations 1 and 0.2.
    fn density(x: &DVector<f64>) -> f64 {
        let (a, b, rho) = (x[0], x[1] / 0.2, 0.9);
        -0.5 * (a * a - 2.0 * rho * a * b + b * b) / (1.0 - rho * rho)
    }

    fn run(proposal: Proposal) -> Vec<Chain> {
        let mut random = StdRng::seed_from_u64(7);
        let mut sampler = Sampler::new(proposal, 2);
        let mut chains = Vec::new();
        for _ in 0..20 {
            chains = (0..4)
                .map(|_| sampler.chain(&DVector::zeros(2), 4000, &mut random, &mut |x| density(x)))
                .collect();
            sampler.learn(&chains);
        }
        chains
    }

    #[test]
    fn both_samplers_reach_the_moments_of_a_known_gaussian() {
        for proposal in [Proposal::Metropolis, Proposal::AdaptiveMetropolis] {
            let chains = run(proposal);
            let mean = mean(&chains);
            let all = || chains.iter().flat_map(|c| &c.samples);
            let moment = |i: usize, j: usize| {
                all().map(|s| (s[i] - mean[i]) * (s[j] - mean[j])).sum::<f64>() / all().count() as f64
            };
            assert!(mean[0].abs() < 0.15 && mean[1].abs() < 0.03, "{proposal:?} {mean}");
            assert!((moment(0, 0) - 1.0).abs() < 0.2, "{proposal:?} {}", moment(0, 0));
            assert!((moment(1, 1) / 0.04 - 1.0).abs() < 0.2, "{proposal:?}");
            assert!((moment(0, 1) / 0.18 - 1.0).abs() < 0.2, "{proposal:?}");
            assert!(quality(&chains).r_hat < 1.05, "{proposal:?} {:?}", quality(&chains));
        }
    }

    #[test]
    fn what_was_learned_makes_more_of_as_many_proposals() {
        let [plain, adaptive] =
            [Proposal::Metropolis, Proposal::AdaptiveMetropolis].map(|p| quality(&run(p)).effective);
        assert!(adaptive > 1.5 * plain, "{adaptive} {plain}");
    }

    #[test]
    fn independent_samples_are_all_effective_and_chains_apart_are_told() {
        let mut random = StdRng::seed_from_u64(1);
        let mut chain = |at: f64| Chain {
            samples: (0..1000)
                .map(|_| DVector::from_element(1, at + random.sample::<f64, _>(StandardNormal)))
                .collect(),
            acceptance: 1.0,
        };
        let good = quality(&[chain(0.0), chain(0.0)]);
        assert!(good.effective > 1500.0 && good.r_hat < 1.01, "{good:?}");
        assert!(quality(&[chain(0.0), chain(3.0)]).r_hat > 1.5);
    }
}

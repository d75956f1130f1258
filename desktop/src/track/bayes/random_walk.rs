//! Random-walk Metropolis: the sampler of Sensors 2024, 24, 8123, and an adaptive one for comparison.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand::rngs::StdRng;
use rand_distr::StandardNormal;

use super::sampling::Quality;

/// Share of a chain that is discarded as burn-in.
const BURN_IN: f64 = 0.25;
/// Optimal scale of a proposal's covariance is this over the number of dimensions (Roberts and others 1997).
const OPTIMAL: f64 = 2.38 * 2.38;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proposal {
    /// A random walk of one step size in all coordinates, adapted to the acceptance rate.
    Metropolis,
    /// A random walk with the covariance of earlier samples (Haario and others 2001).
    AdaptiveMetropolis,
}

/// Step size and learned covariance. Adaptation takes place between chains, so each chain keeps the target's
/// distribution.
#[derive(Debug, Clone)]
pub struct MetropolisSampler {
    proposal: Proposal,
    step: f64,
    mean: DVector<f64>,
    outer: DMatrix<f64>,
    weight: f64,
}

/// Samples after burn-in.
#[derive(Debug, Clone)]
pub struct MarkovChain {
    pub samples: Vec<DVector<f64>>,
    /// Share of all proposals that was accepted.
    pub acceptance: f64,
}

/// Acceptance that the step aims at, the optimum in many dimensions.
const AIM: f64 = 0.234;
/// Largest weight of the learned covariance, in samples; older ones fade.
const MEMORY: f64 = 20_000.0;

impl MetropolisSampler {
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

    /// A chain of `proposals` from a start; `log_density` is minus infinity where the density is zero.
    pub fn chain(
        &self,
        start: &DVector<f64>,
        proposals: usize,
        random: &mut StdRng,
        log_density: &mut dyn FnMut(&DVector<f64>) -> f64,
    ) -> MarkovChain {
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
        MarkovChain { samples, acceptance: f64::from(accepted) / proposals.max(1) as f64 }
    }

    /// Learns from chains: the step from their acceptance, the covariance from their samples around their
    /// own mean.
    pub fn learn(&mut self, chains: &[MarkovChain]) {
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

pub fn mean(chains: &[MarkovChain]) -> DVector<f64> {
    let all = || chains.iter().flat_map(|c| &c.samples);
    let zero = DVector::zeros(chains[0].samples[0].len());
    all().fold(zero, |sum, s| sum + s) / all().count() as f64
}

/// Quality of chains of equal length, by their worst coordinate.
pub fn quality(chains: &[MarkovChain]) -> Option<Quality> {
    let acceptance = chains.iter().map(|c| c.acceptance).sum::<f64>() / chains.len() as f64;
    let coordinate = |k: usize| chains.iter().map(|c| c.samples.iter().map(|s| s[k]).collect()).collect();
    let coordinates: Vec<Vec<Vec<f64>>> =
        (0..chains.first()?.samples.first()?.len()).map(coordinate).collect();
    Quality::of(acceptance, &coordinates)
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

    fn run(proposal: Proposal) -> Vec<MarkovChain> {
        let mut random = StdRng::seed_from_u64(7);
        let mut sampler = MetropolisSampler::new(proposal, 2);
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
    fn both_samplers_reach_moments_of_known_gaussian() {
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
            let quality = quality(&chains).unwrap();
            assert!(quality.r_hat < 1.05, "{proposal:?} {quality:?}");
        }
    }

    #[test]
    fn adaptive_metropolis_has_larger_effective_sample_size() {
        let [plain, adaptive] = [Proposal::Metropolis, Proposal::AdaptiveMetropolis]
            .map(|p| quality(&run(p)).unwrap().effective_bulk);
        assert!(adaptive > 1.5 * plain, "{adaptive} {plain}");
    }
}

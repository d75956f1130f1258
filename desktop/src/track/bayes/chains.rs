//! Chains for one target from dispersed starts, run until they converge.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand::rngs::StdRng;
use rayon::prelude::*;

use super::independence::Walker;
use super::marginal::{BearingGaussian, ConditionalUnbalance, Marginal};
use super::mixture::Mixture;
use super::sampling::{PosteriorSample, Quality};

/// Independent chains, and the width of their starts relative to the proposals.
pub const CHAINS: usize = 4;
const DISPERSED: f64 = 2.0;
/// Share of a chain that is discarded as burn-in.
const BURN_IN: f64 = 0.1;
/// Convergence criteria: largest R-hat and least effective sample size (Vehtari and others 2021, section 4). Eight halves of chains
/// that are worth 400 samples together differ by chance alone as an R-hat of 1.01 does, one of a dozen quantities by more.
const AGREED: f64 = 1.02;
const ENOUGH: f64 = 400.0;
/// Bounds of the growth of chains from one test of convergence to the next.
const LEAST_GROWTH: f64 = 1.2;
const MOST_GROWTH: f64 = 2.0;
/// Most rounds with each proposal distribution: after the first it is matched to the target by more draws.
const ROUNDS: [usize; 3] = [4, 4, 8];
/// Samples beyond those that the first ones promise to be enough: an effective size is itself an estimate.
const MARGIN: f64 = 1.2;
/// Draws by which the proposals are matched to the target, once and again, before the chains start.
const MATCHING: [usize; 2] = [400; 2];
/// Draws by which they are matched once more if the chains do not agree.
const MATCHING_AGAIN: usize = 1600;

/// Samples of all chains, and their convergence.
pub struct PosteriorSamples {
    pub samples: Vec<PosteriorSample>,
    pub quality: Quality,
}

impl PosteriorSamples {
    /// Mean and covariance of the sampled bearings.
    pub fn bearings(&self) -> BearingGaussian {
        let size = self.samples.first().map_or(0, |s| s.logs.len());
        let count = self.samples.len() as f64;
        let mut mean = vec![0.0; size];
        for s in &self.samples {
            mean.iter_mut().zip(&s.logs).for_each(|(sum, log)| *sum += log / count);
        }
        let mut covariance = DMatrix::zeros(size, size);
        let mut off = DVector::zeros(size);
        for s in &self.samples {
            off.iter_mut().zip(&s.logs).zip(&mean).for_each(|((off, log), mean)| *off = log - mean);
            covariance.ger(1.0 / count, &off, &off, 1.0);
        }
        BearingGaussian { logs: mean, covariance }
    }
}

/// A chain and its samples.
struct SampledChain {
    walker: Walker<ConditionalUnbalance>,
    samples: Vec<PosteriorSample>,
}

/// Samples a target with `proposals` of each chain a round. `None` if the machine is singular everywhere.
pub fn draw(target: &Marginal, proposals: usize, seed: u64) -> Option<PosteriorSamples> {
    let mut mixture = target.proposals(seed)?;
    let density = |z: &DVector<f64>| Some(target.log_density(z)?.0);
    for (k, draws) in MATCHING.into_iter().enumerate() {
        mixture = mixture.matched(&density, draws, seed.wrapping_add(k as u64)).unwrap_or(mixture);
    }
    for (renewal, rounds) in ROUNDS.into_iter().enumerate() {
        let seed = seed.wrapping_mul(0x9e37_79b9).wrapping_add(renewal as u64);
        let found = with_proposals(target, &mixture, proposals, rounds, seed)?;
        if renewal + 1 == ROUNDS.len() || agreed(&found.quality) {
            return Some(found);
        }
        mixture = mixture.matched(&density, MATCHING_AGAIN, seed).unwrap_or(mixture);
    }
    None
}

fn agreed(quality: &Quality) -> bool {
    quality.r_hat <= AGREED && quality.effective_bulk.min(quality.effective_tail) >= ENOUGH
}

/// Factor on the length of chains of this quality after which they promise to agree: effective samples grow with the length, and the
/// excess of R-hat over one shrinks with it.
fn growth(quality: &Quality) -> f64 {
    let effective = quality.effective_bulk.min(quality.effective_tail);
    let excess = (quality.r_hat - 1.0) / (AGREED - 1.0);
    (MARGIN * excess.max(ENOUGH / effective.max(1.0))).clamp(LEAST_GROWTH, MOST_GROWTH)
}

/// Chains with proposals of one distribution, run for as long as the first round promises to take.
fn with_proposals(
    target: &Marginal,
    mixture: &Mixture,
    proposals: usize,
    most_rounds: usize,
    seed: u64,
) -> Option<PosteriorSamples> {
    let density = |z: &DVector<f64>| target.log_density(z);
    let start = |chain: u64| {
        let random = StdRng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9).wrapping_add(chain));
        let walker = Walker::start(mixture, DISPERSED, random, &density)?;
        Some(SampledChain { walker, samples: Vec::new() })
    };
    let mut chains: Vec<SampledChain> = (0..CHAINS as u64).map(start).collect::<Option<_>>()?;
    let burn_in = (BURN_IN * proposals as f64) as usize;
    let most = most_rounds * proposals;
    let (mut made, mut wanted) = (0, proposals);
    let quality = loop {
        let left_out = if made == 0 { burn_in } else { 0 };
        chains.par_iter_mut().for_each(|SampledChain { walker, samples }| {
            walker.go(mixture, wanted - made, &density, &mut |given, random| {
                samples
                    .push(PosteriorSample { logs: given.logs.clone(), unbalance_kg_m: given.draw(random) });
            });
            samples.drain(..left_out);
        });
        made = wanted;
        let acceptance = chains.iter().map(|c| c.walker.acceptance()).sum::<f64>() / CHAINS as f64;
        let quality = Quality::of(acceptance, &quantities(&chains))?;
        if agreed(&quality) || made == most {
            break quality;
        }
        wanted = ((made as f64 * growth(&quality)) as usize).min(most);
    };
    let samples = chains.into_iter().flat_map(|c| c.samples).collect();
    Some(PosteriorSamples { samples, quality })
}

/// Sampled quantities: logarithms of the bearings, then real and imaginary part of each plane's unbalance.
fn quantities(chains: &[SampledChain]) -> Vec<Vec<Vec<f64>>> {
    let of = |value: &dyn Fn(&PosteriorSample) -> f64| -> Vec<Vec<f64>> {
        chains.iter().map(|c| c.samples.iter().map(value).collect()).collect()
    };
    let first = chains.iter().find_map(|c| c.samples.first());
    let planes = chains.iter().flat_map(|c| c.samples.first()).map(|s| s.unbalance_kg_m.len()).min();
    let bearings = (0..first.map_or(0, |s| s.logs.len())).map(|i| of(&|s| s.logs[i]));
    let unbalance = (0..planes.unwrap_or(0))
        .flat_map(|j| [of(&|s| s.unbalance_kg_m[j].re), of(&|s| s.unbalance_kg_m[j].im)]);
    bearings.chain(unbalance).collect()
}

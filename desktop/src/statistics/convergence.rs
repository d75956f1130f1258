//! Have Markov chains met, and how many independent samples are they worth? Rank-normalised split R-hat and effective
//! sample sizes of bulk and tails (Vehtari, Gelman, Simpson, Carpenter and Bürkner 2021, Bayesian Analysis 16, 667;
//! equations in that paper's numbers).

use nalgebra::DVectorView;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// Offsets of the ranks before they become normal scores (equation 14).
const RANK_OFFSET: [f64; 2] = [0.375, 0.25];
/// Quantiles whose own effective sample size is that of the tails (section 4.3).
const TAILS: [f64; 2] = [0.05, 0.95];
/// Fewest samples of a chain: half of it has to have a variance and two lags.
const FEWEST: usize = 8;

/// How good some chains are for one quantity, or for the worst of several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Potential scale reduction: of ranks or of folded ranks, whichever is larger; 1 when the chains agree.
    pub r_hat: f64,
    /// Independent samples that a mean or a median is worth.
    pub effective_bulk: f64,
    /// Independent samples that the ends of a 90 % interval are worth.
    pub effective_tail: f64,
}

impl Convergence {
    /// The worst of several quantities, each in chains of one and the same length: one row a chain. Not a number
    /// where a chain has fewer than eight samples; `None` without a quantity.
    pub fn worst(quantities: &[Vec<Vec<f64>>]) -> Option<Self> {
        let scores = Scores::new(quantities.first()?.iter().map(|c| c.len() / 2 * 2).sum());
        quantities.par_iter().map(|chains| Self::by_scores(chains, &scores)).reduce_with(Self::or_worse)
    }

    fn by_scores(chains: &[Vec<f64>], scores: &Scores) -> Self {
        // halves of equal length: of an odd chain the last sample does not count
        let length = chains.iter().map(Vec::len).min().unwrap_or(0) / 2 * 2;
        if length < FEWEST {
            return Self { r_hat: f64::NAN, effective_bulk: f64::NAN, effective_tail: f64::NAN };
        }
        let all: Vec<f64> = chains.iter().flat_map(|c| &c[..length]).copied().collect();
        let ascending = ordered(&all);
        let sorted = |rank: usize| ascending[rank].0;
        let median = 0.5 * (sorted((all.len() - 1) / 2) + sorted(all.len() / 2));
        let bulk = Moments::new(scores.of(&ascending), length);
        let spread = Moments::new(scores.of(&folded(&ascending, median)), length);
        let tail = |share: f64| {
            let end = quantile(&sorted, all.len(), share);
            let below = all.iter().map(|x| f64::from(u8::from(*x <= end))).collect();
            Moments::new(below, length).effective()
        };
        let [low, high] = TAILS.map(tail);
        Self {
            r_hat: bulk.r_hat().max(spread.r_hat()),
            effective_bulk: bulk.effective(),
            effective_tail: low.min(high),
        }
    }

    fn or_worse(self, other: Self) -> Self {
        Self {
            r_hat: self.r_hat.max(other.r_hat),
            effective_bulk: self.effective_bulk.min(other.effective_bulk),
            effective_tail: self.effective_tail.min(other.effective_tail),
        }
    }
}

/// Values in ascending order, each with its place.
fn ordered(values: &[f64]) -> Vec<(f64, usize)> {
    let mut all: Vec<(f64, usize)> = values.iter().copied().enumerate().map(|(i, x)| (x, i)).collect();
    all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// Distances of ordered values from their median, ordered themselves: what lies below it and what lies above are in order already.
fn folded(ascending: &[(f64, usize)], median: f64) -> Vec<(f64, usize)> {
    let above = ascending.partition_point(|(x, _)| *x < median);
    let distance = |(x, place): &(f64, usize)| ((x - median).abs(), *place);
    let (below, above) = ascending.split_at(above);
    let (mut below, mut above) =
        (below.iter().rev().map(distance).peekable(), above.iter().map(distance).peekable());
    let next = || match (below.peek(), above.peek()) {
        (Some(a), Some(b)) if a.0 > b.0 => above.next(),
        (Some(_), _) => below.next(),
        _ => above.next(),
    };
    std::iter::from_fn(next).collect()
}

/// Value below which a share of the sorted samples lies, straight lines between them.
fn quantile(sorted: &dyn Fn(usize) -> f64, count: usize, share: f64) -> f64 {
    let at = share * (count - 1) as f64;
    let below = at.floor() as usize;
    let above = (below + 1).min(count - 1);
    sorted(below) + (at - below as f64) * (sorted(above) - sorted(below))
}

/// Normal scores of all ranks that so many samples can have, those of ties between two ranks included.
struct Scores(Vec<f64>);

impl Scores {
    fn new(samples: usize) -> Self {
        let normal = Normal::standard();
        let score = |doubled: usize| {
            let [up, beside] = RANK_OFFSET;
            normal.inverse_cdf((0.5 * doubled as f64 - up) / (samples as f64 + beside))
        };
        Self((2..=2 * samples).map(score).collect())
    }

    /// The scores of ordered values, in the places where they were; equal values share their mean rank.
    fn of(&self, ordered: &[(f64, usize)]) -> Vec<f64> {
        let mut scores = vec![0.0; ordered.len()];
        let mut first = 0;
        for tied in ordered.chunk_by(|a, b| a.0 == b.0) {
            // twice the mean of the ranks first + 1 … first + n
            let doubled = 2 * first + tied.len() + 1;
            tied.iter().for_each(|(_, i)| scores[*i] = self.0[doubled - 2]);
            first += tied.len();
        }
        scores
    }
}

/// Chains cut in halves: what is within them and between them.
struct Moments {
    halves: Vec<Vec<f64>>,
    /// Mean variance within a half, and the pooled variance of the quantity (equation 3).
    within: f64,
    pooled: f64,
}

impl Moments {
    /// Of chains that lie one after the other.
    fn new(all: Vec<f64>, length: usize) -> Self {
        let half = length / 2;
        let mut halves: Vec<Vec<f64>> = all.chunks(half).map(<[f64]>::to_vec).collect();
        let (n, count) = (half as f64, halves.len() as f64);
        let means: Vec<f64> = halves.iter().map(|h| h.iter().sum::<f64>() / n).collect();
        for (h, mean) in halves.iter_mut().zip(&means) {
            h.iter_mut().for_each(|x| *x -= mean);
        }
        let grand = means.iter().sum::<f64>() / count;
        let between = means.iter().map(|m| (m - grand).powi(2)).sum::<f64>() / (count - 1.0);
        let squares: f64 = halves.iter().flatten().map(|x| x * x).sum();
        let within = squares / (n - 1.0) / count;
        Self { halves, within, pooled: (n - 1.0) / n * within + between }
    }

    /// Equation 4.
    fn r_hat(&self) -> f64 {
        if self.within > 0.0 { (self.pooled / self.within).sqrt() } else { f64::INFINITY }
    }

    /// Correlation of samples so far apart, all halves together (equation 10).
    fn correlation(&self, lag: usize) -> f64 {
        let n = self.halves[0].len();
        let products = |h: &Vec<f64>| {
            DVectorView::from_slice(&h[..n - lag], n - lag).dot(&DVectorView::from_slice(&h[lag..], n - lag))
        };
        let covariance = self.halves.iter().map(products).sum::<f64>() / (n * self.halves.len()) as f64;
        1.0 - (self.within - covariance) / self.pooled
    }

    /// Effective number of samples: Geyer's initial monotone sequence of pairs of correlations (section 3.2).
    fn effective(&self) -> f64 {
        let n = self.halves[0].len();
        let total = (n * self.halves.len()) as f64;
        if self.within <= 0.0 {
            // chains that stand still are worth one sample each at best
            return self.halves.len() as f64 / 2.0;
        }
        let (mut least, mut sum, mut even) = (f64::INFINITY, 0.0, 1.0);
        let mut lag = 0;
        while lag + 1 < n {
            even = if lag == 0 { 1.0 } else { self.correlation(lag) };
            let pair = even + self.correlation(lag + 1);
            if pair < 0.0 {
                break;
            }
            least = pair.min(least);
            sum += least;
            (even, lag) = (0.0, lag + 2);
        }
        // what a pair that was cut off begins with still counts, if it is positive
        let time = 2.0 * sum - 1.0 + even.max(0.0);
        total / time.max(1.0 / total.log10())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;
    use serde_json::Value;

    /// Chains of an autoregression of first order around a level each, of unit variance.
    fn chains(levels: [f64; 4], rho: f64, length: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut random = StdRng::seed_from_u64(seed);
        let mut chain = |level: f64| {
            let mut at: f64 = random.sample(StandardNormal);
            let mut next = || {
                at = rho * at + (1.0 - rho * rho).sqrt() * random.sample::<f64, _>(StandardNormal);
                level + at
            };
            (0..length).map(|_| next()).collect()
        };
        levels.map(&mut chain).to_vec()
    }

    fn of(chains: &[Vec<f64>]) -> Convergence {
        Convergence::worst(&[chains.to_vec()]).unwrap()
    }

    /// The chains that `tests/reference/make_convergence_reference.py` gave to ArviZ.
    fn congruential(case: &Value) -> Vec<Vec<f64>> {
        let number = |key: &str| case[key].as_f64().unwrap();
        let (mut x, scale) = (case["seed"].as_u64().unwrap(), 10_f64.powf(number("decimals")));
        let mut chain = |level: &Value| {
            let mut a = 0.0;
            let mut next = || {
                x = 16_807 * x % 2_147_483_647;
                a = number("rho") * a + x as f64 / 2_147_483_647.0 - 0.5;
                ((level.as_f64().unwrap() + a) * scale).round() / scale
            };
            (0..number("length") as usize).map(|_| next()).collect()
        };
        case["levels"].as_array().unwrap().iter().map(&mut chain).collect()
    }

    #[test]
    fn figures_equal_those_of_arviz_also_with_ties() {
        let text = include_str!("../../tests/data/convergence/arviz.json");
        let cases: Vec<Value> = serde_json::from_str(text).unwrap();
        for case in &cases {
            let found = of(&congruential(case));
            let figures = [
                ("r_hat", found.r_hat),
                ("effective_bulk", found.effective_bulk),
                ("effective_tail", found.effective_tail),
            ];
            for (key, ours) in figures {
                let theirs = case[key].as_f64().unwrap();
                assert!((ours / theirs - 1.0).abs() < 1e-6, "seed {}, {key}: {ours} {theirs}", case["seed"]);
            }
        }
    }

    #[test]
    fn independent_samples_are_all_effective_in_bulk_and_tails() {
        let found = of(&chains([0.0; 4], 0.0, 5000, 1));
        assert!((found.effective_bulk / 20_000.0 - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.effective_tail / 20_000.0 - 1.0).abs() < 0.1, "{found:?}");
        assert!(found.r_hat < 1.001, "{found:?}");
    }

    #[test]
    fn an_autoregression_is_worth_its_closed_form() {
        for rho in [-0.3, 0.3, 0.8] {
            let found = of(&chains([0.0; 4], rho, 25_000, 2));
            let expected = 100_000.0 * (1.0 - rho) / (1.0 + rho);
            // scores of ranks of a Gaussian are the Gaussian itself
            assert!((found.effective_bulk / expected - 1.0).abs() < 0.1, "{rho}: {found:?} {expected}");
        }
    }

    #[test]
    fn chains_at_different_levels_and_of_different_spread_are_told() {
        let apart = of(&chains([0.0, 0.0, 0.0, 0.5], 0.0, 1000, 3));
        assert!(apart.r_hat > 1.01 && apart.effective_bulk < 400.0, "{apart:?}");
        let mut wide = chains([0.0; 4], 0.0, 1000, 4);
        assert!(of(&wide).r_hat < 1.01);
        wide[0].iter_mut().for_each(|x| *x *= 3.0);
        let wide = of(&wide);
        assert!(wide.r_hat > 1.01, "the folded ranks see a spread: {wide:?}");
    }

    #[test]
    fn rank_diagnostics_ignore_monotone_maps_and_heavy_tails() {
        let plain = chains([0.0; 4], 0.5, 500, 5);
        let bent: Vec<Vec<f64>> = plain.iter().map(|c| c.iter().map(|x| x.exp()).collect()).collect();
        let (plain, bent) = (of(&plain), of(&bent));
        assert!((plain.effective_bulk - bent.effective_bulk).abs() < 1e-9, "{plain:?} {bent:?}");
        let cauchy = |x: &f64| (std::f64::consts::PI * (x.sin() * 1e4).fract() * 0.499).tan();
        let cauchy: Vec<Vec<f64>> =
            chains([0.0; 4], 0.0, 1000, 6).iter().map(|c| c.iter().map(cauchy).collect()).collect();
        assert!(of(&cauchy).r_hat < 1.01);
    }

    #[test]
    fn worst_quantity_is_reported_and_constant_chains_fail() {
        let (good, bad) = (chains([0.0; 4], 0.0, 400, 7), chains([0.0, 1.0, 0.0, 0.0], 0.9, 400, 8));
        let worst = Convergence::worst(&[good.clone(), bad.clone()]).unwrap();
        assert_eq!(worst.r_hat, of(&bad).r_hat);
        assert!(worst.effective_bulk < of(&good).effective_bulk);
        let still = of(&[vec![1.0; 100], vec![2.0; 100]]);
        assert!(still.r_hat.is_infinite() && still.effective_bulk < 3.0, "{still:?}");
        assert!(of(&[vec![0.0; 4], vec![1.0; 4]]).r_hat.is_nan());
    }
}

//! Bayes factor of an event at every epoch and of every scope, from one backward pass.
//!
//! With `r` and `N` of the smoother at an epoch's prediction, a shock `δ` there changes the record's log
//! likelihood by `rᵀδ − ½ δᵀNδ` (de Jong and Penzer 1998, "Diagnosing shocks in time series"). Of a shock with
//! covariance `D` that leaves, on average over all shocks, `½ bᵀ(1 + M)⁻¹b − ½ ln det(1 + M)` with
//! `M = D^½ N D^½` and `b = D^½ r`: the logarithm of a Bayes factor.
//!
//! A Bayes factor is one on average where there is no event, and so is the mean of any number of them, however
//! they depend on each other: the mean exceeds `1/p` in at most a share `p` of records (Vovk and Wang 2021,
//! "E-values: calibration, combination and applications", and Markov's inequality). This corrects for the number of days and scopes tried.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::kalman::BackwardPass;
use super::scope::Scope;
use super::state::Layout;
use crate::track::answer::Interval;

/// False-alarm probability for a record.
const CHANCE: f64 = 0.01;
/// Share of the probability that an interval of days leaves out at either end.
const TAIL: f64 = 0.025;

/// Logarithms of the Bayes factors, by epoch and by scope in the order of [`Scope::ALL`]; empty where no event is possible.
pub struct Scan {
    gains: Vec<Vec<f64>>,
}

impl Scan {
    /// From the backward pass at each epoch's prediction, for epochs in a range.
    pub fn new(layout: &Layout, later: &[BackwardPass], epochs: &Range<usize>) -> Self {
        let jumps = Scope::ALL.map(|scope| layout.jump(scope));
        let of = |(k, later): (usize, &BackwardPass)| {
            let possible = k > 0 && epochs.contains(&k);
            jumps.iter().filter(|_| possible).map(|jump| gain(later, jump)).collect()
        };
        Self { gains: later.par_iter().enumerate().map(of).collect() }
    }

    /// The most probable epoch, and the gain of the best scope there.
    pub fn best(&self) -> Option<(usize, f64)> {
        let all =
            self.gains.iter().enumerate().flat_map(|(k, gains)| gains.iter().map(move |gain| (k, *gain)));
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Logarithm of the mean Bayes factor of all trials at `epochs`; `of_best` is the exact logarithm for the best.
    pub fn evidence(&self, of_best: f64, epochs: usize) -> f64 {
        let best = self.best().map_or(0.0, |b| b.1);
        let sum: f64 = self.gains.iter().flatten().map(|gain| (gain - best).exp()).sum();
        of_best + sum.ln() - ((epochs * Scope::ALL.len()) as f64).ln()
    }

    /// Central interval of the epoch over all scopes, with a uniform prior.
    pub fn epochs(&self) -> Option<(usize, usize)> {
        let best = self.best()?.1;
        let weight = |gains: &Vec<f64>| gains.iter().map(|gain| (gain - best).exp()).sum::<f64>();
        let weights: Vec<f64> = self.gains.iter().map(weight).collect();
        let total: f64 = weights.iter().sum();
        let reached = |share: f64| {
            let mut sum = 0.0;
            weights.iter().position(|w| {
                sum += w;
                sum >= share * total
            })
        };
        Some((reached(TAIL)?, reached(1.0 - TAIL)?))
    }
}

/// Whether the evidence is enough for an event.
pub fn is_enough(evidence: f64) -> bool {
    evidence >= -CHANCE.ln()
}

/// Days of a range of epochs.
pub fn days(time_d: impl Fn(usize) -> f64, epochs: (usize, usize)) -> Interval {
    Interval { low: time_d(epochs.0), high: time_d(epochs.1) }
}

/// Logarithm of the Bayes factor of a shock to these components with these variances.
fn gain(later: &BackwardPass, jump: &[(usize, f64)]) -> f64 {
    let sd: Vec<f64> = jump.iter().map(|(_, variance)| variance.sqrt()).collect();
    let score = DVector::from_fn(jump.len(), |i, _| sd[i] * later.score[jump[i].0]);
    let spread = DMatrix::from_fn(jump.len(), jump.len(), |i, j| {
        let own = if i == j { 1.0 } else { 0.0 };
        own + sd[i] * later.information[(jump[i].0, jump[j].0)] * sd[j]
    });
    let Some(factor) = spread.cholesky() else { return f64::NEG_INFINITY };
    let log_det = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    0.5 * (score.dot(&factor.solve(&score)) - log_det)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::joint::kalman::{FilterStep, Gaussian, Innovation, Transition, later};

    /// Log likelihood of a random walk, one of whose steps is a shock of this variance as well, and what is later than
    /// each of its predictions.
    fn walk(measured: &[f64], shock: Option<(usize, f64)>) -> (f64, Vec<BackwardPass>) {
        let one = |v: f64| DMatrix::from_element(1, 1, v);
        let (mut at, mut log_likelihood) = (Gaussian { mean: DVector::zeros(1), covariance: one(4.0) }, 0.0);
        let (mut visits, mut steps) = (Vec::new(), Vec::new());
        for (k, y) in measured.iter().enumerate() {
            if k > 0 {
                let more = shock.filter(|(at, _)| *at == k).map_or(0.0, |(_, variance)| variance);
                let step = Transition {
                    keep: DVector::from_element(1, 1.0),
                    reach: Vec::new(),
                    noise: one(0.1 + more),
                };
                at = at.predicted(&step);
                steps.push(step);
            }
            let predicted = at.clone();
            let left = DVector::from_element(1, y - at.mean[0]);
            let innovation = Innovation::new(&at, one(1.0), &left, &DVector::from_element(1, 0.2)).unwrap();
            log_likelihood -= 0.5 * (innovation.squared + innovation.log_det);
            at = innovation.update(&at);
            visits.push(FilterStep { seen: vec![innovation], predicted, filtered: at.clone() });
        }
        let later = later(&visits, &steps);
        (log_likelihood, later)
    }

    #[test]
    fn shock_gain_equals_likelihood_gain_of_filter_with_shock() {
        let measured = [0.3, -0.2, 0.1, 2.4, 2.1, 2.6];
        let (without, later) = walk(&measured, None);
        for k in 1..measured.len() {
            let with = walk(&measured, Some((k, 3.0))).0;
            assert!((gain(&later[k], &[(0, 3.0)]) - (with - without)).abs() < 1e-10, "{k}");
        }
    }

    #[test]
    fn evidence_corrects_for_number_of_trials() {
        let epochs = 1000;
        let mut gains = vec![vec![0.0; Scope::ALL.len()]; epochs];
        gains[500][1] = 10.0;
        let scan = Scan { gains };
        assert_eq!(scan.best().map(|b| b.0), Some(500));
        // e^10 among eight thousand tries is worth no more than four times nothing
        assert!(!is_enough(scan.evidence(10.0, epochs)));
        assert!(is_enough(scan.evidence(20.0, epochs)));
    }

    #[test]
    fn epoch_interval_covers_likely_neighbours() {
        let mut gains = vec![vec![-50.0; Scope::ALL.len()]; 100];
        (gains[40][0], gains[41][0], gains[42][0]) = (19.0, 20.0, 19.5);
        assert_eq!(Scan { gains }.epochs(), Some((40, 42)));
    }
}

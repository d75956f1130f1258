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
use super::state::{Layout, Shock};
use crate::track::answer::Interval;

/// False-alarm probability for a record.
const CHANCE: f64 = 0.01;
/// Share of the probability that an interval of days leaves out at either end.
const TAIL: f64 = 0.025;

/// Logarithms of the Bayes factors, by epoch and by scope; empty where no event is possible.
pub struct Scan {
    scopes: Vec<Scope>,
    gains: Vec<Vec<f64>>,
}

impl Scan {
    /// From the backward pass at each epoch's prediction, for epochs in a range, of a machine with so many bearings.
    pub fn new(layout: &Layout, bearings: usize, later: &[BackwardPass], epochs: &Range<usize>) -> Self {
        let scopes = Scope::all(bearings, layout.probes);
        let jumps: Vec<Vec<Shock>> = scopes.iter().map(|scope| layout.jump(*scope)).collect();
        let of = |(k, later): (usize, &BackwardPass)| {
            let possible = k > 0 && epochs.contains(&k);
            jumps.iter().filter(|_| possible).map(|jump| gain(later, jump)).collect()
        };
        Self { gains: later.par_iter().enumerate().map(of).collect(), scopes }
    }

    /// The same for some scopes alone; the others count as tried in vain.
    pub fn only(mut self, is_meant: impl Fn(Scope) -> bool) -> Self {
        for gains in &mut self.gains {
            for (gain, scope) in gains.iter_mut().zip(&self.scopes) {
                *gain = if is_meant(*scope) { *gain } else { f64::NEG_INFINITY };
            }
        }
        self
    }

    /// The best scope of those for which this holds, at an epoch.
    pub fn best_scope(&self, epoch: usize, is_meant: impl Fn(Scope) -> bool) -> Option<Scope> {
        let all = self.scopes.iter().zip(self.gains.get(epoch)?).filter(|(scope, _)| is_meant(**scope));
        all.max_by(|a, b| a.1.total_cmp(b.1)).map(|(scope, _)| *scope)
    }

    /// Whether the log Bayes factor of a scope is at least half the best scope's at an epoch. A scope below that is not linearised on its own.
    pub fn is_promising(&self, epoch: usize, scope: Scope) -> bool {
        let Some(gains) = self.gains.get(epoch) else { return false };
        let best = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        self.scopes.iter().zip(gains).any(|(s, gain)| *s == scope && *gain >= 0.5 * best)
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
        of_best + sum.ln() - ((epochs * self.scopes.len()) as f64).ln()
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

/// Logarithm of the Bayes factor of independent shocks.
fn gain(later: &BackwardPass, jump: &[Shock]) -> f64 {
    let score =
        DVector::from_fn(jump.len(), |i, _| jump[i].iter().map(|(at, sd)| sd * later.score[*at]).sum());
    let spread = DMatrix::from_fn(jump.len(), jump.len(), |i, j| {
        let own = if i == j { 1.0 } else { 0.0 };
        let pairs = jump[i].iter().flat_map(|a| jump[j].iter().map(move |b| (a, b)));
        own + pairs.map(|((k, a), (l, b))| a * later.information[(*k, *l)] * b).sum::<f64>()
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
                    shift: DVector::zeros(1),
                    noise: one(0.1 + more),
                };
                at = at.predicted(&step);
                steps.push(step);
            }
            let predicted = at.clone();
            let left = DVector::from_element(1, y - at.mean[0]);
            let innovation = Innovation::new(&at, &one(1.0), &left, &DVector::from_element(1, 0.2)).unwrap();
            log_likelihood -= 0.5 * (innovation.squared + innovation.log_det);
            at = innovation.update(&at);
            visits.push(FilterStep { seen: vec![innovation], predicted });
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
            assert!((gain(&later[k], &[vec![(0, 3.0_f64.sqrt())]]) - (with - without)).abs() < 1e-10, "{k}");
        }
    }

    #[test]
    fn evidence_corrects_for_number_of_trials() {
        let epochs = 1000;
        let scopes = Scope::all(2, 4);
        let mut gains = vec![vec![0.0; scopes.len()]; epochs];
        gains[500][1] = 10.0;
        let scan = Scan { scopes, gains };
        assert_eq!(scan.best().map(|b| b.0), Some(500));
        // e^10 among thirteen thousand tries is worth no more than four times nothing
        assert!(!is_enough(scan.evidence(10.0, epochs)));
        assert!(is_enough(scan.evidence(20.0, epochs)));
    }

    #[test]
    fn epoch_interval_covers_likely_neighbours() {
        let scopes = Scope::all(2, 4);
        let mut gains = vec![vec![-50.0; scopes.len()]; 100];
        (gains[40][0], gains[41][0], gains[42][0]) = (19.0, 20.0, 19.5);
        assert_eq!(Scan { scopes, gains }.epochs(), Some((40, 42)));
    }
}

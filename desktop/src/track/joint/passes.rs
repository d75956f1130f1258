//! The record as the filter sees it, and runs of filter and smoother along it.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::kalman::{Gaussian, Innovation, Later, Step, Visit, later};
use super::motion::Motion;
use super::scope::Change;
use super::state::{Layout, Linear};
use crate::machine::drawing::Noise;
use crate::track::operating_point::Logs;
use crate::track::record::Day;

/// Chance that a reading of a machine without an event is called impossible.
const CHANCE: f64 = 1e-6;
/// Rounds over which states settle around their own answer at most, and the change of the likelihood's
/// logarithm below which they have settled: little against what an event has to be worth.
const ROUNDS: usize = 10;
const SETTLED: f64 = 0.5;
/// Rounds over which the wander alone settles.
const WANDER_ROUNDS: usize = 3;

/// All readings of one time.
pub struct Epoch {
    pub time_d: f64,
    /// The record's own reading, if there is one.
    pub own: Option<Day>,
    /// Run-ups of that time.
    pub beside: Vec<Day>,
}

impl Epoch {
    /// The record's own reading first.
    fn all(&self) -> impl Iterator<Item = &Day> {
        self.own.iter().chain(&self.beside)
    }
}

/// The record as the filter sees it.
pub struct Problem {
    pub layout: Layout,
    pub noise: Noise,
    /// Days between readings, as a rule.
    pub pace_d: f64,
    pub epochs: Vec<Epoch>,
    pub guess: Logs,
    /// Epochs from which on the machine is described anew, by a later run-up.
    pub described: Vec<usize>,
}

/// A run of the filter, and the states around which its readings are linearised.
pub type Settled = (Pass, Vec<DVector<f64>>);

/// One run of the filter.
pub struct Pass {
    pub visits: Vec<Visit>,
    pub steps: Vec<Step>,
    pub log_likelihood: f64,
    pub impossible: Vec<bool>,
}

impl Pass {
    /// What is later than each epoch's prediction.
    pub fn later(&self) -> Vec<Later> {
        later(&self.visits, &self.steps)
    }

    pub fn smoothed(&self, later: &[Later]) -> Vec<Gaussian> {
        self.visits.par_iter().zip(later).map(|(v, l)| v.predicted.smoothed(l)).collect()
    }

    pub fn smoothed_means(&self, later: &[Later]) -> Vec<DVector<f64>> {
        let mean = |(v, l): (&Visit, &Later)| &v.predicted.mean + &v.predicted.covariance * &l.score;
        self.visits.iter().zip(later).map(mean).collect()
    }
}

impl Problem {
    /// The filter along the record, linearised around these states.
    pub fn filter(
        &self,
        motion: &Motion,
        changes: &[Change],
        linearised_at: &[DVector<f64>],
    ) -> Option<Pass> {
        self.filter_of(&self.layout, motion, changes, linearised_at, None)
    }

    /// The same of a layout, where it may be given which of the record's readings are left out, not found.
    pub fn filter_of(
        &self,
        layout: &Layout,
        motion: &Motion,
        changes: &[Change],
        linearised_at: &[DVector<f64>],
        left_out: Option<&[bool]>,
    ) -> Option<Pass> {
        let around = |(epoch, point): (&Epoch, &DVector<f64>)| -> Option<Vec<Linear>> {
            epoch.all().map(|day| layout.linear(day, point, &self.noise)).collect()
        };
        let linear: Vec<Vec<Linear>> =
            self.epochs.par_iter().zip(linearised_at).map(around).collect::<Option<_>>()?;
        let mut at = layout.start(&self.guess, motion);
        let mut pass =
            Pass { visits: Vec::new(), steps: Vec::new(), log_likelihood: 0.0, impossible: Vec::new() };
        for (k, (epoch, readings)) in self.epochs.iter().zip(linear).enumerate() {
            if k > 0 {
                let paces = (epoch.time_d - self.epochs[k - 1].time_d) / self.pace_d;
                let scope = changes.iter().find(|(at, _)| *at == k).map(|(_, scope)| *scope);
                let step = layout.step(paces, motion, scope, self.described.contains(&k));
                at = at.predicted(&step);
                pass.steps.push(step);
            }
            let (predicted, mut seen, mut impossible) = (at.clone(), Vec::new(), false);
            for (n, Linear { slope, left, variance }) in readings.into_iter().enumerate() {
                let left = left - &slope * (&at.mean - &linearised_at[k]);
                let innovation = Innovation::new(&at, slope, &left, &variance)?;
                let limit = impossible_from(variance.len());
                pass.log_likelihood -= 0.5 * (innovation.squared.min(limit) + innovation.log_det);
                let out = left_out.map_or(innovation.squared > limit, |out| out[k]);
                if out && n == 0 && epoch.own.is_some() {
                    impossible = true;
                } else {
                    let updated = innovation.update(&at);
                    seen.push((at, innovation));
                    at = updated;
                }
            }
            pass.impossible.push(impossible);
            pass.visits.push(Visit { predicted, seen, filtered: at.clone() });
        }
        Some(pass)
    }

    /// Filter and smoother, again and again around their own answer, `at_rest` or with its wander.
    pub fn settle(
        &self,
        motion: &Motion,
        changes: &[Change],
        linearised_at: &[DVector<f64>],
        at_rest: bool,
    ) -> Option<Settled> {
        let mut linearised_at = linearised_at.to_vec();
        let mut pass = self.filter(motion, changes, &linearised_at)?;
        for _ in 0..ROUNDS {
            let point = |x: DVector<f64>| if at_rest { self.layout.at_rest(x) } else { x };
            linearised_at = pass.smoothed_means(&pass.later()).into_iter().map(point).collect();
            let before = pass.log_likelihood;
            pass = self.filter(motion, changes, &linearised_at)?;
            if (pass.log_likelihood - before).abs() < SETTLED {
                break;
            }
        }
        Some((pass, linearised_at))
    }

    /// The wander of each epoch once more, with everything else as it was found: around its own answer, so
    /// that it need not be small for the features to be linear in it.
    pub fn wander_again(&self, motion: &Motion, pass: &Pass, states: &mut [Gaussian]) -> Option<()> {
        let (at, all) = (self.layout.wander(), self.layout.coefficients);
        let part = |m: &DMatrix<f64>| m.view((at, at), (all, all)).into_owned();
        let start = Gaussian { mean: DVector::zeros(all), covariance: motion.settled() };
        let own = |s: &Step| Step {
            keep: s.keep.rows(at, all).into_owned(),
            reach: Vec::new(),
            noise: part(&s.noise),
        };
        let steps: Vec<Step> = pass.steps.iter().map(own).collect();
        for _ in 0..WANDER_ROUNDS {
            let (mut now, mut visits) = (start.clone(), Vec::new());
            for (k, epoch) in self.epochs.iter().enumerate() {
                if k > 0 {
                    now = now.predicted(&steps[k - 1]);
                }
                let (predicted, mut seen) = (now.clone(), Vec::new());
                let point = &states[k].mean;
                for day in epoch.own.iter().filter(|_| !pass.impossible[k]).chain(&epoch.beside) {
                    let Linear { slope, left, variance } = self.layout.linear(day, point, &self.noise)?;
                    let slope = slope.columns(at, all).into_owned();
                    let left = left - &slope * (&now.mean - point.rows(at, all));
                    let innovation = Innovation::new(&now, slope, &left, &variance)?;
                    let updated = innovation.update(&now);
                    seen.push((now, innovation));
                    now = updated;
                }
                visits.push(Visit { predicted, seen, filtered: now.clone() });
            }
            let later = later(&visits, &steps);
            for ((state, visit), later) in states.iter_mut().zip(&visits).zip(&later) {
                let wander = &visit.predicted.mean + &visit.predicted.covariance * &later.score;
                state.mean.rows_mut(at, all).copy_from(&wander);
            }
        }
        Some(())
    }

    /// Epochs with a reading of the record.
    pub fn own(&self) -> impl Iterator<Item = (usize, &Day)> {
        self.epochs.iter().enumerate().filter_map(|(k, e)| Some((k, e.own.as_ref()?)))
    }
}

/// Squared innovation beyond which a reading of so many numbers is called impossible.
fn impossible_from(numbers: usize) -> f64 {
    ChiSquared::new(numbers as f64).map_or(f64::INFINITY, |c| c.inverse_cdf(1.0 - CHANCE))
}

//! The record as the filter sees it, and runs of filter and smoother along it.

use std::sync::{Arc, OnceLock};

use nalgebra::{Complex, DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::kalman::{BackwardPass, FilterStep, Gaussian, Innovation, Transition, later, smoothed_means};
use super::motion::ProcessModel;
use super::scope::{EventAt, Scope};
use super::state::{Layout, LinearReading};
use crate::machine::drawing::Noise;
use crate::track::coefficients::Logs;
use crate::track::conditions::Covariate;
use crate::track::record::Day;

type C = Complex<f64>;

/// Probability that a reading of a machine without an event is called an outlier.
const CHANCE: f64 = 1e-6;
/// Limits of readings of fewer numbers are kept.
const MOST_KNOWN: usize = 65;
/// Most rounds of relinearisation, and the change of the log likelihood at convergence, small against the evidence that
/// an event needs.
const ROUNDS: usize = 10;
const SETTLED: f64 = 0.5;
/// Rounds of relinearisation for the random walk alone.
const WALK_ROUNDS: usize = 3;

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

    /// Gives run-ups the conditions of the record's own reading.
    pub fn under_its_conditions(&mut self) {
        let own = self.own.as_ref().map_or_else(Vec::new, |day| day.conditions.clone());
        self.beside.iter_mut().for_each(|day| day.conditions.clone_from(&own));
    }
}

/// The record as the filter sees it.
pub struct JointProblem {
    pub layout: Layout,
    pub noise: Noise,
    /// Days between readings, as a rule.
    pub pace_d: f64,
    pub epochs: Vec<Epoch>,
    pub guess: Logs,
    /// Epochs at which a later run-up replaces the model of the machine.
    pub described: Vec<usize>,
    pub restarts: Vec<Restart>,
    /// Conditions of operation that bearings and unbalance may follow.
    pub covariates: Vec<Covariate>,
    /// Log evidence of each covariate's first effect, corrected for the number of trials.
    pub evidence: Vec<f64>,
    pub bearings: usize,
}

/// What a machine may be that is new after an outage.
pub struct Restart {
    /// The first epoch after the outage.
    pub epoch: usize,
    /// Prior means of the bearings and of the unbalance's coordinates.
    pub logs: Logs,
    pub coordinates: Vec<C>,
    /// Points to linearise around at first, from its epoch on.
    pub points: Vec<DVector<f64>>,
}

/// A run of the filter at convergence, and its linearisation points.
pub type ConvergedPass = (Pass, Vec<DVector<f64>>);

/// One run of the filter.
pub struct Pass {
    pub visits: Vec<FilterStep>,
    /// Between visits; equal ones are one.
    pub steps: Vec<Arc<Transition>>,
    pub log_likelihood: f64,
    pub impossible: Vec<bool>,
}

impl Pass {
    /// The backward pass at each epoch's prediction.
    pub fn later(&self) -> Vec<BackwardPass> {
        later(&self.visits, &self.steps)
    }

    pub fn smoothed(&self, later: &[BackwardPass]) -> Vec<Gaussian> {
        self.visits.par_iter().zip(later).map(|(v, l)| v.predicted.smoothed(l)).collect()
    }

    pub fn smoothed_means(&self) -> Vec<DVector<f64>> {
        smoothed_means(&self.visits, &self.steps)
    }
}

impl JointProblem {
    /// The restart at an epoch, if the scope is one.
    pub fn restart_at(&self, epoch: usize, scope: Scope) -> Option<&Restart> {
        self.restarts.iter().find(|r| scope.restart && r.epoch == epoch)
    }

    /// The filter along the record, linearised around these states.
    pub fn filter(
        &self,
        motion: &ProcessModel,
        changes: &[EventAt],
        linearised_at: &[DVector<f64>],
    ) -> Option<Pass> {
        self.filter_of(&self.layout, motion, changes, linearised_at, None)
    }

    /// The same with a given layout and, optionally, given outliers.
    pub fn filter_of(
        &self,
        layout: &Layout,
        motion: &ProcessModel,
        changes: &[EventAt],
        linearised_at: &[DVector<f64>],
        left_out: Option<&[bool]>,
    ) -> Option<Pass> {
        let around = |(epoch, point): (&Epoch, &DVector<f64>)| -> Option<Vec<LinearReading>> {
            epoch.all().map(|day| layout.linear(day, point, &self.noise)).collect()
        };
        let linear: Vec<Vec<LinearReading>> =
            self.epochs.par_iter().zip(linearised_at).map(around).collect::<Option<_>>()?;
        let mut at = layout.start(&self.guess, motion);
        let mut pass =
            Pass { visits: Vec::new(), steps: Vec::new(), log_likelihood: 0.0, impossible: Vec::new() };
        let mut usual: Option<(f64, Arc<Transition>)> = None;
        for (k, (epoch, readings)) in self.epochs.iter().zip(linear).enumerate() {
            if k > 0 {
                let paces = (epoch.time_d - self.epochs[k - 1].time_d) / self.pace_d;
                let scope = changes.iter().find(|(at, _)| *at == k).map(|(_, scope)| *scope);
                let described = self.described.contains(&k);
                let as_before =
                    usual.as_ref().filter(|(of, _)| *of == paces && scope.is_none() && !described);
                let step = match (as_before, scope.and_then(|scope| self.restart_at(k, scope))) {
                    (Some((_, step)), _) => step.clone(),
                    (_, Some(restart)) => {
                        Arc::new(layout.restart(&restart.logs, &restart.coordinates, motion))
                    }
                    _ => Arc::new(layout.step(paces, motion, scope, described)),
                };
                if scope.is_none() && !described {
                    usual = Some((paces, step.clone()));
                }
                at = at.predicted(&step);
                pass.steps.push(step);
            }
            let (predicted, mut seen, mut impossible) = (at.clone(), Vec::new(), false);
            for (n, LinearReading { slope, left, variance }) in readings.into_iter().enumerate() {
                let left = left - &slope * (&at.mean - &linearised_at[k]);
                let innovation = Innovation::new(&at, &slope, &left, &variance)?;
                let limit = impossible_from(variance.len());
                pass.log_likelihood -= 0.5 * (innovation.squared.min(limit) + innovation.log_det);
                let out = left_out.map_or(innovation.squared > limit, |out| out[k]);
                if out && n == 0 && epoch.own.is_some() {
                    impossible = true;
                } else {
                    at = innovation.update(&at);
                    seen.push(innovation);
                }
            }
            pass.impossible.push(impossible);
            pass.visits.push(FilterStep { predicted, seen });
        }
        Some(pass)
    }

    /// Log likelihoods of the record, linearised at rest and at the walk.
    pub fn likelihoods(
        &self,
        motion: &ProcessModel,
        changes: &[EventAt],
        linearised_at: &[DVector<f64>],
    ) -> Option<[f64; 2]> {
        let at_rest = self.filter(motion, changes, linearised_at)?.log_likelihood;
        Some([at_rest, self.converge(motion, changes, linearised_at, false)?.0.log_likelihood])
    }

    /// Filter and smoother, relinearised around the smoothed states until convergence; `at_rest` leaves the random walk out
    /// of the linearisation point.
    pub fn converge(
        &self,
        motion: &ProcessModel,
        changes: &[EventAt],
        linearised_at: &[DVector<f64>],
        at_rest: bool,
    ) -> Option<ConvergedPass> {
        let mut linearised_at = linearised_at.to_vec();
        let mut pass = self.filter(motion, changes, &linearised_at)?;
        for _ in 0..ROUNDS {
            let point = |x: DVector<f64>| if at_rest { self.layout.at_rest(x) } else { x };
            linearised_at = pass.smoothed_means().into_iter().map(point).collect();
            let before = pass.log_likelihood;
            // one at a time, as passes are most of the memory
            drop(pass);
            pass = self.filter(motion, changes, &linearised_at)?;
            if (pass.log_likelihood - before).abs() < SETTLED {
                break;
            }
        }
        Some((pass, linearised_at))
    }

    /// Smooths the random walk again with everything else fixed, relinearised around itself, so that it may be large.
    pub fn smooth_walk_again(
        &self,
        motion: &ProcessModel,
        pass: &Pass,
        states: &mut [Gaussian],
    ) -> Option<()> {
        let (at, all) = (self.layout.walk(), self.layout.coefficients());
        let part = |m: &DMatrix<f64>| m.view((at, at), (all, all)).into_owned();
        let start = Gaussian { mean: DVector::zeros(all), covariance: motion.settled() };
        let own = |s: &Arc<Transition>| Transition {
            keep: s.keep.rows(at, all).into_owned(),
            reach: Vec::new(),
            shift: s.shift.rows(at, all).into_owned(),
            noise: part(&s.noise),
        };
        let steps: Vec<Transition> = pass.steps.iter().map(own).collect();
        for _ in 0..WALK_ROUNDS {
            let (mut now, mut visits) = (start.clone(), Vec::new());
            for (k, epoch) in self.epochs.iter().enumerate() {
                if k > 0 {
                    now = now.predicted(&steps[k - 1]);
                }
                let (predicted, mut seen) = (now.clone(), Vec::new());
                let point = &states[k].mean;
                for day in epoch.own.iter().filter(|_| !pass.impossible[k]).chain(&epoch.beside) {
                    let LinearReading { slope, left, variance } =
                        self.layout.linear(day, point, &self.noise)?;
                    let slope = slope.columns(at, all).into_owned();
                    let left = left - &slope * (&now.mean - point.rows(at, all));
                    let innovation = Innovation::new(&now, &slope, &left, &variance)?;
                    now = innovation.update(&now);
                    seen.push(innovation);
                }
                visits.push(FilterStep { predicted, seen });
            }
            for (state, walk) in states.iter_mut().zip(smoothed_means(&visits, &steps)) {
                state.mean.rows_mut(at, all).copy_from(&walk);
            }
        }
        Some(())
    }

    /// Epochs with a reading of the record.
    pub fn own(&self) -> impl Iterator<Item = (usize, &Day)> {
        self.epochs.iter().enumerate().filter_map(|(k, e)| Some((k, e.own.as_ref()?)))
    }
}

/// Squared innovation above which a reading of so many numbers is an outlier.
pub(super) fn impossible_from(numbers: usize) -> f64 {
    // it is asked for every reading of every pass, and takes as long as a filter step
    static KNOWN: [OnceLock<f64>; MOST_KNOWN] = [const { OnceLock::new() }; MOST_KNOWN];
    let limit = || ChiSquared::new(numbers as f64).map_or(f64::INFINITY, |c| c.inverse_cdf(1.0 - CHANCE));
    KNOWN.get(numbers).map_or_else(limit, |known| *known.get_or_init(limit))
}

//! Method 4, ours: all days together.
//!
//! The bearings follow a mean-reverting random walk about constants; the unbalance drifts
//! smoothly; an event changes the constants of one bearing or several, the unbalance, or all of these. This is a
//! state-space model whose measurement is linear in the unbalance and nearly linear in the bearings. An iterated
//! extended Kalman filter and smoother solve it (`kalman`, `state`). Covariance and persistence of the random walk are
//! learned from the record by expectation and maximisation (Shumway and Stoffer 1982).
//!
//! One reading at one speed has fewer numbers than there are unknowns, on two bearings eight for twelve. Time resolves
//! them: a random walk of the bearings and a smooth drift of the unbalance change the features in different ways, a
//! run-up fixes the bearings of one day, and the unbalance changes little from day to day. Unknowns that stay open keep
//! their prior;
//! [`JointFindings::constants`] says which.
//!
//! Conditions of operation change bearings or unbalance where the evidence asks for it (`regression`).
//!
//! Events are steps of the features ([`super::step`]), three readings in a row that the filter finds impossible, or
//! shocks whose Bayes factor outweighs the number of trials (`scan`). Day and scope of an event are those of highest
//! likelihood; the filter runs for each scope. Scopes that are not ruled out widen the intervals. A single impossible
//! reading is left out as a disturbance.

mod absorbed;
mod advice;
mod answer;
mod branch;
mod conclude;
mod condition_effects;
mod coordinate;
mod estimates;
mod filter_states;
mod follower;
mod kalman;
mod learn;
mod motion;
mod passes;
mod regression;
mod regressor;
mod restart;
mod scan;
mod scope;
mod search;
mod state;

use nalgebra::{Complex, DVector};

pub use answer::{
    BearingEffect, ConditionEffect, ConstantPart, Event, JointFindings, LogChange, OtherEffect, PlaneEffect,
    SecondSpeed,
};
pub use follower::Follower;
pub use scope::{BearingSet, Instrument, Scope};

use super::answer::ReadingEstimate;
use super::coefficients::logs_of;
use super::daily::{TrackedRecord, Tracking};
use super::operating_point::FollowedMachine;
use super::record;
use crate::diagnose::{ImprovementStep as Added, improve};
use crate::error::{Error, TrackError};
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;
use conclude::SmoothedHistory;
use coordinate::{Coordinate, size};
use learn::Learning;
use passes::{Epoch, JointProblem};
use restart::Restarts;
use search::EventHistory;
use state::Layout;

type C = Complex<f64>;

/// A run-up after an event, and its day.
#[derive(Debug, Clone)]
pub struct LaterRunup<'a> {
    /// Days since the record began.
    pub time_d: f64,
    pub readings: &'a [Reading],
}

/// The most probable history of a record.
struct JointHistory {
    problem: JointProblem,
    found: SmoothedHistory,
    /// Effects that later run-ups showed, by label.
    effects: Vec<String>,
    /// The machine at the end, with these effects.
    now: Rotor,
}

impl Tracking<'_> {
    /// All days of the record together; `runup` is of the first day, `later` of days after an event.
    ///
    /// # Errors
    /// If the machine is singular on its bearings, or a later run-up cannot be diagnosed.
    pub fn joint(
        &self,
        record: &[Reading],
        runup: &[Reading],
        later: &[LaterRunup],
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<(TrackedRecord, JointFindings), Error> {
        let JointHistory { problem, found, effects, now } =
            self.joint_history(record, runup, later, progress)?;
        let (run, mut findings) = self.estimates(&problem, &found, effects);
        findings.second_speed = self.second_speed(&problem, &found, &now);
        Ok((run, findings))
    }

    /// The same, with a filter that goes on from the last reading, and without the advice of a second speed.
    ///
    /// # Errors
    /// As those of [`Self::joint`].
    pub fn joint_to_go_on(
        &self,
        record: &[Reading],
        runup: &[Reading],
        later: &[LaterRunup],
    ) -> Result<(TrackedRecord, JointFindings, Follower), Error> {
        let JointHistory { problem, found, effects, now } =
            self.joint_history(record, runup, later, &mut |_, _| ())?;
        let (run, findings) = self.estimates(&problem, &found, effects);
        let follower = Follower::new(self, &problem, &found, now)
            .ok_or(Error::SingularMachine { tried: "on the bearings of the record" })?;
        Ok((run, findings, follower))
    }

    fn joint_history(
        &self,
        record: &[Reading],
        runup: &[Reading],
        later: &[LaterRunup],
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<JointHistory, Error> {
        let mut start = self.adaptive(&mut |_, _| ()).estimates;
        let begun = self.phase_one.as_ref().map_or_else(|| self.rotor.clone(), |p| p.rotor.clone());
        let mut problem = self.problem(&begun, runup)?;
        let windows = self.steps(problem.own().map(|(k, _)| k));
        let Restarts { stated, parts } = self.restarts(record, &windows)?;
        let restarted: Vec<usize> = parts.iter().map(|part| part.epoch).collect();
        parts.into_iter().for_each(|part| part.replace_in(&mut start));
        let linearised_at = self.first_guess(&mut problem, &start);
        problem.add_restarts(&restarted, &logs_of(self.rotor), &linearised_at);
        let singular = || Error::SingularMachine { tried: "on the bearings of the record" };
        let mut learning = Learning::new(progress);
        let mut history = EventHistory::new(&problem, windows, &stated, linearised_at);
        problem.find_events(&mut history, &mut learning).ok_or_else(singular)?;
        if problem.find_regressors(&mut history, &mut learning).ok_or_else(singular)? {
            // a step of a condition may have been taken for an event
            problem.find_events(&mut history, &mut learning).ok_or_else(singular)?;
        }
        let (mut effects, mut now) = (Vec::new(), begun.clone());
        for l in later {
            // days before the event are described without the effect, so that it can be nowhere else
            history.other_part = None;
            let since = history.hold(problem.bearings, |k| problem.epochs[k].time_d <= l.time_d);
            let since = since.ok_or(TrackError::NoEventBefore { time_d: l.time_d })?;
            let found = improve(&begun, l.readings, |_: &Added| ())?;
            effects.extend(found.steps.iter().map(|s| s.added.label()));
            self.describe_anew(&mut problem, &mut history.linearised_at, &found.rotor, since, l)?;
            now = found.rotor;
        }
        if !later.is_empty() {
            problem.find_events(&mut history, &mut learning).ok_or_else(singular)?;
        }
        let found = problem.conclude(history, &mut learning).ok_or_else(singular)?;
        Ok(JointHistory { problem, found, effects, now })
    }

    fn problem(&self, begun: &Rotor, runup: &[Reading]) -> Result<JointProblem, Error> {
        let own = self.days.iter().map(|d| Epoch { time_d: d.time_d, own: Some(d.clone()), beside: vec![] });
        let mut epochs: Vec<Epoch> = own.collect();
        epochs[0].beside = record::days(begun, &self.noise, runup)?;
        epochs[0].under_its_conditions();
        let mut gaps: Vec<f64> = epochs.windows(2).map(|w| w[1].time_d - w[0].time_d).collect();
        gaps.retain(|g| *g > 0.0);
        gaps.sort_by(f64::total_cmp);
        let begin = |start: &C| Coordinate::new(*start, &[], start.norm());
        Ok(JointProblem {
            layout: Layout {
                planes: self.unbalance_kg_m.iter().map(begin).collect(),
                positions_m: self.rotor.plane_positions_m(),
                numbers: self.numbers.clone(),
                regressors: Vec::new(),
                probes: self.rotor.probe.len(),
                has_factors: true,
            },
            noise: self.noise,
            pace_d: gaps.get(gaps.len() / 2).copied().unwrap_or(1.0),
            epochs,
            // without a run-up phase I's bearings are little more than the file's: the prior is the file's
            guess: if runup.is_empty() { logs_of(self.rotor) } else { self.logs.clone() },
            described: Vec::new(),
            restarts: Vec::new(),
            covariates: self.covariates.clone(),
            evidence: Vec::new(),
            bearings: self.rotor.bearing.len(),
        })
    }

    /// States to linearise around at first, the bearings of these estimates and their unbalance smoothed; and by that the
    /// coordinates in which the unbalance drifts.
    fn first_guess(&self, problem: &mut JointProblem, all: &[ReadingEstimate]) -> Vec<DVector<f64>> {
        const BESIDE: usize = 7;
        let index = |epoch: &Epoch| all.partition_point(|e| e.time_d < epoch.time_d).min(all.len() - 1);
        let mean = |k: usize, j: usize| {
            let near = &all[k.saturating_sub(BESIDE)..(k + BESIDE + 1).min(all.len())];
            let same: Vec<&ReadingEstimate> = near.iter().filter(|e| e.logs == all[k].logs).collect();
            same.iter().map(|e| e.unbalance_kg_m[j]).sum::<C>() / same.len() as f64
        };
        let planes = 0..self.unbalance_kg_m.len();
        let path = |j: usize| problem.epochs.iter().map(|e| mean(index(e), j)).collect::<Vec<C>>();
        let paths: Vec<Vec<C>> = planes.map(path).collect();
        let largest = paths.iter().map(|p| size(p)).fold(0.0, f64::max);
        let starts = self.unbalance_kg_m.iter().zip(&paths);
        problem.layout.planes = starts.map(|(u, path)| Coordinate::new(*u, path, largest)).collect();
        let mut coordinates = vec![C::from(0.0); paths.len()];
        let of = |(k, epoch): (usize, &Epoch)| {
            for (j, z) in coordinates.iter_mut().enumerate() {
                *z = problem.layout.planes[j].of(paths[j][k], *z);
            }
            problem.layout.at(&all[index(epoch)].logs, &coordinates)
        };
        problem.epochs.iter().enumerate().map(of).collect()
    }

    /// Puts a model with other effects under the days from an epoch on, and a run-up beside its day.
    fn describe_anew(
        &self,
        problem: &mut JointProblem,
        linearised_at: &mut [DVector<f64>],
        rotor: &Rotor,
        since: usize,
        later: &LaterRunup,
    ) -> Result<(), Error> {
        let machine = FollowedMachine::of(rotor);
        let logs = logs_of(rotor);
        problem.described.push(since);
        for (epoch, point) in problem.epochs.iter_mut().zip(linearised_at).skip(since) {
            if let Some(day) = &mut epoch.own {
                day.point = machine.at(day.speed_rad_s)?.with_weights(&day.weights_kg_m);
            }
            let planes = 0..problem.layout.planes.len();
            let coordinates: Vec<C> = planes.map(|j| problem.layout.coordinate(point, j)).collect();
            *point = problem.layout.at_like(point, &logs, &coordinates);
        }
        let distance = |e: &Epoch| (e.time_d - later.time_d).abs();
        let epochs = &mut problem.epochs[since..];
        if let Some(near) = epochs.iter_mut().min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            near.beside.extend(record::days(rotor, &self.noise, later.readings)?);
            near.under_its_conditions();
        }
        Ok(())
    }
}

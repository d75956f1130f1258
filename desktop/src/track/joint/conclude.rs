//! The most probable history, with the explanations that are not ruled out.

use nalgebra::Complex;
use rayon::prelude::*;

use super::answer::Event;
use super::branch::Branch;
use super::kalman::Gaussian;
use super::learn::{Learning, Until};
use super::motion::ProcessModel;
use super::passes::{JointProblem, Pass};
use super::regressor::OtherPart;
use super::scan::days;
use super::scope::{EventAt, Instrument};
use super::search::{AssumedEvent, EventHistory, PossibleHistory, Rival};
use super::state::MarginalState;

type C = Complex<f64>;

pub struct SmoothedHistory {
    pub motion: ProcessModel,
    pub pass: Pass,
    pub smoothed: Vec<Gaussian>,
    pub rivals: Vec<RivalHistory>,
    /// States that the readings are linearised at.
    #[cfg(test)]
    pub linearised_at: Vec<nalgebra::DVector<f64>>,
    pub other_part: Option<OtherPart>,
    pub events: Vec<Event>,
    /// Events that may have taken place, with too little evidence to be claimed.
    pub possible: Vec<Event>,
    /// Epoch of each event.
    pub at: Vec<usize>,
    /// Whether expectation and maximisation converged.
    pub settled: bool,
}

/// Another explanation of the record.
pub struct RivalHistory {
    /// Its probability relative to the most probable history.
    pub weight: f64,
    /// Smoothed states, under the conditions of their days.
    pub states: Vec<MarginalState>,
    /// The filter at the end.
    pub end: Branch,
}

impl JointProblem {
    /// The most probable history with the converged process model.
    pub fn conclude(
        &mut self,
        mut history: EventHistory,
        learning: &mut Learning,
    ) -> Option<SmoothedHistory> {
        let other_part = history.other_part.take();
        let possible = history.possible.take();
        let less_likely = Self::take_likely(&mut history, possible);
        self.learn_from(&mut history, learning, Until::Settled)?;
        let changes = history.changes();
        let all_changes = changes.clone();
        let (pass, _linearised_at) =
            self.converge(&history.motion, &changes, &history.linearised_at, true)?;
        let mut smoothed = pass.smoothed(&pass.later());
        self.smooth_walk_again(&history.motion, &pass, &mut smoothed)?;
        let mut rivals = self.rivals(&history, &pass.impossible)?;
        history.events.sort_by_key(|e| e.change.0);
        let time_d = |k: usize| self.epochs[k].time_d;
        let event = |e: &AssumedEvent| Event {
            time_d: time_d(e.change.0),
            interval_d: days(time_d, e.interval),
            scope: e.change.1,
            evidence: e.evidence,
            stated: e.stated,
            factor: self.changed_factor(e.change, &smoothed),
        };
        let mut possible: Vec<Event> = history.events.iter().filter(|e| e.unclaimed).map(event).collect();
        history.events.retain(|e| !e.unclaimed);
        let events = history.events.iter().map(event).collect();
        if let Some(less) = less_likely {
            let mut changes = changes;
            changes.push(less.change);
            let pass = self.converge(&less.motion, &changes, &less.linearised_at, true)?.0;
            let smoothed = pass.smoothed(&pass.later());
            possible.push(Event {
                time_d: time_d(less.change.0),
                interval_d: days(time_d, less.interval),
                scope: less.change.1,
                evidence: less.evidence,
                stated: false,
                factor: self.changed_factor(less.change, &smoothed),
            });
            let end = self.branch(less.evidence.exp(), &less.motion, &pass, true)?;
            let states = (0..).zip(&smoothed).map(|(k, state)| self.marginal(k, state)).collect();
            rivals.push(RivalHistory { weight: end.weight, states, end });
        }
        if let Some(other) = &other_part {
            rivals.push(self.with_other_part(&all_changes, other)?);
        }
        Some(SmoothedHistory {
            other_part,
            events,
            possible,
            at: history.events.iter().map(|e| e.change.0).collect(),
            settled: !learning.gave_up,
            motion: history.motion,
            pass,
            smoothed,
            rivals,
            #[cfg(test)]
            linearised_at: _linearised_at,
        })
    }

    /// Factor of the instrument that an event changed, after it over before it; one of events in the machine.
    fn changed_factor(&self, (epoch, scope): EventAt, smoothed: &[Gaussian]) -> C {
        let of = |k: usize, p: usize| self.layout.factor(&smoothed[k].mean)[p];
        match scope.instrument {
            None => C::from(1.0),
            Some(Instrument::Gain(p)) => of(epoch, p) / of(epoch - 1, p),
            Some(Instrument::PhaseReference) => of(epoch, 0) / of(epoch - 1, 0),
        }
    }

    /// Takes an event that is more probable than not into the history, unclaimed; returns one that is less probable. Over a
    /// record an event is taken to be as probable as none, so that the mean Bayes factor is its odds.
    fn take_likely(history: &mut EventHistory, possible: Option<PossibleHistory>) -> Option<PossibleHistory> {
        let possible = possible?;
        if possible.evidence <= 0.0 {
            return Some(possible);
        }
        let (epoch, scope) = possible.change;
        history.events.push(AssumedEvent {
            unclaimed: true,
            evidence: possible.evidence,
            interval: possible.interval,
            rivals: vec![(Rival::Absent, -possible.evidence)],
            ..AssumedEvent::new(epoch, scope)
        });
        (history.motion, history.linearised_at) = (possible.motion, possible.linearised_at);
        None
    }

    /// Smoothed states under each other explanation of an event, with its relative probability.
    fn rivals(&self, history: &EventHistory, impossible: &[bool]) -> Option<Vec<RivalHistory>> {
        let of = |i: usize| history.events[i].rivals.iter().map(move |(rival, log)| (i, *rival, log.exp()));
        let all: Vec<(usize, Rival, f64)> = (0..history.events.len()).flat_map(of).collect();
        let one = |(i, rival, weight): (usize, Rival, f64)| {
            let mut changes = history.changes();
            let epoch = changes[i].0;
            let pass = match rival {
                Rival::Scope(scope) => {
                    changes[i].1 = scope;
                    let from = self.begin_with(scope, epoch, &history.linearised_at);
                    self.converge(&history.motion, &changes, &from, true)?.0
                }
                Rival::Absent => {
                    changes.remove(i);
                    self.converge(&history.motion, &changes, &history.linearised_at, true)?.0
                }
                Rival::Unexplained => {
                    changes.retain(|(at, _)| *at < epoch);
                    let unread: Vec<bool> =
                        (0..).zip(impossible).map(|(k, out)| k >= epoch || *out).collect();
                    let at = &history.linearised_at;
                    self.filter_of(&self.layout, &history.motion, &changes, at, Some(&unread))?
                }
            };
            let is_read = !matches!(rival, Rival::Unexplained);
            Some(RivalHistory {
                weight,
                states: self.marginals(&pass),
                end: self.branch(weight, &history.motion, &pass, is_read)?,
            })
        };
        all.into_par_iter().map(one).collect()
    }
}

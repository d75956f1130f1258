//! The filter carried on from the last reading of a record: one evaluation of the machine a reading and explanation.
//!
//! A new reading is linearised once, at the state predicted for it, without the random walk as all readings are
//! ([`Layout::at_rest`]). The process model, the events and the other explanations are those of the record until then. The filter
//! along the whole record with these linearisation points is the same.

use super::branch::Branch;
use super::conclude::SmoothedHistory;
use super::estimates::of_state;
use super::kalman::Gaussian;
use super::passes::JointProblem;
use super::state::MarginalState;
use crate::error::Error;
use crate::forecast::filter_state::FilterState;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::{Condition, Reading};
use crate::track::answer::ReadingEstimate;
use crate::track::conditions::Covariate;
use crate::track::daily::Tracking;
use crate::track::operating_point::FollowedMachine;
use crate::track::record::{self, Day};

/// A filter that goes on.
pub struct Follower {
    rotor: Rotor,
    machine: FollowedMachine,
    noise: Noise,
    bearing_of: Vec<usize>,
    covariates: Vec<Covariate>,
    conditions: Vec<Condition>,
    pace_d: f64,
    last_d: f64,
    /// Covariates of the last reading.
    last_conditions: Vec<f64>,
    /// The most probable explanation first.
    branches: Vec<Branch>,
}

/// A reading taken in, and what it is known by.
pub struct FollowedReading {
    pub estimate: ReadingEstimate,
    pub filter_states: [FilterState; 4],
    /// Whether the reading was left out as an outlier.
    pub is_impossible: bool,
    /// Points at which the machine was evaluated.
    pub evaluations: usize,
}

impl Follower {
    pub(super) fn new(
        tracking: &Tracking,
        problem: &JointProblem,
        found: &SmoothedHistory,
        rotor: Rotor,
    ) -> Option<Self> {
        let own = problem.branch(1.0, &found.motion, &found.pass, true)?;
        let rivals = found.rivals.iter().map(|rival| rival.end.clone());
        let (_, last) = problem.own().last()?;
        Some(Self {
            machine: FollowedMachine::of(&rotor),
            rotor,
            noise: problem.noise,
            bearing_of: tracking.bearing_of.clone(),
            covariates: problem.covariates.clone(),
            conditions: tracking.config.conditions.clone(),
            pace_d: problem.pace_d,
            last_d: last.time_d,
            last_conditions: last.conditions.clone(),
            branches: std::iter::once(own).chain(rivals).collect(),
        })
    }

    /// A reading of this machine, ready to be taken in.
    ///
    /// # Errors
    /// If the machine is singular at its speed, or a weight of its run is in no plane.
    fn day(&self, row: usize, reading: &Reading) -> Result<Day, Error> {
        let mut day = record::day(&self.rotor, &self.machine, &self.noise, row, reading)?;
        let values = self.covariates.iter().zip(&self.last_conditions);
        // a lost value stays as it was
        day.conditions =
            values.map(|(c, last)| c.of_reading(&self.conditions, reading).unwrap_or(*last)).collect();
        Ok(day)
    }

    /// Takes the next reading in; `None` if it has no value, or the machine is singular.
    ///
    /// # Errors
    /// If a weight of its run is in no plane.
    pub fn take(&mut self, row: usize, reading: &Reading) -> Result<Option<FollowedReading>, Error> {
        if reading.probes.iter().all(Option::is_none) {
            return Ok(None);
        }
        let day = self.day(row, reading)?;
        Ok(self.advance(&day))
    }

    fn advance(&mut self, day: &Day) -> Option<FollowedReading> {
        let paces = (day.time_d - self.last_d) / self.pace_d;
        (self.last_d, self.last_conditions) = (day.time_d, day.conditions.clone());
        let mut impossible = Vec::new();
        for branch in &mut self.branches {
            impossible.push(branch.advance(day, paces, &self.noise)?);
        }
        let states: Vec<Gaussian> = self.branches.iter().map(|b| b.under(&day.conditions)).collect();
        let (own, is_impossible) = (&self.branches[0], impossible[0]);
        let rivals = self.branches.iter().zip(&states).skip(1);
        let rivals: Vec<(f64, MarginalState)> =
            rivals.map(|(b, state)| (b.weight, b.layout.marginal(state))).collect();
        let rivals = rivals.iter().map(|(weight, state)| (*weight, state)).collect();
        let mut estimate = of_state(&own.layout, day, &self.bearing_of, &states[0], rivals)?;
        estimate.suspicious = is_impossible;
        let filter_states = own.layout.filter_states(&states[0], &day.weights_kg_m, &own.motion, self.pace_d);
        estimate.unbalance_kg_m.iter_mut().zip(&day.weights_kg_m).for_each(|(u, weight)| *u += weight);
        let evaluations = 1 + self.branches.iter().filter(|b| b.is_read).count();
        Some(FollowedReading { estimate, filter_states, is_impossible, evaluations })
    }
}

#[cfg(test)]
mod tests {
    use super::super::JointHistory;
    use super::super::passes::Epoch;
    use super::*;
    use crate::track::answer::{Config, Method};
    use crate::track::filtered::tests::record;

    #[test]
    fn filter_that_goes_on_equals_filter_of_whole_record() {
        let (rotor, days, runup) = record(40);
        let config = Config::new(Method::Joint);
        let known = &days[..30];
        let tracking = Tracking::begin(&rotor, known, &runup, &config).unwrap();
        let history = tracking.joint_history(known, &runup, &[], &mut |_, _| ()).unwrap();
        let JointHistory { mut problem, found, now, .. } = history;
        assert!(found.events.is_empty());
        let mut follower = Follower::new(&tracking, &problem, &found, now).unwrap();
        let (mut points, mut states) = (found.linearised_at.clone(), Vec::new());
        for (row, reading) in days.iter().enumerate().skip(known.len()) {
            let day = follower.day(row, reading).unwrap();
            let mut ahead = follower.branches[0].clone();
            let paces = (day.time_d - follower.last_d) / follower.pace_d;
            ahead.state = ahead.state.predicted(&ahead.layout.step(paces, &ahead.motion, None, false));
            points.push(ahead.point());
            let followed = follower.advance(&day).unwrap();
            assert!(!followed.is_impossible && followed.evaluations == 1 + follower.branches.len());
            problem.epochs.push(Epoch { time_d: day.time_d, own: Some(day), beside: Vec::new() });
            states.push(follower.branches[0].state.clone());
        }
        let pass = problem.filter(&found.motion, &[], &points).unwrap();
        for (visit, state) in pass.visits[known.len()..].iter().zip(&states) {
            let filtered = visit.filtered();
            assert!((&filtered.mean - &state.mean).amax() < 1e-9 * filtered.mean.amax());
            assert!((&filtered.covariance - &state.covariance).amax() < 1e-9 * filtered.covariance.amax());
        }
    }
}

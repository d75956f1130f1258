//! Machines that are new after an outage: outages that are stated, and gaps in the days beyond which the features stepped.
//!
//! Each part of the record from a restart on is identified by itself. That gives points to linearise around; the prior of
//! its unbalance has the width of any unbalance and any angle.

use nalgebra::DVector;

use super::passes::{JointProblem, Restart};
use super::search::StepWindow;
use crate::error::{Error, TrackError};
use crate::measurement::Reading;
use crate::track::answer::{Config, Outage, ReadingEstimate};
use crate::track::coefficients::Logs;
use crate::track::daily::Tracking;
use crate::track::faults::{FEWEST, LONG_GAP_D};

/// A part of the record that begins with a restart, followed by itself.
pub struct RestartedPart {
    /// Its first epoch.
    pub epoch: usize,
    estimates: Vec<ReadingEstimate>,
}

impl RestartedPart {
    /// Puts its estimates in place of those of the same days.
    pub fn replace_in(self, all: &mut Vec<ReadingEstimate>) {
        let (Some(first), Some(last)) = (self.estimates.first(), self.estimates.last()) else { return };
        let (from_d, to_d) = (first.time_d, last.time_d);
        all.retain(|e| e.time_d < from_d || e.time_d > to_d);
        let at = all.partition_point(|e| e.time_d < from_d);
        all.splice(at..at, self.estimates);
    }
}

/// Restarts of a record.
pub struct Restarts {
    /// Epochs of those after stated outages.
    pub stated: Vec<usize>,
    /// All of them, the stated ones included.
    pub parts: Vec<RestartedPart>,
}

impl Tracking<'_> {
    /// Restarts after stated outages and after gaps beyond which the features stepped, each part identified by itself.
    ///
    /// # Errors
    /// If an outage is not one of this record, or what follows it cannot be identified.
    pub(super) fn restarts(&self, record: &[Reading], windows: &[StepWindow]) -> Result<Restarts, Error> {
        let outages = &self.config.outages;
        let stated: Vec<usize> =
            outages.iter().map(|outage| self.epoch_after(*outage)).collect::<Result<_, _>>()?;
        let is_gap = |k: &usize| self.days[*k].time_d - self.days[*k - 1].time_d > LONG_GAP_D;
        let stepped = |k: &usize| windows.iter().any(|w| w.epochs.contains(k));
        let mut epochs: Vec<usize> =
            (1..self.days.len()).filter(|k| stated.contains(k) || (is_gap(k) && stepped(k))).collect();
        // a stretch too short to identify anything is left to the other explanations
        let complete_from =
            |k: usize, end: usize| self.days[k..end].iter().filter(|d| d.is_complete()).count();
        let ends = |epochs: &[usize], i: usize| epochs.get(i + 1).copied().unwrap_or(self.days.len());
        let long: Vec<bool> =
            (0..epochs.len()).map(|i| complete_from(epochs[i], ends(&epochs, i)) >= FEWEST).collect();
        let mut is_long = long.iter();
        epochs.retain(|k| *is_long.next().unwrap_or(&false) || stated.contains(k));
        let mut parts = Vec::new();
        for (i, epoch) in epochs.iter().enumerate() {
            let rows = self.days[*epoch].row..self.days[ends(&epochs, i) - 1].row + 1;
            let outage = stated.iter().position(|k| k == epoch).map(|i| outages[i]);
            match (self.identified_anew(record, rows), outage) {
                (Ok(estimates), _) => parts.push(RestartedPart { epoch: *epoch, estimates }),
                (Err(why), Some(Outage { from_d, to_d })) => {
                    return Err(TrackError::AfterOutage { from_d, to_d, why: why.to_string() }.into());
                }
                (Err(_), None) => {}
            }
        }
        Ok(Restarts { stated, parts })
    }

    /// The first epoch after an outage.
    fn epoch_after(&self, outage: Outage) -> Result<usize, Error> {
        let Outage { from_d, to_d } = outage;
        let (first, last) = (&self.days[0], &self.days[self.days.len() - 1]);
        let within = first.time_d <= from_d && from_d < to_d && to_d <= last.time_d;
        if !within {
            let (first_d, last_d) = (first.time_d, last.time_d);
            return Err(TrackError::OutageOutside { from_d, to_d, first_d, last_d }.into());
        }
        let overlaps = |o: &&Outage| **o != outage && o.from_d < to_d && from_d < o.to_d;
        if let Some(other) = self.config.outages.iter().find(overlaps) {
            let (other_from_d, other_to_d) = (other.from_d, other.to_d);
            return Err(TrackError::OutagesOverlap { from_d, to_d, other_from_d, other_to_d }.into());
        }
        let inside = |time_d: f64| from_d < time_d && time_d < to_d;
        if let Some(day) = self.days.iter().find(|d| inside(d.time_d)) {
            return Err(TrackError::ReadingInOutage { from_d, to_d, time_d: day.time_d }.into());
        }
        Ok(self.days.partition_point(|d| d.time_d < to_d).max(1))
    }

    /// Method 2 on rows of the record that begin with an unknown machine.
    fn identified_anew(
        &self,
        record: &[Reading],
        rows: std::ops::Range<usize>,
    ) -> Result<Vec<ReadingEstimate>, Error> {
        let config = Config { identified: false, outages: Vec::new(), ..self.config.clone() };
        let from = rows.start;
        let part = Tracking::begin(self.rotor, &record[rows], &[], &config)?;
        let mut estimates = part.adaptive(&mut |_, _| ()).estimates;
        estimates.iter_mut().for_each(|e| e.row += from);
        Ok(estimates)
    }
}

impl JointProblem {
    /// Adds restarts at epochs: `logs` are the prior means of the bearings, and `points` what is linearised around at first.
    pub fn add_restarts(&mut self, epochs: &[usize], logs: &Logs, points: &[DVector<f64>]) {
        let layout = &self.layout;
        let coordinates = |k: usize| (0..layout.planes.len()).map(move |j| layout.coordinate(&points[k], j));
        let restart = |k: &usize| Restart {
            epoch: *k,
            logs: logs.clone(),
            coordinates: coordinates(*k).collect(),
            points: points[*k..].to_vec(),
        };
        self.restarts = epochs.iter().map(restart).collect();
    }
}

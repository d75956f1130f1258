//! A record, played frame by frame over the virtual bus into the controller's core.
//!
//! The host sends each reading as frames and knows of the answer only what comes back as frames; the controller's clock
//! is the record's ([`timing`]). [`live`] does the same over a real bus; [`check`] then holds every answer against the
//! desktop crate.

pub mod check;
mod config;
pub mod fit;
pub mod live;
mod reference;
mod simulated;
pub mod timing;

use anyhow::Result;
use rotor_edge_core::can::{Counters, FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame, MonitorResult};
use rotor_edge_core::state::Status;
use rotor_edge_desktop::measurement::Reading;

use crate::bus::Traffic;
use crate::bus::states::States;
use crate::edge::Deployment;
pub use config::ReplayConfig;
use timing::Timing;
pub use timing::day;

/// One reading that the controller answered.
#[derive(Debug, Clone, Copy)]
pub struct AnsweredReading {
    /// Row of the record, from 0.
    pub row: usize,
    pub result: MonitorResult,
}

impl AnsweredReading {
    /// Whether the controller says that the model no longer fits.
    pub fn flagged(&self) -> bool {
        self.result.flags & FLAG_FLAGGED != 0
    }

    /// Whether the controller judged the model by this reading.
    pub fn judged(&self) -> bool {
        self.result.is_judged()
    }

    /// Whether this reading alone looked wrong.
    pub fn suspicious(&self) -> bool {
        self.result.flags & FLAG_SUSPICIOUS != 0
    }
}

/// A change of what the controller says of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateChange {
    /// Day of the record.
    pub time_d: f64,
    pub status: Status,
}

#[derive(Debug, Clone)]
pub struct Replay {
    /// Answers in the order of the record.
    pub answers: Vec<AnsweredReading>,
    /// The controller's states, when they changed.
    pub states: Vec<StateChange>,
    pub traffic: Traffic,
    /// The controller's own count of what became of the readings, all its lives together.
    pub counters: Counters,
}

/// A time during which the controller flagged the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flag {
    /// First suspicious reading of the streak, days (row number without a `time_d` column).
    pub since_d: f64,
    /// Reading at which the flag went up, days.
    pub time_d: f64,
    /// The bearing whose probes misfit most, in the order of the rotor's file.
    pub suspect: Option<usize>,
    /// Readings from the flag's rise to its fall.
    pub readings: usize,
}

/// Plays `record` into a fresh controller that holds the deployed model; `progress` hears of every row.
///
/// # Errors
/// If the controller refuses the model.
pub fn run(
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    progress: impl FnMut(usize),
) -> Result<Replay> {
    run_overheard(deployment, record, config, progress, |_, _| Ok(()))
}

/// The same; `overhear` gets every frame on the bus, with the simulated time in µs.
///
/// # Errors
/// If the controller refuses the model, or `overhear` fails.
pub fn run_overheard(
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    progress: impl FnMut(usize),
    overhear: impl FnMut(u64, &Frame) -> Result<()>,
) -> Result<Replay> {
    simulated::play(deployment, record, config, progress, overhear)
}

/// States as days of the record.
fn changes(states: &States, timing: &Timing) -> Vec<StateChange> {
    let change = |timed: &crate::bus::decoded::Timed<Status>| StateChange {
        time_d: timing.day(timed.time_us),
        status: timed.what,
    };
    states.changes().iter().map(change).collect()
}

/// The row that a 16-bit sequence number stands for, not later than the last one sent.
fn row_of(sequence: u16, last: usize) -> usize {
    last - usize::from((last as u16).wrapping_sub(sequence))
}

/// The times during which the flag was up.
pub fn flags(record: &[Reading], answers: &[AnsweredReading]) -> Vec<Flag> {
    let mut flags: Vec<Flag> = Vec::new();
    let mut since = 0;
    for (i, answer) in answers.iter().enumerate() {
        let before = i.checked_sub(1).map(|k| &answers[k]);
        if answer.suspicious() && !before.is_some_and(AnsweredReading::suspicious) {
            since = answer.row;
        }
        if !answer.flagged() {
            continue;
        }
        if before.is_some_and(AnsweredReading::flagged) {
            if let Some(flag) = flags.last_mut() {
                flag.readings += 1;
            }
        } else {
            flags.push(Flag {
                since_d: day(record, since),
                time_d: day(record, answer.row),
                suspect: answer.result.suspect.map(usize::from),
                readings: 1,
            });
        }
    }
    flags
}

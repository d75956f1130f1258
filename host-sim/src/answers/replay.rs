//! Answer of `replay`.

use rotor_edge_core::can::Counters;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use serde::Serialize;

use super::alphabetical;
use super::findings::DeterminedAnswer;
use super::identify::Identification;
use super::tracker::TrackerResult;
use crate::bus::numbers::probe_numbers;
use crate::bus::states::name;
use crate::ingest::dates::Dates;
use crate::replay::check::Equivalence;
use crate::replay::fit::ModelFit;
use crate::replay::{AnsweredReading, Flag, Replay, StateChange, day};

/// A record, played into the controller's core.
#[derive(Serialize)]
pub struct ReplayAnswer {
    pub readings: usize,
    pub equivalence: Equivalence,
    pub flags: Vec<FlagSummary>,
    pub states: Vec<StateSummary>,
    pub frames: Frames,
    pub counters: CounterSummary,
    #[serde(serialize_with = "alphabetical")]
    pub unbalance: LastUnbalance,
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "alphabetical")]
    pub better: Option<BetterAnswer>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub answers: Option<Vec<ReplayedResult>>,
    #[serde(skip)]
    pub fit: ModelFit,
    #[serde(skip)]
    pub job: ReplayJob,
}

/// What was replayed and how.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayJob {
    pub rotor_name: String,
    /// Readings of the record, answered or not.
    pub recorded: usize,
    /// First and last day of the record.
    pub days: [f64; 2],
    /// Result of phase I and how many speeds its run-up has; `None` where the model was identified already.
    pub phase_one: Option<(Identification, Option<usize>)>,
    pub bus: String,
    /// How long a verdict counts, s.
    pub age_limit_s: f64,
    pub power_cuts_d: Vec<f64>,
    pub dates: Dates,
}

/// The days from an event on, with the model as it was and with a better one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BetterAnswer {
    pub since_d: f64,
    /// Mean residual over feature sum.
    pub residual_ratio_before: f64,
    pub residual_ratio_after: f64,
    /// Days on which the better model raised a flag.
    pub flags: Vec<f64>,
    #[serde(skip)]
    pub label: String,
    /// Readings that were flagged, with the model as it was and with the better one.
    #[serde(skip)]
    pub flagged: [usize; 2],
}

/// One answer, in the controller's own numbers.
#[derive(Serialize)]
pub struct ReplayedResult {
    pub row: usize,
    pub time_d: f64,
    #[serde(flatten)]
    pub result: TrackerResult,
}

/// All answers of a replay.
pub fn answers(record: &[Reading], played: &Replay) -> Vec<ReplayedResult> {
    let summary = |AnsweredReading { row, result }: &AnsweredReading| ReplayedResult {
        row: *row,
        time_d: day(record, *row),
        result: result.into(),
    };
    played.answers.iter().map(summary).collect()
}

/// The planes on the last day that the model fits, or why there are none.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum LastUnbalance {
    Known(KnownUnbalance),
    Unknown { why: String },
}

/// The planes on one day.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnownUnbalance {
    pub time_d: f64,
    pub determined: DeterminedAnswer,
    /// Size of the noise over the stated one, as the readings that the model fits show it.
    pub noise_scale: f64,
    /// Whether the bearings' uncertainty is in the intervals.
    pub with_bearings: bool,
    /// Whether readings follow that the model does not fit.
    pub outdated: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlagSummary {
    pub since_d: f64,
    pub time_d: f64,
    pub suspect: Option<String>,
    pub readings: usize,
}

/// A change of what the controller says of itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateSummary {
    pub time_d: f64,
    pub state: String,
    pub reason: String,
    /// Probes that it works without.
    #[serde(skip)]
    pub missing: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Frames {
    pub sent: u64,
    pub received: u64,
    pub lost: u64,
}

/// The controller's count of what became of the readings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CounterSummary {
    pub skipped: u32,
    pub lost: u32,
    pub rejected: u32,
    pub repeated: u32,
    pub late: u32,
    pub incomplete: u32,
    pub stray: u32,
    #[serde(skip)]
    pub evaluated: u32,
    /// Readings evaluated without all probes.
    #[serde(skip)]
    pub partial: u32,
}

impl ReplayAnswer {
    /// Everything that a replay saw; `unbalance` are the planes on the last day that the model fits. There is no better model, and
    /// single answers are left out.
    pub fn of(
        rotor: &Rotor,
        record: &[Reading],
        played: &Replay,
        agreement: &Equivalence,
        raised: &[Flag],
        unbalance: LastUnbalance,
        job: ReplayJob,
    ) -> Self {
        let traffic = played.traffic;
        Self {
            readings: played.answers.len(),
            equivalence: *agreement,
            flags: raised.iter().map(|flag| FlagSummary::of(rotor, flag)).collect(),
            states: played.states.iter().map(|change| StateSummary::of(rotor, change)).collect(),
            frames: Frames { sent: traffic.sent, received: traffic.received, lost: traffic.lost },
            counters: played.counters.into(),
            unbalance,
            better: None,
            answers: None,
            fit: ModelFit::of(record, &played.answers, raised),
            job,
        }
    }
}

impl FlagSummary {
    fn of(rotor: &Rotor, flag: &Flag) -> Self {
        Self {
            since_d: flag.since_d,
            time_d: flag.time_d,
            suspect: flag.suspect.and_then(|b| rotor.bearing.get(b)).map(|b| b.name.clone()),
            readings: flag.readings,
        }
    }
}

impl StateSummary {
    fn of(rotor: &Rotor, change: &StateChange) -> Self {
        let status = &change.status;
        let numbers = probe_numbers(status.missing_mask).into_iter();
        let probes = numbers.filter_map(|number| rotor.probe.get(usize::from(number) - 1));
        Self {
            time_d: change.time_d,
            state: name(status.state),
            reason: name(status.reason),
            missing: probes.map(|probe| probe.name.clone()).collect(),
        }
    }
}

impl From<Counters> for CounterSummary {
    fn from(c: Counters) -> Self {
        Self {
            skipped: c.skipped,
            lost: c.lost,
            rejected: c.rejected,
            repeated: c.repeated,
            late: c.late,
            incomplete: c.incomplete,
            stray: c.stray,
            evaluated: c.readings,
            partial: c.partial,
        }
    }
}

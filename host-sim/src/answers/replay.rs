//! Answer of `replay`.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use serde::Serialize;
use serde_json::Value;

use super::alphabetical;
use super::findings::DeterminedAnswer;
use super::tracker::TrackerResult;
use crate::bus::states::name;
use crate::replay::check::Equivalence;
use crate::replay::{Flag, Replay, day};

/// A record, played into the controller's core.
#[derive(Serialize)]
pub struct ReplayAnswer<'a> {
    readings: usize,
    equivalence: EquivalenceSummary,
    flags: Vec<FlagSummary<'a>>,
    states: Vec<StateSummary>,
    frames: Frames,
    counters: CounterSummary,
    #[serde(serialize_with = "alphabetical")]
    unbalance: LastUnbalance,
    #[serde(skip_serializing_if = "Option::is_none")]
    better: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    answers: Option<Vec<ReplayedResult>>,
}

/// One answer, in the controller's own numbers.
#[derive(Serialize)]
pub struct ReplayedResult {
    row: usize,
    time_d: f64,
    #[serde(flatten)]
    result: TrackerResult,
}

/// All answers of a replay.
pub fn answers(record: &[Reading], played: &Replay) -> Vec<ReplayedResult> {
    let summary = |crate::replay::AnsweredReading { row, result }: &crate::replay::AnsweredReading| {
        ReplayedResult { row: *row, time_d: day(record, *row), result: result.into() }
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

#[derive(Serialize)]
struct EquivalenceSummary {
    max_relative_feature_error: f64,
    max_residual_excess_um: f64,
    max_relative_excess: f64,
    max_unbalance_difference_g_mm: f64,
    max_angle_difference_deg: f64,
    compared: usize,
    max_relative_gap: f64,
    certified: usize,
}

#[derive(Serialize)]
struct FlagSummary<'a> {
    since_d: f64,
    time_d: f64,
    suspect: Option<&'a str>,
    readings: usize,
}

/// A change of what the controller says of itself.
#[derive(Serialize)]
struct StateSummary {
    time_d: f64,
    state: String,
    reason: String,
}

#[derive(Serialize)]
struct Frames {
    sent: u64,
    received: u64,
    lost: u64,
}

#[derive(Serialize)]
struct CounterSummary {
    skipped: u32,
    lost: u32,
    rejected: u32,
    repeated: u32,
    late: u32,
    incomplete: u32,
    stray: u32,
}

impl<'a> ReplayAnswer<'a> {
    /// Everything a replay saw; `better` is what a better model made of the days after the event,
    /// `answers` all of the controller's, `unbalance` the planes on the last day that the model fits.
    pub fn of(
        rotor: &'a Rotor,
        played: &Replay,
        agreement: &Equivalence,
        raised: &[Flag],
        better: Option<Value>,
        answers: Option<Vec<ReplayedResult>>,
        unbalance: LastUnbalance,
    ) -> Self {
        let (t, c) = (played.traffic, played.counters);
        Self {
            readings: played.answers.len(),
            equivalence: EquivalenceSummary {
                max_relative_feature_error: agreement.max_relative_feature_error,
                max_residual_excess_um: agreement.max_residual_excess_um,
                max_relative_excess: agreement.max_relative_excess,
                max_unbalance_difference_g_mm: agreement.max_unbalance_difference_g_mm,
                max_angle_difference_deg: agreement.max_angle_difference_deg,
                compared: agreement.compared,
                max_relative_gap: agreement.max_relative_gap,
                certified: agreement.certified,
            },
            flags: raised
                .iter()
                .map(|f| FlagSummary {
                    since_d: f.since_d,
                    time_d: f.time_d,
                    suspect: f.suspect.and_then(|b| rotor.bearing.get(b)).map(|b| b.name.as_str()),
                    readings: f.readings,
                })
                .collect(),
            states: played
                .states
                .iter()
                .map(|change| StateSummary {
                    time_d: change.time_d,
                    state: name(change.status.state),
                    reason: name(change.status.reason),
                })
                .collect(),
            frames: Frames { sent: t.sent, received: t.received, lost: t.lost },
            counters: CounterSummary {
                skipped: c.skipped,
                lost: c.lost,
                rejected: c.rejected,
                repeated: c.repeated,
                late: c.late,
                incomplete: c.incomplete,
                stray: c.stray,
            },
            unbalance,
            better,
            answers,
        }
    }
}

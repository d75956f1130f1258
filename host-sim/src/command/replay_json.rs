//! `replay --json`.

use rotor_edge_desktop::rotor::Rotor;
use serde::Serialize;
use serde_json::Value;

use crate::replay::check::Equivalence;
use crate::replay::{Flag, Replay};

/// What `replay --json` prints.
#[derive(Serialize)]
pub struct Summary<'a> {
    readings: usize,
    equivalence: EquivalenceSummary,
    flags: Vec<FlagSummary<'a>>,
    frames: Frames,
    counters: CounterSummary,
    #[serde(skip_serializing_if = "Option::is_none")]
    better: Option<Value>,
}

#[derive(Serialize)]
struct EquivalenceSummary {
    max_relative_feature_error: f64,
    max_residual_excess_um: f64,
    max_relative_excess: f64,
    max_unbalance_difference_g_mm: f64,
    max_angle_difference_deg: f64,
    compared: usize,
}

#[derive(Serialize)]
struct FlagSummary<'a> {
    since_d: f64,
    time_d: f64,
    suspect: Option<&'a str>,
    readings: usize,
}

#[derive(Serialize)]
struct Frames {
    sent: u64,
    received: u64,
    lost: u64,
}

#[derive(Serialize)]
struct CounterSummary {
    skipped: u16,
    lost: u16,
    rejected: u16,
    repeated: u16,
    late: u16,
    incomplete: u16,
    stray: u16,
}

impl<'a> Summary<'a> {
    /// Everything a replay saw; `better` is what a better model made of the days after the event.
    pub fn of(
        rotor: &'a Rotor,
        played: &Replay,
        agreement: &Equivalence,
        raised: &[Flag],
        better: Option<Value>,
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
            },
            flags: raised
                .iter()
                .map(|f| FlagSummary {
                    since_d: f.since_d,
                    time_d: f.time_d,
                    suspect: f.suspect.map(|b| rotor.bearing[b].name.as_str()),
                    readings: f.readings,
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
            better,
        }
    }
}

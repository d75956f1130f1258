//! A monitor's result and its states. [`ResultAnswer`] is the one reading of the result on the bus; the plant keeps its keys.
//! [`TimedResult`] has the keys of `decode` and `watch`, [`TrackerResult`](super::tracker::TrackerResult) those of
//! `replay --answers` and of the tracker of the Python package. They differ:
//!
//! | content | plant | `decode`, `watch` | `replay`, tracker |
//! |---|---|---|---|
//! | planes | `planes_g_mm`, cosine and sine | `planes`, magnitude and angle | `unbalance_g_mm`, cosine and sine |
//! | static, dynamic | `static_g_mm`, `dynamic_g_mm` | `static`, `dynamic` | `static_g_mm`, `dynamic_g_mm` |
//! | residual | `residual_um` | `residual_um` | `e_um` |
//! | flags | `is_suspicious`, `is_flagged` | `suspicious`, `flagged` | `flags`, all bits of the bus |
//! | probes | `used_mask`, bits | `probes_used` | `probes_used` |
//! | reason, redundancy | yes | yes | no |

use nalgebra::Complex;
use rotor_edge_core::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS, MonitorResult};
use rotor_edge_core::model::Pair;
use rotor_edge_core::state::Status;
use rotor_edge_desktop::unbalance::G_MM;
use serde::{Deserialize, Serialize};

use super::shared::UnbalanceAnswer;
use crate::bus::decoded::{Timed, planes_of};
use crate::bus::numbers::{bearing_number, probe_numbers};
use crate::bus::states::{States, name};

/// A number that may be missing: the protocol's NaN.
type Finite = Option<f32>;

/// What a monitor made of a reading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ResultAnswer {
    /// The residual was too large.
    pub is_suspicious: bool,
    pub is_flagged: bool,
    /// Suspected bearing, from 1.
    pub suspect: Option<u8>,
    pub reason: String,
    /// Suspicious readings in a row.
    pub streak: u16,
    /// Rows of the reading less unknowns; zero: the residual says nothing.
    pub redundancy: u8,
    /// Bit i set: probe i was used.
    pub used_mask: u8,
    /// Cosine and sine of the unbalance of each plane, g·mm.
    pub planes_g_mm: Vec<[Finite; 2]>,
    pub static_g_mm: [Finite; 2],
    pub dynamic_g_mm: [Finite; 2],
    pub residual_um: Finite,
    /// Residual over the sum of the features.
    pub ratio: Finite,
    /// Residual below which nothing is suspicious, µm.
    pub floor_um: Finite,
    /// Residual above which a rise counts, µm.
    pub level_um: Finite,
}

/// A result as `decode` and `watch` print it; its time counts from the begin of the recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimedResult {
    pub time_s: f64,
    pub sequence: u16,
    pub suspicious: bool,
    pub flagged: bool,
    pub suspect: Option<u8>,
    pub streak: u16,
    pub reason: String,
    pub probes_used: Vec<u8>,
    pub redundancy: u8,
    pub planes: Vec<UnbalanceAnswer>,
    #[serde(rename = "static")]
    pub static_unbalance: UnbalanceAnswer,
    pub dynamic: UnbalanceAnswer,
    pub residual_um: f32,
    pub ratio: f32,
    pub floor_um: f32,
    pub level_um: f32,
}

/// A change of what a monitor said of itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateChange {
    pub time_s: f64,
    pub state: String,
    pub reason: String,
    pub missing_probes: Vec<u8>,
}

fn finite(value: f32) -> Finite {
    value.is_finite().then_some(value)
}

fn finite_pair(pair: Pair) -> [Finite; 2] {
    pair.map(finite)
}

/// The protocol's number again.
pub(super) fn or_nan(value: Finite) -> f32 {
    value.unwrap_or(f32::NAN)
}

impl From<&MonitorResult> for ResultAnswer {
    fn from(result: &MonitorResult) -> Self {
        Self {
            is_suspicious: result.flags & FLAG_SUSPICIOUS != 0,
            is_flagged: result.flags & FLAG_FLAGGED != 0,
            suspect: result.suspect.map(bearing_number),
            reason: name(result.reason),
            streak: result.streak,
            redundancy: result.redundancy,
            used_mask: result.used_mask,
            planes_g_mm: planes_of(result).iter().map(|plane| finite_pair(*plane)).collect(),
            static_g_mm: finite_pair(result.static_g_mm),
            dynamic_g_mm: finite_pair(result.dynamic_g_mm),
            residual_um: finite(result.e_um),
            ratio: finite(result.ratio),
            floor_um: finite(result.floor_um),
            level_um: finite(result.level_um),
        }
    }
}

impl TimedResult {
    /// A result, its time counted from `start_us`.
    pub fn of(timed: &Timed<MonitorResult>, start_us: u64) -> Self {
        let result = ResultAnswer::from(&timed.what);
        Self {
            time_s: seconds(timed.time_us, start_us),
            sequence: timed.what.sequence,
            suspicious: result.is_suspicious,
            flagged: result.is_flagged,
            suspect: result.suspect,
            streak: result.streak,
            reason: result.reason,
            probes_used: probe_numbers(result.used_mask),
            redundancy: result.redundancy,
            planes: result.planes_g_mm.iter().copied().map(polar).collect(),
            static_unbalance: polar(result.static_g_mm),
            dynamic: polar(result.dynamic_g_mm),
            residual_um: or_nan(result.residual_um),
            ratio: or_nan(result.ratio),
            floor_um: or_nan(result.floor_um),
            level_um: or_nan(result.level_um),
        }
    }
}

fn seconds(time_us: u64, start_us: u64) -> f64 {
    time_us.saturating_sub(start_us) as f64 * 1e-6
}

fn polar(pair: [Finite; 2]) -> UnbalanceAnswer {
    let [x, y] = pair.map(|part| f64::from(or_nan(part)));
    UnbalanceAnswer::of(Complex::new(x, y) / G_MM)
}

impl StateChange {
    /// All changes, their times counted from `start_us`.
    pub fn all(states: &States, start_us: u64) -> Vec<Self> {
        let change = |timed: &Timed<Status>| Self {
            time_s: seconds(timed.time_us, start_us),
            state: name(timed.what.state),
            reason: name(timed.what.reason),
            missing_probes: probe_numbers(timed.what.missing_mask),
        };
        states.changes().iter().map(change).collect()
    }
}

//! Answer of a ``Tracker``: the controller's own numbers, of 32 bits.

use rotor_edge_core::can::MonitorResult;
use rotor_edge_core::state::Status;
use serde::Serialize;

use super::monitor_result::{ResultAnswer, or_nan};
use crate::bus::numbers::{bearing_number, probe_numbers};
use crate::bus::states::name;

/// A reading that was judged, as ``replay --json --answers`` prints it; bearings and probes count from 1. Unbalances are
/// ``[U cos α, U sin α]``.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackerResult {
    /// A row a plane.
    pub unbalance_g_mm: Vec<[f32; 2]>,
    pub static_g_mm: [f32; 2],
    /// At plane 1; not a number with three planes or more.
    pub dynamic_g_mm: [f32; 2],
    /// Residual: Σ|model − measured| over cosines and sines of all probes.
    pub e_um: f32,
    /// The same relative to Σ|measured|.
    pub ratio: f32,
    /// Bits of the result on the bus.
    pub flags: u8,
    /// The bearing whose probes misfit most.
    pub suspect: Option<u8>,
    /// Suspicious readings in a row.
    pub streak: u16,
    pub probes_used: Vec<u8>,
    /// Residual below which nothing is suspicious.
    pub floor_um: f32,
    /// Level above which a rise counts.
    pub level_um: f32,
}

/// What the monitor says of itself, and its result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitoredAnswer {
    /// no_model, waiting, learning, tracking, suspicious, flagged, blind or stale.
    pub state: String,
    pub reason: String,
    /// Why the flag was raised that is latched; none without one.
    pub cause: String,
    /// The bearing that was suspected then, from 1.
    pub suspect: Option<u8>,
    pub missing_probes: Vec<u8>,
    /// Time since the last reading that was judged; None if there was none.
    pub age_s: Option<f32>,
    /// None where no reading came, or it could not be judged.
    pub result: Option<TrackerResult>,
}

impl From<&MonitorResult> for TrackerResult {
    fn from(on_bus: &MonitorResult) -> Self {
        let result = ResultAnswer::from(on_bus);
        Self {
            // with the bits of planes at their bound
            flags: on_bus.flags,
            unbalance_g_mm: result.planes_g_mm.iter().map(|plane| plane.map(or_nan)).collect(),
            static_g_mm: result.static_g_mm.map(or_nan),
            dynamic_g_mm: result.dynamic_g_mm.map(or_nan),
            e_um: or_nan(result.residual_um),
            ratio: or_nan(result.ratio),
            suspect: result.suspect,
            streak: result.streak,
            probes_used: probe_numbers(result.used_mask),
            floor_um: or_nan(result.floor_um),
            level_um: or_nan(result.level_um),
        }
    }
}

impl MonitoredAnswer {
    pub fn of(status: &Status, result: Option<&MonitorResult>) -> Self {
        Self {
            state: name(status.state),
            reason: name(status.reason),
            cause: name(status.cause),
            suspect: status.suspect.map(bearing_number),
            missing_probes: probe_numbers(status.missing_mask),
            age_s: Some(status.age_s).filter(|age_s| age_s.is_finite()),
            result: result.map(TrackerResult::from),
        }
    }
}

//! A monitor's result in JSON, the same for every command that prints one.

use nalgebra::Complex;
use rotor_edge_core::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS, MonitorResult};
use rotor_edge_core::state::Status;
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};
use serde::Serialize;

use crate::bus::decoded::{Timed, planes_of};
use crate::bus::states::{States, name};
use crate::watch::words::{bearing_number, probe_numbers};

#[derive(Serialize)]
pub struct Answer {
    pub time_s: f64,
    pub sequence: u16,
    pub suspicious: bool,
    pub flagged: bool,
    pub suspect: Option<u8>,
    pub streak: u16,
    pub reason: String,
    pub probes_used: Vec<u8>,
    pub redundancy: u8,
    pub planes: Vec<Unbalance>,
    #[serde(rename = "static")]
    pub static_unbalance: Unbalance,
    pub dynamic: Unbalance,
    pub residual_um: f32,
    pub ratio: f32,
    pub floor_um: f32,
    pub level_um: f32,
}

/// An unbalance as people write it.
#[derive(Serialize)]
pub struct Unbalance {
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
}

impl Unbalance {
    fn of([x, y]: [f32; 2]) -> Self {
        let [unbalance_g_mm, angle_deg] = g_mm_deg(Complex::new(f64::from(x), f64::from(y)) / G_MM);
        Self { unbalance_g_mm, angle_deg }
    }
}

impl Answer {
    /// A result, its time counted from `start_us`.
    pub fn of(timed: &Timed<MonitorResult>, start_us: u64) -> Self {
        let r = &timed.what;
        Self {
            time_s: timed.time_us.saturating_sub(start_us) as f64 * 1e-6,
            sequence: r.sequence,
            suspicious: r.flags & FLAG_SUSPICIOUS != 0,
            flagged: r.flags & FLAG_FLAGGED != 0,
            suspect: r.suspect.map(bearing_number),
            streak: r.streak,
            reason: name(r.reason),
            probes_used: probe_numbers(r.used_mask),
            redundancy: r.redundancy,
            planes: planes_of(r).iter().copied().map(Unbalance::of).collect(),
            static_unbalance: Unbalance::of(r.static_g_mm),
            dynamic: Unbalance::of(r.dynamic_g_mm),
            residual_um: r.e_um,
            ratio: r.ratio,
            floor_um: r.floor_um,
            level_um: r.level_um,
        }
    }
}

/// A change of what a monitor said of itself.
#[derive(Serialize)]
pub struct Change {
    pub time_s: f64,
    pub state: String,
    pub reason: String,
    pub missing_probes: Vec<u8>,
}

/// All changes, their times counted from `start_us`.
pub fn changes(states: &States, start_us: u64) -> Vec<Change> {
    let change = |timed: &Timed<Status>| Change {
        time_s: timed.time_us.saturating_sub(start_us) as f64 * 1e-6,
        state: name(timed.what.state),
        reason: name(timed.what.reason),
        missing_probes: probe_numbers(timed.what.missing_mask),
    };
    states.changes().iter().map(change).collect()
}

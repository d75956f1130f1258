//! A result of the controller in its own numbers, as programs read it.

use rotor_edge_core::can::MonitorResult;
use rotor_edge_core::model::Pair;
use serde::Serialize;

use crate::bus::decoded::planes_of;
use crate::watch::words::{bearing_number, probe_numbers};

/// The result without its number; bearings and probes count from 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResultJson {
    unbalance_g_mm: Vec<Pair>,
    static_g_mm: Pair,
    dynamic_g_mm: Pair,
    e_um: f32,
    ratio: f32,
    flags: u8,
    suspect: Option<u8>,
    streak: u16,
    probes_used: Vec<u8>,
    floor_um: f32,
    level_um: f32,
}

impl ResultJson {
    pub fn of(result: &MonitorResult) -> Self {
        Self {
            unbalance_g_mm: planes_of(result).to_vec(),
            static_g_mm: result.static_g_mm,
            dynamic_g_mm: result.dynamic_g_mm,
            e_um: result.e_um,
            ratio: result.ratio,
            flags: result.flags,
            suspect: result.suspect.map(bearing_number),
            streak: result.streak,
            probes_used: probe_numbers(result.used_mask),
            floor_um: result.floor_um,
            level_um: result.level_um,
        }
    }
}

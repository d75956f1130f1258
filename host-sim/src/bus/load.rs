//! How full a bus is, and how many monitors it carries.

use rotor_edge_core::can::{Frame, READING_FRAMES, RESULT_FRAMES};
use rotor_edge_core::node::HEARTBEAT_FRAMES;
use serde::Serialize;

use super::virtual_bus::frame_bits;

/// Monitors that the protocol is made for.
pub const MONITORS: u32 = 30;
/// Readings of each monitor a second.
pub const READINGS_A_SECOND: u32 = 10;
const BIT_RATES: [u32; 4] = [125_000, 250_000, 500_000, 1_000_000];

/// What one bit rate carries.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Load {
    /// Bits a second.
    pub bit_rate: u32,
    /// Load with all [`MONITORS`], of the bus's capacity; above 1 they do not fit.
    pub load: f64,
    /// Monitors that fit, at most [`MONITORS`].
    pub monitors: u32,
}

/// Frames of one monitor a second: its readings, its results and its heartbeat.
pub fn frames_a_second() -> u32 {
    READINGS_A_SECOND * (READING_FRAMES + RESULT_FRAMES) as u32 + HEARTBEAT_FRAMES as u32
}

/// The load at the usual bit rates, every frame full and stuffed at its worst.
pub fn loads() -> Vec<Load> {
    let full = Frame::standard(0, &[0; 8]).map_or(0, |frame| frame_bits(&frame));
    let monitor = frames_a_second() * full;
    let load = |bit_rate| Load {
        bit_rate,
        load: f64::from(MONITORS * monitor) / f64::from(bit_rate),
        monitors: (bit_rate / monitor).min(MONITORS),
    };
    BIT_RATES.map(load).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_are_those_worked_out_by_hand() {
        // 10 × 13 + 5 = 135 frames of 135 bits: 18,225 bit/s a monitor, 546,750 for thirty
        assert_eq!(frames_a_second(), 135);
        let found: Vec<_> = loads().iter().map(|l| (l.bit_rate, l.monitors)).collect();
        assert_eq!(found, [(125_000, 6), (250_000, 13), (500_000, 27), (1_000_000, 30)]);
        assert!((loads()[3].load - 0.546_75).abs() < 1e-12);
    }
}

//! How full a bus is, and how many monitors it carries.

use rotor_edge_core::can::Frame;
use rotor_edge_core::node::HEARTBEAT_FRAMES;
use serde::Serialize;

use super::virtual_bus::frame_bits;

/// Monitors that the protocol is made for.
pub const MONITORS: u32 = 30;
/// Readings of each monitor a second.
pub const READINGS_A_SECOND: u32 = 10;
/// Frames of a reading of four probes with their gap voltages: start, vectors, gaps, end.
const READING_FRAMES: usize = 1 + 4 + 1 + 1;
/// Frames of a result for two planes: status, planes, static, dynamic, residual, limits, end.
const RESULT_FRAMES: usize = 1 + 2 + 4 + 1;
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
    use rotor_edge_core::can::{NumberedReading, reading_frames, result_frames};
    use rotor_edge_core::reading::{ProbeVector, Reading};

    use super::*;
    use crate::watch::testing::plain_result;

    #[test]
    fn loads_are_those_worked_out_by_hand() {
        // 10 × 15 + 13 = 163 frames of 135 bits: 22,005 bit/s a monitor, 660,150 for thirty
        assert_eq!(frames_a_second(), 163);
        let found: Vec<_> = loads().iter().map(|l| (l.bit_rate, l.monitors)).collect();
        assert_eq!(found, [(125_000, 5), (250_000, 11), (500_000, 22), (1_000_000, 30)]);
        assert!((loads()[3].load - 0.660_15).abs() < 1e-12);
    }

    #[test]
    fn so_many_frames_are_what_the_protocol_makes() {
        let vector = ProbeVector { cos_um: 1.0, sin_um: 2.0 };
        let reading = Reading::new(3000.0, &[vector; 4]).unwrap().with_gaps_v(&[-9.0; 4]);
        assert_eq!(reading_frames(0, &NumberedReading::new(0, reading)).len(), READING_FRAMES);
        assert_eq!(result_frames(0, &plain_result(0, 2)).len(), RESULT_FRAMES);
    }
}

//! A monitor's result for one reading, as frames and back (the host's side).

use heapless::Vec;

use super::crc32;
use super::frame::Frame;
use super::message::Message;
use crate::model::Pair;
use crate::residual::Bearing;

/// Frames of a result.
pub const RESULT_FRAMES: usize = 7;
const BODY_FRAMES: usize = RESULT_FRAMES - 1;

/// What a monitor says about one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonitorResult {
    /// Number of the reading.
    pub sequence: u16,
    /// `FLAG_…` bits.
    pub flags: u8,
    /// Suspected bearing.
    pub suspect: Option<Bearing>,
    /// Suspicious readings in a row.
    pub streak: u16,
    /// `[U cos α, U sin α]` of each plane, g·mm.
    pub unbalance_g_mm: [Pair; 2],
    /// Static unbalance, g·mm.
    pub static_g_mm: Pair,
    /// Dynamic unbalance at plane 1, g·mm.
    pub dynamic_g_mm: Pair,
    /// `Σ|calculated − measured|`, µm.
    pub e_um: f32,
    /// The same relative to `Σ|measured|`.
    pub ratio: f32,
}

/// The seven frames of a result, in the order of sending.
pub fn result_frames(node: u8, result: &MonitorResult) -> Vec<Frame, RESULT_FRAMES> {
    let &MonitorResult { sequence, flags, suspect, streak, unbalance_g_mm: [first, second], .. } = result;
    let body = [
        Message::Status { sequence, flags, suspect, streak },
        Message::Unbalance { plane: 0, unbalance_g_mm: first },
        Message::Unbalance { plane: 1, unbalance_g_mm: second },
        Message::Static(result.static_g_mm),
        Message::Dynamic(result.dynamic_g_mm),
        Message::Residual { e_um: result.e_um, ratio: result.ratio },
    ];
    let mut frames = Vec::new();
    for message in body {
        // Cannot be full: the capacity is that of a whole result.
        let _ = frames.push(message.encode(node));
    }
    let crc32 = crc32(frames.iter().filter_map(Frame::full_payload));
    let _ = frames.push(Message::ResultEnd { sequence, count: BODY_FRAMES as u8, crc32 }.encode(node));
    frames
}

/// Puts results together from the frames of one monitor.
#[derive(Debug, Clone, Default)]
pub struct ResultAssembler {
    sequence: Option<u16>,
    frames: [Option<Frame>; BODY_FRAMES],
    damaged: u16,
}

impl ResultAssembler {
    /// Ready for a status.
    pub fn new() -> Self {
        Self::default()
    }

    /// Results begun and never completed, or with a wrong checksum; wraps.
    pub fn damaged(&self) -> u16 {
        self.damaged
    }

    /// Takes one frame of the monitor; the result, when this frame completes it. Other messages are passed over.
    pub fn receive(&mut self, frame: &Frame) -> Option<MonitorResult> {
        let (_, message) = Message::decode(frame).ok()?;
        let slot = match message {
            Message::Status { sequence, .. } => {
                if self.frames.first() != Some(&Some(*frame)) {
                    self.drop_open();
                }
                self.sequence = Some(sequence);
                0
            }
            Message::Unbalance { plane, .. } => 1 + usize::from(plane),
            Message::Static(_) => 3,
            Message::Dynamic(_) => 4,
            Message::Residual { .. } => 5,
            Message::ResultEnd { sequence, crc32, .. } => {
                let result = self.finish(sequence, crc32);
                if result.is_some() {
                    self.clear();
                } else {
                    self.drop_open();
                }
                return result;
            }
            _ => return None,
        };
        if self.sequence.is_some()
            && let Some(place) = self.frames.get_mut(slot)
        {
            *place = Some(*frame);
        }
        None
    }

    fn clear(&mut self) {
        self.sequence = None;
        self.frames = [None; BODY_FRAMES];
    }

    fn drop_open(&mut self) {
        if self.sequence.is_some() {
            self.damaged = self.damaged.wrapping_add(1);
        }
        self.clear();
    }

    fn finish(&self, end: u16, checksum: u32) -> Option<MonitorResult> {
        if self.sequence != Some(end) || self.frames.iter().any(Option::is_none) {
            return None;
        }
        if checksum != crc32(self.frames.iter().flatten().filter_map(Frame::full_payload)) {
            return None;
        }
        let mut result = MonitorResult {
            sequence: end,
            flags: 0,
            suspect: None,
            streak: 0,
            unbalance_g_mm: [[0.0; 2]; 2],
            static_g_mm: [0.0; 2],
            dynamic_g_mm: [0.0; 2],
            e_um: 0.0,
            ratio: 0.0,
        };
        for frame in self.frames.iter().flatten() {
            match Message::decode(frame).ok()?.1 {
                Message::Status { flags, suspect, streak, .. } => {
                    (result.flags, result.suspect, result.streak) = (flags, suspect, streak);
                }
                Message::Unbalance { plane, unbalance_g_mm } => {
                    *result.unbalance_g_mm.get_mut(usize::from(plane))? = unbalance_g_mm;
                }
                Message::Static(unbalance) => result.static_g_mm = unbalance,
                Message::Dynamic(unbalance) => result.dynamic_g_mm = unbalance,
                Message::Residual { e_um, ratio } => (result.e_um, result.ratio) = (e_um, ratio),
                _ => {}
            }
        }
        Some(result)
    }
}

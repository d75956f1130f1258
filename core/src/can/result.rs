//! A monitor's result for one reading, as frames and back (the host's side).

use heapless::Vec;

use super::frame::Frame;
use super::message::{
    Message, TYPE_DYNAMIC, TYPE_LIMITS, TYPE_RESIDUAL, TYPE_RESULT_END, TYPE_STATIC, TYPE_STATUS,
    TYPE_UNBALANCE,
};
use super::{FLAG_SUSPICIOUS, crc32};
use crate::model::{MAX_PLANES, Pair};
use crate::state::Reason;

/// Frames of a result with the most planes.
pub const MAX_RESULT_FRAMES: usize = SLOTS + 1;
/// Frames before the end, with the most planes: one for each type.
const SLOTS: usize = (TYPE_RESULT_END - TYPE_STATUS) as usize;
/// Frames before the end that are not a plane's.
const OTHERS: usize = SLOTS - MAX_PLANES;

/// What a monitor says about one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MonitorResult {
    pub sequence: u16,
    /// `FLAG_…` bits and [`flag_at_bound`](super::flag_at_bound).
    pub flags: u8,
    /// Suspected bearing, from 0.
    pub suspect: Option<u8>,
    /// Rows of the reading less unknowns; zero: the residual says nothing.
    pub redundancy: u8,
    /// Suspicious readings in a row.
    pub streak: u16,
    /// Bit i set: probe i was used.
    pub used_mask: u8,
    /// Why it is suspicious, or what else is to be said of it.
    pub reason: Reason,
    /// Planes of the model, 1 to [`MAX_PLANES`].
    pub planes: u8,
    /// `[U cos α, U sin α]` of each plane, g·mm; zero beyond `planes`.
    pub unbalance_g_mm: [Pair; MAX_PLANES],
    pub static_g_mm: Pair,
    /// Dynamic unbalance at plane 1, g·mm; NaN with three planes or more.
    pub dynamic_g_mm: Pair,
    /// `Σ|calculated − measured|`, µm.
    pub e_um: f32,
    /// The same relative to `Σ|measured|`.
    pub ratio: f32,
    /// Residual below which nothing is suspicious, µm.
    pub floor_um: f32,
    /// Level above which a rise counts, µm.
    pub level_um: f32,
}

impl MonitorResult {
    /// The reading was judged and is not suspicious: the monitor holds the next ones against it.
    pub fn is_trusted(&self) -> bool {
        self.is_judged() && self.flags & FLAG_SUSPICIOUS == 0
    }

    /// The reading says something of the model.
    pub fn is_judged(&self) -> bool {
        !matches!(self.reason, Reason::NoRedundancy | Reason::BelowNoise)
    }
}

/// The seven to ten frames of a result, in the order of sending.
pub fn result_frames(node: u8, result: &MonitorResult) -> Vec<Frame, MAX_RESULT_FRAMES> {
    let &MonitorResult { sequence, flags, suspect, redundancy, streak, used_mask, reason, .. } = result;
    let status = Message::Status { sequence, flags, suspect, redundancy, streak, used_mask, reason };
    let mut frames = Vec::from_array([status.encode(node)]);
    let planes = (0..result.planes).zip(&result.unbalance_g_mm);
    let planes = planes.map(|(plane, &unbalance_g_mm)| Message::Unbalance { plane, unbalance_g_mm });
    let others = [
        Message::Static(result.static_g_mm),
        Message::Dynamic(result.dynamic_g_mm),
        Message::Residual { e_um: result.e_um, ratio: result.ratio },
        Message::Limits { floor_um: result.floor_um, level_um: result.level_um },
    ];
    for message in planes.chain(others) {
        // Cannot be full: the capacity is that of a whole result.
        let _ = frames.push(message.encode(node));
    }
    let crc32 = crc32(frames.iter().filter_map(Frame::full_payload));
    let end = Message::ResultEnd { sequence, frames: frames.len() as u8, crc32 };
    let _ = frames.push(end.encode(node));
    frames
}

/// Puts results together from the frames of one monitor.
#[derive(Debug, Clone, Default)]
pub struct ResultAssembler {
    sequence: Option<u16>,
    frames: [Option<Frame>; SLOTS],
    damaged: u16,
}

impl ResultAssembler {
    pub fn new() -> Self {
        Self::default()
    }

    /// Results begun and never completed, or with a wrong checksum; wraps.
    pub fn damaged(&self) -> u16 {
        self.damaged
    }

    /// Takes one frame of the monitor; the result, when this frame completes it. Other messages are passed over.
    pub fn receive(&mut self, frame: &Frame) -> Option<MonitorResult> {
        match Message::decode(frame).ok()?.1 {
            Message::Status { sequence, .. } => {
                if self.frames.first() != Some(&Some(*frame)) {
                    self.drop_open();
                }
                self.sequence = Some(sequence);
            }
            Message::ResultEnd { sequence, frames, crc32 } => {
                let result = self.finish(sequence, frames, crc32);
                if result.is_some() {
                    self.clear();
                } else {
                    self.drop_open();
                }
                return result;
            }
            _ => {}
        }
        let slot = frame.message_type().wrapping_sub(TYPE_STATUS);
        if self.sequence.is_some()
            && let Some(place) = self.frames.get_mut(usize::from(slot))
        {
            *place = Some(*frame);
        }
        None
    }

    fn clear(&mut self) {
        self.sequence = None;
        self.frames = [None; SLOTS];
    }

    fn drop_open(&mut self) {
        if self.sequence.is_some() {
            self.damaged = self.damaged.wrapping_add(1);
        }
        self.clear();
    }

    fn finish(&self, end: u16, frames: u8, checksum: u32) -> Option<MonitorResult> {
        let planes =
            usize::from(frames).checked_sub(OTHERS).filter(|planes| (1..=MAX_PLANES).contains(planes))?;
        let expected = (TYPE_UNBALANCE..).take(planes).chain([
            TYPE_STATUS,
            TYPE_STATIC,
            TYPE_DYNAMIC,
            TYPE_RESIDUAL,
            TYPE_LIMITS,
        ]);
        let is_there = |kind| self.frames.iter().flatten().any(|frame| frame.message_type() == kind);
        let number = self.frames.iter().flatten().count();
        let is_whole = number == usize::from(frames) && expected.into_iter().all(is_there);
        if self.sequence != Some(end)
            || !is_whole
            || checksum != crc32(self.frames.iter().flatten().filter_map(Frame::full_payload))
        {
            return None;
        }
        let mut result = MonitorResult {
            sequence: end,
            flags: 0,
            suspect: None,
            redundancy: 0,
            streak: 0,
            used_mask: 0,
            reason: Reason::None,
            planes: planes as u8,
            unbalance_g_mm: [[0.0; 2]; MAX_PLANES],
            static_g_mm: [0.0; 2],
            dynamic_g_mm: [0.0; 2],
            e_um: 0.0,
            ratio: 0.0,
            floor_um: 0.0,
            level_um: 0.0,
        };
        for frame in self.frames.iter().flatten() {
            match Message::decode(frame).ok()?.1 {
                Message::Status { flags, suspect, redundancy, streak, used_mask, reason, .. } => {
                    (result.flags, result.suspect, result.streak) = (flags, suspect, streak);
                    (result.redundancy, result.used_mask, result.reason) = (redundancy, used_mask, reason);
                }
                Message::Unbalance { plane, unbalance_g_mm } => {
                    *result.unbalance_g_mm.get_mut(usize::from(plane))? = unbalance_g_mm;
                }
                Message::Static(unbalance) => result.static_g_mm = unbalance,
                Message::Dynamic(unbalance) => result.dynamic_g_mm = unbalance,
                Message::Residual { e_um, ratio } => (result.e_um, result.ratio) = (e_um, ratio),
                Message::Limits { floor_um, level_um } => {
                    (result.floor_um, result.level_um) = (floor_um, level_um);
                }
                _ => {}
            }
        }
        Some(result)
    }
}

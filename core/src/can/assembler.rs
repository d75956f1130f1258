//! From frames to readings, and from a reading to frames.
//!
//! A start opens a reading, vectors fill their slots in any order, the end must match in sequence and checksum. Frames
//! that arrive twice do no harm. The sequence number decides what a whole reading is: the next one, one after a gap
//! (the gap is counted as lost), the same again (repeated), or older by up to half the range (late).
//!
//! A sender that restarts falls back in sequence and looks late. When [`RESYNCHRONISE_AFTER`] older starts arrive in
//! ascending order with nothing newer between them, the last of them is followed. A fall by more than half the range
//! cannot be told from a jump ahead: it is followed at once and counted as that many lost. Nor can a burst of old
//! readings from a gateway be told from a restart; the numbers then fall back and recover with the next new reading.

use heapless::Vec;

use super::counters::{Counters, count};
use super::crc32;
use super::frame::Frame;
use super::message::{CanError, Keyphasor, Message};
use crate::reading::{ProbeVector, Reading};

/// Probes of a reading on the bus.
const PROBES: usize = 4;

/// Frames of a reading.
pub const READING_FRAMES: usize = PROBES + 2;
/// Older starts in ascending order after which a sender is taken to have restarted.
pub const RESYNCHRONISE_AFTER: u8 = 3;

/// A whole reading with its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberedReading {
    /// Number given by the sender.
    pub sequence: u16,
    /// What is known of its phase reference.
    pub keyphasor: Keyphasor,
    /// The reading; a lost probe is [`ProbeVector::LOST`].
    pub reading: Reading,
}

#[derive(Debug, Clone, Copy)]
enum Stage {
    Closed,
    /// Within a repeated or late transmission, whose frames are dropped without being stray.
    Passing,
    Open(Open),
}

#[derive(Debug, Clone, Copy)]
struct Open {
    since_us: u64,
    sequence: u16,
    valid_mask: u8,
    keyphasor: Keyphasor,
    speed_rpm: f32,
    start: [u8; 8],
    vectors: [Option<(ProbeVector, [u8; 8])>; PROBES],
    /// The sender restarted: the gap to the last reading means nothing.
    restarted: bool,
}

/// Puts readings together from the frames of one sender.
#[derive(Debug, Clone)]
pub struct Assembler {
    stage: Stage,
    last: Option<u16>,
    /// Last older start, and how many came in ascending order.
    older: Option<(u16, u8)>,
    counters: Counters,
}

impl NumberedReading {
    /// A reading whose sender says nothing of its keyphasor.
    pub fn new(sequence: u16, reading: Reading) -> Self {
        Self { sequence, keyphasor: Keyphasor::NotStated, reading }
    }
}

impl Default for Assembler {
    fn default() -> Self {
        Self::new()
    }
}

impl Assembler {
    /// Ready for a first reading of any sequence number.
    pub fn new() -> Self {
        Self { stage: Stage::Closed, last: None, older: None, counters: Counters::default() }
    }

    /// Takes any sequence number next; counters go on.
    pub fn restart(&mut self) {
        *self = Self { counters: self.counters, ..Self::new() };
    }

    /// What was counted so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    pub(crate) fn counters_mut(&mut self) -> &mut Counters {
        &mut self.counters
    }

    /// Drops an open reading older than `timeout_us`.
    pub fn poll(&mut self, timeout_us: u64, time_us: u64) {
        if let Stage::Open(open) = &self.stage
            && time_us.saturating_sub(open.since_us) > timeout_us
        {
            self.abandon();
        }
    }

    /// Takes one frame of the sender; the reading, when this frame completes it. Other messages are passed over.
    pub fn receive(&mut self, timeout_us: u64, time_us: u64, frame: &Frame) -> Option<NumberedReading> {
        self.poll(timeout_us, time_us);
        match (Message::decode(frame), frame.full_payload()) {
            (Ok((_, Message::ReadingStart { sequence, valid_mask, keyphasor, speed_rpm })), Some(&start)) => {
                let vectors = [None; PROBES];
                let since_us = time_us;
                self.start(Open {
                    since_us,
                    sequence,
                    valid_mask,
                    keyphasor,
                    speed_rpm,
                    start,
                    vectors,
                    restarted: false,
                });
                None
            }
            (Ok((_, Message::ProbeVector { probe, vector })), Some(&payload)) => {
                self.vector(probe, vector, payload);
                None
            }
            (Ok((_, Message::ReadingEnd { sequence, crc32, .. })), _) => self.end(sequence, crc32),
            (Err(CanError::WrongLength | CanError::BadValue), _) => {
                count(&mut self.counters.stray, 1);
                None
            }
            _ => None,
        }
    }

    fn abandon(&mut self) {
        count(&mut self.counters.incomplete, 1);
        self.stage = Stage::Closed;
    }

    fn start(&mut self, mut open: Open) {
        if let Stage::Open(present) = &self.stage {
            if present.start == open.start {
                return;
            }
            self.abandon();
        }
        let ahead = self.last.map_or(1, |last| open.sequence.wrapping_sub(last));
        self.stage = if ahead == 0 {
            count(&mut self.counters.repeated, 1);
            Stage::Passing
        } else if is_ahead(ahead) {
            Stage::Open(open)
        } else if self.restarted(open.sequence) {
            open.restarted = true;
            Stage::Open(open)
        } else {
            count(&mut self.counters.late, 1);
            Stage::Passing
        };
    }

    /// Whether this older start is the last of enough in ascending order.
    fn restarted(&mut self, sequence: u16) -> bool {
        let in_a_row = match self.older {
            Some((before, number)) if is_ahead(sequence.wrapping_sub(before)) => number.saturating_add(1),
            _ => 1,
        };
        self.older = Some((sequence, in_a_row));
        in_a_row >= RESYNCHRONISE_AFTER
    }

    fn vector(&mut self, probe: u8, vector: ProbeVector, payload: [u8; 8]) {
        match &mut self.stage {
            Stage::Open(open) => {
                if let Some(slot) = open.vectors.get_mut(usize::from(probe)) {
                    *slot = Some((vector, payload));
                }
            }
            Stage::Passing => {}
            Stage::Closed => count(&mut self.counters.stray, 1),
        }
    }

    fn end(&mut self, sequence: u16, checksum: u32) -> Option<NumberedReading> {
        let open = match self.stage {
            Stage::Open(open) => open,
            Stage::Passing => {
                self.stage = Stage::Closed;
                return None;
            }
            Stage::Closed => {
                count(&mut self.counters.stray, 1);
                return None;
            }
        };
        let [Some(v0), Some(v1), Some(v2), Some(v3)] = open.vectors else {
            self.abandon();
            return None;
        };
        self.stage = Stage::Closed;
        let payloads = [open.start, v0.1, v1.1, v2.1, v3.1];
        if sequence != open.sequence || checksum != crc32(payloads.iter()) {
            count(&mut self.counters.rejected, 1);
            return None;
        }
        self.accept(&open);
        let mut probes = [v0.0, v1.0, v2.0, v3.0];
        for (number, probe) in probes.iter_mut().enumerate() {
            if open.valid_mask >> number & 1 == 0 {
                *probe = ProbeVector::LOST;
            }
        }
        Some(NumberedReading {
            sequence,
            keyphasor: open.keyphasor,
            reading: Reading::new(open.speed_rpm, &probes)?,
        })
    }

    fn accept(&mut self, open: &Open) {
        if open.restarted {
            count(&mut self.counters.resynchronised, 1);
        } else if let Some(last) = self.last {
            count(&mut self.counters.lost, open.sequence.wrapping_sub(last).wrapping_sub(1));
        }
        self.last = Some(open.sequence);
        self.older = None;
    }
}

/// A difference of sequence numbers that means forwards.
fn is_ahead(difference: u16) -> bool {
    (1..0x8000).contains(&difference)
}

/// The six frames of a reading, in the order of sending.
pub fn reading_frames(
    node: u8,
    &NumberedReading { sequence, keyphasor, reading }: &NumberedReading,
) -> Vec<Frame, READING_FRAMES> {
    let mut valid_mask = 0;
    for (number, probe) in reading.probes().iter().enumerate() {
        valid_mask |= u8::from(probe.is_finite()) << number;
    }
    let speed_rpm = reading.speed_rpm;
    let start = Message::ReadingStart { sequence, valid_mask, keyphasor, speed_rpm }.encode(node);
    let mut frames = Vec::from_array([start]);
    for (probe, &vector) in (0..).zip(reading.probes()) {
        // Cannot be full: the capacity is that of a whole reading.
        let _ = frames.push(Message::ProbeVector { probe, vector }.encode(node));
    }
    let crc32 = crc32(frames.iter().filter_map(Frame::full_payload));
    let _ = frames.push(Message::ReadingEnd { sequence, count: PROBES as u8, crc32 }.encode(node));
    frames
}

//! From frames to readings, and from a reading to frames.
//!
//! A start opens a reading, the others fill their slots in any order, the end must match in sequence, number and checksum. Frames
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
use super::message::{CanError, GAP_NOT_STATED_MV, Message, TYPE_READING_END, TYPE_READING_START};
use crate::reading::{Keyphasor, MAX_PROBES, ProbeVector, Reading};

/// Frames of a reading of the most probes with gap voltages.
pub const MAX_READING_FRAMES: usize = SLOTS + 1;
/// Frames before the end, at most: one for each type.
const SLOTS: usize = (TYPE_READING_END - TYPE_READING_START) as usize;
/// Probes whose gap voltages share a frame.
const GAP_GROUP: usize = 4;
/// Older starts in ascending order after which a sender is taken to have restarted.
pub const RESYNCHRONISE_AFTER: u8 = 3;

/// A whole reading with its number.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
    /// The frames so far, by their type.
    frames: [Option<Frame>; SLOTS],
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
        match Message::decode(frame) {
            Ok((_, Message::ReadingStart { sequence, .. })) => self.start(time_us, sequence, frame),
            Ok((_, Message::ProbeVector { .. } | Message::Gaps { .. })) => self.part(frame),
            Ok((_, Message::ReadingEnd { sequence, frames, crc32 })) => {
                return self.end(sequence, frames, crc32);
            }
            Err(CanError::WrongLength | CanError::BadValue) => count(&mut self.counters.stray, 1),
            _ => {}
        }
        None
    }

    /// When [`Assembler::poll`] has something to do.
    pub(crate) fn poll_at(&self, timeout_us: u64) -> Option<u64> {
        match &self.stage {
            Stage::Open(open) => Some(open.since_us.saturating_add(timeout_us).saturating_add(1)),
            _ => None,
        }
    }

    fn abandon(&mut self) {
        count(&mut self.counters.incomplete, 1);
        self.stage = Stage::Closed;
    }

    fn start(&mut self, since_us: u64, sequence: u16, frame: &Frame) {
        let mut open = Open { since_us, sequence, frames: [None; SLOTS], restarted: false };
        if let Stage::Open(present) = &self.stage {
            if present.frames.first() == Some(&Some(*frame)) {
                return;
            }
            self.abandon();
        }
        open.put(frame);
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

    fn part(&mut self, frame: &Frame) {
        match &mut self.stage {
            Stage::Open(open) => open.put(frame),
            Stage::Passing => {}
            Stage::Closed => count(&mut self.counters.stray, 1),
        }
    }

    fn end(&mut self, sequence: u16, frames: u8, checksum: u32) -> Option<NumberedReading> {
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
        if open.payloads().count() != usize::from(frames) {
            self.abandon();
            return None;
        }
        self.stage = Stage::Closed;
        let numbered =
            open.reading().filter(|_| sequence == open.sequence && checksum == crc32(open.payloads()));
        if numbered.is_none() {
            count(&mut self.counters.rejected, 1);
        } else {
            self.accept(&open);
        }
        numbered
    }

    fn accept(&mut self, open: &Open) {
        if open.restarted {
            count(&mut self.counters.resynchronised, 1);
        } else if let Some(last) = self.last {
            count(&mut self.counters.lost, open.sequence.wrapping_sub(last).wrapping_sub(1).into());
        }
        self.last = Some(open.sequence);
        self.older = None;
    }
}

impl Open {
    fn put(&mut self, frame: &Frame) {
        let slot = frame.message_type().wrapping_sub(TYPE_READING_START);
        if let Some(place) = self.frames.get_mut(usize::from(slot)) {
            *place = Some(*frame);
        }
    }

    /// In rising order of type.
    fn payloads(&self) -> impl Iterator<Item = &[u8; 8]> {
        self.frames.iter().flatten().filter_map(Frame::full_payload)
    }

    /// `None` if the start names no number of probes that can be, or other frames came than it asks for.
    fn reading(&self) -> Option<NumberedReading> {
        let mut vectors = [None; MAX_PROBES];
        let mut gaps_v = [f32::NAN; MAX_PROBES];
        let mut start = None;
        for frame in self.frames.iter().flatten() {
            match Message::decode(frame).ok()?.1 {
                Message::ReadingStart { valid_mask, keyphasor, probes, speed_rpm, .. } => {
                    start = Some((valid_mask, keyphasor, usize::from(probes), speed_rpm));
                }
                Message::ProbeVector { probe, vector } => {
                    *vectors.get_mut(usize::from(probe))? = Some(vector);
                }
                Message::Gaps { group, gaps_mv } => {
                    let places = gaps_v.iter_mut().skip(usize::from(group) * GAP_GROUP);
                    for (gap_v, mv) in places.zip(gaps_mv) {
                        *gap_v = if mv == GAP_NOT_STATED_MV { f32::NAN } else { f32::from(mv) / 1000.0 };
                    }
                }
                _ => return None,
            }
        }
        let (valid_mask, keyphasor, probes, speed_rpm) = start?;
        let (expected, beyond) = vectors.split_at_checked(probes)?;
        if beyond.iter().any(Option::is_some) {
            return None;
        }
        let mut found: Vec<ProbeVector, MAX_PROBES> = Vec::new();
        for vector in expected {
            found.push((*vector)?).ok()?;
        }
        let mut reading = Reading::new(speed_rpm, &found)?.with_gaps_v(&gaps_v);
        reading.lose(!valid_mask);
        Some(NumberedReading { sequence: self.sequence, keyphasor, reading })
    }
}

/// A difference of sequence numbers that means forwards.
fn is_ahead(difference: u16) -> bool {
    (1..0x8000).contains(&difference)
}

/// The frames of a reading, in the order of sending: three to twelve.
pub fn reading_frames(
    node: u8,
    &NumberedReading { sequence, keyphasor, reading }: &NumberedReading,
) -> Vec<Frame, MAX_READING_FRAMES> {
    let (valid_mask, speed_rpm) = (reading.valid_mask(), reading.speed_rpm);
    let probes = reading.probes().len() as u8;
    let start = Message::ReadingStart { sequence, valid_mask, keyphasor, probes, speed_rpm };
    let mut frames = Vec::from_array([start.encode(node)]);
    let vectors = (0..).zip(reading.probes());
    let vectors = vectors.map(|(probe, &vector)| Message::ProbeVector { probe, vector });
    let gaps = (0..).zip(reading.gaps_v().chunks(GAP_GROUP));
    let gaps = gaps
        .filter(|(_, gaps_v)| gaps_v.iter().any(|gap_v| gap_v.is_finite()))
        .map(|(group, gaps_v)| Message::Gaps { group, gaps_mv: gaps_mv(gaps_v) });
    for message in vectors.chain(gaps) {
        // Cannot be full: the capacity is that of a whole reading.
        let _ = frames.push(message.encode(node));
    }
    let crc32 = crc32(frames.iter().filter_map(Frame::full_payload));
    let end = Message::ReadingEnd { sequence, frames: frames.len() as u8, crc32 };
    let _ = frames.push(end.encode(node));
    frames
}

/// Volts as whole millivolts, those that do not fit as the nearest that do.
fn gaps_mv(gaps_v: &[f32]) -> [i16; GAP_GROUP] {
    let mut gaps_mv = [GAP_NOT_STATED_MV; GAP_GROUP];
    for (gap_mv, gap_v) in gaps_mv.iter_mut().zip(gaps_v) {
        if gap_v.is_finite() {
            let half = if *gap_v < 0.0 { -0.5 } else { 0.5 };
            // The cast cuts off and saturates; the least number means that nothing is stated.
            *gap_mv = ((1000.0 * gap_v + half) as i16).max(GAP_NOT_STATED_MV + 1);
        }
    }
    gaps_mv
}

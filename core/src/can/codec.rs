//! Each message as eight bytes, there and back.

use super::counters::COUNTER_PAIRS;
use super::frame::Frame;
use super::message::{
    CanError, Message, TYPE_COUNTERS, TYPE_DYNAMIC, TYPE_GAPS, TYPE_HEARTBEAT, TYPE_LIMITS, TYPE_MODEL,
    TYPE_READING_END, TYPE_READING_START, TYPE_RESIDUAL, TYPE_RESULT_END, TYPE_STATE, TYPE_STATIC,
    TYPE_STATUS, TYPE_UNBALANCE, TYPE_VECTOR, TYPE_VERSION, TYPE_VERSION_QUERY,
};
use crate::reading::{Keyphasor, ProbeVector};
use crate::state::{NodeState, Reason, Status};

const NIBBLE: u8 = 0xf;
/// Bits of a latched cause; the suspected bearing is above them.
const CAUSE_BITS: u32 = 5;

impl Message {
    /// The frame for a node (its low five bits count).
    pub fn encode(&self, node: u8) -> Frame {
        let (message_type, payload) = match *self {
            Self::ReadingStart { sequence, valid_mask, keyphasor, probes, speed_rpm } => {
                let head = head(sequence, valid_mask, nibbles(keyphasor as u8, probes));
                (TYPE_READING_START, join(head, speed_rpm.to_le_bytes()))
            }
            Self::ProbeVector { probe, vector } => {
                (TYPE_VECTOR + (probe & 7), two_f32([vector.cos_um, vector.sin_um]))
            }
            Self::Gaps { group, gaps_mv } => {
                let [[a, b], [c, d], [e, f], [g, h]] = gaps_mv.map(i16::to_le_bytes);
                (TYPE_GAPS + (group & 1), [a, b, c, d, e, f, g, h])
            }
            Self::ReadingEnd { sequence, frames, crc32 } => {
                (TYPE_READING_END, join(head(sequence, frames, 0), crc32.to_le_bytes()))
            }
            Self::Status { sequence, flags, suspect, redundancy, streak, used_mask, reason } => {
                let lower = head(sequence, flags, nibbles(from_one(suspect, NIBBLE), redundancy));
                (TYPE_STATUS, join(lower, head(streak, used_mask, reason.code())))
            }
            Self::Unbalance { plane, unbalance_g_mm } => {
                (TYPE_UNBALANCE + (plane & 3), two_f32(unbalance_g_mm))
            }
            Self::Static(unbalance_g_mm) => (TYPE_STATIC, two_f32(unbalance_g_mm)),
            Self::Dynamic(unbalance_g_mm) => (TYPE_DYNAMIC, two_f32(unbalance_g_mm)),
            Self::Residual { e_um, ratio } => (TYPE_RESIDUAL, two_f32([e_um, ratio])),
            Self::Limits { floor_um, level_um } => (TYPE_LIMITS, two_f32([floor_um, level_um])),
            Self::ResultEnd { sequence, frames, crc32 } => {
                (TYPE_RESULT_END, join(head(sequence, frames, 0), crc32.to_le_bytes()))
            }
            Self::Heartbeat { version, state, reason, missing_mask, readings } => {
                let lower = [version, state as u8, reason.code(), missing_mask];
                (TYPE_HEARTBEAT, join(lower, readings.to_le_bytes()))
            }
            Self::State(Status { state, reason, missing_mask, cause, suspect, age_s }) => {
                let cause = cause.code() & ((1 << CAUSE_BITS) - 1) | from_one(suspect, 7) << CAUSE_BITS;
                (TYPE_STATE, join([state as u8, reason.code(), missing_mask, cause], age_s.to_le_bytes()))
            }
            Self::Counters { pair, values: [first, second] } => {
                let pair = pair.min(COUNTER_PAIRS as u8 - 1);
                (TYPE_COUNTERS + pair, join(first.to_le_bytes(), second.to_le_bytes()))
            }
            Self::Model { checksum, probes, planes, on_trial } => {
                (TYPE_MODEL, join(checksum.to_le_bytes(), [probes, planes, on_trial.into(), 0]))
            }
            Self::Version { protocol, oldest, model_schema, shapes, probes, planes } => {
                (TYPE_VERSION, join([protocol, oldest, model_schema, shapes], [probes, planes, 0, 0]))
            }
            Self::VersionQuery => return Frame::empty(TYPE_VERSION_QUERY, node),
        };
        Frame::full(message_type, node, payload)
    }

    /// Node and meaning of a frame.
    ///
    /// Errors: [`CanError`].
    pub fn decode(frame: &Frame) -> Result<(u8, Self), CanError> {
        let message_type = frame.message_type();
        if message_type == TYPE_VERSION_QUERY {
            return Ok((frame.node(), Self::VersionQuery));
        }
        let known = matches!(
            message_type,
            TYPE_READING_START..=TYPE_RESULT_END | TYPE_HEARTBEAT..=TYPE_MODEL | TYPE_VERSION
        );
        if !known {
            return Err(CanError::UnknownType);
        }
        let &[a, b, c, d, e, f, g, h] = frame.full_payload().ok_or(CanError::WrongLength)?;
        let (lower, upper) = ([a, b, c, d], [e, f, g, h]);
        let sequence = u16::from_le_bytes([a, b]);
        let pair = [f32::from_le_bytes(lower), f32::from_le_bytes(upper)];
        let words = [u32::from_le_bytes(lower), u32::from_le_bytes(upper)];
        let message = match message_type {
            TYPE_READING_START => Self::ReadingStart {
                sequence,
                valid_mask: c,
                keyphasor: known_value(Keyphasor::ALL.get(usize::from(d & NIBBLE)).copied())?,
                probes: d >> 4,
                speed_rpm: pair[1],
            },
            TYPE_VECTOR..TYPE_GAPS => {
                let [cos_um, sin_um] = pair;
                let probe = message_type - TYPE_VECTOR;
                Self::ProbeVector { probe, vector: ProbeVector { cos_um, sin_um } }
            }
            TYPE_GAPS..TYPE_READING_END => {
                let gaps_mv = [[a, b], [c, d], [e, f], [g, h]].map(i16::from_le_bytes);
                Self::Gaps { group: message_type - TYPE_GAPS, gaps_mv }
            }
            TYPE_READING_END => Self::ReadingEnd { sequence, frames: c, crc32: words[1] },
            TYPE_STATUS => Self::Status {
                sequence,
                flags: c,
                suspect: (d & NIBBLE).checked_sub(1),
                redundancy: d >> 4,
                streak: u16::from_le_bytes([e, f]),
                used_mask: g,
                reason: Reason::from_code(h),
            },
            TYPE_UNBALANCE..TYPE_STATIC => {
                Self::Unbalance { plane: message_type - TYPE_UNBALANCE, unbalance_g_mm: pair }
            }
            TYPE_STATIC => Self::Static(pair),
            TYPE_DYNAMIC => Self::Dynamic(pair),
            TYPE_RESIDUAL => Self::Residual { e_um: pair[0], ratio: pair[1] },
            TYPE_LIMITS => Self::Limits { floor_um: pair[0], level_um: pair[1] },
            TYPE_RESULT_END => Self::ResultEnd { sequence, frames: c, crc32: words[1] },
            TYPE_HEARTBEAT => Self::Heartbeat {
                version: a,
                state: known_value(NodeState::from_code(b))?,
                reason: Reason::from_code(c),
                missing_mask: d,
                readings: words[1],
            },
            TYPE_STATE => Self::State(Status {
                state: known_value(NodeState::from_code(a))?,
                reason: Reason::from_code(b),
                missing_mask: c,
                cause: Reason::from_code(d & ((1 << CAUSE_BITS) - 1)),
                suspect: (d >> CAUSE_BITS).checked_sub(1),
                age_s: pair[1],
            }),
            TYPE_MODEL => Self::Model { checksum: words[0], probes: e, planes: f, on_trial: g & 1 != 0 },
            TYPE_VERSION => {
                Self::Version { protocol: a, oldest: b, model_schema: c, shapes: d, probes: e, planes: f }
            }
            _ => Self::Counters { pair: message_type.wrapping_sub(TYPE_COUNTERS), values: words },
        };
        Ok((frame.node(), message))
    }
}

fn known_value<T>(value: Option<T>) -> Result<T, CanError> {
    value.ok_or(CanError::BadValue)
}

/// A number from 0 as one from 1, zero for none, at most `greatest`.
fn from_one(number: Option<u8>, greatest: u8) -> u8 {
    number.map_or(0, |number| number.saturating_add(1).min(greatest))
}

fn nibbles(low: u8, high: u8) -> u8 {
    low.min(NIBBLE) | high.min(NIBBLE) << 4
}

fn head(number: u16, third: u8, fourth: u8) -> [u8; 4] {
    let [a, b] = number.to_le_bytes();
    [a, b, third, fourth]
}

fn join([a, b, c, d]: [u8; 4], [e, f, g, h]: [u8; 4]) -> [u8; 8] {
    [a, b, c, d, e, f, g, h]
}

fn two_f32([first, second]: [f32; 2]) -> [u8; 8] {
    join(first.to_le_bytes(), second.to_le_bytes())
}

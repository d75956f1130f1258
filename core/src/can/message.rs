//! What the messages are.

use core::error::Error;
use core::fmt;

use crate::model::Pair;
use crate::reading::{Keyphasor, ProbeVector};
use crate::state::{NodeState, Reason, Status};

/// Version of this protocol, carried by the heartbeat.
pub const PROTOCOL_VERSION: u8 = 3;
/// Oldest version whose frames still mean the same.
pub const OLDEST_PROTOCOL_VERSION: u8 = 3;

pub const TYPE_READING_START: u8 = 8;
/// Type of the first [`Message::ProbeVector`]; the other seven follow.
pub(super) const TYPE_VECTOR: u8 = 9;
/// Type of the first [`Message::Gaps`]; the other follows.
pub(super) const TYPE_GAPS: u8 = 17;
pub const TYPE_READING_END: u8 = 19;
pub const TYPE_STATUS: u8 = 20;
/// Type of the first [`Message::Unbalance`]; the other three follow.
pub(super) const TYPE_UNBALANCE: u8 = 21;
pub(super) const TYPE_STATIC: u8 = 25;
pub(super) const TYPE_DYNAMIC: u8 = 26;
pub(super) const TYPE_RESIDUAL: u8 = 27;
pub(super) const TYPE_LIMITS: u8 = 28;
pub const TYPE_RESULT_END: u8 = 29;
pub const TYPE_HEARTBEAT: u8 = 32;
pub const TYPE_STATE: u8 = 33;
/// Type of the first [`Message::Counters`]; the others follow.
pub(super) const TYPE_COUNTERS: u8 = 34;
pub const TYPE_MODEL: u8 = 44;
/// Type of the ISO-TP frames towards a node.
pub const TYPE_TO_NODE: u8 = 48;
/// Type of the ISO-TP frames from a node.
pub const TYPE_TO_HOST: u8 = 49;
pub const TYPE_OFFER: u8 = 50;
/// Type of a part of a request.
pub const TYPE_PART: u8 = 51;
/// Type of an [`Ack`](super::parts::Ack).
pub const TYPE_ACK: u8 = 52;
/// Type of a part of an answer.
pub const TYPE_ANSWER_PART: u8 = 53;
pub const TYPE_VERSION: u8 = 62;
pub const TYPE_VERSION_QUERY: u8 = 63;
/// Type of the first frame of a reading's MAC.
#[cfg(feature = "mac")]
pub const TYPE_READING_NONCE: u8 = 30;
/// Type of the second frame of a reading's MAC.
#[cfg(feature = "mac")]
pub const TYPE_READING_CODE: u8 = 31;
/// Type of the first frame of the MAC of what a node tells.
#[cfg(feature = "mac")]
pub const TYPE_TOLD_NONCE: u8 = 45;
/// Type of the second frame of the MAC of what a node tells.
#[cfg(feature = "mac")]
pub const TYPE_TOLD_CODE: u8 = 46;

/// Status flag: the reading is suspicious.
pub const FLAG_SUSPICIOUS: u8 = 1;
/// Status flag: suspicion persisted.
pub const FLAG_FLAGGED: u8 = 2;

/// Status flag: the unbalance of a plane, from 0 to 3, lies on its bound.
pub const fn flag_at_bound(plane: u8) -> u8 {
    4 << (plane & 3)
}

/// In place of a gap voltage, mV: it is not stated.
pub const GAP_NOT_STATED_MV: i16 = i16::MIN;

/// One frame's meaning. Bytes named reserved are sent as zero and ignored when received.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Message {
    /// Opens a reading. u16 sequence, u8 mask, u8 keyphasor (low nibble) and probes (high nibble), f32 speed.
    ReadingStart {
        /// Number of the reading, wrapping.
        sequence: u16,
        /// Bit i set: probe i gave a value.
        valid_mask: u8,
        /// What is known of the phase reference.
        keyphasor: Keyphasor,
        /// Probes of the reading, 0 to 15 on the wire; an assembler takes 1 to 8.
        probes: u8,
        speed_rpm: f32,
    },
    /// One probe. f32 cos, f32 sin.
    ProbeVector {
        /// 0 to 7, in the order of the model (carried by the type).
        probe: u8,
        /// µm zero-to-peak; NaN in both for a lost probe.
        vector: ProbeVector,
    },
    /// Gap voltages of four probes: four i16, mV. Sent only if one of them is stated.
    Gaps {
        /// 0: probes 0 to 3, 1: probes 4 to 7 (carried by the type).
        group: u8,
        /// mV; [`GAP_NOT_STATED_MV`] if not stated.
        gaps_mv: [i16; 4],
    },
    /// Closes a reading. u16 sequence, u8 frames, u8 reserved, u32 checksum.
    ReadingEnd {
        /// That of [`Self::ReadingStart`].
        sequence: u16,
        /// Frames before this one.
        frames: u8,
        /// CRC-32 over their payloads, in rising order of type.
        crc32: u32,
    },
    /// Opens a result. u16 sequence, u8 flags, u8 suspect (low nibble, 0 none) and redundancy (high nibble), u16 streak,
    /// u8 mask, u8 reason.
    Status {
        sequence: u16,
        /// `FLAG_…` bits and [`flag_at_bound`].
        flags: u8,
        /// Suspected bearing, from 0, at most 14.
        suspect: Option<u8>,
        /// Rows of the reading less unknowns, at most 15; zero: the residual says nothing.
        redundancy: u8,
        /// Suspicious readings in a row.
        streak: u16,
        /// Bit i set: probe i was used.
        used_mask: u8,
        /// Why it is suspicious, or what else is to be said of it.
        reason: Reason,
    },
    /// Unbalance of a plane. f32 U cos α, f32 U sin α.
    Unbalance {
        /// 0 to 3 (carried by the type).
        plane: u8,
        unbalance_g_mm: Pair,
    },
    /// Static unbalance. f32 U cos α, f32 U sin α, g·mm.
    Static(Pair),
    /// Dynamic unbalance at plane 1. f32 U cos α, f32 U sin α, g·mm; NaN with three planes or more.
    Dynamic(Pair),
    /// f32 e, f32 e/f.
    Residual {
        /// `Σ|calculated − measured|`, µm.
        e_um: f32,
        /// The same relative to `Σ|measured|`.
        ratio: f32,
    },
    /// What the residual was held against. f32 floor, f32 level.
    Limits {
        /// Residual below which nothing is suspicious, µm.
        floor_um: f32,
        /// Level above which a rise counts, µm.
        level_um: f32,
    },
    /// Closes a result. u16 sequence, u8 frames, u8 reserved, u32 checksum.
    ResultEnd {
        /// That of [`Self::Status`].
        sequence: u16,
        /// Frames before this one: five and one for each plane.
        frames: u8,
        /// CRC-32 over their payloads.
        crc32: u32,
    },
    /// Sign of life. u8 version, u8 state, u8 reason, u8 mask, u32 readings.
    Heartbeat {
        /// [`PROTOCOL_VERSION`] of the sender.
        version: u8,
        /// What the node is doing.
        state: NodeState,
        reason: Reason,
        /// As in [`Status`].
        missing_mask: u8,
        /// Readings evaluated.
        readings: u32,
    },
    /// At once when it changes, and after a heartbeat. u8 state, u8 reason, u8 mask, u8 cause (low five bits) and suspect
    /// (high three bits, 0 none), f32 age.
    State(Status),
    /// Two of the [`Counters`](super::Counters), u32 each, in their order.
    Counters {
        /// Which two, 0 to 9 (carried by the type).
        pair: u8,
        values: [u32; 2],
    },
    /// Which model is in use. u32 checksum, u8 probes, u8 planes, u8 on trial (its lowest bit; the others reserved), u8
    /// reserved; all zero without one.
    Model {
        /// [`Model::checksum`](crate::model::Model::checksum).
        checksum: u32,
        probes: u8,
        planes: u8,
        /// It is on trial: used, not stored, and replaced by the one before unless it is confirmed.
        on_trial: bool,
    },
    /// Answer to the query. Six u8, then u16 reserved. No version changes it.
    Version {
        protocol: u8,
        /// [`OLDEST_PROTOCOL_VERSION`].
        oldest: u8,
        model_schema: u8,
        /// Basis shapes of its model.
        shapes: u8,
        /// Probes that it can hold.
        probes: u8,
        /// Planes that it can hold.
        planes: u8,
    },
    /// Asks a node, or all with [`BROADCAST_NODE`](super::BROADCAST_NODE), for its version. No payload; no version changes it.
    VersionQuery,
}

/// Why a frame has no meaning here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CanError {
    /// The type is not one of this version.
    UnknownType,
    /// Not eight bytes.
    WrongLength,
    /// A byte with few allowed values has another.
    BadValue,
}

impl fmt::Display for CanError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::UnknownType => "the frame's type is not one of this protocol version",
            Self::WrongLength => "the frame does not have eight bytes",
            Self::BadValue => "a byte of the frame has a value that is not allowed",
        })
    }
}

impl Error for CanError {}

//! Each message as eight bytes, there and back.

use super::frame::Frame;
use crate::model::Pair;
use crate::reading::ProbeVector;
use crate::residual::Bearing;

/// Version of this protocol, carried by the heartbeat.
pub const PROTOCOL_VERSION: u8 = 2;
/// Oldest version whose frames still mean the same.
pub const OLDEST_PROTOCOL_VERSION: u8 = 1;

/// Type of [`Message::ReadingStart`].
pub const TYPE_READING_START: u8 = 8;
/// Type of the first [`Message::ProbeVector`]; the other three follow.
const TYPE_VECTOR: u8 = 9;
/// Type of [`Message::ReadingEnd`].
pub const TYPE_READING_END: u8 = 13;
/// Type of [`Message::Status`].
pub const TYPE_STATUS: u8 = 16;
const TYPE_UNBALANCE: u8 = 17;
const TYPE_STATIC: u8 = 19;
const TYPE_DYNAMIC: u8 = 20;
const TYPE_RESIDUAL: u8 = 21;
/// Type of [`Message::ResultEnd`].
pub const TYPE_RESULT_END: u8 = 22;
pub(super) const TYPE_HEARTBEAT: u8 = 32;
const TYPE_COUNTERS: u8 = 33;
const TYPE_DISCARDS: u8 = 34;
const TYPE_COMMANDS: u8 = 35;
pub(super) const TYPE_TRANSFERS: u8 = 36;
/// Type of the ISO-TP frames towards a node.
pub const TYPE_TO_NODE: u8 = 48;
/// Type of the ISO-TP frames from a node.
pub const TYPE_TO_HOST: u8 = 49;
/// Type of [`Message::Version`].
pub const TYPE_VERSION: u8 = 62;
/// Type of [`Message::VersionQuery`].
pub const TYPE_VERSION_QUERY: u8 = 63;

/// Status flag: the reading is suspicious.
pub const FLAG_SUSPICIOUS: u8 = 1;
/// Status flag: suspicion persisted.
pub const FLAG_FLAGGED: u8 = 2;
/// Status flag: the unbalance of plane 1 lies on its bound.
pub const FLAG_AT_BOUND_1: u8 = 4;
/// Status flag: the unbalance of plane 2 lies on its bound.
pub const FLAG_AT_BOUND_2: u8 = 8;

/// What the sender of a reading knows of its keyphasor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Keyphasor {
    /// Nothing was said.
    #[default]
    NotStated,
    /// One mark a turn, steady.
    Locked,
    /// No mark: speed and phases mean nothing.
    Missing,
    /// The speed changed too much within the reading, or marks came out of step.
    Unsteady,
}

impl Keyphasor {
    /// Phases can be believed.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::NotStated | Self::Locked)
    }
}

/// What a node is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeState {
    /// No reading evaluated since start or since the model was replaced.
    Waiting,
    /// The model describes the machine.
    Tracking,
    /// The last reading was suspicious.
    Suspicious,
    /// The flag is up.
    Flagged,
    /// Somebody else uses this node's number: no results until that has ended.
    Conflict,
    /// Just started: listens for others with its number before it answers.
    Listening,
}

/// One frame's meaning. Bytes named reserved are sent as zero and ignored when received.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Message {
    /// Opens a reading. u16 sequence, u8 mask, u8 keyphasor, f32 speed.
    ReadingStart {
        /// Number of the reading, wrapping.
        sequence: u16,
        /// Bit i set: probe i gave a value.
        valid_mask: u8,
        /// What is known of the phase reference.
        keyphasor: Keyphasor,
        /// Speed, rpm.
        speed_rpm: f32,
    },
    /// One probe. f32 cos, f32 sin.
    ProbeVector {
        /// 0 to 3: bearing 1 X, Y, bearing 2 X, Y (carried by the type).
        probe: u8,
        /// µm zero-to-peak; NaN in both for a lost probe.
        vector: ProbeVector,
    },
    /// Closes a reading. u16 sequence, u8 count, u8 reserved, u32 checksum.
    ReadingEnd {
        /// That of the start.
        sequence: u16,
        /// Vectors sent: 4.
        count: u8,
        /// CRC-32 over the payloads of the start and the vectors.
        crc32: u32,
    },
    /// Opens a result. u16 sequence, u8 flags, u8 suspect (0 none, 1, 2), u16 streak, u16 reserved.
    Status {
        /// Number of the reading.
        sequence: u16,
        /// `FLAG_…` bits.
        flags: u8,
        /// Suspected bearing.
        suspect: Option<Bearing>,
        /// Suspicious readings in a row.
        streak: u16,
    },
    /// Unbalance of a plane. f32 U cos α, f32 U sin α.
    Unbalance {
        /// 0 or 1 (carried by the type).
        plane: u8,
        /// g·mm.
        unbalance_g_mm: Pair,
    },
    /// Static unbalance. f32 U cos α, f32 U sin α, g·mm.
    Static(Pair),
    /// Dynamic unbalance at plane 1. f32 U cos α, f32 U sin α, g·mm.
    Dynamic(Pair),
    /// f32 e, f32 e/f.
    Residual {
        /// `Σ|calculated − measured|`, µm.
        e_um: f32,
        /// The same relative to `Σ|measured|`.
        ratio: f32,
    },
    /// Closes a result. u16 sequence, u8 count, u8 reserved, u32 checksum.
    ResultEnd {
        /// That of the status.
        sequence: u16,
        /// Frames before this one: 6.
        count: u8,
        /// CRC-32 over their payloads.
        crc32: u32,
    },
    /// Sign of life. u8 version, u8 state, then three u16.
    Heartbeat {
        /// [`PROTOCOL_VERSION`] of the sender.
        version: u8,
        /// What the node is doing.
        state: NodeState,
        /// See [`Counters`](super::Counters).
        readings: u16,
        /// See [`Counters`](super::Counters).
        lost: u16,
        /// See [`Counters`](super::Counters).
        rejected: u16,
    },
    /// Four u16, see [`Counters`](super::Counters).
    Counters {
        /// First.
        repeated: u16,
        /// Second.
        late: u16,
        /// Third.
        incomplete: u16,
        /// Fourth.
        stray: u16,
    },
    /// Four u16, see [`Counters`](super::Counters).
    Discards {
        /// First.
        skipped: u16,
        /// Second.
        resynchronised: u16,
        /// Third.
        overflowed: u16,
        /// Fourth.
        unsolved: u16,
    },
    /// Commands received. Four u16, see [`Counters`](super::Counters).
    Commands {
        /// First.
        accepted: u16,
        /// Second.
        refused: u16,
        /// Third.
        forged: u16,
        /// Fourth.
        replayed: u16,
    },
    /// Two u16, see [`Counters`](super::Counters), and which model is in use.
    Transfers {
        /// First.
        broken: u16,
        /// Second.
        conflicts: u16,
        /// [`Model::checksum`](crate::model::Model::checksum).
        model_checksum: u32,
    },
    /// Answer to the query. Four u8, then u32 reserved. No version changes it.
    Version {
        /// [`PROTOCOL_VERSION`].
        protocol: u8,
        /// [`OLDEST_PROTOCOL_VERSION`].
        oldest: u8,
        /// [`MODEL_SCHEMA`](crate::model::MODEL_SCHEMA).
        model_schema: u8,
        /// Basis shapes of its model.
        shapes: u8,
    },
    /// Asks a node, or all with [`BROADCAST_NODE`](super::BROADCAST_NODE), for its version. No payload; no version changes it.
    VersionQuery,
}

/// Why a frame has no meaning here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CanError {
    /// The type is not one of this version.
    UnknownType,
    /// Not eight bytes.
    WrongLength,
    /// A byte with few allowed values has another.
    BadValue,
}

impl Message {
    /// The frame for a node (its low five bits count).
    pub fn encode(&self, node: u8) -> Frame {
        let (message_type, payload) = match *self {
            Self::ReadingStart { sequence, valid_mask, keyphasor, speed_rpm } => {
                let head = head(sequence, valid_mask, keyphasor as u8);
                (TYPE_READING_START, join(head, speed_rpm.to_le_bytes()))
            }
            Self::ProbeVector { probe, vector } => {
                (TYPE_VECTOR + (probe & 3), two_f32([vector.cos_um, vector.sin_um]))
            }
            Self::ReadingEnd { sequence, count, crc32 } => {
                (TYPE_READING_END, join(head(sequence, count, 0), crc32.to_le_bytes()))
            }
            Self::Status { sequence, flags, suspect, streak } => {
                let suspect = match suspect {
                    None => 0,
                    Some(Bearing::One) => 1,
                    Some(Bearing::Two) => 2,
                };
                (TYPE_STATUS, join(head(sequence, flags, suspect), u32::from(streak).to_le_bytes()))
            }
            Self::Unbalance { plane, unbalance_g_mm } => {
                (TYPE_UNBALANCE + (plane & 1), two_f32(unbalance_g_mm))
            }
            Self::Static(unbalance_g_mm) => (TYPE_STATIC, two_f32(unbalance_g_mm)),
            Self::Dynamic(unbalance_g_mm) => (TYPE_DYNAMIC, two_f32(unbalance_g_mm)),
            Self::Residual { e_um, ratio } => (TYPE_RESIDUAL, two_f32([e_um, ratio])),
            Self::ResultEnd { sequence, count, crc32 } => {
                (TYPE_RESULT_END, join(head(sequence, count, 0), crc32.to_le_bytes()))
            }
            Self::Heartbeat { version, state, readings, lost, rejected } => {
                let first = u16::from_le_bytes([version, state as u8]);
                (TYPE_HEARTBEAT, four_u16([first, readings, lost, rejected]))
            }
            Self::Counters { repeated, late, incomplete, stray } => {
                (TYPE_COUNTERS, four_u16([repeated, late, incomplete, stray]))
            }
            Self::Discards { skipped, resynchronised, overflowed, unsolved } => {
                (TYPE_DISCARDS, four_u16([skipped, resynchronised, overflowed, unsolved]))
            }
            Self::Commands { accepted, refused, forged, replayed } => {
                (TYPE_COMMANDS, four_u16([accepted, refused, forged, replayed]))
            }
            Self::Transfers { broken, conflicts, model_checksum } => {
                let [[a, b], [c, d]] = [broken, conflicts].map(u16::to_le_bytes);
                (TYPE_TRANSFERS, join([a, b, c, d], model_checksum.to_le_bytes()))
            }
            Self::Version { protocol, oldest, model_schema, shapes } => {
                (TYPE_VERSION, join([protocol, oldest, model_schema, shapes], [0; 4]))
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
        let known = matches!(
            message_type,
            TYPE_READING_START..=TYPE_READING_END
                | TYPE_STATUS..=TYPE_RESULT_END
                | TYPE_HEARTBEAT..=TYPE_TRANSFERS
                | TYPE_VERSION
        );
        if message_type == TYPE_VERSION_QUERY {
            return Ok((frame.node(), Self::VersionQuery));
        }
        if !known {
            return Err(CanError::UnknownType);
        }
        let &payload = frame.full_payload().ok_or(CanError::WrongLength)?;
        let [a, b, c, d, e, f, g, h] = payload;
        let sequence = u16::from_le_bytes([a, b]);
        let upper = [e, f, g, h];
        let pair = [f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes(upper)];
        let words =
            [sequence, u16::from_le_bytes([c, d]), u16::from_le_bytes([e, f]), u16::from_le_bytes([g, h])];
        let message = match message_type {
            TYPE_READING_START => {
                let keyphasor = keyphasor(d)?;
                Self::ReadingStart {
                    sequence,
                    valid_mask: c,
                    keyphasor,
                    speed_rpm: f32::from_le_bytes(upper),
                }
            }
            TYPE_READING_END => Self::ReadingEnd { sequence, count: c, crc32: u32::from_le_bytes(upper) },
            TYPE_STATUS => Self::Status { sequence, flags: c, suspect: suspect(d)?, streak: words[2] },
            TYPE_UNBALANCE..TYPE_STATIC => {
                Self::Unbalance { plane: message_type - TYPE_UNBALANCE, unbalance_g_mm: pair }
            }
            TYPE_STATIC => Self::Static(pair),
            TYPE_DYNAMIC => Self::Dynamic(pair),
            TYPE_RESIDUAL => Self::Residual { e_um: pair[0], ratio: pair[1] },
            TYPE_RESULT_END => Self::ResultEnd { sequence, count: c, crc32: u32::from_le_bytes(upper) },
            TYPE_HEARTBEAT => {
                let [_, readings, lost, rejected] = words;
                Self::Heartbeat { version: a, state: state(b)?, readings, lost, rejected }
            }
            TYPE_COUNTERS => {
                let [repeated, late, incomplete, stray] = words;
                Self::Counters { repeated, late, incomplete, stray }
            }
            TYPE_DISCARDS => {
                let [skipped, resynchronised, overflowed, unsolved] = words;
                Self::Discards { skipped, resynchronised, overflowed, unsolved }
            }
            TYPE_COMMANDS => {
                let [accepted, refused, forged, replayed] = words;
                Self::Commands { accepted, refused, forged, replayed }
            }
            TYPE_TRANSFERS => {
                let [broken, conflicts, ..] = words;
                Self::Transfers { broken, conflicts, model_checksum: u32::from_le_bytes(upper) }
            }
            TYPE_VERSION => Self::Version { protocol: a, oldest: b, model_schema: c, shapes: d },
            _ => {
                let [cos_um, sin_um] = pair;
                let probe = message_type.wrapping_sub(TYPE_VECTOR);
                Self::ProbeVector { probe, vector: ProbeVector { cos_um, sin_um } }
            }
        };
        Ok((frame.node(), message))
    }
}

fn suspect(byte: u8) -> Result<Option<Bearing>, CanError> {
    match byte {
        0 => Ok(None),
        1 => Ok(Some(Bearing::One)),
        2 => Ok(Some(Bearing::Two)),
        _ => Err(CanError::BadValue),
    }
}

fn keyphasor(byte: u8) -> Result<Keyphasor, CanError> {
    match byte {
        0 => Ok(Keyphasor::NotStated),
        1 => Ok(Keyphasor::Locked),
        2 => Ok(Keyphasor::Missing),
        3 => Ok(Keyphasor::Unsteady),
        _ => Err(CanError::BadValue),
    }
}

fn state(byte: u8) -> Result<NodeState, CanError> {
    match byte {
        0 => Ok(NodeState::Waiting),
        1 => Ok(NodeState::Tracking),
        2 => Ok(NodeState::Suspicious),
        3 => Ok(NodeState::Flagged),
        4 => Ok(NodeState::Conflict),
        5 => Ok(NodeState::Listening),
        _ => Err(CanError::BadValue),
    }
}

fn head(sequence: u16, third: u8, fourth: u8) -> [u8; 4] {
    let [a, b] = sequence.to_le_bytes();
    [a, b, third, fourth]
}

fn join([a, b, c, d]: [u8; 4], [e, f, g, h]: [u8; 4]) -> [u8; 8] {
    [a, b, c, d, e, f, g, h]
}

fn two_f32([first, second]: [f32; 2]) -> [u8; 8] {
    join(first.to_le_bytes(), second.to_le_bytes())
}

fn four_u16(words: [u16; 4]) -> [u8; 8] {
    let [[a, b], [c, d], [e, f], [g, h]] = words.map(u16::to_le_bytes);
    [a, b, c, d, e, f, g, h]
}

//! Commands that change a monitor, and its answers: authenticated, numbered, and bound to one node.
//!
//! ```text
//! request  u8 wire version, u8 command, u8 node, u8 0, u64 counter, body, 16 bytes HMAC-SHA-256
//! answer   u8 wire version, u8 command, u8 node, u8 outcome, u64 counter, u32 model checksum,
//!          u8 detail, u8 asked, u8 held, u8 0, body, 16 bytes HMAC-SHA-256
//! ```
//!
//! In the answer to a model that was accepted, `detail` is 1 if it is the model in use already, and 2 if it replaced another:
//! `asked` is then the reason of the flag that it lowered, zero without one, and `held` the bearing suspected, from 1.
//!
//! Little endian. The body of a request is the model of [`Command::Deploy`] and [`Command::DeployAnother`], a u32 of seconds
//! and the model of [`Command::Trial`], or the thresholds of [`Command::SetThresholds`], otherwise empty; that of an answer the
//! thresholds that [`Command::GetThresholds`] asked for.
//!
//! The code of a request covers the words `rotor-edge request` and all bytes before it, that of an answer the words
//! `rotor-edge answer`, all bytes before it and the code of the request: neither can be taken for the other, and an answer
//! belongs to one request. The counter of a request must exceed every one the node has accepted, restarts included, by at
//! most [`MAX_COUNTER_STEP`], so that no number locks commands out. Each travels as one ISO-TP message or in
//! numbered parts (`can::parts`). Measurement frames need no key.

use heapless::Vec;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use crate::model::ModelError;
use crate::state::Reason;
use crate::thresholds::{THRESHOLDS_BYTES, ThresholdError, Thresholds};

pub const WIRE_VERSION: u8 = 2;
/// Bytes of a device's key.
pub const KEY_BYTES: usize = 32;
/// Bytes of an authentication code: HMAC-SHA-256, the left half.
pub const CODE_BYTES: usize = 16;
/// Bytes before a request's body.
pub const HEAD_BYTES: usize = 12;
/// Bytes of the longest answer.
pub const ANSWER_BYTES: usize = ANSWER_HEAD_BYTES + THRESHOLDS_BYTES + CODE_BYTES;
/// Bytes before the model in the body of [`Command::Trial`].
pub const TRIAL_BYTES: usize = 4;
/// Longest request: room for a model of six shapes, eight probes and four planes with every list full, so that a node
/// that holds fewer can say so.
pub const MAX_REQUEST_BYTES: usize = 2656;
/// A request's counter exceeds the last one accepted by at most so much: milliseconds since 1970 suit until 2109.
pub const MAX_COUNTER_STEP: u64 = 1 << 42;

const ANSWER_HEAD_BYTES: usize = 20;
const REQUEST_DOMAIN: &[u8] = b"rotor-edge request";
const ANSWER_DOMAIN: &[u8] = b"rotor-edge answer";

type Code = [u8; CODE_BYTES];

/// A device's secret. It never shows in debug output.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Key(pub [u8; KEY_BYTES]);

impl core::fmt::Debug for Key {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str("Key")
    }
}

impl Key {
    pub(crate) fn mac(&self, parts: [&[u8]; 3]) -> Option<Hmac<Sha256>> {
        let mut mac = Hmac::<Sha256>::new_from_slice(&self.0).ok()?;
        for part in parts {
            mac.update(part);
        }
        Some(mac)
    }

    fn code(&self, parts: [&[u8]; 3]) -> Code {
        let full =
            self.mac(parts).map(|mac| <[u8; 32]>::from(mac.finalize().into_bytes())).unwrap_or_default();
        full.first_chunk::<CODE_BYTES>().copied().unwrap_or_default()
    }

    /// In constant time.
    fn confirms(&self, parts: [&[u8]; 3], code: &Code) -> bool {
        self.mac(parts).is_some_and(|mac| mac.verify_truncated_left(code).is_ok())
    }
}

/// What a node is asked to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Command {
    /// Change to the model in the body, [`Model::encode`](crate::model::Model::encode).
    Deploy = 1,
    /// Begin a new record, `Node::restart`.
    Restart = 2,
    /// Lower the latched flag.
    Acknowledge = 3,
    /// Judge by the [`Thresholds`] in the body from now on.
    SetThresholds = 4,
    GetThresholds = 5,
    /// [`Command::Deploy`], also where the model held is of another machine.
    DeployAnother = 6,
    /// Change to the model in the body for so many seconds, without storing it: [`Command::Deploy`] of the same bytes within
    /// this time confirms it, otherwise what was stored comes back.
    Trial = 7,
}

impl Command {
    const ALL: [Self; 7] = [
        Self::Deploy,
        Self::Restart,
        Self::Acknowledge,
        Self::SetThresholds,
        Self::GetThresholds,
        Self::DeployAnother,
        Self::Trial,
    ];

    fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|command| *command as u8 == byte)
    }

    /// The model's bytes in the body of a deployment, and the seconds of a trial. A body that is too short for the seconds
    /// gives no bytes, which [`Model::decode`](crate::model::Model::decode) refuses.
    pub fn model(self, body: &[u8]) -> Option<(&[u8], Option<u32>)> {
        match self {
            Self::Deploy | Self::DeployAnother => Some((body, None)),
            Self::Trial => {
                let (seconds, model) = body.split_first_chunk::<TRIAL_BYTES>().unwrap_or((&[0; 4], &[]));
                Some((model, Some(u32::from_le_bytes(*seconds))))
            }
            Self::Restart | Self::Acknowledge | Self::SetThresholds | Self::GetThresholds => None,
        }
    }
}

/// What became of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum Outcome {
    /// Done, and stored.
    Accepted = 0,
    /// Too short, of another wire version, or an unknown command.
    Malformed = 1,
    /// The node was given no key: it takes no commands.
    NoKey = 2,
    /// The code is not one made with this node's key for this node.
    Forged = 3,
    /// The counter is not above the last one accepted.
    Replayed = 4,
    /// The model is refused; see [`Detail::Model`].
    Model = 5,
    /// What the command changes could not be stored.
    Storage = 6,
    /// The counter is more than [`MAX_COUNTER_STEP`] above the last one accepted.
    Counter = 7,
    /// The thresholds are refused; see [`Detail::Thresholds`].
    Thresholds = 8,
    /// The model held is of another machine, and the command is not [`Command::DeployAnother`].
    Machine = 9,
}

/// What an answer says besides its outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Detail {
    /// The outcome says it all.
    #[default]
    None,
    Model {
        /// What is wrong with it.
        error: ModelError,
        /// For [`ModelError::BasisSize`], [`ModelError::Probes`] and [`ModelError::Planes`]: how many the model has.
        asked: u8,
        /// And how many the firmware holds.
        held: u8,
    },
    Thresholds(ThresholdError),
    /// Accepted: the model is the one in use, and nothing changed. A latched flag and the reference stay, and no trial begins.
    Unchanged,
    /// Accepted: another model was in use, whose reference is dropped.
    Replaced {
        /// Cause of the flag that was latched; [`Reason::None`] without one.
        lowered: Reason,
        /// The bearing that was suspected, from 0.
        suspect: Option<u8>,
    },
}

/// [`Detail::Unchanged`] on the wire.
const UNCHANGED: u8 = 1;
/// [`Detail::Replaced`] on the wire.
const REPLACED: u8 = 2;

impl Outcome {
    const ALL: [Self; 10] = [
        Self::Accepted,
        Self::Malformed,
        Self::NoKey,
        Self::Forged,
        Self::Replayed,
        Self::Model,
        Self::Storage,
        Self::Counter,
        Self::Thresholds,
        Self::Machine,
    ];

    /// Only who has the key is told the counter.
    fn tells_counter(self) -> bool {
        !matches!(self, Self::Malformed | Self::NoKey | Self::Forged)
    }
}

/// A request whose code and counter were right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    pub command: Command,
    pub counter: u64,
    /// What to do it with.
    pub body: &'a [u8],
}

/// Writes a request into `buffer` and returns how many bytes it took; `None` if the buffer is too small.
///
/// ```
/// use rotor_edge_core::command::{Command, Key, Outcome, open_request, write_request};
/// let (key, mut buffer) = (Key([7; 32]), [0; 64]);
/// let length = write_request(&mut buffer, &key, 3, Command::Restart, 100, &[]).unwrap();
/// let request = open_request(&buffer[..length], Some(&key), 3, 99).unwrap();
/// assert_eq!(request.command, Command::Restart);
/// assert_eq!(open_request(&buffer[..length], Some(&key), 3, 100), Err(Outcome::Replayed));
/// assert_eq!(open_request(&buffer[..length], Some(&key), 4, 99), Err(Outcome::Forged));
/// ```
pub fn write_request(
    buffer: &mut [u8],
    key: &Key,
    node: u8,
    command: Command,
    counter: u64,
    body: &[u8],
) -> Option<usize> {
    let length = HEAD_BYTES.checked_add(body.len())?.checked_add(CODE_BYTES)?;
    let (head, rest) = buffer.get_mut(..length)?.split_first_chunk_mut::<HEAD_BYTES>()?;
    let (place, code) = rest.split_last_chunk_mut::<CODE_BYTES>()?;
    let [a, b, c, d, e, f, g, h] = counter.to_le_bytes();
    *head = [WIRE_VERSION, command as u8, node, 0, a, b, c, d, e, f, g, h];
    for (place, &byte) in place.iter_mut().zip(body) {
        *place = byte;
    }
    *code = key.code([REQUEST_DOMAIN, head, place]);
    Some(length)
}

/// Checks a request to `node` that has accepted counters up to `last_counter`.
///
/// Errors: [`Outcome::Malformed`], [`Outcome::NoKey`], [`Outcome::Forged`], [`Outcome::Replayed`], [`Outcome::Counter`], in
/// this order, so that nothing is said about the counter to who has no key.
pub fn open_request<'a>(
    bytes: &'a [u8],
    key: Option<&Key>,
    node: u8,
    last_counter: u64,
) -> Result<Request<'a>, Outcome> {
    let (signed, code) = bytes.split_last_chunk::<CODE_BYTES>().ok_or(Outcome::Malformed)?;
    let (head, body) = signed.split_first_chunk::<HEAD_BYTES>().ok_or(Outcome::Malformed)?;
    let [version, command, to, _, counter @ ..] = *head;
    if version != WIRE_VERSION {
        return Err(Outcome::Malformed);
    }
    let key = key.ok_or(Outcome::NoKey)?;
    if !key.confirms([REQUEST_DOMAIN, signed, &[]], code) || to != node {
        return Err(Outcome::Forged);
    }
    let counter = u64::from_le_bytes(counter);
    if counter <= last_counter {
        return Err(Outcome::Replayed);
    }
    if counter - last_counter > MAX_COUNTER_STEP {
        return Err(Outcome::Counter);
    }
    let command = Command::from_byte(command).ok_or(Outcome::Malformed)?;
    Ok(Request { command, counter, body })
}

/// A node's answer to a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    pub node: u8,
    /// The command's byte, as it came.
    pub command: u8,
    pub outcome: Outcome,
    /// Last counter accepted; zero to a request that was malformed, forged or came to a node without a key.
    pub counter: u64,
    /// [`Model::checksum`](crate::model::Model::checksum) of the model in use, zero without one.
    pub model_checksum: u32,
    pub detail: Detail,
    /// `None` unless [`Command::GetThresholds`] was accepted.
    pub thresholds: Option<Thresholds>,
}

impl Answer {
    /// The bytes of the answer to `request`; without a key, the code is zero.
    pub fn encode(&self, request: &[u8], key: Option<&Key>) -> Vec<u8, ANSWER_BYTES> {
        let (detail, asked, held) = match self.detail {
            Detail::None => (0, 0, 0),
            Detail::Model { error, asked, held } => (error as u8, asked, held),
            Detail::Thresholds(error) => (error as u8, 0, 0),
            Detail::Unchanged => (UNCHANGED, 0, 0),
            Detail::Replaced { lowered, suspect } => {
                (REPLACED, lowered.code(), suspect.map_or(0, |bearing| bearing.saturating_add(1)))
            }
        };
        let counter = if self.outcome.tells_counter() { self.counter } else { 0 };
        let mut bytes = Vec::new();
        // Cannot be full: the capacity is that of the longest answer.
        let mut add = |part: &[u8]| {
            let _ = bytes.extend_from_slice(part);
        };
        add(&[WIRE_VERSION, self.command, self.node, self.outcome as u8]);
        add(&counter.to_le_bytes());
        add(&self.model_checksum.to_le_bytes());
        add(&[detail, asked, held, 0]);
        if let Some(thresholds) = self.thresholds {
            add(&thresholds.encode());
        }
        let code = key.map_or([0; CODE_BYTES], |key| key.code([ANSWER_DOMAIN, &bytes, code_of(request)]));
        let _ = bytes.extend_from_slice(&code);
        bytes
    }

    /// Reads an answer to `request`, and whether its code confirms that it is the node's own.
    ///
    /// `None`: not an answer of this wire version.
    pub fn decode(bytes: &[u8], request: &[u8], key: &Key) -> Option<(Self, bool)> {
        let (signed, code) = bytes.split_last_chunk::<CODE_BYTES>()?;
        let (head, body) = signed.split_first_chunk::<ANSWER_HEAD_BYTES>()?;
        let &[version, command, node, outcome, a, b, c, d, e, f, g, h, p, q, r, s, detail, asked, held, _] =
            head;
        if version != WIRE_VERSION {
            return None;
        }
        let outcome = Outcome::ALL.into_iter().find(|known| *known as u8 == outcome)?;
        let detail = match outcome {
            Outcome::Model => ModelError::from_code(detail).map(|error| Detail::Model { error, asked, held }),
            Outcome::Thresholds => ThresholdError::from_code(detail).map(Detail::Thresholds),
            Outcome::Accepted if detail == UNCHANGED => Some(Detail::Unchanged),
            Outcome::Accepted if detail == REPLACED => {
                Some(Detail::Replaced { lowered: Reason::from_code(asked), suspect: held.checked_sub(1) })
            }
            // of a newer node: the outcome is understood
            _ => None,
        };
        let thresholds = if body.is_empty() { None } else { Some(Thresholds::decode(body).ok()?) };
        let answer = Self {
            node,
            command,
            outcome,
            counter: u64::from_le_bytes([a, b, c, d, e, f, g, h]),
            model_checksum: u32::from_le_bytes([p, q, r, s]),
            detail: detail.unwrap_or_default(),
            thresholds,
        };
        Some((answer, key.confirms([ANSWER_DOMAIN, signed, code_of(request)], code)))
    }
}

/// The code at the end of a request; empty for one too short to have any.
fn code_of(request: &[u8]) -> &[u8] {
    request.last_chunk::<CODE_BYTES>().map_or(&[], |code| code.as_slice())
}

#[cfg(test)]
mod tests;

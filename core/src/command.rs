//! Commands that change a monitor, and its answers: authenticated, numbered, and bound to one node.
//!
//! ```text
//! request  u8 wire version, u8 command, u8 node, u8 0, u64 counter, body, 16 bytes HMAC-SHA-256
//! answer   u8 wire version, u8 command, u8 node, u8 outcome, u64 counter, u32 model checksum,
//!          u8 detail, 3 × u8 0, 16 bytes HMAC-SHA-256
//! ```
//!
//! Little endian. The code of a request covers all bytes before it, that of an answer also the code of the request, so
//! that an answer belongs to one request. The counter of a request must exceed every one the node has accepted,
//! restarts included. Each travels as one ISO-TP message. Measurement frames need no key.

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use crate::model::ModelError;

/// Version of this layout.
pub const WIRE_VERSION: u8 = 1;
/// Bytes of a device's key.
pub const KEY_BYTES: usize = 32;
/// Bytes of an authentication code: HMAC-SHA-256, the left half.
pub const CODE_BYTES: usize = 16;
/// Bytes before a request's body.
pub const HEAD_BYTES: usize = 12;
/// Bytes of an answer.
pub const ANSWER_BYTES: usize = ANSWER_HEAD_BYTES + CODE_BYTES;
/// Longest request: room for a model of six shapes with every list full, and for larger ones to come.
pub const MAX_REQUEST_BYTES: usize = 2640;

const ANSWER_HEAD_BYTES: usize = 20;

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
    fn mac(&self, parts: [&[u8]; 2]) -> Option<Hmac<Sha256>> {
        let mut mac = Hmac::<Sha256>::new_from_slice(&self.0).ok()?;
        for part in parts {
            mac.update(part);
        }
        Some(mac)
    }

    fn code(&self, parts: [&[u8]; 2]) -> Code {
        let full =
            self.mac(parts).map(|mac| <[u8; 32]>::from(mac.finalize().into_bytes())).unwrap_or_default();
        full.first_chunk::<CODE_BYTES>().copied().unwrap_or_default()
    }

    /// In constant time.
    fn confirms(&self, parts: [&[u8]; 2], code: &Code) -> bool {
        self.mac(parts).is_some_and(|mac| mac.verify_truncated_left(code).is_ok())
    }
}

/// What a node is asked to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Command {
    /// Change to the model in the body, [`Model::encode`](crate::model::Model::encode).
    Deploy = 1,
    /// Begin a new record, [`Node::restart`](crate::node::Node::restart).
    Restart = 2,
}

impl Command {
    fn from_byte(byte: u8) -> Option<Self> {
        [Self::Deploy, Self::Restart].into_iter().find(|command| *command as u8 == byte)
    }
}

/// What became of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
    /// The model is refused; the answer's detail is the [`ModelError`].
    Model = 5,
    /// The counter or the model could not be stored.
    Storage = 6,
}

impl Outcome {
    const ALL: [Self; 7] = [
        Self::Accepted,
        Self::Malformed,
        Self::NoKey,
        Self::Forged,
        Self::Replayed,
        Self::Model,
        Self::Storage,
    ];
}

/// A request whose code and counter were right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    /// What to do.
    pub command: Command,
    /// Its number.
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
    *code = key.code([head, place]);
    Some(length)
}

/// Checks a request to `node` that has accepted counters up to `last_counter`.
///
/// Errors: [`Outcome::Malformed`], [`Outcome::NoKey`], [`Outcome::Forged`], [`Outcome::Replayed`], in this order, so that
/// nothing is said about the counter to who has no key.
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
    if !key.confirms([signed, &[]], code) || to != node {
        return Err(Outcome::Forged);
    }
    let counter = u64::from_le_bytes(counter);
    if counter <= last_counter {
        return Err(Outcome::Replayed);
    }
    let command = Command::from_byte(command).ok_or(Outcome::Malformed)?;
    Ok(Request { command, counter, body })
}

/// A node's answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// Who answers.
    pub node: u8,
    /// The command's byte, as it came.
    pub command: u8,
    /// What became of it.
    pub outcome: Outcome,
    /// Last counter accepted.
    pub counter: u64,
    /// [`Model::checksum`](crate::model::Model::checksum) of the model in use.
    pub model_checksum: u32,
    /// Why the model was refused.
    pub model_error: Option<ModelError>,
}

impl Answer {
    /// The bytes of the answer to `request`; without a key, the code is zero.
    pub fn encode(&self, request: &[u8], key: Option<&Key>) -> [u8; ANSWER_BYTES] {
        let mut bytes = [0; ANSWER_BYTES];
        let Some((head, code)) = bytes.split_first_chunk_mut::<ANSWER_HEAD_BYTES>() else {
            return bytes;
        };
        let [a, b, c, d, e, f, g, h] = self.counter.to_le_bytes();
        let [p, q, r, s] = self.model_checksum.to_le_bytes();
        let detail = self.model_error.map_or(0, |error| error as u8);
        *head = [
            WIRE_VERSION,
            self.command,
            self.node,
            self.outcome as u8,
            a,
            b,
            c,
            d,
            e,
            f,
            g,
            h,
            p,
            q,
            r,
            s,
            detail,
            0,
            0,
            0,
        ];
        if let Some(key) = key {
            for (place, byte) in code.iter_mut().zip(key.code([head, code_of(request)])) {
                *place = byte;
            }
        }
        bytes
    }

    /// Reads an answer to `request`, and whether its code confirms that it is the node's own.
    ///
    /// `None`: not an answer of this wire version.
    pub fn decode(bytes: &[u8], request: &[u8], key: &Key) -> Option<(Self, bool)> {
        let (head, code) = bytes.split_first_chunk::<ANSWER_HEAD_BYTES>()?;
        let code = <&Code>::try_from(code).ok()?;
        let &[version, command, node, outcome, a, b, c, d, e, f, g, h, p, q, r, s, detail, ..] = head;
        if version != WIRE_VERSION {
            return None;
        }
        let answer = Self {
            node,
            command,
            outcome: Outcome::ALL.into_iter().find(|known| *known as u8 == outcome)?,
            counter: u64::from_le_bytes([a, b, c, d, e, f, g, h]),
            model_checksum: u32::from_le_bytes([p, q, r, s]),
            model_error: ModelError::from_code(detail),
        };
        Some((answer, key.confirms([head, code_of(request)], code)))
    }
}

/// The code at the end of a request; empty for one too short to have any.
fn code_of(request: &[u8]) -> &[u8] {
    request.last_chunk::<CODE_BYTES>().map_or(&[], |code| code.as_slice())
}

#[cfg(test)]
mod tests;

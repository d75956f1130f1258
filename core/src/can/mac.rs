//! Message authentication codes (MACs): two frames after a group of frames show who sent the group, and that it is no
//! recording.
//!
//! A group is a reading (towards a node) or what a node tells at once: a result, a heartbeat with all that follows it, or a
//! state alone. The first frame of the MAC holds the number of frames in the group (u8) and its nonce (56 bits), a
//! number that only grows: microseconds since 1970 suit. The second holds the left eight bytes of an HMAC-SHA-256, by the
//! device's key, over the words `rotor-edge seal` and then, of every frame of the group and of the MAC's first, the
//! identifier (u16, which has the direction and the node in it) and the eight bytes, in rising order of identifier.
//!
//! Receivers without the feature `mac` ignore these frames.
//!
//! ```
//! use rotor_edge_core::can::mac::{Direction, Gate, MacError, mac_frames};
//! use rotor_edge_core::can::{NumberedReading, reading_frames};
//! use rotor_edge_core::command::Key;
//! use rotor_edge_core::reading::{ProbeVector, Reading};
//! let (key, node) = (Key([7; 32]), 3);
//! let reading = Reading::new(9000.0, &[ProbeVector { cos_um: 1.0, sin_um: 2.0 }; 4]).unwrap();
//! let frames = reading_frames(node, &NumberedReading::new(1, reading));
//! let authenticated: Vec<_> = frames.iter().copied().chain(mac_frames(&key, Direction::ToNode, node, 1000, &frames)).collect();
//! let mut gate = Gate::new(Direction::ToNode, 999);
//! let mut hear = |time_us| authenticated.iter().map(|frame| gate.receive(&key, 200_000, time_us, frame)).last();
//! assert_eq!(hear(0), Some(Ok(Some(frames.clone().into_iter().collect()))));
//! // a recording of it
//! assert_eq!(hear(50_000), Some(Err(MacError::Replayed)));
//! ```

use core::error::Error;
use core::fmt;

use heapless::Vec;
use hmac::{Hmac, Mac};
use sha2::Sha256;

use super::counters::COUNTER_PAIRS;
use super::frame::Frame;
use super::message::{
    TYPE_HEARTBEAT, TYPE_MODEL, TYPE_READING_END, TYPE_READING_START, TYPE_RESULT_END, TYPE_STATE,
    TYPE_STATUS,
};
pub use super::message::{TYPE_READING_CODE, TYPE_READING_NONCE, TYPE_TOLD_CODE, TYPE_TOLD_NONCE};
use crate::command::Key;

pub const MAC_FRAMES: usize = 2;
/// Frames of a group, at most: those of a heartbeat.
pub const MAX_GROUP_FRAMES: usize = COUNTER_PAIRS + 3;
/// Greatest nonce: the year 4253 in microseconds.
pub const MAX_NONCE: u64 = (1 << 56) - 1;

const DOMAIN: &[u8] = b"rotor-edge seal";
/// One for each type that can be in a group, in either direction.
const SLOTS: usize = (TYPE_MODEL - TYPE_STATUS) as usize + 1;

/// The frames of a group, in rising order of identifier.
pub type Group = Vec<Frame, MAX_GROUP_FRAMES>;

/// Which way authenticated frames travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Direction {
    ToNode,
    /// Results, heartbeats and states.
    ToHost,
}

/// Why a group is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MacError {
    /// Frames are missing, those of the MAC among them, or they took too long.
    Incomplete,
    /// The code is not one made with this key over these frames.
    Forged,
    /// The code is right and its nonce not above the last one.
    Replayed,
}

impl fmt::Display for MacError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Incomplete => "frames of the group or of its seal are missing or late",
            Self::Forged => "the authentication code was not made with this key over these frames",
            Self::Replayed => "the freshness is not above that of the last group taken",
        })
    }
}

impl Error for MacError {}

impl Direction {
    /// Types of the MAC's two frames.
    fn types(self) -> [u8; MAC_FRAMES] {
        match self {
            Self::ToNode => [TYPE_READING_NONCE, TYPE_READING_CODE],
            Self::ToHost => [TYPE_TOLD_NONCE, TYPE_TOLD_CODE],
        }
    }

    /// Least type of a group.
    fn first(self) -> u8 {
        match self {
            Self::ToNode => TYPE_READING_START,
            Self::ToHost => TYPE_STATUS,
        }
    }

    /// Whether frames of this type count only with a MAC.
    pub fn covers(self, message_type: u8) -> bool {
        match self {
            Self::ToNode => (TYPE_READING_START..=TYPE_READING_END).contains(&message_type),
            Self::ToHost => {
                matches!(message_type, TYPE_STATUS..=TYPE_RESULT_END | TYPE_HEARTBEAT..=TYPE_MODEL)
            }
        }
    }
}

/// The two frames of the MAC of a group for or of `node`, to be sent after it; `group` in rising order of identifier. Of the
/// nonce, 56 bits count.
pub fn mac_frames(
    key: &Key,
    direction: Direction,
    node: u8,
    nonce: u64,
    group: &[Frame],
) -> [Frame; MAC_FRAMES] {
    let [first, second] = direction.types();
    let [a, b, c, d, e, f, g, _] = nonce.to_le_bytes();
    let head = Frame::full(first, node, [group.len() as u8, a, b, c, d, e, f, g]);
    let full = hmac(key, group, &head).map(|mac| <[u8; 32]>::from(mac.finalize().into_bytes()));
    let code = full.unwrap_or_default().first_chunk().copied().unwrap_or_default();
    [head, Frame::full(second, node, code)]
}

/// As many as a group can have.
pub(crate) fn grouped<'a>(frames: impl Iterator<Item = &'a Frame>) -> Group {
    let mut group = Group::new();
    for frame in frames {
        let _ = group.push(*frame);
    }
    group
}

/// HMAC-SHA-256 over a group and its MAC's first frame.
fn hmac(key: &Key, group: &[Frame], head: &Frame) -> Option<Hmac<Sha256>> {
    let mut mac = key.mac([DOMAIN, &[], &[]])?;
    for frame in group.iter().chain([head]) {
        mac.update(&frame.raw_id().to_le_bytes());
        mac.update(frame.bytes());
    }
    Some(mac)
}

/// Holds the frames of one node in one direction back until their MAC is there.
#[derive(Debug, Clone)]
pub struct Gate {
    direction: Direction,
    /// By their type.
    frames: [Option<Frame>; SLOTS],
    head: Option<Frame>,
    since_us: u64,
    last: u64,
}

impl Gate {
    /// Takes what is fresher than `last`.
    pub fn new(direction: Direction, last: u64) -> Self {
        Self { direction, frames: [None; SLOTS], head: None, since_us: 0, last }
    }

    /// The greatest nonce that was taken.
    pub fn last(&self) -> u64 {
        self.last
    }

    /// Takes nothing up to this nonce any more.
    pub fn raise(&mut self, last: u64) {
        self.last = self.last.max(last);
    }

    /// Takes one frame of the node: a whole group, when this frame is its MAC's last. Frames that need no MAC are passed
    /// over. One wrong MAC and the group is gone: a forger has one attempt for each.
    ///
    /// Errors: [`MacError`], and nothing else has changed.
    pub fn receive(
        &mut self,
        key: &Key,
        timeout_us: u64,
        time_us: u64,
        frame: &Frame,
    ) -> Result<Option<Group>, MacError> {
        let Some(payload) = frame.full_payload() else { return Ok(None) };
        let [first, second] = self.direction.types();
        match frame.message_type() {
            kind if kind == second => self.close(key, timeout_us, time_us, payload),
            kind if kind == first => {
                self.head = Some(*frame);
                Ok(None)
            }
            kind if self.direction.covers(kind) => self.put(time_us, frame),
            _ => Ok(None),
        }
    }

    fn put(&mut self, time_us: u64, frame: &Frame) -> Result<Option<Group>, MacError> {
        let place = usize::from(frame.message_type().wrapping_sub(self.direction.first()));
        let mut before = Ok(None);
        if self.begins_with(frame.message_type()) && self.frames.get(place) != Some(&Some(*frame)) {
            if self.frames.iter().any(Option::is_some) {
                before = Err(MacError::Incomplete);
            }
            self.clear();
            self.since_us = time_us;
        }
        if let Some(place) = self.frames.get_mut(place) {
            *place = Some(*frame);
        }
        before
    }

    /// Whether a frame of this type opens a group. A state does unless it follows its heartbeat.
    fn begins_with(&self, message_type: u8) -> bool {
        let is_in_heartbeat =
            || self.frames.iter().flatten().any(|frame| frame.message_type() == TYPE_HEARTBEAT);
        match message_type {
            TYPE_READING_START | TYPE_STATUS | TYPE_HEARTBEAT => true,
            TYPE_STATE => !is_in_heartbeat(),
            _ => false,
        }
    }

    fn clear(&mut self) {
        (self.frames, self.head) = ([None; SLOTS], None);
    }

    fn close(
        &mut self,
        key: &Key,
        timeout_us: u64,
        time_us: u64,
        code: &[u8; 8],
    ) -> Result<Option<Group>, MacError> {
        let group = grouped(self.frames.iter().flatten());
        let head = self.head;
        self.clear();
        if group.is_empty() {
            // a MAC whose group was taken or refused already
            return Ok(None);
        }
        let head = head.ok_or(MacError::Incomplete)?;
        let &[frames, a, b, c, d, e, f, g] = head.full_payload().ok_or(MacError::Incomplete)?;
        let is_late = time_us.saturating_sub(self.since_us) > timeout_us;
        if usize::from(frames) != group.len() || is_late {
            return Err(MacError::Incomplete);
        }
        // in constant time
        if hmac(key, &group, &head).is_none_or(|mac| mac.verify_truncated_left(code).is_err()) {
            return Err(MacError::Forged);
        }
        let nonce = u64::from_le_bytes([a, b, c, d, e, f, g, 0]);
        if nonce <= self.last {
            return Err(MacError::Replayed);
        }
        self.last = nonce;
        Ok(Some(group))
    }
}

#[cfg(test)]
mod tests;

//! Readings with a seal, and frames that count only with theirs.

use std::time::{SystemTime, UNIX_EPOCH};

use rotor_edge_core::can::Frame;
use rotor_edge_core::can::seal::{Direction, Gate, SEAL_FRAMES, SealError, seal};
use rotor_edge_core::command::Key;
use rotor_edge_core::node::NodeConfig;
use serde::Serialize;

/// This machine's clock, µs since 1970.
pub fn present_us() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_micros() as u64)
}

/// Seals the readings for one monitor.
#[derive(Debug, Clone)]
pub struct Sealer {
    key: Key,
    node: u8,
    last: u64,
}

impl Sealer {
    /// With the monitor's key.
    pub fn new(key: Key, node: u8) -> Self {
        Self { key, node, last: 0 }
    }

    /// What is to follow these frames of a reading: fresher than all before, and by this machine's clock.
    pub fn seal(&mut self, reading: &[Frame]) -> [Frame; SEAL_FRAMES] {
        self.last = present_us().max(self.last + 1);
        seal(&self.key, Direction::ToNode, self.node, self.last, reading)
    }
}

/// Groups of frames that were not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Refused {
    /// Without a seal, or with frames missing.
    pub unsealed: u64,
    /// With a code that is not one by the key.
    pub forged: u64,
    /// With the right code, and no fresher than what was heard before.
    pub replayed: u64,
}

impl Refused {
    /// Whether there were any.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }

    fn count(&mut self, error: SealError) {
        match error {
            SealError::Forged => self.forged += 1,
            SealError::Replayed => self.replayed += 1,
            _ => self.unsealed += 1,
        }
    }
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { unsealed, forged, replayed } = self;
        write!(
            f,
            "refused: {forged} with a wrong seal, {replayed} recorded before, {unsealed} without a whole seal"
        )
    }
}

/// Lets through what one monitor and those who send readings to it say under its key.
#[derive(Debug, Clone)]
pub struct Checker {
    key: Key,
    node: u8,
    gates: [Gate; 2],
    refused: Refused,
}

impl Checker {
    /// Believes any freshness at first.
    pub fn new(key: Key, node: u8) -> Self {
        let gates = [Direction::ToNode, Direction::ToHost].map(|direction| Gate::new(direction, 0));
        Self { key, node, gates, refused: Refused::default() }
    }

    /// Which monitor.
    pub fn node(&self) -> u8 {
        self.node
    }

    /// What was not believed so far.
    pub fn refused(&self) -> Refused {
        self.refused
    }

    /// Takes any frame: those that may be believed now. Frames of other monitors, and those that no seal covers, are.
    pub fn take(&mut self, time_us: u64, frame: &Frame) -> Vec<Frame> {
        let is_covered =
            [Direction::ToNode, Direction::ToHost].iter().any(|d| d.covers(frame.message_type()));
        if frame.node() != self.node || !(is_covered || frame.is_seal()) {
            return vec![*frame];
        }
        // the time-out is the same for every number
        let timeout_us = NodeConfig::new(0).reading_timeout_us;
        let mut believed = Vec::new();
        for gate in &mut self.gates {
            match gate.receive(&self.key, timeout_us, time_us, frame) {
                Ok(group) => believed.extend(group.into_iter().flatten()),
                Err(error) => self.refused.count(error),
            }
        }
        believed
    }
}

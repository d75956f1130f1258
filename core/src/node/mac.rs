//! A node that takes only readings with a MAC, and sends a MAC with all it tells.

use super::{Node, QUEUE_FRAMES, Save};
use crate::can::Frame;
use crate::can::mac::{Direction, Gate, MAC_FRAMES, MacError, grouped, mac_frames};
use crate::numerics::Numerics;

/// How far the stored nonce is ahead of the nonce of the frames that the node sends. Each group of frames raises their nonce by
/// one, so the reserve lasts for days; it is one second of readings that are numbered in µs.
const OWN_FRAMES_RESERVE: u64 = 1_000_000;

/// Readings that wait for their MAC, and the last nonces.
#[derive(Debug, Clone)]
pub(super) struct Mac {
    gate: Gate,
    /// Of what was told last.
    told: u64,
    /// What is stored: as far ahead of the readings as none will be taken after a restart.
    stored: u64,
    wanted: Option<u64>,
    /// The nonce that was to be stored last could not be.
    unsaved: bool,
}

impl Mac {
    pub fn new() -> Self {
        Self { gate: Gate::new(Direction::ToNode, 0), told: 0, stored: 0, wanted: None, unsaved: false }
    }

    /// Storing goes ahead of the readings by up to the reserve, and begins anew when half of it is used up: flash wears out.
    fn reserve(&mut self, last: u64, reserve: u64) {
        if last.saturating_add(reserve / 2) > self.wanted.unwrap_or(self.stored) {
            self.wanted = Some(last.saturating_add(reserve));
        }
    }
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    /// Takes up the nonce stored last, after a restart: no reading with this nonce or a lower one is taken.
    pub fn restore_nonce(&mut self, nonce: u64) {
        let mac = &mut self.mac;
        mac.gate.raise(nonce);
        mac.told = mac.told.max(nonce);
        mac.stored = mac.stored.max(nonce);
    }

    pub(super) fn is_authenticated(&self) -> bool {
        self.config.authenticated
    }

    /// A frame that may belong to an authenticated reading. Nothing but the counters changes before its MAC proves right.
    pub(super) fn take_authenticated(&mut self, time_us: u64, frame: &Frame) {
        let Some(key) = self.config.key else { return };
        match self.mac.gate.receive(&key, self.config.reading_timeout_us, time_us, frame) {
            Ok(None) => {}
            Ok(Some(group)) => {
                let mac = &mut self.mac;
                mac.reserve(mac.gate.last(), self.config.nonce_reserve);
                for frame in &group {
                    self.take_up(time_us, frame);
                }
            }
            Err(MacError::Incomplete) => self.count(|c| &mut c.incomplete),
            Err(MacError::Forged) => self.count(|c| &mut c.forged),
            Err(MacError::Replayed) => self.count(|c| &mut c.replayed),
        }
    }

    /// Queues what the node tells, with its MAC if the node sends MACs, or nothing. Whether there was room.
    pub(super) fn tell(&mut self, frames: &[Frame], most: usize) -> bool {
        let Some(key) = self.config.key.filter(|_| self.config.authenticated) else {
            return self.queue_all(frames, most);
        };
        let waiting = self.queue.len();
        // A queue without room for the MAC refuses all of it.
        if QUEUE_FRAMES.saturating_sub(waiting) < most.saturating_add(MAC_FRAMES) {
            let counters = self.assembler.counters_mut();
            counters.overflowed = counters.overflowed.wrapping_add(most as u32);
            return false;
        }
        if !self.queue_all(frames, most) {
            return false;
        }
        let mac = &mut self.mac;
        mac.told = mac.told.saturating_add(1).max(mac.gate.last());
        mac.reserve(mac.told, OWN_FRAMES_RESERVE);
        let told = grouped(self.queue.iter().skip(waiting));
        for frame in mac_frames(&key, Direction::ToHost, self.config.node, mac.told, &told) {
            let _ = self.queue.push_back(frame);
        }
        true
    }

    pub(super) fn nonce_to_save(&self) -> Option<Save<'_>> {
        self.mac.wanted.map(Save::Nonce)
    }

    /// Whether it was the nonce that was to be stored. What could not be is tried again with the next reading.
    pub(super) fn nonce_saved(&mut self, stored: bool) -> bool {
        let Some(wanted) = self.mac.wanted.take() else { return false };
        self.mac.unsaved = !stored;
        if stored {
            self.mac.stored = wanted;
        } else {
            self.count(|c| &mut c.unsaved);
        }
        true
    }

    pub(super) fn is_nonce_unsaved(&self) -> bool {
        self.mac.unsaved
    }
}

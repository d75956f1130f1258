//! A node that takes readings with a seal alone, and seals what it tells.

use super::{Node, QUEUE_FRAMES, Save};
use crate::can::Frame;
use crate::can::seal::{Direction, Gate, SEAL_FRAMES, SealError, grouped, seal};
use crate::numerics::Numerics;

/// The same for what is told without a reading between: days of it, and to readings only an instant.
const WORDS_RESERVE: u64 = 1_000_000;

/// Where readings wait for their seal, and how fresh the last ones were.
#[derive(Debug, Clone)]
pub(super) struct Seals {
    gate: Gate,
    /// Of what was told last.
    told: u64,
    /// What is stored: as far ahead of the readings as none will be taken after a restart.
    stored: u64,
    wanted: Option<u64>,
}

impl Seals {
    pub fn new() -> Self {
        Self { gate: Gate::new(Direction::ToNode, 0), told: 0, stored: 0, wanted: None }
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
    /// Takes up the freshness stored last, after a restart: no reading that was sealed before it is taken.
    pub fn restore_freshness(&mut self, freshness: u64) {
        let seals = &mut self.seals;
        seals.gate.raise(freshness);
        seals.told = seals.told.max(freshness);
        seals.stored = seals.stored.max(freshness);
    }

    pub(super) fn is_sealed(&self) -> bool {
        self.config.sealed
    }

    /// A frame that may be one of a sealed reading. Nothing but the counters changes before its seal proves right.
    pub(super) fn take_sealed(&mut self, time_us: u64, frame: &Frame) {
        let Some(key) = self.config.key else { return };
        match self.seals.gate.receive(&key, self.config.reading_timeout_us, time_us, frame) {
            Ok(None) => {}
            Ok(Some(group)) => {
                let seals = &mut self.seals;
                seals.reserve(seals.gate.last(), self.config.freshness_reserve);
                for frame in &group {
                    self.take_up(time_us, frame);
                }
            }
            Err(SealError::Incomplete) => self.count(|c| &mut c.incomplete),
            Err(SealError::Forged) => self.count(|c| &mut c.forged),
            Err(SealError::Replayed) => self.count(|c| &mut c.replayed),
        }
    }

    /// Queues what the node tells, with its seal if it seals, or nothing. Whether there was room.
    pub(super) fn tell<const COUNT: usize>(&mut self, frames: impl IntoIterator<Item = Frame>) -> bool {
        let Some(key) = self.config.key.filter(|_| self.config.sealed) else {
            return self.queue_all::<COUNT>(frames);
        };
        let waiting = self.queue.len();
        // A queue without room for the seal refuses all of it.
        if QUEUE_FRAMES.saturating_sub(waiting) < COUNT.saturating_add(SEAL_FRAMES) {
            let counters = self.assembler.counters_mut();
            counters.overflowed = counters.overflowed.wrapping_add(COUNT as u32);
            return false;
        }
        if !self.queue_all::<COUNT>(frames) {
            return false;
        }
        let seals = &mut self.seals;
        seals.told = seals.told.saturating_add(1).max(seals.gate.last());
        seals.reserve(seals.told, WORDS_RESERVE);
        let told = grouped(self.queue.iter().skip(waiting));
        for frame in seal(&key, Direction::ToHost, self.config.node, seals.told, &told) {
            let _ = self.queue.push_back(frame);
        }
        true
    }

    pub(super) fn freshness_to_save(&self) -> Option<Save<'_>> {
        self.seals.wanted.map(Save::Freshness)
    }

    /// Whether it was the freshness that was to be stored. What could not be is tried again with the next reading.
    pub(super) fn freshness_saved(&mut self, stored: bool) -> bool {
        let Some(wanted) = self.seals.wanted.take() else { return false };
        if stored {
            self.seals.stored = wanted;
        } else {
            self.count(|c| &mut c.unsaved);
        }
        true
    }
}

//! What is stored, and when the memory is: at once when a flag is raised or lowered, otherwise seldom, for flash wears out.

use crate::memory::MemoryBytes;
use crate::thresholds::ThresholdBytes;

/// After the first failure it is tried again so much later, and after each further one twice as late as before.
const RETRY_US: u64 = 1_000_000;
/// Doublings at most: a minute later is soon enough where there is room again, and spares flash that fails.
const MOST_DOUBLINGS: u8 = 6;

/// What must survive a loss of power.
#[derive(Debug, Clone, PartialEq)]
pub enum Save<'a> {
    /// A command waits to take effect until all of this is stored, or nothing of it. Only with the feature `command`.
    Command {
        /// Last counter accepted, for `Node::restore_counter`.
        counter: u64,
        /// The new model's bytes, for [`Node::load`](super::Node::load); `None` if the model stays.
        model: Option<&'a [u8]>,
        /// The new thresholds, for [`Node::restore_thresholds`](super::Node::restore_thresholds); `None` if they stay.
        thresholds: Option<ThresholdBytes>,
    },
    /// What the node has learned of the machine, for [`Node::restore`](super::Node::restore).
    Memory(MemoryBytes),
    /// Greatest nonce that is refused after a restart, for `Node::restore_nonce`. Only with the feature `mac`.
    Nonce(u64),
}

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SaveScheduler {
    due_us: Option<u64>,
    saved_us: Option<u64>,
    wanted: bool,
    /// Failures since something was stored last.
    failures: u8,
}

impl SaveScheduler {
    /// Something has changed. What was never stored since the start is due at once.
    pub fn changed(&mut self, time_us: u64, period_us: u64) {
        // What failed is tried again at its own time.
        if self.is_failing() {
            return;
        }
        let due_us = self.saved_us.map_or(time_us, |saved_us| saved_us.saturating_add(period_us));
        self.due_us = Some(self.due_us.map_or(due_us, |earlier_us| earlier_us.min(due_us)));
    }

    /// Something has changed that must not be lost.
    pub fn changed_much(&mut self, time_us: u64) {
        self.due_us = Some(time_us);
    }

    pub fn poll(&mut self, time_us: u64) {
        self.wanted = self.due_us.is_some_and(|due_us| time_us >= due_us);
    }

    pub fn poll_at(&self) -> Option<u64> {
        self.due_us.filter(|_| !self.wanted)
    }

    pub fn is_wanted(&self) -> bool {
        self.wanted
    }

    /// What was to be stored last could not be.
    pub fn is_failing(&self) -> bool {
        self.failures > 0
    }

    pub fn saved(&mut self, time_us: u64, stored: bool) {
        self.wanted = false;
        if stored {
            (self.due_us, self.saved_us, self.failures) = (None, Some(time_us), 0);
        } else {
            self.due_us = Some(time_us.saturating_add(RETRY_US << self.failures.min(MOST_DOUBLINGS)));
            self.failures = self.failures.saturating_add(1);
        }
    }
}

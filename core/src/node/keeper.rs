//! When the memory is to be stored: at once when a flag is raised or lowered, otherwise seldom, for flash wears out.

/// After a failure it is tried again so much later.
const RETRY_US: u64 = 1_000_000;

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Keeper {
    due_us: Option<u64>,
    saved_us: Option<u64>,
    wanted: bool,
}

impl Keeper {
    /// Something has changed. What was never stored since the start is due at once.
    pub fn changed(&mut self, time_us: u64, period_us: u64) {
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

    pub fn saved(&mut self, time_us: u64, stored: bool) {
        self.wanted = false;
        if stored {
            (self.due_us, self.saved_us) = (None, Some(time_us));
        } else {
            self.due_us = Some(time_us.saturating_add(RETRY_US));
        }
    }
}

//! When the watchdog may be fed: only after every part of the program has come round since the last time, so that one
//! that hangs is not covered by another that runs.

/// A part of the program that must come round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Frames are taken from the controller, or there were none.
    Receive,
    /// The node was polled at a later time than before.
    Poll,
    /// Frames are handed to the controller, dropped in time, or there were none.
    Send,
}

const ALL: u8 = 0b111;

/// What has come round since the watchdog was fed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    seen: u8,
    polled_us: u64,
}

impl Progress {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self { seen: 0, polled_us: 0 }
    }

    /// A part came round.
    pub fn made(&mut self, part: Part) {
        self.seen |= 1 << part as u8;
    }

    /// The node was polled. A clock that stands still is no progress.
    pub fn polled(&mut self, time_us: u64) {
        if time_us > self.polled_us {
            self.polled_us = time_us;
            self.made(Part::Poll);
        }
    }

    /// Whether to feed the watchdog now; if so, all parts must come round again.
    pub fn may_feed(&mut self) -> bool {
        let all = self.seen == ALL;
        if all {
            self.seen = 0;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_after_all_parts_and_then_all_again() {
        let mut progress = Progress::new();
        for time_us in 1..4 {
            assert!(!progress.may_feed());
            progress.made(Part::Receive);
            progress.made(Part::Send);
            assert!(!progress.may_feed());
            progress.polled(time_us);
            assert!(progress.may_feed());
        }
        assert!(!progress.may_feed());
    }

    #[test]
    fn a_clock_that_stands_still_starves_the_watchdog() {
        let mut progress = Progress::new();
        progress.polled(5);
        progress.made(Part::Receive);
        progress.made(Part::Send);
        assert!(progress.may_feed());
        progress.polled(5);
        progress.made(Part::Receive);
        progress.made(Part::Send);
        assert!(!progress.may_feed());
    }
}

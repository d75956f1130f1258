//! Where a monitor's time comes from.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// A clock that never goes back.
pub trait Clock: Sync {
    /// Time since the start, µs.
    fn now_us(&self) -> u64;
}

pub struct RealTime(Instant);

impl RealTime {
    pub fn start() -> Self {
        Self(Instant::now())
    }
}

impl Clock for RealTime {
    fn now_us(&self) -> u64 {
        self.0.elapsed().as_micros() as u64
    }
}

/// Time as somebody plays it: it stands still until it is set.
#[derive(Default)]
pub struct PlayedTime(AtomicU64);

impl PlayedTime {
    /// Goes on to a later time.
    pub fn set(&self, time_us: u64) {
        self.0.fetch_max(time_us, Ordering::Release);
    }
}

impl Clock for PlayedTime {
    fn now_us(&self) -> u64 {
        self.0.load(Ordering::Acquire)
    }
}

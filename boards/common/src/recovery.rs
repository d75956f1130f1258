//! When to join the bus again: a controller that was thrown off it (bus-off) waits, longer each time, so that a faulty
//! one does not disturb the others for ever, and at most ten seconds, so that a repaired cable is found.

/// The first wait, µs: the 128 × 11 recessive bits that the standard asks for take 3 ms at 500 kbit/s.
const FIRST_US: u64 = 100_000;
/// The longest wait, µs.
const LONGEST_US: u64 = 10_000_000;
/// On the bus for so long, the next fault counts as the first, µs.
const HEALED_US: u64 = 60_000_000;

/// Where a controller stands with its bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recovery {
    wait_us: u64,
    /// When to join again, while off the bus.
    due_us: Option<u64>,
    joined_us: u64,
    times_off: u16,
}

impl Default for Recovery {
    fn default() -> Self {
        Self::new()
    }
}

impl Recovery {
    /// On the bus.
    pub const fn new() -> Self {
        Self { wait_us: FIRST_US, due_us: None, joined_us: 0, times_off: 0 }
    }

    /// To be called regularly with what the controller says; `true` once when it is to join again.
    pub fn poll(&mut self, time_us: u64, is_off: bool) -> bool {
        match self.due_us {
            None if is_off => {
                self.times_off = self.times_off.saturating_add(1);
                if time_us.saturating_sub(self.joined_us) >= HEALED_US {
                    self.wait_us = FIRST_US;
                }
                self.due_us = Some(time_us.saturating_add(self.wait_us));
                self.wait_us = (2 * self.wait_us).min(LONGEST_US);
                false
            }
            Some(due_us) if time_us >= due_us => {
                self.due_us = None;
                self.joined_us = time_us;
                true
            }
            _ => false,
        }
    }

    /// Times off the bus since the start.
    pub fn times_off(&self) -> u16 {
        self.times_off
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Times of joining within `until_us`, the controller being off the bus whenever `is_off` says so.
    fn joins(until_us: u64, is_off: impl Fn(u64) -> bool) -> Vec<u64> {
        let mut recovery = Recovery::new();
        (0..until_us).step_by(10_000).filter(|&t| recovery.poll(t, is_off(t))).collect()
    }

    #[test]
    fn waits_double_up_to_ten_seconds_while_the_fault_lasts() {
        let joins = joins(60_000_000, |_| true);
        let waits: Vec<u64> = joins.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert_eq!(joins[0], 100_000);
        assert!(waits.windows(2).all(|pair| pair[1] >= pair[0]));
        assert!(waits.iter().all(|&wait| wait <= 10_020_000), "{waits:?}");
        assert!(waits.last().is_some_and(|&wait| wait >= 10_000_000));
    }

    #[test]
    fn waits_double_in_a_fault_long_after_the_start() {
        let mut recovery = Recovery::new();
        let begins_us = 2 * HEALED_US;
        let times = (0..begins_us + 5_000_000).step_by(10_000);
        let joins: Vec<u64> = times.filter(|&t| recovery.poll(t, t >= begins_us)).collect();
        let waits: Vec<u64> = joins.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(waits.len() >= 4 && waits.windows(2).all(|pair| pair[1] > pair[0]), "{waits:?}");
    }

    #[test]
    fn faultless_bus_is_never_rejoined_and_healed_one_resets_wait() {
        assert!(joins(60_000_000, |_| false).is_empty());
        let mut recovery = Recovery::new();
        for time_us in (0..5_000_000).step_by(10_000) {
            recovery.poll(time_us, true);
        }
        for time_us in (5_000_000..100_000_000).step_by(10_000) {
            recovery.poll(time_us, false);
        }
        let times_off = recovery.times_off();
        assert!(!recovery.poll(100_000_000, true));
        assert!(!recovery.poll(100_090_000, true) && recovery.poll(100_100_000, true));
        assert_eq!(recovery.times_off(), times_off + 1);
    }
}

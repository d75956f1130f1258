//! Whether samples came without a gap, by a clock that does not depend on how they came.

/// Compares samples with the time they take. A ring that was overwritten is short of whole rounds, a converter that misses
/// its trigger of some samples; either way the next ones come later than they should, and stay late. Clock and trigger must
/// divide the same crystal exactly: what they drift apart would add up to losses that never were.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pace {
    scans: i64,
    /// When the first sample was taken, by the earliest delivery so far.
    begin_us: Option<i64>,
}

impl Pace {
    pub const fn new() -> Self {
        Self { scans: 0, begin_us: None }
    }

    /// So many more scans, one each `scan_us`, are read at this time. `false` if they are late by as long as they took: half
    /// a ring is then overwritten while it is read, or samples are missing.
    pub fn keeps(&mut self, scans: usize, scan_us: u32, time_us: u64) -> bool {
        let (scans, scan_us) = (scans as i64, i64::from(scan_us));
        self.scans += scans;
        let begin_us = time_us as i64 - self.scans * scan_us;
        let earliest_us = self.begin_us.map_or(begin_us, |before| before.min(begin_us));
        self.begin_us = Some(earliest_us);
        begin_us - earliest_us < scans * scan_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCANS: usize = 100;
    const SCAN_US: u32 = 50;
    const HALF_US: u64 = 5_000;

    #[test]
    fn reader_late_by_less_than_half_a_buffer_loses_nothing() {
        let mut pace = Pace::new();
        for half in 1..10_000 {
            let late_us = half * 2_654_435_761 % HALF_US;
            assert!(pace.keeps(SCANS, SCAN_US, half * HALF_US + late_us));
        }
    }

    #[test]
    fn a_first_read_that_was_late_hides_no_later_one() {
        let mut pace = Pace::new();
        let read = [HALF_US + 4_000, 2 * HALF_US, 3 * HALF_US + 4_999, 5 * HALF_US];
        assert_eq!(read.map(|time_us| pace.keeps(SCANS, SCAN_US, time_us)), [true, true, true, false]);
    }

    #[test]
    fn missed_round_of_double_buffer_is_detected_for_any_delay() {
        for first_us in (0..HALF_US).step_by(100) {
            for second_us in (0..HALF_US).step_by(100) {
                let mut pace = Pace::new();
                assert!(pace.keeps(SCANS, SCAN_US, HALF_US + first_us));
                assert!(!pace.keeps(SCANS, SCAN_US, 4 * HALF_US + second_us));
            }
        }
    }

    #[test]
    fn converter_missing_one_trigger_in_a_hundred_is_detected() {
        let mut pace = Pace::new();
        let slow_us = HALF_US + u64::from(SCAN_US);
        let found = (1..200).position(|half| !pace.keeps(SCANS, SCAN_US, half * slow_us));
        // 50 µs lost a half: 5 ms after a hundred more
        assert_eq!(found, Some(100));
    }
}

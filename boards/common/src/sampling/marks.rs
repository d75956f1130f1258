//! The keyphasor's marks as a timer captured them, in the order of the scans.

use heapless::Deque;

/// How the timer that captures marks hangs together with the scans: both divide the same clock, and began together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CaptureConfig {
    /// Ticks from one scan to the next.
    pub scan_ticks: u32,
    /// Ticks after which the timer begins again at 0: a whole number of scans.
    pub length_ticks: u32,
    /// From the timer's beginning to the instant of the keyphasor's conversion in the first scan, by the timer's reckoning:
    /// what its input is late by is added.
    pub first_ticks: u32,
}

/// Marks in 10 ms, at most: 48,000 rpm.
const WAITING: usize = 8;

/// Marks that scans have not come up to yet.
#[derive(Debug, Clone)]
pub struct Marks {
    config: CaptureConfig,
    waiting: Deque<u32, WAITING>,
    /// The next scan's instant.
    scan_ticks: u32,
}

impl Marks {
    /// Before the first scan.
    pub fn new(config: CaptureConfig) -> Self {
        Self { config, waiting: Deque::new(), scan_ticks: config.first_ticks }
    }

    /// Takes what the timer captured next. More than there is room for is noise, and dropped.
    pub fn captured(&mut self, ticks: u32) {
        let _ = self.waiting.push_back(ticks);
    }

    /// Goes on to the next scan: whether a mark passed since the one before, and how long before this one, in scans.
    pub fn next(&mut self) -> Option<f32> {
        let CaptureConfig { scan_ticks, length_ticks, .. } = self.config;
        let now = self.scan_ticks;
        self.scan_ticks = wrapped(u64::from(now) + u64::from(scan_ticks), length_ticks);
        let mut found = None;
        while let Some(&mark) = self.waiting.front() {
            let age_ticks = wrapped(u64::from(now) + u64::from(length_ticks) - u64::from(mark), length_ticks);
            // More than half of the timer's length is ahead.
            if age_ticks > length_ticks / 2 {
                break;
            }
            self.waiting.pop_front();
            if age_ticks < scan_ticks {
                found = Some(age_ticks as f32 / scan_ticks as f32);
            }
        }
        found
    }
}

/// A sum of at most two lengths, as the timer counts.
fn wrapped(ticks: u64, length_ticks: u32) -> u32 {
    let length = u64::from(length_ticks);
    (if ticks >= length { ticks - length } else { ticks }) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const CONFIG: CaptureConfig =
        CaptureConfig { scan_ticks: 8_500, length_ticks: 8_500 * 1_000, first_ticks: 11_600 };

    #[test]
    fn marks_are_found_at_their_scan_for_many_timer_lengths() {
        let mut marks = Marks::new(CONFIG);
        // 1.2345 ms and a third of a tick, so that every phase comes up
        let instant = |number: u64| 20_000 + number * 209_865 + number / 3;
        let (mut next, mut found) = (0, 0);
        for scan in 0..50_000_u64 {
            let now = 11_600 + scan * 8_500;
            // The interrupt's mark is there long before the scan is read.
            while instant(next) < now + 4_000 {
                marks.captured((instant(next) % u64::from(CONFIG.length_ticks)) as u32);
                next += 1;
            }
            if let Some(age) = marks.next() {
                let expected = (now - instant(found)) as f32 / 8_500.0;
                assert!((0.0..1.0).contains(&age) && (age - expected).abs() < 1e-6, "{age} for {expected}");
                found += 1;
            }
        }
        assert!(found > 2_000 && next - found <= 1, "{found} of {next}");
    }

    #[test]
    fn a_mark_of_long_ago_is_passed_over_and_one_ahead_waits() {
        let mut marks = Marks::new(CONFIG);
        let found: Vec<_> = (0..4).map(|_| marks.next()).collect();
        assert_eq!(found, [None; 4]);
        // The fifth scan is at 45,600.
        marks.captured(20_000);
        marks.captured(54_000);
        assert_eq!(marks.next(), None);
        assert_eq!(marks.next(), Some((54_100 - 54_000) as f32 / 8_500.0));
    }

    #[test]
    fn noise_fills_the_room_and_no_more() {
        let mut marks = Marks::new(CONFIG);
        (0..100).for_each(|ticks| marks.captured(ticks));
        assert_eq!(marks.next(), None);
        marks.captured(11_600 + 8_400);
        assert_eq!(marks.next(), Some(100.0 / 8_500.0));
    }
}

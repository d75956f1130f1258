//! For how much of the time readings are suspicious: Page's cumulative sum (1954).
//!
//! ```text
//! suspicious reading   sum + its time             count + 1
//! other reading        sum − a quarter of its     count − 1/4     neither falls below zero
//! ```
//!
//! A share p of suspicious time adds p − (1 − p)/4: the sums fill above p = 1/5, in whatever pattern suspicion comes and
//! goes. Without a break they are the time and the number of suspicious readings.

use crate::scalar;
use crate::thresholds::Thresholds;

/// A reading that is not suspicious takes away one of so many parts.
const PARTS: u16 = 4;
/// The sums end at this multiple of what makes a flag, so that they empty in a known time after a long fault.
const FULL: u16 = 2;

/// Cumulative sums, and the suspicious readings in a row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Suspicion {
    pub sum_s: f32,
    /// The sum of readings, in quarters.
    pub quarters: u16,
    /// Suspicious readings in a row; those within the averaging time count as one.
    pub run: u16,
    pub run_s: f32,
}

impl Suspicion {
    /// Goes on after a loss of power, as if the sums were one run.
    pub fn resume(sum_s: f32, quarters: u16) -> Self {
        Self { sum_s, quarters, run: quarters / PARTS, run_s: sum_s }
    }

    /// Goes on after a loss of power from a run without a break.
    pub fn resume_run(run: u16, run_s: f32) -> Self {
        Self::resume(run_s, run.saturating_mul(PARTS))
    }

    /// No suspicious reading is remembered.
    pub fn is_empty(&self) -> bool {
        self.quarters == 0 && self.sum_s == 0.0
    }

    /// Takes a reading `dt_s` after the one before, `None` if nobody knows when that was. `counts`: it is not within the
    /// averaging time of the last one that counted.
    pub fn take(&mut self, thresholds: &Thresholds, is_suspicious: bool, dt_s: Option<f32>, counts: bool) {
        if !is_suspicious {
            (self.run, self.run_s) = (0, 0.0);
            // After a restart a reading stands for one mean's time at least.
            let dt_s = dt_s.unwrap_or(thresholds.average_s);
            self.sum_s = scalar::greater(0.0, self.sum_s - dt_s / f32::from(PARTS));
            self.quarters = self.quarters.saturating_sub(u16::from(counts));
            return;
        }
        // After a restart nobody knows for how long: long enough, if there are readings enough.
        let dt_s = dt_s.unwrap_or(thresholds.persistence_s);
        // The first of all has no time behind it.
        if !self.is_empty() {
            self.sum_s = scalar::lesser(f32::from(FULL) * thresholds.persistence_s, self.sum_s + dt_s);
        }
        if self.run > 0 {
            self.run_s += dt_s;
        }
        if counts {
            self.run = self.run.saturating_add(1);
            let most = FULL * PARTS * u16::from(thresholds.persistence_readings);
            self.quarters = self.quarters.saturating_add(PARTS).min(most);
        }
    }

    /// Time and readings suffice for a flag.
    pub fn persists(&self, thresholds: &Thresholds) -> bool {
        self.sum_s >= thresholds.persistence_s
            && self.quarters >= PARTS * u16::from(thresholds.persistence_readings)
    }

    /// The last run alone would not suffice.
    pub fn is_intermittent(&self, thresholds: &Thresholds) -> bool {
        self.run_s < thresholds.persistence_s || self.run < u16::from(thresholds.persistence_readings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    const THRESHOLDS: Thresholds = Thresholds::DEFAULT;
    const DAY_S: f32 = 86_400.0;

    /// Plays a pattern of suspicious readings and gives the place of the first that persists.
    fn first(dt_s: f32, pattern: impl IntoIterator<Item = bool>) -> Option<usize> {
        let mut suspicion = Suspicion::default();
        let mut since_count_s = f32::INFINITY;
        for (place, is_suspicious) in pattern.into_iter().enumerate() {
            let counts = since_count_s >= THRESHOLDS.average_s || (is_suspicious && suspicion.run == 0);
            since_count_s = if counts { dt_s } else { since_count_s + dt_s };
            suspicion.take(&THRESHOLDS, is_suspicious, (place > 0).then_some(dt_s), counts);
            if is_suspicious && suspicion.persists(&THRESHOLDS) {
                return Some(place);
            }
        }
        None
    }

    /// `bad` of `length` readings are suspicious, again and again.
    fn periodic(bad: usize, length: usize) -> impl Iterator<Item = bool> {
        (0..10_000).map(move |place| place % length < bad)
    }

    #[test]
    fn share_above_a_fifth_fills_the_sum_in_any_pattern() {
        for dt_s in [0.1, 0.5, 1.0, 60.0, DAY_S] {
            for (bad, length) in [(1, 2), (2, 3), (1, 4), (10, 40), (25, 100)] {
                assert!(first(dt_s, periodic(bad, length)).is_some(), "{bad} of {length} at {dt_s} s");
            }
        }
        let mut random = Random::new(5);
        let pattern: std::vec::Vec<bool> = (0..10_000).map(|_| random.signed() > 0.4).collect();
        assert!(first(0.1, pattern).is_some(), "three of ten at random");
    }

    #[test]
    fn share_below_a_fifth_never_persists() {
        for dt_s in [0.1, 1.0, 60.0, DAY_S] {
            for (bad, length) in [(1, 6), (1, 10), (2, 12), (5, 30)] {
                // a run long enough for a flag on its own is another matter
                if bad as f32 * dt_s < THRESHOLDS.persistence_s || bad < 3 {
                    assert_eq!(first(dt_s, periodic(bad, length)), None, "{bad} of {length} at {dt_s} s");
                }
            }
        }
    }

    #[test]
    fn unbroken_suspicion_persists_after_time_and_readings() {
        assert_eq!(first(DAY_S, [true; 5]), Some(2));
        assert_eq!(first(2.0, [true; 10]), Some(5));
        let place = first(0.1, [true; 200]).unwrap();
        assert!((100..=101).contains(&place), "{place}");
    }

    #[test]
    fn one_outlier_is_forgotten_after_four_readings() {
        let mut suspicion = Suspicion::default();
        suspicion.take(&THRESHOLDS, true, Some(DAY_S), true);
        assert_eq!((suspicion.sum_s, suspicion.quarters, suspicion.run), (0.0, 4, 1));
        for left in [3, 2, 1, 0] {
            suspicion.take(&THRESHOLDS, false, Some(DAY_S), true);
            assert_eq!((suspicion.quarters, suspicion.run), (left, 0));
        }
        assert_eq!(suspicion, Suspicion::default());
    }

    #[test]
    fn sum_of_a_long_fault_empties_within_eight_persistences() {
        let mut suspicion = Suspicion::default();
        for _ in 0..100_000 {
            suspicion.take(&THRESHOLDS, true, Some(1.0), true);
        }
        assert!(suspicion.persists(&THRESHOLDS) && !suspicion.is_intermittent(&THRESHOLDS));
        let mut left_s = 0.0;
        while !suspicion.is_empty() {
            suspicion.take(&THRESHOLDS, false, Some(1.0), true);
            left_s += 1.0;
        }
        assert!(left_s <= 8.0 * THRESHOLDS.persistence_s, "{left_s}");
    }
}

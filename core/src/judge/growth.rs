//! How much a plane's unbalance may have grown.

use super::seconds_since;
use crate::model::{MAX_PLANES, Pair};
use crate::scalar;
use crate::thresholds::Thresholds;

/// Part of the growth time after which the anchor moves: with f32, steps of a tenth of a second would change nothing.
const STEP: f32 = 1.0 / 256.0;

/// What each plane's unbalance was about one growth time ago: the bound is a multiple of it. A bound on the last
/// estimate alone would let noise pull the unbalance down at every reading and up only at the pace of growth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Growth {
    anchor_g_mm: [f32; MAX_PLANES],
    since_us: Option<u64>,
}

impl Growth {
    /// The bound on each plane's unbalance, g·mm, at this time, after `last_g_mm`.
    ///
    /// The anchor follows the unbalance with `growth_s` as time constant. Readings that far apart or farther, and the
    /// first one, are bounded by the unbalance before, as in Bera et al. (2023).
    pub fn bounds_g_mm(
        &mut self,
        thresholds: &Thresholds,
        time_us: u64,
        last_g_mm: &[Pair],
    ) -> [f32; MAX_PLANES] {
        let part =
            self.since_us.map_or(1.0, |since_us| seconds_since(since_us, time_us) / thresholds.growth_s);
        if part >= STEP {
            for (anchor, &last) in self.anchor_g_mm.iter_mut().zip(last_g_mm) {
                let last = scalar::length(last);
                *anchor = if part >= 1.0 { last } else { *anchor + part * (last - *anchor) };
            }
            self.since_us = Some(time_us);
        }
        self.anchor_g_mm.map(|anchor| thresholds.growth * anchor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY_US: u64 = 86_400_000_000;
    const THRESHOLDS: Thresholds = Thresholds::DEFAULT;

    #[test]
    fn daily_readings_are_bounded_by_the_one_before() {
        let mut growth = Growth::default();
        for (day, last) in (0..).zip([100.0, 50.0, 70.0, 0.0]) {
            let bounds = growth.bounds_g_mm(&THRESHOLDS, day * DAY_US, &[[last, 0.0], [0.0, -2.0 * last]]);
            assert_eq!(bounds[..2], [1.2 * last, 1.2 * (2.0 * last)]);
        }
    }

    /// An unbalance that always grows as much as it may.
    fn grown(period_us: u64, days: u64) -> f32 {
        let mut growth = Growth::default();
        let mut last = 100.0;
        for step in 0..=days * DAY_US / period_us {
            last = growth.bounds_g_mm(&THRESHOLDS, step * period_us, &[[last, 0.0]])[0];
        }
        last / 120.0
    }

    #[test]
    fn no_pace_of_readings_lets_an_unbalance_grow_faster_than_stated_by_a_quarter_more() {
        // In small steps da/dt = 0.2 a/τ: e^0.2 = 1.221 a day instead of 1.2.
        for (period_us, days) in
            [(87_000, 2), (1_000_000, 5), (60_000_000, 5), (3_600_000_000, 5), (DAY_US, 5)]
        {
            let a_day = f64::from(grown(period_us, days)).powf(1.0 / days as f64);
            assert!((1.19..1.25).contains(&a_day), "{period_us}: {a_day}");
        }
    }

    #[test]
    fn noise_does_not_pull_the_bound_down() {
        let mut growth = Growth::default();
        let mut random = crate::testing::Random::new(4);
        let mut bound = 0.0;
        for step in 0..200_000 {
            let last = 100.0 * (1.0 + 0.1 * random.signed());
            bound = growth.bounds_g_mm(&THRESHOLDS, step * 87_000, &[[last, 0.0]])[0];
        }
        assert!((bound - 120.0).abs() < 5.0, "{bound}");
    }
}

//! How much a plane's unbalance may have grown.

use super::seconds_since;
use crate::model::{MAX_PLANES, Pair};
use crate::scalar;
use crate::thresholds::Thresholds;

/// Part of the growth time after which the anchor moves: with f32, steps of a tenth of a second would change nothing.
pub(super) const STEP: f32 = 1.0 / 256.0;
/// Deviations of an estimate that its error does not exceed but once in 1e9 readings: six of a normal distribution, times
/// √(π/2), by which least absolute residuals are less certain than least squares.
pub(super) const DOUBT: f32 = 7.52;

/// What each plane's unbalance was at most about one growth time ago: the bound is a multiple of it.
///
/// A bound on the last estimate alone would let noise pull the unbalance down at every reading, and up only at the pace of
/// growth; and an estimate from a slow machine, which says little, would bound what is seen at full speed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Growth {
    /// `None` until there is an estimate.
    anchor_g_mm: Option<[f32; MAX_PLANES]>,
    bound_g_mm: Option<[f32; MAX_PLANES]>,
    since_us: Option<u64>,
}

impl Growth {
    /// Goes on after a loss of power from [`Growth::most_g_mm`]: as after one growth time, for nobody knows how long it was.
    /// Planes that are not given or not finite begin with what they are.
    pub fn resume(most_g_mm: &[f32], last_g_mm: &[Pair]) -> Self {
        let mut anchor_g_mm = [0.0; MAX_PLANES];
        for (place, (anchor, &last)) in anchor_g_mm.iter_mut().zip(last_g_mm).enumerate() {
            let most = most_g_mm.get(place).copied().filter(|most| scalar::is_amount(*most));
            *anchor = most.unwrap_or(scalar::length(last));
        }
        Self { anchor_g_mm: Some(anchor_g_mm), ..Self::default() }
    }

    /// What each plane's unbalance is at most after an estimate: that and its doubt, and no more than it may have been.
    ///
    /// `deviation_g_mm`: standard deviation of either part of each plane's unbalance; NaN if unknown.
    pub fn most_g_mm(&self, last_g_mm: &[Pair], deviation_g_mm: &[f32; MAX_PLANES]) -> [f32; MAX_PLANES] {
        let mut most_g_mm = self.bound_g_mm.unwrap_or([f32::MAX; MAX_PLANES]);
        for (most, (&last, &deviation)) in most_g_mm.iter_mut().zip(last_g_mm.iter().zip(deviation_g_mm)) {
            // A deviation that is not a number counts as none.
            let estimated = scalar::length(last) + scalar::greater(0.0, DOUBT * deviation);
            // An estimate may lie above its bound by rounding, or by the model's floor.
            *most = scalar::lesser(estimated, scalar::greater(*most, scalar::length(last)));
        }
        most_g_mm
    }

    /// The bound on each plane's unbalance, g·mm, at this time, after an estimate.
    ///
    /// Without an anchor the estimate is the first one. The anchor follows the greatest possible unbalance with `growth_s` as
    /// time constant. The first reading, and readings at least `growth_s` apart, are bounded by the unbalance before, as in
    /// Bera et al. (2023).
    pub fn bounds_g_mm(
        &mut self,
        thresholds: &Thresholds,
        time_us: u64,
        last_g_mm: &[Pair],
        deviation_g_mm: &[f32; MAX_PLANES],
    ) -> [f32; MAX_PLANES] {
        let part = self.since_us.map(|since_us| seconds_since(since_us, time_us) / thresholds.growth_s);
        let anchor_g_mm = match self.anchor_g_mm {
            Some(anchor_g_mm) if part.is_some_and(|part| part < STEP) => anchor_g_mm,
            before => {
                let most_g_mm = self.most_g_mm(last_g_mm, deviation_g_mm);
                let mut anchor_g_mm = before.unwrap_or(most_g_mm);
                for (anchor, most) in anchor_g_mm.iter_mut().zip(most_g_mm) {
                    match part {
                        None => {}
                        Some(part) if part >= 1.0 => *anchor = most,
                        Some(part) => *anchor += part * (most - *anchor),
                    }
                }
                self.since_us = Some(time_us);
                anchor_g_mm
            }
        };
        self.anchor_g_mm = Some(anchor_g_mm);
        let bound_g_mm = anchor_g_mm.map(|anchor| thresholds.growth * anchor);
        self.bound_g_mm = Some(bound_g_mm);
        bound_g_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY_US: u64 = 86_400_000_000;
    const THRESHOLDS: Thresholds = Thresholds::DEFAULT;
    const UNKNOWN: [f32; MAX_PLANES] = [f32::NAN; MAX_PLANES];

    #[test]
    fn daily_readings_are_bounded_by_the_one_before() {
        let mut growth = Growth::resume(&[], &[[100.0, 0.0], [0.0, 200.0]]);
        for (day, last) in (0..).zip([100.0, 50.0, 60.0, 0.0]) {
            let last_g_mm = [[last, 0.0], [0.0, -2.0 * last]];
            let bounds = growth.bounds_g_mm(&THRESHOLDS, day * DAY_US, &last_g_mm, &UNKNOWN);
            assert_eq!(bounds[..2], [1.2 * last, 1.2 * (2.0 * last)]);
        }
    }

    /// An unbalance that always grows as much as it may.
    fn grown(period_us: u64, days: u64) -> f32 {
        let mut growth = Growth::resume(&[], &[[100.0, 0.0]]);
        let mut last = 100.0;
        for step in 0..=days * DAY_US / period_us {
            last = growth.bounds_g_mm(&THRESHOLDS, step * period_us, &[[last, 0.0]], &UNKNOWN)[0];
        }
        last / 120.0
    }

    #[test]
    fn growth_limit_holds_for_any_pace_of_readings() {
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
        let mut growth = Growth::resume(&[], &[[100.0, 0.0]]);
        let mut random = crate::testing::Random::new(4);
        let mut bound = 0.0;
        for step in 0..200_000 {
            let last = 100.0 * (1.0 + 0.1 * random.signed());
            bound = growth.bounds_g_mm(&THRESHOLDS, step * 87_000, &[[last, 0.0]], &UNKNOWN)[0];
        }
        assert!((bound - 120.0).abs() < 5.0, "{bound}");
    }

    #[test]
    fn uninformative_estimate_never_bounds_next_below_truth() {
        // 100 g·mm known to 0.1; then a day at low speed says 20 with a deviation of 30; then full speed again.
        let mut growth = Growth::resume(&[], &[[100.0, 0.0]]);
        growth.bounds_g_mm(&THRESHOLDS, 0, &[[100.0, 0.0]], &UNKNOWN);
        growth.bounds_g_mm(&THRESHOLDS, DAY_US, &[[100.0, 0.0]], &[0.1; MAX_PLANES]);
        let [bound, ..] = growth.bounds_g_mm(&THRESHOLDS, 2 * DAY_US, &[[20.0, 0.0]], &[30.0; MAX_PLANES]);
        // at most what it may have grown to by then, and a day's growth more
        assert!((bound - 1.2 * 1.2 * (100.0 + 0.1 * DOUBT)).abs() < 1e-3, "{bound}");
        let [bound, ..] = growth.bounds_g_mm(&THRESHOLDS, 3 * DAY_US, &[[100.0, 0.0]], &[0.1; MAX_PLANES]);
        assert!((bound - 1.2 * (100.0 + 0.1 * DOUBT)).abs() < 1e-3, "{bound}");
    }

    #[test]
    fn after_a_loss_of_power_the_bound_is_that_of_the_next_day() {
        let last = [[100.0, 0.0], [30.0, 40.0]];
        let mut whole = Growth::resume(&[], &last);
        whole.bounds_g_mm(&THRESHOLDS, 0, &last, &UNKNOWN);
        let most = whole.most_g_mm(&last, &[1.0; MAX_PLANES]);
        let mut cut = Growth::resume(&most, &last);
        assert_eq!(
            whole.bounds_g_mm(&THRESHOLDS, DAY_US, &last, &[1.0; MAX_PLANES])[..2],
            cut.bounds_g_mm(&THRESHOLDS, 5, &last, &UNKNOWN)[..2]
        );
        let spoilt = Growth::resume(&[f32::NAN, -1.0], &last);
        assert_eq!(spoilt.anchor_g_mm.unwrap()[..2], [100.0, 50.0]);
    }
}

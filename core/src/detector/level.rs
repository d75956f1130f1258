//! The usual residual: a mean over time.

use crate::scalar;

/// Part of the weight so far below which new values wait in a block: with f32, ten readings a second on a mean over ten
/// days would each change nothing.
const BLOCK: f32 = 1.0 / 128.0;
/// Shortest distance of two values, s: readings of the same instant count all the same.
const SHORTEST_S: f32 = 1e-6;
/// A gap in time counts at most this part of the mean's length: a machine that stood still for a month does not begin anew.
const LONGEST: f32 = 0.1;

/// Mean of all values so far, weighted with the time each stands for, and from `length_s` on exponential.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Level {
    mean: Option<f32>,
    weight_s: f32,
    block: f32,
    block_s: f32,
}

impl Level {
    /// Goes on with a mean that stood for `weight_s`; a mean that is not finite or negative is none.
    pub fn resume(mean: Option<f32>, weight_s: f32) -> Self {
        let mean = mean.filter(|mean| scalar::is_amount(*mean));
        let weight_s = if scalar::is_amount(weight_s) { weight_s } else { 0.0 };
        Self { mean, weight_s, ..Self::default() }
    }

    /// The mean; `None` before the first value.
    pub fn mean(&self) -> Option<f32> {
        self.mean
    }

    /// Time that the mean stands for, s.
    pub fn weight_s(&self) -> f32 {
        self.weight_s
    }

    /// Takes a value that stands for `dt_s`. The first value stands for as long as the second.
    pub fn update(&mut self, length_s: f32, dt_s: f32, value: f32) {
        if self.mean.is_none() {
            self.mean = Some(value);
            return;
        }
        let dt_s = scalar::greater(SHORTEST_S, scalar::lesser(dt_s, LONGEST * length_s));
        if self.weight_s == 0.0 {
            self.weight_s = dt_s;
        }
        self.block_s += dt_s;
        self.block += (value - self.block) * (dt_s / self.block_s);
        if self.block_s >= BLOCK * self.weight_s {
            self.fold(length_s);
        }
    }

    /// Takes what waits into the mean.
    pub fn fold(&mut self, length_s: f32) {
        if let Some(mean) = &mut self.mean
            && self.block_s > 0.0
        {
            self.weight_s =
                scalar::lesser(self.weight_s + self.block_s, scalar::greater(length_s, self.block_s));
            *mean += (self.block - *mean) * (self.block_s / self.weight_s);
        }
        (self.block, self.block_s) = (0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY_S: f32 = 86_400.0;

    #[test]
    fn daily_values_begin_as_the_mean_and_become_exponential() {
        let mut level = Level::default();
        let mut days = 0.0_f32;
        let mut expected = 0.0_f32;
        for day in 0..30u8 {
            let value = 4.0 + f32::from(day % 7);
            days = (days + 1.0).min(10.0);
            expected += (value - expected) / days;
            level.update(10.0 * DAY_S, DAY_S, value);
            assert!((level.mean().unwrap() - expected).abs() < 1e-5, "day {day}");
        }
    }

    #[test]
    fn a_fast_series_has_the_mean_and_the_memory_of_a_slow_one() {
        let mut level = Level::default();
        let (length_s, dt_s) = (10.0 * DAY_S, 0.087);
        for _ in 0..2_000_000 {
            level.update(length_s, dt_s, 5.0);
        }
        assert!((level.mean().unwrap() - 5.0).abs() < 1e-4);
        // 2,000,000 readings more at 6 weigh as many: the mean is 5.5, to the block that still waits.
        for _ in 0..2_000_000 {
            level.update(length_s, dt_s, 6.0);
        }
        let mean = f64::from(level.mean().unwrap());
        assert!((mean - 5.5).abs() < 0.01, "{mean}");
        assert!((f64::from(level.weight_s()) / (4e6 * 0.087) - 1.0).abs() < 0.01);
    }

    #[test]
    fn a_long_gap_counts_a_tenth_and_an_instant_counts_all_the_same() {
        let mut level = Level::resume(Some(10.0), 10.0 * DAY_S);
        level.update(10.0 * DAY_S, 1000.0 * DAY_S, 20.0);
        assert!((level.mean().unwrap() - 11.0).abs() < 1e-4);
        let mut instant = Level::default();
        for value in [1.0, 3.0] {
            instant.update(DAY_S, 0.0, value);
        }
        assert_eq!(instant.mean(), Some(2.0));
    }

    #[test]
    fn what_cannot_be_a_mean_is_none() {
        for mean in [f32::NAN, f32::INFINITY, -1.0] {
            assert_eq!(Level::resume(Some(mean), f32::NAN), Level::default());
        }
    }
}

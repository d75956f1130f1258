//! Readings of the same speed and the same probes become one that is steadier.

use super::seconds_since;
use crate::reading::Reading;

/// Relative difference of speed up to which two readings are of the same speed.
const SAME_SPEED: f32 = 0.005;
/// Distance in time constants from which the mean is the reading itself.
const APART: f32 = 10.0;

/// The mean of the readings so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AveragedReading {
    /// Speed, vectors and gap voltages.
    pub reading: Reading,
    /// Variance of its noise relative to that of one reading: 1 for one alone. Noise of readings is taken as independent,
    /// which holds for the converter's and the bus's and not for drift; drift is what the level is for.
    pub variance: f32,
    at_us: u64,
}

/// Exponential mean of readings over time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Average {
    last: Option<AveragedReading>,
}

impl Average {
    /// Takes a reading and gives the mean.
    ///
    /// The weight of a reading is `dt/(dt + τ)` (backward Euler), one from `dt = 10 τ` on and for the first of a speed or
    /// of a set of probes.
    #[inline(never)]
    pub fn update(&mut self, time_constant_s: f32, time_us: u64, reading: &Reading) -> AveragedReading {
        if let Some(last) = &mut self.last
            && last.join(time_constant_s, time_us, reading)
        {
            return *last;
        }
        *self.last.insert(AveragedReading { reading: *reading, variance: 1.0, at_us: time_us })
    }
}

impl AveragedReading {
    /// Takes another reading into the mean; `false`, and nothing changes, if the two have nothing to do with each other.
    fn join(&mut self, time_constant_s: f32, time_us: u64, reading: &Reading) -> bool {
        let dt_s = seconds_since(self.at_us, time_us);
        if dt_s >= APART * time_constant_s || !is_alike(&self.reading, reading) {
            return false;
        }
        let weight = dt_s / (dt_s + time_constant_s);
        self.reading.approach(reading, weight);
        self.variance = (1.0 - weight) * (1.0 - weight) * self.variance + weight * weight;
        self.at_us = time_us;
        true
    }
}

/// False for what is not a number.
pub(super) fn is_same_speed(one_rpm: f32, other_rpm: f32) -> bool {
    (one_rpm - other_rpm).abs() <= SAME_SPEED * one_rpm
}

/// The same speed and the same probes with a value.
fn is_alike(one: &Reading, other: &Reading) -> bool {
    is_same_speed(one.speed_rpm, other.speed_rpm)
        && one.probes().len() == other.probes().len()
        && one.valid_mask() == other.valid_mask()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::ProbeVector;
    use crate::testing::Random;

    const PERIOD_US: u64 = 87_000;

    fn reading(speed_rpm: f32, cos_um: f32) -> Reading {
        Reading::new(speed_rpm, &[ProbeVector { cos_um, sin_um: -cos_um }; 4]).unwrap()
    }

    #[test]
    fn daily_readings_are_taken_as_they_are() {
        let mut average = Average::default();
        for day in 0..5_u8 {
            let measured = reading(9000.0, f32::from(day));
            let averaged = average.update(1.0, u64::from(day) * 86_400_000_000, &measured);
            assert_eq!((averaged.reading.probes(), averaged.variance), (measured.probes(), 1.0));
        }
    }

    #[test]
    fn a_step_is_followed_with_the_time_constant() {
        let mut average = Average::default();
        average.update(1.0, 0, &reading(9000.0, 0.0));
        let steps = 2000_u64;
        let mut last = average.update(1.0, 1, &reading(9000.0, 0.0));
        for step in 1..=steps {
            // two time constants in steps of a thousandth
            last = average.update(1.0, step * 1000, &reading(9000.0, 1.0));
        }
        // 1 − e⁻² of the way; backward Euler with steps of 1e-3 is 1e-3 off at most
        let expected = 1.0 - (-2.0_f64).exp();
        assert!((f64::from(last.reading.probes()[0].cos_um) - expected).abs() < 1e-3);
    }

    #[test]
    fn variance_is_that_of_the_mean_of_independent_readings() {
        let mut random = Random::new(8);
        let (mut sum, mut square, mut stated) = (0.0_f64, 0.0_f64, 0.0);
        for _ in 0..4000 {
            let mut average = Average::default();
            let mut last = None;
            for step in 0..15 {
                last = Some(average.update(1.0, step * PERIOD_US, &reading(9000.0, random.signed())));
            }
            let last = last.unwrap();
            let mean = f64::from(last.reading.probes()[1].cos_um);
            (sum, square, stated) = (sum + mean, square + mean * mean, last.variance);
        }
        let variance = square / 4000.0 - (sum / 4000.0).powi(2);
        // uniform numbers have a variance of 1/3; of a variance from 4000 samples three deviations are 7 %
        assert!((variance * 3.0 / f64::from(stated) - 1.0).abs() < 0.07, "{variance} {stated}");
        assert!(stated < 0.3);
    }

    #[test]
    fn average_restarts_after_speed_probe_change_or_pause() {
        let mut partial = reading(9000.0, 5.0);
        partial.lose(0b10);
        let fewer = Reading::new(9000.0, &[ProbeVector { cos_um: 5.0, sin_um: 1.0 }; 3]).unwrap();
        for (time_us, other) in
            [(PERIOD_US, reading(9046.0, 5.0)), (PERIOD_US, fewer), (10_000_000, reading(9000.0, 5.0))]
        {
            let mut average = Average::default();
            average.update(1.0, 0, &reading(9000.0, 1.0));
            let averaged = average.update(1.0, time_us, &other);
            assert_eq!((averaged.reading.probes(), averaged.variance), (other.probes(), 1.0));
        }
        let mut average = Average::default();
        average.update(1.0, 0, &reading(9000.0, 1.0));
        let averaged = average.update(1.0, PERIOD_US, &partial);
        assert_eq!((averaged.variance, averaged.reading.valid_mask()), (1.0, 0b1101));
        let near = average.update(1.0, 2 * PERIOD_US, &reading(9000.0, 1.0));
        assert_eq!(near.variance, 1.0, "the probe is back");
        let near = average.update(1.0, 3 * PERIOD_US, &reading(9044.0, 1.0));
        assert!(near.variance < 1.0, "the same speed within half a per cent");
    }
}

//! Test for a step of the features against their usual random walk.
//!
//! Bearings change with load and temperature, and the residual often rises by half without an event. At an event the
//! features change within a day by more than usual. The test compares the mean of the suspicious readings with the
//! mean of as many readings before, by Hotelling's T² with the covariance of the past changes from day to day.
//!
//! For features that walk at random by `q` a day and are measured with noise `r`, the changes from day
//! to day have the covariance `q + 2r`, and the difference of two means of n following readings has
//! `q (2n² + 1)/(3n) + 2r/n`: at most `(2n² + 1)/(3n)` times as much.

use nalgebra::{Complex, DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::record::Day;
use crate::units::same_speed;

type C = Complex<f64>;

/// False-alarm probability of one test.
const CHANCE: f64 = 1e-5;
/// Changes needed for the test, beyond the number of features.
const SPARE: usize = 8;
/// Readings further apart than this do not count as a change from day to day.
const FAR_D: f64 = 3.0;

/// Changes of the features from reading to reading, for each speed.
#[derive(Debug, Clone, Default)]
pub struct Steps {
    speeds: Vec<StepsAtSpeed>,
}

/// Changes of the features at one speed.
#[derive(Debug, Clone)]
struct StepsAtSpeed {
    /// Mean speed of its readings.
    speed_rad_s: f64,
    readings: f64,
    outer: DMatrix<f64>,
    /// Number of changes between readings with the same weights, and their total time.
    count: usize,
    days: f64,
    last: (f64, Vec<C>, DVector<f64>),
}

/// All features of a reading, µm.
fn features_um(day: &Day) -> DVector<f64> {
    DVector::from_iterator(
        2 * day.measured_m.len(),
        day.all_m().iter().flat_map(|y| [y.re * 1e6, -y.im * 1e6]),
    )
}

fn mean_um(days: &[&Day]) -> DVector<f64> {
    let zero = DVector::zeros(2 * days[0].measured_m.len());
    days.iter().fold(zero, |sum, d| sum + features_um(d)) / days.len() as f64
}

impl Steps {
    fn at(&self, day: &Day) -> Option<&StepsAtSpeed> {
        self.speeds.iter().find(|s| same_speed(s.speed_rad_s, day.speed_rad_s))
    }

    /// Learns from a reading. A change that is itself a step is limited to the largest change that is not.
    pub fn learn(&mut self, day: &Day) {
        let own = self.speeds.iter_mut().find(|s| same_speed(s.speed_rad_s, day.speed_rad_s));
        match own {
            Some(own) => own.learn(day),
            None => self.speeds.push(StepsAtSpeed::new(day)),
        }
    }

    /// T² of the change between two readings over its limit; zero if speed or weights changed, or there is too little
    /// history.
    pub fn excess(&self, before: &Day, after: &Day) -> f64 {
        if !same_speed(before.speed_rad_s, after.speed_rad_s) || before.weights_kg_m != after.weights_kg_m {
            return 0.0;
        }
        let change = features_um(after) - features_um(before);
        let squared = self.at(after).and_then(|s| s.squared(&change, 1.0));
        squared.map_or(0.0, |(squared, limit)| squared / limit)
    }

    /// Whether the last `n` readings at the newest reading's speed stepped away from the `n` before them; `None` if there
    /// is too little history with the same weights.
    pub fn stepped(&self, days: &[&Day], n: usize) -> Option<bool> {
        let own = self.at(days.last()?)?;
        let same = days.iter().rev().filter(|d| same_speed(own.speed_rad_s, d.speed_rad_s));
        let same: Vec<&Day> = same.take(2 * n).copied().collect();
        let newest = &same.first()?.weights_kg_m;
        if same.len() < 2 * n || same.iter().any(|d| d.weights_kg_m != *newest) {
            return None;
        }
        let (after, before) = same.split_at(n);
        let apart = ((after[n - 1].time_d - before[0].time_d) / own.usual_d()).max(1.0);
        let n = n as f64;
        let factor = (2.0 * n * n + 1.0) / (3.0 * n) * apart;
        let (squared, limit) = own.squared(&(mean_um(after) - mean_um(before)), factor)?;
        Some(squared > limit)
    }
}

impl StepsAtSpeed {
    fn new(day: &Day) -> Self {
        let size = 2 * day.measured_m.len();
        Self {
            speed_rad_s: day.speed_rad_s,
            readings: 1.0,
            outer: DMatrix::zeros(size, size),
            count: 0,
            days: 0.0,
            last: (day.time_d, day.weights_kg_m.clone(), features_um(day)),
        }
    }

    fn learn(&mut self, day: &Day) {
        let now = features_um(day);
        let apart_d = day.time_d - self.last.0;
        if apart_d <= FAR_D && day.weights_kg_m == self.last.1 {
            let change = &now - &self.last.2;
            let excess =
                self.squared(&change, 1.0).map_or(1.0, |(squared, limit)| (squared / limit).max(1.0));
            self.outer.ger(1.0 / excess, &change, &change, 1.0);
            self.count += 1;
            self.days += apart_d;
        }
        self.readings += 1.0;
        self.speed_rad_s += (day.speed_rad_s - self.speed_rad_s) / self.readings;
        self.last = (day.time_d, day.weights_kg_m.clone(), now);
    }

    /// Mean days between two readings.
    fn usual_d(&self) -> f64 {
        (self.days / self.count.max(1) as f64).max(f64::MIN_POSITIVE)
    }

    /// T² of a change whose covariance is `factor` times that of a usual one, and its limit; `None` if there is too
    /// little history.
    fn squared(&self, change: &DVector<f64>, factor: f64) -> Option<(f64, f64)> {
        if self.count < self.outer.nrows() + SPARE {
            return None;
        }
        let (p, count) = (self.outer.nrows() as f64, self.count as f64);
        let spread = &self.outer * (factor / count);
        let squared = change.dot(&spread.cholesky()?.solve(change));
        let quantile = FisherSnedecor::new(p, count - p).ok()?.inverse_cdf(1.0 - CHANCE);
        Some((squared, quantile * p * count / (count - p)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;
    use crate::track::record;
    use nalgebra::Complex;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};

    /// Days whose features wander by a step of about one a day, and jump by `jump` of it on day 200.
    fn walking(jump: f64, seed: u64) -> Vec<Day> {
        let mut random = StdRng::seed_from_u64(seed);
        let mut at = [Complex::new(0.0, 0.0); 4];
        let readings = (0..250).map(|day| {
            for y in &mut at {
                let mut uniform = || random.random_range(-1.7..1.7) * 1e-6;
                *y += Complex::new(uniform(), uniform());
            }
            if day == 200 {
                at[1].re += jump * 1e-6;
            }
            crate::measurement::Reading {
                time_d: Some(f64::from(day)),
                speed_rpm: 9000.0,
                probes: at.map(Some).to_vec(),
                ..Default::default()
            }
        });
        let readings: Vec<_> = readings.collect();
        let noise = crate::machine::drawing::Noise { relative: 0.02, floor_um: 0.03, ..Default::default() };
        record::days(&sample_rotor(), &noise, &readings).unwrap()
    }

    fn steps_found(days: &[Day]) -> Vec<usize> {
        let days: Vec<&Day> = days.iter().collect();
        let mut steps = Steps::default();
        let mut found = Vec::new();
        for k in 0..days.len() {
            if steps.stepped(&days[..=k], 3) == Some(true) {
                found.push(k);
            }
            steps.learn(days[k]);
        }
        found
    }

    #[test]
    fn random_walk_is_no_step_at_any_of_ten_seeds() {
        for seed in 0..10 {
            assert_eq!(steps_found(&walking(0.0, seed)), Vec::<usize>::new(), "seed {seed}");
        }
    }

    #[test]
    fn jump_of_twelve_daily_changes_is_a_step_after_3_readings() {
        assert!(steps_found(&walking(12.0, 3)).contains(&202));
    }

    #[test]
    fn speed_or_weight_change_is_no_step_and_second_speed_jump_is() {
        let mut days = walking(0.0, 4);
        for day in &mut days[120..] {
            day.speed_rad_s *= 0.8;
            day.measured_m.iter_mut().flatten().for_each(|y| *y *= 1.7);
        }
        for day in &mut days[80..] {
            day.weights_kg_m[0] = C::from(1e-4);
            day.measured_m.iter_mut().flatten().for_each(|y| *y += C::from(4e-5));
        }
        assert_eq!(steps_found(&days), Vec::<usize>::new());
        days[200..].iter_mut().for_each(|day| day.measured_m[1].iter_mut().for_each(|y| y.re += 4e-5));
        assert!(steps_found(&days).contains(&202));
    }
}

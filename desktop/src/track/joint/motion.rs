//! Process model of the bearings' random walk and the unbalance's drift, and its unconstrained parameters.

use nalgebra::{DMatrix, DVector};

use crate::track::coefficients::FollowedNumber;

/// Initial standard deviation of the random walk's process noise in a day, of a direct coefficient.
const FIRST_PUSH: f64 = 0.03;
/// The same for the rate of the unbalance's coordinate, per day.
const FIRST_RATE_PUSH: f64 = 0.002;
/// Initial time constant of random walk and rate, days.
const FIRST_DAYS: f64 = 10.0;

/// Process model of random walk and drift; learned from the record.
#[derive(Debug, Clone)]
pub struct ProcessModel {
    /// Covariance of the random walk's process noise in a pace, the usual days between two readings.
    pub push: DMatrix<f64>,
    /// Persistence of the random walk over a pace.
    pub keep: f64,
    /// Variance of the rate's process noise; the rate is per pace.
    pub rate_push: f64,
    /// Persistence of the rate over a pace.
    pub rate_keep: f64,
}

impl ProcessModel {
    /// Initial model for these numbers and this pace; its variance in a day does not depend on the pace.
    pub fn first(numbers: &[FollowedNumber], pace_d: f64) -> Self {
        let [keep, daily] = [pace_d, 1.0].map(|days| kept(FIRST_DAYS, days));
        let gain = (1.0 - keep.powi(2)) / (1.0 - daily.powi(2));
        let variance = numbers.iter().map(|n| (FIRST_PUSH * n.width()).powi(2) * gain);
        Self {
            push: DMatrix::from_diagonal(&DVector::from_iterator(numbers.len(), variance)),
            keep,
            rate_push: (FIRST_RATE_PUSH * pace_d).powi(2) * gain,
            rate_keep: keep,
        }
    }

    /// Stationary covariance of the random walk.
    pub fn settled(&self) -> DMatrix<f64> {
        &self.push / (1.0 - self.keep.powi(2))
    }

    /// Unconstrained parameters: logarithms of variances, the rest of the Cholesky factor of `push`, log odds of the
    /// persistences.
    pub fn numbers(&self) -> Option<DVector<f64>> {
        let factor = self.push.clone().cholesky()?.unpack();
        let odds = |keep: f64| (keep / (1.0 - keep)).ln();
        let size = self.push.nrows();
        let push = (0..size)
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .map(|(i, j)| if i == j { factor[(i, i)].ln() } else { factor[(i, j)] / factor[(i, i)] });
        let rest = [odds(self.keep), self.rate_push.ln(), odds(self.rate_keep)];
        Some(DVector::from_iterator(size * (size + 1) / 2 + rest.len(), push.chain(rest)))
    }

    /// The model of such parameters, for this pace; the persistences are limited.
    pub fn of_numbers(numbers: &DVector<f64>, pace_d: f64) -> Self {
        // n (n + 1)/2 of the factor and three others
        let size = (1..).find(|n| n * (n + 1) / 2 + 3 >= numbers.len()).unwrap_or_default();
        let mut factor = DMatrix::zeros(size, size);
        let mut next = numbers.iter().copied();
        let mut one = || next.next().unwrap_or_default();
        for i in 0..size {
            let row: Vec<f64> = (0..=i).map(|_| one()).collect();
            for j in 0..=i {
                factor[(i, j)] = if i == j { row[i].exp() } else { row[j] * row[i].exp() };
            }
        }
        let kept_of = |odds: f64, most: f64| (1.0 / (1.0 + (-odds).exp())).clamp(LEAST_KEPT, most);
        let keep = kept_of(one(), kept(SLOWEST_WALK_D, pace_d));
        let rate_push = one().exp();
        let rate_keep = kept_of(one(), kept(SLOWEST_RATE_D, pace_d));
        Self { push: &factor * factor.transpose(), keep, rate_push, rate_keep }
    }
}

/// Longest time constant of the random walk, days. Bearings that drift over months and unbalance that grows over months
/// look alike at one speed; slow changes are attributed to the unbalance.
pub const SLOWEST_WALK_D: f64 = 20.0;
/// The same of the unbalance's rate.
pub const SLOWEST_RATE_D: f64 = 100.0;

/// Least persistence in a pace; below it, process and measurement noise cannot be separated.
pub const LEAST_KEPT: f64 = 0.05;

/// Persistence after `days` of a process with time constant `fades_d`, at least [`LEAST_KEPT`].
pub fn kept(fades_d: f64, days: f64) -> f64 {
    (-days / fades_d).exp().max(LEAST_KEPT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;
    use crate::track::coefficients::followed;

    #[test]
    fn process_model_round_trips_through_its_parameters() {
        let mixed = DMatrix::from_fn(8, 8, |i, j| ((3 * i + 5 * j) % 7) as f64 * 0.01);
        let push = &mixed * mixed.transpose() + DMatrix::identity(8, 8) * 1e-4;
        let motion = ProcessModel { push, keep: 0.8, rate_push: 3e-6, rate_keep: 0.97 };
        let again = ProcessModel::of_numbers(&motion.numbers().unwrap(), 1.0);
        assert!((&again.push - &motion.push).amax() < 1e-12);
        for (ours, theirs) in [
            (again.keep, motion.keep),
            (again.rate_push, motion.rate_push),
            (again.rate_keep, motion.rate_keep),
        ] {
            assert!((ours / theirs - 1.0).abs() < 1e-12, "{ours} {theirs}");
        }
    }

    #[test]
    fn initial_process_variance_is_independent_of_pace() {
        let variance =
            |keep: f64, push: f64, paces: f64| push * (1.0 - keep.powf(2.0 * paces)) / (1.0 - keep * keep);
        let numbers = followed(&sample_rotor());
        let daily = ProcessModel::first(&numbers, 1.0);
        for pace_d in [0.01, 0.25, 2.0] {
            let other = ProcessModel::first(&numbers, pace_d);
            let walk = variance(other.keep, other.push[(0, 0)], 10.0 / pace_d);
            assert!((walk / variance(daily.keep, daily.push[(0, 0)], 10.0) - 1.0).abs() < 1e-9);
            let rate = variance(other.rate_keep, other.rate_push, 10.0 / pace_d) / pace_d.powi(2);
            assert!((rate / variance(daily.rate_keep, daily.rate_push, 10.0) - 1.0).abs() < 1e-9);
        }
    }
}

//! How wander and unbalance move, and the same as plain numbers.

use nalgebra::{DMatrix, DVector};

/// Standard deviation of the wander's push in a day before anything is learned.
const FIRST_PUSH: f64 = 0.03;
/// The same of the rate of the unbalance's coordinate, per day.
const FIRST_RATE_PUSH: f64 = 0.002;
/// Days in which wander and rate fade, before anything is learned.
const FIRST_DAYS: f64 = 10.0;

/// How wander and unbalance move; learned from the record.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Covariance of the wander's push in a pace: the days between two readings, as a rule.
    pub push: DMatrix<f64>,
    /// What is left of the wander after a pace.
    pub keep: f64,
    /// Variance of the push of the rate, which is stated per pace.
    pub rate_push: f64,
    /// What is left of the rate after a pace.
    pub rate_keep: f64,
}

impl Motion {
    /// Before anything is learned, of so many coefficients and readings with this pace: the same wander and
    /// drift in a day at any pace.
    pub fn first(coefficients: usize, pace_d: f64) -> Self {
        let [keep, daily] = [pace_d, 1.0].map(|days| kept(FIRST_DAYS, days));
        let gain = (1.0 - keep.powi(2)) / (1.0 - daily.powi(2));
        Self {
            push: DMatrix::identity(coefficients, coefficients) * (FIRST_PUSH.powi(2) * gain),
            keep,
            rate_push: (FIRST_RATE_PUSH * pace_d).powi(2) * gain,
            rate_keep: keep,
        }
    }

    /// Covariance of a wander that has gone on for long.
    pub fn settled(&self) -> DMatrix<f64> {
        &self.push / (1.0 - self.keep.powi(2))
    }

    /// As numbers of which any are a motion, but for how slowly it may fade: logarithms of variances, the rest of
    /// the push's Cholesky factor, log odds of what is kept.
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

    /// The motion of such numbers, of readings with this pace.
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
        let keep = kept_of(one(), kept(SLOWEST_WANDER_D, pace_d));
        let rate_push = one().exp();
        let rate_keep = kept_of(one(), kept(SLOWEST_RATE_D, pace_d));
        Self { push: &factor * factor.transpose(), keep, rate_push, rate_keep }
    }
}

/// Days in which the wander fades at the slowest. Bearings that went elsewhere over months and
/// unbalance that grew over months look alike at one speed; months are taken as the unbalance's.
pub const SLOWEST_WANDER_D: f64 = 20.0;
/// The same of the unbalance's rate.
pub const SLOWEST_RATE_D: f64 = 100.0;

/// What fades faster than this in a pace is no longer told from noise.
pub const LEAST_KEPT: f64 = 0.05;

/// Share that is left after some days of what fades to 1/e over so many; never less than can be told from noise.
pub fn kept(fades_d: f64, days: f64) -> f64 {
    (-days / fades_d).exp().max(LEAST_KEPT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_motion_give_it_back() {
        let mixed = DMatrix::from_fn(8, 8, |i, j| ((3 * i + 5 * j) % 7) as f64 * 0.01);
        let push = &mixed * mixed.transpose() + DMatrix::identity(8, 8) * 1e-4;
        let motion = Motion { push, keep: 0.8, rate_push: 3e-6, rate_keep: 0.97 };
        let again = Motion::of_numbers(&motion.numbers().unwrap(), 1.0);
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
    fn initial_motion_variance_is_independent_of_pace() {
        let variance =
            |keep: f64, push: f64, paces: f64| push * (1.0 - keep.powf(2.0 * paces)) / (1.0 - keep * keep);
        let daily = Motion::first(8, 1.0);
        for pace_d in [0.01, 0.25, 2.0] {
            let other = Motion::first(8, pace_d);
            let wander = variance(other.keep, other.push[(0, 0)], 10.0 / pace_d);
            assert!((wander / variance(daily.keep, daily.push[(0, 0)], 10.0) - 1.0).abs() < 1e-9);
            let rate = variance(other.rate_keep, other.rate_push, 10.0 / pace_d) / pace_d.powi(2);
            assert!((rate / variance(daily.rate_keep, daily.rate_push, 10.0) - 1.0).abs() < 1e-9);
        }
    }
}

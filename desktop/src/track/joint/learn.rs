//! How the wander and the unbalance move, learned from the record by expectation and maximisation.

use nalgebra::{DMatrix, DVector};

use super::kalman::{Gaussian, smooth};
use super::passes::{Change, Problem};
use super::state::Motion;
use crate::track::coefficients::COEFFICIENTS;

/// Readings in which the wander fades at the slowest. Bearings that went elsewhere over months and
/// unbalance that grew over months look alike at one speed; months are taken as the unbalance's.
const SLOWEST_WANDER: f64 = 20.0;
/// The same of the unbalance's rate.
const SLOWEST_RATE: f64 = 100.0;
/// Days that the first guess of a motion counts for.
const GUESS_DAYS: f64 = 2.0;

impl Problem {
    /// One round of expectation and maximisation: the states, and the motion that makes them most
    /// probable.
    pub fn learn(
        &self,
        motion: &Motion,
        changes: &[Change],
        linearised_at: &[DVector<f64>],
    ) -> Option<(Motion, Vec<DVector<f64>>)> {
        let pass = self.filter(motion, changes, Some(linearised_at))?;
        let (smoothed, cross) = smooth(&pass.filtered, &pass.steps);
        let mut wander = Moments::new(self.layout.wander(), COEFFICIENTS);
        let mut rate = Moments::new(self.layout.flat(), self.layout.flat());
        for k in 1..smoothed.len() {
            let days = (self.epochs[k].time_d - self.epochs[k - 1].time_d) / self.pace_d;
            if (days - 1.0).abs() < 0.1 && !changes.iter().any(|(at, _)| *at == k) {
                wander.add(&smoothed[k], &smoothed[k - 1], &cross[k - 1]);
                rate.add(&smoothed[k], &smoothed[k - 1], &cross[k - 1]);
            }
        }
        let first = Motion::default();
        let (keep, push) = wander.fit(&motion.push, &first.push, (-1.0 / SLOWEST_WANDER).exp());
        let now = DMatrix::identity(rate.size, rate.size) * motion.rate_push;
        let prior = DMatrix::identity(rate.size, rate.size) * first.rate_push;
        let (rate_keep, rate_push) = rate.fit(&now, &prior, (-1.0 / SLOWEST_RATE).exp());
        let learned = Motion { push, keep, rate_push: rate_push.trace() / rate.size as f64, rate_keep };
        Some((learned, smoothed.into_iter().map(|g| self.layout.at_rest(g.mean)).collect()))
    }
}

/// Second moments of a part of the state, of a day and the day before.
struct Moments {
    at: usize,
    size: usize,
    count: f64,
    now: DMatrix<f64>,
    both: DMatrix<f64>,
    before: DMatrix<f64>,
}

impl Moments {
    fn new(at: usize, size: usize) -> Self {
        let zero = || DMatrix::zeros(size, size);
        Self { at, size, count: 0.0, now: zero(), both: zero(), before: zero() }
    }

    fn add(&mut self, now: &Gaussian, before: &Gaussian, cross: &DMatrix<f64>) {
        let (at, size) = (self.at, self.size);
        let part = |m: &DMatrix<f64>| m.view((at, at), (size, size)).into_owned();
        let (x, y) = (now.mean.rows(at, size), before.mean.rows(at, size));
        self.now += part(&now.covariance) + x * x.transpose();
        self.both += part(cross) + x * y.transpose();
        self.before += part(&before.covariance) + y * y.transpose();
        self.count += 1.0;
    }

    /// What is left after a day, at most `most`, and the covariance of the push.
    fn fit(&self, push: &DMatrix<f64>, guess: &DMatrix<f64>, most: f64) -> (f64, DMatrix<f64>) {
        let weigh = |m: &DMatrix<f64>| {
            push.clone().cholesky().map_or_else(|| m.trace(), |factor| factor.solve(m).trace())
        };
        let keep = (weigh(&self.both) / weigh(&self.before)).clamp(0.05, most);
        let left = &self.now - (&self.both + self.both.transpose()) * keep + &self.before * (keep * keep);
        let push = (left + guess * GUESS_DAYS) / (self.count + GUESS_DAYS);
        (keep, (&push + push.transpose()) * 0.5)
    }
}

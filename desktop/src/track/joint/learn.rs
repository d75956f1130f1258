//! How the wander and the unbalance move, learned from the record by expectation and maximisation.
//!
//! Each round raises the likelihood, and each by a little less than the one before. From two rounds in a row a third
//! is guessed far ahead along their way (SQUAREM: Varadhan and Roland 2008, "Simple and globally convergent methods for
//! accelerating the convergence of any EM algorithm", scheme S3); where that overshoots, the second counts.

use nalgebra::{DMatrix, DVector};

use super::kalman::{Gaussian, across};
use super::motion::{LEAST_KEPT, Motion, SLOWEST_RATE, SLOWEST_WANDER, kept};
use super::passes::{Change, Problem};
use crate::track::coefficients::COEFFICIENTS;

/// Days that the first guess of a motion counts for.
const GUESS_DAYS: f64 = 2.0;

/// Three rounds that together gain less than this, in nats of the record's likelihood, are the last: before the
/// events are known, and of the whole.
const ROUGH_NATS: f64 = 1.0;
const FINE_NATS: f64 = 0.1;
/// Rounds after which the learning gives up, of a run.
const MOST_ROUNDS: usize = 300;
/// Rounds that a record takes as a rule; only for the progress.
const TYPICAL_ROUNDS: usize = 60;
/// Loss of likelihood, in nats, by which a guess ahead has overshot.
const OVERSHOT_NATS: f64 = 1.0;

/// When a run of the learning has learned enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// The motion is good enough to tell events.
    Rough,
    /// Nothing more is to be had.
    Settled,
}

/// Expectation and maximisation, round after round.
pub struct Learning<'a> {
    progress: &'a mut dyn FnMut(usize, usize),
    rounds: usize,
    /// The last run gave up while the likelihood still rose.
    pub gave_up: bool,
}

impl<'a> Learning<'a> {
    /// `progress` hears how many rounds of about how many are done.
    pub fn new(progress: &'a mut dyn FnMut(usize, usize)) -> Self {
        Self { progress, rounds: 0, gave_up: false }
    }

    /// Rounds until the likelihood no longer rises.
    pub fn run(
        &mut self,
        problem: &Problem,
        motion: &mut Motion,
        linearised_at: &mut Vec<DVector<f64>>,
        changes: &[Change],
        until: Until,
    ) -> Option<()> {
        let tolerance = if until == Until::Rough { ROUGH_NATS } else { FINE_NATS };
        let mut last = f64::NEG_INFINITY;
        self.gave_up = false;
        for _ in 0..MOST_ROUNDS / 3 {
            let (_, first, states) = self.round(problem, motion, changes, linearised_at)?;
            let (reached, second, states) = self.round(problem, &first, changes, &states)?;
            let ahead = ahead(motion, &first, &second).unwrap_or_else(|| second.clone());
            let guessed = self.round(problem, &ahead, changes, &states);
            let now = match guessed.filter(|g| g.0 >= reached - OVERSHOT_NATS) {
                Some((tried, third, there)) => {
                    (*motion, *linearised_at) = (third, there);
                    tried.max(reached)
                }
                None => {
                    (*motion, *linearised_at) = (second, states);
                    reached
                }
            };
            // a step back is made by readings that are linearised anew, and says as little as a small step on
            if (now - last).abs() < tolerance {
                return Some(());
            }
            last = now;
        }
        self.gave_up = true;
        Some(())
    }

    fn round(
        &mut self,
        problem: &Problem,
        motion: &Motion,
        changes: &[Change],
        linearised_at: &[DVector<f64>],
    ) -> Option<(f64, Motion, Vec<DVector<f64>>)> {
        self.rounds += 1;
        (self.progress)(self.rounds, self.rounds.max(TYPICAL_ROUNDS));
        problem.learn(motion, changes, linearised_at)
    }
}

/// Where two rounds lead if they go on as they did.
fn ahead(from: &Motion, first: &Motion, second: &Motion) -> Option<Motion> {
    let (from, first, second) = (from.numbers()?, first.numbers()?, second.numbers()?);
    let step = &first - &from;
    let turn = second - &first - &step;
    if turn.norm() == 0.0 {
        return None;
    }
    let reach = (step.norm() / turn.norm()).max(1.0);
    Some(Motion::of_numbers(&(from + step * (2.0 * reach) + turn * (reach * reach))))
}

impl Problem {
    /// One round of expectation and maximisation: the log likelihood with this motion, the motion that makes the
    /// smoothed states most probable, and these states.
    fn learn(
        &self,
        motion: &Motion,
        changes: &[Change],
        linearised_at: &[DVector<f64>],
    ) -> Option<(f64, Motion, Vec<DVector<f64>>)> {
        let layout = self.layout.for_changes(changes);
        let part = |x: &DVector<f64>| x.rows(0, layout.size()).into_owned();
        let points: Vec<DVector<f64>> = linearised_at.iter().map(part).collect();
        let pass = self.filter_of(&layout, motion, changes, &points, None)?;
        let later = pass.later();
        let smoothed = pass.smoothed(&later);
        let mut wander = Moments::new(layout.wander(), COEFFICIENTS);
        let mut rate = Moments::new(layout.flat(), layout.flat());
        for k in 1..smoothed.len() {
            let paces = (self.epochs[k].time_d - self.epochs[k - 1].time_d) / self.pace_d;
            if (paces - 1.0).abs() < 0.1 && !changes.iter().any(|(at, _)| *at == k) {
                for part in [&mut wander, &mut rate] {
                    let (from, step, to) = (&pass.visits[k - 1], &pass.steps[k - 1], &pass.visits[k]);
                    let cross = across(from, step, to, &later[k], part.at, part.size);
                    part.add(&smoothed[k], &smoothed[k - 1], &cross);
                }
            }
        }
        let first = Motion::default();
        let (keep, push) = wander.fit(&motion.push, &first.push, kept(SLOWEST_WANDER));
        let now = DMatrix::identity(rate.size, rate.size) * motion.rate_push;
        let prior = DMatrix::identity(rate.size, rate.size) * first.rate_push;
        let (rate_keep, rate_push) = rate.fit(&now, &prior, kept(SLOWEST_RATE));
        let learned = Motion { push, keep, rate_push: rate_push.trace() / rate.size as f64, rate_keep };
        let whole = |g: Gaussian| self.layout.at_rest(g.mean.resize_vertically(self.layout.size(), 0.0));
        Some((pass.log_likelihood, learned, smoothed.into_iter().map(whole).collect()))
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
        self.both += cross + x * y.transpose();
        self.before += part(&before.covariance) + y * y.transpose();
        self.count += 1.0;
    }

    /// What is left after a day, at most `most`, and the covariance of the push.
    fn fit(&self, push: &DMatrix<f64>, guess: &DMatrix<f64>, most: f64) -> (f64, DMatrix<f64>) {
        let weigh = |m: &DMatrix<f64>| {
            push.clone().cholesky().map_or_else(|| m.trace(), |factor| factor.solve(m).trace())
        };
        let keep = (weigh(&self.both) / weigh(&self.before)).clamp(LEAST_KEPT, most);
        let left = &self.now - (&self.both + self.both.transpose()) * keep + &self.before * (keep * keep);
        let push = (left + guess * GUESS_DAYS) / (self.count + GUESS_DAYS);
        (keep, (&push + push.transpose()) * 0.5)
    }
}

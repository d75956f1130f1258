//! How the wander and the unbalance move, learned from the record by expectation and maximisation.
//!
//! Each round raises the likelihood, and each by a little less than the one before. From two rounds in a row a third
//! is guessed far ahead along their way (SQUAREM: Varadhan and Roland 2008, "Simple and globally convergent methods for
//! accelerating the convergence of any EM algorithm", scheme S3); where that overshoots, the second counts.

use argmin::core::{CostFunction, Executor};
use argmin::solver::brent::BrentOpt;
use nalgebra::{DMatrix, DVector};

use super::kalman::{Gaussian, across};
use super::motion::{LEAST_KEPT, Motion, SLOWEST_RATE_D, SLOWEST_WANDER_D, kept};
use super::passes::Problem;
use super::scope::Change;

/// Pushes that the first guess of a motion counts for.
const GUESS_PUSHES: f64 = 2.0;
/// Trials in the search of what is left after a pace, at most.
const MOST_TRIALS: u64 = 60;

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
            let ahead = ahead(motion, &first, &second, problem.pace_d).unwrap_or_else(|| second.clone());
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
fn ahead(from: &Motion, first: &Motion, second: &Motion, pace_d: f64) -> Option<Motion> {
    let (from, first, second) = (from.numbers()?, first.numbers()?, second.numbers()?);
    let step = &first - &from;
    let turn = second - &first - &step;
    if turn.norm() == 0.0 {
        return None;
    }
    let reach = (step.norm() / turn.norm()).max(1.0);
    Some(Motion::of_numbers(&(from + step * (2.0 * reach) + turn * (reach * reach)), pace_d))
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
        let mut wander = Moments::new(layout.wander(), layout.coefficients);
        let mut rate = Moments::new(layout.flat(), layout.flat());
        for k in 1..smoothed.len() {
            let paces = (self.epochs[k].time_d - self.epochs[k - 1].time_d) / self.pace_d;
            if !changes.iter().any(|(at, _)| *at == k) {
                for part in [&mut wander, &mut rate] {
                    let (from, step, to) = (&pass.visits[k - 1], &pass.steps[k - 1], &pass.visits[k]);
                    let cross = across(from, step, to, &later[k], part.at, part.size);
                    part.add(&smoothed[k], &smoothed[k - 1], &cross, paces);
                }
            }
        }
        let first = Motion::first(self.layout.coefficients, self.pace_d);
        let (keep, push) = wander.fit(&motion.push, &first.push, kept(SLOWEST_WANDER_D, self.pace_d));
        let now = DMatrix::identity(rate.size, rate.size) * motion.rate_push;
        let prior = DMatrix::identity(rate.size, rate.size) * first.rate_push;
        let (rate_keep, rate_push) = rate.fit(&now, &prior, kept(SLOWEST_RATE_D, self.pace_d));
        let learned = Motion { push, keep, rate_push: rate_push.trace() / rate.size as f64, rate_keep };
        let whole = |g: Gaussian| self.layout.at_rest(g.mean.resize_vertically(self.layout.size(), 0.0));
        Some((pass.log_likelihood, learned, smoothed.into_iter().map(whole).collect()))
    }
}

/// Second moments of a part of the state, of each reading and the one before.
struct Moments {
    at: usize,
    size: usize,
    pairs: Vec<Pair<DMatrix<f64>>>,
}

/// Second moments of two readings, and the paces between them.
struct Pair<T> {
    paces: f64,
    now: T,
    both: T,
    before: T,
}

impl<T> Pair<T> {
    /// What is left between the two where `keep` is left after a pace, and the variance of all pushes between them over
    /// that of one pace.
    fn fade(&self, keep: f64) -> (f64, f64) {
        (keep.powf(self.paces), (1.0 - keep.powf(2.0 * self.paces)) / (1.0 - keep * keep))
    }
}

impl Moments {
    fn new(at: usize, size: usize) -> Self {
        Self { at, size, pairs: Vec::new() }
    }

    fn add(&mut self, now: &Gaussian, before: &Gaussian, cross: &DMatrix<f64>, paces: f64) {
        let (at, size) = (self.at, self.size);
        let part = |m: &DMatrix<f64>| m.view((at, at), (size, size)).into_owned();
        let (x, y) = (now.mean.rows(at, size), before.mean.rows(at, size));
        self.pairs.push(Pair {
            paces,
            now: part(&now.covariance) + x * x.transpose(),
            both: cross + x * y.transpose(),
            before: part(&before.covariance) + y * y.transpose(),
        });
    }

    /// What is left after a pace, at most `most`, with pushes of this covariance; and the covariance of the push with
    /// that.
    fn fit(&self, push: &DMatrix<f64>, guess: &DMatrix<f64>, most: f64) -> (f64, DMatrix<f64>) {
        let keep = self.keep(push, most);
        let mut left = guess * GUESS_PUSHES;
        for pair in &self.pairs {
            let (kept, gain) = pair.fade(keep);
            let moved =
                &pair.now - (&pair.both + pair.both.transpose()) * kept + &pair.before * (kept * kept);
            left += moved / gain;
        }
        let push = left / (self.pairs.len() as f64 + GUESS_PUSHES);
        (keep, (&push + push.transpose()) * 0.5)
    }

    /// What is most probably left after a pace.
    fn keep(&self, push: &DMatrix<f64>, most: f64) -> f64 {
        let factor = push.clone().cholesky();
        let weigh = |m: &DMatrix<f64>| factor.as_ref().map_or_else(|| m.trace(), |f| f.solve(m).trace());
        let weighed = |pair: &Pair<DMatrix<f64>>| Pair {
            paces: pair.paces,
            now: weigh(&pair.now),
            both: weigh(&pair.both),
            before: weigh(&pair.before),
        };
        let fading = Fading { size: self.size as f64, pairs: self.pairs.iter().map(weighed).collect() };
        let found = Executor::new(fading, BrentOpt::new(LEAST_KEPT, most))
            .configure(|state| state.max_iters(MOST_TRIALS))
            .run();
        found.ok().and_then(|found| found.state.best_param).unwrap_or(most)
    }
}

/// Pairs of readings, their moments weighed by the push's precision.
struct Fading {
    size: f64,
    pairs: Vec<Pair<f64>>,
}

impl CostFunction for Fading {
    type Param = f64;
    type Output = f64;

    /// Minus twice the logarithm of the pairs' likelihood where so much is left after a pace, on average over the states
    /// that the record allows; up to a constant.
    fn cost(&self, keep: &f64) -> Result<f64, argmin::core::Error> {
        let of = |pair: &Pair<f64>| {
            let (kept, gain) = pair.fade(*keep);
            self.size * gain.ln() + (pair.now - 2.0 * kept * pair.both + kept * kept * pair.before) / gain
        };
        Ok(self.pairs.iter().map(of).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of one number, in order: now, both, before.
    fn moments(pairs: &[(f64, [f64; 3])]) -> Moments {
        let one = |v: f64| DMatrix::from_element(1, 1, v);
        let pair = |(paces, [now, both, before]): &(f64, [f64; 3])| Pair {
            paces: *paces,
            now: one(*now),
            both: one(*both),
            before: one(*before),
        };
        Moments { at: 0, size: 1, pairs: pairs.iter().map(pair).collect() }
    }

    #[test]
    fn learned_persistence_equals_lag_one_regression() {
        let pairs = [(1.0, [1.1, 0.7, 0.9]), (1.0, [0.8, 0.5, 1.2]), (1.0, [1.5, 1.2, 1.1])];
        let one = DMatrix::from_element(1, 1, 0.3);
        let (keep, push) = moments(&pairs).fit(&one, &one, 0.99);
        let expected: f64 = 2.4 / 3.2;
        assert!((keep - expected).abs() < 1e-6, "{keep}");
        let left = 3.4 - 2.0 * expected * 2.4 + expected * expected * 3.2;
        assert!((push[(0, 0)] - (left + 0.3 * GUESS_PUSHES) / (3.0 + GUESS_PUSHES)).abs() < 1e-6);
    }

    /// Moments as they are expected of a process that keeps 0.8 of itself over a pace and is pushed by 0.36.
    #[test]
    fn a_process_is_learned_from_readings_minutes_and_days_apart() {
        let (keep, settled) = (0.8_f64, 1.0);
        let pair = |paces: f64| (paces, [settled, settled * keep.powf(paces), settled]);
        let pairs: Vec<_> =
            [0.01, 0.1, 0.3, 1.0, 2.5, 6.0].into_iter().cycle().take(6_000).map(pair).collect();
        let all = moments(&pairs);
        let (mut found, mut push) = (0.0, DMatrix::from_element(1, 1, 1.0));
        for _ in 0..50 {
            (found, push) = all.fit(&push, &DMatrix::from_element(1, 1, 1.0), 0.99);
        }
        assert!((found - keep).abs() < 1e-3, "{found}");
        assert!((push[(0, 0)] / (1.0 - keep * keep) - settled).abs() < 1e-2, "{push}");
    }
}

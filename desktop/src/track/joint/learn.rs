//! Process model of bearings and unbalance, learned from the record by expectation and maximisation.
//!
//! Convergence is linear and slow. From two rounds a third point is extrapolated (SQUAREM: Varadhan and Roland 2008, "Simple and globally convergent methods for
//! accelerating the convergence of any EM algorithm", scheme S3); if that overshoots, the second round is kept.

use argmin::core::{CostFunction, Executor};
use argmin::solver::brent::BrentOpt;
use nalgebra::{DMatrix, DVector};

use super::kalman::{Gaussian, across};
use super::motion::{LEAST_KEPT, ProcessModel, SLOWEST_RATE_D, SLOWEST_WALK_D, kept};
use super::passes::JointProblem;
use super::scope::EventAt;

/// Weight of the initial process noise, in readings.
const GUESS_PUSHES: f64 = 2.0;
/// Most iterations in the search for the persistence.
const MOST_TRIALS: u64 = 60;

/// Convergence: three rounds gain less than this, in nats of the record's likelihood. While events are searched, and at
/// the end.
const ROUGH_NATS: f64 = 1.0;
const FINE_NATS: f64 = 0.1;
/// Most rounds of a run.
const MOST_ROUNDS: usize = 300;
/// Extrapolations in a row without a new highest likelihood that end a run. Where an event is still missing, the
/// states at which readings are linearised jump about, and more rounds find nothing.
const PATIENCE: usize = 6;
/// Typical number of rounds; only for the progress.
const TYPICAL_ROUNDS: usize = 60;
/// Loss of likelihood, in nats, that rejects an extrapolation.
const OVERSHOT_NATS: f64 = 1.0;

/// Convergence target of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// Good enough to detect events.
    Rough,
    Settled,
}

/// Expectation and maximisation, round after round.
pub struct Learning<'a> {
    progress: &'a mut dyn FnMut(usize, usize),
    rounds: usize,
    /// The last run ended without convergence.
    pub gave_up: bool,
}

impl<'a> Learning<'a> {
    /// `progress` takes the rounds done and their estimated total.
    pub fn new(progress: &'a mut dyn FnMut(usize, usize)) -> Self {
        Self { progress, rounds: 0, gave_up: false }
    }

    /// Makes rounds until the gain is below that of `until`.
    pub fn run(
        &mut self,
        problem: &JointProblem,
        motion: &mut ProcessModel,
        linearised_at: &mut Vec<DVector<f64>>,
        changes: &[EventAt],
        until: Until,
    ) -> Option<()> {
        let tolerance = if until == Until::Rough { ROUGH_NATS } else { FINE_NATS };
        let mut last = f64::NEG_INFINITY;
        let mut best = (f64::NEG_INFINITY, motion.clone(), linearised_at.clone());
        let mut since_best = 0;
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
            since_best += 1;
            if now > best.0 + tolerance {
                since_best = 0;
            }
            if now > best.0 {
                best = (now, motion.clone(), linearised_at.clone());
            }
            if since_best == PATIENCE {
                break;
            }
        }
        self.gave_up = true;
        (_, *motion, *linearised_at) = best;
        Some(())
    }

    fn round(
        &mut self,
        problem: &JointProblem,
        motion: &ProcessModel,
        changes: &[EventAt],
        linearised_at: &[DVector<f64>],
    ) -> Option<(f64, ProcessModel, Vec<DVector<f64>>)> {
        self.rounds += 1;
        (self.progress)(self.rounds, self.rounds.max(TYPICAL_ROUNDS));
        problem.learn(motion, changes, linearised_at)
    }
}

fn ahead(
    from: &ProcessModel,
    first: &ProcessModel,
    second: &ProcessModel,
    pace_d: f64,
) -> Option<ProcessModel> {
    let (from, first, second) = (from.numbers()?, first.numbers()?, second.numbers()?);
    let step = &first - &from;
    let turn = second - &first - &step;
    if turn.norm() == 0.0 {
        return None;
    }
    let reach = (step.norm() / turn.norm()).max(1.0);
    Some(ProcessModel::of_numbers(&(from + step * (2.0 * reach) + turn * (reach * reach)), pace_d))
}

impl JointProblem {
    /// One round of expectation and maximisation: log likelihood of this model, the updated model, and the smoothed states.
    fn learn(
        &self,
        motion: &ProcessModel,
        changes: &[EventAt],
        linearised_at: &[DVector<f64>],
    ) -> Option<(f64, ProcessModel, Vec<DVector<f64>>)> {
        let layout = self.layout.for_changes(changes);
        let part = |x: &DVector<f64>| x.rows(0, layout.size()).into_owned();
        let points: Vec<DVector<f64>> = linearised_at.iter().map(part).collect();
        let pass = self.filter_of(&layout, motion, changes, &points, None)?;
        let later = pass.later();
        let smoothed = pass.smoothed(&later);
        let mut walk = PairMoments::new(layout.walk(), layout.coefficients());
        let mut rate = PairMoments::new(layout.flat(), layout.flat());
        for k in 1..smoothed.len() {
            let paces = (self.epochs[k].time_d - self.epochs[k - 1].time_d) / self.pace_d;
            if !changes.iter().any(|(at, _)| *at == k) {
                for part in [&mut walk, &mut rate] {
                    let (from, step, to) = (&pass.visits[k - 1], &pass.steps[k - 1], &pass.visits[k]);
                    let cross = across(from, step, to, &later[k], part.at, part.size);
                    part.add(&smoothed[k], &smoothed[k - 1], &cross, paces);
                }
            }
        }
        let first = ProcessModel::first(&self.layout.numbers, self.pace_d);
        let (keep, push) = walk.fit(&motion.push, &first.push, kept(SLOWEST_WALK_D, self.pace_d));
        let now = DMatrix::identity(rate.size, rate.size) * motion.rate_push;
        let prior = DMatrix::identity(rate.size, rate.size) * first.rate_push;
        let (rate_keep, rate_push) = rate.fit(&now, &prior, kept(SLOWEST_RATE_D, self.pace_d));
        let learned = ProcessModel { push, keep, rate_push: rate_push.trace() / rate.size as f64, rate_keep };
        let whole = |g: Gaussian| self.layout.at_rest(g.mean.resize_vertically(self.layout.size(), 0.0));
        Some((pass.log_likelihood, learned, smoothed.into_iter().map(whole).collect()))
    }
}

/// Second moments of a part of the state, for each reading and its predecessor.
struct PairMoments {
    at: usize,
    size: usize,
    pairs: Vec<ReadingPair<DMatrix<f64>>>,
}

/// Second moments of two consecutive readings, and the paces between them.
struct ReadingPair<T> {
    paces: f64,
    now: T,
    both: T,
    before: T,
}

impl<T> ReadingPair<T> {
    /// Persistence between the two readings for `keep` in one pace, and the process noise between them relative to that of
    /// one pace.
    fn fade(&self, keep: f64) -> (f64, f64) {
        (keep.powf(self.paces), (1.0 - keep.powf(2.0 * self.paces)) / (1.0 - keep * keep))
    }
}

impl PairMoments {
    fn new(at: usize, size: usize) -> Self {
        Self { at, size, pairs: Vec::new() }
    }

    fn add(&mut self, now: &Gaussian, before: &Gaussian, cross: &DMatrix<f64>, paces: f64) {
        let (at, size) = (self.at, self.size);
        let part = |m: &DMatrix<f64>| m.view((at, at), (size, size)).into_owned();
        let (x, y) = (now.mean.rows(at, size), before.mean.rows(at, size));
        self.pairs.push(ReadingPair {
            paces,
            now: part(&now.covariance) + x * x.transpose(),
            both: cross + x * y.transpose(),
            before: part(&before.covariance) + y * y.transpose(),
        });
    }

    /// Persistence in a pace, at most `most`, for process noise of covariance `push`; and the updated covariance.
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

    /// Most likely persistence in a pace.
    fn keep(&self, push: &DMatrix<f64>, most: f64) -> f64 {
        let factor = push.clone().cholesky();
        let weigh = |m: &DMatrix<f64>| factor.as_ref().map_or_else(|| m.trace(), |f| f.solve(m).trace());
        let weighed = |pair: &ReadingPair<DMatrix<f64>>| ReadingPair {
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

/// Pairs of readings, their moments weighted by the precision of the process noise.
struct Fading {
    size: f64,
    pairs: Vec<ReadingPair<f64>>,
}

impl CostFunction for Fading {
    type Param = f64;
    type Output = f64;

    /// Expected −2 log likelihood of the pairs at this persistence, up to a constant.
    fn cost(&self, keep: &f64) -> Result<f64, argmin::core::Error> {
        let of = |pair: &ReadingPair<f64>| {
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
    fn moments(pairs: &[(f64, [f64; 3])]) -> PairMoments {
        let one = |v: f64| DMatrix::from_element(1, 1, v);
        let pair = |(paces, [now, both, before]): &(f64, [f64; 3])| ReadingPair {
            paces: *paces,
            now: one(*now),
            both: one(*both),
            before: one(*before),
        };
        PairMoments { at: 0, size: 1, pairs: pairs.iter().map(pair).collect() }
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
    fn process_is_learned_from_readings_minutes_and_days_apart() {
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

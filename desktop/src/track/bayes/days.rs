//! The two loops: bearings and unbalance sampled on every day, and in the whole range after a flag.
//!
//! Every day is sampled by itself, from bearings that wander around what was last identified. Yesterday's unbalance
//! is no prior of today's: what is wrong with it is mostly wrong with the bearings of both days, so that days in a
//! row would agree more and more on the same error. An event is looked for where method 1 looks, in the residual on
//! the bearings that were last identified; the readings that raised the flag then say what they became, with the
//! unbalance near to what it was before.

use nalgebra::{Complex, DMatrix, DVector};

use super::chains::{CHAINS, Drawn, draw, moments};
use super::marginal::{Bearings, Marginal};
use super::sampling::{Sample, Sampler, Sampling, spread};
use crate::track::adaptive::Jump;
use crate::track::answer::{Cause, Estimate, Reidentified};
use crate::track::coefficients::{PRIOR_LOG_SD, coefficient};
use crate::track::daily::{Run, Tracking, WANDER, Watch};
use crate::track::operating_point::Logs;
use crate::track::record::Day;

type C = Complex<f64>;

/// Days that the stated range of the wander counts for beside those that were seen.
const ASSUMED_DAYS: f64 = 20.0;

/// Share of the variance of a coefficient's wander that it has in common with the same coefficient of the bearing's
/// other direction: both see the same load and temperature.
const COMMON: f64 = 0.5;

/// Covariance of a wander that is as likely anywhere in its stated range.
fn wander(count: usize) -> DMatrix<f64> {
    let common = |i: usize, j: usize| {
        let ((a, _, of), (b, _, and)) = (coefficient(i, count), coefficient(j, count));
        if i == j {
            1.0
        } else if a == b && of == and {
            COMMON
        } else {
            0.0
        }
    };
    DMatrix::from_fn(count, count, common) * (WANDER * WANDER / 3.0)
}

/// Where bearings are on a day that was not seen yet: around what was identified, as far as they were seen to wander.
/// Load and temperature move all coefficients of a bearing at once, which nobody states and the days show.
struct Wandering {
    identified: Bearings,
    /// Second moment around what was identified, and the days that it is the mean of.
    moment: DMatrix<f64>,
    days: f64,
}

impl Wandering {
    /// A wander that is as likely anywhere in its stated range, on top of what is not known of where it is around.
    fn around(identified: Bearings) -> Self {
        let moment = &identified.covariance + wander(identified.logs.len());
        Self { identified, moment, days: ASSUMED_DAYS }
    }

    fn prior(&self) -> Bearings {
        Bearings { logs: self.identified.logs.clone(), covariance: self.moment.clone() }
    }

    /// Learns from a day's samples (Dempster, Laird and Rubin 1977: their second moment is what is expected of it).
    fn learn(&mut self, seen: &Bearings) {
        let off = DVector::from_column_slice(&seen.logs) - DVector::from_column_slice(&self.identified.logs);
        let second = &seen.covariance + &off * off.transpose();
        self.days += 1.0;
        self.moment += (second - &self.moment) / self.days;
    }

    /// The nearest bearings that a wander of the stated range leads to.
    fn within_range(&self, logs: &[f64]) -> Logs {
        let pairs = logs.iter().zip(&self.identified.logs);
        pairs.map(|(log, middle)| log.clamp(middle - WANDER, middle + WANDER)).collect()
    }
}

/// What carries on from day to day.
struct State {
    wandering: Wandering,
    /// Standard deviation of each plane's unbalance in each direction on the last good day, kg·m.
    unbalance_sd_kg_m: Vec<f64>,
    /// Bearings of the last good day, no further away than a wander takes them.
    logs: Logs,
    /// Phase II on such bearings: where an event shows.
    watched: Vec<Estimate>,
    last_d: f64,
    watch: Watch,
}

impl Tracking<'_> {
    /// Daily sampling, and a wide one after every flag.
    pub fn bayes(&self, progress: &mut dyn FnMut(usize, usize)) -> (Run, Option<Sampling>) {
        let identified = Bearings { logs: self.logs.clone(), covariance: self.logs_covariance.clone() };
        let mut state = State {
            wandering: Wandering::around(identified),
            logs: self.logs.clone(),
            unbalance_sd_kg_m: vec![0.0; self.unbalance_kg_m.len()],
            watched: Vec::new(),
            last_d: f64::NAN,
            watch: Watch::new(self.config),
        };
        let mut run = Run::default();
        let (mut qualities, mut last) = (Vec::new(), Vec::new());
        let days: Vec<&Day> = self.complete().collect();
        for (k, day) in days.iter().enumerate() {
            progress(k + 1, days.len());
            let last_unbalance = state.watched.last().map_or(&self.unbalance_kg_m, |e| &e.unbalance_kg_m);
            let last_d = if state.last_d.is_nan() { day.time_d } else { state.last_d };
            let Some((mut estimate, drawn)) = self.sample(day, k, &state.wandering) else { continue };
            let near = state.wandering.within_range(&estimate.logs);
            let watched = self.phase_two(day, &near, Some((last_unbalance, last_d)));
            let Some(mut watched) = watched else { continue };
            let raised = state.watch.judge(&days[..=k], &mut watched);
            (estimate.suspicious, estimate.flagged) = (watched.suspicious, watched.flagged);
            if !estimate.suspicious {
                // a reading that looks wrong teaches nothing
                state.unbalance_sd_kg_m = unbalance_sd_kg_m(&estimate, &drawn.samples);
                state.wandering.learn(&moments(&drawn.samples));
                state.logs = near;
            }
            qualities.push((day.time_d, drawn.quality));
            last = drawn.samples.iter().map(|s| s.with_weights(&day.weights_kg_m)).collect();
            state.last_d = day.time_d;
            state.watched.push(watched);
            run.estimates.push(estimate);
            if let Some(suspect) = raised {
                self.search_widely(&days, k, suspect, &mut state, &mut run);
            }
        }
        let sampling = (!qualities.is_empty()).then_some(Sampling {
            sampler: Sampler::Independence,
            proposals: self.config.proposals,
            chains: CHAINS,
            days: qualities,
            adaptive: None,
            last,
        });
        (run, sampling)
    }

    /// One day on bearings that wander; `k` makes its random numbers its own.
    fn sample(&self, day: &Day, k: usize, wandering: &Wandering) -> Option<(Estimate, Drawn)> {
        let days = [day];
        let target = Marginal::new(&days, self.unbalance_kg_m.len(), &wandering.prior(), None)?;
        let drawn = self.draw(&target, &[vec![0.0; self.logs.len()]], k as u64)?;
        let (given, _) = target.given(&moments(&drawn.samples).logs)?;
        let middle = Sample { logs: given.logs, unbalance_kg_m: given.unbalance_kg_m.as_slice().to_vec() };
        let mut estimate = self.estimate(day, &middle.logs, middle.unbalance_kg_m.clone())?;
        let with_weights = |s: &Sample| s.with_weights(&day.weights_kg_m);
        let samples: Vec<Sample> = drawn.samples.iter().map(with_weights).collect();
        estimate.spread = Some(spread(&with_weights(&middle), &samples));
        Some((estimate, drawn))
    }

    fn draw(&self, target: &Marginal, starts: &[Logs], stream: u64) -> Option<Drawn> {
        let seed = self.config.seed.wrapping_mul(0x9e37_79b9).wrapping_add(stream);
        draw(target, starts, self.config.proposals, seed)
    }

    /// The second loop, on the readings until day `k` that raised a flag.
    fn search_widely(&self, days: &[&Day], k: usize, suspect: usize, state: &mut State, run: &mut Run) {
        let persistence = self.config.thresholds.persistence.max(1);
        let streak = &days[k + 1 - persistence..=k];
        let begun = state.watched.len() - streak.len();
        let now = state.watched[begun..].to_vec();
        let jump = self.jump(streak, &state.logs, &state.watch, &now);
        let cause = match jump {
            Jump::Explains(free) => {
                self.go_on(free, state);
                Cause::Unbalance
            }
            jump => {
                let known = if let Jump::Helps(free) = &jump { free } else { &now };
                let found = self.widely(streak, suspect, state, run);
                let found = found.filter(|(_, after)| self.better(after, known));
                if let Some((identified, after)) = found {
                    run.reidentified.push(Reidentified {
                        since_d: streak[0].time_d,
                        time_d: streak[streak.len() - 1].time_d,
                        case: 0,
                        bearing: suspect,
                        cases: Vec::new(),
                        logs: identified.logs.clone(),
                    });
                    state.logs = identified.logs.clone();
                    state.wandering = Wandering::around(identified);
                    self.go_on(after, state);
                    let again = |i: usize| Some(self.sample(days[i], i, &state.wandering)?.0);
                    let again: Option<Vec<Estimate>> = (k + 1 - persistence..=k).map(again).collect();
                    run.estimates.truncate(run.estimates.len() - persistence);
                    run.estimates.extend(again.unwrap_or_default());
                    Cause::Model
                } else {
                    now.iter().for_each(|e| state.watch.monitor.accept(&e.residual));
                    if let Jump::Helps(_) = jump { Cause::Unbalance } else { Cause::Model }
                }
            }
        };
        run.flags.push(self.flag(&now, suspect, cause));
    }

    /// Goes on from these, in the place of what was watched last.
    fn go_on(&self, estimates: Vec<Estimate>, state: &mut State) {
        state.watched.truncate(state.watched.len() - estimates.len());
        state.watched.extend(estimates);
        state.watch.settle();
    }

    /// Bearings in the whole range that describe a streak, and its phase II on them.
    fn widely(
        &self,
        streak: &[&Day],
        suspect: usize,
        state: &State,
        run: &Run,
    ) -> Option<(Bearings, Vec<Estimate>)> {
        let count = state.logs.len();
        let covariance = DMatrix::identity(count, count) * PRIOR_LOG_SD.powi(2);
        let before = Bearings { covariance, logs: state.logs.clone() };
        let (held, _) = self.held(&run.estimates, streak[0]);
        let held: Vec<(C, f64)> = held.into_iter().zip(state.unbalance_sd_kg_m.iter().copied()).collect();
        let target = Marginal::new(streak, held.len(), &before, Some(&held))?;
        let stream = 1_000_000 + run.flags.len() as u64;
        let starts: Vec<Logs> = (0..STARTS).map(|k| beside(k, suspect, count)).collect();
        let identified = moments(&self.draw(&target, &starts, stream)?.samples);
        let (given, _) = target.given(&identified.logs)?;
        let unbalance_kg_m = given.unbalance_kg_m.as_slice().to_vec();
        let after = self.restart(streak, &identified.logs, unbalance_kg_m)?;
        Some((identified, after))
    }
}

/// Bearings from which the second loop is searched: as they were, and the suspect stiffer or softer, more or less
/// damped, by this logarithm.
const STARTS: usize = 5;
const BESIDE: f64 = 0.5;

fn beside(k: usize, suspect: usize, count: usize) -> Logs {
    let log = |i: usize| {
        let (bearing, _, damping) = coefficient(i, count);
        let up = if damping { k & 1 == 0 } else { k & 2 == 0 };
        let size = if up { BESIDE } else { -BESIDE };
        if k + 1 < STARTS && bearing == suspect { size } else { 0.0 }
    };
    (0..count).map(log).collect()
}

/// Standard deviation of each plane's unbalance in each direction, kg·m.
fn unbalance_sd_kg_m(estimate: &Estimate, samples: &[Sample]) -> Vec<f64> {
    let of = |(j, u): (usize, &C)| {
        let squares: f64 = samples.iter().map(|s| (s.unbalance_kg_m[j] - u).norm_sqr()).sum();
        (0.5 * squares / samples.len() as f64).sqrt()
    };
    estimate.unbalance_kg_m.iter().enumerate().map(of).collect()
}

//! Method 4, ours: all days together.
//!
//! Bearings wander about constants with load and temperature; the unbalance drifts smoothly; an event
//! changes the constants of one bearing or both, the unbalance, or all of it. That is a state that moves
//! at random and is measured through a model that is linear in the unbalance and nearly so in the bearings:
//! a Kalman filter and smoother, linearised again around its own answer until it stays (`kalman`,
//! `state`). How the wander moves, which coefficients together and how fast, is learned from the record by
//! expectation and maximisation (Shumway and Stoffer 1982).
//!
//! One reading at one speed holds eight numbers for twelve unknowns. What resolves them is time: bearings
//! that wander and unbalance that drifts smoothly move the features in different ways, a run-up fixes the
//! bearings of one day, and the unbalance of one day is nearly that of the next. What even this leaves
//! open keeps its prior, and [`Joint::constants`] says which.
//!
//! Events are steps of the features ([`super::step`]), or three readings in a row that the filter finds
//! impossible; when each took place and what it changed is what makes the record most probable. A single
//! impossible reading is left out: a passing disturbance teaches nothing.

mod kalman;
mod search;
mod state;

use nalgebra::{Complex, DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

pub use state::Scope;

use super::daily::{Run, Tracking};
use super::record::{self, Day};
use super::spot::{Logs, logs_of};
use super::{Cause, Estimate, Flag, Interval, Reidentified, Spread};
use crate::diagnose::{Step as Added, improve};
use crate::error::Error;
use crate::fit::hypothesis::{COEFFICIENTS, PRIOR_LOG_SD};
use crate::measurement::Reading;
use crate::rotor::{Noise, Rotor};
use kalman::{Gaussian, Innovation, Step, smooth};
use search::Window;
use state::{Layout, Motion};

type C = Complex<f64>;

/// Chance that a reading of a machine without an event is called impossible.
const CHANCE: f64 = 1e-6;
/// Rounds over which states settle around their own answer.
const SETTLE: usize = 3;
/// Half of a 95 % interval, in standard deviations.
const HALF: f64 = 1.96;

/// An event, and how sure it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// First day of the new state.
    pub time_d: f64,
    /// What it changed.
    pub scope: Scope,
    /// Logarithm of how much more probable the record is with it.
    pub evidence: f64,
}

/// What is known of a bearing coefficient's constant part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constant {
    /// Logarithm of its value.
    pub log: f64,
    /// Standard deviation of that; the prior's is 0.5.
    pub sd: f64,
    /// Fixed at least twice as well as by the prior.
    pub from_data: bool,
}

/// What method 4 learned beside its estimates.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Events in order.
    pub events: Vec<Event>,
    /// The bearings' constants: first day of a state, and the eight coefficients.
    pub constants: Vec<(f64, Vec<Constant>)>,
    /// Standard deviation of each coefficient's wander, relative.
    pub wander: Logs,
    /// Days in which the wander fades to 1/e.
    pub wander_days: f64,
    /// Days whose reading was left out as impossible.
    pub left_out_d: Vec<f64>,
    /// Effects that a later run-up showed, by label.
    pub effects: Vec<String>,
    /// Unbalance of each estimate as it was known on its day, kg·m: what a forecast may use.
    pub known_then_kg_m: Vec<Vec<C>>,
}

/// A run-up after an event, and its day.
#[derive(Debug, Clone)]
pub struct Later<'a> {
    /// Days since the record began.
    pub time_d: f64,
    /// The run-up.
    pub readings: &'a [Reading],
}

/// All readings of one time.
struct Epoch {
    time_d: f64,
    /// The record's own reading, if there is one.
    own: Option<Day>,
    /// Run-ups of that time.
    beside: Vec<Day>,
}

/// The record as the filter sees it.
struct Problem {
    layout: Layout,
    noise: Noise,
    unit_kg_m: f64,
    /// Days between readings, as a rule.
    pace_d: f64,
    epochs: Vec<Epoch>,
    guess: Logs,
    unbalance: Vec<C>,
}

/// An event at an epoch.
type Change = (usize, Scope);

/// One run of the filter.
struct Pass {
    filtered: Vec<Gaussian>,
    steps: Vec<Step>,
    log_likelihood: f64,
    impossible: Vec<bool>,
}

impl Problem {
    /// The filter along the record, linearised around these states; around its own predictions if there
    /// are none.
    fn filter(&self, motion: &Motion, changes: &[Change], around: Option<&[DVector<f64>]>) -> Option<Pass> {
        let mut at = self.layout.start(&self.guess, &self.unbalance, motion);
        let mut pass =
            Pass { filtered: Vec::new(), steps: Vec::new(), log_likelihood: 0.0, impossible: Vec::new() };
        for (k, epoch) in self.epochs.iter().enumerate() {
            if k > 0 {
                let days = (epoch.time_d - self.epochs[k - 1].time_d) / self.pace_d;
                let scope = changes.iter().find(|(at, _)| *at == k).map(|(_, scope)| *scope);
                let step = self.layout.step(days, motion, scope);
                at = at.predicted(&step);
                pass.steps.push(step);
            }
            let mut impossible = false;
            for (n, day) in epoch.own.iter().chain(&epoch.beside).enumerate() {
                let point = around.map_or_else(|| at.mean.clone(), |around| around[k].clone());
                let (slope, left, variance) = self.layout.linear(day, &point, self.unit_kg_m, &self.noise)?;
                let left = left - &slope * (&at.mean - &point);
                let innovation = Innovation::new(&at, &slope, left, &variance)?;
                let limit = impossible_from(variance.len());
                pass.log_likelihood -= 0.5 * (innovation.squared.min(limit) + innovation.log_det);
                if innovation.squared > limit && n == 0 && epoch.own.is_some() {
                    impossible = true;
                } else {
                    at = innovation.update(&at);
                }
            }
            pass.impossible.push(impossible);
            pass.filtered.push(at.clone());
        }
        Some(pass)
    }

    /// Filter and smoother, again and again around their own answer, `at_rest` or with its wander.
    fn settle(
        &self,
        motion: &Motion,
        changes: &[Change],
        around: &[DVector<f64>],
        at_rest: bool,
    ) -> Option<(Pass, Vec<DVector<f64>>)> {
        let mut around = around.to_vec();
        let mut pass = self.filter(motion, changes, Some(&around))?;
        for _ in 0..SETTLE {
            let (smoothed, _) = smooth(&pass.filtered, &pass.steps);
            let point = |g: Gaussian| if at_rest { self.layout.at_rest(g.mean) } else { g.mean };
            around = smoothed.into_iter().map(point).collect();
            pass = self.filter(motion, changes, Some(&around))?;
        }
        Some((pass, around))
    }

    /// One round of expectation and maximisation: the states, and the motion that makes them most
    /// probable.
    fn learn(
        &self,
        motion: &Motion,
        changes: &[Change],
        around: &[DVector<f64>],
    ) -> Option<(Motion, Vec<DVector<f64>>)> {
        let pass = self.filter(motion, changes, Some(around))?;
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

    /// The wander of each epoch once more, with everything else as it was found: around its own answer, so
    /// that it need not be small for the features to be linear in it.
    fn wander_again(&self, motion: &Motion, pass: &Pass, states: &mut [Gaussian]) -> Option<()> {
        let (at, all) = (self.layout.wander(), COEFFICIENTS);
        let part = |m: &DMatrix<f64>| m.view((at, at), (all, all)).into_owned();
        let settled = &motion.push / (1.0 - motion.keep.powi(2));
        let start = Gaussian { mean: DVector::zeros(all), covariance: settled };
        let steps: Vec<Step> = pass
            .steps
            .iter()
            .map(|s| Step { transition: part(&s.transition), noise: part(&s.noise) })
            .collect();
        for _ in 0..SETTLE {
            let (mut now, mut filtered) = (start.clone(), Vec::new());
            for (k, epoch) in self.epochs.iter().enumerate() {
                if k > 0 {
                    now = now.predicted(&steps[k - 1]);
                }
                let point = &states[k].mean;
                for day in epoch.own.iter().filter(|_| !pass.impossible[k]).chain(&epoch.beside) {
                    let (slope, left, variance) =
                        self.layout.linear(day, point, self.unit_kg_m, &self.noise)?;
                    let slope = slope.columns(at, all).into_owned();
                    let left = left - &slope * (&now.mean - point.rows(at, all));
                    now = Innovation::new(&now, &slope, left, &variance)?.update(&now);
                }
                filtered.push(now.clone());
            }
            let (smoothed, _) = smooth(&filtered, &steps);
            for (state, wander) in states.iter_mut().zip(smoothed) {
                state.mean.rows_mut(at, all).copy_from(&wander.mean);
            }
        }
        Some(())
    }

    fn own(&self) -> impl Iterator<Item = (usize, &Day)> {
        self.epochs.iter().enumerate().filter_map(|(k, e)| Some((k, e.own.as_ref()?)))
    }
}

/// Squared innovation beyond which a reading of so many numbers is called impossible.
fn impossible_from(numbers: usize) -> f64 {
    ChiSquared::new(numbers as f64).map_or(f64::INFINITY, |c| c.inverse_cdf(1.0 - CHANCE))
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

/// Readings in which the wander fades at the slowest. Bearings that went elsewhere over months and
/// unbalance that grew over months look alike at one speed; months are taken as the unbalance's.
const SLOWEST_WANDER: f64 = 20.0;
/// The same of the unbalance's rate.
const SLOWEST_RATE: f64 = 100.0;
/// Days that the first guess of a motion counts for.
const GUESS_DAYS: f64 = 2.0;

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

impl Tracking<'_> {
    /// All days together; `runup` is of the first day, `later` of days after an event.
    ///
    /// # Errors
    /// If the machine is singular on its bearings, or a later run-up cannot be diagnosed.
    pub fn joint(
        &self,
        runup: &[Reading],
        later: &[Later],
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<(Run, Joint), Error> {
        let start = self.adaptive(&mut |_, _| ());
        let begun = self.phase_one.as_ref().map_or_else(|| self.rotor.clone(), |p| p.rotor.clone());
        let mut problem = self.problem(&begun, runup)?;
        let mut around = self.first_guess(&problem, &start);
        let mut windows = self.steps(&problem);
        let mut effects = Vec::new();
        for l in later {
            let before = |w: &&mut Window| problem.epochs[w.likely].time_d <= l.time_d;
            let Some(window) = windows.iter_mut().rfind(before) else {
                return Err(Error::Unsuitable(format!(
                    "nothing changed before the later run-up of day {}: expected one that was taken after an event",
                    l.time_d
                )));
            };
            // days before it are described without the effect, so that it can be nowhere else
            window.epochs = window.likely..window.likely + 1;
            let since = window.likely;
            let found = improve(&begun, l.readings, |_: &Added| ())?;
            effects.extend(found.steps.iter().map(|s| s.added.label()));
            self.describe_anew(&mut problem, &mut around, &found.rotor, since, l)?;
        }
        let singular = || Error::Unsuitable("the machine is singular on the bearings of the record".into());
        let found = problem.search(windows, around, progress).ok_or_else(singular)?;
        Ok(self.told(&problem, &found, effects))
    }

    fn problem(&self, begun: &Rotor, runup: &[Reading]) -> Result<Problem, Error> {
        let layout = Layout { planes: self.rotor.plane.len() };
        let unit_kg_m = self.unbalance_kg_m.iter().map(|u| u.norm()).fold(f64::MIN_POSITIVE, f64::max);
        let own = self.days.iter().map(|d| Epoch { time_d: d.time_d, own: Some(d.clone()), beside: vec![] });
        let mut epochs: Vec<Epoch> = own.collect();
        epochs[0].beside = record::days(begun, &self.noise, runup)?;
        let mut gaps: Vec<f64> = epochs.windows(2).map(|w| w[1].time_d - w[0].time_d).collect();
        gaps.retain(|g| *g > 0.0);
        gaps.sort_by(f64::total_cmp);
        Ok(Problem {
            layout,
            noise: self.noise,
            unit_kg_m,
            pace_d: gaps.get(gaps.len() / 2).copied().unwrap_or(1.0),
            epochs,
            // without a run-up phase I's bearings are little more than the file's: the prior is the file's
            guess: if runup.is_empty() { logs_of(self.rotor) } else { self.logs },
            unbalance: self.unbalance_kg_m.iter().map(|u| u / unit_kg_m).collect(),
        })
    }

    /// States to linearise around at first: the bearings of method 2, and its unbalance smoothed.
    fn first_guess(&self, problem: &Problem, start: &Run) -> Vec<DVector<f64>> {
        const BESIDE: usize = 7;
        let all = &start.estimates;
        let of = |epoch: &Epoch| {
            let k = all.partition_point(|e| e.time_d < epoch.time_d).min(all.len() - 1);
            let near = &all[k.saturating_sub(BESIDE)..(k + BESIDE + 1).min(all.len())];
            let same: Vec<&Estimate> = near.iter().filter(|e| e.logs == all[k].logs).collect();
            let mean = |j: usize| {
                same.iter().map(|e| e.unbalance_kg_m[j]).sum::<C>() / (same.len() as f64 * problem.unit_kg_m)
            };
            let unbalance: Vec<C> = (0..problem.layout.planes).map(mean).collect();
            problem.layout.at(&all[k].logs, &unbalance)
        };
        problem.epochs.iter().map(of).collect()
    }

    /// Puts a model with other effects under the days from an epoch on, and a run-up beside its day.
    fn describe_anew(
        &self,
        problem: &mut Problem,
        around: &mut [DVector<f64>],
        rotor: &Rotor,
        since: usize,
        later: &Later,
    ) -> Result<(), Error> {
        let model = super::spot::model(rotor);
        let logs = logs_of(rotor);
        for (epoch, point) in problem.epochs.iter_mut().zip(around).skip(since) {
            if let Some(day) = &mut epoch.own {
                day.spot = super::spot::Spot::new(&model, day.speed_rad_s)?;
            }
            *point = problem.layout.at(&logs, &problem.layout.unbalance(point));
        }
        let distance = |e: &Epoch| (e.time_d - later.time_d).abs();
        let epochs = &mut problem.epochs[since..];
        if let Some(near) = epochs.iter_mut().min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            near.beside.extend(record::days(rotor, &self.noise, later.readings)?);
        }
        Ok(())
    }

    /// What was found, as estimates.
    fn told(&self, problem: &Problem, found: &search::Found, effects: Vec<String>) -> (Run, Joint) {
        let layout = problem.layout;
        let mut run = Run::default();
        let mut known_then_kg_m = Vec::new();
        let scaled = |x: &DVector<f64>| -> Vec<C> {
            layout.unbalance(x).iter().map(|u| u * problem.unit_kg_m).collect()
        };
        for (k, day) in problem.own() {
            let state = &found.smoothed[k];
            let Some(mut estimate) = self.estimate(day, &layout.logs(&state.mean), scaled(&state.mean))
            else {
                continue;
            };
            estimate.spread = Some(spread(layout, state, problem.unit_kg_m));
            estimate.suspicious = found.pass.impossible[k];
            known_then_kg_m.push(scaled(&found.pass.filtered[k].mean));
            run.estimates.push(estimate);
        }
        for (event, k) in found.events.iter().zip(&found.at) {
            let [before, after] = [k - 1, *k].map(|k| layout.constant_logs(&found.smoothed[k].mean));
            let suspect = suspect(event.scope, &before, &after);
            let of_model = event.scope.bearings.contains(&true);
            let cause = if of_model { Cause::Model } else { Cause::Unbalance };
            run.flags.push(Flag { since_d: event.time_d, time_d: event.time_d, suspect, cause });
            if of_model {
                let both = event.scope.bearings == [true; 2];
                run.reidentified.push(Reidentified {
                    since_d: event.time_d,
                    time_d: event.time_d,
                    case: 1 + u8::from(event.scope.unbalance) + if both { 2 } else { 0 },
                    bearing: suspect,
                    cases: Vec::new(),
                    logs: after,
                });
            }
        }
        let states = std::iter::once(0).chain(found.at.iter().copied());
        let constants = states.map(|k| {
            let state = &found.smoothed[k];
            let (logs, sd) = (layout.constant_logs(&state.mean), layout.constant_sd(&state.covariance));
            let of = |(log, sd): (&f64, &f64)| Constant {
                log: *log,
                sd: *sd,
                from_data: *sd < 0.5 * PRIOR_LOG_SD,
            };
            (problem.epochs[k].time_d, logs.iter().zip(&sd).map(of).collect())
        });
        let settled = &found.motion.push / (1.0 - found.motion.keep.powi(2));
        let joint = Joint {
            constants: constants.collect(),
            wander: std::array::from_fn(|i| settled[(i, i)].sqrt()),
            wander_days: -problem.pace_d / found.motion.keep.ln(),
            left_out_d: problem
                .own()
                .filter(|(k, _)| found.pass.impossible[*k])
                .map(|(_, d)| d.time_d)
                .collect(),
            events: found.events.clone(),
            effects,
            known_then_kg_m,
        };
        (run, joint)
    }
}

/// The bearing that an event changed; of both, the one that changed more.
fn suspect(scope: Scope, before: &Logs, after: &Logs) -> usize {
    let change = |bearing: usize| {
        let own = |i: &usize| crate::fit::hypothesis::coefficient(*i).0 == bearing;
        (0..COEFFICIENTS).filter(own).map(|i| (after[i] - before[i]).powi(2)).sum::<f64>()
    };
    match scope.bearings {
        [true, false] => 0,
        [false, true] => 1,
        _ => usize::from(change(1) > change(0)),
    }
}

/// Intervals of a state.
fn spread(layout: Layout, state: &Gaussian, unit_kg_m: f64) -> Spread {
    let (logs, sd) = (layout.logs(&state.mean), layout.logs_sd(&state.covariance));
    let around = |at: f64, sd: f64| Interval { low: at - HALF * sd, high: at + HALF * sd };
    let along = |j: usize, turn: f64| {
        // standard deviation of the plane's unbalance along its own direction, or across it
        let u = C::from_polar(1.0, layout.unbalance(&state.mean)[j].arg() + turn);
        let c = |a: usize, b: usize| state.covariance[(2 * j + a, 2 * j + b)];
        let variance = u.re * u.re * c(0, 0) + 2.0 * u.re * u.im * c(0, 1) + u.im * u.im * c(1, 1);
        variance.max(0.0).sqrt()
    };
    let planes = 0..layout.planes;
    let size = |j: usize| layout.unbalance(&state.mean)[j].norm();
    let angle = |j: usize| layout.unbalance(&state.mean)[j].arg();
    Spread {
        logs: std::array::from_fn(|i| around(logs[i], sd[i])),
        magnitude_kg_m: planes
            .clone()
            .map(|j| around(size(j) * unit_kg_m, along(j, 0.0) * unit_kg_m))
            .collect(),
        angle_rad: planes
            .map(|j| around(angle(j), along(j, std::f64::consts::FRAC_PI_2) / size(j).max(1e-9)))
            .collect(),
    }
}

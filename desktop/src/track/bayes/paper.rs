//! Bayesian updating in two loops as it was printed (Bera et al., Sensors 2024, 24, 8123).
//!
//! Each day a Metropolis sampler moves through bearings and unbalance, from yesterday's mean on: the prior
//! is uniform in the assumed range of the bearings around the last identification, and within the growth bound of
//! the unbalance; the likelihood falls exponentially with the residual, `exp(−Σ|rᵢ|/bᵢ)`, with
//! `bᵢ = σᵢ/√2` so that it has the noise's standard deviation. The day's mean carries on.
//!
//! When the residual jumps by more than 30 % and stays, a second loop walks through the whole range with a
//! step that adapts to its acceptance, on the readings that raised the flag.
//!
//! Eight numbers a day for twelve unknowns: four directions are as wide as the prior, and where the mean
//! lies along them is as much the prior's and the short chain's doing as the data's. A range that moved
//! with the mean would let the unbalance drift away without a limit, at a residual as low as ever; so it
//! stays where the bearings were identified. The interval of a day says how wide the directions are.

use nalgebra::{Complex, DVector};

use super::paper_posterior::Posterior;
use super::random_walk::{MarkovChain, MetropolisSampler, Proposal, quality};
use super::sampling::{self, Sampling, median};
use crate::track::adaptive::Jump;
use crate::track::answer::{FlagCause, ReadingEstimate, Reidentified};
use crate::track::coefficients::{FollowedNumber, Logs};
use crate::track::daily::{EventDetector, TrackedRecord, Tracking};
use crate::track::record::Day;

type C = Complex<f64>;

/// Independent chains for each day.
const CHAINS: usize = 4;
/// Size of the bearings' coordinates.
const UNIT: f64 = 0.1;
/// Range of the second loop around the start, as phase I's.
const WIDE: f64 = 0.916_290_731_874_155;
/// Rounds of the second loop, each of this many times the proposals of a day; the last one counts.
const ROUNDS: usize = 12;
const LONGER: usize = 5;
/// Every so many days the adaptive sampler runs on the same target.
const COMPARED_EVERY: usize = 10;

/// State of the method between days.
struct PaperState {
    /// Last identified bearings, and yesterday's mean.
    identified: Logs,
    logs: Logs,
    last: Vec<C>,
    last_d: f64,
    detector: EventDetector,
    sampler: MetropolisSampler,
}

impl PaperState {
    /// Continues from these estimates instead of those from `begun` on.
    fn go_on(&mut self, estimates: Vec<ReadingEstimate>, run: &mut TrackedRecord, begun: usize) {
        if let Some(last) = estimates.last() {
            self.last.clone_from(&last.unbalance_kg_m);
        }
        run.estimates.truncate(begun);
        run.estimates.extend(estimates);
        self.detector.reset();
    }
}

impl Tracking<'_> {
    /// Daily sampling by a random walk from yesterday's mean on, and a wide search after every flag.
    pub fn bayes_as_printed(
        &self,
        progress: &mut dyn FnMut(usize, usize),
    ) -> (TrackedRecord, Option<Sampling>) {
        let dimensions = self.logs.len() + 2 * self.unbalance_kg_m.len();
        let mut state = PaperState {
            identified: self.logs.clone(),
            logs: self.logs.clone(),
            last: self.unbalance_kg_m.clone(),
            last_d: f64::NAN,
            detector: EventDetector::new(self.config),
            sampler: MetropolisSampler::new(Proposal::Metropolis, dimensions),
        };
        let mut other = MetropolisSampler::new(Proposal::AdaptiveMetropolis, dimensions);
        let mut run = TrackedRecord::default();
        let (mut qualities, mut adaptive, mut last) = (Vec::new(), Vec::new(), Vec::new());
        let days: Vec<&Day> = self.complete().collect();
        for (k, day) in days.iter().enumerate() {
            progress(k + 1, days.len());
            let Some(target) = self.daily_target(&days[k..=k], &state) else { continue };
            let starts: Vec<DVector<f64>> =
                (0..CHAINS).filter_map(|c| target.start(&dispersed(c, self.logs.len()))).collect();
            if starts.len() < CHAINS {
                continue;
            }
            let seed = self.config.seed.wrapping_add(k as u64);
            let chains = target.chains(&state.sampler, &starts, self.config.proposals, seed);
            let Some((centre, spread, samples)) = target.sum_up(&chains) else { continue };
            if k % COMPARED_EVERY == 0 {
                let beside = target.chains(&other, &starts, self.config.proposals, seed);
                other.learn(&beside);
                adaptive.extend(quality(&beside));
            }
            drop(target);
            qualities.extend(quality(&chains).map(|quality| (day.time_d, quality)));
            state.sampler.learn(&chains);
            let Some(mut estimate) = self.estimate(day, &centre.logs, centre.unbalance_kg_m) else {
                continue;
            };
            estimate.spread = Some(spread);
            let raised = state.detector.evaluate(&days[..=k], &mut estimate);
            if !estimate.suspicious {
                // the bearings are not learned from suspicious readings
                state.logs.clone_from(&estimate.logs);
            }
            (state.last, state.last_d) = (estimate.unbalance_kg_m.clone(), day.time_d);
            run.estimates.push(estimate);
            last = samples;
            if let Some(suspect) = raised {
                self.search_widely_as_printed(&days[..=k], suspect, &mut state, &mut run);
            }
        }
        let sampling = (!qualities.is_empty()).then(|| Sampling {
            sampler: sampling::SamplerKind::Metropolis,
            proposals: self.config.proposals,
            chains: CHAINS,
            days: qualities,
            adaptive: median(adaptive.iter()),
            last,
        });
        (run, sampling)
    }

    fn daily_target<'t>(&'t self, days: &'t [&'t Day], state: &'t PaperState) -> Option<Posterior<'t>> {
        let last_d = if state.last_d.is_nan() { days[0].time_d } else { state.last_d };
        let ranges = self.ranges();
        let range = [-1.0, 1.0]
            .map(|sign| state.identified.iter().zip(&ranges).map(|(log, r)| log + sign * r).collect());
        let around = self.around(days[0], &state.last, last_d);
        Posterior::new(days, &state.logs, UNIT, range, around)
    }

    /// Each plane's previous unbalance, and its largest change within the growth bound, kg·m.
    fn around(&self, day: &Day, was: &[C], was_d: f64) -> Vec<(C, f64)> {
        let largest = self.largest_kg_m(day, was, was_d);
        was.iter().zip(largest).map(|(u, largest)| (*u, largest - u.norm())).collect()
    }

    /// The second loop, on the readings that raised a flag.
    fn search_widely_as_printed(
        &self,
        days: &[&Day],
        suspect: usize,
        state: &mut PaperState,
        run: &mut TrackedRecord,
    ) {
        let persistence = self.config.thresholds.persistence.max(1);
        let streak = &days[days.len() - persistence..];
        let begun = run.estimates.len() - streak.len();
        let now = run.estimates[begun..].to_vec();
        let jump = self.jump(streak, &state.logs, &state.detector, &now);
        let found = match jump {
            Jump::Explains(_) => None,
            _ => self.widely_as_printed(streak, suspect, state, run),
        };
        let known = if let Jump::Helps(free) = &jump { free } else { &now };
        let cause = match (found.filter(|(after, _)| self.better(after, known)), jump) {
            (Some((after, logs)), _) => {
                run.reidentified.push(Reidentified {
                    since_d: streak[0].time_d,
                    time_d: streak[streak.len() - 1].time_d,
                    case: 0,
                    bearing: suspect,
                    cases: Vec::new(),
                    logs: logs.clone(),
                });
                (state.identified, state.logs) = (logs.clone(), logs);
                state.go_on(after, run, begun);
                FlagCause::Model
            }
            (None, Jump::Explains(free)) => {
                state.go_on(free, run, begun);
                FlagCause::Unbalance
            }
            (None, jump) => {
                now.iter().for_each(|e| state.detector.residuals.accept(&e.residual));
                if let Jump::Helps(_) = jump { FlagCause::Unbalance } else { FlagCause::Model }
            }
        };
        run.flags.push(self.flag(&now, suspect, cause));
    }

    /// Bearings in the whole range that describe a streak, and its phase II on them.
    fn widely_as_printed(
        &self,
        streak: &[&Day],
        suspect: usize,
        state: &PaperState,
        run: &TrackedRecord,
    ) -> Option<(Vec<ReadingEstimate>, Logs)> {
        let range: [Logs; 2] = [-1.0, 1.0].map(|sign| {
            self.logs.iter().zip(&self.numbers[..]).map(|(log, n)| log + sign * WIDE * n.width()).collect()
        });
        let count = self.logs.len();
        let centre: Logs = (0..count).map(|i| state.logs[i].clamp(range[0][i], range[1][i])).collect();
        let (held, held_d) = self.held(&run.estimates, streak[0]);
        let around = self.around(streak[0], &held, held_d);
        let target = Posterior::new(streak, &centre, 0.25 * WIDE, range, around)?;
        let dimensions = self.logs.len() + 2 * self.unbalance_kg_m.len();
        let mut sampler = MetropolisSampler::new(Proposal::AdaptiveMetropolis, dimensions);
        let mut starts: Vec<DVector<f64>> =
            (0..CHAINS).filter_map(|k| target.start(&spread_start(k, suspect, &self.numbers))).collect();
        let mut chains = Vec::new();
        for round in 0..ROUNDS {
            let seed =
                self.config.seed.wrapping_add(1_000_000 + 1000 * run.flags.len() as u64 + round as u64);
            chains = target.chains(&sampler, &starts, LONGER * self.config.proposals, seed);
            sampler.learn(&chains);
            starts = chains.iter().filter_map(|c| c.samples.last().cloned()).collect();
        }
        // chains stuck far below the highest density are left out
        let level = |c: &MarkovChain| {
            c.samples.iter().map(|x| target.log_density(x)).sum::<f64>() / c.samples.len().max(1) as f64
        };
        let levels: Vec<f64> = chains.iter().map(level).collect();
        let highest = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let kept: Vec<MarkovChain> = chains
            .iter()
            .zip(&levels)
            .filter(|(_, level)| highest - **level < dimensions as f64)
            .map(|(c, _)| c.clone())
            .collect();
        let (found, ..) = (!kept.is_empty()).then(|| target.sum_up(&kept))??;
        Some((self.restart(streak, &found.logs, found.unbalance_kg_m)?, found.logs))
    }
}

/// Bearings on which a chain of a day begins, in the units of its step: the chains begin apart, or that they agree would
/// say nothing.
fn dispersed(k: usize, count: usize) -> Vec<f64> {
    let size = if k < 2 { 1.0 } else { 2.0 };
    (0..count).map(|i| if (i + k).is_multiple_of(2) { size } else { -size }).collect()
}

/// Bearings on which a chain of the second loop begins: the suspect stiffer or softer, more or less damped.
fn spread_start(k: usize, suspect: usize, numbers: &[FollowedNumber]) -> Vec<f64> {
    let coordinate = |n: &FollowedNumber| {
        let up = if n.is_damping() { k & 1 == 0 } else { k & 2 == 0 };
        let size = if up { 1.0 } else { -1.0 };
        if n.bearing == suspect { size } else { 0.0 }
    };
    numbers.iter().map(coordinate).collect()
}

//! The two loops: bearings and unbalance sampled on every day, and in the whole range after a flag.
//!
//! Each day is sampled by itself; the prior of the bearings is a random walk around the last identification. Yesterday's
//! unbalance is no prior of today's: its error comes mostly from the bearings, which both days share, so consecutive days
//! would reinforce the same error. Events are detected as in method 1, by the residual on the last identified bearings.
//! The readings that raised the flag then identify the new bearings, with the unbalance near its previous value.

use nalgebra::{Complex, DMatrix, DVector};

use super::chains::{CHAINS, PosteriorSamples, draw};
use super::marginal::{BearingGaussian, Marginal};
use super::sampling::{PosteriorSample, Quality, SamplerKind, Sampling, spread};
use crate::bearing::law::Role;
use crate::track::adaptive::Jump;
use crate::track::answer::{FlagCause, ReadingEstimate, Reidentified};
use crate::track::coefficients::{FollowedNumber, Logs};
use crate::track::daily::{EventDetector, TrackedRecord, Tracking};
use crate::track::record::Day;

type C = Complex<f64>;

/// Weight of the assumed range of the random walk, in days.
const ASSUMED_DAYS: f64 = 20.0;

/// Correlation of a coefficient's random walk with that of the same coefficient in the bearing's other direction:
/// both see the same load and temperature.
const COMMON: f64 = 0.5;

/// Covariance of a random walk that is uniform in its assumed range.
fn walk_covariance(numbers: &[FollowedNumber], ranges: &[f64]) -> DMatrix<f64> {
    let common = |i: usize, j: usize| {
        let (a, b) = (&numbers[i], &numbers[j]);
        let is_direct = a.law.role != Role::Other;
        let correlation = match () {
            () if i == j => 1.0,
            () if is_direct && (a.bearing, a.law.role) == (b.bearing, b.law.role) => COMMON,
            () => 0.0,
        };
        correlation * ranges[i] * ranges[j] / 3.0
    };
    DMatrix::from_fn(numbers.len(), numbers.len(), common)
}

/// Prior of the bearings on a new day: a Gaussian around the last identification, with a covariance learned from past
/// days. Load and temperature move all coefficients of a bearing together; the days show how.
struct BearingWalk {
    identified: BearingGaussian,
    /// Second moment around the identified bearings, and its weight in days.
    moment: DMatrix<f64>,
    days: f64,
    /// Usual range of each logarithm.
    ranges: Vec<f64>,
}

impl BearingWalk {
    /// A random walk uniform in its assumed range, plus the covariance of the identification.
    fn around(identified: BearingGaussian, numbers: &[FollowedNumber], ranges: Vec<f64>) -> Self {
        let moment = &identified.covariance + walk_covariance(numbers, &ranges);
        Self { identified, moment, days: ASSUMED_DAYS, ranges }
    }

    fn prior(&self) -> BearingGaussian {
        BearingGaussian { logs: self.identified.logs.clone(), covariance: self.moment.clone() }
    }

    /// Learns from the posterior of a day: its second moment is the expectation (Dempster, Laird and Rubin 1977).
    fn learn(&mut self, seen: &BearingGaussian) {
        let off = DVector::from_column_slice(&seen.logs) - DVector::from_column_slice(&self.identified.logs);
        let second = &seen.covariance + &off * off.transpose();
        self.days += 1.0;
        self.moment += (second - &self.moment) / self.days;
    }

    /// The nearest bearings within the assumed range.
    fn within_range(&self, logs: &[f64]) -> Logs {
        let all = logs.iter().zip(&self.identified.logs).zip(&self.ranges);
        all.map(|((log, middle), range)| log.clamp(middle - range, middle + range)).collect()
    }
}

/// State of the method between days.
struct DailyState {
    walk: BearingWalk,
    /// Standard deviation of each plane's unbalance in each direction on the last good day, kg·m.
    unbalance_sd_kg_m: Vec<f64>,
    /// Bearings of the last good day, limited to the assumed range.
    logs: Logs,
    /// Phase II on these bearings, whose residual shows events.
    watched: Vec<ReadingEstimate>,
    last_d: f64,
    detector: EventDetector,
}

/// Estimate of a day, and the samples behind it.
struct SampledDay {
    estimate: ReadingEstimate,
    bearings: BearingGaussian,
    /// Standard deviation of each plane's unbalance in each direction, kg·m.
    unbalance_sd_kg_m: Vec<f64>,
    quality: Quality,
    /// With the known weights of the day.
    samples: Vec<PosteriorSample>,
}

impl Tracking<'_> {
    /// Daily sampling, and a wide one after every flag.
    pub fn bayes(&self, progress: &mut dyn FnMut(usize, usize)) -> (TrackedRecord, Option<Sampling>) {
        let identified =
            BearingGaussian { logs: self.logs.clone(), covariance: self.logs_covariance.clone() };
        let mut state = DailyState {
            walk: BearingWalk::around(identified, &self.numbers, self.ranges()),
            logs: self.logs.clone(),
            unbalance_sd_kg_m: vec![0.0; self.unbalance_kg_m.len()],
            watched: Vec::new(),
            last_d: f64::NAN,
            detector: EventDetector::new(self.config),
        };
        let mut run = TrackedRecord::default();
        let (mut qualities, mut last) = (Vec::new(), Vec::new());
        let days: Vec<&Day> = self.complete().collect();
        for (k, day) in days.iter().enumerate() {
            progress(k + 1, days.len());
            let last_unbalance = state.watched.last().map_or(&self.unbalance_kg_m, |e| &e.unbalance_kg_m);
            let last_d = if state.last_d.is_nan() { day.time_d } else { state.last_d };
            let Some(sampled) = self.sample(day, k, &state.walk) else { continue };
            let mut estimate = sampled.estimate;
            let near = state.walk.within_range(&estimate.logs);
            let watched = self.phase_two(day, &near, Some((last_unbalance, last_d)));
            let Some(mut watched) = watched else { continue };
            let raised = state.detector.evaluate(&days[..=k], &mut watched);
            (estimate.suspicious, estimate.flagged) = (watched.suspicious, watched.flagged);
            if !estimate.suspicious {
                // suspicious readings are not learned from
                state.unbalance_sd_kg_m = sampled.unbalance_sd_kg_m;
                state.walk.learn(&sampled.bearings);
                state.logs = near;
            }
            qualities.push((day.time_d, sampled.quality));
            last = sampled.samples;
            state.last_d = day.time_d;
            state.watched.push(watched);
            run.estimates.push(estimate);
            if let Some(suspect) = raised {
                self.search_widely(&days, k, suspect, &mut state, &mut run);
            }
        }
        let sampling = (!qualities.is_empty()).then_some(Sampling {
            sampler: SamplerKind::Independence,
            proposals: self.config.proposals,
            chains: CHAINS,
            days: qualities,
            adaptive: None,
            last,
        });
        (run, sampling)
    }

    /// Samples one day with this prior of the bearings; `k` selects the random stream.
    fn sample(&self, day: &Day, k: usize, walk: &BearingWalk) -> Option<SampledDay> {
        let days = [day];
        let target = Marginal::new(&days, self.unbalance_kg_m.len(), &walk.prior(), None)?;
        let drawn = self.draw(&target, k as u64)?;
        let bearings = drawn.bearings();
        let (given, _) = target.given(bearings.logs.clone())?;
        let middle =
            PosteriorSample { logs: given.logs, unbalance_kg_m: given.unbalance_kg_m.as_slice().to_vec() };
        let mut estimate = self.estimate(day, &middle.logs, middle.unbalance_kg_m.clone())?;
        let unbalance_sd_kg_m = unbalance_sd_kg_m(&estimate, &drawn.samples);
        let with_weights = |s: PosteriorSample| s.with_weights(&day.weights_kg_m);
        let samples: Vec<PosteriorSample> = drawn.samples.into_iter().map(with_weights).collect();
        estimate.spread = Some(spread(&with_weights(middle), &samples));
        Some(SampledDay { estimate, bearings, unbalance_sd_kg_m, quality: drawn.quality, samples })
    }

    fn draw(&self, target: &Marginal, stream: u64) -> Option<PosteriorSamples> {
        let seed = self.config.seed.wrapping_mul(0x9e37_79b9).wrapping_add(stream);
        draw(target, self.config.proposals, seed)
    }

    /// The second loop, on the readings up to day `k` that raised a flag.
    fn search_widely(
        &self,
        days: &[&Day],
        k: usize,
        suspect: usize,
        state: &mut DailyState,
        run: &mut TrackedRecord,
    ) {
        let persistence = self.config.thresholds.persistence.max(1);
        let streak = &days[k + 1 - persistence..=k];
        let begun = state.watched.len() - streak.len();
        let now = state.watched[begun..].to_vec();
        let jump = self.jump(streak, &state.logs, &state.detector, &now);
        let cause = match jump {
            Jump::Explains(free) => {
                self.go_on(free, state);
                FlagCause::Unbalance
            }
            jump => {
                let known = if let Jump::Helps(free) = &jump { free } else { &now };
                let found = self.widely(streak, state, run);
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
                    state.walk = BearingWalk::around(identified, &self.numbers, self.ranges());
                    self.go_on(after, state);
                    let again = |i: usize| Some(self.sample(days[i], i, &state.walk)?.estimate);
                    let again: Option<Vec<ReadingEstimate>> = (k + 1 - persistence..=k).map(again).collect();
                    run.estimates.truncate(run.estimates.len() - persistence);
                    run.estimates.extend(again.unwrap_or_default());
                    FlagCause::Model
                } else {
                    now.iter().for_each(|e| state.detector.residuals.accept(&e.residual));
                    if let Jump::Helps(_) = jump { FlagCause::Unbalance } else { FlagCause::Model }
                }
            }
        };
        run.flags.push(self.flag(&now, suspect, cause));
    }

    /// Continues from these estimates instead of the last ones.
    fn go_on(&self, estimates: Vec<ReadingEstimate>, state: &mut DailyState) {
        state.watched.truncate(state.watched.len() - estimates.len());
        state.watched.extend(estimates);
        state.detector.reset();
    }

    /// Bearings identified from a streak with the wide prior, and phase II of the streak on them.
    fn widely(
        &self,
        streak: &[&Day],
        state: &DailyState,
        run: &TrackedRecord,
    ) -> Option<(BearingGaussian, Vec<ReadingEstimate>)> {
        let sds = DVector::from_iterator(self.numbers.len(), self.numbers.iter().map(|n| n.law.prior_sd));
        let covariance = DMatrix::from_diagonal(&sds.component_mul(&sds));
        let before = BearingGaussian { covariance, logs: state.logs.clone() };
        let (held, _) = self.held(&run.estimates, streak[0]);
        let held: Vec<(C, f64)> = held.into_iter().zip(state.unbalance_sd_kg_m.iter().copied()).collect();
        let target = Marginal::new(streak, held.len(), &before, Some(&held))?;
        let stream = 1_000_000 + run.flags.len() as u64;
        let identified = self.draw(&target, stream)?.bearings();
        let (given, _) = target.given(identified.logs.clone())?;
        let unbalance_kg_m = given.unbalance_kg_m.as_slice().to_vec();
        let after = self.restart(streak, &identified.logs, unbalance_kg_m)?;
        Some((identified, after))
    }
}

/// Standard deviation of each plane's unbalance in each direction, kg·m.
fn unbalance_sd_kg_m(estimate: &ReadingEstimate, samples: &[PosteriorSample]) -> Vec<f64> {
    let of = |(j, u): (usize, &C)| {
        let squares: f64 = samples.iter().map(|s| (s.unbalance_kg_m[j] - u).norm_sqr()).sum();
        (0.5 * squares / samples.len() as f64).sqrt()
    };
    estimate.unbalance_kg_m.iter().enumerate().map(of).collect()
}

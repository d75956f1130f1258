//! Method 3: Bayesian updating in two loops.
//!
//! Each day a Metropolis sampler moves through bearings and unbalance, from yesterday's mean on: the prior
//! is uniform, in the range that bearings wander in around what was last identified, and as far as the
//! unbalance may grow; the likelihood falls exponentially with the residual, `exp(−Σ|rᵢ|/bᵢ)`, with
//! `bᵢ = σᵢ/√2` so that it has the noise's standard deviation. The day's mean carries on.
//!
//! When the residual jumps by more than 30 % and stays, a second loop walks through the whole range with a
//! step that adapts to its acceptance, on the readings that raised the flag.
//!
//! Coordinates are the logarithms of the bearings, in units of the daily range, and the deviation of the
//! unbalance from its best for these bearings, in its own standard deviations. The density is the same,
//! and a step of one size fits all of them.
//!
//! Eight numbers a day for twelve unknowns: four directions are as wide as the prior, and where the mean
//! lies along them is as much the prior's and the short chain's doing as the data's. A range that moved
//! with the mean would let the unbalance drift away without a limit, at a residual as low as ever; so it
//! stays where the bearings were identified. The interval of a day says how wide the directions are.

use nalgebra::{Complex, DMatrix, DVector};
use rand::SeedableRng;
use rand::rngs::StdRng;
use rayon::prelude::*;

use super::adaptive::Jump;
use super::chains::{Chain, Proposal, Quality, Sampler, mean, quality};
use super::daily::{Run, Tracking, WANDER, Watch};
use super::record::Day;
use super::spot::Logs;
use super::{Cause, Estimate, Interval, Reidentified, Spread};
use crate::fit::hypothesis::{COEFFICIENTS, coefficient};

type C = Complex<f64>;

/// Independent chains a day.
const CHAINS: usize = 4;
/// Size of the bearings' coordinates.
const UNIT: f64 = 0.1;
/// Range of the second loop around the start, as phase I's.
const WIDE: f64 = 0.916_290_731_874_155;
/// Rounds of the second loop, each of this many times the proposals of a day; the last one counts.
const ROUNDS: usize = 12;
const LONGER: usize = 5;
/// A chain begins inside its bounds, at most at this share of the way to them.
const INSIDE: f64 = 0.9;
/// Every so many days the other sampler has a go at the same target.
const COMPARED_EVERY: usize = 10;

/// What the sampling was worth.
#[derive(Debug, Clone)]
pub struct Sampling {
    /// Proposals of each chain and day.
    pub proposals: usize,
    /// Chains a day.
    pub chains: usize,
    /// Median over days, of the paper's sampler and of adaptive Metropolis on the same days.
    pub quality: [Quality; 2],
    /// Samples of the last day: what the histograms show.
    pub last: Vec<Sample>,
}

/// One sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Logarithms of the bearing coefficients.
    pub logs: Logs,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: Vec<C>,
}

/// The posterior of some readings with common bearings and unbalance.
struct Target<'a> {
    days: &'a [&'a Day],
    centre: &'a Logs,
    /// Size of the first coordinates.
    unit: f64,
    /// Lowest and highest logarithm.
    range: [Logs; 2],
    /// Where each plane's unbalance was, and how far from there it may be, kg·m.
    around: Vec<(C, f64)>,
    /// What one standard deviation of the unbalance is at the centre.
    spread: DMatrix<f64>,
}

impl Target<'_> {
    /// The best unbalance for these bearings, by weighted least squares, real parts and imaginary parts in
    /// turn, and the normal matrix.
    fn best(&self, logs: &Logs) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let planes = self.around.len();
        let (mut normal, mut right) = (DMatrix::zeros(2 * planes, 2 * planes), DVector::zeros(2 * planes));
        for day in self.days {
            let motion = day.spot.on(logs)?;
            let count = day.measured_m.len();
            for (p, y) in day.measured_m.iter().enumerate() {
                let Some(y) = y else { continue };
                let weight = day.sigma_m[p].powi(-2);
                let left = y - motion.probes[planes * count + p];
                for i in 0..planes {
                    let hi = motion.probes[i * count + p].conj() * weight;
                    let r = hi * left;
                    right[2 * i] += r.re;
                    right[2 * i + 1] += r.im;
                    for j in 0..planes {
                        let n = hi * motion.probes[j * count + p];
                        normal[(2 * i, 2 * j)] += n.re;
                        normal[(2 * i + 1, 2 * j + 1)] += n.re;
                        normal[(2 * i, 2 * j + 1)] -= n.im;
                        normal[(2 * i + 1, 2 * j)] += n.im;
                    }
                }
            }
        }
        let best = normal.clone().cholesky()?.solve(&right);
        Some((best, normal))
    }

    /// Sets the spread of the unbalance at the centre.
    fn prepared(mut self) -> Option<Self> {
        let (_, normal) = self.best(self.centre)?;
        self.spread = normal.cholesky()?.l().try_inverse()?.transpose();
        Some(self)
    }

    /// Where a chain begins: on these bearings, with the best unbalance for them that is within reach. On the
    /// day of an event the best one is not, and a chain begun there would never find a place that is allowed.
    fn start(&self, bearings: [f64; COEFFICIENTS]) -> Option<DVector<f64>> {
        let logs = std::array::from_fn(|i| self.centre[i] + self.unit * bearings[i]);
        let (best, _) = self.best(&logs)?;
        let mut back = DVector::zeros(best.len());
        for (j, (was, reach)) in self.around.iter().enumerate() {
            let away = C::new(best[2 * j], best[2 * j + 1]) - was;
            let excess = away * (1.0 - INSIDE * reach / away.norm()).max(0.0);
            (back[2 * j], back[2 * j + 1]) = (-excess.re, -excess.im);
        }
        let unbalance = self.spread.clone().lu().solve(&back)?;
        let all = bearings.iter().chain(&unbalance).copied();
        Some(DVector::from_iterator(bearings.len() + best.len(), all))
    }

    fn sample(&self, x: &DVector<f64>) -> Option<Sample> {
        let logs: Logs = std::array::from_fn(|i| self.centre[i] + self.unit * x[i]);
        let inside = (0..COEFFICIENTS).all(|i| (self.range[0][i]..=self.range[1][i]).contains(&logs[i]));
        let (best, _) = inside.then(|| self.best(&logs))??;
        let u = best + &self.spread * x.rows(COEFFICIENTS, x.len() - COEFFICIENTS);
        let unbalance_kg_m: Vec<C> = u.as_slice().chunks(2).map(|p| C::new(p[0], p[1])).collect();
        let near = |(u, (was, reach)): (&C, &(C, f64))| (u - was).norm() <= *reach;
        let allowed = unbalance_kg_m.iter().zip(&self.around).all(near);
        allowed.then_some(Sample { logs, unbalance_kg_m })
    }

    fn log_density(&self, x: &DVector<f64>) -> f64 {
        let misfit = |s: Sample| {
            let mut sum = 0.0;
            for day in self.days {
                let shown = day.spot.on(&s.logs)?.at(&s.unbalance_kg_m);
                for ((y, m), sigma_m) in shown.iter().zip(&day.measured_m).zip(&day.sigma_m) {
                    sum += m.map_or(0.0, |m| (y - m).l1_norm()) * std::f64::consts::SQRT_2 / sigma_m;
                }
            }
            Some(-sum)
        };
        self.sample(x).and_then(misfit).unwrap_or(f64::NEG_INFINITY)
    }

    fn chains(&self, sampler: &Sampler, starts: &[DVector<f64>], proposals: usize, seed: u64) -> Vec<Chain> {
        let one = |(k, start): (usize, &DVector<f64>)| {
            let mut random = StdRng::seed_from_u64(seed.wrapping_mul(0x9e37_79b9).wrapping_add(k as u64));
            sampler.chain(start, proposals, &mut random, &mut |x| self.log_density(x))
        };
        starts.par_iter().enumerate().map(one).collect()
    }

    /// Mean of the samples in their own coordinates, and where they lie.
    fn sum_up(&self, chains: &[Chain]) -> Option<(Sample, Spread, Vec<Sample>)> {
        let all: Vec<Sample> =
            chains.iter().flat_map(|c| &c.samples).filter_map(|x| self.sample(x)).collect();
        let centre = self.sample(&mean(chains))?;
        let interval = |value: &dyn Fn(&Sample) -> f64| {
            let mut values: Vec<f64> = all.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
            Interval { low: at(0.025), high: at(0.975) }
        };
        let planes = centre.unbalance_kg_m.len();
        let spread = Spread {
            logs: std::array::from_fn(|i| interval(&|s| s.logs[i])),
            magnitude_kg_m: (0..planes).map(|j| interval(&|s| s.unbalance_kg_m[j].norm())).collect(),
            angle_rad: (0..planes)
                .map(|j| {
                    let middle = centre.unbalance_kg_m[j];
                    let turned = interval(&|s| (s.unbalance_kg_m[j] * middle.conj()).arg());
                    Interval { low: middle.arg() + turned.low, high: middle.arg() + turned.high }
                })
                .collect(),
        };
        Some((centre, spread, all))
    }
}

/// What carries on from day to day.
struct State {
    /// What was last identified, and yesterday's mean.
    identified: Logs,
    logs: Logs,
    last: Vec<C>,
    last_d: f64,
    watch: Watch,
    sampler: Sampler,
}

impl State {
    /// Goes on from these estimates, in the place of those from `begun` on.
    fn go_on(&mut self, estimates: Vec<Estimate>, run: &mut Run, begun: usize) {
        if let Some(last) = estimates.last() {
            self.last.clone_from(&last.unbalance_kg_m);
        }
        run.estimates.truncate(begun);
        run.estimates.extend(estimates);
        self.watch.settle();
    }
}

impl Tracking<'_> {
    /// Daily sampling, and a wide search after every flag.
    pub fn bayes(&self, progress: &mut dyn FnMut(usize, usize)) -> (Run, Option<Sampling>) {
        let dimensions = COEFFICIENTS + 2 * self.unbalance_kg_m.len();
        let mut state = State {
            identified: self.logs,
            logs: self.logs,
            last: self.unbalance_kg_m.clone(),
            last_d: f64::NAN,
            watch: Watch::new(self.config),
            sampler: Sampler::new(Proposal::Metropolis, dimensions),
        };
        let mut other = Sampler::new(Proposal::AdaptiveMetropolis, dimensions);
        let mut run = Run::default();
        let (mut qualities, mut last) = ([Vec::new(), Vec::new()], Vec::new());
        let days: Vec<&Day> = self.complete().collect();
        for (k, day) in days.iter().enumerate() {
            progress(k + 1, days.len());
            let Some(target) = self.daily_target(&days[k..=k], &state) else { continue };
            let Some(start) = target.start([0.0; COEFFICIENTS]) else { continue };
            let starts = vec![start; CHAINS];
            let seed = self.config.seed.wrapping_add(k as u64);
            let chains = target.chains(&state.sampler, &starts, self.config.proposals, seed);
            let Some((centre, spread, samples)) = target.sum_up(&chains) else { continue };
            if k % COMPARED_EVERY == 0 {
                let beside = target.chains(&other, &starts, self.config.proposals, seed);
                other.learn(&beside);
                qualities[1].push(quality(&beside));
            }
            drop(target);
            qualities[0].push(quality(&chains));
            state.sampler.learn(&chains);
            let Some(mut estimate) = self.estimate(day, &centre.logs, centre.unbalance_kg_m) else {
                continue;
            };
            estimate.spread = Some(spread);
            let raised = state.watch.judge(&days[..=k], &mut estimate);
            if !estimate.suspicious {
                // a reading that looks wrong teaches nothing of the bearings
                state.logs = estimate.logs;
            }
            (state.last, state.last_d) = (estimate.unbalance_kg_m.clone(), day.time_d);
            run.estimates.push(estimate);
            last = samples;
            if let Some(suspect) = raised {
                self.search_widely(&days[..=k], suspect, &mut state, &mut run);
            }
        }
        let sampling = medians(&qualities).map(|quality| Sampling {
            proposals: self.config.proposals,
            chains: CHAINS,
            quality,
            last,
        });
        (run, sampling)
    }

    fn daily_target<'t>(&'t self, days: &'t [&'t Day], state: &'t State) -> Option<Target<'t>> {
        let last_d = if state.last_d.is_nan() { days[0].time_d } else { state.last_d };
        let range = [-WANDER, WANDER].map(|d| state.identified.map(|log| log + d));
        let around = self.around(days[0], &state.last, last_d);
        let spread = DMatrix::zeros(0, 0);
        Target { days, centre: &state.logs, unit: UNIT, range, around, spread }.prepared()
    }

    /// How far each plane's unbalance may be from what it was: it changes by no more than it may grow.
    fn around(&self, day: &Day, was: &[C], was_d: f64) -> Vec<(C, f64)> {
        let largest = self.largest_kg_m(day, was, was_d);
        was.iter().zip(largest).map(|(u, largest)| (*u, largest - u.norm())).collect()
    }

    /// The second loop, on the readings that raised a flag.
    fn search_widely(&self, days: &[&Day], suspect: usize, state: &mut State, run: &mut Run) {
        let persistence = self.config.thresholds.persistence.max(1);
        let streak = &days[days.len() - persistence..];
        let begun = run.estimates.len() - streak.len();
        let now = run.estimates[begun..].to_vec();
        let jump = self.jump(streak, &state.logs, &state.watch, &now);
        let found = match jump {
            Jump::Explains(_) => None,
            _ => self.widely(streak, suspect, state, run),
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
                    logs,
                });
                (state.identified, state.logs) = (logs, logs);
                state.go_on(after, run, begun);
                Cause::Model
            }
            (None, Jump::Explains(free)) => {
                state.go_on(free, run, begun);
                Cause::Unbalance
            }
            (None, jump) => {
                now.iter().for_each(|e| state.watch.monitor.accept(&e.residual));
                if let Jump::Helps(_) = jump { Cause::Unbalance } else { Cause::Model }
            }
        };
        run.flags.push(self.flag(&now, suspect, cause));
    }

    /// Bearings in the whole range that describe a streak, and its phase II on them.
    fn widely(
        &self,
        streak: &[&Day],
        suspect: usize,
        state: &State,
        run: &Run,
    ) -> Option<(Vec<Estimate>, Logs)> {
        let range = [-1.0, 1.0].map(|sign| std::array::from_fn(|i| self.logs[i] + sign * WIDE));
        let centre = std::array::from_fn(|i| state.logs[i].clamp(range[0][i], range[1][i]));
        let (held, held_d) = self.held(&run.estimates, streak[0]);
        let around = self.around(streak[0], &held, held_d);
        let spread = DMatrix::zeros(0, 0);
        let target = Target { days: streak, centre: &centre, unit: 0.25 * WIDE, range, around, spread };
        let target = target.prepared()?;
        let dimensions = COEFFICIENTS + 2 * self.unbalance_kg_m.len();
        let mut sampler = Sampler::new(Proposal::AdaptiveMetropolis, dimensions);
        let mut starts: Vec<DVector<f64>> =
            (0..CHAINS).filter_map(|k| target.start(spread_start(k, suspect))).collect();
        let mut chains = Vec::new();
        for round in 0..ROUNDS {
            let seed =
                self.config.seed.wrapping_add(1_000_000 + 1000 * run.flags.len() as u64 + round as u64);
            chains = target.chains(&sampler, &starts, LONGER * self.config.proposals, seed);
            sampler.learn(&chains);
            starts = chains.iter().filter_map(|c| c.samples.last().cloned()).collect();
        }
        // chains that found no better place than another found do not count
        let level = |c: &Chain| {
            c.samples.iter().map(|x| target.log_density(x)).sum::<f64>() / c.samples.len().max(1) as f64
        };
        let levels: Vec<f64> = chains.iter().map(level).collect();
        let highest = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let kept: Vec<Chain> = chains
            .iter()
            .zip(&levels)
            .filter(|(_, level)| highest - **level < dimensions as f64)
            .map(|(c, _)| c.clone())
            .collect();
        let (found, ..) = (!kept.is_empty()).then(|| target.sum_up(&kept))??;
        let mut last = (found.unbalance_kg_m.clone(), streak[0].time_d);
        let again = |day: &&Day| {
            let estimate = self.phase_two(day, &found.logs, Some((&last.0, last.1)))?;
            last = (estimate.unbalance_kg_m.clone(), day.time_d);
            Some(estimate)
        };
        let after = streak.iter().map(again).collect::<Option<Vec<Estimate>>>()?;
        Some((after, found.logs))
    }
}

/// Bearings on which a chain of the second loop begins: the suspect stiffer or softer, more or less damped.
fn spread_start(k: usize, suspect: usize) -> [f64; COEFFICIENTS] {
    std::array::from_fn(|i| {
        let (bearing, _, damping) = coefficient(i);
        let up = if damping { k & 1 == 0 } else { k & 2 == 0 };
        let size = if up { 1.0 } else { -1.0 };
        if bearing == suspect { size } else { 0.0 }
    })
}

fn medians(qualities: &[Vec<Quality>; 2]) -> Option<[Quality; 2]> {
    let median = |all: &[Quality], value: &dyn Fn(&Quality) -> f64| {
        let mut values: Vec<f64> = all.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let one = |all: &[Quality]| {
        Some(Quality {
            acceptance: median(all, &|q| q.acceptance)?,
            effective: median(all, &|q| q.effective)?,
            r_hat: median(all, &|q| q.r_hat)?,
        })
    };
    Some([one(&qualities[0])?, one(&qualities[1])?])
}

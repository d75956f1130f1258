//! Phase I once, then phase II daily.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use super::answer::{Config, Flag, FlagCause, Method, ReadingEstimate, Reidentified};
use super::coefficients::{FollowedNumber, Logs, followed, logs_of};
use super::conditions::{self, Covariate};
use super::detector::{ReadingResidual, ResidualDetector};
use super::faults;
use super::record::{self, Day};
use super::step::Steps;
use crate::error::{Error, TrackError};
use crate::identify::{
    BearingParameter, PhaseOne, PhaseOneConfig, UnbalanceBounds, beside_runup, identify, least_residual,
};
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;
use crate::unbalance::phasor_kg_m;

type C = Complex<f64>;

/// Readings that the start is checked with, and that a search over all days begins from.
const FIRST_READINGS: usize = 3;
/// Largest deviation of a bearing coefficient's logarithm from its identified value: hydrodynamic bearings change
/// by a quarter with load and temperature. Of a number that is known better than a coefficient it is that much less.
pub const WALK_RANGE: f64 = 0.25;
/// Samples drawn from that range.
const WALK_DRAWS: usize = 200;
/// A plane with next to no unbalance could never grow: the bound never falls below this share of the
/// larger plane's start.
const BOUND_FLOOR: f64 = 0.1;

/// A record with its identified start and its configuration.
pub struct Tracking<'a> {
    pub rotor: &'a Rotor,
    pub config: &'a Config,
    pub noise: Noise,
    /// Readings with at least one value.
    pub days: Vec<Day>,
    pub covariates: Vec<Covariate>,
    pub phase_one: Option<PhaseOne>,
    pub remarks: Vec<String>,
    pub bearing_of: Vec<usize>,
    /// The numbers of the bearings that are followed.
    pub numbers: Arc<[FollowedNumber]>,
    /// Their identified logarithms.
    pub logs: Logs,
    /// Covariance of that after phase I; zero if the file was identified.
    pub logs_covariance: DMatrix<f64>,
    pub unbalance_kg_m: Vec<C>,
    bounds: UnbalanceBounds,
}

/// Result of one method over a record.
#[derive(Debug, Clone, Default)]
pub struct TrackedRecord {
    pub estimates: Vec<ReadingEstimate>,
    pub flags: Vec<Flag>,
    pub reidentified: Vec<Reidentified>,
}

impl<'a> Tracking<'a> {
    /// Checks the record and identifies the start.
    pub fn begin(
        rotor: &'a Rotor,
        record: &[Reading],
        runup: &[Reading],
        config: &'a Config,
    ) -> Result<Self, Error> {
        let mut remarks = faults::remarks(rotor, record)?;
        let noise = Noise::of(rotor, record);
        let phase_one = match config.identified {
            true => None,
            false => Some(start(rotor, record, runup, config)?),
        };
        let identified = phase_one.as_ref().map_or(rotor, |found| &found.rotor);
        let phasor = |p: &crate::machine::drawing::Plane| {
            let unknown = || TrackError::PlaneNotIdentified { plane: p.name.clone() };
            let magnitude = p.unbalance_g_mm.ok_or_else(unknown)?;
            Ok(phasor_kg_m(magnitude, p.angle_deg.unwrap_or(0.0)))
        };
        let unbalance_kg_m = identified.plane.iter().map(phasor).collect::<Result<Vec<C>, Error>>()?;
        let largest = unbalance_kg_m.iter().map(|u| u.norm()).fold(f64::MIN_POSITIVE, f64::max);
        let logs = logs_of(identified);
        let numbers: Arc<[FollowedNumber]> = followed(rotor).into();
        let mut days = record::days(identified, &noise, record)?;
        let mut covariates = Vec::new();
        if config.method == Method::Joint {
            let (used, unused) = conditions::covariates(&config.conditions, record, &mut days);
            remarks.extend(unused);
            covariates = used;
        }
        let tracking = Self {
            days,
            covariates,
            logs_covariance: phase_one.as_ref().map_or_else(
                || DMatrix::zeros(logs.len(), logs.len()),
                |found| covariance_of(rotor, found, &numbers),
            ),
            numbers,
            logs,
            bearing_of: rotor.probe.iter().map(|p| rotor.bearing_of(p).unwrap_or(0)).collect(),
            bounds: UnbalanceBounds { growth: config.growth, floor_kg_m: BOUND_FLOOR * largest },
            rotor,
            config,
            noise,
            phase_one,
            remarks,
            unbalance_kg_m,
        };
        tracking.check_planes()?;
        tracking.check_start(runup)?;
        Ok(tracking)
    }

    /// Checks that phase I saw one machine in one state: its bearings describe all its readings, and the first days
    /// are within the bearings' usual range around those of the run-up.
    fn check_start(&self, runup: &[Reading]) -> Result<(), Error> {
        let Some(found) = &self.phase_one else { return Ok(()) };
        let mut ratio = found.residual_ratio;
        let mut limit = self.config.thresholds.ratio_limit;
        if ratio <= limit && !runup.is_empty() {
            let logs = logs_of(&identify(self.rotor, runup, &phase_one_config(self.config))?.rotor);
            let first: Vec<&Day> = self.complete().take(FIRST_READINGS).collect();
            let free = |day: &&&Day| Some(self.phase_two(day, &logs, None)?.residual.ratio());
            ratio = first.iter().filter_map(|day| free(&day)).fold(f64::INFINITY, f64::min);
            limit = self.largest_ratio_in_range(first[0], &logs).max(self.config.thresholds.ratio_floor);
        }
        if ratio <= limit {
            return Ok(());
        }
        Err(TrackError::FirstDaysUnexplained { residual_ratio: ratio, limit }.into())
    }

    /// Largest residual over feature sum of a day with bearings drawn from their usual range.
    fn largest_ratio_in_range(&self, day: &Day, logs: &[f64]) -> f64 {
        let mut random = StdRng::seed_from_u64(self.config.seed);
        let mut largest = 0.0_f64;
        for _ in 0..WALK_DRAWS {
            let elsewhere: Logs =
                logs.iter().zip(&self.ranges()).map(|(log, r)| log + random.random_range(-r..*r)).collect();
            let Some(motion) = day.point.on(&elsewhere) else { continue };
            let shown = motion.at(&self.unbalance_kg_m).into_iter().map(Some).collect();
            let drawn = Day { measured_m: shown, ..day.clone() };
            largest = largest.max(self.phase_two(&drawn, logs, None).map_or(0.0, |e| e.residual.ratio()));
        }
        largest
    }

    /// Usual range of each logarithm around its identified value.
    pub fn ranges(&self) -> Vec<f64> {
        self.numbers.iter().map(|n| WALK_RANGE * n.width()).collect()
    }

    /// Readings without a lost probe.
    pub fn complete(&self) -> impl Iterator<Item = &Day> {
        self.days.iter().filter(|d| d.is_complete())
    }

    /// A reading with this unbalance on these bearings.
    pub fn estimate(&self, day: &Day, logs: &[f64], unbalance_kg_m: Vec<C>) -> Option<ReadingEstimate> {
        estimate(day, &self.bearing_of, logs, unbalance_kg_m)
    }

    /// Adds the known weights of each reading's run to its estimated unbalance.
    pub fn with_weights(&self, mut estimates: Vec<ReadingEstimate>) -> Vec<ReadingEstimate> {
        for estimate in &mut estimates {
            let day = self.days.binary_search_by_key(&estimate.row, |day| day.row).ok();
            let weights = day.iter().flat_map(|k| &self.days[*k].weights_kg_m);
            estimate.unbalance_kg_m.iter_mut().zip(weights).for_each(|(u, weight)| *u += weight);
        }
        estimates
    }

    /// Bound on each plane's unbalance, kg·m, from its last value.
    pub fn largest_kg_m(&self, day: &Day, last: &[C], at_d: f64) -> Vec<f64> {
        // the bound is for a day; a gap gives the unbalance that much longer to grow
        let growth = self.bounds.growth.powf((day.time_d - at_d).max(1.0));
        last.iter().map(|u| UnbalanceBounds { growth, ..self.bounds }.largest(*u)).collect()
    }

    /// Phase II: the exact optimum of a complete reading; unbounded without a last unbalance.
    pub fn phase_two(&self, day: &Day, logs: &[f64], last: Option<(&[C], f64)>) -> Option<ReadingEstimate> {
        let planes = self.rotor.plane.len();
        let largest: Vec<f64> = match last {
            Some((last, at_d)) => self.largest_kg_m(day, last, at_d),
            None => vec![f64::INFINITY; planes],
        };
        let response = day.point.on(logs)?.influence();
        let best = least_residual(&response, &DVector::from_vec(day.all_m()), &largest).ok()?;
        self.estimate(day, logs, best.unbalance_kg_m.iter().copied().collect())
    }

    /// Phase II of a streak on these bearings, from this unbalance on.
    pub fn restart(
        &self,
        streak: &[&Day],
        logs: &[f64],
        unbalance_kg_m: Vec<C>,
    ) -> Option<Vec<ReadingEstimate>> {
        let mut last = (unbalance_kg_m, streak.first()?.time_d);
        let one = |day: &&Day| {
            let estimate = self.phase_two(day, logs, Some((&last.0, last.1)))?;
            last = (estimate.unbalance_kg_m.clone(), day.time_d);
            Some(estimate)
        };
        streak.iter().map(one).collect()
    }

    /// Method 1: the bearings are constant.
    pub fn fixed(&self, progress: &mut dyn FnMut(usize, usize)) -> TrackedRecord {
        let mut run = TrackedRecord::default();
        let mut detector = EventDetector::new(self.config);
        let mut last = (self.unbalance_kg_m.clone(), f64::NAN);
        let days: Vec<&Day> = self.complete().collect();
        for (k, day) in days.iter().enumerate() {
            let at_d = if last.1.is_nan() { day.time_d } else { last.1 };
            let Some(mut estimate) = self.phase_two(day, &self.logs, Some((&last.0, at_d))) else { continue };
            last = (estimate.unbalance_kg_m.clone(), day.time_d);
            let raised = detector.evaluate(&days[..=k], &mut estimate);
            run.estimates.push(estimate);
            if let Some(suspect) = raised {
                run.flags.push(self.flag(&run.estimates, suspect, FlagCause::Model));
            }
            progress(k + 1, days.len());
        }
        run
    }

    /// Flag raised by the last of these estimates.
    pub fn flag(&self, estimates: &[ReadingEstimate], suspect: usize, cause: FlagCause) -> Flag {
        let persistence = self.config.thresholds.persistence.max(1);
        let first = estimates.len().saturating_sub(persistence);
        let (since_d, time_d) = (estimates[first].time_d, estimates[estimates.len() - 1].time_d);
        Flag { since_d, time_d, suspect, cause }
    }
}

/// A reading with this unbalance on these bearings; `bearing_of` is the bearing number of each probe.
pub fn estimate(
    day: &Day,
    bearing_of: &[usize],
    logs: &[f64],
    unbalance_kg_m: Vec<C>,
) -> Option<ReadingEstimate> {
    let calculated_m = day.point.on(logs)?.at(&unbalance_kg_m);
    Some(ReadingEstimate {
        row: day.row,
        time_d: day.time_d,
        logs: logs.to_vec(),
        residual: ReadingResidual::new(&calculated_m, &day.measured_m, bearing_of),
        calculated_m,
        unbalance_kg_m,
        spread: None,
        suspicious: false,
        flagged: false,
    })
}

/// Raises a flag when the residual stays high and the features stepped.
#[derive(Debug, Clone)]
pub struct EventDetector {
    pub residuals: ResidualDetector,
    steps: Steps,
    persistence: usize,
    ratio_limit: f64,
    up: bool,
}

impl EventDetector {
    pub fn new(config: &Config) -> Self {
        Self {
            residuals: ResidualDetector::new(config.thresholds),
            steps: Steps::default(),
            persistence: config.thresholds.persistence.max(1),
            ratio_limit: config.thresholds.ratio_limit,
            up: false,
        }
    }

    /// Evaluates the last of these readings and marks its estimate; returns the suspect bearing if it raises a flag.
    pub fn evaluate(&mut self, days: &[&Day], estimate: &mut ReadingEstimate) -> Option<usize> {
        let result = self.residuals.evaluate(&estimate.residual);
        if !result.suspicious {
            self.up = false;
        }
        // before there is a past to compare with, only the ratio counts
        let stepped = || {
            let beyond = estimate.residual.ratio() > self.ratio_limit;
            self.steps.stepped(days, self.persistence).unwrap_or(beyond)
        };
        let raised = result.lasting && !self.up && stepped();
        self.steps.learn(days[days.len() - 1]);
        self.up |= raised;
        (estimate.suspicious, estimate.flagged) = (result.suspicious, self.up);
        raised.then_some(result.suspect)
    }

    /// Resets the streak after the cause of a flag was handled.
    pub fn reset(&mut self) {
        self.residuals.reset();
        self.up = false;
    }
}

/// Phase I on the first complete reading and the run-up. The bearings change from day to day: if further days were
/// pooled with the first, the covariance would be too small.
fn start(rotor: &Rotor, record: &[Reading], runup: &[Reading], config: &Config) -> Result<PhaseOne, Error> {
    let first = record.iter().filter(|r| r.complete().is_some()).take(match config.method {
        // the search over all days only begins here
        Method::Joint => FIRST_READINGS,
        _ => 1,
    });
    identify(rotor, &beside_runup(rotor, first, runup), &phase_one_config(config))
}

/// Covariance of these numbers after phase I.
fn covariance_of(rotor: &Rotor, found: &PhaseOne, numbers: &[FollowedNumber]) -> DMatrix<f64> {
    let all = found.bearings_covariance();
    let is_it = |n: &FollowedNumber, p: &BearingParameter| {
        p.bearing == rotor.bearing[n.bearing].name && p.symbol == n.law.symbol
    };
    let place = |n: &FollowedNumber| found.bearings.iter().position(|p| is_it(n, p));
    let places: Vec<Option<usize>> = numbers.iter().map(place).collect();
    let of = |i: usize, j: usize| Some(all[(places[i]?, places[j]?)]);
    DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| of(i, j).unwrap_or(0.0))
}

fn phase_one_config(config: &Config) -> PhaseOneConfig {
    PhaseOneConfig { seed: config.seed, ..PhaseOneConfig::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::testing::sample_rotor;
    use crate::track::answer::Method;
    use crate::units::rad_s;
    use rand_distr::StandardNormal;

    const NOISE: Noise =
        Noise { relative: 0.02, floor_um: 0.03, scale: None, correlation: None, between_runs: None };
    /// χ² of four numbers stays below this with 95 %.
    const CIRCLE: f64 = 9.488;

    /// A run-up and three days of a machine whose bearings wander by a tenth after the first, and its unbalance.
    fn begun(seed: u64) -> (Vec<Reading>, Vec<Reading>, Vec<C>) {
        let mut random = StdRng::seed_from_u64(seed);
        let mut normal = move || random.sample::<f64, _>(StandardNormal);
        let true_kg_m: Vec<C> = (0..2).map(|_| C::from_polar(4e-4, 3.0 * normal())).collect();
        let offsets: Logs = (0..8).map(|_| 0.15 * normal()).collect();
        let mut read = |speeds_rpm: &[f64], day: f64, walk: [f64; 2]| -> Vec<Reading> {
            let mut rotor = sample_rotor();
            for (n, offset) in followed(&rotor).iter().zip(&offsets) {
                let constants = rotor.bearing[n.bearing].constants_mut().unwrap();
                let (of, by) = match n.is_damping() {
                    true => (&mut constants.damping_n_s_m, -1.1 * walk[n.bearing]),
                    false => (&mut constants.stiffness_n_m, walk[n.bearing]),
                };
                *(if n.law.symbol.ends_with("xx") { &mut of.xx } else { &mut of.yy }) *= (offset + by).exp();
            }
            let model = Model::finite_elements(&rotor);
            let mut one = |speed_rpm: &f64| {
                let shown =
                    model.response(rad_s(*speed_rpm)).unwrap().at(&DVector::from_vec(true_kg_m.clone()));
                let mut noisy = |y: &C| {
                    let sd_m = NOISE.sigma_m(*y);
                    Some(y + C::new(normal(), normal()) * sd_m)
                };
                let probes = shown.iter().map(&mut noisy).collect();
                Reading { time_d: Some(day), speed_rpm: *speed_rpm, probes, ..Reading::default() }
            };
            speeds_rpm.iter().map(&mut one).collect()
        };
        let speeds_rpm: Vec<f64> = (0..20).map(|k| 1500.0 + 500.0 * f64::from(k)).collect();
        let runup = read(&speeds_rpm, 0.0, [0.0; 2]);
        let walk = [[0.0, 0.0], [0.06, -0.05], [0.1, -0.09]];
        let days = walk.iter().enumerate().flat_map(|(day, w)| read(&[11_000.0], day as f64, *w)).collect();
        (days, runup, true_kg_m)
    }

    #[test]
    fn start_95_percent_circle_holds_with_walking_bearings() {
        let rotor = Rotor { noise: Some(NOISE), ..sample_rotor() };
        let held = |seed: u64, method: Method| {
            let (days, runup, true_kg_m) = begun(seed);
            let found = start(&rotor, &days, &runup, &Config::new(method)).unwrap();
            let off = found.unbalance_kg_m.iter().zip(&true_kg_m).flat_map(|(u, t)| [(u - t).re, (u - t).im]);
            let off = DVector::from_iterator(4, off);
            off.dot(&(found.unbalance_covariance().try_inverse().unwrap() * &off)) < CIRCLE
        };
        let found = (0..40).filter(|seed| held(*seed, Method::Fixed)).count();
        // 38 of 40 on average; fewer than 34 have a chance of 1:70
        assert!(found >= 34, "{found} of 40");
    }
}

//! The unbalance of a long record, while the machine's bearings change.
//!
//! | method | what it does |
//! |---|---|
//! | [`Method::Fixed`] | phase I once, phase II daily, bearings constant |
//! | [`Method::Adaptive`] | bearings identified anew when the residual jumps and stays (Machines 2023, 11, 976) |
//! | [`Method::Bayes`] | bearings and unbalance sampled daily, and widely after a jump (Sensors 2024, 24, 8123) |
//! | [`Method::Joint`] | all days together: bearings that wander, unbalance that drifts and jumps |
//!
//! | module | holds |
//! |---|---|
//! | `record`, `spot` | readings, each with the machine solved at its speed |
//! | [`monitor`], `step` | residual and level; an event or a wander |
//! | `daily` | phase I, phase II, and the two methods that are made of them |
//! | `cases`, `adaptive` | the four cases of a re-identification |
//! | `chains`, `bayes` | samplers and their quality; the two loops |
//! | `joint` | all days together |

mod adaptive;
mod bayes;
mod cases;
mod chains;
mod coefficients;
mod daily;
mod joint;
pub mod monitor;
mod posterior;
mod record;
mod spot;
mod step;

use nalgebra::Complex;

pub use bayes::Sampling;
pub use cases::CaseFit;
pub use chains::Quality;
pub use joint::{Constant, Event, Joint, Later, Scope};
pub use monitor::{Residual, Thresholds};
pub use posterior::Sample;
pub use spot::Logs;

use crate::error::Error;
use crate::identify::PhaseOne;
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;
use crate::track::coefficients::COEFFICIENTS;
use daily::Tracking;

type C = Complex<f64>;

/// How the record is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Bearings constant.
    Fixed,
    /// Re-identification after a jump of the residual.
    Adaptive,
    /// Metropolis sampling, daily and after a jump.
    Bayes,
    /// All days together.
    Joint,
}

/// Settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// How the record is followed.
    pub method: Method,
    /// When a reading is suspicious, and when that is a flag.
    pub thresholds: Thresholds,
    /// Largest unbalance of a plane relative to the day before.
    pub growth: f64,
    /// The file's bearings and planes are identified already: no phase I.
    pub identified: bool,
    /// Proposals of each chain of a day.
    pub proposals: usize,
    /// Seed of everything random.
    pub seed: u64,
}

impl Config {
    /// The usual settings of a method.
    pub fn new(method: Method) -> Self {
        let rise = if method == Method::Bayes { 0.3 } else { 0.5 };
        let thresholds = Thresholds { rise, ..Thresholds::default() };
        Self { method, thresholds, growth: 1.2, identified: false, proposals: 200, seed: 1 }
    }
}

/// What is said of one reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Row of the record.
    pub row: usize,
    /// Days since the record began.
    pub time_d: f64,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: Vec<C>,
    /// Logarithms of the bearing coefficients, in the order of phase I.
    pub logs: Logs,
    /// What the model shows with both, m.
    pub calculated_m: Vec<C>,
    /// That against what was measured.
    pub residual: Residual,
    /// Where the truth is with 95 % probability, of methods that say so.
    pub spread: Option<Spread>,
    /// The reading alone looked wrong.
    pub suspicious: bool,
    /// The model no longer describes the machine.
    pub flagged: bool,
}

/// Ends of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Intervals of one reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Logarithms of the bearing coefficients.
    pub logs: [Interval; COEFFICIENTS],
    /// Magnitude of each plane's unbalance, kg·m.
    pub magnitude_kg_m: Vec<Interval>,
    /// Its angle, rad, around the estimate's.
    pub angle_rad: Vec<Interval>,
}

/// What a flag turned out to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The model stopped describing the machine.
    Model,
    /// The unbalance jumped, by more than phase II may follow in a day; the model still holds.
    Unbalance,
}

/// A streak of suspicious readings that was long enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flag {
    /// First reading of the streak, days.
    pub since_d: f64,
    /// Reading at which the flag went up, days.
    pub time_d: f64,
    /// The bearing whose probes misfit most.
    pub suspect: usize,
    /// What it turned out to be.
    pub cause: Cause,
}

/// Bearings that were identified anew.
#[derive(Debug, Clone, PartialEq)]
pub struct Reidentified {
    /// First day of the new bearings.
    pub since_d: f64,
    /// Day on which they were found.
    pub time_d: f64,
    /// The case that was taken, 1 to 4; 0 where the method knows no cases.
    pub case: u8,
    /// The suspect bearing.
    pub bearing: usize,
    /// All four cases.
    pub cases: Vec<CaseFit>,
    /// Logarithms of the new coefficients.
    pub logs: Logs,
}

/// A record followed.
#[derive(Debug, Clone)]
pub struct Track {
    /// What was done.
    pub method: Method,
    /// Phase I, unless the file was identified.
    pub phase_one: Option<PhaseOne>,
    /// One for each reading that could be used.
    pub estimates: Vec<Estimate>,
    /// Flags in order.
    pub flags: Vec<Flag>,
    /// Re-identifications in order.
    pub reidentified: Vec<Reidentified>,
    /// First day of bearings that were identified anew without a run-up since: near one speed an effect that
    /// the file lacks reads as other bearings, and no interval knows of that.
    pub undiagnosed_since_d: Option<f64>,
    /// The same readings with bearings constant: what every method is measured by.
    pub fixed: Vec<Estimate>,
    /// First day on which the constant bearings failed for good, if they did.
    pub event_d: Option<f64>,
    /// What the sampling was worth, of [`Method::Bayes`].
    pub sampling: Option<Sampling>,
    /// What was learned beside, of [`Method::Joint`].
    pub joint: Option<Joint>,
    /// What is odd in the record, one sentence each.
    pub remarks: Vec<String>,
}

impl Track {
    /// Mean residual of these estimates from a day on, µm.
    fn mean_um(estimates: &[Estimate], from_d: f64) -> Option<f64> {
        let after: Vec<f64> =
            estimates.iter().filter(|e| e.time_d >= from_d).map(|e| e.residual.e_um).collect();
        (!after.is_empty()).then(|| after.iter().sum::<f64>() / after.len() as f64)
    }

    /// How much smaller the mean residual is than with constant bearings: over the whole record, and from
    /// the event on.
    pub fn reduction(&self) -> [Option<f64>; 2] {
        [Some(f64::NEG_INFINITY), self.event_d].map(|from| {
            let from = from?;
            let (own, fixed) = (Self::mean_um(&self.estimates, from)?, Self::mean_um(&self.fixed, from)?);
            Some(1.0 - own / fixed)
        })
    }
}

/// Follows a record of this rotor; a run-up in the state of the first days helps phase I, later ones help
/// [`Method::Joint`] alone. `progress` hears how much of how much is done.
///
/// # Errors
/// If the record cannot be followed: too short, begun after an event, a dead probe.
pub fn track(
    rotor: &Rotor,
    record: &[Reading],
    runup: &[Reading],
    later: &[Later],
    config: &Config,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Track, Error> {
    rotor.validate()?;
    coefficients::can_follow(rotor)?;
    let tracking = Tracking::begin(rotor, record, runup, config)?;
    let fixed = tracking.fixed(&mut |_, _| ());
    let event_d = fixed.flags.first().map(|f| f.since_d);
    let (mut sampling, mut joint) = (None, None);
    let run = match config.method {
        Method::Fixed => fixed.clone(),
        Method::Adaptive => tracking.adaptive(progress),
        Method::Bayes => {
            let (run, found) = tracking.bayes(progress);
            sampling = found;
            run
        }
        Method::Joint => {
            let (run, found) = tracking.joint(runup, later, progress)?;
            joint = Some(found);
            run
        }
    };
    let undiagnosed =
        run.reidentified.iter().map(|r| r.since_d).find(|since| later.iter().all(|l| l.time_d < *since));
    Ok(Track {
        method: config.method,
        undiagnosed_since_d: undiagnosed,
        phase_one: tracking.phase_one,
        estimates: run.estimates,
        flags: run.flags,
        reidentified: run.reidentified,
        fixed: fixed.estimates,
        event_d,
        sampling,
        joint,
        remarks: tracking.remarks,
    })
}

//! Configuration of tracking, and its results for each reading.

use nalgebra::Complex;

use super::cases::CaseFit;
use super::coefficients::Logs;
use super::detector::{DetectorThresholds, ReadingResidual};
use crate::measurement::Condition;

type C = Complex<f64>;

/// How the record is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    Fixed,
    /// Re-identification after a jump of the residual.
    Adaptive,
    /// Bearings and unbalance sampled, daily and after a jump.
    Bayes,
    /// All days are estimated together.
    Joint,
}

/// Proposals of a chain and day after which the chains mostly agree.
pub const PROPOSALS: usize = 400;
/// Number of proposals in the paper.
pub const PROPOSALS_AS_PRINTED: usize = 200;

/// Days in which the machine stood; its bearings and its unbalance are new after them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outage {
    pub from_d: f64,
    pub to_d: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// How the record is followed.
    pub method: Method,
    /// Thresholds for suspicious readings and for flags.
    pub thresholds: DetectorThresholds,
    /// Largest unbalance of a plane relative to the previous day.
    pub growth: f64,
    /// The file's bearings and planes are already identified: phase I is skipped.
    pub identified: bool,
    /// Proposals of each chain of a day; [`PROPOSALS`] is usual, and the paper's [`PROPOSALS_AS_PRINTED`].
    pub proposals: usize,
    /// [`Method::Bayes`] as it was printed: a random walk in bearings and unbalance together.
    pub paper: bool,
    pub seed: u64,
    /// Stated outages, of [`Method::Joint`].
    pub outages: Vec<Outage>,
    /// Conditions of operation that the readings hold; [`Method::Joint`] regresses on them.
    pub conditions: Vec<Condition>,
}

impl Config {
    /// The usual settings of a method.
    pub fn new(method: Method) -> Self {
        let rise = if method == Method::Bayes { 0.3 } else { 0.5 };
        let thresholds = DetectorThresholds { rise, ..DetectorThresholds::default() };
        Self {
            method,
            thresholds,
            growth: 1.2,
            identified: false,
            proposals: PROPOSALS,
            paper: false,
            seed: 1,
            outages: Vec::new(),
            conditions: Vec::new(),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct ReadingEstimate {
    pub row: usize,
    /// Days since the record began.
    pub time_d: f64,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: Vec<C>,
    /// Logarithms of the bearing coefficients, in the order of phase I.
    pub logs: Logs,
    /// Calculated phasor of each probe, m.
    pub calculated_m: Vec<C>,
    pub residual: ReadingResidual,
    /// 95 % intervals, of methods that estimate them.
    pub spread: Option<CredibleIntervals>,
    /// The reading alone looked wrong.
    pub suspicious: bool,
    /// The model no longer describes the machine.
    pub flagged: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct CredibleIntervals {
    /// Logarithms of the bearing coefficients.
    pub logs: Vec<Interval>,
    /// Magnitude of each plane's unbalance, kg·m.
    pub magnitude_kg_m: Vec<Interval>,
    /// Its angle, rad, around the estimate's.
    pub angle_rad: Vec<Interval>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlagCause {
    /// The model stopped describing the machine.
    Model,
    /// The unbalance jumped by more than phase II may follow in a day; the model still holds.
    Unbalance,
    /// A probe or the phase reference changed, and not the machine.
    Instrument,
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
    pub cause: FlagCause,
}

/// A re-identification of the bearings.
#[derive(Debug, Clone, PartialEq)]
pub struct Reidentified {
    /// First day of the new bearings.
    pub since_d: f64,
    /// Day on which they were found.
    pub time_d: f64,
    /// Selected case, 1 to 4; 0 where the method has no cases.
    pub case: u8,
    pub bearing: usize,
    pub cases: Vec<CaseFit>,
    /// Logarithms of the new coefficients.
    pub logs: Logs,
}

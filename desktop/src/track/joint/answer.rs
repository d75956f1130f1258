//! Results of the joint method.

use nalgebra::Complex;

use super::scope::Scope;
use crate::forecast::filter_state::FilterState;
use crate::measurement::Condition;
use crate::track::answer::Interval;
use crate::track::coefficients::Logs;

/// An event with its evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Most probable first day of the new state.
    pub time_d: f64,
    /// 95 % interval of that day; both ends are days with a reading.
    pub interval_d: Interval,
    pub scope: Scope,
    /// Logarithm of how much more probable the record is with it, on average over every day and every scope
    /// that were tried: by chance alone it is above `e` in at most `exp(−e)` of records.
    pub evidence: f64,
    /// Whether it is the end of a stated outage, whose evidence is not judged.
    pub stated: bool,
    /// What an instrument shows after it over what it showed before; one of events in the machine.
    pub factor: Complex<f64>,
}

/// Constant part of a bearing coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantPart {
    /// Logarithm of its value.
    pub log: f64,
    /// Standard deviation of that; the prior's is 0.5, of a number of a film less.
    pub sd: f64,
    /// Whether its standard deviation is at most half the prior's.
    pub from_data: bool,
}

/// Events, constants and random walk that method 4 learned.
#[derive(Debug, Clone)]
pub struct JointFindings {
    pub events: Vec<Event>,
    /// Events that may have taken place, with too little evidence to be claimed: intervals are the mixture with and without
    /// them.
    pub possible: Vec<Event>,
    /// The bearings' constants: first day of a state, and its coefficients.
    pub constants: Vec<(f64, Vec<ConstantPart>)>,
    /// Standard deviation of each coefficient's random walk, relative.
    pub walk_sd: Logs,
    /// Days in which the random walk reverts to 1/e.
    pub walk_days: f64,
    /// Days whose reading was left out as an outlier.
    pub left_out_d: Vec<f64>,
    /// Effects that a later run-up showed, by label.
    pub effects: Vec<String>,
    /// Whether expectation and maximisation converged.
    pub settled: bool,
    /// Filtered state on the day of each estimate, for magnitude (g·mm) and angle (degrees) of the static and then of the
    /// dynamic unbalance. A forecast may use it, as it contains no later data.
    pub filter_states: Vec<[FilterState; 4]>,
    /// What conditions of operation change, one for each that the record has.
    pub conditions: Vec<ConditionEffect>,
    /// What a second reading a day at another speed would give.
    pub second_speed: Option<SecondSpeed>,
}

/// What a condition of operation changes; nothing where there are neither bearings nor planes.
#[derive(Debug, Clone)]
pub struct ConditionEffect {
    pub condition: Condition,
    /// Its mean over the record, in its unit. The constants of the bearings are those at the mean.
    pub mean: f64,
    /// Change of the condition that effects are stated for, in its unit.
    pub step: f64,
    /// Logarithm of how much more probable the record is with its likeliest effect, less that of the number of trials.
    pub evidence: f64,
    pub bearings: Vec<BearingEffect>,
    pub planes: Vec<PlaneEffect>,
    /// Another part of the machine that may follow it instead.
    pub other: Option<OtherEffect>,
}

/// Another part of the machine that may follow a condition; intervals are the mixture of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherEffect {
    /// Whether it is the unbalance, else other bearings.
    pub is_unbalance: bool,
    pub probability: f64,
}

impl ConditionEffect {
    /// Whether it changes anything.
    pub fn is_used(&self) -> bool {
        !(self.bearings.is_empty() && self.planes.is_empty())
    }
}

/// Change of a logarithm for a step of a condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogChange {
    pub log: f64,
    pub sd: f64,
}

/// What a step of a condition changes at a bearing.
#[derive(Debug, Clone)]
pub struct BearingEffect {
    pub bearing: usize,
    /// Mean of its direct stiffness coefficients, and of its damping coefficients.
    pub stiffness: LogChange,
    pub damping: LogChange,
    /// By the coefficient's number, in the order of phase I.
    pub coefficients: Vec<(usize, LogChange)>,
}

/// What a step of a condition adds to the unbalance of a plane, of the last day.
#[derive(Debug, Clone, Copy)]
pub struct PlaneEffect {
    pub plane: usize,
    pub change_kg_m: Complex<f64>,
    /// Standard deviation of a component, kg·m.
    pub sd_kg_m: f64,
}

/// What a second reading a day would give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondSpeed {
    pub speed_rpm: f64,
    /// Days of readings after which the half-widths hold.
    pub days: f64,
    /// 95 % half-width of a component of the planes' unbalance (rms over the planes) with readings at the second speed as well,
    /// kg·m.
    pub half_width_kg_m: f64,
    /// The same with readings at the record's speed alone.
    pub without_kg_m: f64,
}

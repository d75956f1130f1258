//! What all days together say.

use super::scope::Scope;
use crate::forecast::filter_state::FilterState;
use crate::track::answer::Interval;
use crate::track::operating_point::Logs;

/// An event, and how sure it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Most probable first day of the new state.
    pub time_d: f64,
    /// Where that day is with 95 % probability; both ends are days with a reading.
    pub interval_d: Interval,
    pub scope: Scope,
    /// Logarithm of how much more probable the record is with it, on average over every day and every scope
    /// that were tried: by chance alone it is above `e` in at most `exp(−e)` of records.
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
    /// Whether the likelihood had stopped rising when the learning of wander and drift ended.
    pub settled: bool,
    /// What was known on the day of each estimate of the static unbalance's size (g·mm) and angle (degrees), and of the
    /// dynamic one's: what a forecast may use.
    pub known_then: Vec<[FilterState; 4]>,
}

//! The range in which phase I searches the bearings.

use crate::bearing::law::Role;
use crate::machine::bearings::{BearingUnknown, Bearings};
use crate::machine::drawing::SearchBounds;

/// Search range around the file's guess where `[identify]` does not give one: a factor either way.
const DEFAULT_RANGE: f64 = 2.5;

/// Lowest and highest search coordinate of everything that data may decide about the bearings.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    pub low: Vec<f64>,
    pub high: Vec<f64>,
}

impl Range {
    /// The stated bounds, or 2.5 times either way around what the file says; as far for what has no logarithm, in
    /// standard deviations of its prior.
    pub fn new(bearings: &Bearings, bounds: Option<&SearchBounds>) -> Self {
        let side = |k: usize| {
            let direction = [-1.0, 1.0][k];
            let edge = |u: &BearingUnknown| match (bounds, u.law.role) {
                // bounds are of coefficients; a factor on a stated column is none
                (Some(b), Role::Damping) if !u.law.unit.is_empty() => b.damping_n_s_m[k].ln(),
                (Some(b), Role::Stiffness) if !u.law.unit.is_empty() => b.stiffness_n_m[k].ln(),
                (_, Role::Other) => u.law.stated + direction * 2.0 * u.law.prior_sd,
                _ => u.law.stated + direction * DEFAULT_RANGE.ln(),
            };
            bearings.unknowns().iter().map(edge).collect()
        };
        Self { low: side(0), high: side(1) }
    }

    /// All coefficients, each moved to the nearest bound if it is outside.
    pub fn clamped(&self, logs: &[f64]) -> Vec<f64> {
        let bounds = self.low.iter().zip(&self.high);
        logs.iter().zip(bounds).map(|(log, (low, high))| log.clamp(*low, *high)).collect()
    }
}

//! The bearing coefficients that phase I reports, and the range it searches them in.

use crate::fit::hypothesis::{COEFFICIENTS, coefficient};
use crate::machine::drawing::{Rotor, SearchBounds};

/// Search range around the file's guess where `[identify]` does not give one: a factor either way.
const DEFAULT_RANGE: f64 = 2.5;

/// What the data said about a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Identified {
    /// The data fix it at least twice as well as the starting guess did.
    FromData,
    /// The data say little or nothing; it stayed near its start.
    StayedAtStart,
    /// The search range ended here.
    AtBound,
}

/// One identified bearing coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct BearingParameter {
    /// The bearing.
    pub bearing: String,
    /// `k_xx`, `k_yy`, `c_xx` or `c_yy`.
    pub symbol: &'static str,
    /// Value, N/m or N·s/m.
    pub value: f64,
    /// Where the search began.
    pub start: f64,
    /// Standard deviation relative to the value, prior included.
    pub relative_sd: f64,
    /// Whether the data decided it.
    pub identified: Identified,
}

/// Symbol of coefficient `i`, in the order of [`coefficient`].
pub fn symbol(i: usize) -> &'static str {
    match coefficient(i) {
        (_, 0, false) => "k_xx",
        (_, _, false) => "k_yy",
        (_, 0, true) => "c_xx",
        _ => "c_yy",
    }
}

/// Writes coefficients, given by their logarithms, into a rotor.
pub fn assign(rotor: &mut Rotor, logs: &[f64]) {
    for (i, log) in logs.iter().take(COEFFICIENTS).enumerate() {
        let (bearing, axis, damping) = coefficient(i);
        let b = &mut rotor.bearing[bearing];
        let c = if damping { &mut b.damping_n_s_m } else { &mut b.stiffness_n_m };
        *(if axis == 0 { &mut c.xx } else { &mut c.yy }) = log.exp();
    }
}

/// Lowest and highest logarithm of each coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    /// Lowest.
    pub low: Vec<f64>,
    /// Highest.
    pub high: Vec<f64>,
}

impl Range {
    /// The stated bounds, or 2.5 times either way around the guess (logarithms).
    pub fn new(guess: &[f64; COEFFICIENTS], bounds: Option<&SearchBounds>) -> Self {
        let side = |k: usize| {
            let log = |(i, guess): (usize, &f64)| match bounds {
                Some(b) if coefficient(i).2 => b.damping_n_s_m[k].ln(),
                Some(b) => b.stiffness_n_m[k].ln(),
                None => guess + [-1.0, 1.0][k] * DEFAULT_RANGE.ln(),
            };
            guess.iter().enumerate().map(log).collect()
        };
        Self { low: side(0), high: side(1) }
    }

    /// All coefficients, each moved to the nearest bound if it is outside.
    pub fn clamped(&self, logs: &[f64]) -> Vec<f64> {
        let bounds = self.low.iter().zip(&self.high);
        logs.iter().zip(bounds).map(|(log, (low, high))| log.clamp(*low, *high)).collect()
    }
}

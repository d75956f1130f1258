//! The bearing coefficients as a vector of unknowns: logarithms of the direct terms.

use nalgebra::{Complex, SMatrix, SVector};

use crate::rotor::{Bearing, Rotor, SearchBounds};

/// Direct coefficients of two bearings: k_xx k_yy of each, then c_xx c_yy of each.
pub const COEFFICIENTS: usize = 8;

/// How far the file's coefficients are trusted: standard deviation of their logarithms. A weak prior;
/// where the data speak at all, they overrule it.
pub const PRIOR_LOG_SD: f64 = 0.5;

/// Search range around the file's guess where `[identify]` does not give one.
const DEFAULT_RANGE: f64 = 2.5;

/// Logarithms of the eight direct coefficients.
pub type LogCoefficients = SVector<f64, COEFFICIENTS>;

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

/// Axis (0 for x, 1 for y) and bearing of coefficient `i`, and whether it is damping.
pub fn place(i: usize) -> (usize, usize, bool) {
    ((i / 2) % 2, i % 2, i >= COEFFICIENTS / 2)
}

fn direct(bearing: &Bearing, axis: usize, damping: bool) -> f64 {
    let c = if damping { &bearing.damping_n_s_m } else { &bearing.stiffness_n_m };
    if axis == 0 { c.xx } else { c.yy }
}

/// The rotor's coefficients; damping of zero starts from a loss of one thousandth at 1000 rad/s, as
/// a logarithm needs a number.
pub fn logarithms(rotor: &Rotor) -> LogCoefficients {
    LogCoefficients::from_fn(|i, _| {
        let (bearing, axis, damping) = place(i);
        let b = &rotor.bearing[bearing];
        let floor = if damping { 1e-6 * direct(b, axis, false) } else { 1.0 };
        direct(b, axis, damping).max(floor).ln()
    })
}

/// Writes the coefficients into a rotor.
pub fn assign(rotor: &mut Rotor, logs: &LogCoefficients) {
    for (i, log) in logs.iter().enumerate() {
        let (bearing, axis, damping) = place(i);
        let b = &mut rotor.bearing[bearing];
        let c = if damping { &mut b.damping_n_s_m } else { &mut b.stiffness_n_m };
        *(if axis == 0 { &mut c.xx } else { &mut c.yy }) = log.exp();
    }
}

/// Search range of each logarithm.
pub fn ranges(start: &LogCoefficients, bounds: Option<&SearchBounds>) -> [LogCoefficients; 2] {
    let side = |k: usize| {
        LogCoefficients::from_fn(|i, _| match bounds {
            Some(b) if place(i).2 => b.damping_n_s_m[k].ln(),
            Some(b) => b.stiffness_n_m[k].ln(),
            None => start[i] + if k == 0 { -DEFAULT_RANGE.ln() } else { DEFAULT_RANGE.ln() },
        })
    };
    [side(0), side(1)]
}

/// Symbol of coefficient `i`.
pub fn symbol(i: usize) -> &'static str {
    match place(i) {
        (_, 0, false) => "k_xx",
        (_, _, false) => "k_yy",
        (_, 0, true) => "c_xx",
        _ => "c_yy",
    }
}

/// Dynamic stiffness of both bearings, 4 × 4 in x₁ y₁ x₂ y₂; cross-coupling is the rotor's own.
pub fn dynamic_stiffness(
    rotor: &Rotor,
    logs: &LogCoefficients,
    speed_rad_s: f64,
) -> SMatrix<Complex<f64>, 4, 4> {
    let mut z = SMatrix::zeros();
    for (b, bearing) in rotor.bearing.iter().enumerate() {
        let (k, c) = (bearing.stiffness_n_m, bearing.damping_n_s_m);
        z[(2 * b, 2 * b + 1)] = Complex::new(k.xy, speed_rad_s * c.xy);
        z[(2 * b + 1, 2 * b)] = Complex::new(k.yx, speed_rad_s * c.yx);
    }
    for i in 0..COEFFICIENTS {
        let (bearing, axis, _) = place(i);
        let at = 2 * bearing + axis;
        z[(at, at)] += slope(i, logs, speed_rad_s);
    }
    z
}

/// Change of the dynamic stiffness per unit of logarithm `i`: the coefficient's own contribution.
pub fn slope(i: usize, logs: &LogCoefficients, speed_rad_s: f64) -> Complex<f64> {
    let value = logs[i].exp();
    if place(i).2 { Complex::new(0.0, speed_rad_s * value) } else { Complex::from(value) }
}

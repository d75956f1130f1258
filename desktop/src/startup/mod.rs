//! A single-disk rotor from its start-up alone.
//!
//! | module | holds |
//! |---|---|
//! | [`series`] | each run along each direction that a bearing's probes see |
//! | [`half_power`], [`circle`], [`least_squares`] | natural speed and damping, three ways |
//! | [`estimate`] | what follows from them: damping, stiffness, bearing; over all runs |
//! | [`shaft`] | the shaft as a spring under the disk, by beam theory |
//! | [`two_degree`] | the simple model's prediction, and how far any model is off |
//! | [`refinement`] | what this project's own diagnosis makes of the same data |
//!
//! The simple model is that of AlSaleh, Sedighi, Ouakad (2020): two uncoupled oscillators
//! `m ẍ + c ẋ + k x = U Ω² cos Ωt` and the same in y, one pair for each bearing's probes, driven by the
//! added mass, with `c = 2 ζ m ω` and `k = m ω²`.

pub mod circle;
pub mod estimate;
pub mod half_power;
pub mod least_squares;
mod minimum;
pub mod refinement;
pub mod series;
pub mod shaft;
#[cfg(test)]
mod tests;
pub mod two_degree;

use nalgebra::Complex;

use crate::compare::{SIGNIFICANCE, upper_tail};
use crate::error::{Error, StartupError};
use crate::machine::drawing::{Noise, Rotor, Tolerance};
use crate::measurement::Reading;

use estimate::{CombinedEstimates, RunEstimates};
use series::{ProbeDirection, RunUp};
use shaft::ShaftSpring;

/// The clearance of the bearings of the paper's kit, 5 mil, µm.
pub const PAPER_CLEARANCE_UM: f64 = 127.0;
/// The speeds at which the paper compares, rpm.
pub const PAPER_SPEEDS_RPM: [f64; 2] = [1000.0, 3600.0];

/// Natural speed and damping ratio of one oscillator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modal {
    pub natural_rad_s: f64,
    pub damping_ratio: f64,
}

impl Modal {
    /// Motion per eccentricity `U/m`: `Ω² / (ω² − Ω² + 2iζωΩ)`.
    pub fn per_eccentricity(&self, speed_rad_s: f64) -> Complex<f64> {
        let (w, n) = (speed_rad_s, self.natural_rad_s);
        Complex::from(w * w) / Complex::new(n * n - w * w, 2.0 * self.damping_ratio * n * w)
    }
}

/// A number with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UncertainValue {
    pub value: f64,
    pub sd: f64,
}

/// What the caller knows beside the rotor's file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// Mass of the two-degree model, kg; the disk's as in the paper if not stated.
    pub mass_kg: Option<f64>,
    /// Runs whose trial weights are not known well enough to predict them.
    pub unknown_weights: Vec<String>,
}

/// The simple model of a start-up.
#[derive(Debug, Clone)]
pub struct Startup {
    /// Mass of the two-degree model, kg.
    pub mass_kg: f64,
    /// The shaft under the disk.
    pub spring: ShaftSpring,
    /// Where the shaft is seen.
    pub directions: Vec<ProbeDirection>,
    pub runs: Vec<RunUp>,
    /// Estimates of each run along each direction.
    pub seen: Vec<Vec<RunEstimates>>,
    /// The same over all runs, by direction.
    pub combined: Vec<CombinedEstimates>,
    /// Whether the natural speed moves with the amplitude, by direction.
    pub shifts: Vec<Option<estimate::AmplitudeShift>>,
    /// The disk's own unbalance by the two-degree model, where trial weights tell it, kg·m.
    pub own_kg_m: Option<estimate::OwnUnbalance>,
    /// The noise that was gone by.
    pub noise: Noise,
    /// What could not be done, one sentence each.
    pub remarks: Vec<String>,
}

impl Startup {
    /// Whether noise explains what the two-degree model leaves of all runs along all directions, so that its intervals hold.
    pub fn two_degree_fits(&self) -> bool {
        let fits = || self.seen.iter().flatten().filter_map(|s| s.least_squares.as_ref().ok());
        let chi2: f64 = fits().map(|fit| fit.chi2_per_value * fit.values as f64).sum();
        let freedom: usize = fits().map(|fit| fit.values.saturating_sub(least_squares::FITTED)).sum();
        freedom > 0 && upper_tail(chi2, freedom) >= SIGNIFICANCE
    }
}

/// Estimates the simple model from a start-up.
///
/// # Errors
/// If the rotor has not exactly one disk, or nothing at all can be estimated: one sentence on what is
/// missing.
pub fn startup(rotor: &Rotor, readings: &[Reading], options: &Options) -> Result<Startup, Error> {
    let [disk] = rotor.disk.as_slice() else {
        return Err(StartupError::Disks { given: rotor.disk.len() }.into());
    };
    if rotor.bearing.len() != 2 {
        return Err(StartupError::Bearings { given: rotor.bearing.len() }.into());
    }
    let mass_kg = options.mass_kg.unwrap_or(disk.mass_kg);
    if mass_kg <= 0.0 {
        return Err(StartupError::NoMass { disk: disk.name.clone() }.into());
    }
    let spring = ShaftSpring::of(rotor, disk)?;
    let noise = Noise::of(rotor, readings);
    let directions = series::directions(rotor);
    let runs = RunUp::all(rotor, readings);
    let mut remarks = Vec::new();
    remarks.extend(noise.assumption(rotor));
    remarks.extend(Tolerance::assumption(rotor));
    for name in &options.unknown_weights {
        remarks.push(format!(
            "The weight of run {name} has no angle_deg: its resonance is evaluated, but nothing is predicted for it."
        ));
    }
    let seen: Vec<Vec<RunEstimates>> = runs
        .iter()
        .map(|run| {
            directions.iter().map(|d| RunEstimates::of(&series::series(readings, &noise, run, d))).collect()
        })
        .collect();
    remarks.extend(estimate::unseen(&runs, &directions, &seen));
    if seen.iter().flatten().all(|s| s.half_power.is_err() && s.circle.is_err() && s.least_squares.is_err()) {
        return Err(remarks.pop().map_or(Error::NoReading, Error::Unsuitable));
    }
    let by_direction = |d: usize| seen.iter().map(move |run| &run[d]);
    let combined =
        (0..directions.len()).map(|d| CombinedEstimates::of(by_direction(d), mass_kg, &spring)).collect();
    let shifts = (0..directions.len()).map(|d| estimate::AmplitudeShift::of(by_direction(d))).collect();
    let known: Vec<bool> =
        runs.iter().map(|r| !options.unknown_weights.iter().any(|u| u == r.label())).collect();
    let own_kg_m = estimate::OwnUnbalance::of(&runs, &known, &directions, &seen);
    Ok(Startup { mass_kg, spring, directions, runs, seen, combined, shifts, own_kg_m, noise, remarks })
}

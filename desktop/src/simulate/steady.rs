//! Whether a machine has a steady response: none of its modes grows.

use super::shown::ends;
use super::switched;
use crate::check::campbell::Campbell;
use crate::check::system::System;
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::units::{rad_s, rpm};

/// Speeds of a run at which modes are looked at.
const LOOKED_AT: usize = 7;
/// Modes up to this many times the fastest speed are looked at.
const FREQUENCIES: f64 = 2.0;

/// The first speed of a range at which a mode grows, rpm.
///
/// # Errors
/// If the modes cannot be computed.
pub fn unstable_from_rpm(machine: &Rotor, speeds_rpm: &[f64]) -> Result<Option<f64>, Error> {
    let (slowest, fastest) = ends(speeds_rpm);
    let step = |k: usize| slowest + (fastest - slowest) * k as f64 / (LOOKED_AT - 1) as f64;
    let mut speeds: Vec<f64> = (0..LOOKED_AT).map(|k| rad_s(step(k))).collect();
    speeds.dedup();
    let system = System::new(&switched(machine))?;
    let campbell = Campbell::new(&system, &speeds, FREQUENCIES * rad_s(fastest))?;
    Ok(campbell.threshold(&system, 0).map(|threshold| rpm(threshold.speed_rad_s)))
}

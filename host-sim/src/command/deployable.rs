//! A rotor's file as the model that a controller gets.

use std::path::Path;

use anyhow::{Result, bail};
use rotor_edge_desktop::machine::rotor_file;

use super::identify::{self, Days};
use crate::edge::Deployment;
use crate::sample;

/// The model of a file, for speeds up to `fastest_rpm`, or that of the data it was fitted to.
///
/// # Errors
/// If the file is not one that was identified, or the controller cannot hold its model.
pub fn of_file(path: &Path, fastest_rpm: Option<f64>) -> Result<Deployment> {
    let rotor = rotor_file::read(path)?;
    let path = path.display();
    if rotor.plane.iter().any(|p| p.unbalance_g_mm.is_none()) {
        bail!("{path}: [[plane]]: unbalance_g_mm is missing; `rotor-edge identify` or `improve` finds it");
    }
    let Some(fastest_rpm) = fastest_rpm.or(rotor.fastest_rpm) else {
        bail!(
            "{path}: fastest_rpm is missing: give --fastest-rpm, the highest speed that the machine reaches"
        );
    };
    if !(1.0..=1e6).contains(&fastest_rpm) {
        bail!("--fastest-rpm {fastest_rpm}: expected a speed in rpm");
    }
    Deployment::new(&rotor, fastest_rpm)
}

/// The built-in sample after phase I.
///
/// # Errors
/// None, as long as the sample can be identified.
pub fn of_sample(seed: u64) -> Result<Deployment> {
    let (rotor, record, runup) = sample::load()?;
    let days = Days::FIRST_THREE.select(&record)?;
    let found = identify::phase_one(&rotor, &days, Some(&runup), seed)?;
    let fastest_rpm = record.iter().chain(&runup).map(|r| r.speed_rpm).fold(0.0, f64::max);
    Deployment::new(&found.rotor, fastest_rpm)
}

//! A record made ready for tracking: every reading with the machine solved at its speed.

use nalgebra::Complex;

use super::operating_point::{FollowedMachine, OperatingPoint};
use crate::error::{Error, TrackError};
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;
use crate::unbalance::phasor_kg_m;
use crate::units::same_place;

type C = Complex<f64>;

#[derive(Debug, Clone)]
pub struct Day {
    pub row: usize,
    /// Days since the record began; the row where the record has no days.
    pub time_d: f64,
    pub speed_rad_s: f64,
    /// The machine at this speed, with the known weights of its run.
    pub point: OperatingPoint,
    /// Weights of its run in each plane, trial or correction, kg·m; the unknown unbalance does not include them.
    pub weights_kg_m: Vec<C>,
    /// Phasor of each probe, m; `None` where it was lost.
    pub measured_m: Vec<Option<C>>,
    /// Standard deviation of each component, m; undefined where the probe was lost.
    pub sigma_m: Vec<f64>,
    /// Covariates, centred and scaled; empty if the record has none.
    pub conditions: Vec<f64>,
}

impl Day {
    /// All probes of a complete reading; lost ones as zero.
    pub fn all_m(&self) -> Vec<C> {
        self.measured_m.iter().map(|y| y.unwrap_or_default()).collect()
    }

    /// Whether no probe was lost.
    pub fn is_complete(&self) -> bool {
        self.measured_m.iter().all(Option::is_some)
    }
}

/// The day of a reading.
pub fn time_d(row: usize, reading: &Reading) -> f64 {
    reading.time_d.unwrap_or(row as f64)
}

/// Solves every reading that has a value on the model of this rotor.
///
/// # Errors
/// If the machine is singular at one of the speeds, or a run's weight is in no plane.
pub fn days(rotor: &Rotor, noise: &Noise, record: &[Reading]) -> Result<Vec<Day>, Error> {
    let machine = FollowedMachine::of(rotor);
    let day = |(row, r): (usize, &Reading)| day(rotor, &machine, noise, row, r);
    record.iter().enumerate().filter(|(_, r)| r.probes.iter().any(Option::is_some)).map(day).collect()
}

/// One reading, solved on the machine of this rotor.
///
/// # Errors
/// If the machine is singular at its speed, or a weight of its run is in no plane.
pub fn day(
    rotor: &Rotor,
    machine: &FollowedMachine,
    noise: &Noise,
    row: usize,
    r: &Reading,
) -> Result<Day, Error> {
    let weights_kg_m = weights_kg_m(rotor, r)?;
    Ok(Day {
        row,
        time_d: time_d(row, r),
        speed_rad_s: r.speed_rad_s(),
        point: machine.at(r.speed_rad_s())?.with_weights(&weights_kg_m),
        weights_kg_m,
        measured_m: r.probes.clone(),
        sigma_m: r.probes.iter().map(|y| noise.sigma_m(y.unwrap_or_default())).collect(),
        conditions: Vec::new(),
    })
}

/// Weights that the rotor's file states for a reading's run, a plane each.
fn weights_kg_m(rotor: &Rotor, reading: &Reading) -> Result<Vec<C>, Error> {
    let mut weights = vec![C::from(0.0); rotor.plane.len()];
    let stated = rotor.run.iter().find(|run| Some(&run.name) == reading.run.as_ref());
    for added in stated.iter().flat_map(|run| &run.added_unbalance) {
        let plane = rotor.plane.iter().position(|p| same_place(p.position_m, added.position_m));
        let Some(plane) = plane else {
            let run = reading.run.clone().unwrap_or_default();
            return Err(TrackError::WeightOutsidePlanes { run, position_m: added.position_m }.into());
        };
        weights[plane] += phasor_kg_m(added.magnitude_g_mm, added.angle_deg);
    }
    Ok(weights)
}

//! Speeds and unbalance of a simulation that does not state them.

use nalgebra::Complex;
use rand::Rng;

use crate::bearing::Law;
use crate::check::default_range_rpm;
use crate::check::system::System;
use crate::error::Error;
use crate::grade::{Rigid, USUAL_GRADE_MM_S};
use crate::machine::drawing::{Plane, Rotor};
use crate::unbalance::phasor_kg_m;
use crate::units::rpm;

type C = Complex<f64>;

/// Speeds of a run, evenly from this share of the fastest.
pub const SPEEDS: usize = 40;
const SLOWEST: f64 = 0.1;
/// Speeds are rounded to this, rpm.
const ROUND_RPM: f64 = 0.1;
/// How far inside the range of its films a machine is run, relative.
const INSIDE: f64 = 1e-3;

/// A run-up to the fastest rated speed, else to the fastest that the file was fitted to, else past the second critical
/// speed; within what the films are solved for.
///
/// # Errors
/// If the machine has no critical speeds, or its films have no speed in common.
pub fn speeds_rpm(file: &Rotor) -> Result<Vec<f64>, Error> {
    let rated = file.rated.map(|rated| rated.speed_rpm[1]);
    let fastest = match rated.or(file.fastest_rpm) {
        Some(fastest) => fastest,
        None => default_range_rpm(file, &System::new(file)?)[1],
    };
    let (mut from, mut to) = (SLOWEST * fastest, fastest);
    for bearing in &file.bearing {
        if let Law::Film(film) = &bearing.law {
            let [slowest, fastest] = film.curve().range_rad_s().map(rpm);
            (from, to) = (from.max(slowest * (1.0 + INSIDE)), to.min(fastest * (1.0 - INSIDE)));
        }
    }
    if from >= to {
        let what = "the oil films of the bearings have no speed in common; state the speeds with --speeds";
        return Err(Error::Unsuitable(what.into()));
    }
    let at = |k: usize| from + (to - from) * k as f64 / (SPEEDS - 1) as f64;
    Ok((0..SPEEDS).map(|k| (at(k) / ROUND_RPM).round() * ROUND_RPM).map(tidy).collect())
}

/// A speed without the digits that rounding leaves behind.
fn tidy(speed_rpm: f64) -> f64 {
    format!("{speed_rpm:.3}").parse().unwrap_or(speed_rpm)
}

/// Unbalance of each plane, kg·m: as it is asked for, else as the file states it, else an even share of what the balance
/// grade permits at a random angle.
///
/// # Errors
/// If a plane is asked for that the file does not have, or twice.
pub fn unbalance_kg_m(
    file: &Rotor,
    asked: &[(String, C)],
    fastest_rpm: f64,
    random: &mut impl Rng,
) -> Result<Vec<C>, Error> {
    let known = || file.plane.iter().map(|p| p.name.clone()).collect::<Vec<_>>();
    if let Some((plane, _)) = asked.iter().find(|(plane, _)| !known().contains(plane)) {
        return Err(Error::UnknownPlane { plane: plane.clone(), known: known() });
    }
    let is_again = |k: usize| asked[..k].iter().any(|(before, _)| *before == asked[k].0);
    if let Some(again) = (0..asked.len()).find(|k| is_again(*k)) {
        return Err(Error::Unsuitable(format!(
            "the unbalance of plane \"{}\" is stated twice",
            asked[again].0
        )));
    }
    let rated = file.rated;
    let grade_mm_s = rated.and_then(|rated| rated.balance_grade_mm_s).unwrap_or(USUAL_GRADE_MM_S);
    let service_rpm = rated.map_or(fastest_rpm, |rated| rated.speed_rpm[1]);
    let share = Rigid::of(file).permissible_kg_m(grade_mm_s, service_rpm) / file.plane.len() as f64;
    let of = |plane: &Plane| {
        // drawn for every plane, so that stating one leaves the others as they are
        let by_grade = C::from_polar(share, random.random_range(-180.0..180.0_f64).to_radians());
        let asked = asked.iter().find(|(name, _)| *name == plane.name).map(|(_, u)| *u);
        let stated = plane.unbalance_g_mm.map(|g_mm| phasor_kg_m(g_mm, plane.angle_deg.unwrap_or(0.0)));
        asked.or(stated).unwrap_or(by_grade)
    };
    Ok(file.plane.iter().map(of).collect())
}

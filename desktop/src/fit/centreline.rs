//! The shaft centreline as evidence: where gap voltages say that the journals run, against where their films put them.

use nalgebra::{DVector, Vector2};

use crate::bearing::curve::Curve;
use crate::effects::terms::Terms;
use crate::machine::drawing::{Probe, Rotor};
use crate::measurement::Reading;

/// Standard deviation of a probe's scale factor: API standard 670 allows 5 % either way, taken as evenly distributed.
const SCALE: f64 = 0.029;

/// What one probe says about its journal in one reading.
#[derive(Debug, Clone, Copy)]
pub struct JournalReading {
    bearing: usize,
    speed_rad_s: f64,
    angle_rad: f64,
    /// Towards the probe, from where the journal lay still, m.
    moved_m: f64,
    sigma_m: f64,
}

/// What the gap voltages say. A probe's error of calibration is the same in all its readings, so that many say no more
/// than one.
pub fn observed(rotor: &Rotor, readings: &[Reading]) -> Vec<JournalReading> {
    let of_probe = |(p, probe): (usize, &Probe)| {
        let (Some(gap), Some(bearing)) = (probe.gap, rotor.bearing_of(probe)) else { return vec![] };
        let seen = |r: &Reading| Some((r.speed_rad_s(), gap.moved_m(r.gaps_v.get(p).copied().flatten()?)));
        let all: Vec<(f64, f64)> = readings.iter().filter_map(seen).collect();
        let shared = (all.len() as f64).sqrt();
        let reading = |(speed_rad_s, moved_m): (f64, f64)| JournalReading {
            bearing,
            speed_rad_s,
            angle_rad: probe.angle_deg.to_radians(),
            moved_m,
            sigma_m: (gap.accuracy_um * 1e-6).hypot(SCALE * moved_m) * shared,
        };
        all.into_iter().map(reading).collect()
    };
    rotor.probe.iter().enumerate().flat_map(of_probe).collect()
}

/// Model minus measured place of the journals in standard deviations.
pub fn residuals(observed: &[JournalReading], terms: &Terms) -> DVector<f64> {
    let residual = |seen: &JournalReading| {
        let Some(Curve::Film(film)) = &terms.supports[seen.bearing].1.curve else { return 0.0 };
        let Some(place) = film.risen_m(seen.speed_rad_s * terms.speed_factor) else { return 0.0 };
        let (sin, cos) = seen.angle_rad.sin_cos();
        (place.dot(&Vector2::new(cos, sin)) - seen.moved_m) / seen.sigma_m
    };
    DVector::from_iterator(observed.len(), observed.iter().map(residual))
}

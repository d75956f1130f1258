//! The shaft centreline as evidence: where gap voltages say that the journals run, against where their films put them.

use nalgebra::{DVector, Vector2};

use crate::bearing::curve::Curve;
use crate::machine::drawing::Rotor;
use crate::machine::terms::Terms;
use crate::measurement::Reading;

/// Standard deviation of a probe's scale factor: API standard 670 allows 5 % either way.
const SCALE: f64 = 0.029;

/// What one probe says about its journal in one reading.
#[derive(Debug, Clone, Copy)]
pub struct Risen {
    bearing: usize,
    speed_rad_s: f64,
    angle_rad: f64,
    /// Towards the probe, from where the journal lay still, m.
    moved_m: f64,
    /// Standard deviation, m.
    sigma_m: f64,
}

/// What the gap voltages say. A probe's error of calibration is the same in all its readings, so that many say no more
/// than one.
pub fn observed(rotor: &Rotor, readings: &[Reading]) -> Vec<Risen> {
    let of_probe = |(p, probe): (usize, &crate::machine::drawing::Probe)| {
        let (Some(gap), Some(bearing)) = (probe.gap, rotor.bearing_of(probe)) else { return vec![] };
        let seen = |r: &Reading| Some((r.speed_rad_s(), gap.moved_m(r.gaps_v.get(p).copied().flatten()?)));
        let all: Vec<(f64, f64)> = readings.iter().filter_map(seen).collect();
        let shared = (all.len() as f64).sqrt();
        let risen = |(speed_rad_s, moved_m): (f64, f64)| Risen {
            bearing,
            speed_rad_s,
            angle_rad: probe.angle_deg.to_radians(),
            moved_m,
            sigma_m: (gap.accuracy_um * 1e-6).hypot(SCALE * moved_m) * shared,
        };
        all.into_iter().map(risen).collect()
    };
    rotor.probe.iter().enumerate().flat_map(of_probe).collect()
}

/// Model minus measured place of the journals in standard deviations; a speed that the film is not solved for says
/// nothing.
pub fn residuals(observed: &[Risen], terms: &Terms) -> DVector<f64> {
    let residual = |risen: &Risen| {
        let Some(Curve::Film(film)) = &terms.supports[risen.bearing].1.curve else { return 0.0 };
        let Some(place) = film.risen_m(risen.speed_rad_s) else { return 0.0 };
        let (sin, cos) = risen.angle_rad.sin_cos();
        (place.dot(&Vector2::new(cos, sin)) - risen.moved_m) / risen.sigma_m
    };
    DVector::from_iterator(observed.len(), observed.iter().map(residual))
}

//! What arrives: one 1x reading of four proximity probes at one speed.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use crate::scalar;

/// Probes of a machine: bearing 1 X, Y, bearing 2 X, Y.
pub const PROBES: usize = 4;

/// Real numbers in a reading: cosine and sine part of each probe.
pub const FEATURES: usize = 2 * PROBES;

/// One probe's 1x vector, zero-to-peak, in µm: `u(t) = cos_um·cos Wt + sin_um·sin Wt`, t = 0 at the keyphasor mark.
///
/// ```
/// use rotor_edge_core::reading::ProbeVector;
/// // A pure sine peaks a quarter turn after the mark: it lags by 90 degrees.
/// let vector = ProbeVector { cos_um: 0.0, sin_um: 12.5 };
/// assert_eq!(vector.peak_to_peak_um(), 25.0);
/// assert!((vector.lag_deg() - 90.0).abs() < 1e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProbeVector {
    /// Part in phase with the keyphasor mark, µm zero-to-peak.
    pub cos_um: f32,
    /// Part a quarter turn later, µm zero-to-peak.
    pub sin_um: f32,
}

impl ProbeVector {
    /// A probe that gave no value.
    pub const LOST: Self = Self { cos_um: f32::NAN, sin_um: f32::NAN };

    /// The vector of the phasor `Y`, `u = Re(Y e^{iWt})`, µm.
    #[inline]
    pub fn from_phasor(phasor: Complex<f32>) -> Self {
        Self { cos_um: phasor.re, sin_um: -phasor.im }
    }

    /// The phasor `Y = cos − i sin`, µm.
    #[inline]
    pub fn phasor(self) -> Complex<f32> {
        Complex::new(self.cos_um, -self.sin_um)
    }

    /// Both parts are finite numbers.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.cos_um.is_finite() && self.sin_um.is_finite()
    }

    /// Amplitude, µm zero-to-peak.
    pub fn amplitude_um(self) -> f32 {
        scalar::length([self.cos_um, self.sin_um])
    }

    /// Amplitude, µm peak-to-peak (what a vibration monitor displays).
    pub fn peak_to_peak_um(self) -> f32 {
        2.0 * self.amplitude_um()
    }

    /// Phase lag of the peak behind the keyphasor mark, degrees, 0 ≤ lag < 360.
    pub fn lag_deg(self) -> f32 {
        scalar::angle_deg(self.sin_um, self.cos_um)
    }
}

/// The four probe vectors at one speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Speed of rotation, rpm.
    pub speed_rpm: f32,
    /// Bearing 1 X, bearing 1 Y, bearing 2 X, bearing 2 Y.
    pub probes: [ProbeVector; PROBES],
}

impl Reading {
    /// `u_c1 u_s1 v_c1 v_s1 u_c2 u_s2 v_c2 v_s2`, µm zero-to-peak.
    pub fn features(&self) -> [f32; FEATURES] {
        features(&self.probes)
    }

    /// Phasors `Y = cos − i sin` of the four probes, µm.
    pub fn phasors(&self) -> [Complex<f32>; PROBES] {
        self.probes.map(ProbeVector::phasor)
    }

    /// Speed and all eight features are finite: no probe is lost.
    pub fn is_complete(&self) -> bool {
        self.speed_rpm.is_finite() && self.probes.iter().all(|probe| probe.is_finite())
    }

    /// Speed of rotation, rad/s.
    pub fn speed_rad_s(&self) -> f32 {
        rad_s(self.speed_rpm)
    }
}

/// Cosine and sine parts in the order of the features, µm.
pub fn features(probes: &[ProbeVector; PROBES]) -> [f32; FEATURES] {
    let [x1, y1, x2, y2] = probes;
    [x1.cos_um, x1.sin_um, y1.cos_um, y1.sin_um, x2.cos_um, x2.sin_um, y2.cos_um, y2.sin_um]
}

/// The four probe vectors of eight features, µm.
pub fn probe_vectors(features: &[f32; FEATURES]) -> [ProbeVector; PROBES] {
    let [a, b, c, d, e, f, g, h] = *features;
    [(a, b), (c, d), (e, f), (g, h)].map(|(cos_um, sin_um)| ProbeVector { cos_um, sin_um })
}

/// Speed in rad/s of a speed in rpm.
#[inline]
pub fn rad_s(speed_rpm: f32) -> f32 {
    speed_rpm * (core::f32::consts::TAU / 60.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phasor_reproduces_the_waveform_at_every_instant() {
        let vector = ProbeVector { cos_um: 3.0, sin_um: -7.0 };
        for step in 0..12 {
            let angle = f64::from(step) * 0.5;
            let waveform = 3.0 * angle.cos() - 7.0 * angle.sin();
            let y = vector.phasor();
            let rotated = f64::from(y.re) * angle.cos() - f64::from(y.im) * angle.sin();
            assert!((waveform - rotated).abs() < 1e-6);
        }
        assert_eq!(ProbeVector::from_phasor(vector.phasor()), vector);
    }

    #[test]
    fn lag_is_the_instant_of_the_peak() {
        let vector = ProbeVector { cos_um: -2.0, sin_um: 5.0 };
        let lag = f64::from(vector.lag_deg()).to_radians();
        let at = |angle: f64| -2.0 * angle.cos() + 5.0 * angle.sin();
        assert!(at(lag) > at(lag + 0.01) && at(lag) > at(lag - 0.01));
        assert!((at(lag) - f64::from(vector.amplitude_um())).abs() < 1e-5);
    }

    #[test]
    fn features_and_vectors_are_inverse_and_keep_the_stated_order() {
        let features = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let reading = Reading { speed_rpm: 60.0, probes: probe_vectors(&features) };
        assert_eq!(reading.features(), features);
        assert_eq!(reading.probes[2].sin_um, 6.0);
        assert!((reading.speed_rad_s() - core::f32::consts::TAU).abs() < 1e-6);
    }

    #[test]
    fn a_lost_probe_makes_the_reading_incomplete() {
        let mut reading = Reading { speed_rpm: 60.0, probes: probe_vectors(&[0.0; 8]) };
        assert!(reading.is_complete());
        reading.probes[3] = ProbeVector::LOST;
        assert!(!reading.is_complete());
    }
}

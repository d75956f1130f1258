//! The noise of a measured component: `relative · |Y| + floor`, as a rotor's file states it or as it is assumed.

use nalgebra::Complex;

use super::Reading;
use crate::machine::drawing::{Noise, Rotor};
use crate::statistics::scatter::{ASSUMED_LOG_SD, STATED_LOG_SD, Scatter};

/// Share of the amplitude, and of the median amplitude as floor.
const RELATIVE: f64 = 0.02;
/// Smallest floor, µm: what a proximity probe resolves at best.
const LEAST_FLOOR_UM: f64 = 1e-3;

/// Standard deviation of each component of a measured phasor, in the unit of both it and `floor`.
pub(crate) fn component_sd(relative: f64, floor: f64, measured: Complex<f64>) -> f64 {
    relative * measured.norm() + floor
}

impl Noise {
    /// As the rotor's file states it, else as assumed from the readings.
    pub fn of(rotor: &Rotor, readings: &[Reading]) -> Self {
        rotor.noise.unwrap_or_else(|| Self::assumed(readings))
    }

    /// Where no file states it: two percent, and two percent of the median amplitude as floor.
    pub fn assumed(readings: &[Reading]) -> Self {
        let mut sizes: Vec<f64> =
            readings.iter().flat_map(|r| r.probes.iter().flatten()).map(|y| y.norm()).collect();
        sizes.sort_by(f64::total_cmp);
        let median_um = sizes.get(sizes.len() / 2).map_or(1.0, |m| m * 1e6);
        Self { relative: RELATIVE, floor_um: (RELATIVE * median_um).max(LEAST_FLOOR_UM), ..Self::default() }
    }

    /// Standard deviation of each component of a measured phasor, m.
    pub fn sigma_m(&self, measured_m: Complex<f64>) -> f64 {
        component_sd(self.relative, self.floor_um * 1e-6, measured_m)
    }

    /// What a fit found over what is stated; as stated where there was none.
    pub fn scatter(&self) -> Scatter {
        Scatter {
            scale: self.scale.unwrap_or(1.0),
            correlation: self.correlation.unwrap_or(0.0),
            between_runs: self.between_runs.unwrap_or(0.0),
        }
    }

    /// How far the noise that a rotor is measured with is trusted: standard deviation of the logarithm of its size.
    pub fn log_sd(rotor: &Rotor) -> f64 {
        if rotor.noise.is_some() { STATED_LOG_SD } else { ASSUMED_LOG_SD }
    }

    /// A sentence on the assumption, where the rotor's file states no noise.
    pub fn assumption(&self, rotor: &Rotor) -> Option<String> {
        rotor.noise.is_none().then(|| {
            format!(
                "The rotor's file has no [noise]; {:.0} % of the amplitude and {:.3} µm were assumed.",
                self.relative * 100.0,
                self.floor_um
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    #[test]
    fn noise_floor_is_2_percent_of_median_valid_amplitude() {
        let at = |sizes_um: [Option<f64>; 3]| Reading {
            speed_rpm: 3000.0,
            probes: sizes_um.map(|s| s.map(|s| Complex::new(0.0, -s * 1e-6))).to_vec(),
            ..Reading::default()
        };
        let noise =
            Noise::assumed(&[at([Some(4.0), None, Some(900.0)]), at([Some(1.0), Some(5.0), Some(7.0)])]);
        assert_eq!(noise.relative, 0.02);
        assert!((noise.floor_um - 0.1).abs() < 1e-12);
        assert!(Noise::assumed(&[]).floor_um > 0.0);
    }
}

//! Noise to go by where nobody stated it.

use crate::machine::drawing::Noise;
use crate::measurement::Reading;

/// Share of the amplitude, and of the median amplitude as floor.
const RELATIVE: f64 = 0.02;
/// Smallest floor, µm: what a proximity probe resolves at best.
const LEAST_FLOOR_UM: f64 = 1e-3;

/// Noise to go by where a rotor's file states none: two percent, and two percent of the median
/// amplitude as floor.
pub fn assumed_noise(readings: &[Reading]) -> Noise {
    let mut sizes: Vec<f64> =
        readings.iter().flat_map(|r| r.probes.iter().flatten()).map(|y| y.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    let median_um = sizes.get(sizes.len() / 2).map_or(1.0, |m| m * 1e6);
    Noise { relative: RELATIVE, floor_um: (RELATIVE * median_um).max(LEAST_FLOOR_UM), ..Noise::default() }
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
            assumed_noise(&[at([Some(4.0), None, Some(900.0)]), at([Some(1.0), Some(5.0), Some(7.0)])]);
        assert_eq!(noise.relative, 0.02);
        assert!((noise.floor_um - 0.1).abs() < 1e-12);
        assert!(assumed_noise(&[]).floor_um > 0.0);
    }
}

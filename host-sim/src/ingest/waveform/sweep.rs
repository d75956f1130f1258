//! What a change of speed does to the response, taken off: a run-up as if each of its speeds had been held.
//!
//! The unbalance of a shaft whose speed rises by α rad/s² turns with `φ̈ = α`. Its response at the speed Ω is that of a
//! steady speed and, to first order in α, `−(iα/2) Y''(Ω)` with the second derivative by Ω (of the impulse response h,
//! `∫ h(τ) e^{iφ(t−τ)} dτ` with `φ(t−τ) = φ − Ωτ + ατ²/2`); the force's own growth as Ω² adds α/Ω² of Y, 1e-4 at the largest
//! drift of a window, which is left. The mean over a window through which the speed rises by ΔΩ adds `Y'' ΔΩ²/24`. Both go by
//! the curvature, which a parabola through the readings shows.

use rotor_edge_desktop::units::{SECONDS_A_DAY, rad_s};

use nalgebra::{Complex, Matrix3, Vector3};
use rotor_edge_desktop::measurement::Reading;

use super::vectors::mean_of;

/// A parabola is laid through so many bins' breadth.
const BREADTH_BINS: f64 = 3.0;
/// Fewer readings than this do not show more than the parabola itself.
const FEWEST_READINGS: usize = 5;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RateCompensation {
    pub bins: usize,
    /// Those with too few readings around them, which stay as measured.
    pub left: usize,
    /// The largest change of a vector, µm, and its speed.
    pub largest_um: f64,
    pub at_rpm: f64,
}

/// Readings that follow one another, in bins of `bin_rpm`; each vector that of a steady speed in the middle of its bin.
pub fn steady(
    readings: &[Reading],
    bins: &[&[Reading]],
    bin_rpm: f64,
    revolutions: u16,
) -> (Vec<Reading>, RateCompensation) {
    let mut done = RateCompensation::default();
    let mut begins = 0;
    let each = bins.iter().map(|bin| {
        let mut mean = mean_of(bin);
        let around = around(readings, begins, bin.len(), mean.speed_rpm, bin_rpm);
        begins += bin.len();
        done.bins += 1;
        if !compensate(&mut mean, around, revolutions, &mut done) {
            done.left += 1;
        }
        mean
    });
    (each.collect(), done)
}

/// Neighbours of a bin on the same way up or down.
fn around(readings: &[Reading], begins: usize, length: usize, speed_rpm: f64, bin_rpm: f64) -> &[Reading] {
    let is_near = |r: &&Reading| (r.speed_rpm - speed_rpm).abs() <= 0.5 * BREADTH_BINS * bin_rpm;
    let before = readings[..begins].iter().rev().take_while(is_near).count();
    let after = readings[begins + length..].iter().take_while(is_near).count();
    &readings[begins - before..begins + length + after]
}

fn compensate(mean: &mut Reading, around: &[Reading], revolutions: u16, done: &mut RateCompensation) -> bool {
    let omega = |r: &Reading| rad_s(r.speed_rpm);
    let middle = omega(mean);
    let Some(alpha) = acceleration(around) else { return false };
    let rise = alpha * 60.0 * f64::from(revolutions) / mean.speed_rpm;
    let factor = Complex::new(-rise * rise / 24.0, 0.5 * alpha);
    let mut is_whole = true;
    for probe in 0..mean.probes.len() {
        let Some(measured) = mean.probes[probe] else { continue };
        let points: Vec<_> =
            around.iter().filter_map(|r| Some((omega(r) - middle, r.probes[probe]?))).collect();
        let Some([y, _, bend]) = parabola(&points) else {
            is_whole = false;
            continue;
        };
        let steady = y + 2.0 * bend * factor;
        let change_um = 1e6 * (steady - measured).norm();
        if change_um > done.largest_um {
            (done.largest_um, done.at_rpm) = (change_um, mean.speed_rpm);
        }
        mean.probes[probe] = Some(steady);
    }
    is_whole
}

/// Slope of the speed over time, rad/s².
fn acceleration(readings: &[Reading]) -> Option<f64> {
    let points: Vec<(f64, Complex<f64>)> = (readings.iter())
        .filter_map(|r| Some((SECONDS_A_DAY * r.time_d?, Complex::new(rad_s(r.speed_rpm), 0.0))))
        .collect();
    let from = points.first()?.0;
    let points: Vec<_> = points.iter().map(|(t, speed)| (t - from, *speed)).collect();
    let middle = 0.5 * points.last()?.0;
    let [_, slope, bend] = parabola(&points)?;
    Some((slope + 2.0 * middle * bend).re)
}

/// Least squares: `y = a + b x + c x²`.
fn parabola(points: &[(f64, Complex<f64>)]) -> Option<[Complex<f64>; 3]> {
    if points.len() < FEWEST_READINGS {
        return None;
    }
    // in parts of the reach, so that the normal equations stay well conditioned
    let reach = points.iter().map(|p| p.0.abs()).fold(0.0, f64::max);
    if reach <= 0.0 {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Vector3::<Complex<f64>>::zeros());
    for (x, y) in points {
        let row = Vector3::new(1.0, x / reach, (x / reach).powi(2));
        normal += row * row.transpose();
        right += row.map(|v| v * y);
    }
    let inverse = normal.try_inverse()?;
    let found = inverse.map(Complex::from) * right;
    Some([found[0], found[1] / reach, found[2] / (reach * reach)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabola_is_found_in_own_points_and_four_are_too_few() {
        let [a, b, c] = [Complex::new(1.0, -2.0), Complex::new(0.5, 0.25), Complex::new(-3.0, 1.0)];
        let points: Vec<_> = (-3..4).map(|i| (0.1 * f64::from(i), 0.1 * f64::from(i))).collect();
        let points: Vec<_> = points.into_iter().map(|(x, same)| (x, a + b * x + c * same * same)).collect();
        let found = parabola(&points).unwrap();
        assert!([a, b, c].iter().zip(found).all(|(known, found)| (known - found).norm() < 1e-12));
        assert_eq!(parabola(&points[..4]), None);
    }
}

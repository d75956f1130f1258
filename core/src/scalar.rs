//! The only place with scalar transcendental functions, each called by path.
//!
//! As methods (`x.sqrt()`) they would silently become std's on the host and micromath's approximations on the target.
//! Exact ones come from libm. micromath's (worst error 6 % for the square root) serve the swarm's random starts alone.

use nalgebra::Complex;

/// Square root, correctly rounded.
#[inline]
pub(crate) fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Square root, correctly rounded, for what no firmware links.
#[inline]
pub(crate) fn sqrt_f64(x: f64) -> f64 {
    libm::sqrt(x)
}

/// Length of a plane vector. Squares overflow above 1e19, far outside every quantity here.
#[inline]
pub(crate) fn length([x, y]: [f32; 2]) -> f32 {
    sqrt(x * x + y * y)
}

/// Angle of `(x, y)` in degrees, 0 ≤ angle < 360.
#[inline]
pub(crate) fn angle_deg(y: f32, x: f32) -> f32 {
    let degrees = libm::atan2f(y, x).to_degrees();
    let turned = if degrees < 0.0 { degrees + 360.0 } else { degrees };
    // A tiny negative angle rounds up to 360 exactly.
    if turned >= 360.0 { 0.0 } else { turned }
}

/// |re| + |im|: within √2 of the modulus, no square root.
#[inline]
pub(crate) fn size(z: Complex<f32>) -> f32 {
    z.re.abs() + z.im.abs()
}

/// `sum + a·b`, part by part: a chain of four multiply-adds, where the product made first takes two operations more.
#[inline(always)]
pub(crate) fn add_product(sum: Complex<f32>, a: Complex<f32>, b: Complex<f32>) -> Complex<f32> {
    Complex::new(sum.re + a.re * b.re - a.im * b.im, sum.im + a.re * b.im + a.im * b.re)
}

/// `sum − a·b`, in the same way.
#[inline(always)]
pub(crate) fn subtract_product(sum: Complex<f32>, a: Complex<f32>, b: Complex<f32>) -> Complex<f32> {
    Complex::new(sum.re - a.re * b.re + a.im * b.im, sum.im - a.re * b.im - a.im * b.re)
}

/// The largest [`size`] of some numbers; those that are not numbers are left out.
#[inline]
pub(crate) fn largest_size(numbers: &[Complex<f32>]) -> f32 {
    numbers.iter().fold(0.0, |largest, &z| greater(largest, size(z)))
}

/// A finite number that is not negative.
#[inline]
pub(crate) fn is_amount(number: f32) -> bool {
    (0.0..=f32::MAX).contains(&number)
}

/// The greater number; the first if the second is not a number. `f32::max` treats both alike, which takes twice the code.
#[inline(always)]
pub(crate) fn greater(number: f32, other: f32) -> f32 {
    if other > number { other } else { number }
}

/// The lesser number; the first if the second is not a number.
#[inline(always)]
pub(crate) fn lesser(number: f32, other: f32) -> f32 {
    if other < number { other } else { number }
}

/// 1/z, scaled first: the plain formula squares z and overflows f32 from 1e19 on.
#[inline]
pub(crate) fn reciprocal(z: Complex<f32>) -> Complex<f32> {
    let scale = 1.0 / size(z);
    let unit = z * scale;
    let factor = scale / (unit.re * unit.re + unit.im * unit.im);
    Complex::new(unit.re * factor, -unit.im * factor)
}

/// A point of the unit disc from two numbers in 0..1, uniform to within micromath's few per cent.
#[inline]
pub(crate) fn rough_disc_point(radial: f32, angular: f32) -> [f32; 2] {
    let radius = micromath::F32Ext::sqrt(radial);
    let angle = core::f32::consts::TAU * (angular - 0.5);
    [radius * micromath::F32Ext::cos(angle), radius * micromath::F32Ext::sin(angle)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reciprocal_agrees_with_f64_from_tiny_to_huge() {
        for scale in [1e-18_f32, 1e-3, 1.0, 1e9, 1e25] {
            for (re, im) in [(1.0_f32, 0.0_f32), (0.0, -2.0), (3.0, 4.0), (-5.0, 1e-3)] {
                let z = Complex::new(re * scale, im * scale);
                let square = f64::from(z.re).powi(2) + f64::from(z.im).powi(2);
                let got = reciprocal(z);
                let error = (f64::from(got.re) - f64::from(z.re) / square)
                    .hypot(f64::from(got.im) + f64::from(z.im) / square);
                assert!(error * square.sqrt() < 3e-7, "{z}: {got}");
            }
        }
    }

    #[test]
    fn angle_is_within_a_turn_for_every_quadrant_and_both_zeros() {
        for (y, x, want) in
            [(0.0, 1.0, 0.0), (1.0, 0.0, 90.0), (0.0, -1.0, 180.0), (-1.0, 0.0, 270.0), (-0.0, 1.0, 0.0)]
        {
            assert!((angle_deg(y, x) - want).abs() < 1e-4);
        }
        assert!((0.0..360.0).contains(&angle_deg(-1e-9, 1.0)));
    }

    #[test]
    fn rough_disc_points_stay_within_ten_per_cent_of_the_disc() {
        for i in 0..64u8 {
            for j in 0..64u8 {
                let [x, y] = rough_disc_point(f32::from(i) / 64.0, f32::from(j) / 64.0);
                assert!(x.hypot(y) < 1.1);
            }
        }
    }
}

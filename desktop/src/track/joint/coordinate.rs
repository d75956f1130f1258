//! Coordinate in which an unbalance drifts: its complex logarithm.
//!
//! The readings depend on the product of unbalance and response. With a drift in g·mm, a smaller unbalance on softer
//! bearings would explain the same readings at a lower cost, and every unbalance would be biased low. A relative drift
//! has no such bias: `U = U₀ exp(z)` with `z = ℓ + iφ`.
//!
//! Near zero the logarithm is useless: an error of one day turns the angle by half a turn. A plane whose unbalance comes
//! close to zero anywhere in the record has the coordinate `U = U₀ + s z`, with `s` its rms over the record.

use nalgebra::Complex;

type C = Complex<f64>;

/// Share of the larger plane's size (rms over the record) below which an unbalance counts as near zero: a day
/// alone tells an unbalance to some 15 % of it, and the exponential is straight enough within a third of the
/// unbalance.
const NEAR_ZERO: f64 = 0.2;

/// How one plane's unbalance (kg·m) follows from its complex coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coordinate {
    /// `start · exp(z)`.
    Relative { start: C },
    /// `start + size · z`.
    Absolute { start: C, size: f64 },
}

impl Coordinate {
    /// For a plane that begins at `start` and goes about along `path`, all in kg·m; `largest` is the size (rms) of
    /// the larger plane.
    pub fn new(start: C, path: &[C], largest: f64) -> Self {
        let floor = NEAR_ZERO * largest;
        let least = path.iter().map(|u| u.norm()).fold(start.norm(), f64::min);
        if least < floor || least == 0.0 {
            let size = size(path).max(floor).max(f64::MIN_POSITIVE);
            return Self::Absolute { start, size };
        }
        Self::Relative { start }
    }

    /// The unbalance at a coordinate, kg·m.
    pub fn unbalance(self, z: C) -> C {
        match self {
            Self::Relative { start } => start * z.exp(),
            Self::Absolute { start, size } => start + z * size,
        }
    }

    /// Its derivative by the coordinate, kg·m.
    pub fn slope(self, z: C) -> C {
        match self {
            Self::Relative { .. } => self.unbalance(z),
            Self::Absolute { size, .. } => C::from(size),
        }
    }

    /// The coordinate of an unbalance (kg·m); its angle is unwrapped to the value nearest to `near`.
    pub fn of(self, unbalance: C, near: C) -> C {
        match self {
            Self::Relative { start } => {
                let turn = std::f64::consts::TAU;
                let z = (unbalance / start).ln();
                C::new(z.re, z.im + turn * ((near.im - z.im) / turn).round())
            }
            Self::Absolute { start, size } => (unbalance - start) / size,
        }
    }
}

/// Root mean square of a plane's unbalance.
pub fn size(path: &[C]) -> f64 {
    (path.iter().map(|u| u.norm_sqr()).sum::<f64>() / path.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coordinates() -> [Coordinate; 2] {
        let start = C::new(3e-4, -1e-4);
        [Coordinate::new(start, &[start], 4e-4), Coordinate::new(start, &[start, start * 0.1, -start], 4e-4)]
    }

    #[test]
    fn plane_through_zero_is_absolute_and_others_are_relative() {
        let [away, through] = coordinates();
        assert!(matches!(away, Coordinate::Relative { .. }));
        assert!(matches!(through, Coordinate::Absolute { .. }));
        let none = Coordinate::new(C::from(0.0), &[C::from(0.0)], 4e-4);
        assert!((none.slope(C::from(0.0)).norm() - NEAR_ZERO * 4e-4).abs() < 1e-12);
        assert!(Coordinate::new(C::from(0.0), &[], 0.0).slope(C::from(0.0)).norm() > 0.0);
    }

    #[test]
    fn coordinate_round_trips_and_slope_equals_difference() {
        for c in coordinates() {
            let z = C::new(0.2, 7.0);
            let u = c.unbalance(z);
            assert!((c.of(u, z) - z).norm() < 1e-12);
            let step = C::new(1e-6, 2e-6);
            let difference = (c.unbalance(z + step) - c.unbalance(z - step)) / (step * 2.0);
            assert!((difference - c.slope(z)).norm() < 1e-9 * c.slope(z).norm());
        }
    }

    #[test]
    fn angle_is_unwrapped_over_several_turns() {
        let c = coordinates()[0];
        let mut z = C::from(0.0);
        for k in 0..100 {
            let u = c.unbalance(C::new(0.0, 0.3 * f64::from(k)));
            z = c.of(u, z);
        }
        assert!((z.im - 29.7).abs() < 1e-9);
    }
}

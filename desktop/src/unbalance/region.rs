//! The region that holds an unbalance with a probability of 95 %.
//!
//! An estimate `û` with the 2 × 2 covariance `C` of its real and imaginary part has the elliptic region
//! `(u − û)ᵀ C⁻¹ (u − û) ≤ 2 F₂,ν(0.95)`, and one component alone lies within Student's t of ν degrees of freedom; ν are those of
//! the noise scale in `C`. A known noise scale is the limit ν → ∞: χ² of two degrees of freedom, and the normal law.

use nalgebra::{Complex, DMatrix, Matrix2, Vector2};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use crate::decomposition::hermitian;

type C = Complex<f64>;

/// Degrees of freedom of a noise scale that is known.
pub const KNOWN_NOISE: f64 = f64::INFINITY;
/// Probability outside intervals and regions.
const OUTSIDE: f64 = 0.05;

/// Half-width of the 95 % interval of one component, in standard deviations.
pub fn component_95(freedom: f64) -> f64 {
    let below = 1.0 - 0.5 * OUTSIDE;
    if freedom == KNOWN_NOISE {
        return Normal::standard().inverse_cdf(below);
    }
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(below))
}

/// Radius of the circle that holds a two-dimensional vector with 95 %, in standard deviations of a component: `√(2 F₂,ν(0.95))`.
///
/// For two components the F distribution has a closed form, `P(F > f) = (1 + 2f/ν)^(−ν/2)`.
pub fn vector_95(freedom: f64) -> f64 {
    let chi_square = -2.0 * OUTSIDE.ln();
    if freedom == KNOWN_NOISE {
        return chi_square.sqrt();
    }
    if freedom > 0.0 { (freedom * (chi_square / freedom).exp_m1()).sqrt() } else { f64::INFINITY }
}

/// An unbalance and the ellipse that holds it with 95 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnbalanceRegion {
    pub unbalance_g_mm: C,
    /// Covariance of its real and imaginary part, g²·mm².
    pub covariance_g2_mm2: Matrix2<f64>,
    /// Major and minor semi-axis, g·mm; infinite where the covariance is not finite.
    pub semi_axes_g_mm: [f64; 2],
    /// Direction of the major axis, degrees.
    pub major_deg: f64,
    freedom: f64,
}

impl UnbalanceRegion {
    /// `freedom` are the degrees of freedom of the noise scale in the covariance, [`KNOWN_NOISE`] if it was not estimated.
    pub fn new(unbalance_g_mm: C, covariance_g2_mm2: Matrix2<f64>, freedom: f64) -> Self {
        let eigen = hermitian(DMatrix::from_column_slice(2, 2, covariance_g2_mm2.as_slice()));
        let major = usize::from(eigen.eigenvalues[1] > eigen.eigenvalues[0]);
        let axis = eigen.eigenvectors.column(major);
        let radius = vector_95(freedom);
        let semi_axis = |i: usize| match eigen.eigenvalues[i] {
            variance if variance.is_nan() => f64::INFINITY,
            variance => radius * variance.max(0.0).sqrt(),
        };
        Self {
            unbalance_g_mm,
            covariance_g2_mm2,
            semi_axes_g_mm: [major, 1 - major].map(semi_axis),
            major_deg: axis[1].atan2(axis[0]).to_degrees(),
            freedom,
        }
    }

    /// Standard deviation along a direction of unit length, g·mm.
    fn sd_along_g_mm(&self, direction: C) -> f64 {
        let along = Vector2::new(direction.re, direction.im);
        match along.dot(&(self.covariance_g2_mm2 * along)) {
            variance if variance.is_nan() => f64::INFINITY,
            variance => variance.max(0.0).sqrt(),
        }
    }

    /// Major and minor semi-axis, g·mm, then the direction of the major axis, degrees.
    pub fn ellipse(&self) -> [f64; 3] {
        let [major, minor] = self.semi_axes_g_mm;
        [major, minor, self.major_deg]
    }

    /// Its own direction, of unit length; zero for no unbalance.
    fn direction(&self) -> C {
        self.unbalance_g_mm / self.unbalance_g_mm.norm().max(f64::MIN_POSITIVE)
    }

    /// Half-extents of the ellipse along the unbalance and across it, g·mm.
    pub fn extents_g_mm(&self) -> [f64; 2] {
        let along = self.direction();
        [along, along * C::i()].map(|d| vector_95(self.freedom) * self.sd_along_g_mm(d))
    }

    /// 95 % half-width of the magnitude by itself, g·mm.
    pub fn half_width_95_g_mm(&self) -> f64 {
        component_95(self.freedom) * self.sd_along_g_mm(self.direction())
    }

    /// 95 % interval of the magnitude by itself, along the direction of the estimate, g·mm; from zero where the ellipse holds
    /// the origin.
    pub fn magnitude_95_g_mm(&self) -> [f64; 2] {
        let (size, half) = (self.unbalance_g_mm.norm(), self.half_width_95_g_mm());
        let low = if self.holds(C::from(0.0)) { 0.0 } else { (size - half).max(0.0) };
        [low, size + half]
    }

    /// Whether the ellipse holds this unbalance, g·mm.
    pub fn holds(&self, unbalance_g_mm: C) -> bool {
        let [major, minor] = self.semi_axes_g_mm;
        let off = (unbalance_g_mm - self.unbalance_g_mm) * C::from_polar(1.0, -self.major_deg.to_radians());
        (off.re / major).hypot(off.im / minor) <= 1.0
    }
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{ChiSquared, FisherSnedecor};

    use super::*;

    #[test]
    fn f_quantile_of_infinite_freedom_is_chi_square() {
        let f = |k: f64, freedom: f64| FisherSnedecor::new(k, freedom).unwrap().inverse_cdf(0.95);
        // closed form and Student's t against F of as many degrees of freedom
        for freedom in [1.0, 2.0, 3.5, 10.0, 200.0] {
            assert!((vector_95(freedom) / (2.0 * f(2.0, freedom)).sqrt() - 1.0).abs() < 1e-9, "{freedom}");
            assert!((component_95(freedom) / f(1.0, freedom).sqrt() - 1.0).abs() < 1e-9, "{freedom}");
        }
        // and their limit against chi-square of one and two components
        let chi_square = |k: f64| ChiSquared::new(k).unwrap().inverse_cdf(0.95).sqrt();
        assert!((vector_95(KNOWN_NOISE) / chi_square(2.0) - 1.0).abs() < 1e-9);
        assert!((component_95(KNOWN_NOISE) / chi_square(1.0) - 1.0).abs() < 1e-9);
        // which F and t exceed, relative, by 1.5/ν (-ln 0.05 / 2) and 1.21/ν ((z² + 1)/4), to first order
        let z = component_95(KNOWN_NOISE);
        for (of, first) in
            [(vector_95 as fn(f64) -> f64, -(0.05_f64).ln() / 2.0), (component_95, (z * z + 1.0) / 4.0)]
        {
            let excess = 1e4 * (of(1e4) / of(KNOWN_NOISE) - 1.0);
            assert!((excess / first - 1.0).abs() < 1e-2, "{excess} {first}");
        }
    }

    #[test]
    fn round_unit_region_has_chi_square_radius_and_interval() {
        let region = UnbalanceRegion::new(C::new(0.0, 10.0), Matrix2::identity(), 1e6);
        let radius = (-2.0 * 0.05_f64.ln()).sqrt();
        assert!(region.semi_axes_g_mm.iter().all(|a| (a - radius).abs() < 1e-3));
        let [low, high] = region.magnitude_95_g_mm();
        assert!((low - 8.04).abs() < 1e-2 && (high - 11.96).abs() < 1e-2);
    }

    #[test]
    fn interval_starts_at_zero_only_if_region_holds_origin() {
        let low = |size: f64| {
            UnbalanceRegion::new(C::from(size), Matrix2::identity(), KNOWN_NOISE).magnitude_95_g_mm()[0]
        };
        assert!(low(2.44) == 0.0 && low(2.46) > 0.0);
    }

    #[test]
    fn ellipse_of_known_covariance_has_its_axes_and_direction() {
        // 2 and 1 g·mm standard deviation, the first at 30°
        let turn = nalgebra::Rotation2::new(30f64.to_radians()).into_inner();
        let covariance = turn * Matrix2::new(4.0, 0.0, 0.0, 1.0) * turn.transpose();
        let u = C::from_polar(20.0, 30f64.to_radians());
        let region = UnbalanceRegion::new(u, covariance, KNOWN_NOISE);
        let radius = (-2.0 * 0.05_f64.ln()).sqrt();
        let near = |a: [f64; 2]| (a[0] - 2.0 * radius).abs() < 1e-9 && (a[1] - radius).abs() < 1e-9;
        assert!(near(region.semi_axes_g_mm) && near(region.extents_g_mm()));
        assert!((region.major_deg.rem_euclid(180.0) - 30.0).abs() < 1e-6);
        let off = |along: f64, across: f64| {
            region.holds(u + C::new(along, across) * C::from_polar(1.0, 30f64.to_radians()))
        };
        assert!(off(1.99 * radius, 0.0) && !off(2.01 * radius, 0.0));
        assert!(off(0.0, -0.99 * radius) && !off(0.0, -1.01 * radius));
    }

    #[test]
    fn covariance_that_is_not_finite_has_infinite_region() {
        let unknown = Matrix2::from_diagonal_element(f64::INFINITY);
        let region = UnbalanceRegion::new(C::from(5.0), unknown, KNOWN_NOISE);
        assert!(region.semi_axes_g_mm.iter().all(|a| a.is_infinite()));
        assert!(region.holds(C::from(-1e9)));
    }
}

//! The unbalance of one mounting from what was learned, with its region.

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector2};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use super::learning::{Learned, Seen, factor, placement};
use crate::error::Error;

type C = Complex<f64>;

/// Rounds over the covariance, which depends on the unbalance through what is not known of the influence.
const ROUNDS: usize = 8;
/// An unbalance this many times the largest stated weight is not expected; keeps planes apart that nothing else does.
const EXPECTED: f64 = 10.0;
/// Probability of intervals and regions.
const PROBABILITY: f64 = 0.95;

#[derive(Debug, Clone, PartialEq)]
pub struct PlaneEstimate {
    /// Beyond the base run, g·mm.
    pub unbalance_g_mm: C,
    /// Covariance of its real and imaginary part, g²·mm².
    pub covariance: Matrix2<f64>,
    /// Magnitudes, g·mm: the end of the estimate along its own direction; from nothing where the region holds the origin.
    pub interval_95: [f64; 2],
    /// Ellipse that holds the unbalance with 95 %: major and minor semi-axis, g·mm.
    pub semi_axes_g_mm: [f64; 2],
    /// Direction of the major axis, degrees.
    pub major_deg: f64,
}

impl PlaneEstimate {
    fn new(unbalance_g_mm: C, covariance: Matrix2<f64>, freedom: f64) -> Self {
        let quantile =
            StudentsT::new(0.0, 1.0, freedom).map_or(1.96, |t| t.inverse_cdf(0.5 + PROBABILITY / 2.0));
        let square = FisherSnedecor::new(2.0, freedom).map_or(5.99, |f| 2.0 * f.inverse_cdf(PROBABILITY));
        let u = Vector2::new(unbalance_g_mm.re, unbalance_g_mm.im);
        let size = u.norm();
        let along = u / size.max(f64::MIN_POSITIVE);
        let half = quantile * along.dot(&(covariance * along)).max(0.0).sqrt();
        let inverse = covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
        let holds_origin = u.dot(&(inverse * u)) <= square;
        let eigen = covariance.symmetric_eigen();
        let major = eigen.eigenvalues.imax();
        let axis = eigen.eigenvectors.column(major);
        Self {
            unbalance_g_mm,
            covariance,
            interval_95: [if holds_origin { 0.0 } else { (size - half).max(0.0) }, size + half],
            semi_axes_g_mm: [major, 1 - major].map(|i| (square * eigen.eigenvalues[i].max(0.0)).sqrt()),
            major_deg: axis[1].atan2(axis[0]).to_degrees(),
        }
    }
}

/// Unbalance of every plane of a mounting relative to the base run.
///
/// Least squares with the covariance of the mounting and of what is not known of the influence.
///
/// # Errors
/// If a covariance is singular.
pub fn estimated(
    learned: &Learned,
    seen: &Seen,
    planes: usize,
    largest_g_mm: f64,
) -> Result<Vec<PlaneEstimate>, Error> {
    let mut unbalance = DVector::zeros(2 * planes);
    let mut covariance = DMatrix::zeros(0, 0);
    let complex = |u: &DVector<f64>| (0..planes).map(|j| C::new(u[j], u[planes + j])).collect::<Vec<_>>();
    let expected = DMatrix::from_diagonal_element(2 * planes, 2 * planes, (EXPECTED * largest_g_mm).powi(-2));
    let bare = learned.predict(seen, &vec![C::from(0.0); planes], false).mean;
    for _ in 0..ROUNDS {
        let expectation = learned.predict(seen, &complex(&unbalance), false);
        let noise = factor(expectation.covariance)?;
        let weighted = noise.solve(&expectation.per_weight);
        let solved = factor(expectation.per_weight.tr_mul(&weighted) + &expected)?;
        unbalance = solved.solve(&weighted.tr_mul(&(&seen.y - &bare)));
        covariance = solved.inverse();
    }
    let found = complex(&unbalance);
    covariance += placement(&found, learned.placement);
    let of = |j: usize| {
        let at = [j, planes + j];
        PlaneEstimate::new(found[j], Matrix2::from_fn(|a, b| covariance[(at[a], at[b])]), learned.freedom())
    };
    Ok((0..planes).map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_unit_region_has_chi_square_radius_and_interval() {
        let estimate = PlaneEstimate::new(C::new(0.0, 10.0), Matrix2::identity(), 1e6);
        // chi-square of two degrees of freedom: -2 ln 0.05
        let radius = (-2.0 * 0.05_f64.ln()).sqrt();
        assert!(estimate.semi_axes_g_mm.iter().all(|a| (a - radius).abs() < 1e-3));
        assert!(
            (estimate.interval_95[0] - 8.04).abs() < 1e-2 && (estimate.interval_95[1] - 11.96).abs() < 1e-2
        );
    }

    #[test]
    fn interval_starts_at_zero_only_if_region_holds_origin() {
        let low = |size: f64| PlaneEstimate::new(C::from(size), Matrix2::identity(), 1e6).interval_95[0];
        assert!(low(2.44) == 0.0 && low(2.46) > 0.0);
    }
}

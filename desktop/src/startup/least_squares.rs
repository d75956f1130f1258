//! The resonance by least squares: the two-degree model at every speed, its force free.

use nalgebra::{Complex, DVector};

use super::half_power::{half_power, peak};
use super::minimum::minimum;
use super::series::Point;
use super::{Modal, UncertainValue};

type C = Complex<f64>;

/// Where the search starts if there are no half-power points.
const TYPICAL_DAMPING: f64 = 0.1;

/// The two-degree model fitted to a start-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastSquares {
    pub natural_rad_s: UncertainValue,
    pub damping_ratio: UncertainValue,
    /// Unbalance per mass, `U/m` as felt along the direction, m.
    pub eccentricity_m: C,
    /// Standard deviation of each component of that, m.
    pub eccentricity_sd_m: f64,
    /// χ² per real number: far above 1 where the two-degree model is not what moved.
    pub chi2_per_value: f64,
    /// Real numbers that it was fitted to.
    pub values: usize,
}

/// Real numbers that are fitted: natural speed, damping, and both components of the force.
pub const FITTED: usize = 4;

impl LeastSquares {
    pub fn modal(&self) -> Modal {
        Modal { natural_rad_s: self.natural_rad_s.value, damping_ratio: self.damping_ratio.value }
    }
}

/// Fits natural speed, damping and one complex force to a whole start-up.
///
/// # Errors
/// One sentence where there is no resonance, or less is measured than sought.
pub fn least_squares(points: &[Point]) -> Result<LeastSquares, String> {
    let top = peak(points)?;
    if points.len() < 4 {
        return Err("fewer than four readings, too few for a fit".into());
    }
    let guess = half_power(points)
        .map_or(Modal { natural_rad_s: points[top].speed_rad_s, damping_ratio: TYPICAL_DAMPING }, |found| {
            found.modal
        });
    let modal = |x: &DVector<f64>| Modal { natural_rad_s: x[0].exp(), damping_ratio: x[1].exp() };
    let start = DVector::from_row_slice(&[guess.natural_rad_s.ln(), guess.damping_ratio.ln()]);
    let residuals = |x: &DVector<f64>| {
        let of = modal(x);
        let force = force(points, &of).0;
        DVector::from_iterator(
            2 * points.len(),
            points.iter().flat_map(|p| {
                let off = (p.motion_m - force * of.per_eccentricity(p.speed_rad_s)) / p.sigma_m;
                [off.re, off.im]
            }),
        )
    };
    let (at, covariance) = minimum(start, residuals);
    let covariance =
        covariance.ok_or_else(|| "the readings leave natural speed or damping open".to_string())?;
    let best = modal(&at);
    let (eccentricity_m, eccentricity_sd_m) = force(points, &best);
    let value = |i: usize, value: f64| UncertainValue { value, sd: value * covariance[(i, i)].sqrt() };
    Ok(LeastSquares {
        natural_rad_s: value(0, best.natural_rad_s),
        damping_ratio: value(1, best.damping_ratio),
        eccentricity_m,
        eccentricity_sd_m,
        chi2_per_value: residuals(&at).norm_squared() / (2 * points.len()) as f64,
        values: 2 * points.len(),
    })
}

/// The force that fits best, and the standard deviation of its components.
fn force(points: &[Point], modal: &Modal) -> (C, f64) {
    let (mut product, mut weight) = (C::from(0.0), 0.0);
    for p in points {
        let h = modal.per_eccentricity(p.speed_rad_s) / p.sigma_m;
        product += h.conj() * p.motion_m / p.sigma_m;
        weight += h.norm_sqr();
    }
    (product / weight, weight.sqrt().recip())
}

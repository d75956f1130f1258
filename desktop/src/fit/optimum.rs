//! What a search ends with.

use nalgebra::{Complex, DMatrix, DVector};

use super::data::Amplitudes;

type C = Complex<f64>;

/// A hypothesis at its best fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Search coordinates at the optimum.
    pub x: Vec<f64>,
    /// Linear unknowns: planes (kg·m), then the effects' in their own units.
    pub unknowns: Vec<C>,
    /// Squared misfit in standard deviations as they were found, drawing errors allowed for.
    pub chi2: f64,
    /// The same in standard deviations as stated.
    pub stated_chi2: f64,
    /// The same with the prior on the bearings and the spread of the drawing errors: minus twice the
    /// logarithm of the posterior density, up to a constant.
    pub cost: f64,
    /// Real numbers measured.
    pub values: usize,
    /// Unknowns of the effects: real numbers.
    pub effect_unknowns: usize,
    /// Model at every value, m.
    pub predicted_m: Vec<C>,
    /// Squared amplitudes of the shaft, m².
    pub amplitudes: Amplitudes,
    /// Covariance of search coordinates and of real and imaginary parts of the linear unknowns.
    pub covariance: Option<DMatrix<f64>>,
    /// Weighted residuals before drawing errors are allowed for.
    pub(super) weighted: DVector<f64>,
}

impl Fit {
    /// Real numbers that were fitted.
    pub(super) fn unknown_count(&self) -> f64 {
        (self.x.len() + 2 * self.unknowns.len()) as f64
    }

    /// χ² per measured real number, in noise as stated.
    pub fn chi2_per_value(&self) -> f64 {
        self.stated_chi2 / self.values as f64
    }
}

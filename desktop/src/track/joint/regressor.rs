//! What follows a condition of operation: constants of the state, and other explanations that cannot be ruled out.

use nalgebra::DVector;

use super::motion::ProcessModel;

/// A constant of the state: what a covariate adds to a component of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regressor {
    pub covariate: usize,
    /// Component of the state, of the bearings' constants or of the unbalance's coordinates.
    pub onto: usize,
    /// Prior standard deviation for one scale of the covariate.
    pub sd: f64,
}

/// Another part of the machine that may follow a covariate instead.
pub struct OtherPart {
    pub covariate: usize,
    /// Logarithm of its probability relative to that of the selected part.
    pub log_odds: f64,
    /// Whether it is the unbalance.
    pub is_unbalance: bool,
    /// All regressors of this explanation.
    pub regressors: Vec<Regressor>,
    pub motion: ProcessModel,
    pub linearised_at: Vec<DVector<f64>>,
}

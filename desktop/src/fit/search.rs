//! What a search needs of a problem, whatever the number of its held places.

use nalgebra::{Complex, DMatrix, DVector};

use super::data::Amplitudes;
use super::descent::{Objective, Stop};
use super::drawing_errors::DrawingErrors;
use super::projection::Solved;
use crate::shaft::nodal::Row;

type C = Complex<f64>;

/// One value of the data and one place of the shaft.
#[derive(Debug, Clone, Copy)]
pub struct UnderForce {
    /// What the value shows, in noise units, of a force of one newton there that turns forward, and of one backward.
    pub shown: [C; 2],
    /// Motion of the shaft there, m: forward, backward.
    pub motion: [C; 2],
}

/// Forces at any place of the shaft.
pub trait UnitForces {
    /// Of every value, at each of some places.
    fn under_unit_forces(&self, places: &[&Row]) -> Option<Vec<Vec<UnderForce>>>;
}

/// A problem whatever the number of its held places.
pub trait Search: UnitForces + Objective {
    /// Moves to `x` and evaluates there.
    fn go_to(&mut self, x: &[f64]);
    /// Takes supports that depend on amplitudes at these, and evaluates anew.
    fn hold(&mut self, amplitudes: &Amplitudes);
    fn descend(&mut self, stop: Stop);
    fn x(&self) -> &[f64];
    /// The linear unknowns there; `None` if the machine is singular.
    fn solved(&self) -> Option<&Solved>;
    /// Squared misfit in standard deviations, without the prior.
    fn chi2(&self) -> f64;
    /// Squared misfit with the prior on the bearings.
    fn cost(&self) -> f64;
    /// Squared amplitude of the shaft at its places in every row.
    fn amplitudes(&self) -> Option<Amplitudes>;
    /// The model at `x` and these linear unknowns, in noise units.
    fn weighted_model(&self, x: &[f64], unknowns: &[C]) -> Option<DVector<f64>>;
    /// Change of the model at every value per search coordinate, weighted but not whitened or projected.
    fn raw_derivative(&self) -> Option<DMatrix<f64>>;
    /// The same per standard deviation of each error of the drawing.
    fn deviation_derivative(&self, errors: &DrawingErrors) -> Option<DMatrix<f64>>;
    /// `JᵀJ` and `Jᵀr` of the weighted residuals and the prior on the bearings, for the search coordinates and
    /// further unknowns with this derivative of the model; what the linear unknowns can follow is out.
    fn joint_normal_equations(&self, further: &DMatrix<f64>) -> Option<(DMatrix<f64>, DVector<f64>)>;
    /// Covariance of everything: search coordinates first, then real and imaginary parts of the linear
    /// unknowns. From the information in the data and in the prior.
    fn covariance(&self) -> Option<DMatrix<f64>>;
}

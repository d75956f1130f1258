//! Dimensions of the drawing as a fit found them, with their uncertainty.

use nalgebra::DMatrix;

use super::hypothesis::Hypothesis;
use super::{Drawing, Fit, Fitter, singular};
use crate::error::Error;
use crate::machine::tolerance::Deviation;
use crate::statistics::interval::{HALF_95, interval_95};

/// How much better than its tolerance the data must know a dimension for it to be theirs, standard deviations.
const DETERMINED: f64 = 0.5;

/// How far a dimension is from the drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedDimension {
    /// As `[tolerance.found]` of a rotor file calls it.
    pub name: String,
    /// `m` of a position; empty of all else, whose differences are shares of the drawn value.
    pub unit: &'static str,
    /// Fitted minus drawn.
    pub difference: f64,
    /// Ends of its 95 % interval, tolerance included.
    pub interval_95: [f64; 2],
    /// 95 % half-width by the tolerance alone.
    pub tolerance_95: f64,
    /// Whether the data know it at least twice as well as the drawing does.
    pub from_data: bool,
}

impl Fitter<'_> {
    /// Every dimension that may differ from the drawing, beside a fit whose search coordinates and unknowns have this covariance.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn dimensions(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        covariance: &DMatrix<f64>,
    ) -> Result<Vec<FittedDimension>, Error> {
        if self.drawing_is_exact() {
            return Ok(Vec::new());
        }
        let tangent = self.at(hypothesis, fit, drawing)?.tangent().ok_or_else(singular)?;
        let variances = drawing.whitening.variances(tangent, covariance);
        let found = drawing.whitening.estimate(&fit.weighted);
        let all = self.deviations.kinds.iter().zip(found.iter().zip(variances.iter()));
        let dimension = |((kind, tolerance), (t, variance)): (&(Deviation, f64), (&f64, &f64))| {
            let sd = variance.sqrt();
            let difference = tolerance * t;
            FittedDimension {
                name: kind.name(self.rotor),
                unit: kind.unit(),
                difference,
                interval_95: interval_95(difference, tolerance * sd),
                tolerance_95: HALF_95 * tolerance,
                from_data: sd < DETERMINED,
            }
        };
        Ok(all.map(dimension).collect())
    }
}

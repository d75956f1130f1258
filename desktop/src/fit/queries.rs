//! Questions to a fit that is already there: its uncertainty, its sensitivity, its misfit elsewhere.

use nalgebra::{Complex, DMatrix, DVector};

use super::data::Amplitudes;
use super::drawing_errors::DrawingErrors;
use super::hypothesis::Hypothesis;
use super::problem::Problem;
use super::{Drawing, Fit, Fitter, ShaftKind, singular};
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::statistics::scatter::Scatter;

impl Fitter<'_> {
    /// A drawing whose errors were found in other data, taken as known, with the noise as stated.
    pub fn known(&self, drawing: &Drawing) -> Drawing {
        Drawing::new(drawing.deviation.clone(), self.plain.of_scatter())
    }

    /// Covariance of search coordinates, then of real and imaginary parts of the linear unknowns.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn covariance(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<Option<DMatrix<f64>>, Error> {
        Ok(self.at(hypothesis, fit, drawing)?.covariance())
    }

    /// Errors of an estimate that takes this drawing as exact: the change of the search coordinates, then of the real and imaginary parts
    /// of the linear unknowns, by one standard deviation of each error of the drawing, one error a column.
    ///
    /// Where the machine is `d` off its drawing, least squares find `θ + C Jᵀ D d` for `θ`, with the covariance `C`, the derivative `J`
    /// by the parameters and `D` by the errors, in noise units.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn shifts_by_drawing(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<DMatrix<f64>, Error> {
        let problem = self.at(hypothesis, fit, drawing)?;
        let shaft = self.shaft(&ShaftKind::of(&hypothesis.terms(&fit.x)));
        let errors = DrawingErrors::new(self.rotor, shaft, &self.deviations, &drawing.deviation);
        let mut by_error = problem.error_derivative(&errors).ok_or_else(singular)?;
        drawing.whitening.apply(&mut by_error);
        let covariance = problem.covariance().ok_or_else(singular)?;
        Ok(covariance * problem.tangent().ok_or_else(singular)?.tr_mul(&by_error))
    }

    /// Change of every real number in noise units per search coordinate, and per real and imaginary part
    /// of each linear unknown relative to its size.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn sensitivity(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<DMatrix<f64>, Error> {
        sensitivity(&self.at(hypothesis, fit, drawing)?).ok_or_else(singular)
    }

    /// Squared misfit of each real number of these data under a hypothesis fitted to other data.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn misfits_of(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<Vec<f64>, Error> {
        let problem = self.at(hypothesis, fit, drawing)?;
        let model = problem.weighted_model(&fit.x, &fit.unknowns).ok_or_else(singular)?;
        let measured = self.data.values().flat_map(|v| {
            let y = v.measured_m / v.sigma_m;
            [y.re, y.im]
        });
        Ok(measured.zip(model.iter()).map(|(y, m)| (y - m).powi(2)).collect())
    }

    /// Amplitudes of a shaft that does not move: where a search over them begins.
    pub fn still(&self) -> Amplitudes {
        vec![vec![[0.0; 2]; self.rotor.bearing.len() + self.rotor.disk.len()]; self.rows().len()]
    }

    /// A rotor's file with noise and drawing's errors as a fit found them: what was built, not what was drawn. Noise that
    /// nobody stated stays unstated.
    pub fn corrected(&self, rotor: Rotor, fit: &Fit, drawing: &Drawing) -> Rotor {
        let found = drawing.whitening.estimate(&fit.weighted).resize_vertically(self.deviations.len(), 0.0);
        let mut built = rotor;
        self.deviations.build_into(&mut built, &found);
        if let Some(noise) = &mut built.noise {
            let Scatter { scale, correlation, between_runs } = drawing.scatter();
            (noise.scale, noise.correlation) = (Some(scale), Some(correlation));
            noise.between_runs = Some(between_runs).filter(|between| *between > 0.0);
        }
        built
    }

    pub(super) fn at<'p>(
        &'p self,
        hypothesis: &'p Hypothesis<'p>,
        fit: &'p Fit,
        drawing: &'p Drawing,
    ) -> Result<Problem<'p>, Error> {
        let plant = self.plant_of(drawing, &ShaftKind::of(&hypothesis.terms(&fit.x)))?;
        let mut problem = self.problem(hypothesis, plant, Some(&fit.amplitudes), &drawing.whitening);
        problem.go_to(&fit.x);
        Ok(problem)
    }
}

/// Derivative by search coordinates, then per real and imaginary part of each linear unknown.
fn sensitivity(problem: &Problem) -> Option<DMatrix<f64>> {
    let outer = problem.derivative()?;
    let unknowns = &problem.solved()?.unknowns;
    let none = vec![Complex::from(0.0); unknowns.len()];
    let at_rest = problem.weighted_model(problem.x(), &none)?;
    let mut columns: Vec<DVector<f64>> = outer.column_iter().map(|c| c.clone_owned()).collect();
    for (j, u) in unknowns.iter().enumerate() {
        for axis in [Complex::new(1.0, 0.0), Complex::new(0.0, 1.0)] {
            let mut only = none.clone();
            only[j] = axis * u.norm();
            columns.push(problem.weighted_model(problem.x(), &only)? - &at_rest);
        }
    }
    Some(DMatrix::from_columns(&columns))
}

//! What a hypothesis says of measurements that nobody has made yet: its prediction at any unknowns, its derivative by all of them,
//! and what missing a part of the response would cost on average.

use std::cell::RefCell;

use nalgebra::{Complex, DMatrix, DVector};

use super::data::Amplitudes;
use super::hypothesis::Hypothesis;
use super::problem::Problem;
use super::{Drawing, Fit, Fitter, ShaftKind, singular};
use crate::error::Error;
use crate::machine::drawing::Noise;
use crate::statistics::whitening::Whitening;

/// A hypothesis that predicts the readings for any unknowns.
pub struct ForwardModel<'p> {
    problem: RefCell<Problem<'p>>,
    /// Where amplitudes are sought from.
    amplitudes: &'p Amplitudes,
}

impl ForwardModel<'_> {
    /// Every value in noise units for these search coordinates and linear unknowns; `None` if the machine is singular.
    pub fn at(&self, x: &[f64], unknowns: &[Complex<f64>]) -> Option<DVector<f64>> {
        self.problem.borrow_mut().settled_model(x, unknowns, self.amplitudes)
    }
}

/// The average cost of a fit that misses a part of the response, its scatter the most probable one.
pub struct ExpectedCost {
    whitening: Whitening,
    used_up: f64,
}

impl ExpectedCost {
    /// Up to a constant, where this is missed, whitened.
    pub fn of(&self, missed: &DVector<f64>) -> f64 {
        self.whitening.expected_cost(missed, self.used_up)
    }
}

impl Drawing {
    /// Whitens columns in noise units by scatter and errors of the drawing.
    pub fn whiten(&self, columns: &mut DMatrix<f64>) {
        self.whitening.apply(columns);
    }

    /// Columns in noise units again, of which the noise is independent but for the drawing.
    pub fn unwhiten(&self, columns: &mut DMatrix<f64>) {
        self.whitening.unapply_deviations(columns);
    }

    /// The same drawing where the standard deviation of each real number was so many times as large.
    pub fn reweighed(&self, ratios: &DVector<f64>) -> Self {
        self.under(self.whitening.reweighed(ratios))
    }
}

impl Fitter<'_> {
    /// A hypothesis that predicts these readings, on the shaft of a drawing.
    ///
    /// # Errors
    /// If the shaft cannot be solved.
    pub fn forward<'p>(
        &'p self,
        hypothesis: &'p Hypothesis<'p>,
        drawing: &Drawing,
        amplitudes: &'p Amplitudes,
    ) -> Result<ForwardModel<'p>, Error> {
        let plant = self.plant_of(drawing, &ShaftKind::of(&hypothesis.terms(&hypothesis.origin())))?;
        let problem = self.problem(hypothesis, plant, Some(amplitudes), &self.plain);
        Ok(ForwardModel { problem: RefCell::new(problem), amplitudes })
    }

    /// Whitened change of the model per search coordinate, then per real and imaginary part of each linear unknown, at `x`.
    ///
    /// # Errors
    /// If the machine is singular there.
    pub fn tangent(
        &self,
        hypothesis: &Hypothesis,
        x: &[f64],
        drawing: &Drawing,
        amplitudes: &Amplitudes,
    ) -> Result<DMatrix<f64>, Error> {
        let plant = self.plant_of(drawing, &ShaftKind::of(&hypothesis.terms(x)))?;
        let mut problem = self.problem(hypothesis, plant, Some(amplitudes), &drawing.whitening);
        problem.go_to(x);
        problem.tangent().ok_or_else(singular)
    }

    /// The same machine where the readings are changed by this, in noise units, and have the noise of their new size.
    pub fn changed(&self, change: &DVector<f64>, noise: &Noise) -> Self {
        let mut data = self.data.clone();
        let values = data.rows.iter_mut().flat_map(|row| &mut row.values);
        for (v, by) in values.zip(change.as_slice().chunks_exact(2)) {
            v.measured_m += Complex::new(by[0], by[1]) * v.sigma_m;
            v.sigma_m = noise.sigma_m(v.measured_m);
        }
        self.anew(data)
    }

    /// What a fit misses: readings, whitened, with errors of the drawing counted from the drawing as stated, then deviations of the
    /// bearings from their priors.
    pub fn missed(&self, hypothesis: &Hypothesis, fit: &Fit, drawing: &Drawing) -> DVector<f64> {
        let (_, left) = drawing.whitening.apply_with(&DMatrix::zeros(fit.weighted.len(), 0), &fit.weighted);
        let priors = hypothesis.bearings.prior_residuals(&fit.x);
        let all: Vec<f64> = left.iter().copied().chain(priors).collect();
        DVector::from_vec(all)
    }

    /// Squared change of what a fit predicts, in noise units, if the same values were evaluated as another machine's data have it.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn change_to(
        &self,
        other: &Fitter,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<f64, Error> {
        let of = |fitter: &Fitter| {
            let still = fitter.still();
            let model = fitter.forward(hypothesis, &drawing.of_another(), &still)?;
            model.at(&fit.x, &fit.unknowns).ok_or_else(singular)
        };
        Ok((of(other)? - of(self)?).norm_squared())
    }

    /// What missing a part of the response beside a fit costs.
    pub fn expected_cost(&self, fit: &Fit, drawing: &Drawing) -> ExpectedCost {
        ExpectedCost { whitening: self.about(&drawing.whitening, fit), used_up: fit.unknown_count() }
    }
}

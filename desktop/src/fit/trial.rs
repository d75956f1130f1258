//! A hypothesis at points of somebody else's choosing: for searches without derivatives, and for a fit
//! that has to stay inside bounds.

use std::cell::RefCell;

use nalgebra::Complex;

use super::data::Amplitudes;
use super::data::{Data, FitValue};
use super::hypothesis::Hypothesis;
use super::problem::Problem;
use super::within::{Bounds, descend_within};
use super::{Drawing, Effort, FINISH, Fit, Fitter, ShaftKind};
use crate::error::Error;

/// Σ|u_c| + Σ|u_s| of the differences between the data and a model, µm: the objective of Bera et al.,
/// Machines 2023, 11, 976.
pub fn summed_residual_um(data: &Data, predicted_m: &[Complex<f64>]) -> f64 {
    let difference = |(v, y): (&FitValue, &Complex<f64>)| (v.measured_m - y).l1_norm() * 1e6;
    data.values().zip(predicted_m).map(difference).sum()
}

impl Fitter<'_> {
    /// A hypothesis to be evaluated at any point. Supports that harden, soften or rub are taken at the given `amplitudes`; at
    /// rest if there are none.
    ///
    /// # Errors
    /// If the shaft cannot be solved.
    pub fn trial<'p>(
        &'p self,
        hypothesis: &'p Hypothesis<'p>,
        drawing: &'p Drawing,
        amplitudes: Option<&'p Amplitudes>,
    ) -> Result<FreeProblem<'p>, Error> {
        let plant = self.plant_of(drawing, &ShaftKind::of(&hypothesis.terms(&hypothesis.origin())))?;
        let problem = self.problem(hypothesis, plant, amplitudes, &drawing.whitening);
        Ok(FreeProblem { fitter: self, hypothesis, drawing, problem: RefCell::new(problem) })
    }
}

/// A hypothesis, ready to be evaluated at any point. The linear unknowns are solved for, weighted by the noise; search
/// coordinates are those of [`Hypothesis`].
pub struct FreeProblem<'p> {
    fitter: &'p Fitter<'p>,
    hypothesis: &'p Hypothesis<'p>,
    drawing: &'p Drawing,
    problem: RefCell<Problem<'p>>,
}

impl FreeProblem<'_> {
    /// [`summed_residual_um`] there; `None` if the machine is singular.
    pub fn summed_residual_um(&self, x: &[f64]) -> Option<f64> {
        let mut problem = self.problem.borrow_mut();
        problem.go_to(x);
        Some(summed_residual_um(&self.fitter.data, &problem.solved()?.predicted_m(&self.fitter.data)))
    }

    /// The best fit inside these bounds that a search from this point finds.
    ///
    /// # Errors
    /// If the machine is singular there.
    pub fn fit_within(&self, start: &[f64], bounds: Bounds) -> Result<Fit, Error> {
        let mut problem = self.problem.borrow_mut();
        descend_within(&mut problem, start, bounds, FINISH);
        self.fitter.result(&problem, self.hypothesis, self.drawing, Effort::Final)
    }
}

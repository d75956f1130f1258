//! A first look at what each unknown cause would cost.
//!
//! Bearings and effects stay as a fit has them, so that the model and what the probes show of a cause are computed once. Whitened by
//! the noise, a cause of any size is an allowance with the same eigenvectors.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::assumption::{Assumption, AssumptionResponse};
use super::first_size;
use crate::error::Error;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::projection::LinearSolution;
use crate::fit::{Drawing, Fit, Fitter, singular};
use crate::statistics::allowance::Allowance;
use crate::statistics::scatter::Scatter;
use crate::statistics::whitening::{Whitening, growth};

/// Rounds over the size of a cause: the force first, or the noise takes all; then one with the noise that it leaves.
const ROUNDS_IN_STATED_NOISE: usize = 3;

/// The linear system of a model, weighted by the noise as stated.
struct StillModel {
    columns: DMatrix<f64>,
    target: DVector<f64>,
    /// What bearings and effects cost.
    prior_cost: f64,
    /// Real numbers that were fitted.
    used_up: f64,
}

/// A noise, and a model whitened by it.
struct UnderNoise {
    noise: Whitening,
    columns: DMatrix<f64>,
    target: DVector<f64>,
}

/// What a cause of some size costs, and what it leaves.
struct Trial {
    cost: f64,
    /// Factor by which its size would fit better.
    growth: f64,
    /// Weighted residuals without what is due to the cause.
    left: DVector<f64>,
    /// Real numbers of the cause that the data determine.
    determined: f64,
}

impl Fitter<'_> {
    /// What a hypothesis with each of these unknown causes beside it would cost, bearings and effects as a fit has
    /// them.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn screened(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        assumptions: &[Assumption],
    ) -> Result<Vec<f64>, Error> {
        let all = self.shown(hypothesis, fit, drawing, assumptions)?;
        let problem = self.at(hypothesis, fit, drawing)?;
        let now = problem.evaluated().ok_or_else(singular)?;
        let (columns, target) = problem.linear_system(&now.terms, &now.responses);
        let (prior_cost, used_up) = (problem.prior_cost(), fit.unknown_count());
        let model = StillModel { columns, target, prior_cost, used_up };
        let stated = model.under(self.about(&drawing.whitening, fit).scattered(Scatter::STATED));
        let cost = |AssumptionResponse { response, .. }: &AssumptionResponse| {
            model.least_cost(&stated, response, first_size(fit, response)).ok_or_else(singular)
        };
        all.par_iter().map(cost).collect()
    }
}

impl StillModel {
    fn under(&self, noise: Whitening) -> UnderNoise {
        let (columns, target) = noise.apply_with(&self.columns, &self.target);
        UnderNoise { noise, columns, target }
    }

    /// With a cause of which the probes show this; its size and then the noise are sought.
    fn least_cost(&self, stated: &UnderNoise, response: &DMatrix<f64>, first_size: f64) -> Option<f64> {
        let mut size = first_size;
        let mut least = f64::INFINITY;
        let shown = stated.shown(response);
        let mut left = None;
        for _ in 0..ROUNDS_IN_STATED_NOISE {
            let trial = self.tried(stated, response, &shown, size)?;
            least = least.min(trial.cost);
            size *= trial.growth;
            left = Some(trial);
        }
        let Trial { left, determined, .. } = left?;
        let own = self.under(
            stated.noise.scattered(stated.noise.most_probable_scatter(&left, self.used_up + determined).0),
        );
        let last = self.tried(&own, response, &own.shown(response), size)?;
        Some(least.min(last.cost))
    }

    fn tried(
        &self,
        under: &UnderNoise,
        response: &DMatrix<f64>,
        shown: &Allowance,
        size: f64,
    ) -> Option<Trial> {
        let cause = shown.of_size(size);
        let (mut columns, mut target) =
            (under.columns.clone(), DMatrix::from_columns(std::slice::from_ref(&under.target)));
        cause.whiten(&mut columns);
        cause.whiten(&mut target);
        let solved = LinearSolution::of_white(columns, target.column(0).into_owned())?;
        let factors = cause.estimate(&(&under.target - &under.columns * solved.flat()));
        let determined = cause.used_up();
        Some(Trial {
            cost: solved.weighted.norm_squared() + self.prior_cost + under.noise.cost() + cause.log_det(),
            growth: growth(factors.norm_squared(), determined),
            left: &self.target - &self.columns * solved.flat() - response * (factors * size),
            determined,
        })
    }
}

impl UnderNoise {
    /// What the probes show of a cause of unit size, as an allowance beside this noise.
    fn shown(&self, response: &DMatrix<f64>) -> Allowance {
        let mut white = response.clone();
        self.noise.apply(&mut white);
        Allowance::new(white)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::statistics::between_runs::RunErrors;
    use crate::statistics::scatter::Predecessors;
    use crate::statistics::whitening::DataScatter;

    #[test]
    fn cause_of_a_size_costs_what_it_does_as_part_of_the_noise() {
        let (rows, size) = (24, 0.3);
        let waves = |columns: usize, by: f64| {
            DMatrix::from_fn(rows, columns, |i, j| ((i * (j + 2)) as f64 * by + j as f64).sin())
        };
        let scattered = DataScatter {
            series: Arc::new(Predecessors::new([0; 12])),
            runs: RunErrors::none(rows),
            scatter: Scatter { scale: 1.3, correlation: 0.4, between_runs: 0.0 },
            free: rows as f64,
            stated_log_sd: 0.4,
        };
        let noise = Whitening::new(waves(3, 0.7), DVector::from_vec(vec![0.5, -0.2, 0.1]), scattered);
        let (columns, target, response) = (waves(2, 0.31), waves(1, 1.7).column(0) * 5.0, waves(4, 0.13));
        let with = noise.with(&(&response * size));
        let expected = LinearSolution::new(columns.clone(), target.clone(), &with).unwrap();

        let model = StillModel { columns, target, prior_cost: 2.0, used_up: 2.0 };
        let under = model.under(noise);
        let found = model.tried(&under, &response, &under.shown(&response), size).unwrap();
        assert!((found.cost - expected.weighted.norm_squared() - with.cost() - 2.0).abs() < 1e-9);
        assert!((found.growth - with.growth(&expected.left, 4)).abs() < 1e-9);
        assert!((found.determined - with.determined(4)).abs() < 1e-9);
    }
}

//! The correlated noise that a fit goes by: the scatter of the measurement, and what errors of the drawing
//! amount to.
//!
//! Near a given drawing the response is linear in its errors, so a Gaussian prior on them is the same as
//! correlated noise with covariance `C + J Jᵀ` in noise units, C the scatter and J the response per standard deviation.
//! Whitening by it makes the fit ignore what scatter and errors of the drawing could have done, no more.
//! Anything else that has a Gaussian prior and acts linearly can stand in J beside the drawing.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::allowance::Allowance;
use super::between_runs::{self, BetweenRunsSearch, RunAllowance, RunErrors};
use crate::statistics::scatter::{Predecessors, Scatter};

/// The scatter of one set of data.
#[derive(Clone)]
pub struct DataScatter {
    /// Which value precedes which.
    pub series: Arc<Predecessors>,
    /// What a run that is off would change.
    pub runs: RunErrors,
    pub scatter: Scatter,
    /// Real numbers that bearings and planes do not use up.
    pub free: f64,
    /// How far the stated size is trusted, standard deviation of its logarithm.
    pub stated_log_sd: f64,
}

impl DataScatter {
    /// Whitens what varies from reading to reading.
    fn whiten_series(&self, columns: &mut DMatrix<f64>) {
        if self.scatter.scale != 1.0 || self.scatter.correlation != 0.0 {
            self.series.whiten(&self.scatter, columns);
        }
    }

    fn whitened_runs(&self) -> RunErrors {
        self.runs.whitened(|response| self.whiten_series(response))
    }

    fn between_runs(&self) -> RunAllowance {
        RunAllowance::new(self.whitened_runs(), self.scatter.between_runs)
    }
}

/// The correlated noise around deviations `centre`.
pub struct Whitening {
    scattered: DataScatter,
    /// Between runs, readings whitened.
    between: RunAllowance,
    /// Weighted response per standard deviation of each deviation, as stated and with the scatter whitened.
    stated: Arc<DMatrix<f64>>,
    deviations: Arc<Allowance>,
    /// Where the jacobian was taken, in standard deviations.
    centre: DVector<f64>,
    /// ln det of the covariance in noise units.
    log_det: f64,
}

impl Whitening {
    /// From the response per standard deviation at `centre`.
    pub fn new(stated: DMatrix<f64>, centre: DVector<f64>, scattered: DataScatter) -> Self {
        Self::sharing(Arc::new(stated), centre, scattered)
    }

    fn sharing(stated: Arc<DMatrix<f64>>, centre: DVector<f64>, scattered: DataScatter) -> Self {
        let between = scattered.between_runs();
        let mut jacobian = (*stated).clone();
        scattered.whiten_series(&mut jacobian);
        between.whiten(&mut jacobian);
        let deviations = Arc::new(Allowance::new(jacobian));
        let own = scattered.series.log_det(&scattered.scatter, scattered.free);
        let log_det = own + between.log_det() + deviations.log_det();
        Self { scattered, between, stated, deviations, centre, log_det }
    }

    /// The same beside another model, of which a run that is off would change this.
    pub fn about(&self, runs: RunErrors) -> Self {
        let scattered = DataScatter { runs, ..self.scattered.clone() };
        if scattered.scatter.between_runs == 0.0 {
            // where runs do not differ it is the same noise
            let (between, deviations) = (scattered.between_runs(), self.deviations.clone());
            let (stated, centre, log_det) = (self.stated.clone(), self.centre.clone(), self.log_det);
            return Self { scattered, between, stated, deviations, centre, log_det };
        }
        Self::sharing(self.stated.clone(), self.centre.clone(), scattered)
    }

    /// The same where the noise as stated was so many times as large in each value.
    pub fn reweighed(&self, ratios: &DVector<f64>) -> Self {
        let mut stated = (*self.stated).clone();
        stated.column_iter_mut().for_each(|mut column| column.component_mul_assign(ratios));
        Self::new(stated, self.centre.clone(), self.scattered.clone())
    }

    /// The same with another scatter.
    pub fn scattered(&self, scatter: Scatter) -> Self {
        let scattered = DataScatter { scatter, ..self.scattered.clone() };
        Self::sharing(self.stated.clone(), self.centre.clone(), scattered)
    }

    /// The same without deviations of the drawing.
    pub fn of_scatter(&self) -> Self {
        let rows = self.stated.nrows();
        Self::new(DMatrix::zeros(rows, 0), DVector::zeros(0), self.scattered.clone())
    }

    /// The same with further deviations of unit standard deviation, around zero.
    pub fn with(&self, further: &DMatrix<f64>) -> Self {
        let (own, more) = (self.stated.ncols(), further.ncols());
        let mut stated = (*self.stated).clone().resize_horizontally(own + more, 0.0);
        stated.columns_mut(own, more).copy_from(further);
        let centre = self.centre.clone().resize_vertically(own + more, 0.0);
        Self::new(stated, centre, self.scattered.clone())
    }

    /// The same with its deviations taken around others.
    pub fn around(self, centre: DVector<f64>) -> Self {
        Self { centre, ..self }
    }

    /// Weighted response per standard deviation of each deviation, as stated.
    pub fn by_deviation(&self) -> &DMatrix<f64> {
        &self.stated
    }

    /// The scatter that it goes by.
    pub fn scatter(&self) -> Scatter {
        self.scattered.scatter
    }

    /// What the noise itself costs: ln det, and its departure from what was stated.
    pub fn cost(&self) -> f64 {
        let DataScatter { scatter, stated_log_sd, runs, .. } = &self.scattered;
        let of_runs = if !runs.is_empty() { between_runs::neg2_log_prior(scatter) } else { 0.0 };
        self.log_det + scatter.neg2_log_prior(*stated_log_sd) + of_runs
    }

    /// How far the stated size is trusted.
    pub fn stated_log_sd(&self) -> f64 {
        self.scattered.stated_log_sd
    }

    /// Whether there is nothing to whiten.
    pub fn is_plain(&self) -> bool {
        self.deviations.is_empty() && self.scattered.scatter == Scatter::STATED
    }

    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        self.scattered.whiten_series(columns);
        self.between.whiten(columns);
        self.deviations.whiten(columns);
    }

    /// Takes off what [`Self::apply`] does for deviations of the drawing.
    pub fn unapply_deviations(&self, columns: &mut DMatrix<f64>) {
        self.deviations.unwhiten(columns);
    }

    /// Whitens columns of the model and, beside them, weighted residuals of the drawing at `centre`, as deviations are counted from the
    /// drawing.
    pub fn apply_with(
        &self,
        columns: &DMatrix<f64>,
        residual: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let count = columns.ncols();
        let mut all = columns.clone().resize_horizontally(count + 1, 0.0);
        all.set_column(count, &self.about_centre(residual));
        self.apply(&mut all);
        let residual = all.column(count).into_owned();
        (all.remove_column(count), residual)
    }

    /// Residuals of the drawing as stated, for those at `centre`.
    fn about_centre(&self, residual: &DVector<f64>) -> DVector<f64> {
        if self.centre.is_empty() { residual.clone() } else { residual + &*self.stated * &self.centre }
    }

    fn whitened_at_centre(&self, residual: &DVector<f64>) -> DMatrix<f64> {
        let mut white = DMatrix::from_columns(&[self.about_centre(residual)]);
        self.scattered.whiten_series(&mut white);
        self.between.whiten(&mut white);
        white
    }

    /// Change of the weighted response from the drawing at `centre` to one with these deviations.
    pub fn shift(&self, deviations: &DVector<f64>) -> DVector<f64> {
        if deviations.is_empty() {
            return DVector::zeros(self.stated.nrows());
        }
        &*self.stated * (deviations - &self.centre)
    }

    /// Most probable deviations, in standard deviations, for weighted residuals of the drawing at `centre`.
    pub fn estimate(&self, residual: &DVector<f64>) -> DVector<f64> {
        self.deviations.estimate(&self.whitened_at_centre(residual).column(0).into_owned())
    }

    /// Variance of each deviation beside unknowns of this covariance, which change the model by these whitened columns.
    pub fn variances(&self, mut columns: DMatrix<f64>, covariance: &DMatrix<f64>) -> DVector<f64> {
        self.deviations.unwhiten(&mut columns);
        self.deviations.variances(&columns, covariance)
    }

    /// Squared weighted residuals of the drawing at `centre`, squared deviations and errors between runs, the last two at their most
    /// probable.
    pub fn stated_chi2(&self, residual: &DVector<f64>) -> f64 {
        let deviations = self.estimate(residual);
        let mut left = residual - self.shift(&deviations);
        let mut of_runs = 0.0;
        if !self.between.is_empty() {
            let errors = self.between.estimate(&self.whitened_series(&left));
            left -= self.scattered.runs.change(&errors);
            of_runs = self.between.penalty(&errors);
        }
        left.norm_squared() + deviations.norm_squared() + of_runs
    }

    fn whitened_series(&self, residual: &DVector<f64>) -> DVector<f64> {
        let mut white = DMatrix::from_columns(std::slice::from_ref(residual));
        self.scattered.whiten_series(&mut white);
        white.column(0).into_owned()
    }

    /// Factor on the last `count` deviations by which their standard deviation would fit them better, for weighted
    /// residuals of the drawing at `centre`: their squares over how many of them the data determine (MacKay 1992).
    pub fn growth(&self, residual: &DVector<f64>, count: usize) -> f64 {
        let deviations = self.estimate(residual);
        growth(deviations.rows(deviations.len() - count, count).norm_squared(), self.determined(count))
    }

    /// How many of the last `count` deviations the data determine rather than their prior.
    pub fn determined(&self, count: usize) -> f64 {
        self.deviations.determined(count)
    }

    /// The most probable scatter of weighted residuals of the drawing at `centre`, `used_up` of them by unknowns that
    /// were fitted; and what residuals, deviations and noise cost with it, the deviations as they are.
    pub fn most_probable_scatter(&self, residual: &DVector<f64>, used_up: f64) -> (Scatter, f64) {
        let DataScatter { series, runs, free, stated_log_sd, scatter } = &self.scattered;
        let deviations = self.estimate(residual);
        let left = residual - self.shift(&deviations);
        let unused = left.len() as f64 - used_up - self.deviations.used_up();
        let of_series = |left: &DVector<f64>, unused: f64| {
            series.most_probable(left.as_slice(), unused.max(1.0), *stated_log_sd)
        };
        let (found, cost) = if runs.is_empty() {
            of_series(&left, unused)
        } else {
            let sought =
                BetweenRunsSearch::new(&self.scattered.whitened_runs(), &self.whitened_series(&left));
            let tries = sought.tries().map(|t| {
                let (found, cost) = of_series(&(&left - runs.change(&t.errors)), unused - t.used_up);
                (Scatter { between_runs: t.between_runs, ..found }, cost + t.cost)
            });
            let best = tries.min_by(|a, b| a.1.total_cmp(&b.1));
            best.unwrap_or_else(|| of_series(&left, unused))
        };
        let allowed = self.log_det - series.log_det(scatter, *free) - self.between.log_det();
        (found, cost + deviations.norm_squared() + allowed)
    }

    /// What [`Self::most_probable_scatter`] costs on average, up to a constant, where a model misses this (whitened, with the noise as
    /// stated) beside noise as stated; `used_up` as there.
    pub fn expected_cost(&self, missed: &DVector<f64>, used_up: f64) -> f64 {
        let DataScatter { series, runs, stated_log_sd, .. } = &self.scattered;
        // the root of the inverse covariance is symmetric: once more, and what deviations follow is out
        let mut left = DMatrix::from_columns(std::slice::from_ref(missed));
        self.deviations.whiten(&mut left);
        let left = left.column(0).into_owned();
        let of_deviations = missed.norm_squared() - left.norm_squared();
        let unused = left.len() as f64 - used_up - self.deviations.used_up();
        let of_series = |left: &DVector<f64>, unused: f64| {
            series.expected_cost(left.as_slice(), unused.max(1.0), *stated_log_sd)
        };
        let least = if runs.is_empty() {
            of_series(&left, unused)
        } else {
            let cost = |t: between_runs::BetweenRunsTrial| {
                of_series(&(&left - runs.change(&t.errors)), unused - t.used_up) + t.cost
            };
            BetweenRunsSearch::new(runs, &left).tries().map(cost).fold(f64::INFINITY, f64::min)
        };
        least + of_deviations
    }
}

/// Factor on the standard deviation of errors by which it would fit them better: their squares over how many of them the data determine.
pub fn growth(squares: f64, determined: f64) -> f64 {
    (squares / determined.max(f64::MIN_POSITIVE)).sqrt().clamp(0.1, 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(series: Predecessors, scatter: Scatter, values: usize) -> DataScatter {
        DataScatter {
            series: Arc::new(series),
            runs: RunErrors::none(2 * values),
            scatter,
            free: 2.0 * values as f64,
            stated_log_sd: 0.4,
        }
    }

    fn white(values: usize) -> DataScatter {
        of(Predecessors::new(0..values), Scatter::STATED, values)
    }

    #[test]
    fn with_scatter_residuals_of_that_covariance_become_white() {
        let scatter = Scatter { scale: 1.4, correlation: 0.7, between_runs: 0.0 };
        let jacobian = DMatrix::from_fn(10, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let of_scatter = DMatrix::from_fn(10, 10, |i, j| {
            let apart = (i / 2) as i32 - (j / 2) as i32;
            if i % 2 == j % 2 { 1.96 * 0.7_f64.powi(apart.abs()) } else { 0.0 }
        });
        let covariance = of_scatter + &jacobian * jacobian.transpose();
        let scattered = of(Predecessors::new([0; 5]), scatter, 5);
        let w = Whitening::new(jacobian, DVector::zeros(3), scattered);
        let mut root = DMatrix::identity(10, 10);
        w.apply(&mut root);
        assert!((&root * &covariance * root.transpose() - DMatrix::identity(10, 10)).amax() < 1e-12);
        assert!((w.log_det - covariance.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn estimate_recovers_visible_deviations_with_prior_shrinkage() {
        let jacobian = DMatrix::from_fn(40, 2, |i, j| 30.0 * ((i + 1) as f64 * (j + 1) as f64 * 0.3).sin());
        let truth = DVector::from_vec(vec![0.8, -1.4]);
        let centre = DVector::from_vec(vec![0.5, 0.5]);
        let w = Whitening::new(jacobian.clone(), centre.clone(), white(20));
        let found = w.estimate(&(&jacobian * (&truth - centre)));
        assert!((found - truth).amax() < 1e-3);
    }
}

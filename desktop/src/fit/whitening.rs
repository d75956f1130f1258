//! The correlated noise that a fit goes by: the scatter of the measurement, and what errors of the drawing
//! amount to.
//!
//! Near a given drawing the response is linear in its errors, so a Gaussian prior on them is the same as
//! correlated noise with covariance `C + J Jᵀ` in noise units, C the scatter and J the response per standard deviation.
//! Whitening by it makes the fit ignore what scatter and errors of the drawing could have done, no more.
//! Anything else that has a Gaussian prior and acts linearly can stand in J beside the drawing.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::inference::scatter::{Scatter, Series};

/// The scatter of one set of data.
#[derive(Clone)]
pub struct Scattered {
    /// Which value precedes which.
    pub series: Arc<Series>,
    /// Size and correlation.
    pub scatter: Scatter,
    /// Real numbers that bearings and planes do not use up.
    pub free: f64,
    /// How far the stated size is trusted, standard deviation of its logarithm.
    pub stated_log_sd: f64,
}

impl Scattered {
    fn whiten(&self, columns: &mut DMatrix<f64>) {
        if self.scatter != Scatter::STATED {
            self.series.whiten(&self.scatter, columns);
        }
    }
}

/// The correlated noise around deviations `centre`.
pub struct Whitening {
    scattered: Scattered,
    /// Weighted response per standard deviation of each deviation, before and after the scatter is whitened.
    stated: DMatrix<f64>,
    jacobian: DMatrix<f64>,
    /// Where the jacobian was taken, in standard deviations.
    centre: DVector<f64>,
    /// Eigenvalues and eigenvectors of `JᵀJ`, scatter whitened.
    values: DVector<f64>,
    vectors: DMatrix<f64>,
    shrink: DVector<f64>,
    /// ln det of the covariance in noise units.
    log_det: f64,
}

impl Whitening {
    /// From the response per standard deviation at `centre`.
    pub fn new(stated: DMatrix<f64>, centre: DVector<f64>, scattered: Scattered) -> Self {
        let mut jacobian = stated.clone();
        scattered.whiten(&mut jacobian);
        let (values, vectors) = if jacobian.ncols() == 0 {
            (DVector::zeros(0), DMatrix::zeros(0, 0))
        } else {
            let eigen = SymmetricEigen::new(jacobian.tr_mul(&jacobian));
            (eigen.eigenvalues.map(|v| v.max(0.0)), eigen.eigenvectors)
        };
        // (1 + JJᵀ)^(−1/2) = 1 − J V diag((1 − (1+λ)^(−1/2)) / λ) Vᵀ Jᵀ
        let shrink = values.map(|v| if v > 1e-9 { (1.0 - (1.0 + v).sqrt().recip()) / v } else { 0.5 });
        let own = scattered.series.log_det(&scattered.scatter, scattered.free);
        let allowed = values.iter().map(|v| (1.0 + v).ln()).sum::<f64>();
        Self { scattered, stated, jacobian, centre, values, vectors, shrink, log_det: own + allowed }
    }

    /// The same with another scatter.
    pub fn scattered(&self, scatter: Scatter) -> Self {
        let scattered = Scattered { scatter, ..self.scattered.clone() };
        Self::new(self.stated.clone(), self.centre.clone(), scattered)
    }

    /// The scatter alone.
    pub fn of_scatter(&self) -> Self {
        let rows = self.stated.nrows();
        Self::new(DMatrix::zeros(rows, 0), DVector::zeros(0), self.scattered.clone())
    }

    /// The same with further deviations of unit standard deviation, around zero.
    pub fn with(&self, further: &DMatrix<f64>) -> Self {
        let (own, more) = (self.stated.ncols(), further.ncols());
        let mut stated = self.stated.clone().resize_horizontally(own + more, 0.0);
        stated.columns_mut(own, more).copy_from(further);
        let centre = self.centre.clone().resize_vertically(own + more, 0.0);
        Self::new(stated, centre, self.scattered.clone())
    }

    /// The same with its deviations taken around others.
    pub fn around(self, centre: DVector<f64>) -> Self {
        Self { centre, ..self }
    }

    /// The scatter that it goes by.
    pub fn scatter(&self) -> Scatter {
        self.scattered.scatter
    }

    /// What the noise itself costs: ln det, and its departure from what was stated.
    pub fn cost(&self) -> f64 {
        self.log_det + self.scattered.scatter.doubt(self.scattered.stated_log_sd)
    }

    /// How far the stated size is trusted.
    pub fn stated_log_sd(&self) -> f64 {
        self.scattered.stated_log_sd
    }

    /// Whether there is nothing to whiten.
    pub fn is_plain(&self) -> bool {
        self.jacobian.ncols() == 0 && self.scattered.scatter == Scatter::STATED
    }

    /// Whitens every column.
    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        self.scattered.whiten(columns);
        self.allow(columns);
    }

    fn allow(&self, columns: &mut DMatrix<f64>) {
        if self.jacobian.ncols() == 0 {
            return;
        }
        let mut inner = self.vectors.tr_mul(&self.jacobian.tr_mul(columns));
        for (mut row, s) in inner.row_iter_mut().zip(self.shrink.iter()) {
            row *= *s;
        }
        columns.gemm(-1.0, &self.jacobian, &(&self.vectors * inner), 1.0);
    }

    /// Whitens weighted residuals of the drawing at `centre`, as deviations are counted from the drawing.
    pub fn apply_centred(&self, residual: &DVector<f64>) -> DVector<f64> {
        let mut white = self.whitened_at_centre(residual);
        self.allow(&mut white);
        white.column(0).into_owned()
    }

    fn whitened_at_centre(&self, residual: &DVector<f64>) -> DMatrix<f64> {
        let around =
            if self.centre.is_empty() { residual.clone() } else { residual + &self.stated * &self.centre };
        let mut white = DMatrix::from_columns(&[around]);
        self.scattered.whiten(&mut white);
        white
    }

    /// Change of the weighted response from the drawing at `centre` to one with these deviations.
    pub fn shift(&self, deviations: &DVector<f64>) -> DVector<f64> {
        if deviations.is_empty() {
            return DVector::zeros(self.stated.nrows());
        }
        &self.stated * (deviations - &self.centre)
    }

    /// Most probable deviations, in standard deviations, for weighted residuals of the drawing at `centre`.
    pub fn estimate(&self, residual: &DVector<f64>) -> DVector<f64> {
        if self.jacobian.ncols() == 0 {
            return DVector::zeros(0);
        }
        let right = self.jacobian.tr_mul(&self.whitened_at_centre(residual).column(0));
        let variances = self.values.map(|v| (1.0 + v).recip());
        &self.vectors * self.vectors.tr_mul(&right).component_mul(&variances)
    }

    /// Squared weighted residuals of the drawing at `centre` and squared deviations, the deviations at their most
    /// probable.
    pub fn stated_chi2(&self, residual: &DVector<f64>) -> f64 {
        let deviations = self.estimate(residual);
        (residual - self.shift(&deviations)).norm_squared() + deviations.norm_squared()
    }

    /// Factor on the last `count` deviations by which their standard deviation would fit them better, for weighted
    /// residuals of the drawing at `centre`: their squares over how many of them the data determine (MacKay 1992).
    pub fn growth(&self, residual: &DVector<f64>, count: usize) -> f64 {
        let deviations = self.estimate(residual);
        let variance = |i: usize| -> f64 {
            self.vectors.row(i).iter().zip(self.values.iter()).map(|(v, value)| v * v / (1.0 + value)).sum()
        };
        let last = deviations.len() - count..deviations.len();
        let squares: f64 = last.clone().map(|i| deviations[i].powi(2)).sum();
        let determined = count as f64 - last.map(variance).sum::<f64>();
        (squares / determined.max(f64::MIN_POSITIVE)).sqrt().clamp(0.1, 10.0)
    }

    /// Real numbers that the deviations use up, in all.
    pub fn used_up(&self) -> f64 {
        self.values.iter().map(|v| v / (1.0 + v)).sum()
    }

    /// The most probable scatter of weighted residuals of the drawing at `centre`, `used_up` of them by unknowns that
    /// were fitted; and what residuals, deviations and noise cost with it, the deviations as they are.
    pub fn most_probable_scatter(&self, residual: &DVector<f64>, used_up: f64) -> (Scatter, f64) {
        let Scattered { series, free, stated_log_sd, scatter } = &self.scattered;
        let deviations = self.estimate(residual);
        let left = residual - self.shift(&deviations);
        let unused = (left.len() as f64 - used_up - self.used_up()).max(1.0);
        let (found, cost) = series.most_probable(left.as_slice(), unused, *stated_log_sd);
        let allowed = self.log_det - series.log_det(scatter, *free);
        (found, cost + deviations.norm_squared() + allowed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(series: Series, scatter: Scatter, values: usize) -> Scattered {
        Scattered { series: Arc::new(series), scatter, free: 2.0 * values as f64, stated_log_sd: 0.4 }
    }

    fn white(values: usize) -> Scattered {
        of(Series::new(0..values), Scatter::STATED, values)
    }

    #[test]
    fn whitening_equals_the_inverse_square_root_of_the_covariance() {
        let jacobian = DMatrix::from_fn(10, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let covariance = DMatrix::identity(10, 10) + &jacobian * jacobian.transpose();
        let w = Whitening::new(jacobian, DVector::zeros(3), white(5));
        let mut root = DMatrix::identity(10, 10);
        w.apply(&mut root);
        assert!((&root * &covariance * &root - DMatrix::identity(10, 10)).amax() < 1e-12);
        assert!((w.log_det - covariance.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn with_scatter_residuals_of_that_covariance_become_white() {
        let scatter = Scatter { scale: 1.4, correlation: 0.7 };
        let jacobian = DMatrix::from_fn(10, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let of_scatter = DMatrix::from_fn(10, 10, |i, j| {
            let apart = (i / 2) as i32 - (j / 2) as i32;
            if i % 2 == j % 2 { 1.96 * 0.7_f64.powi(apart.abs()) } else { 0.0 }
        });
        let covariance = of_scatter + &jacobian * jacobian.transpose();
        let scattered = of(Series::new([0; 5]), scatter, 5);
        let w = Whitening::new(jacobian, DVector::zeros(3), scattered);
        let mut root = DMatrix::identity(10, 10);
        w.apply(&mut root);
        assert!((&root * &covariance * root.transpose() - DMatrix::identity(10, 10)).amax() < 1e-12);
        assert!((w.log_det - covariance.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn estimate_recovers_deviations_that_the_data_show_and_shrinks_them_by_the_prior() {
        let jacobian = DMatrix::from_fn(40, 2, |i, j| 30.0 * ((i + 1) as f64 * (j + 1) as f64 * 0.3).sin());
        let truth = DVector::from_vec(vec![0.8, -1.4]);
        let centre = DVector::from_vec(vec![0.5, 0.5]);
        let w = Whitening::new(jacobian.clone(), centre.clone(), white(20));
        let found = w.estimate(&(&jacobian * (&truth - centre)));
        assert!((found - truth).amax() < 1e-3);
    }
}

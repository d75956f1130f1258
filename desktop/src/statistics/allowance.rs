//! Linear errors with a Gaussian prior, allowed for as correlated noise.

use crate::decomposition::{hermitian, transposed_product, transposed_product_at_once};
use nalgebra::{DMatrix, DVector};

/// Noise of unit size and, beside it, errors of unit standard deviation that act through a jacobian J: covariance `1 + J Jᵀ`.
pub struct Allowance {
    /// Eigenvalues and eigenvectors of `JᵀJ`: λ and V.
    values: DVector<f64>,
    vectors: DMatrix<f64>,
    /// s of `(1 + JJᵀ)^(−1/2) = 1 − J V diag(s) Vᵀ Jᵀ`.
    shrink: DVector<f64>,
    /// `K = J V diag(√s)`.
    root: DMatrix<f64>,
}

impl Allowance {
    /// For errors that act through this jacobian.
    pub fn new(jacobian: DMatrix<f64>) -> Self {
        let (values, vectors) = if jacobian.ncols() == 0 {
            (DVector::zeros(0), DMatrix::zeros(0, 0))
        } else {
            let eigen = hermitian(transposed_product(&jacobian, &jacobian));
            (eigen.eigenvalues.map(|v| v.max(0.0)), eigen.eigenvectors)
        };
        let shrink = values.map(shrink);
        let mut root = jacobian * &vectors;
        root.column_iter_mut().zip(&shrink).for_each(|(mut column, s)| column *= s.sqrt());
        Self { values, vectors, shrink, root }
    }

    /// For errors of another standard deviation.
    pub fn of_size(&self, size: f64) -> Self {
        let values = &self.values * size.powi(2);
        let shrunk = values.map(shrink);
        let mut root = self.root.clone();
        let factors = shrunk.iter().zip(&self.shrink).map(|(new, old)| size * (new / old).sqrt());
        root.column_iter_mut().zip(factors).for_each(|(mut column, factor)| column *= factor);
        Self { vectors: self.vectors.clone(), values, shrink: shrunk, root }
    }

    /// Whether nothing is allowed for.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// `(1 + J Jᵀ)^(−1/2)` of every column.
    pub fn whiten(&self, columns: &mut DMatrix<f64>) {
        if self.is_empty() {
            return;
        }
        let seen = transposed_product_at_once(&self.root, columns);
        columns.gemm(-1.0, &self.root, &seen, 1.0);
    }

    /// `(1 + J Jᵀ)^(1/2)` of every column, `1 + K diag(√(1 + λ)) Kᵀ`.
    pub fn unwhiten(&self, columns: &mut DMatrix<f64>) {
        if self.is_empty() {
            return;
        }
        let mut seen = transposed_product_at_once(&self.root, columns);
        seen.column_iter_mut()
            .for_each(|mut c| c.component_mul_assign(&self.values.map(|v| (1.0 + v).sqrt())));
        columns.gemm(1.0, &self.root, &seen, 1.0);
    }

    /// ln det of the covariance.
    pub fn log_det(&self) -> f64 {
        self.values.iter().map(|v| (1.0 + v).ln()).sum()
    }

    /// Most probable errors for residuals.
    pub fn estimate(&self, residual: &DVector<f64>) -> DVector<f64> {
        if self.is_empty() {
            return DVector::zeros(0);
        }
        // Kᵀr is √s Vᵀ Jᵀ r
        let seen = self.root.tr_mul(residual).component_div(&self.shrink.map(f64::sqrt));
        &self.vectors * seen.component_mul(&self.values.map(|v| (1.0 + v).recip()))
    }

    /// Variance of each error beside unknowns of this covariance, which change the residuals by these columns: its own, and what not
    /// knowing the unknowns adds.
    pub fn variances(&self, columns: &DMatrix<f64>, covariance: &DMatrix<f64>) -> DVector<f64> {
        let follow: Vec<DVector<f64>> =
            columns.column_iter().map(|column| self.estimate(&column.into_owned())).collect();
        let follow = DMatrix::from_fn(self.values.len(), columns.ncols(), |i, j| follow[j][i]);
        let added = (&follow * covariance).component_mul(&follow);
        DVector::from_fn(self.values.len(), |i, _| self.own_variance(i) + added.row(i).sum())
    }

    /// Variance of an error where all else is known.
    fn own_variance(&self, i: usize) -> f64 {
        self.vectors.row(i).iter().zip(self.values.iter()).map(|(v, value)| v * v / (1.0 + value)).sum()
    }

    /// Real numbers that the errors use up.
    pub fn used_up(&self) -> f64 {
        self.values.iter().map(|v| v / (1.0 + v)).sum()
    }

    /// How many of the last `count` errors the data determine rather than their prior.
    pub fn determined(&self, count: usize) -> f64 {
        let all = self.vectors.nrows();
        count as f64 - (all - count..all).map(|i| self.own_variance(i)).sum::<f64>()
    }
}

/// s of `(1 + v)^(−1/2) = 1 − s v`.
fn shrink(v: f64) -> f64 {
    if v > 1e-9 { (1.0 - (1.0 + v).sqrt().recip()) / v } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitening_equals_the_inverse_square_root_of_the_covariance() {
        let jacobian = DMatrix::from_fn(10, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let covariance = DMatrix::identity(10, 10) + &jacobian * jacobian.transpose();
        let allowance = Allowance::new(jacobian);
        let mut root = DMatrix::identity(10, 10);
        allowance.whiten(&mut root);
        assert!((&root * &covariance * &root - DMatrix::identity(10, 10)).amax() < 1e-12);
        assert!((allowance.log_det() - covariance.determinant().ln()).abs() < 1e-10);
        allowance.unwhiten(&mut root);
        assert!((root - DMatrix::identity(10, 10)).amax() < 1e-12);
    }

    #[test]
    fn errors_of_another_size_are_those_of_a_jacobian_of_that_size() {
        let jacobian = DMatrix::from_fn(10, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let residual = DMatrix::from_fn(10, 1, |i, _| (i as f64).cos());
        let (scaled, direct) =
            (Allowance::new(jacobian.clone()).of_size(0.3), Allowance::new(0.3 * jacobian));
        let whitened = |by: &Allowance| {
            let mut white = residual.clone();
            by.whiten(&mut white);
            white
        };
        assert!((whitened(&scaled) - whitened(&direct)).amax() < 1e-12);
        let residual = residual.column(0).into_owned();
        assert!((scaled.estimate(&residual) - direct.estimate(&residual)).amax() < 1e-12);
        assert!((scaled.log_det() - direct.log_det()).abs() < 1e-12);
    }

    #[test]
    fn variances_are_those_of_errors_and_unknowns_together() {
        let jacobian = DMatrix::from_fn(12, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let columns = DMatrix::from_fn(12, 2, |i, j| ((i * 5 + j * 2) as f64).cos());
        let allowance = Allowance::new(jacobian.clone());
        let mut white = columns.clone();
        allowance.whiten(&mut white);
        let covariance = (white.transpose() * white).try_inverse().unwrap();
        // unknowns without a prior, errors with one of unit variance
        let mut all = columns.clone().resize_horizontally(5, 0.0);
        all.columns_mut(2, 3).copy_from(&jacobian);
        let mut information = all.transpose() * all;
        (2..5).for_each(|i| information[(i, i)] += 1.0);
        let joint = information.try_inverse().unwrap();
        let variances = allowance.variances(&columns, &covariance);
        (0..3).for_each(|i| assert!((variances[i] - joint[(2 + i, 2 + i)]).abs() < 1e-12));
    }

    #[test]
    fn estimate_recovers_errors_that_the_data_show_and_their_number() {
        let jacobian = DMatrix::from_fn(40, 2, |i, j| 30.0 * ((i + 1) as f64 * (j + 1) as f64 * 0.3).sin());
        let truth = DVector::from_vec(vec![0.8, -1.4]);
        let allowance = Allowance::new(jacobian.clone());
        assert!((allowance.estimate(&(jacobian * &truth)) - truth).amax() < 1e-3);
        assert!((allowance.used_up() - 2.0).abs() < 1e-3 && (allowance.determined(1) - 1.0).abs() < 1e-3);
    }
}

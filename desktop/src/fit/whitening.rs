//! The correlated noise that errors of the drawing amount to.
//!
//! Near a given drawing the response is linear in its errors, so a Gaussian prior on them is the same as
//! correlated noise with covariance `1 + J Jᵀ` in noise units, J the response per standard deviation.
//! Whitening by it makes the fit ignore what an error of the drawing could have done, no more.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The correlated noise that drawing errors amount to, around deviations `centre`.
pub struct Whitening {
    /// Weighted response per standard deviation of each deviation.
    jacobian: DMatrix<f64>,
    /// Where the jacobian was taken, in standard deviations.
    centre: DVector<f64>,
    vectors: DMatrix<f64>,
    shrink: DVector<f64>,
    /// ln det of the covariance in noise units.
    pub log_det: f64,
}

impl Whitening {
    /// From the response per standard deviation at `centre`.
    pub fn new(jacobian: DMatrix<f64>, centre: DVector<f64>) -> Self {
        let eigen = SymmetricEigen::new(jacobian.tr_mul(&jacobian));
        let values = eigen.eigenvalues.map(|v| v.max(0.0));
        // (1 + JJᵀ)^(−1/2) = 1 − J V diag((1 − (1+λ)^(−1/2)) / λ) Vᵀ Jᵀ
        let shrink = values.map(|v| if v > 1e-9 { (1.0 - (1.0 + v).sqrt().recip()) / v } else { 0.5 });
        let log_det = values.iter().map(|v| (1.0 + v).ln()).sum();
        Self { jacobian, centre, vectors: eigen.eigenvectors, shrink, log_det }
    }

    /// Whitens every column.
    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        let mut inner = self.vectors.tr_mul(&self.jacobian.tr_mul(columns));
        for (mut row, s) in inner.row_iter_mut().zip(self.shrink.iter()) {
            row *= *s;
        }
        columns.gemm(-1.0, &self.jacobian, &(&self.vectors * inner), 1.0);
    }

    /// Whitens weighted residuals of the drawing at `centre`, as deviations are counted from the drawing.
    pub fn apply_centred(&self, residual: &mut DVector<f64>) {
        residual.gemv(1.0, &self.jacobian, &self.centre, 1.0);
        let mut inner = self.vectors.tr_mul(&self.jacobian.tr_mul(residual));
        inner.component_mul_assign(&self.shrink);
        residual.gemv(-1.0, &self.jacobian, &(&self.vectors * inner), 1.0);
    }

    /// Change of the weighted response from the drawing at `centre` to one with these deviations.
    pub fn shift(&self, deviations: &DVector<f64>) -> DVector<f64> {
        &self.jacobian * (deviations - &self.centre)
    }

    /// Most probable deviations, in standard deviations, for weighted residuals of the drawing at `centre`.
    pub fn estimate(&self, residual: &DVector<f64>) -> DVector<f64> {
        let mut information = self.jacobian.tr_mul(&self.jacobian);
        for i in 0..information.nrows() {
            information[(i, i)] += 1.0;
        }
        let right = self.jacobian.tr_mul(&(residual + &self.jacobian * &self.centre));
        information.cholesky().map_or_else(|| self.centre.clone(), |c| c.solve(&right))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitening_equals_the_inverse_square_root_of_the_covariance() {
        let jacobian = DMatrix::from_fn(9, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let covariance = DMatrix::identity(9, 9) + &jacobian * jacobian.transpose();
        let w = Whitening::new(jacobian, DVector::zeros(3));
        let mut root = DMatrix::identity(9, 9);
        w.apply(&mut root);
        assert!((&root * &covariance * &root - DMatrix::identity(9, 9)).amax() < 1e-12);
        assert!((w.log_det - covariance.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn estimate_recovers_deviations_that_the_data_show_and_shrinks_them_by_the_prior() {
        let jacobian = DMatrix::from_fn(40, 2, |i, j| 30.0 * ((i + 1) as f64 * (j + 1) as f64 * 0.3).sin());
        let truth = DVector::from_vec(vec![0.8, -1.4]);
        let centre = DVector::from_vec(vec![0.5, 0.5]);
        let w = Whitening::new(jacobian.clone(), centre.clone());
        let found = w.estimate(&(&jacobian * (&truth - centre)));
        assert!((found - truth).amax() < 1e-3);
    }
}

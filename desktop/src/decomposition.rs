//! Decompositions of matrices that end whatever these hold: the library's iterate without a limit, and for ever on numbers
//! whose squares vanish.

use nalgebra::{Complex, ComplexField, DMatrix, DVector, Dyn, SVD, Scalar, Schur, SymmetricEigen};

type C = Complex<f64>;

/// Of the largest entry. Every decomposition here errs by more than 1e-16 of it, so that smaller ones are nothing.
const NOTHING: f64 = 1e-100;
/// Iterations for each row; LAPACK takes 30.
const PATIENCE: usize = 300;

/// With vectors on both sides; `None` if the matrix is not finite.
pub(crate) fn svd<T: ComplexField<RealField = f64>>(matrix: DMatrix<T>) -> Option<SVD<T, Dyn, Dyn>> {
    let limit = limit(&matrix);
    SVD::try_new(tame(matrix)?, true, true, 5.0 * f64::EPSILON, limit)
}

/// Descending; not numbers if the matrix is not finite.
pub(crate) fn singular_values<T: ComplexField<RealField = f64>>(matrix: DMatrix<T>) -> DVector<f64> {
    let least = matrix.nrows().min(matrix.ncols());
    let limit = limit(&matrix);
    tame(matrix)
        .and_then(|matrix| SVD::try_new(matrix, false, false, 5.0 * f64::EPSILON, limit))
        .map_or_else(|| DVector::repeat(least, f64::NAN), |svd| svd.singular_values)
}

/// Without the directions whose singular values are below `least`; `None` if the matrix is not finite.
pub(crate) fn pseudo_inverse<T: ComplexField<RealField = f64>>(
    matrix: DMatrix<T>,
    least: f64,
) -> Option<DMatrix<T>> {
    svd(matrix)?.pseudo_inverse(least).ok()
}

/// Of a Hermitian matrix; its eigenvalues are not numbers if it is not finite.
pub(crate) fn hermitian<T: ComplexField<RealField = f64>>(matrix: DMatrix<T>) -> SymmetricEigen<T, Dyn> {
    let size = matrix.nrows();
    let limit = limit(&matrix);
    tame(matrix).and_then(|matrix| SymmetricEigen::try_new(matrix, f64::EPSILON, limit)).unwrap_or_else(
        || SymmetricEigen {
            eigenvalues: DVector::repeat(size, f64::NAN),
            eigenvectors: DMatrix::identity(size, size),
        },
    )
}

/// `None` if the matrix is not finite, or they are not found.
pub(crate) fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<C>> {
    let limit = limit(&matrix);
    let schur = Schur::try_new(tame(matrix)?, f64::EPSILON, limit)?;
    Some(schur.complex_eigenvalues().iter().copied().collect())
}

fn limit<T: Scalar>(matrix: &DMatrix<T>) -> usize {
    PATIENCE * matrix.nrows().max(matrix.ncols()).max(1)
}

/// The matrix without what is nothing; `None` if it is not finite.
fn tame<T: ComplexField<RealField = f64>>(mut matrix: DMatrix<T>) -> Option<DMatrix<T>> {
    let sizes = matrix.map(|entry| entry.norm1());
    if !sizes.iter().all(|size| size.is_finite()) {
        return None;
    }
    let nothing = NOTHING * sizes.amax();
    for (entry, size) in matrix.iter_mut().zip(&sizes) {
        if *size < nothing {
            *entry = T::zero();
        }
    }
    Some(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A product with a known spectrum, and numbers of 1e-300 to 1e-310 in some of its places.
    fn graded() -> DMatrix<f64> {
        let mut matrix = DMatrix::from_fn(9, 9, |i, j| 1.0 / (1.0 + (i + j) as f64));
        for k in 0..9 {
            matrix[(3, k)] = 1e-300 * (1.0 + k as f64);
            matrix[(k, 3)] = 1e-310;
        }
        matrix
    }

    #[test]
    fn numbers_whose_squares_vanish_neither_hang_nor_change_a_decomposition() {
        let (matrix, mut without) = (graded(), graded());
        without.row_mut(3).fill(0.0);
        without.column_mut(3).fill(0.0);
        let found = svd(matrix.clone()).unwrap();
        assert!((&found.singular_values - without.clone().singular_values()).amax() < 1e-14);
        assert!((found.recompose().unwrap() - &without).amax() < 1e-14);
        assert!((singular_values(matrix.clone()) - singular_values(without.clone())).amax() < 1e-14);
        let symmetric = |m: &DMatrix<f64>| (m + m.transpose()) * 0.5;
        let own = hermitian(symmetric(&matrix));
        assert!((own.recompose() - symmetric(&without)).amax() < 1e-14);
        let sum: C = eigenvalues(matrix.clone()).unwrap().iter().sum();
        assert!((sum - C::from(without.trace())).norm() < 1e-13);
    }

    #[test]
    fn a_matrix_that_is_not_finite_has_no_decomposition_and_does_not_hang() {
        for value in [f64::NAN, f64::INFINITY] {
            let mut matrix = DMatrix::<f64>::identity(4, 4);
            matrix[(1, 2)] = value;
            assert!(svd(matrix.clone()).is_none() && eigenvalues(matrix.clone()).is_none());
            assert!(pseudo_inverse(matrix.clone(), 1e-12).is_none());
            assert!(singular_values(matrix.clone()).iter().all(|v| v.is_nan()));
            assert!(hermitian(matrix).eigenvalues.iter().all(|v| v.is_nan()));
        }
    }
}

//! Decompositions of matrices that end whatever these hold: the library's iterate without a limit, and for ever where
//! an entry is not a number.

pub(crate) mod eigen;
pub(crate) mod small;

use nalgebra::{Complex, ComplexField, DMatrix, DVector, Dyn, SVD, Scalar, Schur, SymmetricEigen};
use ndarray::linalg::general_mat_mul;
use ndarray::{ArrayView2, ArrayViewMut2, Axis, ShapeBuilder, Slice};

type C = Complex<f64>;

/// Iterations for each row; LAPACK takes 30.
const PATIENCE: usize = 300;

/// Rows that a product of a transpose takes at a time, so that they stay in the processor's cache.
const BLOCK: usize = 128;
/// Columns up to which nalgebra sums column by column. Its rounding is kept there, as fits to data that do not determine them follow it.
const FEW: usize = 5;

/// `aᵀb`. nalgebra's own product of a transpose takes one column at a time; for more than a few columns, blocks are several times as fast.
pub(crate) fn transposed_product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    by_blocks(a, b, BLOCK)
}

/// The same over all rows at once, rounded as nalgebra rounds a transpose times a matrix.
pub(crate) fn transposed_product_at_once(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    by_blocks(a, b, a.nrows().max(1))
}

fn by_blocks(a: &DMatrix<f64>, b: &DMatrix<f64>, rows: usize) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(a.ncols(), b.ncols());
    let is_narrow = a.ncols().min(b.ncols()) <= FEW;
    let rows = if is_narrow { BLOCK } else { rows };
    for first in (0..a.nrows()).step_by(rows) {
        let count = rows.min(a.nrows() - first);
        if is_narrow {
            product.gemm(1.0, &a.rows(first, count).transpose(), &b.rows(first, count), 1.0);
        } else {
            let rows_of = |m| view(m).slice_axis_move(Axis(0), Slice::from(first..first + count));
            general_mat_mul(1.0, &rows_of(a).t(), &rows_of(b), 1.0, &mut view_mut(&mut product));
        }
    }
    product
}

fn view(matrix: &DMatrix<f64>) -> ArrayView2<'_, f64> {
    let flat = ArrayView2::from_shape(matrix.shape().f(), matrix.as_slice());
    flat.expect("a matrix has as many entries as its rows times its columns")
}

fn view_mut(matrix: &mut DMatrix<f64>) -> ArrayViewMut2<'_, f64> {
    let flat = ArrayViewMut2::from_shape(matrix.shape().f(), matrix.as_mut_slice());
    flat.expect("a matrix has as many entries as its rows times its columns")
}

/// With vectors on both sides; `None` if the matrix is not finite.
pub(crate) fn svd<T: ComplexField<RealField = f64>>(matrix: DMatrix<T>) -> Option<SVD<T, Dyn, Dyn>> {
    let limit = limit(&matrix);
    SVD::try_new(finite(matrix)?, true, true, 5.0 * f64::EPSILON, limit)
}

/// Descending; not numbers if the matrix is not finite.
pub(crate) fn singular_values<T: ComplexField<RealField = f64>>(matrix: DMatrix<T>) -> DVector<f64> {
    let least = matrix.nrows().min(matrix.ncols());
    let limit = limit(&matrix);
    finite(matrix)
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
    finite(matrix).and_then(|matrix| SymmetricEigen::try_new(matrix, f64::EPSILON, limit)).unwrap_or_else(
        || SymmetricEigen {
            eigenvalues: DVector::repeat(size, f64::NAN),
            eigenvectors: DMatrix::identity(size, size),
        },
    )
}

/// `None` if the matrix is not finite, or they are not found.
pub(crate) fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<C>> {
    let limit = limit(&matrix);
    let schur = Schur::try_new(finite(matrix)?, f64::EPSILON, limit)?;
    Some(schur.complex_eigenvalues().iter().copied().collect())
}

fn limit<T: Scalar>(matrix: &DMatrix<T>) -> usize {
    PATIENCE * matrix.nrows().max(matrix.ncols()).max(1)
}

/// The matrix, if it is finite.
fn finite<T: ComplexField<RealField = f64>>(matrix: DMatrix<T>) -> Option<DMatrix<T>> {
    matrix.iter().all(|entry| entry.clone().norm1().is_finite()).then_some(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_of_a_transpose_is_its_sum_over_rows_at_any_size() {
        for [rows, columns, others] in [[300, 3, 2], [300, 20, 12], [5, 0, 1], [7, 9, 1]] {
            let a = DMatrix::from_fn(rows, columns, |i, j| ((i + 7 * j) as f64).sin());
            let b = DMatrix::from_fn(rows, others, |i, j| ((3 * i + j) as f64).cos());
            let sum = |j: usize, k: usize| (0..rows).map(|i| a[(i, j)] * b[(i, k)]).sum::<f64>();
            let product = DMatrix::from_fn(columns, others, sum);
            assert!((transposed_product(&a, &b) - &product).amax() < 1e-12);
            assert_eq!(transposed_product_at_once(&a, &b), a.transpose() * b);
        }
    }

    #[test]
    fn what_is_found_makes_up_the_matrix_again() {
        // of Hilbert, as badly conditioned as they come
        let matrix = DMatrix::from_fn(9, 9, |i, j| 1.0 / (1.0 + (i + j) as f64));
        let found = svd(matrix.clone()).unwrap();
        assert!((found.recompose().unwrap() - &matrix).amax() < 1e-14);
        let own = hermitian(matrix.clone());
        assert!((own.recompose() - &matrix).amax() < 1e-14);
        // of a positive definite matrix, the singular values are the eigenvalues, and their sum is the trace
        let values: [f64; 3] = [
            singular_values(matrix.clone()).sum(),
            own.eigenvalues.sum(),
            eigenvalues(matrix.clone()).unwrap().iter().map(|value| value.re).sum(),
        ];
        assert!(values.iter().all(|sum| (sum - matrix.trace()).abs() < 1e-13), "{values:?}");
        let regular = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 0.0, 4.0]);
        let inverse = DMatrix::from_row_slice(2, 2, &[0.5, -0.125, 0.0, 0.25]);
        assert!((pseudo_inverse(regular, 1e-12).unwrap() - inverse).amax() < 1e-15);
    }

    #[test]
    fn non_finite_matrix_has_no_decomposition_and_terminates() {
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

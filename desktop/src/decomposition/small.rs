//! Systems of a few complex equations that are solved over and over: for the bearings of a machine at one speed.

use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// The size of most of them, two bearings in two directions: known to the compiler, such a system needs no memory of its own.
const USUAL: usize = 4;

/// Solves in place for every column of `right`; `None` if the square matrix is singular.
pub(crate) fn solve(matrix: DMatrix<C>, right: &mut DMatrix<C>) -> Option<()> {
    let solved = if matrix.nrows() == USUAL {
        matrix.fixed_view::<USUAL, USUAL>(0, 0).into_owned().lu().solve_mut(right)
    } else {
        matrix.lu().solve_mut(right)
    };
    solved.then_some(())
}

/// Solves in place for every column of `right`, and with the transpose of the matrix for every column of `of_transpose`; `None` if the
/// square matrix is singular.
pub(crate) fn solve_both(
    matrix: DMatrix<C>,
    right: &mut DMatrix<C>,
    of_transpose: &mut DMatrix<C>,
) -> Option<()> {
    if matrix.nrows() == USUAL {
        let matrix = matrix.fixed_view::<USUAL, USUAL>(0, 0).into_owned();
        let solved = matrix.lu().solve_mut(right) && matrix.transpose().lu().solve_mut(of_transpose);
        return solved.then_some(());
    }
    let factors = matrix.lu();
    let solved = factors.solve_mut(right)
        && factors.u().tr_solve_upper_triangular_mut(of_transpose)
        && factors.l().tr_solve_lower_triangular_mut(of_transpose);
    factors.p().inv_permute_rows(of_transpose);
    solved.then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(rows: usize, columns: usize) -> DMatrix<C> {
        // the product of row and column keeps the rank from that of a few waves
        let phase = |i: usize, j: usize| (i * 7 + j * 3 + i * i * j * 5 + 1) as f64;
        DMatrix::from_fn(rows, columns, |i, j| C::new(phase(i, j).sin(), phase(j, i).cos()))
    }

    #[test]
    fn solutions_of_any_size_fulfil_their_equations() {
        for size in [1, 2, 4, 6, 10] {
            let (matrix, right) = (numbers(size, size), numbers(size, 3));
            let (mut x, mut y, mut alone) = (right.clone(), right.clone(), right.clone());
            solve_both(matrix.clone(), &mut x, &mut y).unwrap();
            solve(matrix.clone(), &mut alone).unwrap();
            let off = (&matrix * &x - &right).map(|v| v.norm()).max();
            let off_transposed = (matrix.transpose() * &y - &right).map(|v| v.norm()).max();
            assert!(off < 1e-11 && off_transposed < 1e-11, "{size}: {off} {off_transposed}");
            assert!((&alone - &x).map(|v| v.norm()).max() < 1e-11, "{size}: {alone} {x}");
        }
    }

    #[test]
    fn singular_system_has_no_solution() {
        for size in [3, 4] {
            let [mut x, mut y] = [numbers(size, 1), numbers(size, 1)];
            assert_eq!(solve_both(DMatrix::zeros(size, size), &mut x, &mut y), None);
            assert_eq!(solve(DMatrix::zeros(size, size), &mut x), None);
        }
    }
}

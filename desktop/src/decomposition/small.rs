//! Systems of a few complex equations that are solved over and over: for the bearings of a machine at one speed.

use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// The size of most of them, two bearings in two directions: the compiler unrolls the loops for it.
const USUAL: usize = 4;

/// LU factors with partial pivoting. Beside its own storage nothing is allocated.
pub(crate) struct SmallSystem {
    /// Both factors, the inverse of each pivot in the diagonal.
    factors: DMatrix<C>,
    /// The row that each row was exchanged with, in turn.
    exchanged: Vec<usize>,
}

impl SmallSystem {
    /// `None` if the square matrix is singular.
    pub(crate) fn new(mut matrix: DMatrix<C>) -> Option<Self> {
        let size = matrix.nrows();
        let mut exchanged = vec![0; size];
        let regular = match size {
            USUAL => factor(matrix.as_mut_slice(), &mut exchanged, USUAL),
            _ => factor(matrix.as_mut_slice(), &mut exchanged, size),
        };
        regular.then_some(Self { factors: matrix, exchanged })
    }

    /// Solves in place for every column.
    pub(crate) fn solve(&self, columns: &mut DMatrix<C>) {
        let (a, size) = (self.factors.as_slice(), self.exchanged.len());
        for x in columns.as_mut_slice().chunks_exact_mut(size.max(1)) {
            match size {
                USUAL => solve(a, &self.exchanged, x, USUAL),
                _ => solve(a, &self.exchanged, x, size),
            }
        }
    }

    /// The same with the transpose of the matrix.
    pub(crate) fn solve_transposed(&self, columns: &mut DMatrix<C>) {
        let (a, size) = (self.factors.as_slice(), self.exchanged.len());
        for x in columns.as_mut_slice().chunks_exact_mut(size.max(1)) {
            match size {
                USUAL => solve_transposed(a, &self.exchanged, x, USUAL),
                _ => solve_transposed(a, &self.exchanged, x, size),
            }
        }
    }
}

/// `y − A x` in place of y, A a square matrix.
pub(crate) fn subtract_product(matrix: &DMatrix<C>, x: &[C], y: &mut [C]) {
    match x.len() {
        USUAL => subtract(matrix.as_slice(), x, y, USUAL),
        size => subtract(matrix.as_slice(), x, y, size),
    }
}

#[inline(always)]
fn subtract(a: &[C], x: &[C], y: &mut [C], size: usize) {
    let (a, x, y) = (&a[..size * size], &x[..size], &mut y[..size]);
    for j in 0..size {
        for i in 0..size {
            y[i] -= a[i + j * size] * x[j];
        }
    }
}

#[inline(always)]
fn factor(a: &mut [C], exchanged: &mut [usize], size: usize) -> bool {
    let (a, exchanged) = (&mut a[..size * size], &mut exchanged[..size]);
    for k in 0..size {
        let mut pivot = k;
        for i in k + 1..size {
            if a[i + k * size].norm_sqr() > a[pivot + k * size].norm_sqr() {
                pivot = i;
            }
        }
        exchanged[k] = pivot;
        for j in 0..size {
            a.swap(k + j * size, pivot + j * size);
        }
        let inverse = a[k + k * size].inv();
        if !inverse.is_finite() {
            return false;
        }
        a[k + k * size] = inverse;
        for i in k + 1..size {
            a[i + k * size] *= inverse;
        }
        for j in k + 1..size {
            let above = a[k + j * size];
            for i in k + 1..size {
                let change = a[i + k * size] * above;
                a[i + j * size] -= change;
            }
        }
    }
    true
}

#[inline(always)]
fn solve(a: &[C], exchanged: &[usize], x: &mut [C], size: usize) {
    let (a, exchanged, x) = (&a[..size * size], &exchanged[..size], &mut x[..size]);
    for k in 0..size {
        x.swap(k, exchanged[k]);
    }
    for k in 0..size {
        for i in k + 1..size {
            x[i] -= a[i + k * size] * x[k];
        }
    }
    for k in (0..size).rev() {
        x[k] *= a[k + k * size];
        for i in 0..k {
            x[i] -= a[i + k * size] * x[k];
        }
    }
}

#[inline(always)]
fn solve_transposed(a: &[C], exchanged: &[usize], x: &mut [C], size: usize) {
    let (a, exchanged, x) = (&a[..size * size], &exchanged[..size], &mut x[..size]);
    for k in 0..size {
        for i in 0..k {
            x[k] -= a[i + k * size] * x[i];
        }
        x[k] *= a[k + k * size];
    }
    for k in (0..size).rev() {
        for i in k + 1..size {
            x[k] -= a[i + k * size] * x[i];
        }
    }
    for k in (0..size).rev() {
        x.swap(k, exchanged[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(rows: usize, columns: usize) -> DMatrix<C> {
        // the first pivot is not the largest of its column
        let entry = |i: usize, j: usize| ((i * 7 + j * 3 + 1) as f64, (i * 2 + j * 5 + 3) as f64);
        DMatrix::from_fn(rows, columns, |i, j| C::new(entry(i, j).0.sin(), entry(i, j).1.cos()))
    }

    #[test]
    fn solutions_of_any_size_fulfil_their_equations() {
        for size in [1, 2, 4, 6, 10] {
            let (matrix, right) = (numbers(size, size), numbers(size, 3));
            let system = SmallSystem::new(matrix.clone()).unwrap();
            let (mut x, mut y) = (right.clone(), right.clone());
            system.solve(&mut x);
            system.solve_transposed(&mut y);
            let off = (&matrix * &x - &right).map(|v| v.norm()).max();
            let off_transposed = (matrix.transpose() * &y - &right).map(|v| v.norm()).max();
            assert!(off < 1e-11 && off_transposed < 1e-11, "{size}: {off} {off_transposed}");
            let mut left = right.column(0).into_owned();
            subtract_product(&matrix, x.column(0).into_owned().as_slice(), left.as_mut_slice());
            assert!(left.map(|v| v.norm()).max() < 1e-11);
        }
    }

    #[test]
    fn singular_system_has_no_factors() {
        assert!(SmallSystem::new(DMatrix::zeros(4, 4)).is_none());
        let mut matrix = numbers(3, 3);
        let first = matrix.column(0).into_owned();
        matrix.set_column(2, &first);
        matrix[(0, 1)] = C::new(f64::NAN, 0.0);
        assert!(SmallSystem::new(matrix).is_none());
    }
}

//! A complex band matrix and its LU factors with row exchanges (LAPACK's `gbtrf` stores them the same way; Golub and Van Loan,
//! Matrix Computations, section 4.3.5). One solution costs O(n) for a shaft of n nodes.

use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// A square matrix whose entries lie within `half_width` of the diagonal.
#[derive(Debug, Clone)]
pub struct Banded {
    size: usize,
    half_width: usize,
    /// Column by column: `2 half_width` places above the diagonal, of which row exchanges fill the upper half, the diagonal, and
    /// `half_width` places below it.
    columns: Vec<C>,
}

/// Factors of a [`Banded`] matrix.
#[derive(Debug, Clone)]
pub struct BandedLu {
    matrix: Banded,
    /// Row that each step exchanged its own with.
    pivots: Vec<usize>,
}

impl Banded {
    pub fn zeros(size: usize, half_width: usize) -> Self {
        Self { size, half_width, columns: vec![C::from(0.0); size * (3 * half_width + 1)] }
    }

    fn index(&self, row: usize, column: usize) -> usize {
        column * (3 * self.half_width + 1) + 2 * self.half_width + row - column
    }

    /// Adds to an entry of the band.
    ///
    /// # Panics
    /// Outside the band.
    pub fn add(&mut self, row: usize, column: usize, value: C) {
        assert!(row.abs_diff(column) <= self.half_width, "({row}, {column}) is outside the band");
        let at = self.index(row, column);
        self.columns[at] += value;
    }

    /// LU factors with partial pivoting; `None` if the matrix is singular.
    pub fn factor(mut self) -> Option<BandedLu> {
        let (n, width) = (self.size, self.half_width);
        let mut pivots = Vec::with_capacity(n);
        let mut last_filled = 0;
        for step in 0..n {
            let below = width.min(n - 1 - step);
            let diagonal = self.index(step, step);
            let candidates = &self.columns[diagonal..=diagonal + below];
            let (pivot, largest) = candidates
                .iter()
                .map(|v| v.l1_norm())
                .enumerate()
                .fold((0, 0.0), |best, (i, size)| if size > best.1 { (i, size) } else { best });
            if largest == 0.0 || !largest.is_finite() {
                return None;
            }
            pivots.push(step + pivot);
            last_filled = last_filled.max((step + width + pivot).min(n - 1));
            if pivot != 0 {
                for column in step..=last_filled {
                    let here = self.index(step, column);
                    self.columns.swap(here, here + pivot);
                }
            }
            let inverse = self.columns[diagonal].inv();
            self.columns[diagonal + 1..=diagonal + below].iter_mut().for_each(|l| *l *= inverse);
            let (done, rest) = self.columns.split_at_mut((step + 1) * (3 * width + 1));
            let multipliers = &done[diagonal + 1..=diagonal + below];
            for (ahead, column) in rest.chunks_exact_mut(3 * width + 1).take(last_filled - step).enumerate() {
                let at = 2 * width - (ahead + 1);
                let factor = column[at];
                if factor != C::from(0.0) {
                    for (value, l) in column[at + 1..].iter_mut().zip(multipliers) {
                        *value -= l * factor;
                    }
                }
            }
        }
        Some(BandedLu { matrix: self, pivots })
    }
}

impl BandedLu {
    /// Solves for every column in place.
    pub fn solve(&self, columns: &mut DMatrix<C>) {
        let Banded { size, half_width, columns: factors } = &self.matrix;
        let (n, width) = (*size, *half_width);
        for mut column in columns.column_iter_mut() {
            let b = column.as_mut_slice();
            for (step, pivot) in self.pivots.iter().enumerate() {
                b.swap(step, *pivot);
                let value = b[step];
                let below = width.min(n - 1 - step);
                let from = self.matrix.index(step, step) + 1;
                for (b, l) in b[step + 1..].iter_mut().zip(&factors[from..from + below]) {
                    *b -= l * value;
                }
            }
            for step in (0..n).rev() {
                let diagonal = self.matrix.index(step, step);
                b[step] *= factors[diagonal].inv();
                let value = b[step];
                let above = (2 * width).min(step);
                for (b, u) in b[step - above..step].iter_mut().zip(&factors[diagonal - above..diagonal]) {
                    *b -= u * value;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn banded_solution_equals_dense_lu() {
        let mut random = StdRng::seed_from_u64(7);
        for (size, half_width) in [(1, 0), (3, 1), (5, 7), (40, 3), (60, 7)] {
            let mut banded = Banded::zeros(size, half_width);
            let mut dense = DMatrix::<C>::zeros(size, size);
            for row in 0..size {
                for column in 0..size {
                    if row.abs_diff(column) <= half_width {
                        let value = C::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0));
                        // small diagonals need the exchange of rows
                        let value = if row == column { value * 1e-9 } else { value };
                        banded.add(row, column, value);
                        dense[(row, column)] += value;
                    }
                }
            }
            let right = DMatrix::from_fn(size, 3, |i, j| C::new(i as f64 + 1.0, j as f64 - 1.0));
            let mut solution = right.clone();
            banded.factor().unwrap().solve(&mut solution);
            let left = (&dense * &solution - &right).norm() / (dense.norm() * solution.norm());
            assert!(left < 1e-14, "{size} × {half_width}: {left:e}");
        }
    }

    #[test]
    fn singular_matrix_has_no_factors() {
        let mut banded = Banded::zeros(4, 1);
        for i in 0..4 {
            banded.add(i, i, C::from(1.0));
        }
        banded.add(2, 2, C::from(-1.0));
        assert!(banded.factor().is_none());
    }
}

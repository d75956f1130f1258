//! Cholesky factors of a symmetric positive definite band matrix.
//!
//! nalgebra has dense and (in another crate) general sparse factors only; a band of a mesh a few nodes
//! wide is factored in place here, forty lines that need no ordering and no allocation per column.

/// The lower half of a symmetric band matrix: row k holds the diagonal and `width` entries left of it.
pub(super) struct Band {
    width: usize,
    rows: Vec<f64>,
}

impl Band {
    /// A zero matrix of `order` rows.
    pub(super) fn zeros(order: usize, width: usize) -> Self {
        Self { width, rows: vec![0.0; order * (width + 1)] }
    }

    /// Entry `(row, row − left)`.
    pub(super) fn set(&mut self, row: usize, left: usize, value: f64) {
        self.rows[row * (self.width + 1) + self.width - left] = value;
    }

    /// The lower factor L with A = L Lᵀ, in place of A.
    pub(super) fn factor(mut self) -> Self {
        let (width, stride) = (self.width, self.width + 1);
        for row in 0..self.rows.len() / stride {
            let (above, this) = self.rows.split_at_mut(row * stride);
            let this = &mut this[..stride];
            for left in (1..=width.min(row)).rev() {
                let column = row - left;
                let other = &above[column * stride..][..stride];
                let shared = width - left;
                let dot: f64 = this[..shared].iter().zip(&other[left..width]).map(|(a, b)| a * b).sum();
                this[shared] = (this[shared] - dot) / other[width];
            }
            let squares: f64 = this[..width].iter().map(|a| a * a).sum();
            this[width] = (this[width] - squares).sqrt();
        }
        self
    }

    /// Solves A x = b in place, `self` being the factor.
    pub(super) fn solve(&self, b: &mut [f64]) {
        let (width, stride) = (self.width, self.width + 1);
        for row in 0..b.len() {
            let this = &self.rows[row * stride..][..stride];
            let reach = width.min(row);
            let dot: f64 =
                this[width - reach..width].iter().zip(&b[row - reach..row]).map(|(a, x)| a * x).sum();
            b[row] = (b[row] - dot) / this[width];
        }
        for row in (0..b.len()).rev() {
            let this = &self.rows[row * stride..][..stride];
            let reach = width.min(row);
            b[row] /= this[width];
            let x = b[row];
            for (a, above) in this[width - reach..width].iter().zip(&mut b[row - reach..row]) {
                *above -= a * x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn the_banded_solution_is_the_dense_one() {
        let (order, width) = (23, 4);
        let mut dense = DMatrix::zeros(order, order);
        let mut band = Band::zeros(order, width);
        for row in 0..order {
            for left in 0..=width.min(row) {
                let value =
                    if left == 0 { 9.0 + (row as f64).sin() } else { ((row * 7 + left) as f64).cos() };
                dense[(row, row - left)] = value;
                dense[(row - left, row)] = value;
                band.set(row, left, value);
            }
        }
        let b = DVector::from_fn(order, |i, _| (i as f64 * 0.7).sin());
        let expected = dense.lu().solve(&b).expect("regular");
        let mut x = b.as_slice().to_vec();
        band.factor().solve(&mut x);
        assert!(x.iter().zip(expected.iter()).all(|(a, b)| (a - b).abs() < 1e-13));
    }
}

//! The linear unknowns, solved for exactly at each point of a search (variable projection, Golub and Pereyra
//! 1973).

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use super::data::Data;
use crate::decomposition::transposed_product;
use crate::statistics::whitening::Whitening;

type C = Complex<f64>;

/// The linear unknowns solved for, and what they leave.
pub struct LinearSolution {
    /// Linear unknowns: planes (kg·m), then the effects' in their own units.
    pub unknowns: Vec<C>,
    /// Weighted (and whitened) residuals, real and imaginary parts in turn.
    pub weighted: DVector<f64>,
    /// Weighted residuals before whitening.
    pub left: DVector<f64>,
    /// Weighted (and whitened) response per real and imaginary part of each linear unknown.
    pub columns: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
}

impl LinearSolution {
    /// Solves for the unknowns; `None` if they cannot be told apart at all.
    pub fn new(columns: DMatrix<f64>, target: DVector<f64>, whitening: &Whitening) -> Option<Self> {
        if whitening.is_plain() {
            return Self::of_white(columns, target);
        }
        let (white, white_target) = whitening.apply_with(&columns, &target);
        let (solution, normal) = solved(&white, &white_target)?;
        let left = target - columns * &solution;
        let weighted = white_target - &white * &solution;
        Some(Self { unknowns: pairs(&solution), weighted, left, columns: white, normal })
    }

    /// The same of a system whose noise is white and of unit size.
    pub fn of_white(columns: DMatrix<f64>, target: DVector<f64>) -> Option<Self> {
        let (solution, normal) = solved(&columns, &target)?;
        let weighted = target - &columns * &solution;
        Some(Self { unknowns: pairs(&solution), left: weighted.clone(), weighted, columns, normal })
    }

    /// Real and imaginary part of each unknown in turn.
    pub fn flat(&self) -> DVector<f64> {
        DVector::from_iterator(2 * self.unknowns.len(), self.unknowns.iter().flat_map(|u| [u.re, u.im]))
    }

    /// Model at every value, m.
    pub fn predicted_m(&self, data: &Data) -> Vec<C> {
        let left = self.left.as_slice().chunks(2).map(|l| C::new(l[0], l[1]));
        data.values().zip(left).map(|(v, left)| v.measured_m - left * v.sigma_m).collect()
    }

    /// Takes out of every column what the linear unknowns can follow.
    pub fn project(&self, columns: &mut DMatrix<f64>) {
        let followed = self.normal.solve(&transposed_product(&self.columns, columns));
        columns.gemm(-1.0, &self.columns, &followed, 1.0);
    }
}

fn pairs(flat: &DVector<f64>) -> Vec<C> {
    flat.as_slice().chunks(2).map(|pair| C::new(pair[0], pair[1])).collect()
}

fn solved(columns: &DMatrix<f64>, target: &DVector<f64>) -> Option<(DVector<f64>, Cholesky<f64, Dyn>)> {
    let normal = ridged_normal(columns)?;
    Some((normal.solve(&columns.tr_mul(target)), normal))
}

/// Cholesky factor of the normal matrix with a whiff of ridge, so that two columns that the data cannot
/// tell apart share what there is.
fn ridged_normal(columns: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let mut normal = transposed_product(columns, columns);
    for i in 0..normal.nrows() {
        normal[(i, i)] *= 1.0 + 1e-12;
        if normal[(i, i)] == 0.0 {
            normal[(i, i)] = 1.0;
        }
    }
    normal.cholesky()
}

//! Least squares for curves with a handful of unknowns: the descent of the fitting engine with
//! derivatives by differences.

use nalgebra::{DMatrix, DVector};

use crate::fit::descent::{Objective, Stop, descend};

/// Step of the differences: unknowns are logarithms, angles or of order one.
const STEP: f64 = 1e-5;
const TO_THE_END: Stop = Stop::after(60, 1e-10);

struct ResidualObjective<F> {
    residuals: F,
    at: DVector<f64>,
}

impl<F: Fn(&DVector<f64>) -> DVector<f64>> ResidualObjective<F> {
    fn jacobian(&self) -> DMatrix<f64> {
        let column = |j: usize| {
            let beside = |step: f64| {
                let mut x = self.at.clone();
                x[j] += step;
                (self.residuals)(&x)
            };
            (beside(STEP) - beside(-STEP)) / (2.0 * STEP)
        };
        DMatrix::from_columns(&(0..self.at.len()).map(column).collect::<Vec<_>>())
    }
}

impl<F: Fn(&DVector<f64>) -> DVector<f64>> Objective for ResidualObjective<F> {
    fn position(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn move_to(&mut self, x: &DVector<f64>) {
        self.at = x.clone();
    }

    fn value(&self) -> f64 {
        (self.residuals)(&self.at).norm_squared()
    }

    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let jacobian = self.jacobian();
        let slope = jacobian.tr_mul(&(self.residuals)(&self.at));
        Some((jacobian.tr_mul(&jacobian), slope))
    }
}

/// Where weighted residuals are least, and the covariance there; `None` where the data leave a direction
/// open.
pub fn minimum(
    start: DVector<f64>,
    residuals: impl Fn(&DVector<f64>) -> DVector<f64>,
) -> (DVector<f64>, Option<DMatrix<f64>>) {
    let mut curve = ResidualObjective { residuals, at: start };
    descend(&mut curve, TO_THE_END);
    let jacobian = curve.jacobian();
    let covariance = jacobian.tr_mul(&jacobian).try_inverse();
    (curve.at, covariance)
}

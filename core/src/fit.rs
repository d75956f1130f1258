//! The problem of phase II at one speed: the unbalance of least absolute residual within a disc for each plane.

use nalgebra::SMatrix;

use crate::model::{MAX_PLANES, Pair};
use crate::reading::FEATURES;
use crate::scalar;

/// Minimise `Σ|H u − target|` subject to `|u_k| ≤ bound_k`: convex, so any minimum is the minimum.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// H: µm per g·mm, columns `U1 cos α1, U1 sin α1, U2 cos α2, U2 sin α2`.
    pub influence: SMatrix<f32, FEATURES, 4>,
    /// Measured features less those present without unbalance, µm.
    pub target_um: [f32; FEATURES],
    /// Largest unbalance allowed in each plane, g·mm.
    pub bound_g_mm: [f32; MAX_PLANES],
}

impl Fit {
    /// `H u − target`, µm.
    #[inline]
    pub fn residuals_um(&self, unbalance_g_mm: &[Pair; MAX_PLANES]) -> [f32; FEATURES] {
        let mut residuals = self.target_um.map(|target| -target);
        for (column, &unbalance) in self.influence.data.0.iter().zip(unbalance_g_mm.as_flattened()) {
            for (residual, &influence) in residuals.iter_mut().zip(column) {
                *residual += influence * unbalance;
            }
        }
        residuals
    }

    /// `Σ|H u − target|`, µm.
    #[inline]
    pub fn residual_um(&self, unbalance_g_mm: &[Pair; MAX_PLANES]) -> f32 {
        self.residuals_um(unbalance_g_mm).iter().map(|residual| residual.abs()).sum()
    }

    /// The nearest unbalance within the bounds: each plane outside its disc is drawn back along its radius.
    #[inline]
    pub fn confine(&self, unbalance_g_mm: [Pair; MAX_PLANES]) -> [Pair; MAX_PLANES] {
        let [first, second] = unbalance_g_mm;
        let [a, b] = self.bound_g_mm;
        [confine(first, a), confine(second, b)]
    }
}

#[inline]
fn confine([x, y]: Pair, bound: f32) -> Pair {
    let square = x * x + y * y;
    if square <= bound * bound {
        return [x, y];
    }
    let factor = bound / scalar::sqrt(square);
    [x * factor, y * factor]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confining_keeps_the_angle_and_shortens_to_the_bound() {
        assert_eq!(confine([3.0, 4.0], 10.0), [3.0, 4.0]);
        let [x, y] = confine([3.0, 4.0], 1.0);
        assert!((x - 0.6).abs() < 1e-6 && (y - 0.8).abs() < 1e-6);
        assert_eq!(confine([3.0, -4.0], 0.0), [0.0, -0.0]);
    }
}

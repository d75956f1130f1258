//! The dual bound.

use crate::fit::BoundedFit;
use crate::model::Pair;
use crate::scalar;

/// `Hᵀλ`, µm per g·mm of each plane; `multipliers` are one λ a row.
pub(super) fn pull<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    multipliers: &[f32],
) -> [Pair; PLANES] {
    let mut pull = [[0.0; 2]; PLANES];
    for (row, multiplier) in fit.rows().iter().zip(multipliers) {
        for ([x, y], [a, b]) in pull.iter_mut().zip(row) {
            *x += multiplier * a;
            *y += multiplier * b;
        }
    }
    pull
}

/// `g(λ) = −λᵀt − Σ b_k ‖(Hᵀλ)_k‖`, µm: no unbalance within the bounds leaves less. What lies outside of −1..1 is cut off,
/// and a row without a multiplier counts as zero, so that this holds whatever is given.
pub(super) fn least_um<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    multipliers: &mut [f32],
) -> f32 {
    let mut least = 0.0;
    for (multiplier, target) in multipliers.iter_mut().zip(fit.target_um()) {
        *multiplier = multiplier.clamp(-1.0, 1.0);
        least -= *multiplier * target;
    }
    for (&pull, bound) in pull(fit, multipliers).iter().zip(fit.bound_g_mm()) {
        least -= bound * scalar::length(pull);
    }
    least
}

//! The dual bound.

use crate::fit::Fit;
use crate::scalar;

/// `g(λ) = −λᵀt − Σ b_k ‖(Hᵀλ)_k‖`, µm: no unbalance within the bounds leaves less. `multipliers` are one λ a row; what lies
/// outside of −1..1 is cut off, and a row without one counts as zero, so that the bound holds whatever is given.
pub(super) fn least_um<const PROBES: usize, const PLANES: usize>(
    fit: &Fit<PROBES, PLANES>,
    multipliers: impl Iterator<Item = f32>,
) -> f32 {
    let mut least = 0.0;
    let mut pull = [[0.0_f32; 2]; PLANES];
    for ((row, target), multiplier) in fit.rows().iter().zip(fit.target_um()).zip(multipliers) {
        let multiplier = multiplier.clamp(-1.0, 1.0);
        least -= multiplier * target;
        for ([x, y], [a, b]) in pull.iter_mut().zip(row).take(fit.planes()) {
            *x += multiplier * a;
            *y += multiplier * b;
        }
    }
    for (&pull, bound) in pull.iter().zip(fit.bound_g_mm()) {
        least -= bound * scalar::length(pull);
    }
    least
}

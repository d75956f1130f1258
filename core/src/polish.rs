//! The least absolute residual within the bounds, and the proof that it is the least.
//!
//! Without bounds the problem is a linear programme: a minimum lies where as many residuals vanish as there are unknowns,
//! and exchanging one vanishing residual for another leads there (`Tableau`; Barrodale and Roberts 1973). A disc is
//! brought in by its tangents: wherever the minimum leaves a disc, a tangent there cuts that place off (Kelley 1960), and
//! the exchange goes on from where it is. With two tangents of a disc in force, the next one touches it where their
//! multipliers' sum points: exactly right if nothing else changes.
//!
//! # Certificate
//! With any λ in −1..1 for each row, `|r| ≥ λ·r` gives for every u within the discs
//!
//! ```text
//! f(u) = Σ|h_i·u − t_i| ≥ λᵀ(H u − t) = (Hᵀλ)·u − λᵀt ≥ −λᵀt − Σ b_k ‖(Hᵀλ)_k‖ = g(λ),
//! ```
//!
//! since `a·u_k ≥ −b_k‖a‖` on a disc. So no u within the bounds is better than g(λ), wherever λ comes from, and
//! `f(u) − g(λ)` bounds what the u at hand leaves on the table. At the minimum there is a λ with f = g: signs for the rows
//! that do not vanish, the multipliers of the exchange for those that do.

mod certificate;
mod tableau;
#[cfg(test)]
mod tests;

use crate::fit::BoundedFit;
use crate::model::{MAX_PLANES, Pair};
use crate::scalar;
use tableau::Tableau;

/// Rounds of tangents, at most; three or four are usual where a bound is active.
const ROUNDS: usize = 16;
/// A disc left by less than this, relative, is not left.
const OUTSIDE: f32 = 2e-6;
/// A gap of this part of `Σ|target|` is small enough.
const CLOSE_ENOUGH: f32 = 2e-5;
/// A plane this near to its bound, relative, is on it.
const AT_BOUND: f32 = 1e-4;

/// The best place within the bounds so far.
struct Best<const PLANES: usize> {
    unbalance_g_mm: [Pair; PLANES],
    residual_um: f32,
}

impl<const PLANES: usize> Best<PLANES> {
    #[inline(never)] // once in flash
    fn consider<const PROBES: usize>(
        &mut self,
        fit: &BoundedFit<PROBES, PLANES>,
        unbalance_g_mm: [Pair; PLANES],
    ) {
        let unbalance_g_mm = fit.confine(unbalance_g_mm);
        let residual_um = fit.residual_um(&unbalance_g_mm);
        if residual_um < self.residual_um {
            *self = Self { unbalance_g_mm, residual_um };
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolishResult<const PLANES: usize> {
    /// The unbalance, g·mm, within the bounds.
    pub unbalance_g_mm: [Pair; PLANES],
    /// Its `Σ|H u − target|`, µm.
    pub residual_um: f32,
    /// The least `Σ|H u − target|` without bounds, µm, and the unbalance that has it, g·mm.
    pub free_residual_um: f32,
    pub free_g_mm: [Pair; PLANES],
    /// `residual_um` lies at most this far above the least within the bounds, µm, by the certificate.
    pub gap_um: f32,
    /// The plane's unbalance lies on its bound.
    pub at_bound: [bool; MAX_PLANES],
}

/// Descends from `start` to the least sum of absolute residuals within the bounds. [`PolishResult::gap_um`] says how far that
/// was reached: within 1e-5 of `Σ|target|` in every case tried (see the tests).
///
/// ```
/// use nalgebra::Complex;
/// use rotor_edge_core::fit::BoundedFit;
/// use rotor_edge_core::polish::polish;
/// // two probes, a quarter turn apart, that show a plane's unbalance of 3 g·mm at 0° as it is
/// let shown = [Complex::new(1.0, 0.0), Complex::new(0.0, -1.0)];
/// let fit = |bound| BoundedFit::<2, 1>::new(shown.iter().map(|&c| ([c], c * 3.0)), &[bound]);
/// let found = polish(&fit(10.0), [[0.0; 2]]);
/// assert!(found.residual_um < 1e-6 && (found.unbalance_g_mm[0][0] - 3.0).abs() < 1e-6);
/// // within 2 g·mm one of each probe's parts is left with 1 µm, and nothing can be better
/// let found = polish(&fit(2.0), [[0.0; 2]]);
/// assert!((found.residual_um - 2.0).abs() < 1e-5 && found.gap_um < 1e-5 && found.at_bound[0]);
/// ```
pub fn polish<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    start: [Pair; PLANES],
) -> PolishResult<PLANES> {
    let mut tableau = Tableau::empty();
    let vertex = descend(fit, &mut tableau, fit.confine(start), false);
    within_bounds(fit, &mut tableau, vertex, (fit.residual_um(&vertex), vertex))
}

/// As [`polish`], warm-started from the solution of a similar problem: where it lies on a bound, the descent begins
/// with the tangent there, and does not learn what is left without bounds. It stops where the certificate holds.
pub(crate) fn polish_warm<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    start: [Pair; PLANES],
) -> PolishResult<PLANES> {
    let mut tableau = Tableau::empty();
    let vertex = descend(fit, &mut tableau, fit.confine(start), true);
    within_bounds(fit, &mut tableau, vertex, (f32::NAN, [[f32::NAN; 2]; PLANES]))
}

/// The least `Σ|H u − target|` without bounds, µm, and the unbalance that has it, g·mm.
pub(crate) fn polish_free<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    start: [Pair; PLANES],
) -> (f32, [Pair; PLANES]) {
    let vertex = descend(fit, &mut Tableau::empty(), start, false);
    (fit.residual_um(&vertex), vertex)
}

/// Fills a tableau and descends in it to a vertex, g·mm; with tangents where the start lies on a bound, if it is warm.
#[inline(never)]
fn descend<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    tableau: &mut Tableau<PLANES>,
    start: [Pair; PLANES],
    is_warm: bool,
) -> [Pair; PLANES] {
    tableau.fill(fit, start);
    if is_warm {
        tableau.cut(-AT_BOUND);
    }
    tableau.descend();
    tableau.unbalance_g_mm(fit)
}

#[inline(never)]
fn within_bounds<const PROBES: usize, const PLANES: usize>(
    fit: &BoundedFit<PROBES, PLANES>,
    tableau: &mut Tableau<PLANES>,
    mut vertex: [Pair; PLANES],
    (free_residual_um, free_g_mm): (f32, [Pair; PLANES]),
) -> PolishResult<PLANES> {
    let mut best = Best { unbalance_g_mm: [[0.0; 2]; PLANES], residual_um: f32::INFINITY };
    let mut least_um = 0.0_f32;
    let enough = CLOSE_ENOUGH * fit.target_um().iter().fold(0.0, |sum, target| sum + target.abs());
    for _ in 0..=ROUNDS {
        best.consider(fit, vertex);
        if tableau.has_tangents() {
            best.consider(fit, tableau.pulled_g_mm(vertex));
        }
        least_um = scalar::greater(least_um, certificate::least_um(fit, &mut tableau.multipliers(fit)));
        if best.residual_um - least_um <= enough || !tableau.cut(OUTSIDE) {
            break;
        }
        tableau.descend();
        vertex = tableau.unbalance_g_mm(fit);
    }
    let Best { unbalance_g_mm, residual_um } = best;
    let mut at_bound = [false; MAX_PLANES];
    for ((at_bound, [x, y]), bound) in at_bound.iter_mut().zip(&unbalance_g_mm).zip(fit.bound_g_mm()) {
        let inner = bound * (1.0 - AT_BOUND);
        *at_bound = x * x + y * y >= inner * inner;
    }
    let gap_um = residual_um - least_um;
    PolishResult {
        unbalance_g_mm,
        residual_um,
        free_residual_um,
        free_g_mm,
        // Rounding may leave the bound above what it bounds; not a number proves nothing.
        gap_um: if gap_um.is_nan() { f32::INFINITY } else { scalar::greater(0.0, gap_um) },
        at_bound,
    }
}

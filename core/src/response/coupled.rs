//! Forward and backward whirl brought together at supports that are not alike in all directions.

use core::array;
use core::mem;

use super::C;
use super::equations::{Coupling, Equations};
use super::motion::{Motion, Whirl};
use crate::linear::{self, Equation};
use crate::scalar;

/// Strength of a coupling (of the solution `SᵀP·pm` for one support) beyond which the correction is not trusted: near a
/// speed at which forward whirl alone would resonate, large numbers cancel, and as many digits are lost.
const STRONGEST: f32 = 16.0;
/// A pivot of the small system below this is a digit and a half lost.
const SMALLEST_PIVOT: f32 = 1.0 / 32.0;
/// Supports that are corrected for, at most; a model with more is eliminated as a whole.
const MAX_COUPLED: usize = 3;

/// φ·x.
#[inline]
pub(super) fn at<const N: usize>(shape: &[f32; N], x: &[C; N]) -> C {
    let mut sum = C::default();
    for (&here, value) in shape.iter().zip(x) {
        sum += value * here;
    }
    sum
}

/// As many rows and columns count as there are couplings.
type Square = [[C; MAX_COUPLED]; MAX_COUPLED];

/// What brings the two kinds of whirl together.
pub(super) struct Correction<'e, const N: usize> {
    equations: &'e Equations<N>,
    /// How the two matrices' solutions answer to the shape of each coupling: P and Q by columns.
    plus: [[C; N]; MAX_COUPLED],
    minus: [[C; N]; MAX_COUPLED],
    /// `(I − SᵀP·pm·SᵀQ·mp)⁻¹`
    inverse: Square,
    /// `SᵀQ·mp`
    back: Square,
}

impl<'e, const N: usize> Correction<'e, N> {
    /// Of the couplings that there are.
    // Made where it stays: moved once, it would cost as much as a right-hand side.
    #[inline(always)]
    pub fn new(equations: &'e Equations<N>) -> Self {
        let side = |place| {
            let coupling: Option<&Coupling<N>> = equations.couplings.get(place);
            coupling.map_or([C::default(); N], |coupling| coupling.shape.map(|x| C::new(x, 0.0)))
        };
        let (plus, minus) = (array::from_fn(side), array::from_fn(side));
        Self { equations, plus, minus, inverse: Square::default(), back: Square::default() }
    }

    /// From factored matrices; `None` where rounding would be amplified, or for more than [`MAX_COUPLED`] couplings.
    #[inline]
    pub fn couple(&mut self) -> Option<()> {
        let Self { equations: Equations { forward, backward, couplings }, plus, minus, inverse, back } = self;
        let count = couplings.len();
        if count > MAX_COUPLED {
            return None;
        }
        for (plus, minus) in plus.iter_mut().zip(minus.iter_mut()).take(count) {
            forward.solve(plus);
            backward.solve(minus);
        }
        let mut is_weak = true;
        for (back, row) in back.iter_mut().zip(couplings) {
            for ((back, minus), column) in back.iter_mut().zip(&*minus).zip(couplings) {
                *back = at(&row.shape, minus) * column.mp;
                is_weak &= scalar::size(*back) <= STRONGEST;
            }
        }
        for (i, (cells, row)) in inverse.iter_mut().zip(couplings).enumerate() {
            let mut forth = [C::default(); MAX_COUPLED];
            for ((forth, plus), column) in forth.iter_mut().zip(&*plus).zip(couplings) {
                *forth = at(&row.shape, plus) * column.pm;
                is_weak &= scalar::size(*forth) <= STRONGEST;
            }
            let forth = forth.get(..count)?;
            for (j, cell) in cells.iter_mut().enumerate().take(count) {
                *cell = C::new(if i == j { 1.0 } else { 0.0 }, 0.0);
                for (forth, back) in forth.iter().zip(&*back) {
                    *cell = scalar::subtract_product(*cell, *forth, back[j]);
                }
            }
        }
        if !is_weak {
            return None;
        }
        invert(inverse, count)
    }

    /// Turns a forward force, `plus`, into the whirl of both kinds.
    #[inline(never)]
    pub fn solve(&self, whirl: &mut Whirl<N>) {
        let Equations { forward, couplings, .. } = self.equations;
        let count = couplings.len();
        forward.solve(&mut whirl.plus);
        let mut free = [C::default(); MAX_COUPLED];
        for (value, coupling) in free.iter_mut().zip(couplings) {
            *value = at(&coupling.shape, &whirl.plus);
        }
        let free = free.get(..count).unwrap_or(&free);
        let mut coupled = [C::default(); MAX_COUPLED];
        for (value, row) in coupled.iter_mut().zip(&self.inverse).take(count) {
            for (cell, free) in row.iter().zip(free) {
                *value = scalar::add_product(*value, *cell, *free);
            }
        }
        let coupled = coupled.get(..count).unwrap_or(&coupled);
        let answers = self.plus.iter().zip(&self.minus);
        for (((coupling, (plus, minus)), row), here) in
            couplings.iter().zip(answers).zip(&self.back).zip(coupled)
        {
            let mut backward = C::default();
            for (cell, coupled) in row.iter().zip(coupled) {
                backward = scalar::add_product(backward, *cell, *coupled);
            }
            // Sᵀm = −SᵀQ·mp·Sᵀp, so that the force −pm·Sᵀm is positive here.
            let (forth, back) = (coupling.pm * backward, coupling.mp * here);
            for (x, answer) in whirl.plus.iter_mut().zip(plus) {
                *x = scalar::add_product(*x, *answer, forth);
            }
            for (x, answer) in whirl.minus.iter_mut().zip(minus) {
                *x = scalar::subtract_product(*x, *answer, back);
            }
        }
    }
}

/// Inverse of the first rows and columns in place (Gauss and Jordan); `None` for a pivot that is small against one.
#[inline]
fn invert(matrix: &mut Square, size: usize) -> Option<()> {
    for place in 0..size.min(MAX_COUPLED) {
        let mut pivot_row = matrix[place];
        let pivot = pivot_row[place];
        let strength = scalar::size(pivot);
        if strength.is_nan() || strength <= SMALLEST_PIVOT {
            return None;
        }
        let reciprocal = scalar::reciprocal(pivot);
        pivot_row[place] = C::new(1.0, 0.0);
        for cell in pivot_row.iter_mut().take(size) {
            *cell *= reciprocal;
        }
        for (i, row) in matrix.iter_mut().enumerate().take(size) {
            if i == place {
                *row = pivot_row;
                continue;
            }
            let factor = mem::take(&mut row[place]);
            for (cell, above) in row.iter_mut().zip(&pivot_row).take(size) {
                *cell = scalar::subtract_product(*cell, factor, *above);
            }
        }
    }
    Some(())
}

/// Turns forces into motion by elimination with pivoting of all 2N equations: whatever the model, at more than twice the
/// cost.
#[inline(never)]
pub(super) fn eliminate<const N: usize, const PLANES: usize>(
    equations: &Equations<N>,
    motion: &mut Motion<N, PLANES>,
) -> Option<()> {
    let mut system = [[Equation::<N, PLANES>::zero(); N]; 2];
    for i in 0..N {
        for j in 0..N {
            // Only the lower triangles are filled.
            let (row, column) = if i > j { (i, j) } else { (j, i) };
            system[0][i].cells[0][j] = equations.forward.rows[row][column];
            system[1][i].cells[1][j] = equations.backward.rows[row][column];
        }
    }
    let [forward, backward] = &mut system;
    for Coupling { shape, pm, mp } in &equations.couplings {
        for ((forward, backward), &here) in forward.iter_mut().zip(backward.iter_mut()).zip(shape) {
            let ([_, minus], [plus, _]) = (&mut forward.cells, &mut backward.cells);
            for ((minus, plus), &there) in minus.iter_mut().zip(plus).zip(shape) {
                *minus += pm * (here * there);
                *plus += mp * (here * there);
            }
        }
    }
    for (i, row) in forward.iter_mut().enumerate() {
        for (side, force) in row.planes.iter_mut().zip(&motion.planes) {
            *side = force.plus[i];
        }
        row.known = motion.forced.map_or(C::default(), |forced| forced.plus[i]);
    }
    linear::solve(&mut system)?;
    let [forward, backward] = &system;
    for i in 0..N {
        for (plane, whirl) in motion.planes.iter_mut().enumerate() {
            (whirl.plus[i], whirl.minus[i]) = (forward[i].planes[plane], backward[i].planes[plane]);
        }
        if let Some(forced) = &mut motion.forced {
            (forced.plus[i], forced.minus[i]) = (forward[i].known, backward[i].known);
        }
    }
    Some(())
}

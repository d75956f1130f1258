//! Forward and backward whirl brought together at supports that are not alike in all directions.

use core::array;
use core::mem;

use super::C;
use super::motion::{Equations, Motion, Whirl};
use crate::linear::{self, Row};
use crate::scalar;

/// Strength of a coupling (of the solution `SᵀP·pm` for one support) beyond which the correction is not trusted: near a
/// speed at which forward whirl alone would resonate, large numbers cancel, and as many digits are lost.
const STRONGEST: f32 = 16.0;
/// A pivot of the small system below this is a digit and a half lost.
const SMALLEST_PIVOT: f32 = 1.0 / 32.0;
/// Supports that are corrected for, at most; a model with more is eliminated as a whole.
const MAX_COUPLED: usize = 3;

/// What ties forward to backward whirl at a support: `Fp += φφᵀ·pm·m`, `Fm += φφᵀ·mp·p`.
#[derive(Clone, Copy)]
pub(super) struct Coupling<const N: usize> {
    pub shape: [f32; N],
    pub pm: C,
    pub mp: C,
}

impl<const N: usize> Coupling<N> {
    fn none() -> Self {
        Self { shape: [0.0; N], pm: C::default(), mp: C::default() }
    }
}

/// φ·x.
#[inline]
pub(super) fn at<const N: usize>(shape: &[f32; N], x: &[C; N]) -> C {
    let mut sum = C::default();
    for (&here, value) in shape.iter().zip(x) {
        sum += value * here;
    }
    sum
}

/// A coupling, and how the two matrices' solutions answer to its shape: columns of P and Q.
struct Tie<const N: usize> {
    coupling: Coupling<N>,
    plus: [C; N],
    minus: [C; N],
}

/// As many rows and columns count as there are ties.
type Square = [[C; MAX_COUPLED]; MAX_COUPLED];

/// What brings the two kinds of whirl together.
pub(super) struct Correction<const N: usize> {
    ties: [Tie<N>; MAX_COUPLED],
    count: usize,
    /// `(I − SᵀP·pm·SᵀQ·mp)⁻¹`
    inverse: Square,
    /// `SᵀQ·mp`
    back: Square,
}

impl<const N: usize> Correction<N> {
    /// Of the couplings that there are.
    #[inline(always)]
    pub fn new(equations: &Equations<N>) -> Self {
        Self {
            ties: array::from_fn(|place| match equations.couplings.get(place) {
                Some(&coupling) => {
                    let side = coupling.shape.map(|x| C::new(x, 0.0));
                    Tie { coupling, plus: side, minus: side }
                }
                None => Tie { coupling: Coupling::none(), plus: [C::default(); N], minus: [C::default(); N] },
            }),
            count: equations.couplings.len(),
            inverse: Square::default(),
            back: Square::default(),
        }
    }

    fn ties(&self) -> impl Iterator<Item = &Tie<N>> {
        self.ties.iter().take(self.count)
    }

    /// From factored matrices; `None` where rounding would be amplified, or for more than [`MAX_COUPLED`] couplings.
    #[inline]
    pub fn couple(&mut self, equations: &Equations<N>) -> Option<()> {
        if self.count > MAX_COUPLED {
            return None;
        }
        for tie in self.ties.iter_mut().take(self.count) {
            equations.forward.solve(&mut tie.plus);
            equations.backward.solve(&mut tie.minus);
        }
        let Self { ties, count, inverse, back } = self;
        let ties = ties.get(..*count)?;
        let mut forth = Square::default();
        let mut strongest = 0.0_f32;
        for ((forth, back), row) in forth.iter_mut().zip(back.iter_mut()).zip(ties) {
            for ((forth, back), column) in forth.iter_mut().zip(back).zip(ties) {
                *forth = at(&row.coupling.shape, &column.plus) * column.coupling.pm;
                *back = at(&row.coupling.shape, &column.minus) * column.coupling.mp;
                strongest = strongest.max(scalar::size(*forth)).max(scalar::size(*back));
            }
        }
        if strongest.is_nan() || strongest > STRONGEST {
            return None;
        }
        for (i, (cells, forth)) in inverse.iter_mut().zip(&forth).enumerate().take(ties.len()) {
            for (j, cell) in cells.iter_mut().enumerate().take(ties.len()) {
                *cell = C::new(if i == j { 1.0 } else { 0.0 }, 0.0);
                for (forth, back) in forth.iter().zip(back.iter()).take(ties.len()) {
                    *cell -= forth * back[j];
                }
            }
        }
        invert(inverse, ties.len())
    }

    /// Turns a forward force, `plus`, into the whirl of both kinds.
    #[inline(never)]
    pub fn solve(&self, equations: &Equations<N>, whirl: &mut Whirl<N>) {
        equations.forward.solve(&mut whirl.plus);
        let mut forward = [C::default(); MAX_COUPLED];
        for (value, tie) in forward.iter_mut().zip(self.ties()) {
            *value = at(&tie.coupling.shape, &whirl.plus);
        }
        let mut coupled = [C::default(); MAX_COUPLED];
        for (value, row) in coupled.iter_mut().zip(&self.inverse).take(self.count) {
            for (cell, forward) in row.iter().zip(&forward).take(self.count) {
                *value += cell * forward;
            }
        }
        for ((tie, row), here) in self.ties().zip(&self.back).zip(&coupled) {
            let mut backward = C::default();
            for (cell, coupled) in row.iter().zip(&coupled).take(self.count) {
                backward += cell * coupled;
            }
            // Sᵀm = −SᵀQ·mp·Sᵀp, so that the force −pm·Sᵀm is positive here.
            let (forth, back) = (tie.coupling.pm * backward, tie.coupling.mp * here);
            for (x, answer) in whirl.plus.iter_mut().zip(&tie.plus) {
                *x += answer * forth;
            }
            for (x, answer) in whirl.minus.iter_mut().zip(&tie.minus) {
                *x -= answer * back;
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
                *cell -= factor * above;
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
    let mut system = [[Row::<N, PLANES>::zero(); N]; 2];
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

//! Forward and backward whirl brought together at supports that are not alike in all directions.

use core::array;
use core::mem;

use heapless::Vec;

use super::C;
use super::motion::{Equations, Motion, Whirl};
use crate::linear::{self, Row, Symmetric};
use crate::scalar;

/// Strength of a coupling (of the solution `SᵀP·pm` for one support) beyond which the correction is not trusted: near a
/// speed at which forward whirl alone would resonate, large numbers cancel, and as many digits are lost.
const STRONGEST: f32 = 16.0;
/// A pivot of the small system below this is a digit and a half lost.
const SMALLEST_PIVOT: f32 = 1.0 / 32.0;
/// Supports that are corrected for, at most; a model with more is eliminated as a whole.
const MAX_COUPLED: usize = 4;

/// What ties forward to backward whirl at a support: `Fp += φφᵀ·pm·m`, `Fm += φφᵀ·mp·p`.
#[derive(Clone, Copy)]
pub(super) struct Coupling<const N: usize> {
    pub shape: [f32; N],
    pub pm: C,
    pub mp: C,
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

/// From the factors of the two matrices; `None` where rounding would be amplified, or for more than
/// [`MAX_COUPLED`] supports.
#[inline]
pub(super) fn solve<const N: usize, const PLANES: usize>(
    equations: &Equations<N, PLANES>,
    forward: &Symmetric<N>,
    backward: &Symmetric<N>,
) -> Option<Motion<N, PLANES>> {
    let mut ties = Vec::<Tie<N>, MAX_COUPLED>::new();
    for &coupling in &equations.couplings {
        let side = coupling.shape.map(|x| C::new(x, 0.0));
        ties.push(Tie { coupling, plus: forward.solve(side), minus: backward.solve(side) }).ok()?;
    }
    let small = Small::new(&ties)?;
    let whirl = |side: &[C; N]| small.couple(&ties, forward.solve(*side));
    Some(Motion {
        planes: array::from_fn(|plane| equations.planes.get(plane).map_or(Whirl::zero(), whirl)),
        forced: equations.forced.as_ref().map_or(Whirl::zero(), whirl),
    })
}

/// A coupling, and how the two matrices' solutions answer to its shape: columns of P and Q.
struct Tie<const N: usize> {
    coupling: Coupling<N>,
    plus: [C; N],
    minus: [C; N],
}

type Square = [[C; MAX_COUPLED]; MAX_COUPLED];

/// `(I − SᵀP·pm·SᵀQ·mp)⁻¹` and `SᵀQ·mp`.
struct Small {
    inverse: Square,
    back: Square,
}

impl Small {
    #[inline]
    fn new<const N: usize>(ties: &[Tie<N>]) -> Option<Self> {
        let (mut forth, mut back) = (Square::default(), Square::default());
        let mut strongest = 0.0_f32;
        for ((forth, back), row) in forth.iter_mut().zip(&mut back).zip(ties) {
            for ((forth, back), column) in forth.iter_mut().zip(back).zip(ties) {
                *forth = at(&row.coupling.shape, &column.plus) * column.coupling.pm;
                *back = at(&row.coupling.shape, &column.minus) * column.coupling.mp;
                strongest = strongest.max(scalar::size(*forth)).max(scalar::size(*back));
            }
        }
        if strongest.is_nan() || strongest > STRONGEST {
            return None;
        }
        let mut inverse = Square::default();
        for (i, (cells, forth)) in inverse.iter_mut().zip(&forth).enumerate().take(ties.len()) {
            for (j, cell) in cells.iter_mut().enumerate().take(ties.len()) {
                *cell = C::new(if i == j { 1.0 } else { 0.0 }, 0.0);
                for (forth, back) in forth.iter().zip(&back).take(ties.len()) {
                    *cell -= forth * back[j];
                }
            }
        }
        invert(&mut inverse, ties.len())?;
        Some(Self { inverse, back })
    }

    /// The whirl of both kinds, from the forward whirl without coupling.
    #[inline]
    fn couple<const N: usize>(&self, ties: &[Tie<N>], alone: [C; N]) -> Whirl<N> {
        let mut whirl = Whirl { plus: alone, minus: [C::default(); N] };
        let mut forward = [C::default(); MAX_COUPLED];
        for (value, tie) in forward.iter_mut().zip(ties) {
            *value = at(&tie.coupling.shape, &alone);
        }
        let mut coupled = [C::default(); MAX_COUPLED];
        for (value, row) in coupled.iter_mut().zip(&self.inverse).take(ties.len()) {
            for (cell, forward) in row.iter().zip(&forward).take(ties.len()) {
                *value += cell * forward;
            }
        }
        for ((tie, row), here) in ties.iter().zip(&self.back).zip(&coupled) {
            let mut backward = C::default();
            for (cell, coupled) in row.iter().zip(&coupled).take(ties.len()) {
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
        whirl
    }
}

/// Inverse of the first rows and columns in place (Gauss and Jordan); `None` for a pivot that is small against one.
#[inline]
fn invert(matrix: &mut Square, size: usize) -> Option<()> {
    for place in 0..size.min(MAX_COUPLED) {
        let mut pivot_row = matrix[place];
        let pivot = pivot_row[place];
        if !(scalar::size(pivot) > SMALLEST_PIVOT) {
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

/// By elimination with pivoting of all 2N equations: whatever the model, at more than twice the cost.
#[inline(never)]
pub(super) fn eliminate<const N: usize, const PLANES: usize>(
    equations: &Equations<N, PLANES>,
) -> Option<Motion<N, PLANES>> {
    let mut system = [[Row::<N, PLANES>::zero(); N]; 2];
    for i in 0..N {
        for j in 0..N {
            // Only the lower triangles are filled.
            let (row, column) = if i > j { (i, j) } else { (j, i) };
            system[0][i].cells[0][j] = equations.forward[row][column];
            system[1][i].cells[1][j] = equations.backward[row][column];
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
    for (place, row) in forward.iter_mut().enumerate() {
        for (side, plane) in row.planes.iter_mut().zip(&equations.planes) {
            *side = plane.get(place).copied().unwrap_or_default();
        }
        row.known = equations.forced.and_then(|forced| forced.get(place).copied()).unwrap_or_default();
    }
    linear::solve(&mut system)?;
    Some(Motion {
        planes: array::from_fn(|plane| {
            solution(&system, |row| row.planes.get(plane).copied().unwrap_or_default())
        }),
        forced: solution(&system, |row| row.known),
    })
}

#[inline]
fn solution<const N: usize, const PLANES: usize>(
    [forward, backward]: &[[Row<N, PLANES>; N]; 2],
    side: impl Fn(&Row<N, PLANES>) -> C,
) -> Whirl<N> {
    Whirl { plus: array::from_fn(|i| side(&forward[i])), minus: array::from_fn(|i| side(&backward[i])) }
}

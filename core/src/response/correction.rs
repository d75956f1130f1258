//! The supports as a correction of the modes: as many equations as the supports have forces.

use super::C;
use super::equations::Equations;
use super::motion::{Motion, Whirl};
use crate::linear::{self, Equation};
use crate::model::{Model, Support};
use crate::scalar;

/// Growth of numbers beyond which the correction is not trusted: the result's error is this many times that of rounding the
/// model.
const LARGEST_GROWTH: f32 = 16.0;
/// Supports that are corrected for, at most; a model with more is eliminated as a whole.
const MOST_SUPPORTS: usize = 4;

type Row<const PLANES: usize> = Equation<MOST_SUPPORTS, PLANES>;

/// A support's shape in each mode times the mode's gain: how the modes answer to a unit of force there.
#[derive(Clone, Copy)]
struct Answer<const N: usize> {
    forward: [f32; N],
    backward: [C; N],
}

/// Turns forces into motion; `None` where rounding would be amplified, the motion being left as it was, and for more
/// supports than [`MOST_SUPPORTS`].
///
/// With A the flexibility of the modes from support to support, the forces r of the supports beyond their nominal springs
/// solve `(I + ΔZ·A)·r = −ΔZ·q`, q being the motion there without them. An entry of A is wrong by a step of f32 of
/// `Σ|φ·gain·φ|`, no more than the largest such sum of a support with itself; what that does to r is the same as an error of
/// ΔZ that is this sum times |ΔZ| as large. Near the pole of a mode it grows without limit, and r cancels against the force.
#[inline(never)]
pub(super) fn correct<const N: usize, const PROBES: usize, const PLANES: usize>(
    equations: &Equations<N>,
    model: &Model<N, PROBES, PLANES>,
    motion: &mut Motion<N, PLANES>,
) -> Option<()> {
    let Equations { forward, backward, supports: stiffness } = equations;
    let (forward_gains, backward_gains) = (forward.map(|x| 1.0 / x), backward.map(scalar::reciprocal));
    let mut answers = [Answer { forward: [0.0; N], backward: [C::default(); N] }; MOST_SUPPORTS];
    let mut rows = [[Row::<PLANES>::zero(); MOST_SUPPORTS]; 2];
    let count = model.supports.len();
    let rows = rows.as_flattened_mut().get_mut(..2 * count)?;
    for (s, (support, stiffness)) in model.supports.iter().zip(stiffness).enumerate() {
        let (below, rest) = answers.split_at_mut_checked(s)?;
        let answer = rest.first_mut()?;
        *answer = Answer::new(support, &forward_gains, &backward_gains);
        let largest = stiffness.as_flattened().iter().fold(0.0_f32, |size, &z| size.max(scalar::size(z)));
        let growth = largest * answer.largest_flexibility(support);
        if growth.is_nan() || growth > LARGEST_GROWTH {
            return None;
        }
        for (t, other) in below.iter().chain([&*answer]).enumerate() {
            let flexibility = other.flexibility(support);
            couple(rows, s, t, stiffness, flexibility);
            if t < s {
                couple(rows, t, s, equations.supports.get(t)?, flexibility);
            }
        }
        let (plus, minus) = rows.get_mut(2 * s..)?.split_first_mut()?;
        let minus = minus.first_mut()?;
        let [[pp, _], [mp, _]] = stiffness;
        let free = |whirl: &Whirl<N>| -at(&answer.forward, &whirl.plus);
        for (whirl, (plus, minus)) in
            motion.planes.iter().zip(plus.planes.iter_mut().zip(&mut minus.planes)).take(model.planes.len())
        {
            let free = free(whirl);
            (*plus, *minus) = (pp * free, mp * free);
        }
        if let Some(whirl) = &motion.forced {
            let free = free(whirl);
            (plus.known, minus.known) = (pp * free, mp * free);
        }
    }
    linear::solve(rows)?;
    for (plane, whirl) in motion.planes.iter_mut().enumerate().take(model.planes.len()) {
        let force = |row: &Row<PLANES>| row.planes.get(plane).copied().unwrap_or_default();
        move_by(whirl, &forward_gains, &answers, rows, force);
    }
    if let Some(whirl) = &mut motion.forced {
        move_by(whirl, &forward_gains, &answers, rows, |row| row.known);
    }
    Some(())
}

impl<const N: usize> Answer<N> {
    #[inline(always)]
    fn new(support: &Support<N>, forward_gains: &[f32; N], backward_gains: &[C; N]) -> Self {
        let ([forward], [backward]) = (&support.shape.forward.data.0, &support.shape.backward.data.0);
        Self {
            forward: core::array::from_fn(|j| forward[j] * forward_gains[j]),
            backward: core::array::from_fn(|j| backward_gains[j] * backward[j]),
        }
    }

    /// At a support, for a unit of force at this one, of forward and of backward whirl.
    #[inline(always)]
    fn flexibility(&self, support: &Support<N>) -> (f32, C) {
        let ([forward], [backward]) = (&support.shape.forward.data.0, &support.shape.backward.data.0);
        let mut sum = 0.0;
        for (here, answer) in forward.iter().zip(&self.forward) {
            sum += here * answer;
        }
        (sum, at(backward, &self.backward))
    }

    /// The same at its own support with nothing cancelled, of whichever whirl is more flexible.
    #[inline(always)]
    fn largest_flexibility(&self, support: &Support<N>) -> f32 {
        let ([forward], [backward]) = (&support.shape.forward.data.0, &support.shape.backward.data.0);
        let (mut plus, mut minus) = (0.0, 0.0);
        for (here, answer) in forward.iter().zip(&self.forward) {
            plus += (here * answer).abs();
        }
        for (here, answer) in backward.iter().zip(&self.backward) {
            minus += here.abs() * scalar::size(*answer);
        }
        // A sum that is not a number stays one.
        if plus > minus { plus } else { minus + 0.0 * plus }
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

/// Writes the cells of `I + ΔZ·A` in the rows of one support and the columns of another.
#[inline(always)]
fn couple<const PLANES: usize>(
    rows: &mut [Row<PLANES>],
    row: usize,
    column: usize,
    stiffness: &[[C; 2]; 2],
    (plus, minus): (f32, C),
) {
    let one = C::new(if row == column { 1.0 } else { 0.0 }, 0.0);
    let [[pp, pm], [mp, mm]] = stiffness;
    let cells = [[one + pp * plus, pm * minus], [mp * plus, one + mm * minus]];
    for (row, cells) in rows.iter_mut().skip(2 * row).zip(cells) {
        for (cell, value) in row.cells.as_flattened_mut().iter_mut().skip(2 * column).zip(cells) {
            *cell = value;
        }
    }
}

/// Turns a forward force, `plus`, into the whirl of both kinds, with the forces of the supports.
#[inline(never)]
fn move_by<const N: usize, const PLANES: usize>(
    whirl: &mut Whirl<N>,
    forward_gains: &[f32; N],
    answers: &[Answer<N>; MOST_SUPPORTS],
    rows: &[Row<PLANES>],
    force: impl Fn(&Row<PLANES>) -> C,
) {
    for (x, gain) in whirl.plus.iter_mut().zip(forward_gains) {
        *x *= *gain;
    }
    let (pairs, _) = rows.as_chunks::<2>();
    for ([plus, minus], answer) in pairs.iter().zip(answers) {
        let (plus, minus) = (force(plus), force(minus));
        for (x, answer) in whirl.plus.iter_mut().zip(&answer.forward) {
            *x += plus * *answer;
        }
        for (x, answer) in whirl.minus.iter_mut().zip(&answer.backward) {
            *x = scalar::add_product(*x, *answer, minus);
        }
    }
}

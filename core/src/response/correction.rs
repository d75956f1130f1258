//! The supports as a correction of the modes: as many equations as the supports have forces.

use core::array;

use heapless::Vec;

use super::C;
use super::equations::Equations;
use super::motion::Motion;
use crate::linear::Blocks;
use crate::model::{Model, Support};
use crate::scalar;

/// Growth of numbers beyond which the correction is not trusted: the result's error is this many times that of rounding the
/// model.
const LARGEST_GROWTH: f32 = 16.0;
/// Supports that are corrected for, at most; a model with more is eliminated as a whole.
const MOST_SUPPORTS: usize = 4;

/// A support's shape in each mode times the mode's gain: how the modes answer to a unit of force there.
struct Answer<const SHAPES: usize> {
    forward: [f32; SHAPES],
    backward: [C; SHAPES],
}

/// Turns forces into motion; `None` where rounding would be amplified, the motion being left as it was, and for more
/// supports than [`MOST_SUPPORTS`].
///
/// With A the flexibility of the modes from support to support, the forces r of the supports beyond their nominal springs
/// solve `(I + ΔZ·A)·r = −ΔZ·q`, q being the motion there without them. An entry of A is wrong by a step of f32 of
/// `Σ|φ·gain·φ|`, no more than the largest such sum of a support with itself; what that does to r is the same as an error of
/// ΔZ that is this sum times |ΔZ| as large. Near the pole of a mode it grows without limit, and r cancels against the force.
#[inline(never)]
pub(super) fn correct<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    equations: &Equations<SHAPES>,
    model: &Model<SHAPES, PROBES, PLANES>,
    motion: &mut Motion<SHAPES, PLANES>,
) -> Option<()> {
    let forward_gains = equations.forward.map(|x| 1.0 / x);
    let backward_gains = equations.backward.map(scalar::reciprocal);
    let mut answers: Vec<Answer<SHAPES>, MOST_SUPPORTS> = Vec::new();
    // Of each support with those before it and with itself, one after another.
    let mut flexibilities: Vec<(f32, C), { MOST_SUPPORTS * (MOST_SUPPORTS + 1) / 2 }> = Vec::new();
    for (support, stiffness) in model.supports.iter().zip(&equations.supports) {
        answers.push(Answer::new(support, &forward_gains, &backward_gains)).ok()?;
        let answer = answers.last()?;
        let largest = scalar::largest_size(stiffness.as_flattened());
        let growth = largest * answer.largest_flexibility(support);
        if growth.is_nan() || growth > LARGEST_GROWTH {
            return None;
        }
        for answer in &answers {
            flexibilities.push(answer.flexibility(support)).ok()?;
        }
    }
    let mut system: Blocks<MOST_SUPPORTS> = Blocks::new();
    for (s, [[pp, pm], [mp, mm]]) in equations.supports.iter().enumerate() {
        system.begin_row()?;
        for t in 0..answers.len() {
            let (later, earlier) = if s > t { (s, t) } else { (t, s) };
            let &(plus, minus) = flexibilities.get(later * (later + 1) / 2 + earlier)?;
            let one = C::new(if s == t { 1.0 } else { 0.0 }, 0.0);
            system.push([[one + pp * plus, pm * minus], [mp * plus, one + mm * minus]])?;
        }
    }
    system.factor(LARGEST_GROWTH)?;
    for whirl in motion.planes.iter_mut().take(model.planes.len()).chain(&mut motion.forced) {
        let mut forces: Vec<[C; 2], MOST_SUPPORTS> = Vec::new();
        for (answer, [[pp, _], [mp, _]]) in answers.iter().zip(&equations.supports) {
            let free = -at(&answer.forward, &whirl.plus);
            forces.push([pp * free, mp * free]).ok()?;
        }
        system.solve(&mut forces);
        for (x, gain) in whirl.plus.iter_mut().zip(&forward_gains) {
            *x *= *gain;
        }
        for ([plus, minus], answer) in forces.iter().zip(&answers) {
            for (x, answer) in whirl.plus.iter_mut().zip(&answer.forward) {
                *x += plus * *answer;
            }
            for (x, answer) in whirl.minus.iter_mut().zip(&answer.backward) {
                *x = scalar::add_product(*x, *answer, *minus);
            }
        }
    }
    Some(())
}

impl<const SHAPES: usize> Answer<SHAPES> {
    #[inline(always)]
    fn new(support: &Support<SHAPES>, forward_gains: &[f32; SHAPES], backward_gains: &[C; SHAPES]) -> Self {
        let ([forward], [backward]) = (&support.shape.forward.data.0, &support.shape.backward.data.0);
        Self {
            forward: array::from_fn(|j| forward[j] * forward_gains[j]),
            backward: array::from_fn(|j| backward_gains[j] * backward[j]),
        }
    }

    /// At a support, for a unit of force at this one, of forward and of backward whirl.
    #[inline]
    fn flexibility(&self, support: &Support<SHAPES>) -> (f32, C) {
        let ([forward], [backward]) = (&support.shape.forward.data.0, &support.shape.backward.data.0);
        let mut sum = 0.0;
        for (here, answer) in forward.iter().zip(&self.forward) {
            sum += here * answer;
        }
        (sum, at(backward, &self.backward))
    }

    /// The same at its own support with nothing cancelled, of whichever whirl is more flexible.
    #[inline(always)]
    fn largest_flexibility(&self, support: &Support<SHAPES>) -> f32 {
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
pub(super) fn at<const SHAPES: usize>(shape: &[f32; SHAPES], x: &[C; SHAPES]) -> C {
    let mut sum = C::default();
    for (&here, value) in shape.iter().zip(x) {
        sum += value * here;
    }
    sum
}

//! The finish after the swarm: reweighted least squares with one multiplier per active bound, then a descent from vertex to vertex.
//!
//! `|r|` is rounded off to `√(r² + ε²)` with an ε that shrinks. Each round minimises a parabola within the discs, a small
//! trust-region problem; finally the optimum's zero residuals are solved for and exchanged. Plain reweighting (weights 1/|r|)
//! was tried first: it stalls where a residual is small that ought not to be, about 1 % of f above the minimum at worst.

mod quadratic;
#[cfg(test)]
mod tests;
mod vertex;

use crate::fit::Fit;
use crate::model::{MAX_PLANES, Pair};
use crate::reading::FEATURES;
use crate::scalar;
use quadratic::Quadratic;

/// Rounds, at most; ten to twelve are usual.
const ROUNDS: usize = 40;
/// Rounds without gain at the last ε after which the rest is rounding.
const STALLED: usize = 3;
/// ε at the first round and what it falls to, relative to the mean |target|.
const EPSILON_FIRST: f32 = 0.1;
const EPSILON_LAST: f32 = 3e-5;
/// How fast ε falls: when the slopes could move all the way to those foreseen (the present ε is solved), and otherwise.
const SHRINK_SOLVED: f32 = 0.3;
const SHRINK_OTHERWISE: f32 = 0.8;
const SOLVED: f32 = 0.9;

/// Unknowns in the scaled problem: x and y of plane 1, x and y of plane 2.
const UNKNOWNS: usize = 2 * MAX_PLANES;
type Vector = [f32; UNKNOWNS];

/// What the polish found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polished {
    /// The unbalance, g·mm, within the bounds.
    pub unbalance_g_mm: [Pair; MAX_PLANES],
    /// Its `Σ|H u − target|`, µm.
    pub residual_um: f32,
    /// The plane's unbalance lies on its bound.
    pub at_bound: [bool; MAX_PLANES],
}

/// Improves `start` until the sum of absolute residuals is its minimum within the bounds: within 1e-4 of `Σ|target|` where no
/// bound is active and 1e-3 where one is, typically 1e-6 (see the tests).
pub fn polish(fit: &Fit, start: [Pair; MAX_PLANES]) -> Polished {
    let problem = Scaled::new(fit);
    let mut best = Best::new(&problem, problem.confine(problem.scale(start)));
    let mut at = best.at;
    let mut multipliers = [0.0; MAX_PLANES];
    let mut foreseen = [0.0; FEATURES];
    let mut stalled = 0;
    let level = problem.target.iter().fold(0.0, |sum, target| sum + target.abs()) / FEATURES as f32;
    let last = EPSILON_LAST * level;
    let mut epsilon = EPSILON_FIRST * level;
    for _ in 0..ROUNDS {
        let quadratic = Quadratic::new(&problem, &at, epsilon, &foreseen);
        let Some(next) = quadratic.minimise(&problem, &at, &mut multipliers) else {
            break;
        };
        let next = problem.confine(next);
        let share = quadratic.foresee(&problem, &difference(&next, &at), &mut foreseen);
        at = next;
        let better = best.consider(&problem, at);
        stalled = if epsilon <= last && !better { stalled + 1 } else { 0 };
        if stalled >= STALLED {
            break;
        }
        let shrink = if share > SOLVED { SHRINK_SOLVED } else { SHRINK_OTHERWISE };
        epsilon = (epsilon * shrink).max(last);
    }
    let active = multipliers.map(|multiplier| multiplier > 0.0);
    vertex::descend(&problem, &mut best, active);
    let unbalance_g_mm = fit.confine(problem.unscale(best.at));
    Polished {
        unbalance_g_mm,
        residual_um: fit.residual_um(&unbalance_g_mm),
        at_bound: problem.at_bound(&best.at),
    }
}

/// The problem with each plane's two columns (orthogonal and of one length by nature) scaled to unit length: discs stay
/// discs, and planes of unlike influence become alike.
struct Scaled {
    columns: [[f32; FEATURES]; UNKNOWNS],
    target: [f32; FEATURES],
    bound: [f32; MAX_PLANES],
    /// Column length before scaling; zero for a plane that is absent, without influence or bound to zero.
    length: [f32; MAX_PLANES],
}

impl Scaled {
    fn new(fit: &Fit) -> Self {
        let mut columns = fit.influence.data.0;
        let mut bound = fit.bound_g_mm;
        let mut length = [0.0; MAX_PLANES];
        for k in 0..MAX_PLANES {
            let norm = scalar::sqrt(columns[2 * k].iter().fold(0.0, |sum, x| sum + x * x));
            let free = norm > f32::MIN_POSITIVE && bound[k] > f32::MIN_POSITIVE;
            let factor = if free { 1.0 / norm } else { 0.0 };
            length[k] = if free { norm } else { 0.0 };
            bound[k] *= length[k];
            for i in 0..2 {
                columns[2 * k + i] = columns[2 * k + i].map(|x| x * factor);
            }
        }
        Self { columns, target: fit.target_um, bound, length }
    }

    fn scale(&self, unbalance: [Pair; MAX_PLANES]) -> Vector {
        let [[a, b], [c, d]] = unbalance;
        let [first, second] = self.length;
        [a * first, b * first, c * second, d * second]
    }

    fn unscale(&self, [a, b, c, d]: Vector) -> [Pair; MAX_PLANES] {
        let [first, second] = self.length.map(|length| if length > 0.0 { 1.0 / length } else { 0.0 });
        [[a * first, b * first], [c * second, d * second]]
    }

    fn is_free(&self) -> [bool; MAX_PLANES] {
        self.length.map(|length| length > 0.0)
    }

    fn confine(&self, mut at: Vector) -> Vector {
        for k in 0..MAX_PLANES {
            let length = scalar::length([at[2 * k], at[2 * k + 1]]);
            if length > self.bound[k] {
                let factor = self.bound[k] / length;
                at[2 * k] *= factor;
                at[2 * k + 1] *= factor;
            }
        }
        at
    }

    fn at_bound(&self, [a, b, c, d]: &Vector) -> [bool; MAX_PLANES] {
        let [first, second] = self.bound;
        let [one, two] = self.is_free();
        let touches = |pair, bound| scalar::length(pair) >= bound * (1.0 - 1e-4);
        [one && touches([*a, *b], first), two && touches([*c, *d], second)]
    }

    /// Change of the residuals by a step.
    fn along(&self, step: &Vector) -> [f32; FEATURES] {
        let mut change = [0.0; FEATURES];
        for (column, &x) in self.columns.iter().zip(step) {
            for (change, &influence) in change.iter_mut().zip(column) {
                *change += influence * x;
            }
        }
        change
    }

    fn residuals(&self, at: &Vector) -> [f32; FEATURES] {
        let mut residuals = self.target.map(|target| -target);
        for (column, &x) in self.columns.iter().zip(at) {
            for (residual, &influence) in residuals.iter_mut().zip(column) {
                *residual += influence * x;
            }
        }
        residuals
    }
}

struct Best {
    at: Vector,
    value: f32,
}

impl Best {
    fn new(problem: &Scaled, at: Vector) -> Self {
        Self { at, value: sum_abs(&problem.residuals(&at)) }
    }

    fn consider(&mut self, problem: &Scaled, at: Vector) -> bool {
        let value = sum_abs(&problem.residuals(&at));
        let better = value < self.value;
        if better {
            *self = Self { at, value };
        }
        better
    }
}

fn difference(next: &Vector, at: &Vector) -> Vector {
    let [a, b, c, d] = *next;
    let [e, f, g, h] = *at;
    [a - e, b - f, c - g, d - h]
}

fn sum_abs(residuals: &[f32; FEATURES]) -> f32 {
    residuals.iter().fold(0.0, |sum, residual| sum + residual.abs())
}

//! The finish after the swarm: reweighted least squares with one multiplier per active bound, then a vertex snap.
//!
//! `|r|` is rounded off to `√(r² + ε²)` with an ε that shrinks. Each round minimises a parabola within the discs, a small
//! trust-region problem; finally the optimum's zero residuals are solved for exactly. Plain reweighting (weights 1/|r|)
//! was tried first: it stalls where a residual is small that ought not to be, up to 2 % of f above the minimum.

mod quadratic;
#[cfg(test)]
mod tests;

use crate::fit::Fit;
use crate::linear::{self, Row};
use crate::model::{MAX_PLANES, Pair};
use crate::reading::FEATURES;
use crate::scalar;
use quadratic::Quadratic;

/// Reweightings, at most.
const ROUNDS: usize = 20;
/// ε at the first round and what it falls to, relative to the mean |target|.
const EPSILON_FIRST: f32 = 0.1;
const EPSILON_LAST: f32 = 3e-5;
const EPSILON_SHRINK: f32 = 0.5;
/// Newton steps of a snap: more than one only straightens the curved bounds and rounding.
const SNAP_STEPS: usize = 3;

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

/// Improves `start` until the sum of absolute residuals is its minimum within the bounds, to about 1e-5 of `Σ|target|`.
pub fn polish(fit: &Fit, start: [Pair; MAX_PLANES]) -> Polished {
    let problem = Scaled::new(fit);
    let mut best = Best::new(&problem, problem.confine(problem.scale(start)));
    let mut at = best.at;
    let mut multipliers = [0.0; MAX_PLANES];
    let mut foreseen = [0.0; FEATURES];
    let level = problem.target.iter().fold(0.0, |sum, target| sum + target.abs()) / FEATURES as f32;
    let last = EPSILON_LAST * level;
    let mut epsilon = EPSILON_FIRST * level;
    for _ in 0..ROUNDS {
        let quadratic = Quadratic::new(&problem, &at, epsilon, &foreseen);
        let Some(next) = quadratic.minimise(&problem, &at, &mut multipliers) else {
            break;
        };
        let next = problem.confine(next);
        quadratic.foresee(&problem, &difference(&next, &at), &mut foreseen);
        at = next;
        best.consider(&problem, at);
        epsilon = (epsilon * EPSILON_SHRINK).max(last);
    }
    let active = multipliers.map(|multiplier| multiplier > 0.0);
    if let Some(snapped) = snap(&problem, best.at, active) {
        best.consider(&problem, snapped);
    }
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

    fn consider(&mut self, problem: &Scaled, at: Vector) {
        let value = sum_abs(&problem.residuals(&at));
        if value < self.value {
            *self = Self { at, value };
        }
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

/// The nearby point where the smallest residuals are zero, as many as the active bounds leave free.
fn snap(problem: &Scaled, start: Vector, active: [bool; MAX_PLANES]) -> Option<Vector> {
    let free = problem.is_free();
    let mut chosen = [false; FEATURES];
    let wanted = (0..MAX_PLANES).fold(0, |sum, k| sum + if free[k] { 2 - usize::from(active[k]) } else { 0 });
    for _ in 0..wanted {
        choose_smallest(&problem.residuals(&start), &mut chosen);
    }
    let mut at = start;
    for _ in 0..SNAP_STEPS {
        let mut rows = [[Row::<f32, MAX_PLANES, 1>::zero(); MAX_PLANES]; 2];
        let mut unused = rows.as_flattened_mut().iter_mut();
        let residuals = problem.residuals(&at);
        for i in 0..FEATURES {
            if chosen[i] {
                let row = unused.next()?;
                row.cells = [
                    [problem.columns[0][i], problem.columns[1][i]],
                    [problem.columns[2][i], problem.columns[3][i]],
                ];
                row.rhs = [-residuals[i]];
            }
        }
        for k in 0..MAX_PLANES {
            let [x, y] = [at[2 * k], at[2 * k + 1]];
            if !free[k] {
                unused.next()?.cells[k] = [1.0, 0.0];
                unused.next()?.cells[k] = [0.0, 1.0];
            } else if active[k] {
                let row = unused.next()?;
                row.cells[k] = [x, y];
                row.rhs = [0.5 * (problem.bound[k] * problem.bound[k] - x * x - y * y)];
            }
        }
        let step = linear::solve(&mut rows)?;
        for (x, [step]) in at.iter_mut().zip(step.as_flattened()) {
            *x += step;
        }
    }
    Some(problem.confine(at))
}

fn choose_smallest(residuals: &[f32; FEATURES], chosen: &mut [bool; FEATURES]) {
    let open = residuals.iter().zip(chosen).filter(|(_, chosen)| !**chosen);
    let mut least = f32::INFINITY;
    let mut found = None;
    for (residual, chosen) in open {
        if residual.abs() < least {
            least = residual.abs();
            found = Some(chosen);
        }
    }
    if let Some(chosen) = found {
        *chosen = true;
    }
}

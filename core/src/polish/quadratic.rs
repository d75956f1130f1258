//! One reweighted least-squares problem within the discs.

use super::{Scaled, UNKNOWNS, Vector};
use crate::linear::{self, Row};
use crate::model::MAX_PLANES;
use crate::reading::FEATURES;
use crate::scalar;

/// Newton steps for the multipliers; they start where the last round left them.
const NEWTON_STEPS: usize = 8;
/// A bound met to this relative accuracy is met.
const BOUND_TOLERANCE: f32 = 1e-5;

/// `½ δᵀA δ − gᵀδ` about the present point.
pub(super) struct Quadratic {
    normal: [[f32; UNKNOWNS]; UNKNOWNS],
    slope: Vector,
    slopes: [f32; FEATURES],
    weights: [f32; FEATURES],
}

impl Quadratic {
    /// Newton's parabola for `Σ√(r² + ε²)` with its second derivative `(1 − w·s)/√(r² + ε²)`, where `s = r/√(r² + ε²)`
    /// is the slope and `w` what the slope was foreseen to be (Chan, Golub, Mulet 1999). With w = 0 it is the reweighted
    /// least squares that cannot overshoot, with w = s Newton's method; in between it converges fast from afar.
    pub fn new(problem: &Scaled, at: &Vector, epsilon: f32, foreseen: &[f32; FEATURES]) -> Self {
        let residuals = problem.residuals(at);
        let mut slopes = [0.0; FEATURES];
        let mut weights = [0.0; FEATURES];
        for i in 0..FEATURES {
            let inverse = 1.0 / scalar::length([residuals[i], epsilon]).max(f32::MIN_POSITIVE);
            slopes[i] = residuals[i] * inverse;
            weights[i] = (1.0 - foreseen[i] * slopes[i]).max(1e-6) * inverse;
        }
        let mut normal = [[0.0; UNKNOWNS]; UNKNOWNS];
        let mut slope = [0.0; UNKNOWNS];
        for i in 0..UNKNOWNS {
            let left = &problem.columns[i];
            let mut weighted = *left;
            for (x, weight) in weighted.iter_mut().zip(&weights) {
                *x *= weight;
            }
            slope[i] = -dot(left, &slopes);
            for j in 0..=i {
                let product = dot(&weighted, &problem.columns[j]);
                normal[i][j] = product;
                normal[j][i] = product;
            }
        }
        // A plane without influence stays where it is.
        for k in 0..MAX_PLANES {
            if problem.length[k] == 0.0 {
                normal[2 * k][2 * k] = 1.0;
                normal[2 * k + 1][2 * k + 1] = 1.0;
            }
        }
        Self { normal, slope, slopes, weights }
    }

    /// Moves `foreseen` towards the slopes after a step, as far as none leaves −1..1; returns the part of the way.
    pub fn foresee(&self, problem: &Scaled, step: &Vector, foreseen: &mut [f32; FEATURES]) -> f32 {
        let mut change = problem.along(step);
        let mut share = 1.0_f32;
        for i in 0..FEATURES {
            change[i] = self.slopes[i] + self.weights[i] * change[i] - foreseen[i];
            let room = if change[i] > 0.0 { 1.0 - foreseen[i] } else { 1.0 + foreseen[i] };
            if change[i].abs() > room {
                share = share.min(room / change[i].abs());
            }
        }
        for (foreseen, change) in foreseen.iter_mut().zip(change) {
            *foreseen += 0.99 * share * change;
        }
        share
    }

    /// The point of least value within the discs, to the accuracy of a few Newton steps on the multipliers (as in a
    /// trust region: the reciprocal length is nearly linear in its multiplier). `None` if the matrix is singular.
    ///
    /// A step on both multipliers that lowers the dual value went too far; then only the plane farther from its bound
    /// takes its step, which converges from anywhere.
    pub fn minimise(
        &self,
        problem: &Scaled,
        at: &Vector,
        multipliers: &mut [f32; MAX_PLANES],
    ) -> Option<Vector> {
        let mut here = self.penalised(problem, at, *multipliers)?;
        for _ in 0..NEWTON_STEPS {
            if here.is_met() {
                break;
            }
            let both = self.penalised(problem, at, here.corrected(here.active))?;
            here = if both.dual >= here.dual || here.active != [true, true] {
                both
            } else {
                self.penalised(problem, at, here.corrected(here.farther()))?
            };
        }
        *multipliers = here.multipliers;
        Some(here.place)
    }

    /// Minimum of the quadratic plus `½ Σ λ_k (|v_k|² − b_k²)`.
    fn penalised(&self, problem: &Scaled, at: &Vector, multipliers: [f32; MAX_PLANES]) -> Option<Penalised> {
        let mut rows = [[Row::<f32, MAX_PLANES, { 1 + UNKNOWNS }>::zero(); MAX_PLANES]; 2];
        for (i, row) in rows.as_flattened_mut().iter_mut().enumerate().take(UNKNOWNS) {
            let [a, b, c, d] = self.normal[i];
            row.cells = [[a, b], [c, d]];
            row.cells[i / 2][i % 2] += multipliers[i / 2];
            row.rhs[0] = self.slope[i] - multipliers[i / 2] * at[i];
            row.rhs[1 + i] = 1.0;
        }
        let solution = linear::solve(&mut rows)?;
        let mut step = [0.0; UNKNOWNS];
        let mut inverse = [[0.0; UNKNOWNS]; UNKNOWNS];
        for ((x, row), [first, b0, b1, b2, b3]) in
            step.iter_mut().zip(&mut inverse).zip(solution.as_flattened())
        {
            *x = *first;
            *row = [*b0, *b1, *b2, *b3];
        }
        let mut place = *at;
        let mut dual = 0.0;
        for i in 0..UNKNOWNS {
            place[i] += step[i];
            let bend = (0..UNKNOWNS).fold(0.0, |sum, j| sum + self.normal[i][j] * step[j]);
            dual += step[i] * (0.5 * bend - self.slope[i]);
        }
        let mut result = Penalised {
            multipliers,
            place,
            dual,
            active: [false; MAX_PLANES],
            wrong: [0.0; MAX_PLANES],
            excess: [0.0; MAX_PLANES],
            gram: gram(&inverse, &place),
        };
        for k in 0..MAX_PLANES {
            let length = scalar::length([place[2 * k], place[2 * k + 1]]);
            let bound = problem.bound[k];
            if problem.length[k] > 0.0 && (multipliers[k] > 0.0 || length > bound) {
                result.active[k] = true;
                result.excess[k] = (length - bound) / bound;
                result.wrong[k] = length * length * result.excess[k];
                result.dual += 0.5 * multipliers[k] * (length * length - bound * bound);
            }
        }
        Some(result)
    }
}

/// The minimum for given multipliers, and what their next Newton step needs.
struct Penalised {
    multipliers: [f32; MAX_PLANES],
    place: Vector,
    dual: f32,
    /// Planes with a multiplier or outside their bound; how far they are from it, relative, and Newton's right side.
    active: [bool; MAX_PLANES],
    excess: [f32; MAX_PLANES],
    wrong: [f32; MAX_PLANES],
    /// `v_kᵀ B_kl v_l` with the inverse matrix B: how the lengths answer to the multipliers.
    gram: [[f32; MAX_PLANES]; MAX_PLANES],
}

impl Penalised {
    fn is_met(&self) -> bool {
        self.excess.iter().all(|excess| excess.abs() <= BOUND_TOLERANCE)
    }

    fn farther(&self) -> [bool; MAX_PLANES] {
        let [first, second] = self.excess.map(f32::abs);
        if first > second { [true, false] } else { [false, true] }
    }

    /// Multipliers after one Newton step on those of the given planes; none falls below zero.
    fn corrected(&self, planes: [bool; MAX_PLANES]) -> [f32; MAX_PLANES] {
        let [first, second] = self.multipliers;
        let [w1, w2] = self.wrong;
        let [[m11, m12], [_, m22]] = self.gram;
        let determinant = m11 * m22 - m12 * m12;
        let [one, two] = match planes {
            [true, true] => {
                [first + (m22 * w1 - m12 * w2) / determinant, second + (m11 * w2 - m12 * w1) / determinant]
            }
            [true, false] => [first + w1 / m11, second],
            [false, true] => [first, second + w2 / m22],
            [false, false] => [first, second],
        };
        // A singular pair leaves NaN; without multipliers the place is merely confined.
        [one, two].map(|multiplier| if multiplier > 0.0 && multiplier.is_finite() { multiplier } else { 0.0 })
    }
}

fn gram(inverse: &[[f32; UNKNOWNS]; UNKNOWNS], place: &Vector) -> [[f32; MAX_PLANES]; MAX_PLANES] {
    let mut gram = [[0.0; MAX_PLANES]; MAX_PLANES];
    for i in 0..UNKNOWNS {
        for j in 0..UNKNOWNS {
            gram[i / 2][j / 2] += place[i] * inverse[i][j] * place[j];
        }
    }
    gram
}

fn dot(left: &[f32; FEATURES], right: &[f32; FEATURES]) -> f32 {
    left.iter().zip(right).fold(0.0, |sum, (a, b)| sum + a * b)
}

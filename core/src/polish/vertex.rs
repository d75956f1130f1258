//! The end of the polish: where as many residuals vanish as the active bounds leave free, and from there downhill.
//!
//! Without active bounds a minimum is such a vertex, and exchanging one vanishing residual for another (Barrodale and
//! Roberts 1973) ends in the exact minimum. On a bound the tangent stands in for the rim, so only what is better is kept.

use super::{Best, Scaled, UNKNOWNS, Vector};
use crate::linear::{self, Row};
use crate::model::MAX_PLANES;
use crate::reading::FEATURES;

/// Exchanges, at most; none is usual.
const EXCHANGES: usize = 8;
/// Newton steps onto a vertex: more than one only straightens the curved bounds and rounding.
const STEPS: usize = 2;
/// A multiplier of a vanishing residual within this of one is within it: rounding.
const SLACK: f32 = 1e-3;

/// The equations of a vertex: each row's residual (none for a bound or an absent plane), the way along which it alone
/// grows at unit rate, and the step that solves them.
struct Vertex {
    owners: [Option<usize>; UNKNOWNS],
    ways: [Vector; UNKNOWNS],
    step: Vector,
}

/// Starts at the vertex of the smallest residuals; `active` says which planes stay on their bounds.
pub(super) fn descend(problem: &Scaled, best: &mut Best, active: [bool; MAX_PLANES]) {
    let mut at = best.at;
    let mut vanishing = smallest(problem, &at, active);
    for _ in 0..EXCHANGES {
        let mut reached = None;
        for _ in 0..STEPS {
            let Some(vertex) = Vertex::new(problem, &at, &vanishing, active) else {
                return;
            };
            for (x, step) in at.iter_mut().zip(&vertex.step) {
                *x += step;
            }
            reached = Some(vertex);
        }
        at = problem.confine(at);
        best.consider(problem, at);
        let Some((leaving, entering)) = reached.and_then(|vertex| vertex.exchange(problem, &at, &vanishing))
        else {
            return;
        };
        for i in 0..FEATURES {
            vanishing[i] = (vanishing[i] && i != leaving) || i == entering;
        }
    }
}

fn smallest(problem: &Scaled, at: &Vector, active: [bool; MAX_PLANES]) -> [bool; FEATURES] {
    let free = problem.is_free();
    let wanted = (0..MAX_PLANES).fold(0, |sum, k| sum + if free[k] { 2 - usize::from(active[k]) } else { 0 });
    let residuals = problem.residuals(at);
    let mut chosen = [false; FEATURES];
    for _ in 0..wanted {
        let mut least = f32::INFINITY;
        let mut found = None;
        for (residual, chosen) in residuals.iter().zip(&mut chosen) {
            if !*chosen && residual.abs() < least {
                least = residual.abs();
                found = Some(chosen);
            }
        }
        if let Some(chosen) = found {
            *chosen = true;
        }
    }
    chosen
}

impl Vertex {
    /// `None` if the equations depend on each other.
    fn new(
        problem: &Scaled,
        at: &Vector,
        vanishing: &[bool; FEATURES],
        active: [bool; MAX_PLANES],
    ) -> Option<Self> {
        let free = problem.is_free();
        let residuals = problem.residuals(at);
        let mut owners = [None; UNKNOWNS];
        let mut rows = [[Row::<f32, MAX_PLANES, { 1 + UNKNOWNS }>::zero(); MAX_PLANES]; 2];
        for (i, row) in rows.as_flattened_mut().iter_mut().enumerate().take(UNKNOWNS) {
            row.rhs[1 + i] = 1.0;
        }
        let mut unused = rows.as_flattened_mut().iter_mut().zip(&mut owners);
        for i in 0..FEATURES {
            if vanishing[i] {
                let (row, owner) = unused.next()?;
                let [a, b, c, d] = problem.columns.map(|column| column[i]);
                row.cells = [[a, b], [c, d]];
                row.rhs[0] = -residuals[i];
                *owner = Some(i);
            }
        }
        for k in 0..MAX_PLANES {
            let [x, y] = [at[2 * k], at[2 * k + 1]];
            if !free[k] {
                unused.next()?.0.cells[k] = [1.0, 0.0];
                unused.next()?.0.cells[k] = [0.0, 1.0];
            } else if active[k] {
                let (row, _) = unused.next()?;
                row.cells[k] = [x, y];
                row.rhs[0] = 0.5 * (problem.bound[k] * problem.bound[k] - x * x - y * y);
            }
        }
        let solution = linear::solve(&mut rows)?;
        let mut step = [0.0; UNKNOWNS];
        let mut ways = [[0.0; UNKNOWNS]; UNKNOWNS];
        for i in 0..UNKNOWNS {
            let sides = &solution[i / 2][i % 2];
            step[i] = sides[0];
            for row in 0..UNKNOWNS {
                ways[row][i] = sides[1 + row];
            }
        }
        Some(Self { owners, ways, step })
    }

    /// The residual that should grow and the one that vanishes first where the sum begins to rise again; `None` at the
    /// minimum, where no multiplier exceeds one.
    fn exchange(
        &self,
        problem: &Scaled,
        at: &Vector,
        vanishing: &[bool; FEATURES],
    ) -> Option<(usize, usize)> {
        let residuals = problem.residuals(at);
        let mut slope = [0.0; UNKNOWNS];
        for (slope, column) in slope.iter_mut().zip(&problem.columns) {
            for i in 0..FEATURES {
                if !vanishing[i] {
                    *slope += column[i] * 1.0_f32.copysign(residuals[i]);
                }
            }
        }
        let mut worst = 1.0 + SLACK;
        let mut found = None;
        for (owner, way) in self.owners.iter().zip(&self.ways) {
            let multiplier = -way.iter().zip(&slope).fold(0.0, |sum, (way, slope)| sum + way * slope);
            if let &Some(owner) = owner
                && multiplier.abs() > worst
            {
                worst = multiplier.abs();
                let sign = 1.0_f32.copysign(multiplier);
                found = Some((owner, way.map(|x| x * sign)));
            }
        }
        let (leaving, direction) = found?;
        let change = problem.along(&direction);
        let mut descent = 1.0 - worst;
        let mut passed = 0.0;
        // Each pass takes the next zero along the way; the sum's slope rises there by twice its rate of change.
        for _ in 0..FEATURES {
            let mut nearest = f32::INFINITY;
            let mut next = None;
            for i in 0..FEATURES {
                let distance = -residuals[i] / change[i];
                if !vanishing[i] && distance > passed && distance < nearest {
                    nearest = distance;
                    next = Some((i, change[i].abs()));
                }
            }
            let (entering, rate) = next?;
            descent += 2.0 * rate;
            if descent >= 0.0 {
                return Some((leaving, entering));
            }
            passed = nearest;
        }
        None
    }
}

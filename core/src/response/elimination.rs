//! Forces into motion by elimination with pivoting of all 2N equations: whatever the model, at several times the cost.

use super::C;
use super::equations::Equations;
use super::motion::Motion;
use crate::linear::{self, Equation};
use crate::model::Model;

/// `None` if the equations are singular.
#[inline(never)]
pub(super) fn eliminate<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    equations: &Equations<SHAPES>,
    model: &Model<SHAPES, PROBES, PLANES>,
    motion: &mut Motion<SHAPES, PLANES>,
) -> Option<()> {
    let mut system = [[Equation::<SHAPES, PLANES>::zero(); SHAPES]; 2];
    let [forward, backward] = &mut system;
    for (j, (forward, backward)) in forward.iter_mut().zip(backward.iter_mut()).enumerate() {
        forward.cells[0][j] = C::new(equations.forward[j], 0.0);
        backward.cells[1][j] = equations.backward[j];
    }
    for (support, block) in model.supports.iter().zip(&equations.supports) {
        let ([plus], [minus]) = (&support.shape.forward.data.0, &support.shape.backward.data.0);
        let shapes = [plus, minus];
        for ((rows, shape), stiffness) in system.iter_mut().zip(shapes).zip(block) {
            for (row, &here) in rows.iter_mut().zip(shape) {
                for ((cells, stiffness), shape) in row.cells.iter_mut().zip(stiffness).zip(shapes) {
                    for (cell, &there) in cells.iter_mut().zip(shape) {
                        *cell += stiffness * (here * there);
                    }
                }
            }
        }
    }
    let [forward, _] = &mut system;
    for (i, row) in forward.iter_mut().enumerate() {
        for (side, force) in row.planes.iter_mut().zip(&motion.planes) {
            *side = force.plus[i];
        }
        row.known = motion.forced.map_or(C::default(), |forced| forced.plus[i]);
    }
    linear::solve(system.as_flattened_mut())?;
    let [forward, backward] = &system;
    for i in 0..SHAPES {
        for (plane, whirl) in motion.planes.iter_mut().enumerate() {
            (whirl.plus[i], whirl.minus[i]) = (forward[i].planes[plane], backward[i].planes[plane]);
        }
        if let Some(forced) = &mut motion.forced {
            (forced.plus[i], forced.minus[i]) = (forward[i].known, backward[i].known);
        }
    }
    Some(())
}

//! A search that stays inside a range.

use nalgebra::{DMatrix, DVector};

use super::descent::{Objective, Stop, descend};
use super::problem::Problem;

/// Lowest and highest search coordinate of every unknown.
#[derive(Debug, Clone, Copy)]
pub struct Bounds<'b> {
    pub low: &'b [f64],
    pub high: &'b [f64],
}

/// Goes downhill from `start`; an unknown that would leave the range is held at its end while the others go on, and
/// is let go when the way down leads inside again.
pub fn descend_within(problem: &mut Problem, start: &[f64], bounds: Bounds, stop: Stop) {
    let mut within = BoundedProblem { problem, bounds };
    within.move_to(&DVector::from_column_slice(start));
    descend(&mut within, stop);
}

struct BoundedProblem<'a, 'p> {
    problem: &'a mut Problem<'p>,
    bounds: Bounds<'a>,
}

impl Objective for BoundedProblem<'_, '_> {
    fn position(&self) -> DVector<f64> {
        self.problem.position()
    }

    fn move_to(&mut self, x: &DVector<f64>) {
        let Bounds { low, high } = self.bounds;
        let inside: Vec<f64> =
            x.iter().zip(low.iter().zip(high)).map(|(x, (low, high))| x.clamp(*low, *high)).collect();
        self.problem.go_to(&inside);
    }

    fn value(&self) -> f64 {
        self.problem.value()
    }

    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (mut gram, mut slope) = self.problem.normal_equations()?;
        let x = self.problem.x();
        for i in 0..x.len() {
            // downhill is against the slope
            let held = (x[i] <= self.bounds.low[i] && slope[i] > 0.0)
                || (x[i] >= self.bounds.high[i] && slope[i] < 0.0);
            if held {
                slope[i] = 0.0;
                gram.row_mut(i).fill(0.0);
                gram.column_mut(i).fill(0.0);
            }
        }
        Some((gram, slope))
    }
}

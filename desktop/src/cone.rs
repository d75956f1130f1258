//! Convex programmes with linear and second-order cones, written row by row and solved to full precision.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use crate::error::Error;

/// `min ½ xᵀPx + cᵀx` where every cone holds its rows of `right − matrix · x`.
#[derive(Default)]
pub(crate) struct Programme {
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    right: Vec<f64>,
    /// Upper triangle of P as (row, column, value); none for a linear cost.
    pub quadratic: Vec<(usize, usize, f64)>,
    /// The cones, in the order of the rows.
    pub cones: Vec<SupportedConeT<f64>>,
}

impl Programme {
    /// An entry of the row that is being written.
    pub fn push(&mut self, column: usize, value: f64) {
        self.rows.push(self.right.len());
        self.columns.push(column);
        self.values.push(value);
    }

    /// Ends the row with its right side.
    pub fn end_row(&mut self, right: f64) {
        self.right.push(right);
    }

    /// The pair of unknowns from `first` on is no longer than `largest`.
    pub fn bound_pair(&mut self, first: usize, largest: f64) {
        self.end_row(largest);
        for axis in 0..2 {
            self.push(first + axis, -1.0);
            self.end_row(0.0);
        }
        self.cones.push(SupportedConeT::SecondOrderConeT(3));
    }

    /// The optimum for a linear cost of every unknown; `what` is only for the message.
    ///
    /// # Errors
    /// If there is none.
    pub fn solve(self, what: &str, cost: &[f64]) -> Result<Vec<f64>, Error> {
        let unknowns = cost.len();
        let settings = DefaultSettingsBuilder::default()
            .verbose(false)
            .tol_gap_abs(1e-10)
            .tol_gap_rel(1e-10)
            .tol_feas(1e-10)
            .build()
            .map_err(|e| Error::Unsuitable(e.to_string()))?;
        let a =
            CscMatrix::new_from_triplets(self.right.len(), unknowns, self.rows, self.columns, self.values);
        let (mut i, mut j, mut p) = (Vec::new(), Vec::new(), Vec::new());
        for (row, column, value) in self.quadratic {
            i.push(row);
            j.push(column);
            p.push(value);
        }
        let quadratic = CscMatrix::new_from_triplets(unknowns, unknowns, i, j, p);
        let mut solver = DefaultSolver::new(&quadratic, cost, &a, &self.right, &self.cones, settings)
            .map_err(|e| Error::Unsuitable(e.to_string()))?;
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Ok(solver.solution.x),
            status => Err(Error::Unsuitable(format!("{what} has no solution: {status:?}"))),
        }
    }
}

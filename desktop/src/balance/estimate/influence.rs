//! Plain influence coefficients beside the model: least squares at every row by itself, nothing known but the runs.

use nalgebra::{Complex, DMatrix};

use super::mounting::Mountings;
use crate::decomposition::svd;

type C = Complex<f64>;

/// Singular values, relative to the largest, below which trial weights do not tell planes apart.
const INDEPENDENT: f64 = 1e-3;

/// Response of the base run, then influence of each plane, by row; µm and µm per g·mm.
pub struct Coefficients(DMatrix<C>);

impl Coefficients {
    /// From the runs of which `used` says so; `None` where they do not determine every row.
    pub fn of(mountings: &Mountings, used: &[bool]) -> Option<Self> {
        let runs: Vec<_> = mountings
            .runs
            .iter()
            .zip(used)
            .filter(|(m, used)| **used && m.stated.is_some())
            .map(|(m, _)| m)
            .collect();
        let planes = runs.first()?.stated.as_ref()?.len();
        let largest =
            runs.iter().flat_map(|m| m.stated.iter().flatten()).map(|u| u.norm()).fold(0.0, f64::max);
        let mut all = DMatrix::zeros(mountings.rows(), 1 + planes);
        for row in 0..mountings.rows() {
            let here: Vec<(&Vec<C>, C)> =
                runs.iter().filter_map(|m| Some((m.stated.as_ref()?, m.phasors[row]?))).collect();
            if here.len() < 1 + planes {
                return None;
            }
            let equations = DMatrix::from_fn(here.len(), 1 + planes, |i, j| match j {
                0 => C::from(1.0),
                _ => here[i].0[j - 1] / largest,
            });
            let measured = DMatrix::from_fn(here.len(), 1, |i, _| here[i].1);
            let svd = svd(equations)?;
            let least = INDEPENDENT * svd.singular_values.max();
            if svd.singular_values.min() < least {
                return None;
            }
            let solution = svd.solve(&measured, least).ok()?;
            for j in 0..=planes {
                all[(row, j)] = solution[(j, 0)] / if j == 0 { 1.0 } else { largest };
            }
        }
        Some(Self(all))
    }

    /// Unbalance of each plane of a run relative to the base run, g·mm; `None` where its rows are too few.
    pub fn estimated(&self, phasors: &[Option<C>]) -> Option<Vec<C>> {
        let rows: Vec<usize> = (0..phasors.len()).filter(|r| phasors[*r].is_some()).collect();
        let planes = self.0.ncols() - 1;
        if rows.len() < planes {
            return None;
        }
        let per_weight = DMatrix::from_fn(rows.len(), planes, |i, j| self.0[(rows[i], 1 + j)]);
        let measured = DMatrix::from_fn(rows.len(), 1, |i, _| {
            phasors[rows[i]].unwrap_or_default() - self.0[(rows[i], 0)]
        });
        let solution = svd(per_weight)?.solve(&measured, f64::MIN_POSITIVE).ok()?;
        Some(solution.iter().copied().collect())
    }
}

//! The unbalance of a run by influence coefficients alone, beside the model: least squares at every row by itself.

use nalgebra::{Complex, DMatrix};

use super::mounting::{Mounting, Mountings};
use crate::balance::influence::regression::{Observation, least_squares};
use crate::balance::influence::{InfluenceCoefficients, stacked};
use crate::decomposition::svd;
use crate::units::rpm;

type C = Complex<f64>;

/// Coefficients of every row, µm and µm per g·mm, from the runs of which `used` says so; `None` where these do not determine
/// every row.
pub fn coefficients(mountings: &Mountings, used: &[bool]) -> Option<Vec<InfluenceCoefficients>> {
    let pairs = mountings.runs.iter().zip(used);
    let runs: Vec<(&Mounting, &Vec<C>)> =
        pairs.filter(|(_, used)| **used).filter_map(|(m, _)| Some((m, m.stated.as_ref()?))).collect();
    let planes = runs.first()?.1.len();
    let largest = runs.iter().flat_map(|(_, w)| w.iter()).map(|u| u.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let at = |row: usize| {
        let observation = |(m, weights): &(&Mounting, &Vec<C>)| {
            let weights = weights.iter().map(|u| u / largest).collect();
            Some(Observation { weights, phasor: m.phasors[row]?, sigma: 1.0 })
        };
        let observed: Vec<Observation> = runs.iter().filter_map(observation).collect();
        let (probe, speed) = (row % mountings.probes, row / mountings.probes);
        let speed_rpm = rpm(mountings.speeds_rad_s[speed]);
        let fit = least_squares(&observed).ok()?;
        Some(InfluenceCoefficients::new(probe, speed_rpm, &fit, planes, largest))
    };
    (0..mountings.rows()).map(at).collect()
}

/// Unbalance of each plane of a run relative to the base run, g·mm; `None` where its rows are too few.
pub fn unbalance_g_mm(all: &[InfluenceCoefficients], phasors: &[Option<C>]) -> Option<Vec<C>> {
    let (per_weight, before) = stacked(all);
    let rows: Vec<usize> = (0..phasors.len()).filter(|r| phasors[*r].is_some()).collect();
    if rows.len() < per_weight.ncols() {
        return None;
    }
    let moved = |i: usize, _| phasors[rows[i]].unwrap_or_default() - before[rows[i]];
    let moved = DMatrix::from_fn(rows.len(), 1, moved);
    let solution = svd(per_weight.select_rows(&rows))?.solve(&moved, f64::MIN_POSITIVE).ok()?;
    Some(solution.iter().copied().collect())
}

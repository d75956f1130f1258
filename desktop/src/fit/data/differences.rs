//! What differs between runs.
//!
//! A bow, a runout, a coupling, the machine's own unbalance: a force or reading that is the same in every run is not in the
//! differences of runs. What is left is how the machine answers to weights, and how the probes show it.

use std::collections::BTreeMap;

use nalgebra::Complex;

use super::{Data, FitRow};
use crate::units::{SAME_SPEED, same_place};

type C = Complex<f64>;

/// Runs that are compared at least: of two there is one difference, and bearings alone can explain that.
const LEAST_RUNS: usize = 3;
/// Speeds are one operating point if they differ by no more than this, relative: the closest that all runs share, from the grid of a
/// controlled sweep to speeds that a person held.
const DWELLS: [f64; 3] = [1e-3, 5e-3, SAME_SPEED];

impl Data {
    /// Every reading less the mean over all runs at its speed, with its weights less their mean; noise stays as it was. `None` if there
    /// are fewer than three runs, no speed that all of them share, or runs that are sweeps.
    pub fn differences_of_runs(&self) -> Option<Self> {
        let mut of_run: BTreeMap<usize, &FitRow> = BTreeMap::new();
        self.rows.iter().for_each(|row| _ = of_run.entry(row.run).or_insert(row));
        if of_run.len() < LEAST_RUNS || self.rows.iter().any(|row| row.swept.is_some()) {
            return None;
        }
        let mean_weights = mean_weights(of_run.values().copied());
        let rows = DWELLS.iter().map(|dwell| {
            let shared = self.shared_speeds(*dwell, of_run.len());
            shared.iter().flat_map(|group| less_mean(group, of_run.len(), &mean_weights)).collect::<Vec<_>>()
        });
        let rows = rows.into_iter().find(|rows| !rows.is_empty())?;
        Some(Self { rows, centreline: self.centreline.clone(), sweeps: None })
    }

    /// Rows at each speed at which so many runs were measured.
    fn shared_speeds(&self, dwell: f64, runs: usize) -> Vec<Vec<&FitRow>> {
        let mut rows: Vec<&FitRow> = self.rows.iter().collect();
        rows.sort_by(|a, b| a.speed_rad_s.total_cmp(&b.speed_rad_s));
        let mut groups: Vec<Vec<&FitRow>> = Vec::new();
        for row in rows {
            match groups.last_mut() {
                Some(group) if row.speed_rad_s <= group[0].speed_rad_s * (1.0 + dwell) => group.push(row),
                _ => groups.push(vec![row]),
            }
        }
        groups.retain(|group| by_run(group).len() == runs);
        groups
    }
}

/// The rows of each run.
fn by_run<'r>(rows: &[&'r FitRow]) -> BTreeMap<usize, Vec<&'r FitRow>> {
    let mut runs: BTreeMap<usize, Vec<&FitRow>> = BTreeMap::new();
    rows.iter().for_each(|row| runs.entry(row.run).or_default().push(row));
    runs
}

/// Mean weight at each position over runs, m and kg·m.
fn mean_weights<'r>(runs: impl ExactSizeIterator<Item = &'r FitRow>) -> Vec<(f64, C)> {
    let share = (runs.len() as f64).recip();
    let mut mean: Vec<(f64, C)> = Vec::new();
    for (position_m, weight) in runs.flat_map(|row| &row.added) {
        match mean.iter_mut().find(|(z, _)| same_place(*z, *position_m)) {
            Some((_, sum)) => *sum += weight * share,
            None => mean.push((*position_m, weight * share)),
        }
    }
    mean
}

/// Rows of one speed less their mean, in which each run counts once. What a probe showed is dropped where it is missing in a run.
fn less_mean(rows: &[&FitRow], runs: usize, mean_weights: &[(f64, C)]) -> Vec<FitRow> {
    let mut means: BTreeMap<usize, Vec<C>> = BTreeMap::new();
    for own in by_run(rows).values() {
        let mut of_probe: BTreeMap<usize, (C, f64)> = BTreeMap::new();
        for value in own.iter().flat_map(|row| &row.values) {
            let (sum, count) = of_probe.entry(value.probe).or_default();
            *sum += value.measured_m;
            *count += 1.0;
        }
        of_probe.iter().for_each(|(probe, (sum, count))| means.entry(*probe).or_default().push(sum / *count));
    }
    let mean_of = |probe: usize| {
        let all = means.get(&probe).filter(|all| all.len() == runs)?;
        Some(all.iter().sum::<C>() / runs as f64)
    };
    let less = |row: &&FitRow| {
        let mut row = (*row).clone();
        row.values.retain_mut(|value| {
            let mean = mean_of(value.probe);
            value.measured_m -= mean.unwrap_or_default();
            mean.is_some()
        });
        row.added.extend(mean_weights.iter().map(|(position_m, weight)| (*position_m, -weight)));
        row
    };
    rows.iter().map(less).filter(|row| !row.values.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::data::FitValue;

    /// What is the same in all runs at a speed, m, and the motion per weight, m per kg·m.
    fn common(speed_rad_s: f64) -> C {
        C::new(3e-5 * (0.01 * speed_rad_s).sin(), 1e-5)
    }

    fn influence(speed_rad_s: f64) -> C {
        C::new(0.2, -1e-4 * speed_rad_s)
    }

    /// Runs with these weights at 0.2 m, each at these speeds, of one probe.
    fn data(weights: &[C], speeds_rad_s: impl Fn(usize) -> Vec<f64>) -> Data {
        let rows = weights.iter().enumerate().flat_map(|(run, weight)| {
            speeds_rad_s(run).into_iter().map(move |speed_rad_s| {
                let measured_m = common(speed_rad_s) + influence(speed_rad_s) * weight;
                FitRow {
                    run,
                    listed: Some(run),
                    readings: 1,
                    speed_rad_s,
                    run_share: 1.0,
                    added: vec![(0.2, *weight)],
                    values: vec![FitValue { probe: 0, measured_m, sigma_m: 1e-7, growth: 1.0 }],
                    swept: None,
                }
            })
        });
        Data { rows: rows.collect(), ..Data::default() }
    }

    const WEIGHTS: [C; 3] = [C::new(0.0, 0.0), C::new(3e-4, 0.0), C::new(0.0, -2e-4)];

    #[test]
    fn differences_of_runs_hold_the_answer_to_weights_alone() {
        let differences = data(&WEIGHTS, |_| vec![100.0, 300.0]).differences_of_runs().unwrap();
        assert_eq!(differences.rows.len(), 6);
        for row in &differences.rows {
            let weight: C = row.added.iter().map(|(_, weight)| weight).sum();
            let value = row.values[0];
            assert!((value.measured_m - influence(row.speed_rad_s) * weight).norm() < 1e-18);
            assert_eq!(value.sigma_m, 1e-7);
        }
        let total: C = differences.rows.iter().map(|row| row.values[0].measured_m).sum();
        assert!(total.norm() < 1e-18);
    }

    #[test]
    fn speeds_that_a_run_lacks_are_left_out_of_differences() {
        // held by a person to half a percent, and one speed of the first run alone
        let speeds = |run: usize| if run == 0 { vec![100.0, 300.0] } else { vec![100.0 + 0.2 * run as f64] };
        let differences = data(&WEIGHTS, speeds).differences_of_runs().unwrap();
        assert!(differences.rows.iter().all(|row| row.speed_rad_s < 101.0));
        assert_eq!(differences.rows.len(), 3);
        assert!(data(&WEIGHTS, |run| vec![100.0 * (run + 1) as f64]).differences_of_runs().is_none());
        assert!(data(&WEIGHTS[..2], |_| vec![100.0]).differences_of_runs().is_none());
    }
}

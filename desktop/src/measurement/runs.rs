//! Readings by the run that they were taken in.

use std::collections::BTreeMap;

use super::Reading;

#[derive(Debug, Clone, PartialEq)]
pub struct SortedRun {
    /// As in the file; `None` where it has no runs.
    pub name: Option<String>,
    /// Numbers of its readings by ascending speed.
    pub rows: Vec<usize>,
}

impl SortedRun {
    /// Every run in the order of the measurement.
    pub fn all(readings: &[Reading]) -> Vec<Self> {
        let mut runs: Vec<Self> = Vec::new();
        for (row, reading) in readings.iter().enumerate() {
            match runs.iter_mut().find(|r| r.name == reading.run) {
                Some(run) => run.rows.push(row),
                None => runs.push(Self { name: reading.run.clone(), rows: vec![row] }),
            }
        }
        for run in &mut runs {
            run.rows.sort_by(|a, b| readings[*a].speed_rpm.total_cmp(&readings[*b].speed_rpm));
        }
        runs
    }
}

/// Share of the run that has passed at each reading, 0 to 1; 1 for a run of one reading.
pub(crate) fn run_shares(readings: &[Reading]) -> Vec<f64> {
    let mut runs: BTreeMap<Option<&str>, Vec<usize>> = BTreeMap::new();
    for (i, reading) in readings.iter().enumerate() {
        runs.entry(reading.run.as_deref()).or_default().push(i);
    }
    let mut shares = vec![1.0; readings.len()];
    for rows in runs.values() {
        let times: Option<Vec<f64>> = rows.iter().map(|i| readings[*i].time_d).collect();
        let passed = times.unwrap_or_else(|| (0..rows.len()).map(|k| k as f64).collect());
        let first = passed.iter().copied().fold(f64::INFINITY, f64::min);
        let whole = passed.iter().copied().fold(f64::NEG_INFINITY, f64::max) - first;
        for (i, at) in rows.iter().zip(&passed).filter(|_| whole > 0.0) {
            shares[*i] = (at - first) / whole;
        }
    }
    shares
}

//! Readings by the run that they were taken in.

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

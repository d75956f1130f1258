//! Readings that repeat the one before: the machine stood at one speed while it was measured several times.
//!
//! The model says the same of all of them, so that it is computed once, at their mean speed; every value stays and is compared by itself,
//! with its noise and its correlation. Readings are joined where neither speed nor noise tells them apart.

use super::{FitRow, FitValue};

/// Relative change of the response per relative change of speed, at most: a resonance with two percent of critical damping, 1/ζ.
const STEEPEST: f64 = 50.0;
/// Largest error of a value, in its standard deviations, by the mean speed of the readings instead of its own.
const UNSEEN: f64 = 0.5;
/// Standard deviations by which two values of one state differ at most: 1 in 1,000 differ by more.
const APART: f64 = 3.7;

/// The rows, each with those that repeat it.
pub fn joined(singly: impl Iterator<Item = FitRow>) -> Vec<FitRow> {
    let mut rows: Vec<FitRow> = Vec::new();
    for row in singly {
        match rows.last_mut().filter(|last| repeats(last, &row)) {
            Some(last) => take_in(last, row),
            None => rows.push(row),
        }
    }
    for row in &mut rows {
        let mean = row.run_share;
        row.values.iter_mut().for_each(|v| v.growth = if mean > 0.0 { v.growth / mean } else { 1.0 });
    }
    rows
}

/// Whether nothing tells a reading from the row before it.
fn repeats(row: &FitRow, next: &FitRow) -> bool {
    let off = (next.speed_rad_s / row.speed_rad_s - 1.0).abs();
    let same = |v: &FitValue| {
        let unseen = STEEPEST * off * v.measured_m.norm() <= UNSEEN * v.sigma_m;
        let before = row.values.iter().find(|b| b.probe == v.probe);
        let near = |b: &FitValue| (v.measured_m - b.measured_m).norm() <= APART * v.sigma_m.hypot(b.sigma_m);
        unseen && before.is_none_or(near)
    };
    next.run == row.run && next.swept.is_none() && off <= 1.0 / STEEPEST && next.values.iter().all(same)
}

fn take_in(row: &mut FitRow, next: FitRow) {
    row.readings += next.readings;
    let share = next.readings as f64 / row.readings as f64;
    row.speed_rad_s += (next.speed_rad_s - row.speed_rad_s) * share;
    row.run_share += (next.run_share - row.run_share) * share;
    row.values.extend(next.values);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// A reading of two probes with noise of 0.1 µm.
    fn reading(run: usize, speed_rad_s: f64, run_share: f64, um: [f64; 2]) -> FitRow {
        let value = |(probe, um): (usize, f64)| FitValue {
            probe,
            measured_m: Complex::from(um * 1e-6),
            sigma_m: 1e-7,
            growth: run_share,
        };
        let values = um.into_iter().enumerate().map(value).collect();
        FitRow {
            run,
            listed: None,
            readings: 1,
            speed_rad_s,
            run_share,
            added: Vec::new(),
            values,
            swept: None,
        }
    }

    #[test]
    fn repeats_are_joined_in_order_at_their_mean() {
        let rows =
            joined([reading(0, 100.0, 0.2, [5.0, 7.0]), reading(0, 100.01, 0.4, [5.1, 6.9])].into_iter());
        assert_eq!(rows.len(), 1);
        assert_eq!((rows[0].readings, rows[0].values.len()), (2, 4));
        assert!((rows[0].speed_rad_s - 100.005).abs() < 1e-9 && (rows[0].run_share - 0.3).abs() < 1e-12);
        let probes: Vec<usize> = rows[0].values.iter().map(|v| v.probe).collect();
        assert_eq!(probes, [0, 1, 0, 1]);
        // what grows acts at each value as it did
        let shares: Vec<f64> = rows[0].values.iter().map(|v| v.growth * rows[0].run_share).collect();
        assert!((shares[1] - 0.2).abs() < 1e-12 && (shares[2] - 0.4).abs() < 1e-12);
    }

    #[test]
    fn another_run_speed_or_value_is_another_row() {
        let first = || reading(0, 100.0, 0.0, [5.0, 7.0]);
        for next in [
            reading(1, 100.0, 0.0, [5.0, 7.0]),
            reading(0, 100.1, 0.0, [5.0, 7.0]),
            reading(0, 100.0, 0.0, [5.0, 7.6]),
        ] {
            assert_eq!(joined([first(), next].into_iter()).len(), 2);
        }
    }

    #[test]
    fn a_slow_sweep_is_no_row_of_repeats() {
        // the larger value allows a relative change of speed of 0.5 · 0.1 µm / (50 · 7 µm) = 1.4e-4 from the mean: one step of 1e-4, and
        // after it not 1.5e-4
        let sweep = (0..100).map(|k| reading(0, 100.0 * 1.0001_f64.powi(k), 0.0, [5.0, 7.0]));
        let rows = joined(sweep);
        let widest = rows.iter().map(|row| row.readings).max().unwrap();
        assert_eq!(widest, 2);
    }
}

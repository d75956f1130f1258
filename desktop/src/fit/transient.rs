//! Rows that the steady response is evaluated in, where some readings are sums over it, and what the readings make of it.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix};

use super::Fitter;
use super::data::{Amplitudes, Data, FitRow, FitValue};

/// Data with runs that are sweeps, by responses at steady speeds. Evaluated values are in metres, observed ones in noise units.
pub struct Transient {
    /// Those of steady runs, as they are, and every speed of a swept run's grid, with all probes.
    pub rows: Vec<FitRow>,
    /// Evaluated rows of each observed row.
    of_row: Vec<Vec<usize>>,
    /// An evaluated value and the observed one that it is.
    steady: Vec<[usize; 2]>,
    runs: Vec<SweptRun>,
    /// Standard deviations of the observed values, m.
    sigma_m: Vec<f64>,
}

/// The readings of a run as sums over its speeds.
struct SweptRun {
    /// Number of the run.
    run: usize,
    /// Its first evaluated row.
    first_row: usize,
    first_value: usize,
    speeds: usize,
    /// Real and imaginary parts of each reading, by those of each speed.
    weights: DMatrix<f64>,
    /// Of each observed value: its number, reading and probe.
    observed: Vec<[usize; 3]>,
}

/// A value in metres, of noise 1, that nobody observed.
fn blank(probe: usize, growth: f64) -> FitValue {
    FitValue { probe, measured_m: Complex::from(0.0), sigma_m: 1.0, growth }
}

impl Transient {
    /// `None` where every reading is that of a steady speed.
    pub fn of(data: &Data, probes: usize) -> Option<Self> {
        data.rows.iter().any(|row| row.swept.is_some()).then(|| Self::new(data, probes))
    }

    fn new(data: &Data, probes: usize) -> Self {
        let sigma_m = data.values().map(|v| v.sigma_m).collect();
        let mut all =
            Self { rows: Vec::new(), of_row: Vec::new(), steady: Vec::new(), runs: Vec::new(), sigma_m };
        let (mut evaluated, mut observed) = (0, 0);
        for row in &data.rows {
            let count = row.values.len();
            if let Some(swept) = &row.swept {
                let run = all.runs.iter().position(|known| known.run == row.run).unwrap_or_else(|| {
                    let own: Vec<&FitRow> = data.rows.iter().filter(|other| other.run == row.run).collect();
                    all.add_run(&own, &swept.speeds_rad_s, probes, evaluated);
                    evaluated += swept.speeds_rad_s.len() * probes;
                    all.runs.len() - 1
                });
                all.runs[run].add(row, observed);
                let (first, speeds) = (all.runs[run].first_row, all.runs[run].speeds);
                all.of_row.push((first..first + speeds).collect());
            } else {
                all.steady.extend((0..count).map(|k| [evaluated + k, observed + k]));
                all.of_row.push(vec![all.rows.len()]);
                let values = row.values.iter().map(|v| blank(v.probe, v.growth)).collect();
                all.rows.push(FitRow { values, ..row.clone() });
                evaluated += count;
            }
            observed += count;
        }
        all
    }

    /// The grid of a run with these readings; what grows over the run does so as far as at the reading of the closest speed.
    fn add_run(&mut self, own: &[&FitRow], speeds_rad_s: &Arc<Vec<f64>>, probes: usize, first_value: usize) {
        let (first, first_row) = (own[0], self.rows.len());
        let row = |speed_rad_s: &f64| {
            let off = |row: &&&FitRow| (row.speed_rad_s - speed_rad_s).abs();
            let closest = own.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            FitRow {
                speed_rad_s: *speed_rad_s,
                run_share: closest.map_or(1.0, |row| row.run_share),
                values: (0..probes).map(|probe| blank(probe, 1.0)).collect(),
                swept: None,
                ..first.clone()
            }
        };
        self.rows.extend(speeds_rad_s.iter().map(row));
        self.runs.push(SweptRun {
            run: first.run,
            first_row,
            first_value,
            speeds: speeds_rad_s.len(),
            weights: DMatrix::zeros(0, 2 * speeds_rad_s.len()),
            observed: Vec::new(),
        });
    }

    /// Evaluated rows of some observed rows alone, in the order of [`Self::of`] their part of the data.
    fn rows_of(&self, observed: &[usize]) -> Vec<usize> {
        let mut rows = Vec::new();
        for row in observed.iter().flat_map(|r| &self.of_row[*r]) {
            if !rows.contains(row) {
                rows.push(*row);
            }
        }
        rows
    }

    /// Observed values of evaluated ones: rows real and imaginary parts in turn, columns whatever they are of.
    pub fn observed(&self, evaluated: &DMatrix<f64>) -> DMatrix<f64> {
        let columns = evaluated.ncols();
        let mut observed = DMatrix::zeros(2 * self.sigma_m.len(), columns);
        for [from, to] in &self.steady {
            for part in 0..2 {
                observed.row_mut(2 * to + part).copy_from(&evaluated.row(2 * from + part));
            }
        }
        for run in &self.runs {
            let probes = self.rows[run.first_row].values.len();
            for probe in 0..probes {
                let value = |i: usize| 2 * (run.first_value + i / 2 * probes + probe) + i % 2;
                let own = DMatrix::from_fn(2 * run.speeds, columns, |i, j| evaluated[(value(i), j)]);
                let seen = &run.weights * own;
                for [to, reading, _] in run.observed.iter().filter(|[.., of]| *of == probe) {
                    observed.rows_mut(2 * to, 2).copy_from(&seen.rows(2 * reading, 2));
                }
            }
        }
        for (k, sigma_m) in self.sigma_m.iter().enumerate() {
            observed.rows_mut(2 * k, 2).unscale_mut(*sigma_m);
        }
        observed
    }
}

impl SweptRun {
    /// Takes in a reading whose first value has this number.
    fn add(&mut self, row: &FitRow, first: usize) {
        let reading = self.weights.nrows() / 2;
        let weights = row.swept.iter().flat_map(|swept| &swept.weights);
        let more = std::mem::replace(&mut self.weights, DMatrix::zeros(0, 0));
        self.weights = more.resize_vertically(2 * (reading + 1), 0.0);
        for (j, w) in weights.enumerate() {
            let turned = nalgebra::Matrix2::new(w.re, -w.im, w.im, w.re);
            self.weights.fixed_view_mut::<2, 2>(2 * reading, 2 * j).copy_from(&turned);
        }
        let values = row.values.iter().enumerate();
        self.observed.extend(values.map(|(k, v)| [first + k, reading, v.probe]));
    }
}

impl Fitter<'_> {
    /// The rows that a model is evaluated in: those of the data, but for runs that are sweeps.
    pub(super) fn rows(&self) -> &[FitRow] {
        self.transient.as_ref().map_or(&self.data.rows, |transient| &transient.rows)
    }

    /// Amplitudes of a fit for [`Self::part`] of its data, which these rows are.
    pub fn part_of_amplitudes(&self, amplitudes: &Amplitudes, rows: &[usize]) -> Amplitudes {
        let own = self.transient.as_ref().map(|transient| transient.rows_of(rows));
        own.as_deref().unwrap_or(rows).iter().map(|r| amplitudes[*r].clone()).collect()
    }
}

//! Model against measurement: how far apart, where, and whether noise explains it.
//!
//! Two questions decide the verdict, each asked at [`SIGNIFICANCE`]. The size of the misfit: χ² of
//! all components against `[noise]`. Its structure: the correlation of neighbouring speeds, because
//! noise does not know its neighbour and missing physics does. For Gaussian noise the correlation is a
//! ratio that does not depend on χ², so the two are independent and a machine that hides nothing is
//! called [`Adequacy::Misses`] in 1 % of all measurements. A fit bends its residual away from its
//! neighbours, which makes the second question, if anything, more patient than that.

mod reversal;
mod structure;
mod tally;
#[cfg(test)]
mod tests;
mod whirl;

use nalgebra::Complex;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::{Reading, SortedRun};
use crate::statistics::significance::SURE;

use tally::{ComparedValue, Tally, ratio};

pub use structure::{Neighbours, SeriesNeighbours};
pub use whirl::{ProbePair, WhirlMisfit, WhirlPart, probe_pairs};

type C = Complex<f64>;

/// A misfit is physics if noise does as badly in less than this share of all measurements.
pub const SIGNIFICANCE: f64 = 0.005;
/// Rows of one run in [`Comparison::by_speed`]; more speeds than this are gathered.
const MOST_SPEEDS: usize = 60;

/// Measured against predicted phasors, with everything that `compare` says about them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    pub readings: usize,
    /// Measured components: two for each probe of each reading that was not lost.
    pub values: usize,
    pub residual_um: Residual,
    /// Σ|residual| over Σ|measured component|.
    pub residual_ratio: f64,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²).
    pub relative_error: f64,
    /// χ² per measured component; the noise alone gives 1.
    pub chi2_per_value: f64,
    /// Measured components less the parameters that were fitted to them.
    pub degrees_of_freedom: usize,
    /// Chance that noise alone makes a χ² this large; 1 where no degree of freedom is left.
    pub chi2_p_value: f64,
    /// Structure of the residual over speed.
    pub neighbours: Neighbours,
    pub verdict: Adequacy,
    /// Probability that nothing is missing, where that was weighed; an upper bound where it is below one in a million.
    pub nothing_missing: Option<f64>,
    /// Every forward whirl appears backward: probes swapped, or phases with the wrong sign.
    pub reversed: bool,
    /// The value furthest from the model, in standard deviations; `None` if all were lost.
    pub worst: Option<Worst>,
    /// Each probe, in the order of the rotor's file.
    pub by_probe: Vec<ProbeMisfit>,
    /// Each run, in the order of the measurement.
    pub by_run: Vec<RunMisfit>,
    /// Each run's speeds, ascending.
    pub by_speed: Vec<SpeedMisfit>,
    /// Forward and backward whirl at each bearing with two probes.
    pub whirl: Vec<WhirlMisfit>,
    /// Model less measurement in standard deviations, by reading and probe; `None` where lost.
    #[serde(skip)]
    pub standardised: Vec<Vec<Option<Complex<f64>>>>,
}

/// Does the model describe the machine?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Adequacy {
    Adequate,
    /// It does not: physics is missing.
    Misses,
}

/// Σ(|Re| + |Im|) of model less measurement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Residual {
    /// Over all readings, µm.
    pub sum: f64,
    /// Of a reading, µm.
    pub mean: f64,
}

/// Where model and measurement are furthest apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worst {
    pub probe: String,
    pub speed_rpm: f64,
    /// The run, if the measurement names them.
    pub run: Option<String>,
    /// |Y_model − Y|, µm.
    pub error_um: f64,
    /// The same over the standard deviation of a component.
    pub error_sigmas: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProbeMisfit {
    pub probe: String,
    /// Σ(|Re| + |Im|), µm.
    pub residual_um: f64,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²).
    pub relative_error: f64,
    pub chi2_per_value: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunMisfit {
    /// The run; `None` for readings without one.
    pub run: Option<String>,
    pub readings: usize,
    /// Σ(|Re| + |Im|), µm.
    pub residual_um: f64,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²).
    pub relative_error: f64,
    pub chi2_per_value: f64,
}

/// Misfit at one speed of one run, or at neighbouring speeds where there are many.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpeedMisfit {
    /// The run, if the measurement names them.
    pub run: Option<String>,
    /// The speed, or the mean of the gathered speeds, rpm.
    pub speed_rpm: f64,
    pub readings: usize,
    /// Σ(|Re| + |Im|), µm.
    pub residual_um: f64,
    pub chi2_per_value: f64,
}

impl Comparison {
    /// Compares `readings` with `predicted_m`, the model's phasor for every probe of every reading.
    ///
    /// `free_parameters` is how many real parameters were fitted to these readings.
    pub fn new(
        rotor: &Rotor,
        readings: &[Reading],
        predicted_m: &[Vec<Complex<f64>>],
        noise: &Noise,
        free_parameters: usize,
    ) -> Self {
        let values = ComparedValues::new(readings, predicted_m, noise);
        let all = Tally::of(values.0.iter().flatten().flatten());
        let degrees_of_freedom = all.components.saturating_sub(free_parameters);
        let chi2_p_value = upper_tail(all.chi2, degrees_of_freedom);
        let runs = SortedRun::all(readings);
        let standardised = values.standardised();
        let neighbours = Neighbours::new(rotor, &standardised, &runs);
        let fits = chi2_p_value >= SIGNIFICANCE && neighbours.p_value >= SIGNIFICANCE;
        let pairs = probe_pairs(rotor);
        Self {
            readings: readings.len(),
            values: all.components,
            residual_um: Residual {
                sum: all.residual_um,
                mean: all.residual_um / readings.len().max(1) as f64,
            },
            residual_ratio: ratio(all.residual_um, all.features_um),
            relative_error: all.relative_error(),
            chi2_per_value: all.chi2_per_value(),
            degrees_of_freedom,
            chi2_p_value,
            neighbours,
            nothing_missing: None,
            verdict: if fits { Adequacy::Adequate } else { Adequacy::Misses },
            reversed: reversal::reversed(&pairs, &values),
            worst: values.worst(rotor, readings),
            by_probe: values.by_probe(rotor),
            by_run: values.by_run(&runs),
            by_speed: values.by_speed(readings, &runs),
            whirl: pairs.iter().map(|p| WhirlMisfit::new(rotor, p, &values)).collect(),
            standardised,
        }
    }
}

impl Comparison {
    /// The same with the verdict of a diagnosis, which knows that noise can be larger than stated and correlated: a model
    /// misses if it is less probable than [`SURE`] that nothing is missing.
    #[must_use]
    pub fn judged_by(self, nothing_missing: f64) -> Self {
        let verdict = if nothing_missing < SURE { Adequacy::Misses } else { Adequacy::Adequate };
        Self { verdict, nothing_missing: Some(nothing_missing), ..self }
    }
}

/// By reading and probe.
struct ComparedValues(Vec<Vec<Option<ComparedValue>>>);

impl ComparedValues {
    fn new(readings: &[Reading], predicted_m: &[Vec<C>], noise: &Noise) -> Self {
        let value = |(measured, model_m): (&Option<C>, &C)| {
            measured.map(|measured_m| ComparedValue {
                measured_m,
                model_m: *model_m,
                sigma_m: noise.sigma_m(measured_m),
            })
        };
        let row = |(r, p): (&Reading, &Vec<C>)| r.probes.iter().zip(p).map(value).collect();
        Self(readings.iter().zip(predicted_m).map(row).collect())
    }

    fn standardised(&self) -> Vec<Vec<Option<C>>> {
        let row = |row: &Vec<Option<ComparedValue>>| {
            row.iter().map(|v| v.map(|v| v.error_m() / v.sigma_m)).collect()
        };
        self.0.iter().map(row).collect()
    }

    /// All values of these readings.
    fn rows<'a>(&'a self, rows: &'a [usize]) -> impl Iterator<Item = &'a ComparedValue> {
        rows.iter().flat_map(|row| self.0[*row].iter().flatten())
    }

    fn worst(&self, rotor: &Rotor, readings: &[Reading]) -> Option<Worst> {
        let all = self.0.iter().enumerate().flat_map(|(row, values)| {
            values.iter().enumerate().filter_map(move |(probe, v)| v.as_ref().map(|v| (row, probe, v)))
        });
        let sigmas = |v: &ComparedValue| v.error_m().norm() / v.sigma_m;
        all.max_by(|a, b| sigmas(a.2).total_cmp(&sigmas(b.2))).map(|(row, probe, v)| Worst {
            probe: rotor.probe[probe].name.clone(),
            speed_rpm: readings[row].speed_rpm,
            run: readings[row].run.clone(),
            error_um: v.error_m().norm() * 1e6,
            error_sigmas: sigmas(v),
        })
    }

    fn by_probe(&self, rotor: &Rotor) -> Vec<ProbeMisfit> {
        let misfit = |(i, probe): (usize, &crate::machine::drawing::Probe)| {
            let tally = Tally::of(self.0.iter().filter_map(|row| row[i].as_ref()));
            ProbeMisfit {
                probe: probe.name.clone(),
                residual_um: tally.residual_um,
                relative_error: tally.relative_error(),
                chi2_per_value: tally.chi2_per_value(),
            }
        };
        rotor.probe.iter().enumerate().map(misfit).collect()
    }

    fn by_run(&self, runs: &[SortedRun]) -> Vec<RunMisfit> {
        let misfit = |run: &SortedRun| {
            let tally = Tally::of(self.rows(&run.rows));
            RunMisfit {
                run: run.name.clone(),
                readings: run.rows.len(),
                residual_um: tally.residual_um,
                relative_error: tally.relative_error(),
                chi2_per_value: tally.chi2_per_value(),
            }
        };
        runs.iter().map(misfit).collect()
    }

    fn by_speed(&self, readings: &[Reading], runs: &[SortedRun]) -> Vec<SpeedMisfit> {
        let misfit = |run: &SortedRun, rows: &[usize]| {
            let tally = Tally::of(self.rows(rows));
            let speeds = rows.iter().map(|row| readings[*row].speed_rpm);
            SpeedMisfit {
                run: run.name.clone(),
                speed_rpm: speeds.sum::<f64>() / rows.len() as f64,
                readings: rows.len(),
                residual_um: tally.residual_um,
                chi2_per_value: tally.chi2_per_value(),
            }
        };
        let rows_of = |run: &SortedRun| run.rows.len().div_ceil(MOST_SPEEDS);
        runs.iter().flat_map(|run| run.rows.chunks(rows_of(run)).map(|rows| misfit(run, rows))).collect()
    }
}

/// Chance of a χ² at least this large.
pub(crate) fn upper_tail(chi2: f64, degrees_of_freedom: usize) -> f64 {
    ChiSquared::new(degrees_of_freedom as f64).map_or(1.0, |law| law.sf(chi2))
}

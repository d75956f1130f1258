//! Measurements made ready for fitting: what was measured where, how well, and under which known
//! trial weights.

mod differences;
mod repeats;
pub mod sweep;

use nalgebra::Complex;

use super::centreline::{JournalReading, observed};
use crate::effects::Pattern;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::{Reading, run_shares};
use crate::receptance::modal_shaft::Force;
use crate::unbalance::phasor_kg_m;
use sweep::{SweepPlan, SweptRow};

type C = Complex<f64>;

/// Squared amplitudes of the shaft, x and y, m², for each row at every bearing, then at every disk; at a disk that nothing
/// holds they are left at zero.
pub type Amplitudes = Vec<Vec<[f64; 2]>>;

/// One probe's value in one reading.
#[derive(Debug, Clone, Copy)]
pub struct FitValue {
    pub probe: usize,
    pub measured_m: C,
    /// Standard deviation of each component, m.
    pub sigma_m: f64,
    /// Ratio of a force that grows over a run, at this value, to its mean over the row.
    pub growth: f64,
}

/// What was measured in one state of the machine: a reading, or several in turn that repeat it. The response is computed once for all
/// of them.
#[derive(Debug, Clone)]
pub struct FitRow {
    /// Number of the run, in the order in which they come.
    pub run: usize,
    /// Number of its `[[run]]` in the rotor's file, if it lists that run.
    pub listed: Option<usize>,
    /// Readings that it is made of; speed and share of the run are their means.
    pub readings: usize,
    pub speed_rad_s: f64,
    /// How much of its run has passed, 0 to 1: by time where the readings state it, else by their order.
    pub run_share: f64,
    /// Trial weights: position, m, and unbalance, kg·m.
    pub added: Vec<(f64, C)>,
    /// Values that were not lost, reading by reading.
    pub values: Vec<FitValue>,
    /// Where speed changes too fast for a steady response: what the reading is a sum of.
    pub swept: Option<SweptRow>,
}

impl FitValue {
    /// Ratio of a force at this value to its mean over the row.
    pub fn share_of_row(&self, force: Force) -> f64 {
        if force == Force::Pattern(Pattern::GrowingBow) { self.growth } else { 1.0 }
    }
}

impl FitRow {
    /// How much of a pattern acts in this reading.
    pub fn share_of(&self, pattern: Pattern) -> f64 {
        match pattern {
            Pattern::GrowingBow => self.run_share,
            Pattern::RunUnbalance { run, .. } if self.listed != Some(run) => 0.0,
            _ => 1.0,
        }
    }
}

/// All readings that are fitted together.
#[derive(Debug, Clone, Default)]
pub struct Data {
    /// In the order of the file.
    pub rows: Vec<FitRow>,
    /// What gap voltages say about the journals' places.
    pub(super) centreline: Vec<JournalReading>,
    /// Runs that are no steady responses.
    pub(crate) sweeps: Option<SweepPlan>,
}

impl Data {
    /// Readings of a rotor with their noise, each that of a steady speed.
    pub fn new(rotor: &Rotor, noise: &Noise, readings: &[Reading]) -> Self {
        Self::of(rotor, noise, readings, vec![None; readings.len()])
    }

    /// The same where some runs are sweeps; `None` where they cannot be evaluated as such.
    pub fn swept(rotor: &Rotor, noise: &Noise, readings: &[Reading], sweeps: &SweepPlan) -> Option<Self> {
        let data = Self::of(rotor, noise, readings, sweeps.rows(readings)?);
        Some(Self { sweeps: Some(sweeps.clone()), ..data })
    }

    /// Whether some run is a sweep.
    pub fn is_swept(&self) -> bool {
        self.sweeps.is_some()
    }

    /// Other readings of the same runs, with the same runs as sweeps.
    pub fn of_same_runs(&self, rotor: &Rotor, noise: &Noise, readings: &[Reading]) -> Self {
        let swept = self.sweeps.as_ref().and_then(|sweeps| Self::swept(rotor, noise, readings, sweeps));
        swept.unwrap_or_else(|| Self::new(rotor, noise, readings))
    }

    fn of(rotor: &Rotor, noise: &Noise, readings: &[Reading], swept: Vec<Option<SweptRow>>) -> Self {
        let mut runs: Vec<Option<&String>> = Vec::new();
        let singly =
            readings.iter().zip(run_shares(readings)).zip(swept).map(|((reading, run_share), swept)| {
                let name = reading.run.as_ref();
                let known = runs.iter().position(|r| *r == name);
                let number = known.unwrap_or_else(|| {
                    runs.push(name);
                    runs.len() - 1
                });
                let listed = rotor.run.iter().position(|r| Some(&r.name) == name);
                let weights = listed.iter().flat_map(|k| &rotor.run[*k].added_unbalance);
                let value = |(probe, y): (usize, &Option<C>)| {
                    y.map(|y| FitValue { probe, measured_m: y, sigma_m: noise.sigma_m(y), growth: run_share })
                };
                FitRow {
                    run: number,
                    listed,
                    readings: 1,
                    speed_rad_s: reading.speed_rad_s(),
                    run_share,
                    added: weights
                        .map(|a| (a.position_m, phasor_kg_m(a.magnitude_g_mm, a.angle_deg)))
                        .collect(),
                    values: reading.probes.iter().enumerate().filter_map(value).collect(),
                    swept,
                }
            });
        Self { rows: repeats::joined(singly), centreline: observed(rotor, readings), sweeps: None }
    }

    /// These rows alone, each as a part of the run that it was chosen from.
    pub fn part(&self, rows: &[usize]) -> Self {
        Self {
            rows: rows.iter().map(|r| self.rows[*r].clone()).collect(),
            centreline: self.centreline.clone(),
            sweeps: self.sweeps.clone(),
        }
    }

    /// Readings in all.
    pub fn readings(&self) -> usize {
        self.rows.iter().map(|row| row.readings).sum()
    }

    /// Whether there are readings of this `[[run]]`.
    pub fn has_run(&self, listed: usize) -> bool {
        self.rows.iter().any(|row| row.listed == Some(listed))
    }

    /// Complex values in all.
    pub fn count(&self) -> usize {
        self.rows.iter().map(|r| r.values.len()).sum()
    }

    /// Every value, row by row.
    pub fn values(&self) -> impl Iterator<Item = &FitValue> {
        self.rows.iter().flat_map(|r| &r.values)
    }

    /// The series that each value belongs to: its run and its probe.
    pub fn series(&self) -> impl Iterator<Item = (usize, usize)> {
        self.rows.iter().flat_map(|r| r.values.iter().map(|v| (r.run, v.probe)))
    }

    /// The run of each value, and its standard deviation per component, m.
    pub fn runs_and_sigmas(&self) -> Vec<(usize, f64)> {
        self.rows.iter().flat_map(|r| r.values.iter().map(|v| (r.run, v.sigma_m))).collect()
    }

    pub fn fastest_rad_s(&self) -> f64 {
        self.rows.iter().map(|r| r.speed_rad_s).fold(0.0, f64::max)
    }
}

//! What models predict of each run, and how far that is from the measurement in percent of the clearance.

use nalgebra::Complex;

use super::series::RunUp;
use super::{Modal, Startup};
use crate::measurement::Reading;

type C = Complex<f64>;

/// A model's motion along every direction in every reading, m; `None` where it says nothing.
pub type DirectionalMotion = Vec<Vec<Option<C>>>;

impl Startup {
    /// The two-degree model of a direction: the half-power estimate, or what there is.
    pub fn modal(&self, direction: usize) -> Option<Modal> {
        let (_, best) = self.combined[direction].best()?;
        Some(Modal { natural_rad_s: best.natural_rad_s.value, damping_ratio: best.damping_ratio.value })
    }

    /// The two-degree prediction of every reading of these runs, driven by the added mass and by an own
    /// unbalance, kg·m (zero in the paper).
    pub fn two_degree(&self, readings: &[Reading], predictable: &[bool], own_kg_m: C) -> DirectionalMotion {
        let mut motion: DirectionalMotion = vec![vec![None; self.directions.len()]; readings.len()];
        for (run, _) in self.runs.iter().zip(predictable).filter(|(_, known)| **known) {
            for row in &run.rows {
                let speed = readings[*row].speed_rad_s();
                for (d, direction) in self.directions.iter().enumerate() {
                    let eccentricity = direction.felt(run.added_kg_m + own_kg_m) / self.mass_kg;
                    motion[*row][d] = self.modal(d).map(|m| eccentricity * m.per_eccentricity(speed));
                }
            }
        }
        motion
    }

    /// What was measured along every direction, m.
    pub fn measured(&self, readings: &[Reading]) -> DirectionalMotion {
        let along = |r: &Reading| self.directions.iter().map(|d| d.motion_m(&r.probes)).collect();
        readings.iter().map(along).collect()
    }

    /// A model's motion along every direction from what it predicts at every probe.
    pub fn along_directions(&self, probes_m: &[Vec<C>]) -> DirectionalMotion {
        let row = |probes: &Vec<C>| {
            let all: Vec<Option<C>> = probes.iter().copied().map(Some).collect();
            self.directions.iter().map(|d| d.motion_m(&all)).collect()
        };
        probes_m.iter().map(row).collect()
    }

    /// The directions of a bearing.
    pub fn directions_of(&self, bearing: usize) -> Vec<usize> {
        (0..self.directions.len()).filter(|d| self.directions[*d].bearing == bearing).collect()
    }

    /// How far two motions are apart at a bearing: the largest distance between the two centres at the same
    /// moment of a turn, m; along one direction where only one is seen.
    pub fn distance_m(&self, bearing: usize, a: &[Option<C>], b: &[Option<C>]) -> Option<f64> {
        let off: Option<Vec<C>> =
            self.directions_of(bearing).into_iter().map(|d| Some(a[d]? - b[d]?)).collect();
        match off?.as_slice() {
            [x, y] => Some(0.5 * ((x + C::i() * y).norm() + (x - C::i() * y).norm())),
            [along] => Some(along.norm()),
            _ => None,
        }
    }

    /// The distance that the noise of a reading makes at a bearing on its own, m (root mean square).
    pub fn noise_m(&self, bearing: usize, reading: &Reading) -> f64 {
        let of = |d: usize| {
            let motion_m = self.directions[d].motion_m(&reading.probes).unwrap_or_default();
            2.0 * self.noise.sigma_m(motion_m).powi(2)
        };
        self.directions_of(bearing).into_iter().map(of).sum::<f64>().sqrt()
    }

    /// The errors of a model at one speed, for every run and bearing.
    pub fn errors_at(&self, readings: &[Reading], model: &DirectionalMotion, speed_rpm: f64) -> Vec<ErrorAt> {
        let measured = self.measured(readings);
        let mut errors = Vec::new();
        for (r, run) in self.runs.iter().enumerate() {
            let Some(row) = run.nearest(readings, speed_rpm) else { continue };
            for bearing in 0..2 {
                let Some(error_m) = self.distance_m(bearing, &measured[row], &model[row]) else { continue };
                let sizes = |m: &DirectionalMotion| {
                    let size = |d: usize| m[row][d].map_or(0.0, |y| y.norm());
                    self.directions_of(bearing).into_iter().map(size).collect()
                };
                errors.push(ErrorAt {
                    run: r,
                    bearing,
                    row,
                    measured_m: sizes(&measured),
                    predicted_m: sizes(model),
                    error_m,
                    noise_m: self.noise_m(bearing, &readings[row]),
                });
            }
        }
        errors
    }

    /// The largest error of a model over runs and bearings at every speed of the file between two speeds:
    /// speed in rpm, error and the noise there, m.
    pub fn worst_by_speed(
        &self,
        readings: &[Reading],
        model: &DirectionalMotion,
        [from_rpm, to_rpm]: [f64; 2],
    ) -> Vec<[f64; 3]> {
        let measured = self.measured(readings);
        let mut worst: Vec<[f64; 3]> = Vec::new();
        for (row, reading) in readings.iter().enumerate() {
            let speed = reading.speed_rpm;
            if !(from_rpm..=to_rpm).contains(&speed) {
                continue;
            }
            for bearing in 0..2 {
                let Some(error) = self.distance_m(bearing, &measured[row], &model[row]) else { continue };
                let noise = self.noise_m(bearing, reading);
                match worst.iter_mut().find(|w| w[0] == speed) {
                    Some(w) if w[1] < error => (w[1], w[2]) = (error, noise),
                    Some(_) => {}
                    None => worst.push([speed, error, noise]),
                }
            }
        }
        worst.sort_by(|a, b| a[0].total_cmp(&b[0]));
        worst
    }
}

/// How far a model is off in one run at one bearing.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorAt {
    pub run: usize,
    pub bearing: usize,
    pub row: usize,
    /// Measured amplitudes along the bearing's directions, zero to peak, m.
    pub measured_m: Vec<f64>,
    pub predicted_m: Vec<f64>,
    /// Largest distance of the two orbits at the same moment, m.
    pub error_m: f64,
    /// The noise of the reading alone, m.
    pub noise_m: f64,
}

/// Runs that a model can be asked to predict.
pub fn predictable(runs: &[RunUp], unknown_weights: &[String]) -> Vec<bool> {
    runs.iter().map(|r| !unknown_weights.iter().any(|u| u == r.label())).collect()
}

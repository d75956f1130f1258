//! How much of a change of the machine a fit of bearings, unbalance and drawing would leave, to first order.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::shown;
use crate::diagnose::best_fit;
use crate::error::Error;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::{Noise, Rotor};
use crate::machine::tolerance::Deviations;
use crate::measurement::{Reading, SlowRoll};

type C = Complex<f64>;

/// Speeds that are looked at; of more, as many evenly among them.
const MOST_SPEEDS: usize = 60;
/// Steps of the differences: of unbalance relative to the largest, of bearings in their search coordinates, of the drawing in
/// standard deviations.
const UNBALANCE_STEP: f64 = 0.01;
const BEARING_STEP: f64 = 1e-3;
const DRAWING_STEP: f64 = 0.05;
/// Keeps apart what the readings do not, relative.
const RIDGE: f64 = 1e-9;

/// Noise-free readings of a file, and what bearings, unbalance and drawing can change in them.
pub struct Visibility<'a> {
    file: &'a Rotor,
    unbalance_kg_m: &'a [C],
    speeds_rpm: Vec<f64>,
    /// Readings for each one that is looked at.
    repeats: f64,
    base: Vec<C>,
    sigma_m: Vec<f64>,
    changes: DMatrix<f64>,
    normal: Cholesky<f64, Dyn>,
}

/// One thing that a fit can change: the machine and its unbalance after a step of this size, and the standard deviation of
/// what is known of it, infinite for nothing.
struct Step {
    machine: Rotor,
    unbalance_kg_m: Vec<C>,
    size: f64,
    prior_sd: f64,
}

impl<'a> Visibility<'a> {
    /// # Errors
    /// If the machine cannot be simulated.
    pub fn new(
        file: &'a Rotor,
        unbalance_kg_m: &'a [C],
        speeds_rpm: &[f64],
        noise: &Noise,
    ) -> Result<Self, Error> {
        let every = speeds_rpm.len().div_ceil(MOST_SPEEDS);
        let looked_at: Vec<f64> = speeds_rpm.iter().copied().step_by(every).collect();
        let base = rows(file, file, unbalance_kg_m, &looked_at)?;
        let sigma_m: Vec<f64> = base.iter().map(|y| noise.sigma_m(*y)).collect();
        let steps = steps(file, unbalance_kg_m);
        let changed = |step: &Step| {
            let rows = rows(file, &step.machine, &step.unbalance_kg_m, &looked_at)?;
            Ok(whitened(&rows, &base, &sigma_m) / step.size)
        };
        let columns: Result<Vec<DVector<f64>>, Error> = steps.par_iter().map(changed).collect();
        let changes = DMatrix::from_columns(&columns?);
        let repeats = speeds_rpm.len() as f64 / looked_at.len() as f64;
        let mut normal = changes.tr_mul(&changes) * repeats;
        for (k, step) in steps.iter().enumerate() {
            normal[(k, k)] += step.prior_sd.powi(-2) + RIDGE * (normal[(k, k)] + 1.0);
        }
        let normal = normal.cholesky().ok_or_else(|| {
            Error::Unsuitable("the changes that a fit can make of this machine are not finite".into())
        })?;
        Ok(Self { file, unbalance_kg_m, speeds_rpm: looked_at, repeats, base, sigma_m, changes, normal })
    }

    /// Root of the sum of squares that is left of what a machine shows beside the file, and of what the fit must change against
    /// what is known, over the noise; `None` where the machine cannot be simulated.
    pub fn of(&self, machine: &Rotor) -> Option<f64> {
        let rows = rows(self.file, machine, self.unbalance_kg_m, &self.speeds_rpm).ok()?;
        let change = whitened(&rows, &self.base, &self.sigma_m);
        let slope = self.changes.tr_mul(&change) * self.repeats;
        let followed = slope.dot(&self.normal.solve(&slope));
        Some((self.repeats * change.norm_squared() - followed).max(0.0).sqrt())
    }

    /// Root of the sum of squares that a whole fit of the file leaves in readings of a machine, over the noise; infinite where the fit
    /// takes it for another machine, zero where it cannot be fitted.
    pub fn after_fit(&self, machine: &Rotor, noise: &Noise) -> f64 {
        let model = Rotor { noise: Some(*noise), ..self.file.clone() };
        let readings = readings(self.file, machine, self.unbalance_kg_m, &self.speeds_rpm);
        match readings.and_then(|readings| best_fit(&model, &readings)) {
            Ok(fit) => (fit.chi2_per_value * self.repeats * 2.0 * self.base.len() as f64).sqrt(),
            Err(Error::AnotherMachine { .. } | Error::ReversedPhases(_)) => f64::INFINITY,
            Err(_) => 0.0,
        }
    }
}

/// Everything that a fit of the file can change.
fn steps(file: &Rotor, unbalance_kg_m: &[C]) -> Vec<Step> {
    let mut steps = Vec::new();
    let own = || unbalance_kg_m.to_vec();
    let largest = unbalance_kg_m.iter().map(|u| u.norm()).fold(1e-9, f64::max);
    for plane in 0..unbalance_kg_m.len() {
        for direction in [C::new(1.0, 0.0), C::new(0.0, 1.0)] {
            let (mut unbalance_kg_m, size) = (own(), UNBALANCE_STEP * largest);
            unbalance_kg_m[plane] += direction * size;
            steps.push(Step { machine: file.clone(), unbalance_kg_m, size, prior_sd: f64::INFINITY });
        }
    }
    let bearings = Bearings::of(file);
    let stated = bearings.stated();
    for (k, unknown) in bearings.unknowns().iter().enumerate() {
        let (mut machine, mut x) = (file.clone(), stated.clone());
        x[k] += BEARING_STEP;
        bearings.assign(&mut machine, &x);
        let prior_sd = unknown.law.prior_sd;
        steps.push(Step { machine, unbalance_kg_m: own(), size: BEARING_STEP, prior_sd });
    }
    for (kind, sd) in &Deviations::of(file).kinds {
        let mut machine = file.clone();
        kind.change(&mut machine, 1.0 + DRAWING_STEP * sd, DRAWING_STEP * sd);
        steps.push(Step { machine, unbalance_kg_m: own(), size: DRAWING_STEP, prior_sd: 1.0 });
    }
    steps
}

/// What a machine shows without noise, less the slow rolls of the file.
fn readings(
    file: &Rotor,
    machine: &Rotor,
    unbalance_kg_m: &[C],
    speeds_rpm: &[f64],
) -> Result<Vec<Reading>, Error> {
    let readings = shown::noise_free(machine, unbalance_kg_m, speeds_rpm)?;
    SlowRoll::Stated.taken_off(&file.name, readings, file)
}

/// The same value by value, m.
fn rows(file: &Rotor, machine: &Rotor, unbalance_kg_m: &[C], speeds_rpm: &[f64]) -> Result<Vec<C>, Error> {
    let readings = readings(file, machine, unbalance_kg_m, speeds_rpm)?;
    Ok(readings.iter().flat_map(|r| r.probes.iter().flatten().copied()).collect())
}

/// Differences in units of the noise, real and imaginary parts in turn.
fn whitened(rows: &[C], base: &[C], sigma_m: &[f64]) -> DVector<f64> {
    let each = rows.iter().zip(base).zip(sigma_m).map(|((y, base), sigma_m)| (y - base) / *sigma_m);
    DVector::from_iterator(2 * rows.len(), each.flat_map(|d| [d.re, d.im]))
}

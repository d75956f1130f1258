//! Phase I: bearings and unbalance of the first days (Bera et al., Machines 2023, 11, 976).
//!
//! A particle swarm moves over the eight bearing coefficients inside the search range; the unbalance,
//! the other four of the paper's twelve unknowns, enters linearly and is solved for exactly at each
//! particle. Its objective is the summed residual of all readings. A Levenberg–Marquardt fit weighted
//! by the noise then finishes from the swarm's best and from the file's guess, with a weak prior at
//! that guess: three days at one speed leave most of the eight open, and an open coefficient should
//! stay where the drawing put it, not where the swarm happened to stop.
//!
//! The search takes the drawing as exact, whatever its `[tolerance]`: the bearings that come out are the
//! ones that go with the model the controller gets, and that model is made from the drawing. What errors
//! of the drawing do to bearings and unbalance is in their intervals.

use nalgebra::{Complex, DMatrix, DVector};

use super::certainty::ModelUncertainty;
use super::range::Range;
use super::swarm::{self, Swarm};
use crate::compare::{Adequacy, Comparison};
use crate::diagnose::sweep::{self, Sweep};
use crate::error::Error;
use crate::fit::bearings::BearingParameter;
use crate::fit::data::Data;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::trial::summed_residual_um;
use crate::fit::within::Bounds;
use crate::fit::{Effort, Fit, Fitter};
use crate::machine::drawing::{Noise, Rotor, SearchBounds, Tolerance};
use crate::measurement::{Reading, by_reading};
use crate::unbalance::g_mm_deg;

#[derive(Debug, Clone, Copy)]
pub struct PhaseOneConfig {
    pub particles: usize,
    pub iterations: u64,
    pub seed: u64,
    /// Search range; the rotor's `[identify]`, or 2.5 times either way around its guess, if absent.
    pub bounds: Option<SearchBounds>,
}

impl Default for PhaseOneConfig {
    fn default() -> Self {
        Self { particles: 40, iterations: 40, seed: 1, bounds: None }
    }
}

#[derive(Debug, Clone)]
pub struct PhaseOne {
    /// The rotor with its identified bearings and planes.
    pub rotor: Rotor,
    /// What the bearings' laws leave to the data: stiffness, then damping, then the rest.
    pub bearings: Vec<BearingParameter>,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: DVector<Complex<f64>>,
    /// Standard deviation of each plane's unbalance, relative to its magnitude, with the bearings open and the drawing within its tolerance.
    pub unbalance_relative_sd: Vec<f64>,
    /// Covariance of the bearings' search coordinates, then of real and imaginary parts of each plane's unbalance, kg·m, by the noise alone:
    /// of what goes with this drawing.
    pub covariance: DMatrix<f64>,
    /// Change of the same numbers by one standard deviation of each error of the drawing, one error a column in the order of
    /// [`crate::machine::tolerance::Deviations`].
    pub shifts_by_drawing: DMatrix<f64>,
    /// Whether noise explains what the identified rotor leaves of the readings, so that the intervals hold.
    pub model_fits: bool,
    /// Σ|f_model − f_measured| over all readings, µm.
    pub residual_um: f64,
    /// `residual_um` over Σ|f_measured|.
    pub residual_ratio: f64,
    /// χ² per measured component, noise-weighted.
    pub chi2_per_value: f64,
    /// Summed residual where the swarm ended, µm.
    pub swarm_residual_um: f64,
    /// What was assumed, and what is odd in the data, one sentence each.
    pub remarks: Vec<String>,
}

impl PhaseOne {
    /// Covariance of the bearings' search coordinates that go with this drawing.
    pub fn bearings_covariance(&self) -> DMatrix<f64> {
        let count = self.bearings.len();
        self.covariance.view((0, 0), (count, count)).into_owned()
    }

    /// How far a model with these bearings can be off.
    pub fn model_uncertainty(&self) -> ModelUncertainty {
        let shifts_by_drawing = self.shifts_by_drawing.rows(0, self.bearings.len()).into_owned();
        ModelUncertainty { bearings: self.bearings_covariance(), shifts_by_drawing }
    }

    /// Standard deviation of what the drawing's errors do to each plane's unbalance, relative to its magnitude: of both components together.
    pub fn unbalance_errors_by_drawing(&self) -> Vec<f64> {
        let first = self.bearings.len();
        let relative = |(plane, u): (usize, &Complex<f64>)| {
            self.shifts_by_drawing.rows(first + 2 * plane, 2).norm() / u.norm().max(f64::MIN_POSITIVE)
        };
        self.unbalance_kg_m.iter().enumerate().map(relative).collect()
    }

    /// Covariance of real and imaginary parts of the planes' unbalance, kg·m, with the bearings open and the drawing within its tolerance.
    pub fn unbalance_covariance(&self) -> DMatrix<f64> {
        let (first, count) = (self.bearings.len(), 2 * self.unbalance_kg_m.len());
        let shifts = self.shifts_by_drawing.rows(first, count);
        self.covariance.view((first, first), (count, count)) + shifts * shifts.transpose()
    }
}

/// Readings of some days and of a run-up in one state of the machine, for [`identify`]: the run-up is a run of its own, also where neither
/// names one.
pub fn beside_runup<'a>(
    rotor: &Rotor,
    days: impl IntoIterator<Item = &'a Reading>,
    runup: &[Reading],
) -> Vec<Reading> {
    let mut name = "run-up".to_string();
    // a run of the file has weights of its own
    while rotor.run.iter().any(|run| run.name == name) {
        name.push('\'');
    }
    let own = |r: &Reading| Reading { run: r.run.clone().or_else(|| Some(name.clone())), ..r.clone() };
    days.into_iter().cloned().chain(runup.iter().map(own)).collect()
}

/// Identifies bearings and unbalance from readings of one machine in one state. Days in a row are not one state where
/// bearings wander: what comes out is then some mean of theirs, and its covariance knows nothing of the wander. A run that
/// changes speed too fast for a steady response is fitted as a transient, by the times of its readings.
///
/// # Errors
/// If there are too few values, or the machine is singular on every trial.
pub fn identify(rotor: &Rotor, readings: &[Reading], config: &PhaseOneConfig) -> Result<PhaseOne, Error> {
    rotor.validate()?;
    let noise = Noise::of(rotor, readings);
    let steady = Fitter::new(rotor, Data::new(rotor, &noise, readings));
    let mut found = identified(&steady, readings, &noise, config)?;
    let mut sweep = Sweep::of(&found.rotor, readings, &noise);
    let mut swept = None;
    if sweep.is_some() {
        swept = sweep::transients(&steady, readings, &noise)?;
    }
    if let Some(data) = &swept {
        found = identified(&steady.on(data.clone()), readings, &noise, config)?;
        sweep = Sweep::of(&found.rotor, readings, &noise);
    }
    found.remarks.extend(noise.assumption(rotor));
    found.remarks.extend(Tolerance::assumption(rotor));
    found.remarks.extend(sweep::remark(swept.as_ref().unwrap_or(&steady.data), readings, sweep.as_ref()));
    Ok(found)
}

/// The same by these data of the readings, with no remarks yet.
fn identified(
    fitter: &Fitter,
    readings: &[Reading],
    noise: &Noise,
    config: &PhaseOneConfig,
) -> Result<PhaseOne, Error> {
    let rotor = fitter.rotor;
    let (count, planes) = (fitter.data.count(), rotor.plane.len());
    if count < planes {
        return Err(Error::TooFewValuesForPlanes { values: count, planes });
    }
    let hypothesis = Hypothesis::drawn(rotor, fitter.scales(None));
    let drawing = fitter.exact_drawing();
    let guess = hypothesis.bearings.stated();
    let range = Range::new(&hypothesis.bearings, config.bounds.or(rotor.identify).as_ref());

    let trial = fitter.trial(&hypothesis, &drawing, None)?;
    let swarm = Swarm { particles: config.particles, iterations: config.iterations, seed: config.seed };
    let (found, swarm_residual_um) = swarm::search(&trial, &range, swarm)?;
    let starts = [found, range.clamped(&guess)];
    let free = fitter.fit(&hypothesis, &starts, &drawing, Effort::Final, Some(&fitter.still()))?;
    let fit = if range.clamped(&free.x) == free.x {
        free
    } else {
        // what a bound keeps a coefficient from doing, the others do for it as well as they can
        let bounds = Bounds { low: &range.low, high: &range.high };
        fitter.trial(&hypothesis, &drawing, Some(&free.amplitudes))?.fit_within(&free.x, bounds)?
    };
    let at_bound = |i: usize| fit.x[i] <= range.low[i] || fit.x[i] >= range.high[i];
    let covariance =
        fit.covariance.as_ref().ok_or(Error::SingularMachine { tried: "on the identified bearings" })?;
    let shifts_by_drawing = fitter.shifts_by_drawing(&hypothesis, &fit, &drawing)?;
    let with_drawing = covariance + &shifts_by_drawing * shifts_by_drawing.transpose();

    let mut identified = rotor.clone();
    hypothesis.bearings.assign(&mut identified, &fit.x);
    for (plane, u) in identified.plane.iter_mut().zip(&fit.unknowns) {
        let [magnitude, angle] = g_mm_deg(*u);
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(magnitude), Some(angle));
    }
    let residual_um = summed_residual_um(&fitter.data, &fit.predicted_m);
    let free_parameters = fit.x.len() + 2 * fit.unknowns.len();
    let predicted_m = by_reading(readings, &fit.predicted_m);
    let compared = Comparison::new(rotor, readings, &predicted_m, noise, free_parameters);
    let silence = vec![Complex::from(0.0); count];
    Ok(PhaseOne {
        rotor: identified,
        bearings: BearingParameter::all(rotor, &hypothesis.bearings, &fit.x, Some(&with_drawing), at_bound),
        unbalance_kg_m: DVector::from_column_slice(&fit.unknowns[..planes]),
        unbalance_relative_sd: unbalance_relative_sd(&fit, &with_drawing, planes),
        covariance: covariance.clone(),
        shifts_by_drawing,
        model_fits: compared.verdict == Adequacy::Adequate,
        residual_um,
        residual_ratio: residual_um / summed_residual_um(&fitter.data, &silence),
        chi2_per_value: fit.chi2_per_value(),
        swarm_residual_um,
        remarks: Vec::new(),
    })
}

/// Standard deviation of each plane's unbalance relative to its magnitude, of both components together;
/// the covariance has real and imaginary parts of the linear unknowns after the search coordinates.
fn unbalance_relative_sd(fit: &Fit, covariance: &DMatrix<f64>, planes: usize) -> Vec<f64> {
    let variance = |j: usize| {
        let at = fit.x.len() + 2 * j;
        covariance[(at, at)] + covariance[(at + 1, at + 1)]
    };
    let sizes = fit.unknowns.iter().take(planes).map(|u| u.norm().max(f64::MIN_POSITIVE));
    sizes.enumerate().map(|(j, size)| variance(j).sqrt() / size).collect()
}

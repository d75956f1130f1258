//! What a model leaves of the readings.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::Result;
use nalgebra::Complex;
use rotor_edge::answers::diagnose::DiagnosisAnswer;
use rotor_edge::command::fitted::Fitted;
use rotor_edge::render::{ComparedModel, Prediction, noise_error};
use rotor_edge_desktop::compare::Comparison;
use rotor_edge_desktop::diagnose::{best_fit, diagnose_telling, fit_holding};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::simulate::predicted;

use super::mask::{Mask, with_probes_of};
use super::parameters::ParameterId;
use super::{FittedTo, Session};

/// What tells a model with its readings from others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelKey {
    /// Number of the session: another one can have the same file with other readings.
    pub session: u64,
    pub file: String,
    pub held: Vec<ParameterId>,
    pub mask: Mask,
}

impl Eq for Mask {}

/// A model at its best fit.
pub struct Analysis {
    pub fit: Fitted,
    /// With its predictions of all readings, those that were left out among them.
    pub whole: ComparedModel,
    /// Error that noise alone leaves.
    pub noise_error: f64,
    /// Of the readings that were left out.
    pub left_out: Option<LeftOut>,
    /// What the file of the model as fitted predicts for all readings, m; `None` where it cannot be evaluated.
    file_m: Option<Vec<Vec<Complex<f64>>>>,
}

/// How well a model predicts readings that it was not fitted to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    pub readings: usize,
    pub error: f64,
    pub noise_error: f64,
    pub chi2_per_value: f64,
    /// How far the model's file is from its fit in the readings that it was fitted to, relative to them: a fit takes the errors of the
    /// drawing as linear, a file has them built in.
    pub file_gap: f64,
}

impl Analysis {
    /// Fits a model to its readings.
    ///
    /// # Errors
    /// If it cannot be fitted.
    pub fn of(label: &str, session: &Session, model: &FittedTo) -> Result<Self> {
        let held: Vec<_> = model.held.iter().filter_map(ParameterId::held).collect();
        let best = match held.is_empty() {
            true => best_fit(&model.rotor, &model.readings)?,
            false => fit_holding(&model.rotor, &model.readings, &held)?,
        };
        let fit = Fitted::of(label, &model.rotor, &model.readings, best);
        let noise_error = noise_error(&fit.model, &model.readings);
        let all = with_probes_of(&fit.best.rotor, &session.given)?;
        let file_m = predicted(&all, &session.readings).ok().map(|found| found.predicted_m);
        if session.mask.is_empty() {
            return Ok(Self { whole: fit.model.clone(), fit, noise_error, left_out: None, file_m });
        }
        let whole = compared(label, &all, &session.readings, &fit)?;
        let left = session.mask.left_out(&session.given, &session.readings);
        let kept = &model.readings;
        let left_out = (!left.is_empty()).then(|| -> Result<LeftOut> {
            let model = compared(label, &all, &left, &fit)?;
            Ok(LeftOut {
                readings: left.len(),
                error: model.comparison.relative_error,
                noise_error: rotor_edge::render::noise_error(&model, &left),
                chi2_per_value: model.comparison.chi2_per_value,
                file_gap: file_gap(&fit, kept)?,
            })
        });
        Ok(Self { whole, fit, noise_error, left_out: left_out.transpose()?, file_m })
    }
}

/// How far a model's file is from its fit, relative to the readings that it was fitted to.
fn file_gap(fit: &Fitted, readings: &[Reading]) -> Result<f64> {
    let file = predicted(&fit.best.rotor, readings)?.predicted_m;
    let (mut apart, mut all) = (0.0, 0.0);
    for ((file, fitted), reading) in file.iter().zip(&fit.best.predicted_m).zip(readings) {
        for ((file, fitted), y) in file.iter().zip(fitted).zip(&reading.probes) {
            let Some(y) = y else { continue };
            apart += (file - fitted).norm_sqr();
            all += y.norm_sqr();
        }
    }
    Ok((apart / all.max(f64::MIN_POSITIVE)).sqrt())
}

/// A file's model beside readings, in the noise that a fit goes by.
fn compared(label: &str, file: &Rotor, readings: &[Reading], fit: &Fitted) -> Result<ComparedModel> {
    let predicted_m = predicted(file, readings)?.predicted_m;
    let comparison = Comparison::new(file, readings, &predicted_m, &fit.best.noise, 0);
    Ok(ComparedModel { prediction: Prediction { label: label.into(), predicted_m }, comparison })
}

/// A model with numbers that were moved by hand, and the evaluations that it took: the curves of the fit, changed by what the file
/// changes, so that they begin where the fit ends.
///
/// # Errors
/// If the machine is singular with them.
pub fn moved(session: &Session, rotor: &Rotor, from: &Analysis) -> Result<(ComparedModel, usize)> {
    let all = with_probes_of(rotor, &session.given)?;
    let mut found = predicted(&all, &session.readings)?;
    if let Some(file_m) = &from.file_m {
        for (row, (whole, file)) in
            found.predicted_m.iter_mut().zip(from.whole.prediction.predicted_m.iter().zip(file_m))
        {
            row.iter_mut().zip(whole.iter().zip(file)).for_each(|(y, (whole, file))| *y += whole - file);
        }
    }
    let noise = &from.fit.best.noise;
    let comparison = Comparison::new(&all, &session.readings, &found.predicted_m, noise, 0);
    let prediction = Prediction { label: "moved by hand".into(), predicted_m: found.predicted_m };
    Ok((ComparedModel { prediction, comparison }, found.evaluations))
}

/// How far a diagnosis is.
#[derive(Debug, Default)]
pub struct SearchProgress {
    done: AtomicUsize,
    planned: AtomicUsize,
}

impl SearchProgress {
    pub fn tell(&self, done: usize, planned: usize) {
        self.done.fetch_max(done, Ordering::Relaxed);
        self.planned.fetch_max(planned, Ordering::Relaxed);
    }

    /// Done and planned.
    pub fn now(&self) -> [usize; 2] {
        [self.done.load(Ordering::Relaxed), self.planned.load(Ordering::Relaxed)]
    }
}

/// What is known of a model's missing effect.
#[derive(Debug, Clone)]
pub enum DiagnosisState {
    Running(Arc<SearchProgress>),
    Found(Arc<DiagnosisAnswer>),
    Failed(String),
}

/// Diagnoses a model, as `diagnose` does.
///
/// # Errors
/// As the command.
pub fn diagnosed(model: &FittedTo, progress: &SearchProgress) -> Result<DiagnosisAnswer> {
    let tell = |done, planned| progress.tell(done, planned);
    Ok(DiagnosisAnswer::from(&diagnose_telling(&model.rotor, &model.readings, &tell)?))
}

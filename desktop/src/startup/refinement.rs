//! The same start-up through this project's own chain: the rotor model fitted, diagnosed, improved.

use nalgebra::Complex;
use rayon::prelude::*;

use super::two_degree::DirectionalMotion;
use super::{Options, Startup, two_degree};
use crate::diagnose::{Candidate, ImprovementOutcome, best_fit, improve_telling};
use crate::error::{Error, StartupError};
use crate::fit::progress::ProgressListener;
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;

type C = Complex<f64>;

/// A model on the way from the simple one to the one that fits.
#[derive(Debug, Clone)]
pub struct ModelStage {
    /// What it is, or which effect was added.
    pub label: String,
    /// What it predicts along every direction.
    pub motion: DirectionalMotion,
    /// χ² per real number, of rotor models.
    pub chi2_per_value: Option<f64>,
}

#[derive(Debug, Clone)]
pub struct ModelRefinement {
    /// From the simple model to the last.
    pub stages: Vec<ModelStage>,
    /// What `improve` made of it.
    pub outcome: ImprovementOutcome,
    /// Unbalance of each plane of the last model and the standard deviation of its components, kg·m.
    pub unbalance_kg_m: Vec<(C, f64)>,
}

impl ModelRefinement {
    /// The candidate shaft bow, if it was looked at and not added: an own unbalance pulls with Ω², a bow
    /// with the same force at every speed, so a start-up tells them apart.
    pub fn bow(&self) -> Option<&Candidate> {
        self.outcome.candidates.iter().find(|c| c.effect == "shaft_bow")
    }
}

/// The stages that need no rotor model: the two-degree model, alone and with the disk's own unbalance.
pub fn simple_stages(found: &Startup, readings: &[Reading], options: &Options) -> Vec<ModelStage> {
    let known = two_degree::predictable(&found.runs, &options.unknown_weights);
    let stage = |label: &str, own: C| ModelStage {
        label: label.into(),
        motion: found.two_degree(readings, &known, own),
        chi2_per_value: None,
    };
    let mut stages = vec![stage("two-degree model, added mass alone", C::from(0.0))];
    if let Some(own) = &found.own_kg_m {
        stages.push(stage("two-degree model with own unbalance", own.unbalance_kg_m));
    }
    stages
}

/// Fits and improves the rotor model on the runs whose weights are known; `told` hears how far the search is, `progress` of each
/// effect.
///
/// # Errors
/// As [`improve`](crate::diagnose::improve), or if no run is left.
pub fn refine(
    rotor: &Rotor,
    readings: &[Reading],
    found: &Startup,
    options: &Options,
    told: ProgressListener,
    mut progress: impl FnMut(&str),
) -> Result<ModelRefinement, Error> {
    let unknown = |r: &Reading| r.run.as_ref().is_some_and(|run| options.unknown_weights.contains(run));
    let usable: Vec<usize> = (0..readings.len()).filter(|i| !unknown(&readings[*i])).collect();
    let kept: Vec<Reading> = usable.iter().map(|i| readings[*i].clone()).collect();
    if kept.is_empty() {
        return Err(StartupError::NoKnownWeights.into());
    }
    let fitted = |(rotor, label): (&Rotor, String)| -> Result<(ModelStage, Vec<(C, f64)>), Error> {
        let fit = best_fit(rotor, &kept)?;
        let mut motion: DirectionalMotion = vec![vec![None; found.directions.len()]; readings.len()];
        for (row, along) in usable.iter().zip(found.along_directions(&fit.predicted_m)) {
            motion[*row] = along;
        }
        let sd = |plane: usize| {
            let variance = |i: usize| fit.unbalance_covariance[(2 * plane + i, 2 * plane + i)];
            variance(0).max(variance(1)).max(0.0).sqrt()
        };
        let planes = fit.unbalance_kg_m.iter().enumerate().map(|(i, u)| (*u, sd(i))).collect();
        Ok((ModelStage { label, motion, chi2_per_value: Some(fit.chi2_per_value) }, planes))
    };
    let outcome = improve_telling(rotor, &kept, told, |step| progress(&step.added.label()))?;
    let mut rotors = vec![(rotor, "rotor model, bearings and own unbalance fitted".to_string())];
    rotors.extend(outcome.steps.iter().map(|step| (&step.rotor, format!("+ {}", step.added.label()))));
    if let [_, .., last] = &mut rotors[..] {
        last.0 = &outcome.rotor;
    }
    let fitted: Vec<_> = rotors.into_par_iter().map(fitted).collect::<Result<_, Error>>()?;
    let (of_rotor_models, mut unbalances): (Vec<ModelStage>, Vec<Vec<(C, f64)>>) = fitted.into_iter().unzip();
    let mut stages = simple_stages(found, readings, options);
    stages.extend(of_rotor_models);
    let unbalance_kg_m = unbalances.pop().unwrap_or_default();
    Ok(ModelRefinement { stages, outcome, unbalance_kg_m })
}

//! Adding effects to a model: one on request, or one after another until it is adequate.

use rayon::prelude::*;

use super::answer::{Candidate, DiagnosisVerdict, SURE, SuspectedMistake};
use super::as_file::as_file;
use super::base::{BaseModel, CandidateFit, explains, same};
use super::diagnosis::{
    DiagnosisRun, ModelComparison, diagnose, examine, remarks_before, unexplained_transient,
};
use super::planes::PlaneUnbalances;
use super::runs::{RefutedRun, RunChange};
use super::sets::{EffectSet, SearchReach, SetComparison, together};
use super::sweep::{self, fitted};
use super::unknown::UnknownCause;
use super::{checks, parameters, runs};
use crate::effects::entry;
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::bearings::BearingParameter;
use crate::fit::data::Data;
use crate::fit::dimensions::FittedDimension;
use crate::fit::hypothesis::PlacedEffect;
use crate::fit::progress::ProgressListener;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;
use crate::statistics::scatter::Scatter;

/// How far to look for several effects: no machine hides more than four, and each needs data of its own.
const REACH: SearchReach = SearchReach { width: 8, effects: 4 };

/// A model with an effect more.
#[derive(Debug, Clone)]
pub struct Improvement {
    /// The new file: bearings, planes and effects as fitted.
    pub rotor: Rotor,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) before.
    pub error_before: f64,
    pub error_after: f64,
    /// χ² per measured real number before and after.
    pub chi2_per_value: [f64; 2],
    /// The effect that was added.
    pub added: Candidate,
    /// The bearings as fitted together with it.
    pub bearings: Vec<BearingParameter>,
    /// The drawing as fitted together with it.
    pub dimensions: Vec<FittedDimension>,
}

#[derive(Debug, Clone)]
pub struct ImprovementStep {
    /// The effect that was added, its parameters as fitted together with all the others.
    pub added: Candidate,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) with it.
    pub error_after: f64,
    /// χ² per measured real number with it.
    pub chi2_per_value: f64,
    /// Sets of effects that explain the data as well as all that were added, this set included.
    pub group: Vec<String>,
    /// The file with this and all earlier additions.
    pub rotor: Rotor,
}

/// Fits one named effect together with bearings, planes and the effects that the file has, and returns
/// the file with all of them.
///
/// # Errors
/// If there is no such effect or place, the effect is present already, or it cannot be fitted.
pub fn add(rotor: &Rotor, readings: &[Reading], kind: &str, at: Option<&str>) -> Result<Improvement, Error> {
    let (effect, place) = entry::resolve(rotor, kind, at).map_err(Error::UnknownEffect)?;
    let placed = PlacedEffect { effect, place };
    let (file, rotor) = (rotor, &rotor.as_stated());
    let noise = Noise::of(rotor, readings);
    let steady = Fitter::new(rotor, Data::new(rotor, &noise, readings)).beginning_at(file).knowing(place);
    checks::not_too_many(readings)?;
    checks::before(rotor, readings)?;
    checks::enough(&steady)?;
    sweep::fitted_with(&steady, readings, &noise, |base| {
        checks::not_reversed(base, rotor, readings, &noise)?;
        added(base, placed)
    })
}

/// A model with an effect more, fitted together with it, and the effect.
fn added(base: &BaseModel, placed: PlacedEffect) -> Result<(Improvement, CandidateFit), Error> {
    let PlacedEffect { effect, .. } = placed;
    let (fitter, rotor) = (base.fitter, base.fitter.rotor);
    let present = base.hypothesis.effects.iter().any(|e| same(e, &placed));
    if let Some(why) = present.then_some("is already in the model").or(effect.not_sought(rotor)) {
        return Err(Error::EffectNotAddable { effect: placed.label(rotor), why: why.into() });
    }
    let (tried, explained) = base.as_shown(base.refined_attempt(placed)?)?;
    checks::this_machine(rotor, base.relative_error(&tried.fit).min(base.relative_error(base.closest())))?;
    let with = base.hypothesis.with(placed);
    let dimensions = match &tried.fit.covariance {
        Some(known) => fitter.dimensions(&with, &tried.fit, tried.drawing(base), known)?,
        None => Vec::new(),
    };
    let improvement = Improvement {
        dimensions,
        rotor: fitter.corrected(as_file(&with, &tried.fit), &tried.fit, tried.drawing(base)),
        error_before: base.relative_error(base.shown().0),
        error_after: base.relative_error(&tried.fit),
        chi2_per_value: [base.closest().chi2_per_value(), tried.fit.chi2_per_value()],
        bearings: base.bearings(&tried.fit, tried.fit.covariance.as_ref()),
        added: base.candidate(&tried, f64::NAN, explained),
    };
    Ok((improvement, tried))
}

#[derive(Debug, Clone)]
pub struct ImprovementOutcome {
    pub rotor: Rotor,
    /// Effects in the order in which they were found.
    pub steps: Vec<ImprovementStep>,
    pub verdict: DiagnosisVerdict,
    /// The reason for the verdict, in one sentence.
    pub summary: String,
    /// Candidates of the first diagnosis, most probable first.
    pub candidates_before: Vec<Candidate>,
    /// Candidates of the last diagnosis that were not added, most probable first.
    pub candidates: Vec<Candidate>,
    /// Probability that nothing is missing, by the first diagnosis and by the last.
    pub nothing_missing: [f64; 2],
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) of the model at the start.
    pub error_before: f64,
    /// χ² per measured real number of the model at the start.
    pub chi2_per_value_before: f64,
    /// Residual noise of the new model relative to the stated noise.
    pub scatter: Scatter,
    /// Unbalances of the planes of the new model.
    pub determined: PlaneUnbalances,
    /// Its bearings as fitted.
    pub bearings: Vec<BearingParameter>,
    /// Its drawing as fitted.
    pub dimensions: Vec<FittedDimension>,
    /// Nature of a cause outside the list, where one is probable.
    pub unknown: Option<UnknownCause>,
    /// The mistake in the files that explains the misfit better than any effect; no effect is added then.
    pub mistake: Option<SuspectedMistake>,
    /// Runs whose stated weights are not true, by the effects that were added.
    pub refuted: Vec<RefutedRun>,
    /// Differences of single runs by the added effects, one sentence each.
    pub remarks: Vec<String>,
}

/// Fits bearings and planes and adds effects until the model is adequate, or nothing that is left explains
/// more than noise. Where rivals cannot be told apart the best of them is added: they predict this machine alike.
///
/// As long as no single effect is enough, the best few sets are followed side by side, and the one that explains most
/// is kept; `progress` hears of each effect of that set. Where an unknown cause explains the data better than
/// any set of effects that physics allows, none is added.
///
/// # Errors
/// As [`super::diagnose`].
pub fn improve(
    rotor: &Rotor,
    readings: &[Reading],
    progress: impl FnMut(&ImprovementStep),
) -> Result<ImprovementOutcome, Error> {
    improve_telling(rotor, readings, &|_, _| (), progress)
}

/// The same for somebody who waits: `told` hears how many fits are done, of how many that are planned so far.
///
/// # Errors
/// As [`improve`].
pub fn improve_telling(
    rotor: &Rotor,
    readings: &[Reading],
    told: ProgressListener,
    progress: impl FnMut(&ImprovementStep),
) -> Result<ImprovementOutcome, Error> {
    let stated = rotor.as_stated();
    let noise = Noise::of(&stated, readings);
    let at_first = remarks_before(&stated, readings, noise)?;
    let steady = Fitter::new(&stated, Data::new(&stated, &noise, readings)).beginning_at(rotor).telling(told);
    fitted(&steady, readings, &noise, |base| {
        improved(rotor, examine(base, readings, noise, at_first, REACH)?, readings, progress)
    })
}

/// A machine's file with effects added after its diagnosis.
fn improved(
    rotor: &Rotor,
    run: DiagnosisRun,
    readings: &[Reading],
    progress: impl FnMut(&ImprovementStep),
) -> Result<ImprovementOutcome, Error> {
    let DiagnosisRun { diagnosis: at_start, base: start, weighed, sets } = run;
    let fitter = start.fitter;
    let mut outcome = ImprovementOutcome {
        rotor: rotor.clone(),
        steps: Vec::new(),
        verdict: at_start.verdict,
        summary: at_start.summary.clone(),
        candidates_before: at_start.candidates.clone(),
        candidates: at_start.candidates,
        nothing_missing: [at_start.nothing_missing; 2],
        error_before: at_start.error_before,
        chi2_per_value_before: at_start.chi2_per_value,
        scatter: at_start.scatter,
        determined: at_start.determined,
        bearings: at_start.bearings,
        dimensions: at_start.dimensions,
        unknown: at_start.unknown,
        mistake: at_start.mistake,
        refuted: Vec::new(),
        remarks: Vec::new(),
    };
    let Some(ModelComparison { tried, unknown, .. }) = weighed else { return Ok(outcome) };
    let nothing_known =
        matches!(at_start.verdict, DiagnosisVerdict::Adequate | DiagnosisVerdict::NotDetermined);
    if nothing_known
        || at_start.too_fast.is_some()
        || outcome.mistake.is_some()
        || at_start.nothing_missing >= SURE
    {
        outcome.rotor = start.written();
        return Ok(outcome);
    }
    let together = sets.map_or_else(|| together(&start, &tried, &unknown, REACH), Ok)?;
    let outside = together.outside(1.0 - at_start.nothing_missing);
    let SetComparison { set, unknown_odds } = together;
    let Some(EffectSet { base: mut best, rivals, .. }) = set.filter(|_| unknown_odds < 1.0) else {
        outcome.rotor = start.written();
        if fitter.data.is_swept() {
            (outcome.verdict, outcome.summary) = unexplained_transient();
        } else if outcome.verdict != DiagnosisVerdict::Unknown {
            // the first look, which follows one set alone, found one that this wider one does not stand by
            outcome.verdict = DiagnosisVerdict::Unknown;
            outcome.summary = "An effect is missing. No physically possible set of known effects explains the data better than \
                               an unknown cause."
                .into();
            outcome.unknown = Some(unknown.cause(fitter, outside));
        }
        return Ok(outcome);
    };
    best.fit.covariance = fitter.covariance(&best.hypothesis, &best.fit, &best.drawing)?;
    let changes = RunChange::beyond(&start, &best.hypothesis, &best.fit);
    outcome.steps = in_order(start, tried, &best, rivals, progress)?;
    outcome.rotor = fitter.corrected(as_file(&best.hypothesis, &best.fit), &best.fit, &best.drawing);
    let now = diagnose(&outcome.rotor, readings)?;
    (outcome.verdict, outcome.summary, outcome.candidates) = (now.verdict, now.summary, now.candidates);
    (outcome.scatter, outcome.determined, outcome.unknown) = (now.scatter, now.determined, now.unknown);
    (outcome.bearings, outcome.dimensions) = (now.bearings, now.dimensions);
    outcome.nothing_missing[1] = now.nothing_missing;
    // the effects of the set together against something that no effect is
    let probability = 1.0 / (1.0 + unknown_odds);
    (outcome.refuted, outcome.remarks) = runs::told(&changes, probability, outcome.verdict.model_fits());
    outcome.steps.iter_mut().for_each(|step| step.added.model_fits = outcome.verdict.model_fits());
    Ok(outcome)
}

/// The effects of a set one after another from the model at the start, the one that explains most first; `tried` are those beside
/// that model, `rivals` the sets that the data cannot tell from this one. `progress` hears of each as soon as it is known.
fn in_order<'a>(
    start: BaseModel<'a>,
    tried: Vec<CandidateFit>,
    best: &BaseModel<'a>,
    rivals: Vec<String>,
    mut progress: impl FnMut(&ImprovementStep),
) -> Result<Vec<ImprovementStep>, Error> {
    let joint = parameters::of_each(&best.hypothesis, &best.fit);
    let mut left: Vec<usize> = (start.stated..best.hypothesis.effects.len()).collect();
    let (mut base, mut tried) = (start, tried);
    let mut steps = Vec::new();
    loop {
        let placed = |index: usize| best.hypothesis.effects[index];
        let chi2 = |t: &CandidateFit| t.shown().stated_chi2;
        // those that were tried beside the model at the start are compared by that
        let of_tried = |index: &usize| {
            let k = tried.iter().position(|t| same(&t.placed, &placed(*index)))?;
            Some((*index, k, chi2(&tried[k])))
        };
        let most = left.iter().filter_map(of_tried).min_by(|a, b| a.2.total_cmp(&b.2));
        let (index, t) = match most {
            Some((index, k, _)) if tried[k].is_settled => (index, tried.swap_remove(k)),
            Some((index, ..)) => (index, base.refined_attempt(placed(index))?),
            None => {
                let fitted = |index: &usize| Ok((*index, base.refined_attempt(placed(*index))?));
                let all: Vec<(usize, CandidateFit)> =
                    left.par_iter().map(fitted).collect::<Result<_, Error>>()?;
                let most = all.into_iter().min_by(|(_, a), (_, b)| chi2(a).total_cmp(&chi2(b)));
                most.ok_or_else(|| Error::Unsuitable("there is no effect to add".into()))?
            }
        };
        left.retain(|i| *i != index);
        let last = left.is_empty();
        let with = base.hypothesis.with(t.placed);
        let candidate = base.candidate(&t, f64::NAN, explains(&t.drawing(&base).scatter(), &base));
        let shown = if last { &best.fit } else { t.shown() };
        let step = ImprovementStep {
            error_after: best.relative_error(shown),
            chi2_per_value: shown.chi2_per_value(),
            group: if last { rivals.clone() } else { Vec::new() },
            // what it would be without those still to come does not matter
            added: Candidate { parameters: joint[index].clone(), disqualified: None, ..candidate },
            rotor: base.fitter.corrected(as_file(&with, &t.fit), &t.fit, t.drawing(&base)),
        };
        progress(&step);
        steps.push(step);
        if last {
            return Ok(steps);
        }
        base = base.grown(&t)?;
        tried.clear();
    }
}

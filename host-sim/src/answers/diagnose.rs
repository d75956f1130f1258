//! Answers of `diagnose`, `add` and `improve`.

use std::collections::BTreeMap;

use rotor_edge_desktop::diagnose::{
    Advice, Candidate, Diagnosis, DiagnosisVerdict, FittedParameter, HeldOut, Improvement,
    ImprovementOutcome, ImprovementStep, RefutedRun, SuspectedMistake,
};
use rotor_edge_desktop::identify::BearingParameter;
use serde::Serialize;
use serde_json::{Value, json};

use super::alphabetical;
use super::dimensions::DimensionAnswer;
use super::findings::{DeterminedAnswer, NoiseAnswer, RefutedRunAnswer, UnknownCauseAnswer};
use super::identify::{DepartureAnswer, IdentifiedCoefficient};
use super::shared::STANDARD_DEVIATION;

/// Values by name; a phasor is its real and imaginary part.
pub type Parameters = BTreeMap<String, Value>;

/// Which effect is missing; ``verdict`` is adequate, not_determined, missing, undecided or unknown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiagnosisAnswer {
    pub verdict: &'static str,
    pub summary: String,
    pub error_before: f64,
    pub chi2_per_value: f64,
    pub nothing_missing: f64,
    #[serde(serialize_with = "alphabetical")]
    pub candidates: Vec<CandidateAnswer>,
    pub indistinguishable: Vec<Vec<String>>,
    #[serde(serialize_with = "alphabetical")]
    pub held_out: Option<HeldOutAnswer>,
    #[serde(serialize_with = "alphabetical")]
    pub advice: Vec<AdviceAnswer>,
    pub remarks: Vec<String>,
    #[serde(serialize_with = "alphabetical")]
    pub noise: NoiseAnswer,
    #[serde(serialize_with = "alphabetical")]
    pub determined: DeterminedAnswer,
    /// As fitted.
    #[serde(serialize_with = "alphabetical")]
    pub bearings: Vec<IdentifiedCoefficient>,
    /// The drawing as fitted; none of an exact one.
    #[serde(serialize_with = "alphabetical")]
    pub dimensions: Vec<DimensionAnswer>,
    #[serde(serialize_with = "alphabetical")]
    pub unknown: Option<UnknownCauseAnswer>,
    #[serde(serialize_with = "alphabetical")]
    pub refuted_runs: Vec<RefutedRunAnswer>,
    /// Numbers of bearings that are not as stated, where the model is adequate.
    #[serde(serialize_with = "alphabetical")]
    pub not_as_stated: Vec<DepartureAnswer>,
    /// Name of the probe that does not show what the others do, where the summary says so of one.
    pub bad_probe: Option<String>,
    /// The mistake in the rotor's file or the measurement that the summary names.
    #[serde(serialize_with = "alphabetical")]
    pub mistake: Option<MistakeAnswer>,
    /// The effects that explain the data only together, where the summary names some.
    pub together: Vec<String>,
    /// The candidate that is claimed, or the first of the rivals; none where nothing is claimed of any.
    #[serde(skip)]
    pub named: Option<CandidateAnswer>,
}

/// A mistake in the rotor's file or the measurement that explains the misfit better than any effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MistakeAnswer {
    /// What is probably wrong.
    pub words: String,
    /// None where the size of the numbers alone shows it.
    pub probability: Option<f64>,
    /// Of the model without the mistake, where that was fitted.
    pub chi2_per_value: Option<f64>,
}

impl From<&SuspectedMistake> for MistakeAnswer {
    fn from(found: &SuspectedMistake) -> Self {
        let SuspectedMistake { words, probability, chi2_per_value } = found.clone();
        Self { words, probability, chi2_per_value }
    }
}

/// An effect at a place, as the data would have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateAnswer {
    pub effect: &'static str,
    pub at: Option<String>,
    pub probability: f64,
    /// The old name of ``twice_log_bayes_factor``.
    pub delta_bic: f64,
    /// Twice the logarithm of the Bayes factor over the model alone.
    pub twice_log_bayes_factor: f64,
    pub error_after: f64,
    pub chi2_per_value: f64,
    pub parameters: Parameters,
    pub uncertainty: Parameters,
    /// What ``uncertainty`` is: one standard deviation.
    pub uncertainty_kind: &'static str,
    /// Least and most of each number; they hold where ``model_adequate``.
    pub interval_95: Parameters,
    /// Whether the model with the effect describes the data.
    pub model_adequate: bool,
    pub units: Option<BTreeMap<String, &'static str>>,
    /// Why physics rules it out.
    pub disqualified: Option<String>,
    pub explanation: String,
    #[serde(skip)]
    pub fitted: FittedAnswer,
}

/// An effect with its parameters as they were fitted, in the order of its list.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedAnswer {
    pub effect: &'static str,
    pub at: Option<String>,
    /// `effect@place`, or the effect alone.
    pub label: String,
    pub parameters: Vec<FittedParameter>,
    /// Whether the model with it describes the data.
    pub model_fits: bool,
    pub disqualified: Option<String>,
    /// What the effect is, and where to look for it on the machine, in sentences.
    pub what: &'static str,
    pub inspect: &'static str,
}

impl FittedAnswer {
    /// The effect in words, such as "seal at disk 3".
    pub fn words(&self) -> String {
        let kind = self.effect.replace('_', " ");
        self.at.as_ref().map_or_else(|| kind.clone(), |at| format!("{kind} at {at}"))
    }
}

/// χ² per value at speeds that were left out, without and with the effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HeldOutAnswer {
    pub before: f64,
    pub after: f64,
}

/// A measurement that would tell rivals apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AdviceAnswer {
    pub measurement: String,
    pub separation_sd: f64,
    pub speed_rpm: f64,
    pub repeats: usize,
}

/// A model with an effect more.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Addition {
    pub error_before: f64,
    pub error_after: f64,
    pub chi2_per_value_before: f64,
    pub chi2_per_value_after: f64,
    pub parameters: Parameters,
    pub uncertainty: Parameters,
    /// What ``uncertainty`` is: one standard deviation.
    pub uncertainty_kind: &'static str,
    /// Least and most of each number; they hold where ``model_adequate``.
    pub interval_95: Parameters,
    /// Whether the model with the effect describes the data.
    pub model_adequate: bool,
    pub units: BTreeMap<String, &'static str>,
    /// As fitted together with the effect.
    pub bearings: Vec<IdentifiedCoefficient>,
    /// The drawing as fitted together with the effect; none of an exact one.
    pub dimensions: Vec<DimensionAnswer>,
    pub disqualified: Option<String>,
    #[serde(skip)]
    pub fitted: FittedAnswer,
}

/// An effect that was added.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepAnswer {
    pub effect: &'static str,
    pub at: Option<String>,
    pub error_after: f64,
    pub chi2_per_value: f64,
    /// Sets of effects that explain the data as well.
    pub group: Vec<String>,
    pub parameters: Parameters,
    pub uncertainty: Parameters,
    /// What ``uncertainty`` is: one standard deviation.
    pub uncertainty_kind: &'static str,
    /// Least and most of each number; they hold where ``model_adequate``.
    pub interval_95: Parameters,
    /// Whether the model with the effect describes the data.
    pub model_adequate: bool,
    #[serde(skip)]
    pub fitted: FittedAnswer,
    #[serde(skip)]
    pub explanation: String,
}

/// A model with all the effects that the data ask for; verdicts are those of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImprovementAnswer {
    pub error_before: f64,
    pub chi2_per_value_before: f64,
    pub steps: Vec<StepAnswer>,
    pub verdict: &'static str,
    pub summary: String,
    pub noise: NoiseAnswer,
    pub determined: DeterminedAnswer,
    /// As fitted, with all effects.
    pub bearings: Vec<IdentifiedCoefficient>,
    /// The drawing as fitted, with all effects; none of an exact one.
    pub dimensions: Vec<DimensionAnswer>,
    pub unknown: Option<UnknownCauseAnswer>,
    pub refuted_runs: Vec<RefutedRunAnswer>,
    /// Numbers of bearings that are not as stated, where the model is adequate.
    pub not_as_stated: Vec<DepartureAnswer>,
    pub remarks: Vec<String>,
    /// The mistake in the files for which no effect was added.
    pub mistake: Option<MistakeAnswer>,
    /// Whether the model was written; one that lacks an unknown cause or holds a mistake only if asked.
    pub written: bool,
    /// Candidates of the first diagnosis, most probable first.
    #[serde(skip)]
    pub candidates_before: Vec<CandidateAnswer>,
}

impl From<&Diagnosis> for DiagnosisAnswer {
    fn from(found: &Diagnosis) -> Self {
        Self {
            verdict: found.verdict.name(),
            summary: found.summary.clone(),
            error_before: found.error_before,
            chi2_per_value: found.chi2_per_value,
            nothing_missing: found.nothing_missing,
            candidates: found.candidates.iter().map(CandidateAnswer::from).collect(),
            indistinguishable: found.indistinguishable.clone(),
            held_out: found.held_out.map(HeldOutAnswer::from),
            advice: found.advice.iter().map(AdviceAnswer::from).collect(),
            remarks: found.remarks.clone(),
            noise: (&found.scatter).into(),
            determined: DeterminedAnswer::of(&found.determined, found.verdict.model_fits()),
            bearings: found.bearings.iter().map(IdentifiedCoefficient::from).collect(),
            dimensions: found.dimensions.iter().map(DimensionAnswer::from).collect(),
            unknown: found.unknown.as_ref().map(UnknownCauseAnswer::from),
            refuted_runs: refuted_runs(&found.refuted),
            not_as_stated: not_as_stated(&found.bearings, found.verdict),
            bad_probe: found.bad_probe.clone(),
            mistake: found.mistake.as_ref().map(MistakeAnswer::from),
            together: found.together.clone(),
            named: found.named().map(CandidateAnswer::from),
        }
    }
}

fn not_as_stated(bearings: &[BearingParameter], verdict: DiagnosisVerdict) -> Vec<DepartureAnswer> {
    match verdict.model_fits() {
        true => bearings.iter().filter_map(DepartureAnswer::of).collect(),
        false => Vec::new(),
    }
}

fn refuted_runs(refuted: &[RefutedRun]) -> Vec<RefutedRunAnswer> {
    refuted.iter().map(RefutedRunAnswer::from).collect()
}

impl From<&Candidate> for CandidateAnswer {
    fn from(c: &Candidate) -> Self {
        Self {
            effect: c.effect,
            at: c.at.clone(),
            probability: c.probability,
            delta_bic: c.support,
            twice_log_bayes_factor: c.support,
            error_after: c.error_after,
            chi2_per_value: c.chi2_per_value,
            parameters: parameters(c),
            uncertainty: uncertainty(c),
            uncertainty_kind: STANDARD_DEVIATION,
            interval_95: intervals(c),
            model_adequate: c.model_fits,
            units: Some(units(c)),
            disqualified: c.disqualified.clone(),
            explanation: c.explanation(),
            fitted: c.into(),
        }
    }
}

impl From<&Candidate> for FittedAnswer {
    fn from(c: &Candidate) -> Self {
        Self {
            effect: c.effect,
            at: c.at.clone(),
            label: c.label(),
            parameters: c.parameters.clone(),
            model_fits: c.model_fits,
            disqualified: c.disqualified.clone(),
            what: c.knowledge.what,
            inspect: c.knowledge.inspect,
        }
    }
}

impl From<HeldOut> for HeldOutAnswer {
    fn from(h: HeldOut) -> Self {
        Self { before: h.before, after: h.after }
    }
}

impl From<&Advice> for AdviceAnswer {
    fn from(a: &Advice) -> Self {
        Self {
            measurement: a.measurement.clone(),
            separation_sd: a.separation_sd,
            speed_rpm: a.speed_rpm,
            repeats: a.repeats,
        }
    }
}

impl From<&Improvement> for Addition {
    fn from(better: &Improvement) -> Self {
        Self {
            error_before: better.error_before,
            error_after: better.error_after,
            chi2_per_value_before: better.chi2_per_value[0],
            chi2_per_value_after: better.chi2_per_value[1],
            parameters: parameters(&better.added),
            uncertainty: uncertainty(&better.added),
            uncertainty_kind: STANDARD_DEVIATION,
            interval_95: intervals(&better.added),
            model_adequate: better.added.model_fits,
            units: units(&better.added),
            bearings: better.bearings.iter().map(IdentifiedCoefficient::from).collect(),
            dimensions: better.dimensions.iter().map(DimensionAnswer::from).collect(),
            disqualified: better.added.disqualified.clone(),
            fitted: (&better.added).into(),
        }
    }
}

impl From<&ImprovementStep> for StepAnswer {
    fn from(step: &ImprovementStep) -> Self {
        Self {
            effect: step.added.effect,
            at: step.added.at.clone(),
            error_after: step.error_after,
            chi2_per_value: step.chi2_per_value,
            group: step.group.clone(),
            parameters: parameters(&step.added),
            uncertainty: uncertainty(&step.added),
            uncertainty_kind: STANDARD_DEVIATION,
            interval_95: intervals(&step.added),
            model_adequate: step.added.model_fits,
            fitted: (&step.added).into(),
            explanation: step.added.explanation(),
        }
    }
}

impl From<&ImprovementOutcome> for ImprovementAnswer {
    fn from(outcome: &ImprovementOutcome) -> Self {
        Self {
            error_before: outcome.error_before,
            chi2_per_value_before: outcome.chi2_per_value_before,
            steps: outcome.steps.iter().map(StepAnswer::from).collect(),
            verdict: outcome.verdict.name(),
            summary: outcome.summary.clone(),
            noise: (&outcome.scatter).into(),
            determined: DeterminedAnswer::of(&outcome.determined, outcome.verdict.model_fits()),
            bearings: outcome.bearings.iter().map(IdentifiedCoefficient::from).collect(),
            dimensions: outcome.dimensions.iter().map(DimensionAnswer::from).collect(),
            unknown: outcome.unknown.as_ref().map(UnknownCauseAnswer::from),
            refuted_runs: refuted_runs(&outcome.refuted),
            not_as_stated: not_as_stated(&outcome.bearings, outcome.verdict),
            remarks: outcome.remarks.clone(),
            mistake: outcome.mistake.as_ref().map(MistakeAnswer::from),
            written: false,
            candidates_before: outcome.candidates_before.iter().map(CandidateAnswer::from).collect(),
        }
    }
}

/// Parameters by name, phasors as `[real, imaginary]`; those of several probes, numbered, are one list.
pub fn parameters(c: &Candidate) -> Parameters {
    by_name(c, |p| if p.value.len() == 1 { json!(p.value[0]) } else { json!(p.value) })
}

/// Ends of 95 % intervals by name, those of a phasor part by part.
pub fn intervals(c: &Candidate) -> Parameters {
    by_name(c, |p| match p.interval_95.as_slice() {
        [] => Value::Null,
        [one] => json!(one),
        parts => json!(parts),
    })
}

/// Standard deviations by name.
pub fn uncertainty(c: &Candidate) -> Parameters {
    by_name(c, |p| json!(p.sd))
}

fn by_name(c: &Candidate, of: impl Fn(&FittedParameter) -> Value) -> Parameters {
    let mut all = Parameters::new();
    for p in &c.parameters {
        match p.name.split_once(' ') {
            Some((name, _)) => {
                if let Value::Array(list) = all.entry(name.into()).or_insert_with(|| json!([])) {
                    list.push(of(p));
                }
            }
            None => {
                all.insert(p.name.clone(), of(p));
            }
        }
    }
    all
}

fn units(c: &Candidate) -> BTreeMap<String, &'static str> {
    let name =
        |p: &FittedParameter| p.name.split_once(' ').map_or(p.name.as_str(), |(name, _)| name).to_string();
    c.parameters.iter().map(|p| (name(p), p.unit)).collect()
}

//! Faults of probes: the sentence that names one, and how a probe is judged when an unknown cause is present too.

use super::answer::SURE;
use super::base::{BaseModel, CandidateFit};
use super::parameters;
use super::rank::OUTSIDE;
use super::unknown::UnknownCauseFit;
use crate::error::Error;
use crate::machine::place::Place;
use crate::statistics::significance::percent;

/// Candidates of the machine itself that a probe is compared with, strongest first.
const RIVALS: usize = 4;

impl CandidateFit {
    /// The sentence on the probe that this effect describes, without a full stop; `None` for an effect of the machine.
    pub fn misreading(&self, base: &BaseModel) -> Option<String> {
        let with = base.hypothesis.with(self.placed);
        let (real, _) = parameters::split(&with, &self.fit).pop()?;
        self.placed.effect.misreading(base.fitter.rotor, self.placed.place, &real)
    }

    /// The summary of a diagnosis in which this effect, and nothing else, is missing.
    pub fn missing_in_words(&self, base: &BaseModel, probability: f64) -> String {
        let probable = percent(probability);
        match self.misreading(base) {
            Some(words) => {
                format!("{words} ({probable} probable). With that allowed for, the model is adequate.")
            }
            None => format!("{} is missing ({probable} probable).", self.placed.label(base.fitter.rotor)),
        }
    }

    /// The probe that it is about, if it is one.
    pub fn probe(&self, base: &BaseModel) -> Option<String> {
        let Place::Probe(p) = self.placed.place else { return None };
        self.misreading(base).and(base.fitter.rotor.probe.get(p)).map(|probe| probe.name.clone())
    }
}

/// A probe that does not show what the others do, whatever else is missing.
pub struct SuspectProbe {
    pub name: String,
    /// What is wrong with it, without a stop.
    pub words: String,
    pub probability: f64,
}

/// The probe that is off beyond doubt though with it something unexplained is left. It has to explain more by itself than an unknown
/// cause does, or any misfit could be laid on it; and together with an unknown cause more than every rival does together with one.
///
/// # Errors
/// If the machine is singular.
pub fn suspect(
    base: &BaseModel,
    tried: &[CandidateFit],
    unknown: &UnknownCauseFit,
) -> Result<Option<SuspectProbe>, Error> {
    let places = 2.0 * (tried.len().max(1) as f64).ln();
    let outside = 2.0 * OUTSIDE.ln();
    let alone = unknown.evidence + outside;
    // evidence of those that were not settled is none to compare by
    let settled = || tried.iter().filter(|t| t.disqualified.is_none() && t.own_drawing.is_some());
    let suspects: Vec<&CandidateFit> =
        settled().filter(|t| t.probe(base).is_some() && t.evidence - places > alone).collect();
    if suspects.is_empty() {
        return Ok(None);
    }
    let rivals = settled().filter(|t| t.probe(base).is_none()).take(RIVALS);
    let with_unknown = |t: &CandidateFit| -> Result<f64, Error> {
        let beside = UnknownCauseFit::beside_candidate(base, t)?.evidence + outside;
        Ok(t.evidence - places + beside.max(0.0))
    };
    let others: Vec<f64> = rivals.map(with_unknown).collect::<Result<_, Error>>()?;
    let own: Vec<f64> = suspects.iter().map(|t| with_unknown(t)).collect::<Result<_, Error>>()?;
    let Some(best) = (0..own.len()).max_by(|a, b| own[*a].total_cmp(&own[*b])) else { return Ok(None) };
    let name = suspects[best].probe(base);
    // a special case of what is wrong with a probe stands for the same probe
    let same = (0..own.len()).filter(|k| suspects[*k].probe(base) == name).map(|k| own[k]);
    let elsewhere = (0..own.len()).filter(|k| suspects[*k].probe(base) != name).map(|k| own[k]);
    let odds = |evidence: f64| (0.5 * (evidence - own[best])).exp();
    let of_probe: f64 = same.map(odds).sum();
    let of_rest: f64 = elsewhere.chain(others).chain([alone]).map(odds).sum();
    let probability = of_probe / (of_probe + of_rest);
    let words = suspects[best].misreading(base);
    let found = |(name, words)| SuspectProbe { name, words, probability };
    Ok(name.zip(words).map(found).filter(|_| probability >= 1.0 - SURE))
}

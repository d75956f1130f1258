//! The diagnosis of a model: every effect tried, ranked, and put into words.

use super::answer::{Candidate, Diagnosis, SURE, Verdict};
use super::base::{Base, Tried};
use super::{advice, checks, evidence, held_out, parameters, rank};
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::fit::hypothesis::Assumed;
use crate::identify::assumed_noise;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;

/// Diagnoses a model against measurements.
///
/// # Errors
/// If the data cannot be this machine's, a probe is dead, or there is too little to fit.
pub fn diagnose(rotor: &Rotor, readings: &[Reading]) -> Result<Diagnosis, Error> {
    let noise = rotor.noise.unwrap_or_else(|| assumed_noise(readings));
    let mut remarks = checks::before(rotor, readings)?;
    remarks.extend(checks::assumed(rotor, &noise));
    let fitter = Fitter::new(rotor, Data::new(rotor, &noise, readings));
    let base = Base::fit(&fitter)?;
    checks::after(&base, rotor, readings, &noise)?;
    if let Some(why) = rank::saturation(&base) {
        return Ok(base.undecidable(why, noise, remarks));
    }
    let tried = base.try_all()?;
    let ranking = rank::rank(&base, &tried);
    let held_out = match tried.first() {
        Some(best) if ranking.nothing_missing < SURE => Some(held_out::check(&base, best, readings, &noise)?),
        _ => None,
    };
    let (verdict, summary) = rank::verdict(&base, &tried, &ranking, held_out);
    let advice = match verdict {
        Verdict::Undecided => advice::between_fits(&base, &tried, &ranking, &noise),
        _ => Vec::new(),
    };
    let stands_on = if verdict == Verdict::Missing { tried.first().map(|t| &t.fit) } else { None };
    remarks.extend(checks::beyond_grade(rotor, &stands_on.unwrap_or(&base.fit).unknowns));
    let candidates = tried
        .iter()
        .zip(&ranking.probabilities)
        .map(|(t, probability)| base.candidate(t, *probability))
        .collect();
    Ok(Diagnosis {
        verdict,
        summary,
        error_before: base.relative_error(&base.fit),
        chi2_per_value: base.fit.chi2_per_value(),
        nothing_missing: ranking.nothing_missing,
        candidates,
        indistinguishable: ranking.groups,
        saturated: false,
        held_out,
        advice,
        remarks,
        noise,
    })
}

impl Base<'_> {
    /// The answer where bearings and planes alone use up what the data hold: anything is possible.
    pub fn undecidable(&self, why: String, noise: Noise, remarks: Vec<String>) -> Diagnosis {
        let rotor = self.fitter.rotor;
        let possible = self.possible();
        let error_before = self.relative_error(&self.fit);
        // the prior, as the data add nothing to it
        let probability = 0.5 / possible.len().max(1) as f64;
        let candidate = |a: &Assumed| Candidate {
            effect: a.effect.name(),
            at: a.place.name(rotor).map(str::to_string),
            probability,
            delta_bic: 0.0,
            error_after: error_before,
            chi2_per_value: self.fit.chi2_per_value(),
            parameters: Vec::new(),
            disqualified: None,
            evidence: "nothing, these data cannot show it.".into(),
            knowledge: a.effect.knowledge(),
        };
        Diagnosis {
            verdict: Verdict::Undecided,
            summary: format!("{why}."),
            error_before,
            chi2_per_value: self.fit.chi2_per_value(),
            nothing_missing: 0.5,
            candidates: possible.iter().map(candidate).collect(),
            indistinguishable: vec![possible.iter().map(|a| a.label(rotor)).collect()],
            saturated: true,
            held_out: None,
            advice: advice::between_typical(self, &possible, &noise),
            remarks,
            noise,
        }
    }

    /// A candidate as it is told.
    pub fn candidate(&self, t: &Tried, probability: f64) -> Candidate {
        let rotor = self.fitter.rotor;
        let with = self.hypothesis.with(t.assumed);
        Candidate {
            effect: t.assumed.effect.name(),
            at: t.assumed.place.name(rotor).map(str::to_string),
            probability,
            delta_bic: t.delta_bic,
            error_after: self.relative_error(&t.fit),
            chi2_per_value: t.fit.chi2_per_value(),
            parameters: parameters::of(&with, &t.fit),
            disqualified: t.disqualified.clone(),
            evidence: evidence::describe(self, t),
            knowledge: t.assumed.effect.knowledge(),
        }
    }
}

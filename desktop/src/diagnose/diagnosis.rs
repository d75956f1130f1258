//! The diagnosis of a model: every effect tried, ranked, and put into words.

use super::answer::{Candidate, Diagnosis, SURE, Verdict};
use super::as_file::as_file;
use super::base::{Base, Tried};
use super::determined::Determined;
use super::rank::Ranking;
use super::runs::RunChange;
use super::sweep::Sweep;
use super::unknown::Unknown;
use super::verdict::{Evidence, Said};
use super::{advice, checks, evidence, held_out, parameters, rank, runs};
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::fit::hypothesis::Assumed;
use crate::identify::assumed_noise;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;

/// That nothing is missing, before there are data.
const PRIOR: f64 = 0.5;

/// Diagnoses a model against measurements.
///
/// # Errors
/// If the data cannot be this machine's, a probe is dead, or there is too little to fit.
pub fn diagnose(rotor: &Rotor, readings: &[Reading]) -> Result<Diagnosis, Error> {
    let rotor = &rotor.as_stated();
    let noise = rotor.noise.unwrap_or_else(|| assumed_noise(readings));
    let mut remarks = checks::before(rotor, readings)?;
    remarks.extend(checks::assumed(rotor, &noise));
    let fitter = Fitter::new(rotor, Data::new(rotor, &noise, readings));
    let base = Base::fit(&fitter)?;
    checks::not_reversed(&base, rotor, readings, &noise)?;
    let determined = Determined::by(&base, &base.hypothesis, &base.fit, &base.drawing)?;
    if let Some(why) = rank::saturation(&base) {
        return Ok(base.undecidable(why, noise, remarks, determined));
    }
    let Weighed { tried, unknown, ranking } = base.weighed()?;
    let held_out = match tried.first() {
        Some(best) if ranking.nothing_missing < SURE => Some(held_out::check(&base, best, readings, &noise)?),
        _ => None,
    };
    let evidence = Evidence {
        base: &base,
        tried: &tried,
        ranking: &ranking,
        unknown: &unknown,
        held_out,
        determined: &determined,
    };
    let least = tried.iter().map(|t| base.relative_error(&t.fit)).fold(f64::INFINITY, f64::min);
    checks::this_machine(rotor, least.min(base.relative_error(base.closest())))?;
    let sweep = Sweep::of(&as_file(&base.hypothesis, &base.fit), readings, &noise);
    let too_fast = match &sweep {
        Some(sweep) if ranking.nothing_missing < SURE => lag_explains(sweep, rotor, readings)?,
        _ => false,
    };
    let mut said = evidence.verdict()?;
    if too_fast {
        said.verdict = Verdict::Undecided;
        said.summary =
            "The misfit is that of a run too fast for a steady response; nothing is claimed.".into();
    }
    let Said { verdict, summary, scatter, outside } = said;
    remarks.extend(sweep.map(|sweep| sweep.remark));
    let advice = match verdict {
        Verdict::Undecided if !too_fast => advice::between_fits(&base, &tried, &ranking, &noise),
        _ => Vec::new(),
    };
    if verdict == Verdict::Undecided && !too_fast && advice.is_empty() {
        remarks.push(advice::another_kind(&base));
    }
    let stands_on = if verdict == Verdict::Missing { tried.first().map(|t| &t.fit) } else { None };
    remarks.extend(checks::beyond_grade(rotor, &stands_on.unwrap_or(&base.fit).unknowns));
    let mut refuted = Vec::new();
    if let Some(best) = tried.first() {
        let changes = RunChange::beyond(&base, &base.hypothesis.with(best.assumed), &best.fit);
        match verdict {
            Verdict::Missing => {
                let (not_true, others) = runs::told(&changes, ranking.probabilities[0]);
                refuted = not_true;
                remarks.extend(others);
            }
            Verdict::Undecided if !too_fast => {
                let label = best.assumed.label(rotor);
                remarks.extend(changes.iter().map(|c| format!("With {label}: {}", c.words())));
            }
            _ => {}
        }
    }
    let cause = (verdict == Verdict::Unknown || outside >= SURE).then(|| unknown.cause(&fitter, outside));
    let candidates = tried
        .iter()
        .zip(&ranking.probabilities)
        .map(|(t, probability)| base.candidate(t, *probability))
        .collect();
    Ok(Diagnosis {
        verdict,
        summary,
        error_before: base.relative_error(base.closest()),
        chi2_per_value: base.closest().chi2_per_value(),
        nothing_missing: ranking.nothing_missing,
        candidates,
        indistinguishable: ranking.groups,
        saturated: false,
        too_fast,
        held_out,
        advice,
        remarks,
        noise,
        scatter,
        unknown: cause,
        determined,
        refuted,
    })
}

/// Whether a run that swept too fast leaves nothing to be missed: so fast that no steady response can be had from it, or
/// noise alone is left when its lag is taken off.
fn lag_explains(sweep: &Sweep, rotor: &Rotor, readings: &[Reading]) -> Result<bool, Error> {
    Ok(!sweep.small || nothing_missing(rotor, &sweep.taken_off(readings))? >= SURE)
}

/// Every explanation of what a model misses, with its probability.
pub struct Weighed {
    pub tried: Vec<Tried>,
    pub unknown: Unknown,
    pub ranking: Ranking,
}

impl Base<'_> {
    /// Known effects, an unknown force and nothing at all, weighed against one another.
    pub fn weighed(&self) -> Result<Weighed, Error> {
        let tried = self.try_all()?;
        let unknown = Unknown::beside(self)?;
        let ranking = rank::rank(self, &tried, Some(unknown.delta_bic));
        Ok(Weighed { tried, unknown, ranking })
    }

    /// The answer where bearings and planes alone use up what the data hold: anything is possible.
    pub fn undecidable(
        &self,
        why: String,
        noise: Noise,
        remarks: Vec<String>,
        determined: Determined,
    ) -> Diagnosis {
        let rotor = self.fitter.rotor;
        let possible = self.possible();
        let advice = advice::between_typical(self, &possible, &noise);
        let mut remarks = remarks;
        remarks.extend(advice.is_empty().then(|| advice::another_kind(self)));
        let error_before = self.relative_error(self.closest());
        // the prior, as the data add nothing to it
        let probability = (1.0 - PRIOR) / possible.len().max(1) as f64;
        let candidate = |a: &Assumed| Candidate {
            effect: a.effect.name(),
            at: a.place.name(rotor).map(str::to_string),
            probability,
            delta_bic: 0.0,
            error_after: error_before,
            chi2_per_value: self.closest().chi2_per_value(),
            parameters: Vec::new(),
            disqualified: None,
            evidence: "nothing, these data cannot show it.".into(),
            knowledge: a.effect.knowledge(),
        };
        Diagnosis {
            verdict: Verdict::Undecided,
            summary: format!("{why}."),
            error_before,
            chi2_per_value: self.closest().chi2_per_value(),
            nothing_missing: PRIOR,
            candidates: possible.iter().map(candidate).collect(),
            indistinguishable: vec![possible.iter().map(|a| a.label(rotor)).collect()],
            saturated: true,
            too_fast: false,
            held_out: None,
            advice,
            remarks,
            noise,
            scatter: self.drawing.scatter(),
            unknown: None,
            determined,
            refuted: Vec::new(),
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

/// Probability that nothing is missing in a model: what [`diagnose`] goes by, without the words. Where bearings and planes
/// alone use up what the data hold it is the prior, even odds.
///
/// # Errors
/// As [`diagnose`].
pub fn nothing_missing(rotor: &Rotor, readings: &[Reading]) -> Result<f64, Error> {
    let rotor = &rotor.as_stated();
    let noise = rotor.noise.unwrap_or_else(|| assumed_noise(readings));
    let fitter = Fitter::new(rotor, Data::new(rotor, &noise, readings));
    let base = Base::fit(&fitter)?;
    if rank::saturation(&base).is_some() {
        return Ok(PRIOR);
    }
    Ok(base.weighed()?.ranking.nothing_missing)
}

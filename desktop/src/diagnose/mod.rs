//! Which physical effect is missing in a model?
//!
//! Every effect, at every place where it can sit, is fitted on top of the model with bearings and planes
//! free, allowing for what the drawing's tolerances could have done. The fits are ranked by the Bayesian
//! information criterion and turned into probabilities; the best must also predict speeds that it was
//! not fitted to. Where the data cannot decide, the answer says so, names the rivals, and says which
//! measurement would tell them apart.

mod advice;
mod base;
mod best_fit;
pub(crate) mod checks;
mod evidence;
mod held_out;
mod improve;
mod parameters;
mod rank;

pub use advice::Advice;
pub use best_fit::{BestFit, best_fit};
pub use improve::{Improvement, Outcome, Step, add, improve};
pub use parameters::FittedParameter;

use base::{Base, Tried, same};

use crate::effects::Knowledge;
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::identify::assumed_noise;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::Reading;

/// A claim needs this little probability that nothing is missing.
pub const SURE: f64 = 0.05;
/// A rival with less than this share of the best one's probability is ruled out.
pub const RIVAL: f64 = 0.05;

/// What the diagnosis says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The model describes the data to within their noise (and the drawing's tolerance).
    Adequate,
    /// One effect, at one place, is missing.
    Missing,
    /// Something is missing or may be, and the data cannot tell what.
    Undecided,
}

impl Verdict {
    /// In one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Missing => "missing",
            Self::Undecided => "undecided",
        }
    }
}

/// An effect at a place, fitted.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Name of the effect.
    pub effect: &'static str,
    /// Name of the bearing, disk or probe; `None` for the whole machine.
    pub at: Option<String>,
    /// Probability that this, and nothing else of the list or nothing at all, is what is missing.
    pub probability: f64,
    /// BIC of the model minus BIC with the effect: evidence for it.
    pub delta_bic: f64,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) with the effect.
    pub error_after: f64,
    /// χ² per measured real number with the effect.
    pub chi2_per_value: f64,
    /// Its parameters.
    pub parameters: Vec<FittedParameter>,
    /// Why physics rules it out, if it does.
    pub disqualified: Option<String>,
    /// What was seen of it in these data.
    pub evidence: String,
    /// What an engineer should know of it.
    pub knowledge: Knowledge,
}

impl Candidate {
    /// `effect@place`, or the effect alone.
    pub fn label(&self) -> String {
        self.at.as_ref().map_or_else(|| self.effect.to_string(), |at| format!("{}@{at}", self.effect))
    }

    /// A paragraph for the engineer.
    pub fn explanation(&self) -> String {
        let k = &self.knowledge;
        format!("{} Seen here: {} Usually: {} Inspect: {}", k.what, self.evidence, k.means, k.inspect)
    }
}

/// Error on speeds that were left out of the fit, χ² per real number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOut {
    /// Of the model.
    pub before: f64,
    /// Of the model with the best candidate.
    pub after: f64,
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// In one word.
    pub verdict: Verdict,
    /// In one sentence.
    pub summary: String,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) of the model at its best bearings and planes.
    pub error_before: f64,
    /// χ² per measured real number of the model.
    pub chi2_per_value: f64,
    /// Probability that nothing is missing.
    pub nothing_missing: f64,
    /// All candidates, most probable first.
    pub candidates: Vec<Candidate>,
    /// Groups of candidates (by label) that the data cannot tell apart, the best one's group first.
    pub indistinguishable: Vec<Vec<String>>,
    /// Whether bearings and planes alone use up what the data hold, so that nothing more can be found.
    pub saturated: bool,
    /// The check on left-out speeds, where there was something to check.
    pub held_out: Option<HeldOut>,
    /// What to measure next, where the data cannot decide.
    pub advice: Vec<Advice>,
    /// What was found odd in the data, one sentence each.
    pub remarks: Vec<String>,
    /// The noise that was gone by.
    pub noise: Noise,
}

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

//! The answer of a diagnosis.

use super::parameters::FittedParameter;
use super::planes::PlaneUnbalances;
use super::runs::RefutedRun;
use super::unknown::UnknownCause;
use crate::effects::Knowledge;
use crate::fit::bearings::BearingParameter;
use crate::fit::dimensions::FittedDimension;
use crate::machine::drawing::Noise;
use crate::statistics::scatter::Scatter;
use crate::statistics::significance::percent;
pub use crate::statistics::significance::{RIVAL, SURE};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiagnosisVerdict {
    /// The model describes the data to within their noise (and the drawing's tolerance).
    Adequate,
    /// One effect, at one place, is missing.
    Missing,
    /// Something is missing or may be, and the data cannot tell what.
    Undecided,
    /// Something is missing that no known effect explains.
    Unknown,
    /// Noise explains the misfit, but the data do not determine what the model is used for.
    NotDetermined,
}

impl DiagnosisVerdict {
    /// Whether the model describes the data, so that its intervals hold.
    pub fn model_fits(self) -> bool {
        matches!(self, Self::Adequate | Self::NotDetermined)
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Missing => "missing",
            Self::Undecided => "undecided",
            Self::Unknown => "unknown",
            Self::NotDetermined => "not_determined",
        }
    }
}

/// An effect at a place, fitted.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub effect: &'static str,
    /// Name of the bearing, disk or probe; `None` for the whole machine.
    pub at: Option<String>,
    /// Probability that this, and nothing else of the list or nothing at all, is what is missing.
    pub probability: f64,
    /// Evidence for it over the model: twice the logarithm of the Bayes factor.
    pub support: f64,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) with the effect.
    pub error_after: f64,
    /// χ² per measured real number with the effect.
    pub chi2_per_value: f64,
    pub parameters: Vec<FittedParameter>,
    /// Whether the model with it describes the data, so that the intervals of its parameters hold.
    pub model_fits: bool,
    /// Why physics rules it out, if it does.
    pub disqualified: Option<String>,
    /// Its effect in these data, in words.
    pub evidence: String,
    /// What engineers know about the effect.
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
    /// Error of the model alone.
    pub before: f64,
    /// Of the model with the best candidate.
    pub after: f64,
    /// Whether the candidate predicts them worse, by more than chance.
    pub worse: bool,
}

/// What shows that a run changed speed too fast for a steady response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TooFast {
    /// Its readings have times, and the speed changes fast between them.
    Times,
    /// Its readings have no times, and the vibration beats beside the peak.
    Beats,
}

#[derive(Debug, Clone)]
pub struct Diagnosis {
    pub verdict: DiagnosisVerdict,
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
    /// How it is known, if it is, that a run changed speed too fast for a steady response and nothing can be claimed for it.
    pub too_fast: Option<TooFast>,
    /// The probe that does not show what the others do, where the summary says so of one.
    pub bad_probe: Option<String>,
    /// The mistake in the files that explains the misfit better than any effect, if one does.
    pub mistake: Option<SuspectedMistake>,
    /// Labels of the effects that explain the data only together, where the summary names some.
    pub together: Vec<String>,
    /// The check on left-out speeds, where there was something to check.
    pub held_out: Option<HeldOut>,
    /// What to measure next, where the data cannot decide.
    pub advice: Vec<Advice>,
    /// What was found odd in the data, one sentence each.
    pub remarks: Vec<String>,
    /// The noise as stated.
    pub noise: Noise,
    /// Residual noise relative to that, of the model behind the verdict.
    pub scatter: Scatter,
    /// Nature of a cause outside the list, where one is probable.
    pub unknown: Option<UnknownCause>,
    /// Unbalances of the planes of the unchanged model.
    pub determined: PlaneUnbalances,
    /// Its bearings as fitted.
    pub bearings: Vec<BearingParameter>,
    /// Its drawing as fitted.
    pub dimensions: Vec<FittedDimension>,
    /// Runs whose stated weights are not true.
    pub refuted: Vec<RefutedRun>,
}

impl Diagnosis {
    /// The candidate that is worth explaining: the one that is claimed, or the first of the rivals; none where nothing
    /// is claimed of any.
    pub fn named(&self) -> Option<&Candidate> {
        let claimed = matches!(self.verdict, DiagnosisVerdict::Missing | DiagnosisVerdict::Undecided);
        self.candidates
            .first()
            .filter(|_| claimed && !self.saturated && self.too_fast.is_none() && self.mistake.is_none())
    }
}

/// A mistake in the rotor's file or the measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct SuspectedMistake {
    /// What is probably wrong, without a full stop.
    pub words: String,
    /// Probability that this is what is wrong; `None` where the size of the numbers alone shows it.
    pub probability: Option<f64>,
    /// χ² per measured real number without it, where that was fitted.
    pub chi2_per_value: Option<f64>,
}

impl SuspectedMistake {
    /// The summary of a diagnosis that names it.
    pub fn summary(&self) -> String {
        match self.probability {
            Some(p) => format!(
                "{} ({} probable). Without that mistake the model is adequate; no effect is claimed.",
                self.words,
                percent(p)
            ),
            None => format!("{}. No effect is claimed.", self.words),
        }
    }
}

/// A measurement that would tell rivals apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    pub measurement: String,
    /// Distance of the two most alike rivals, in standard deviations over all its values.
    pub separation_sd: f64,
    /// Speed at which they differ most, rpm.
    pub speed_rpm: f64,
    /// How often to measure until their average tells the rivals apart.
    pub repeats: usize,
}

//! The verdict on the evidence, in one word and one sentence.

use super::answer::{DiagnosisVerdict, HeldOut, SURE, SuspectedMistake};
use super::base::{BaseModel, CandidateFit, explains};
use super::instruments::{SuspectProbe, suspect, suspect_between_runs};
use super::mistaken::MistakeComparison;
use super::parameters;
use super::planes::PlaneUnbalances;
use super::rank::{NONE_OF_THESE, Ranking};
use super::sets::{EffectSet, SearchReach, SetComparison, is_enough, together};
use super::unknown::UnknownCauseFit;
use crate::error::Error;
use crate::statistics::scatter::Scatter;
use crate::statistics::significance::percent;

/// How far `diagnose` looks for effects that explain the data together. `improve` looks further, and its first verdict names no larger set.
pub const REACH_OF_DIAGNOSIS: SearchReach = SearchReach { width: 1, effects: 2 };

/// All fits and probabilities of a model.
pub struct DiagnosisEvidence<'a, 'b> {
    pub base: &'b BaseModel<'a>,
    pub tried: &'b [CandidateFit],
    pub ranking: &'b Ranking,
    /// An unknown cause beside the model.
    pub unknown: &'b UnknownCauseFit,
    /// Mistakes in the files beside it.
    pub mistaken: &'b MistakeComparison,
    /// A unit that the sizes alone show to be wrong.
    pub unit: Option<&'b SuspectedMistake>,
    pub held_out: Option<HeldOut>,
    /// Unbalances of the planes of the model.
    pub determined: &'b PlaneUnbalances,
    /// How far to look for several effects where no single one is enough.
    pub reach: SearchReach,
}

/// Verdict, summary, and the noise that the explanation leaves.
pub struct Conclusion<'a> {
    pub verdict: DiagnosisVerdict,
    pub summary: String,
    pub scatter: Scatter,
    /// Probability that something outside the list is missing.
    pub outside: f64,
    /// Whether the model with the best candidate, or one of its rivals, describes the data.
    pub candidate_fits: bool,
    /// The probe that does not show what the others do, if the summary says so of one.
    pub bad_probe: Option<String>,
    /// The mistake in the files that the summary names.
    pub mistake: Option<SuspectedMistake>,
    /// The effects that explain the data only together, if the summary names some.
    pub together: Vec<String>,
    /// The sets of several effects, where the verdict needed a search for them.
    pub sets: Option<SetComparison<'a>>,
}

impl<'a> DiagnosisEvidence<'a, '_> {
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn verdict(&self) -> Result<Conclusion<'a>, Error> {
        let base = self.base;
        let scatter = base.drawing.scatter();
        let Ranking { nothing_missing, unknown, .. } = *self.ranking;
        let conclude = |verdict, summary, scatter, candidate_fits| {
            Ok(Conclusion {
                verdict,
                summary,
                scatter,
                outside: unknown,
                candidate_fits,
                bad_probe: None,
                mistake: None,
                together: Vec::new(),
                sets: None,
            })
        };
        let say = |verdict, summary, scatter| conclude(verdict, summary, scatter, false);
        if let Some(mistake) = self.mistake() {
            let said = say(DiagnosisVerdict::Undecided, mistake.summary(), scatter)?;
            return Ok(Conclusion { mistake: Some(mistake), ..said });
        }
        if nothing_missing >= SURE {
            let (verdict, summary) = self.nothing_claimed(&scatter);
            let outside =
                if verdict == DiagnosisVerdict::Unknown { nothing_missing + unknown } else { unknown };
            return Ok(Conclusion { outside, ..say(verdict, summary, scatter)? });
        }
        let best =
            self.tried.first().filter(|t| t.disqualified.is_none() && self.ranking.probabilities[0] > 0.0);
        let Some(best) = best.filter(|_| unknown < 1.0 - SURE) else { return self.several_or_unknown() };
        let left = best.drawing(base).scatter();
        if unknown > self.ranking.probabilities[0]
            || !explains(&left, base)
            || !is_enough(&UnknownCauseFit::beside_candidate(base, best)?)
        {
            return self.several_or_unknown();
        }
        let label = best.placed.label(base.fitter.rotor);
        if let Some(h) = self.held_out
            && h.worse
        {
            let why = format!(
                "{label} fits best but does not predict speeds that were left out (χ² {:.2} before, {:.2} after).",
                h.before, h.after
            );
            return say(DiagnosisVerdict::Undecided, why, left);
        }
        if let Some(group) = self.ranking.groups.first() {
            let others: Vec<&String> = group.iter().filter(|other| **other != label).collect();
            let from = match others[..] {
                [other] if other == NONE_OF_THESE => "a cause outside the list".into(),
                [other] => other.clone(),
                _ => format!("{} other candidates", others.len()),
            };
            if let (Some(words), Some(probe)) = (best.misreading(base), self.one_probe(group)) {
                let why = format!("{words}. The data cannot tell this from {from}.");
                let said = conclude(DiagnosisVerdict::Undecided, why, left, true)?;
                return Ok(Conclusion { bad_probe: Some(probe), ..said });
            }
            if let Some(why) = self.some_probe(group) {
                return conclude(DiagnosisVerdict::Undecided, why, left, true);
            }
            let why =
                format!("An effect is missing. {label} fits best, but the data cannot tell it from {from}.");
            return conclude(DiagnosisVerdict::Undecided, why, left, true);
        }
        let why = best.missing_in_words(base, self.ranking.best);
        let said = conclude(DiagnosisVerdict::Missing, why, left, true)?;
        Ok(Conclusion { bad_probe: best.probe(base), ..said })
    }

    /// The probe that all of these candidates and mistakes are about, if there is one.
    fn one_probe(&self, labels: &[String]) -> Option<String> {
        let rotor = self.base.fitter.rotor;
        let probe = |label: &String| {
            let candidate = self.tried.iter().find(|t| t.placed.label(rotor) == *label);
            let mistake = || self.mistaken.fits.iter().find(|m| m.mistake.label(rotor) == *label);
            match candidate {
                Some(t) => t.probe(self.base),
                None => mistake()?.mistake.probe().map(|p| rotor.probe[p].name.clone()),
            }
        };
        let mut probes = labels.iter().map(probe);
        let first = probes.next()??;
        probes.all(|other| other.as_ref() == Some(&first)).then_some(first)
    }

    /// The sentence on candidates that are all faults of probes; `None` where one of them is of the machine.
    fn some_probe(&self, labels: &[String]) -> Option<String> {
        let words = |label: &String| {
            let of_label = |t: &&CandidateFit| t.placed.label(self.base.fitter.rotor) == *label;
            self.tried.iter().find(of_label)?.misreading(self.base)
        };
        let words: Vec<String> = labels.iter().map(words).collect::<Option<_>>()?;
        Some(format!("A probe is off, and the data cannot tell which. {}.", words.join(", or: ")))
    }

    /// Verdict and summary where noise alone may be what is left.
    fn nothing_claimed(&self, scatter: &Scatter) -> (DiagnosisVerdict, String) {
        let base = self.base;
        let nothing_missing = self.ranking.nothing_missing;
        let probable = percent(nothing_missing);
        let noise = noise_in_words(scatter, base.closest().chi2_per_value());
        if !explains(scatter, base) {
            let why = format!(
                "No known effect explains the misfit, and the residual is not the stated noise ({noise}). Either the noise \
                 differs from the stated noise, or an unknown effect is missing."
            );
            return (DiagnosisVerdict::Unknown, why);
        }
        if nothing_missing < 0.5 {
            let why = format!(
                "An effect may be missing: noise alone explains the misfit with {probable} ({noise})."
            );
            return (DiagnosisVerdict::Undecided, why);
        }
        if let Some(reason) = self.reason_not_to_use() {
            let why = format!(
                "The model fits ({noise}), and no missing effect is visible in these data ({probable} probable). But it is \
                 not fit for balancing. {reason}"
            );
            return (DiagnosisVerdict::NotDetermined, why);
        }
        let why = format!(
            "The misfit is noise ({noise}). No missing effect is visible in these data ({probable} probable)."
        );
        (DiagnosisVerdict::Adequate, why)
    }

    /// The mistake in the files that is more probable than all effects and unknown causes together, and leaves nothing but noise.
    pub fn mistake(&self) -> Option<SuspectedMistake> {
        if let Some(unit) = self.unit {
            return Some(unit.clone());
        }
        let all =
            self.mistaken.fits.iter().zip(&self.ranking.mistakes).filter(|(m, _)| m.explained.is_some());
        let (fit, probability) = all.max_by(|a, b| a.1.total_cmp(b.1))?;
        (*probability > 0.5).then(|| SuspectedMistake {
            words: fit.mistake.words(self.base.fitter.rotor, fit.by),
            probability: Some(*probability),
            chi2_per_value: Some(fit.chi2_per_value),
        })
    }

    /// Why a model that fits is not to be used: its planes are not determined, or an effect that the file states is one that physics
    /// does not allow.
    fn reason_not_to_use(&self) -> Option<String> {
        let base = self.base;
        let stated =
            parameters::of_each(&base.hypothesis, &base.fit).into_iter().zip(&base.hypothesis.effects);
        let mut absurd = stated.filter_map(|(parameters, effect)| {
            let why = parameters::at_bounds(&parameters)?;
            Some(format!("{} in the file: {why}.", effect.label(base.fitter.rotor)))
        });
        absurd.next().or_else(|| self.determined.reason_undetermined())
    }

    /// No single effect is enough: several together, or something that is not in the list.
    fn several_or_unknown(&self) -> Result<Conclusion<'a>, Error> {
        let base = self.base;
        let misfit = base.closest().chi2_per_value();
        let sets = together(base, self.tried, self.unknown, self.reach)?;
        let outside = sets.outside(1.0 - self.ranking.nothing_missing);
        let is_named = |set: &&EffectSet| {
            (2..=REACH_OF_DIAGNOSIS.effects).contains(&set.added) && sets.unknown_odds < 1.0
        };
        if let Some(EffectSet { base: with, .. }) = sets.set.as_ref().filter(is_named) {
            let all = &with.hypothesis.effects[base.hypothesis.effects.len()..];
            let labels: Vec<String> = all.iter().map(|a| a.label(base.fitter.rotor)).collect();
            let summary = format!(
                "No single effect explains the misfit; {} together do (χ² per value {misfit:.2} → {:.2}). `improve` adds them.",
                labels.join(" and "),
                with.fit.chi2_per_value()
            );
            return Ok(Conclusion {
                verdict: DiagnosisVerdict::Undecided,
                summary,
                scatter: with.drawing.scatter(),
                outside,
                candidate_fits: false,
                bad_probe: None,
                mistake: None,
                together: labels,
                sets: Some(sets),
            });
        }
        let mut summary = format!(
            "An effect is missing that no known effect explains, nor two together (χ² per value {misfit:.2}, noise: 1)."
        );
        let bad = match suspect(base, self.tried, self.unknown)? {
            None => suspect_between_runs(base.fitter),
            found => found,
        };
        if let Some(SuspectProbe { words, probability, .. }) = &bad {
            summary = format!("{words} ({} probable). Beside that: {summary}", percent(*probability));
        }
        Ok(Conclusion {
            verdict: DiagnosisVerdict::Unknown,
            summary,
            scatter: self.unknown.best.scatter,
            outside,
            candidate_fits: false,
            bad_probe: bad.map(|bad| bad.name),
            mistake: None,
            together: Vec::new(),
            sets: Some(sets),
        })
    }
}

/// χ², and how the noise differs from the stated noise.
fn noise_in_words(scatter: &Scatter, chi2_per_value: f64) -> String {
    let mut words = format!("χ² per value {chi2_per_value:.2}");
    if (scatter.scale.ln()).abs() > 0.2 {
        words += &format!(", {:.2} times the stated noise", scatter.scale);
    }
    if scatter.between_runs > 0.01 {
        words += &format!(", {:.1} % of the response from run to run", 100.0 * scatter.between_runs);
    }
    if scatter.correlation > 0.3 {
        words += &format!(", correlated from reading to reading by {:.2}", scatter.correlation);
    }
    words
}

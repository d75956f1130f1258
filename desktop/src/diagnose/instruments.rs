//! Faults of probes: the sentence that names one, and how a probe is judged when an unknown cause is present too.

use super::answer::SURE;
use super::base::{BaseModel, CandidateFit};
use super::parameters;
use super::rank::{OUTSIDE, saturation};
use super::unknown::UnknownCauseFit;
use crate::error::Error;
use crate::fit::Fitter;
use crate::machine::place::Place;
use crate::statistics::significance::percent;

/// Runs whose differences are diagnosed at most, spread over all: enough for a probe, and the work does not grow with more.
const MOST_COMPARED: usize = 20;
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
    let alone = unknown.evidence + 2.0 * OUTSIDE.ln();
    let of_probe = |t: &&CandidateFit| t.probe(base).is_some();
    let beyond_unknown = |t: &&CandidateFit| t.evidence - price_of_place(tried) > alone;
    let suspects: Vec<&CandidateFit> = settled(tried).filter(of_probe).filter(beyond_unknown).collect();
    if suspects.is_empty() {
        return Ok(None);
    }
    let rivals = settled(tried).filter(|t| !of_probe(t)).take(RIVALS);
    let compared = beside_unknown(base, tried, suspects.into_iter().chain(rivals))?;
    Ok(most_probable(base, &compared, alone).filter(|probe| probe.probability >= 1.0 - SURE))
}

/// The same by the differences of runs alone, where nothing that is the same in all runs can be laid on a probe: there it is enough that
/// the probe with an unknown cause is more probable than all rivals with one, and by itself explains more than any other probe. Runs whose stated
/// weights explain the misfit best are left out, a third of them at most. `None` where runs cannot be compared.
pub fn suspect_between_runs(fitter: &Fitter) -> Option<SuspectProbe> {
    let mut data = fitter.data.clone();
    let all = data.rows.iter().map(|row| row.run).max().map_or(0, |last| last + 1);
    let runs = all.min(MOST_COMPARED);
    let chosen: Vec<usize> = (0..runs).map(|k| k * all / runs).collect();
    data.rows.retain(|row| chosen.contains(&row.run));
    for _ in 0..=runs / 3 {
        let differing = Fitter::new(fitter.rotor, data.differences_of_runs()?);
        let base = BaseModel::fit(&differing).ok().filter(|base| saturation(base).is_none())?;
        let tried = base.try_all().ok()?;
        let best = tried.first().filter(|t| t.evidence > price_of_place(&tried))?;
        let mut doubtful = best.placed.place;
        if !matches!(doubtful, Place::Run(_)) {
            let unknown = UnknownCauseFit::beside(&base).ok()?;
            let compared = beside_unknown(&base, &tried, settled(&tried)).ok()?;
            let (best, _) = compared.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
            doubtful = best.placed.place;
            if !matches!(doubtful, Place::Run(_)) {
                let found = most_probable(&base, &compared, unknown.evidence + 2.0 * OUTSIDE.ln());
                let strongest = settled(&tried).find_map(|t| t.probe(&base));
                let leads =
                    |found: &SuspectProbe| found.probability > 0.5 && strongest.as_ref() == Some(&found.name);
                return found.filter(leads);
            }
        }
        data.rows.retain(|row| row.listed.map(Place::Run) != Some(doubtful));
    }
    None
}

/// What a candidate pays for the places where it could have been.
fn price_of_place(tried: &[CandidateFit]) -> f64 {
    2.0 * (tried.len().max(1) as f64).ln()
}

/// Candidates that physics allows and whose noise and drawing are settled: evidence of others is none to compare by.
fn settled(tried: &[CandidateFit]) -> impl Iterator<Item = &CandidateFit> {
    tried.iter().filter(|t| t.disqualified.is_none() && t.is_settled)
}

/// Candidates with their evidence over the model, each with an unknown cause beside it where that explains more.
fn beside_unknown<'t>(
    base: &BaseModel,
    tried: &[CandidateFit],
    candidates: impl Iterator<Item = &'t CandidateFit>,
) -> Result<Vec<(&'t CandidateFit, f64)>, Error> {
    let of = |t: &'t CandidateFit| {
        let beside = UnknownCauseFit::beside_candidate(base, t)?.evidence + 2.0 * OUTSIDE.ln();
        Ok((t, t.evidence - price_of_place(tried) + beside.max(0.0)))
    };
    candidates.map(of).collect()
}

/// The most probable probe of these candidates, against all others and an unknown cause alone.
fn most_probable(base: &BaseModel, compared: &[(&CandidateFit, f64)], alone: f64) -> Option<SuspectProbe> {
    let suspects = compared.iter().filter(|(t, _)| t.probe(base).is_some());
    let (best, most) = suspects.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let name = best.probe(base)?;
    // a special case of what is wrong with a probe stands for the same probe
    let (same, rest): (Vec<_>, Vec<_>) =
        compared.iter().partition(|(t, _)| t.probe(base).as_ref() == Some(&name));
    let odds = |evidence: f64| (0.5 * (evidence - most)).exp();
    let of_probe: f64 = same.iter().map(|(_, evidence)| odds(*evidence)).sum();
    let of_rest: f64 = odds(alone) + rest.iter().map(|(_, evidence)| odds(*evidence)).sum::<f64>();
    let probability = of_probe / (of_probe + of_rest);
    let words = best.misreading(base)?;
    Some(SuspectProbe { name, words, probability })
}

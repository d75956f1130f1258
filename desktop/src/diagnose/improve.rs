//! Adding effects to a model: one on request, or one after another until it is adequate.

use super::answer::{Candidate, RIVAL, SURE, Verdict};
use super::as_file::as_file;
use super::base::{Base, Tried, same};
use super::diagnosis::diagnose;
use super::rank::rank;
use super::{checks, parameters};
use crate::effects::entry;
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::fit::hypothesis::Assumed;
use crate::identify::assumed_noise;
use crate::machine::drawing::Rotor;
use crate::measurement::Reading;

/// Effects that `improve` adds at most: no machine hides more, and each needs data of its own.
const MOST_EFFECTS: usize = 4;
/// Sets of effects that are followed side by side, those that differ by a special case counted once. An effect that is
/// not there can be enough for one step and stand in the way of those that are.
const BEAM: usize = 8;

/// A model with an effect more.
#[derive(Debug, Clone)]
pub struct Improvement {
    /// The new file: bearings, planes and effects as fitted.
    pub rotor: Rotor,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) before.
    pub error_before: f64,
    /// The same after.
    pub error_after: f64,
    /// χ² per measured real number before and after.
    pub chi2_per_value: [f64; 2],
    /// The effect that was added.
    pub added: Candidate,
}

/// One step of `improve`.
#[derive(Debug, Clone)]
pub struct Step {
    /// The effect that was added, its parameters as fitted together with all the others.
    pub added: Candidate,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) with it.
    pub error_after: f64,
    /// χ² per measured real number with it.
    pub chi2_per_value: f64,
    /// Sets of effects that explain the data as well as all that were added, this set included.
    pub group: Vec<String>,
    /// The file with it and what was added before.
    pub rotor: Rotor,
}

/// Fits one named effect together with bearings, planes and the effects that the file has, and returns
/// the file with all of them.
///
/// # Errors
/// If there is no such effect or place, the effect is present already, or it cannot be fitted.
pub fn add(rotor: &Rotor, readings: &[Reading], kind: &str, at: Option<&str>) -> Result<Improvement, Error> {
    let (effect, place) = entry::resolve(rotor, kind, at).map_err(Error::Unsuitable)?;
    let assumed = Assumed { effect, place };
    let noise = rotor.noise.unwrap_or_else(|| assumed_noise(readings));
    let fitter = Fitter::new(rotor, Data::new(rotor, &noise, readings));
    checks::before(rotor, readings)?;
    checks::enough(&fitter)?;
    let base = Base::fit(&fitter)?;
    checks::after(&base, rotor, readings, &noise)?;
    let present = base.hypothesis.effects.iter().any(|e| same(e, &assumed));
    if let Some(why) = present.then_some("is already in the model").or(effect.not_sought(rotor)) {
        return Err(Error::Unsuitable(format!("{} {why}", assumed.label(rotor))));
    }
    let mut tried = base.attempt(assumed)?;
    if !fitter.drawing_is_exact() {
        base.refine(&mut tried)?;
    }
    base.finish(&mut tried)?;
    let with = base.hypothesis.with(assumed);
    Ok(Improvement {
        rotor: fitter.corrected(as_file(&with, &tried.fit), &tried.fit, tried.drawing(&base)),
        error_before: base.relative_error(&base.fit),
        error_after: base.relative_error(&tried.fit),
        chi2_per_value: [base.fit.chi2_per_value(), tried.fit.chi2_per_value()],
        added: base.candidate(&tried, f64::NAN),
    })
}

/// What `improve` made of a model.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The new file.
    pub rotor: Rotor,
    /// Effects in the order in which they were found.
    pub steps: Vec<Step>,
    /// The last diagnosis.
    pub verdict: Verdict,
    /// Why, in one sentence.
    pub summary: String,
    /// What the last diagnosis tried on top and did not add, most probable first.
    pub candidates: Vec<Candidate>,
    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²) of the model at the start.
    pub error_before: f64,
    /// χ² per measured real number of the model at the start.
    pub chi2_per_value_before: f64,
}

/// Fits bearings and planes and adds effects until the model is adequate, or nothing that is left explains
/// more than noise. Where rivals cannot be told apart the best of them is added: they predict this machine alike.
///
/// Effects that hide together can mislead a search for one: the best few sets are followed side by side, and the one that
/// explains most is kept. `progress` hears of each effect of that set.
///
/// # Errors
/// As [`super::diagnose`].
pub fn improve(
    rotor: &Rotor,
    readings: &[Reading],
    mut progress: impl FnMut(&Step),
) -> Result<Outcome, Error> {
    let at_start = diagnose(rotor, readings)?;
    let mut outcome = Outcome {
        rotor: rotor.clone(),
        steps: Vec::new(),
        verdict: at_start.verdict,
        summary: at_start.summary.clone(),
        candidates: at_start.candidates,
        error_before: at_start.error_before,
        chi2_per_value_before: at_start.chi2_per_value,
    };
    if at_start.saturated {
        return Ok(outcome);
    }
    let noise = rotor.noise.unwrap_or_else(|| assumed_noise(readings));
    let fitter = Fitter::new(rotor, Data::new(rotor, &noise, readings));
    if at_start.nothing_missing >= SURE {
        let base = Base::fit(&fitter)?;
        outcome.rotor = fitter.corrected(as_file(&base.hypothesis, &base.fit), &base.fit, &base.drawing);
        return Ok(outcome);
    }
    let own = rotor.effect.len();
    let (mut best, rivals) = best_set(&fitter)?;
    best.fit.covariance = fitter.covariance(&best.hypothesis, &best.fit, &best.drawing)?;
    let joint = parameters::of_each(&best.hypothesis, &best.fit);
    let mut left: Vec<usize> = (own..best.hypothesis.effects.len()).collect();
    while !left.is_empty() {
        let set: Vec<Assumed> = left.iter().map(|i| best.hypothesis.effects[*i]).collect();
        let (k, better) = strongest(&outcome.rotor, readings, &set)?;
        let index = left.remove(k);
        let last = left.is_empty();
        let step = Step {
            error_after: if last { best.relative_error(&best.fit) } else { better.error_after },
            chi2_per_value: if last { best.fit.chi2_per_value() } else { better.chi2_per_value[1] },
            group: if last { rivals.clone() } else { Vec::new() },
            added: Candidate { parameters: joint[index].clone(), ..better.added },
            rotor: better.rotor.clone(),
        };
        progress(&step);
        outcome.steps.push(step);
        outcome.rotor = better.rotor;
    }
    outcome.rotor = fitter.corrected(as_file(&best.hypothesis, &best.fit), &best.fit, &best.drawing);
    let now = diagnose(&outcome.rotor, readings)?;
    (outcome.verdict, outcome.summary, outcome.candidates) = (now.verdict, now.summary, now.candidates);
    Ok(outcome)
}

/// The smallest set of effects after which nothing is missing, and the sets that rival it.
fn best_set<'a>(fitter: &'a Fitter<'a>) -> Result<(Base<'a>, Vec<String>), Error> {
    let mut beam = vec![Base::fit(fitter)?];
    let mut rivals = Vec::new();
    for _ in 0..MOST_EFFECTS {
        let mut tried = vec![beam[0].try_all()?];
        if rank(&beam[0], &tried[0]).nothing_missing >= SURE {
            break;
        }
        for base in &beam[1..] {
            tried.push(base.try_all()?);
        }
        let allowed = |t: &&Tried| t.disqualified.is_none();
        let children = tried
            .iter()
            .zip(&beam)
            .flat_map(|(all, base)| all.iter().filter(allowed).map(move |t| (base, t)));
        let mut children: Vec<(&Base, &Tried)> = children.collect();
        children.sort_by(|a, b| a.1.fit.bic().total_cmp(&b.1.fit.bic()));
        let mut seen: Vec<Vec<String>> = Vec::new();
        children.retain(|(base, t)| {
            let set = labels(base, t);
            let new = !seen.contains(&set);
            seen.push(set);
            new
        });
        let Some((_, best)) = children.first() else { break };
        let near = best.fit.bic() + 2.0 * (1.0 / RIVAL).ln();
        let equals: Vec<String> = children
            .iter()
            .filter(|(_, t)| t.fit.bic() < near)
            .map(|(base, t)| labels(base, t).join(" + "))
            .collect();
        // a special case and what it is a case of lead the same way: together they count once
        let mut ways: Vec<Vec<String>> = Vec::new();
        let followed = children.iter().take_while(|(base, t)| {
            let way = labels_of(base, t, |a| a.general_label(base.fitter.rotor));
            if !ways.contains(&way) {
                ways.push(way);
            }
            ways.len() <= BEAM
        });
        let many = followed.count();
        children.truncate(many);
        let kept: Result<Vec<Base>, Error> = children
            .iter()
            .map(|(base, t)| Base::settle(fitter, base.hypothesis.with(t.assumed), base.scaled_for_file(t)))
            .collect();
        rivals = if equals.len() > 1 { equals } else { Vec::new() };
        beam = kept?;
        beam.sort_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()));
    }
    Ok((beam.swap_remove(0), rivals))
}

/// Labels of a base's effects and one more, sorted.
fn labels(base: &Base, t: &Tried) -> Vec<String> {
    labels_of(base, t, |a| a.label(base.fitter.rotor))
}

fn labels_of(base: &Base, t: &Tried, label: impl Fn(&Assumed) -> String) -> Vec<String> {
    let all = base.hypothesis.effects.iter().chain([&t.assumed]);
    let mut labels: Vec<String> = all.map(label).collect();
    labels.sort();
    labels
}

/// The effect of a set that explains most on top of a model.
fn strongest(rotor: &Rotor, readings: &[Reading], set: &[Assumed]) -> Result<(usize, Improvement), Error> {
    let mut best: Option<(usize, Improvement)> = None;
    for (k, a) in set.iter().enumerate() {
        let better = add(rotor, readings, a.effect.name(), a.place.name(rotor))?;
        if best.as_ref().is_none_or(|(_, b)| better.chi2_per_value[1] < b.chi2_per_value[1]) {
            best = Some((k, better));
        }
    }
    best.ok_or_else(|| Error::Unsuitable("there is no effect to add".into()))
}

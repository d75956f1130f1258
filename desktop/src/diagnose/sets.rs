//! Several effects at once.
//!
//! Effects that hide together can mislead a search for one: the best few sets are followed side by side, each
//! grown by one effect at a time, until nothing is missing beside the best.

use rayon::prelude::*;

use super::answer::{RIVAL, SURE};
use super::base::{BaseModel, CandidateFit, explains};
use super::rank::{OUTSIDE, rank};
use super::unknown::UnknownCauseFit;
use crate::error::Error;
use crate::fit::Fit;
use crate::fit::hypothesis::PlacedEffect;

#[derive(Debug, Clone, Copy)]
pub struct SearchReach {
    /// Sets that are followed side by side, those that differ by a special case counted once: an effect that is not there
    /// can be enough for one step and stand in the way of those that are.
    pub width: usize,
    /// Effects that are looked for at most.
    pub effects: usize,
}

/// Larger sets that are settled before the best of them are followed, as a multiple of those.
const SETTLED: usize = 2;
/// Special cases of one effect at one place that are followed beside it, at most, and the effect.
const ALIKE: usize = 3;

/// A set of effects beside a model.
pub struct EffectSet<'a> {
    /// The model with the effects of the set.
    pub base: BaseModel<'a>,
    /// What it was when the last one was added: labels of the sets that explain the data as well, this one included;
    /// empty if there are none.
    pub rivals: Vec<String>,
    /// How many effects were added.
    pub added: usize,
}

/// The smallest set of effects after which nothing is missing, or the best one within reach; `None` if nothing can be
/// added.
///
/// # Errors
/// If the machine is singular.
fn best_set<'a>(
    base: &BaseModel<'a>,
    tried: &[CandidateFit],
    reach: SearchReach,
) -> Result<Option<EffectSet<'a>>, Error> {
    let SearchReach { width, effects } = reach;
    let Some(mut beam) = grown(base, &[(base, tried)], width) else { return Ok(None) };
    let mut added = 1;
    while added < effects {
        let mut tried = vec![beam.sets[0].try_likely()?];
        let places = beam.sets[0].possible().len();
        if rank(&beam.sets[0], &tried[0], places, None, None).nothing_missing >= SURE {
            break;
        }
        for set in &beam.sets[1..] {
            let mut sought = set.try_likely_unsettled()?;
            // no more of one set are followed, and each keeps its fit to all readings
            sought.truncate(ALIKE * SETTLED * width);
            tried.push(sought);
        }
        let parents: Vec<(&BaseModel, &[CandidateFit])> =
            beam.sets.iter().zip(&tried).map(|(b, t)| (b, t.as_slice())).collect();
        let Some(next) = grown(base, &parents, width) else { break };
        beam = next;
        added += 1;
    }
    Ok(Some(EffectSet { base: beam.sets.swap_remove(0), rivals: beam.rivals, added }))
}

/// Several effects together against something that no effect is.
pub struct SetComparison<'a> {
    /// The effects, where they explain the data and nothing more is needed beside them.
    pub set: Option<EffectSet<'a>>,
    /// Odds of something outside the list over them.
    pub unknown_odds: f64,
}

impl SetComparison<'_> {
    /// Probability that something outside the list is missing, of that which is missing with this one.
    pub fn outside(&self, missing: f64) -> f64 {
        missing / (1.0 + self.unknown_odds.recip())
    }
}

/// Looks for several effects and weighs them against an unknown cause: each effect pays for the places where it could
/// sit, the noise that is left must be what was stated, and every parameter one that physics allows.
///
/// # Errors
/// If the machine is singular.
pub fn together<'a>(
    base: &BaseModel<'a>,
    tried: &[CandidateFit],
    unknown: &UnknownCauseFit,
    reach: SearchReach,
) -> Result<SetComparison<'a>, Error> {
    let nothing = SetComparison { set: None, unknown_odds: f64::INFINITY };
    let Some(set) = best_set(base, tried, reach)? else { return Ok(nothing) };
    let explained = explains(&set.base.drawing.scatter(), base) && set.base.is_physical()?;
    let enough = explained && is_enough(&UnknownCauseFit::beside(&set.base)?);
    if !enough {
        return Ok(nothing);
    }
    let places = 2.0 * (tried.len().max(1) as f64).ln();
    let evidence = base.fitter.evidence(&base.fit, &set.base.fit) - set.added as f64 * places;
    let unknown_odds = OUTSIDE * (0.5 * (unknown.evidence - evidence)).exp();
    Ok(SetComparison { set: Some(set), unknown_odds })
}

/// Whether an unknown cause beside an explanation explains no more than chance would let it.
pub fn is_enough(beside: &UnknownCauseFit) -> bool {
    OUTSIDE * (0.5 * beside.evidence).exp() < 1.0
}

/// Sets of one size.
struct Beam<'a> {
    /// Settled, best first.
    sets: Vec<BaseModel<'a>>,
    /// Labels of those that the data cannot tell from the best; empty if there is none beside it.
    rivals: Vec<String>,
}

/// A set with its evidence over the model that all began from: the set it grew from, and what was added.
type Child<'b, 'a> = (f64, &'b BaseModel<'a>, &'b CandidateFit);

/// All sets with one effect more, best first.
fn children<'b, 'a>(
    start: &BaseModel<'a>,
    parents: &[(&'b BaseModel<'a>, &'b [CandidateFit])],
) -> Vec<Child<'b, 'a>> {
    let allowed = |t: &&CandidateFit| t.disqualified.is_none();
    let mut children: Vec<Child> = match parents {
        [(base, all)] => all.iter().filter(allowed).map(|t| (t.evidence, *base, t)).collect(),
        // of most of them only what they are worth in the search is known
        _ => (parents.iter())
            .map(|(base, all)| (base.sought_over(start), base, all))
            .flat_map(|(sought, base, all)| {
                all.iter().filter(allowed).map(move |t| (sought + t.sought, *base, t))
            })
            .collect(),
    };
    children.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut seen: Vec<Vec<String>> = Vec::new();
    children.retain(|(_, base, t)| {
        let set = labels(base, t);
        let new = !seen.contains(&set);
        seen.push(set);
        new
    });
    children
}

/// The best sets with one effect more, by their evidence over the model that all began from.
fn grown<'a>(
    start: &BaseModel<'a>,
    parents: &[(&BaseModel<'a>, &[CandidateFit])],
    width: usize,
) -> Option<Beam<'a>> {
    let evidence = |fit: &Fit| start.fitter.evidence(&start.fit, fit);
    let children = children(start, parents);
    let (best, ..) = children.first()?;
    let near = best + 2.0 * RIVAL.ln();
    let mut equals: Vec<String> = (children.iter())
        .filter(|(evidence, ..)| *evidence > near)
        .map(|(_, base, t)| labels(base, t).join(" + "))
        .collect();
    // a special case and what it is a case of lead the same way: together they count once
    let mut ways: Vec<Vec<String>> = Vec::new();
    let settled_ways = if parents.len() > 1 { SETTLED * width } else { width };
    let followed = children.iter().take_while(|(_, base, t)| {
        let way = labels_of(base, t, |a| a.general_label(base.fitter.rotor));
        if !ways.contains(&way) {
            ways.push(way);
        }
        ways.len() <= settled_ways
    });
    let many = followed.count();
    // a set with which the machine is singular from every start explains nothing
    let settled = |(_, base, t): &Child<'_, 'a>| {
        let base: BaseModel = base.grown(t).ok()?;
        Some((!base.is_physical().ok()?, base))
    };
    let mut kept: Vec<(bool, BaseModel)> = children[..many].par_iter().filter_map(settled).collect();
    // a set that physics does not allow can lead to one that it does, but is not the answer while there is another
    kept.sort_by(|a, b| a.0.cmp(&b.0).then(evidence(&b.1.fit).total_cmp(&evidence(&a.1.fit))));
    if parents.len() > 1 {
        // most children were not refined, so that rivals are sought among the sets that were settled and that physics allows
        let near = evidence(&kept.first()?.1.fit) + 2.0 * RIVAL.ln();
        let rivals = kept.iter().filter(|(unphysical, base)| !unphysical && evidence(&base.fit) > near);
        equals = rivals.map(|(_, base)| effect_labels(base).join(" + ")).collect();
    }
    let mut sets: Vec<BaseModel> = kept.into_iter().map(|(_, base)| base).collect();
    if parents.len() > 1 {
        // special cases were settled beside what they are cases of, and count from here on like any other
        sets.truncate(width);
    }
    // none if the machine is singular with each of them
    sets.first()?;
    Some(Beam { sets, rivals: if equals.len() > 1 { equals } else { Vec::new() } })
}

/// Labels of a base's effects, sorted.
fn effect_labels(base: &BaseModel) -> Vec<String> {
    sorted(base.hypothesis.effects.iter(), |a| a.label(base.fitter.rotor))
}

/// Labels of a base's effects and one more, sorted.
fn labels(base: &BaseModel, t: &CandidateFit) -> Vec<String> {
    labels_of(base, t, |a| a.label(base.fitter.rotor))
}

fn labels_of(base: &BaseModel, t: &CandidateFit, label: impl Fn(&PlacedEffect) -> String) -> Vec<String> {
    sorted(base.hypothesis.effects.iter().chain([&t.placed]), label)
}

fn sorted<'e>(
    effects: impl Iterator<Item = &'e PlacedEffect>,
    label: impl Fn(&PlacedEffect) -> String,
) -> Vec<String> {
    let mut labels: Vec<String> = effects.map(label).collect();
    labels.sort();
    labels
}

//! Several effects at once.
//!
//! Effects that hide together can mislead a search for one: the best few sets are followed side by side, each
//! grown by one effect at a time, until nothing is missing beside the best.

use super::answer::{RIVAL, SURE};
use super::base::{Base, Tried};
use super::rank::{explains, rank};
use crate::error::Error;

/// Effects that are looked for at most: no machine hides more, and each needs data of its own.
const MOST_EFFECTS: usize = 4;

/// A set of effects beside a model.
pub struct Set<'a> {
    /// The model with them.
    pub base: Base<'a>,
    /// What it was when the last one was added: labels of the sets that explain the data as well, this one included;
    /// empty if there are none.
    pub rivals: Vec<String>,
    /// How many effects were added.
    pub added: usize,
}

/// The smallest set of effects after which nothing is missing, or the best one that was reached; `width` sets are
/// followed side by side. `None` if nothing can be added.
///
/// # Errors
/// If the machine is singular.
pub fn best_set<'a>(base: &Base<'a>, tried: &[Tried], width: usize) -> Result<Option<Set<'a>>, Error> {
    let Some(mut beam) = grown(&[(base, tried)], width)? else { return Ok(None) };
    let mut added = 1;
    while added < MOST_EFFECTS {
        let tried: Result<Vec<Vec<Tried>>, Error> = beam.sets.iter().map(Base::try_all).collect();
        let tried = tried?;
        if rank(&beam.sets[0], &tried[0], None).nothing_missing >= SURE {
            break;
        }
        let parents: Vec<(&Base, &[Tried])> =
            beam.sets.iter().zip(&tried).map(|(b, t)| (b, t.as_slice())).collect();
        let Some(next) = grown(&parents, width)? else { break };
        beam = next;
        added += 1;
    }
    Ok(Some(Set { base: beam.sets.swap_remove(0), rivals: beam.rivals, added }))
}

/// Sets of one size.
struct Beam<'a> {
    /// Settled, best first.
    sets: Vec<Base<'a>>,
    /// Labels of those that the data cannot tell from the best; empty if there is none beside it.
    rivals: Vec<String>,
}

/// The best sets with one effect more.
fn grown<'a>(parents: &[(&Base<'a>, &[Tried])], width: usize) -> Result<Option<Beam<'a>>, Error> {
    let allowed = |t: &&Tried| t.disqualified.is_none();
    let mut children: Vec<(&Base, &Tried)> = (parents.iter())
        .flat_map(|(base, all)| all.iter().filter(allowed).map(move |t| (*base, t)))
        .collect();
    children.sort_by(|a, b| a.1.fit.bic().total_cmp(&b.1.fit.bic()));
    let mut seen: Vec<Vec<String>> = Vec::new();
    children.retain(|(base, t)| {
        let set = labels(base, t);
        let new = !seen.contains(&set);
        seen.push(set);
        new
    });
    let Some((parent, best)) = children.first() else { return Ok(None) };
    let width = if explains(&best.drawing(parent).scatter(), parent) { 1 } else { width };
    let near = best.fit.bic() + 2.0 * (1.0 / RIVAL).ln();
    let equals: Vec<String> = (children.iter())
        .filter(|(_, t)| t.fit.bic() < near)
        .map(|(base, t)| labels(base, t).join(" + "))
        .collect();
    let settle = |(base, t): &(&Base<'a>, &Tried)| {
        Base::settle(base.fitter, base.hypothesis.with(t.assumed), base.scaled_for_file(t))
    };
    let kept: Result<Vec<Base>, Error> = children.iter().take(width).map(settle).collect();
    let mut kept = kept?;
    kept.sort_by(|a, b| a.fit.bic().total_cmp(&b.fit.bic()));
    Ok(Some(Beam { sets: kept, rivals: if equals.len() > 1 { equals } else { Vec::new() } }))
}

/// Labels of a base's effects and one more, sorted.
fn labels(base: &Base, t: &Tried) -> Vec<String> {
    let all = base.hypothesis.effects.iter().chain([&t.assumed]);
    let mut labels: Vec<String> = all.map(|a| a.label(base.fitter.rotor)).collect();
    labels.sort();
    labels
}

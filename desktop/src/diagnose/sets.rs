//! Several effects at once.
//!
//! Effects that hide together can mislead a search for one: the best few sets are followed side by side, each
//! grown by one effect at a time, until nothing is missing beside the best.

use rayon::prelude::*;

use super::answer::SURE;
use super::base::{BaseModel, CandidateFit, UnfittedModel, explains, same};
use super::rank::{OUTSIDE, rank};
use super::rivals::{ComparedSet, SettledCost, rivals};
use super::screening::leaves_no_more;
use super::unknown::UnknownCauseFit;
use crate::error::Error;
use crate::fit::hypothesis::PlacedEffect;
use crate::statistics::scatter::Scatter;

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
    let Some(mut beam) = Beam::of_one(base, tried, width) else { return Ok(None) };
    let mut added = 1;
    while added < effects {
        // beside other sets, candidates are compared in the noise and drawing of the search
        let of_lead = match beam.others.is_empty() {
            true => beam.lead.try_likely()?,
            false => beam.lead.try_likely_settled_if_explained()?,
        };
        let mut tried = vec![of_lead];
        let places = beam.lead.possible().len();
        if rank(&beam.lead, &tried[0], places, None, None).nothing_missing >= SURE {
            break;
        }
        let enough = match tried[0].first().filter(|_| !beam.others.is_empty()) {
            Some(best) => noise_of_enough(&beam.lead, best)?,
            None => None,
        };
        let others = beam.others(enough.as_ref())?;
        for set in &others {
            let mut sought = set.try_likely_unsettled()?;
            // no more of one set are followed, and each keeps its fit to all readings
            sought.truncate(ALIKE * SETTLED * width);
            tried.push(sought);
        }
        let sets = std::iter::once(&beam.lead).chain(&others);
        let parents: Vec<(&BaseModel, &[CandidateFit])> =
            sets.zip(&tried).map(|(b, t)| (b, t.as_slice())).collect();
        let chosen = ChosenSets::of(base, &parents, width, enough.as_ref());
        // of many readings, sets of two sizes and their candidates would be most of the memory
        drop((others, tried));
        let Some(next) = chosen.and_then(|chosen| chosen.grown(base, width)) else { break };
        beam = next;
        added += 1;
    }
    Ok(Some(EffectSet { base: beam.lead, rivals: beam.rivals, added }))
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
struct Beam<'b, 'a> {
    /// The best, settled.
    lead: BaseModel<'a>,
    /// Those that are followed beside it.
    others: Vec<Followed<'b, 'a>>,
    /// Labels of those that the data cannot tell from the best; empty if there is none beside it.
    rivals: Vec<String>,
}

/// A set of effects that is followed beside the best one of its size.
enum Followed<'b, 'a> {
    Settled(Box<BaseModel<'a>>),
    /// What was added to which model: it is settled when it is needed.
    Candidate(&'b BaseModel<'a>, &'b CandidateFit),
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

/// How many of these children are followed: so many ways, where a special case and what it is a case of lead the same way and count once.
fn followed(children: &[Child], ways: usize) -> usize {
    let mut seen: Vec<Vec<String>> = Vec::new();
    let is_followed = |(_, base, t): &&Child| {
        let way = labels_of(base, t, |a| a.general_label(base.fitter.rotor));
        if !seen.contains(&way) {
            seen.push(way);
        }
        seen.len() <= ways
    };
    children.iter().take_while(is_followed).count()
}

fn compared_child((evidence, base, t): &Child) -> ComparedSet {
    ComparedSet {
        effects: base.hypothesis.with(t.placed).effects,
        label: labels(base, t).join(" + "),
        evidence: *evidence,
        cost: t.is_settled.then(|| SettledCost::of(&t.fit)),
    }
}

impl<'b, 'a> Beam<'b, 'a> {
    /// Sets of one effect, by their evidence over the model without it. Those that are followed beside the best are not settled yet.
    fn of_one(base: &'b BaseModel<'a>, tried: &'b [CandidateFit], width: usize) -> Option<Self> {
        let children = children(base, &[(base, tried)]);
        let rivals = rivals(children.iter().map(compared_child));
        let mut ways = children[..followed(&children, width)].iter();
        let grown = |(_, base, t): &Child<'_, 'a>| base.grown(t).ok();
        let lead = ways.find_map(grown)?;
        let others = ways.map(|(_, base, t)| Followed::Candidate(base, t)).collect();
        Some(Self { lead, others, rivals })
    }

    /// The sets beside the best that are followed on, settled. Where the best leaves no more than this noise with another effect, those are
    /// left out that leave more with every effect that makes a set which the best, or one before, does not lead to.
    fn others(&mut self, enough: Option<&Scatter>) -> Result<Vec<BaseModel<'a>>, Error> {
        let mut led_from = vec![self.lead.hypothesis.effects.clone()];
        let mut kept = Vec::with_capacity(self.others.len());
        for set in std::mem::take(&mut self.others) {
            let effects = set.effects();
            let is_rival = match enough {
                None => true,
                Some(noise) => set.can_leave_only_noise_with(noise, &|a: &PlacedEffect| {
                    let has = |b: &PlacedEffect| same(a, b) || effects.iter().any(|own| same(own, b));
                    !led_from.iter().any(|from| from.iter().all(has))
                })?,
            };
            if is_rival {
                led_from.push(effects);
                kept.push(set);
            }
        }
        Ok(kept.into_par_iter().filter_map(Followed::settled).collect())
    }
}

/// Sets of one size that are worth settling, before they are.
struct ChosenSets<'a> {
    sets: Vec<UnfittedModel<'a>>,
    /// Of sets that grew from one model, labels of those that rival the best.
    rivals: Option<Vec<String>>,
}

impl<'a> ChosenSets<'a> {
    /// The best sets with one effect more, by their evidence over the model that all began from; where one leaves no more than noise that is
    /// `enough`, those alone that do. `None` if there is none.
    fn of(
        start: &BaseModel<'a>,
        parents: &[(&BaseModel<'a>, &[CandidateFit])],
        width: usize,
        enough: Option<&Scatter>,
    ) -> Option<Self> {
        let mut children = children(start, parents);
        if let Some(noise) = enough {
            children.retain(|(_, base, t)| leaves_no_more(base.fitter, &t.fit, t.drawing(base), noise));
        }
        let of_one = parents.len() == 1;
        let rivals = of_one.then(|| rivals(children.iter().map(compared_child)));
        let many = followed(&children, if of_one { width } else { SETTLED * width });
        Some(Self {
            sets: children[..many].iter().map(|(_, base, t)| base.unfitted_with(t)).collect(),
            rivals,
        })
    }

    /// These sets settled, and of them so many as are followed; `None` if there is none.
    fn grown<'b>(self, start: &BaseModel<'a>, width: usize) -> Option<Beam<'b, 'a>> {
        let settled = self.sets.into_par_iter().filter_map(|set| SettledSet::of(set, start));
        let kept = settled.fold(Vec::new, |all, set| best_first(all, [set])).reduce(Vec::new, best_first);
        // special cases were settled beside what they are cases of, and count from here on like any other
        let most = if self.rivals.is_some() { kept.len() } else { width };
        let rivals = match self.rivals {
            Some(rivals) => rivals,
            None => {
                // most children were not refined, so that rivals are sought among the sets that were settled and that physics allows
                rivals(kept.iter().filter(|set| set.is_physical).map(SettledSet::compared))
            }
        };
        let mut sets = kept.into_iter().map(|set| set.base).take(most);
        let lead = sets.next()?;
        let others = sets.map(|set| Followed::Settled(Box::new(set))).collect();
        Some(Beam { lead, others, rivals })
    }
}

/// A set of effects whose noise and drawing errors are settled, to be compared with other sets of its size.
struct SettledSet<'a> {
    is_physical: bool,
    /// Over the model that all began from.
    evidence: f64,
    /// Of the fit to be compared, which a set that is kept for the search does without.
    cost: SettledCost,
    base: BaseModel<'a>,
}

impl<'a> SettledSet<'a> {
    fn of(set: UnfittedModel<'a>, start: &BaseModel<'a>) -> Option<Self> {
        let base = set.grown().ok()?;
        let evidence = start.fitter.evidence(&start.fit, &base.fit);
        let cost = SettledCost::of(&base.fit);
        Some(Self { is_physical: base.is_physical().ok()?, evidence, cost, base })
    }

    fn compared(&self) -> ComparedSet {
        let Self { evidence, cost, ref base, .. } = *self;
        let label = effect_labels(base).join(" + ");
        ComparedSet { effects: base.hypothesis.effects.clone(), label, evidence, cost: Some(cost) }
    }

    /// The set as far as candidates are sought beside it.
    fn for_search(self) -> Self {
        Self { base: self.base.for_search(), ..self }
    }
}

/// Two lists as one, the best set first, which alone keeps its own drawing: those of many sets would be most of the memory. A set that
/// physics does not allow can lead to one that it does, but is not the answer while there is another.
fn best_first<'a>(
    mut all: Vec<SettledSet<'a>>,
    more: impl IntoIterator<Item = SettledSet<'a>>,
) -> Vec<SettledSet<'a>> {
    all.extend(more);
    all.sort_by(|a, b| b.is_physical.cmp(&a.is_physical).then(b.evidence.total_cmp(&a.evidence)));
    let mut all = all.into_iter();
    let lead = all.next();
    lead.into_iter().chain(all.map(SettledSet::for_search)).collect()
}

impl<'a> Followed<'_, 'a> {
    fn settled(self) -> Option<BaseModel<'a>> {
        match self {
            Self::Settled(base) => Some(*base),
            Self::Candidate(base, t) => base.grown(t).ok(),
        }
    }

    fn effects(&self) -> Vec<PlacedEffect> {
        match self {
            Self::Settled(base) => base.hypothesis.effects.clone(),
            Self::Candidate(base, t) => base.hypothesis.with(t.placed).effects,
        }
    }

    fn can_leave_only_noise_with(
        &self,
        noise: &Scatter,
        is_asked: &(dyn Fn(&PlacedEffect) -> bool + Sync),
    ) -> Result<bool, Error> {
        match self {
            Self::Settled(base) => base.can_leave_only_noise_with(noise, is_asked),
            Self::Candidate(base, t) => base.with_unsettled(t).can_leave_only_noise_with(noise, is_asked),
        }
    }
}

/// The noise that a candidate leaves beside a model if both together explain the data, on the drawing as stated too: then what else
/// explains them leaves no more than that.
fn noise_of_enough(base: &BaseModel, t: &CandidateFit) -> Result<Option<Scatter>, Error> {
    let noise = t.drawing(base).scatter();
    let enough = t.is_settled
        && t.disqualified.is_none()
        && explains(&noise, base)
        && is_enough(&UnknownCauseFit::beside_candidate(base, t)?)
        && base.with_unsettled(t).leaves_only_noise(&noise)?;
    Ok(enough.then_some(noise))
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

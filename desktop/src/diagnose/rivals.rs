//! Which sets of effects the data cannot tell from the best one.

use super::answer::{RIVAL, SURE};
use super::base::same;
use crate::compare::upper_tail;
use crate::fit::Fit;
use crate::fit::hypothesis::PlacedEffect;

/// What a fit under its own noise costs, and with how many unknowns.
#[derive(Debug, Clone, Copy)]
pub struct SettledCost {
    cost: f64,
    effect_unknowns: usize,
}

impl SettledCost {
    pub fn of(fit: &Fit) -> Self {
        Self { cost: fit.cost, effect_unknowns: fit.effect_unknowns }
    }
}

/// Whether a general model gains no more over its special case than noise would: the cost falls by a χ² with as many degrees of freedom as
/// it has further unknowns.
pub fn gains_no_more_than_noise(general: &SettledCost, case: &SettledCost) -> bool {
    let more = general.effect_unknowns.saturating_sub(case.effect_unknowns);
    more > 0 && upper_tail((case.cost - general.cost).max(0.0), more) >= SURE
}

/// A set of effects as one to be told from others.
pub struct ComparedSet {
    pub effects: Vec<PlacedEffect>,
    pub label: String,
    /// Over the model that all began from.
    pub evidence: f64,
    /// `None` where the fit is not settled.
    pub cost: Option<SettledCost>,
}

impl ComparedSet {
    /// Whether this set has the effects of another, some of them in a more general form, and gains no more by it than noise would.
    fn is_seen_as(&self, case: &Self) -> bool {
        let beyond = |own: &Self, other: &Self| -> Vec<PlacedEffect> {
            own.effects.iter().filter(|a| !other.effects.iter().any(|b| same(a, b))).copied().collect()
        };
        let (mut general, special) = (beyond(self, case), beyond(case, self));
        let mut has_general = |a: &PlacedEffect| {
            general.iter().position(|g| a.is_case_of(g)).map(|k| general.swap_remove(k)).is_some()
        };
        special.iter().all(&mut has_general)
            && general.is_empty()
            && self.cost.zip(case.cost).is_some_and(|(own, of_case)| gains_no_more_than_noise(&own, &of_case))
    }
}

/// Labels of the sets that the data cannot tell from the first, which explains the data best; none if it has no rival.
pub fn rivals(best_first: impl IntoIterator<Item = ComparedSet>) -> Vec<String> {
    let mut sets = best_first.into_iter();
    let Some(best) = sets.next() else { return Vec::new() };
    let near = best.evidence + 2.0 * RIVAL.ln();
    let equals = sets.filter(|set| set.evidence > near && !set.is_seen_as(&best)).map(|set| set.label);
    let labels: Vec<String> = std::iter::once(best.label.clone()).chain(equals).collect();
    if labels.len() > 1 { labels } else { Vec::new() }
}

//! The smallest effect that is found.

use std::borrow::Cow;
use std::cell::RefCell;

use nalgebra::DVector;

use super::answer::{EffectPlan, EffectSize, Imitation};
use super::model::Signal;
use super::planned::PlannedModel;
use super::power::{Explained, FittedRival, Outcome, deviate, outcome};
use super::strength::EffectState;
use crate::diagnose::rank::NONE_OF_THESE;
use crate::fit::forward::ForwardModel;
use crate::fit::hypothesis::Hypothesis;

/// Change of the readings, relative, from which on an effect matters.
pub const RELEVANT: f64 = 0.1;
/// How near to it a size is sought, relative, and in how many steps.
const NEAR: f64 = 0.02;
const STEPS: usize = 14;
/// Halvings of a step that would go beyond what physics allows.
const TOWARDS_BOUND: usize = 6;
/// Longest step there.
const LONGEST_STEP: f64 = 30.0;
/// Factor from one size to the next until the probability is passed, and how many of them.
const RUNG: f64 = 2.0;
const RUNGS: usize = 12;
/// Halvings between two sizes, in the logarithm: to five percent.
const HALVINGS: usize = 4;
/// Steps with the model fitted at most, and the first of them in the logarithm of the size at least.
const FINE_STEPS: usize = 20;
const LEAST_STEP: f64 = 0.02;
/// Change of the normal deviate of the probability with the logarithm of the size, about that of a signal of five standard deviations.
const SLOPE: f64 = 5.0;
/// Deviate beyond the one asked for that is near enough, and difference of logarithms of sizes that is none.
const ENOUGH: f64 = 0.08;
const SAME: f64 = 0.01;
/// Rivals of an effect that are fitted.
const FITTED_RIVALS: usize = 4;
/// Imitations that are told.
const TOLD: usize = 5;
/// Probability of being beaten from which on a rival is none.
const BEATEN: f64 = 0.9;
/// Probability with which further measurements are to find an effect.
pub const PROBABLE: f64 = 0.9;

/// One candidate at any strength.
pub struct EffectPath<'m, 'a> {
    planned: &'m PlannedModel<'a>,
    number: usize,
    with: &'m Hypothesis<'a>,
    forward: ForwardModel<'m>,
    /// Change and signal of unit strength, where they grow in proportion.
    per_unit: Option<(DVector<f64>, Signal)>,
    /// Rivals that were fitted.
    fitted: Vec<FittedRival>,
    /// Strengths that were tried with the model taken as linear.
    rough: RefCell<Vec<Tried>>,
}

/// An effect of a strength with what becomes of it.
#[derive(Clone)]
struct Tried {
    strength: f64,
    change: f64,
    explained: Explained,
    outcome: Outcome,
}

impl<'m, 'a> EffectPath<'m, 'a> {
    fn new(planned: &'m PlannedModel<'a>, number: usize, with: &'m Hypothesis<'a>) -> Option<Self> {
        let forward = planned.forward(with).ok()?;
        let mut path = Self {
            planned,
            number,
            with,
            forward,
            per_unit: None,
            fitted: Vec::new(),
            rough: RefCell::default(),
        };
        let placed = planned.candidates[number].placed;
        if placed.effect.parameters(&with.scales).is_empty() {
            let change = planned.change(with, &path.forward, &path.state(1.0))?;
            path.per_unit = Some((change.clone(), planned.signal(change)));
        }
        Some(path)
    }

    fn state(&self, strength: f64) -> EffectState {
        EffectState::of_strength(self.with, self.planned.candidates[self.number].placed, strength)
    }

    fn is_allowed(&self, strength: f64) -> bool {
        self.state(strength).is_allowed(self.with)
    }

    /// Beside the model taken as linear; `None` if the machine is singular there.
    fn signal(&self, strength: f64) -> Option<Signal> {
        if let Some((_, Signal { noise, visible, change, .. })) = &self.per_unit {
            let visible = visible * strength;
            let (noise, linear) = (noise.clone(), visible.clone());
            return Some(Signal { noise, linear, visible, change: change * strength });
        }
        let change = self.planned.change(self.with, &self.forward, &self.state(strength))?;
        Some(self.planned.signal(change))
    }

    /// With the model taken as linear.
    fn roughly_at(&self, strength: f64) -> Option<Tried> {
        let mut rough = self.rough.borrow_mut();
        // the searches for a size that is found and one that is named alone try the same strengths at first
        let at = match rough.iter().position(|tried| tried.strength == strength) {
            Some(at) => at,
            None => {
                rough.push(self.tried(strength, &self.signal(strength)?));
                rough.len() - 1
            }
        };
        let tried = rough[at].clone();
        Some(Tried { outcome: self.beside_fitted(&tried), ..tried })
    }

    /// With the model fitted.
    fn at(&self, strength: f64) -> Option<Tried> {
        Some(self.tried(strength, &self.planned.signal_beside_fit(&self.change(strength)?)?))
    }

    fn change(&self, strength: f64) -> Option<DVector<f64>> {
        match &self.per_unit {
            Some((change, _)) => Some(change * strength),
            None => self.planned.change(self.with, &self.forward, &self.state(strength)),
        }
    }

    /// The rivals that imitate the effect of a size best, fitted.
    fn fitted_rivals(&self, tried: &Tried) -> Vec<FittedRival> {
        let Some(change) = self.change(tried.strength) else { return Vec::new() };
        let candidates = &self.planned.candidates;
        let own = candidates[self.number].placed.effect.name();
        // the same effect elsewhere can be most alike where its response is far from linear
        let is_same_effect = |candidate: usize| candidates[candidate].placed.effect.name() == own;
        let rivals = tried.outcome.rivals.iter().filter(|r| r.lost > 0.0);
        let ordered = rivals.filter_map(|r| Some((r.candidate?, r.lost))).enumerate();
        let numbers: Vec<(usize, f64)> = ordered
            .filter(|(k, (candidate, _))| *k < FITTED_RIVALS || is_same_effect(*candidate))
            .map(|(_, rival)| rival)
            .collect();
        let fit = |(candidate, linear): (usize, f64)| {
            let placed = self.planned.candidates[candidate].placed;
            let lost = self.planned.loss_of_fitted(placed, &change)?;
            Some(FittedRival { candidate, share: (lost / linear).clamp(0.0, 1.0) })
        };
        numbers.into_iter().filter_map(fit).collect()
    }

    fn tried(&self, strength: f64, signal: &Signal) -> Tried {
        let explained = Explained::of(self.planned, self.number, signal);
        let outcome = outcome(self.planned, self.number, &explained, &self.fitted);
        Tried { strength, change: signal.change, explained, outcome }
    }

    /// What becomes of the same effect beside the rivals that are fitted by now.
    fn beside_fitted(&self, tried: &Tried) -> Outcome {
        outcome(self.planned, self.number, &tried.explained, &self.fitted)
    }

    /// The strength that changes the readings by [`RELEVANT`], or by as much as it can.
    fn relevant(&self) -> Option<f64> {
        let mut strength = 1.0;
        for _ in 0..STEPS {
            let change = self.signal(strength)?.change;
            let factor = RELEVANT / change.max(f64::MIN_POSITIVE);
            if (factor - 1.0).abs() < NEAR {
                break;
            }
            // of what grows in proportion the size is known at once
            let longest = if self.per_unit.is_some() { f64::INFINITY } else { LONGEST_STEP };
            let mut next = strength * factor.clamp(longest.recip(), longest);
            for _ in 0..TOWARDS_BOUND {
                if !self.is_allowed(next) {
                    next = (next * strength).sqrt();
                }
            }
            if !next.is_finite() || !self.is_allowed(next) {
                break;
            }
            strength = next;
        }
        Some(strength)
    }

    /// The smallest strength at which something is probable enough, sought from one strength on, with the model taken as linear
    /// first; `None` if none is.
    fn smallest(&self, from: f64, probability: f64, of: fn(&Outcome) -> f64) -> Option<Tried> {
        let search = Search { path: self, probability, of };
        let roughly = search.roughly(from)?;
        search.precisely(roughly.strength)
    }

    fn size(&self, tried: &Tried) -> EffectSize {
        let state = self.state(tried.strength);
        EffectSize {
            parameters: state.sized(self.with),
            entry: state.entry(self.with),
            change: tried.change,
            found: tried.outcome.found,
            alone: tried.outcome.alone,
        }
    }
}

/// A probability that is sought along a path.
struct Search<'s, 'm, 'a> {
    path: &'s EffectPath<'m, 'a>,
    probability: f64,
    of: fn(&Outcome) -> f64,
}

impl Search<'_, '_, '_> {
    /// Where the probability is passed with the model taken as linear, up or down a ladder from a strength.
    fn roughly(&self, from: f64) -> Option<Tried> {
        let reaches = |tried: &Tried| (self.of)(&tried.outcome) >= self.probability;
        let mut high = self.path.roughly_at(from)?;
        let mut low = None;
        let is_above = reaches(&high);
        for _ in 0..RUNGS {
            let strength = if is_above { high.strength / RUNG } else { high.strength * RUNG };
            if !self.path.is_allowed(strength) {
                break;
            }
            let next = self.path.roughly_at(strength)?;
            if is_above && !reaches(&next) {
                low = Some(next.strength);
                break;
            }
            let before = std::mem::replace(&mut high, next);
            if !is_above && reaches(&high) {
                low = Some(before.strength);
                break;
            }
        }
        // what is not found by the linear model may be found by the fitted one: from the largest on
        let Some(mut low) = low else { return Some(high) };
        for _ in 0..HALVINGS {
            let middle = self.path.roughly_at((low * high.strength).sqrt())?;
            if reaches(&middle) {
                high = middle;
            } else {
                low = middle.strength;
            }
        }
        Some(high)
    }

    /// Where the probability is passed with the model fitted, near a strength: by the secant of its normal deviate over the logarithm
    /// of the strength.
    fn precisely(&self, near: f64) -> Option<Tried> {
        let beyond = |tried: &Tried| deviate((self.of)(&tried.outcome)) - deviate(self.probability);
        let mut low: Option<(f64, f64)> = None;
        let mut high: Option<(f64, Tried)> = None;
        let mut strength = near;
        let mut least_step = LEAST_STEP;
        for _ in 0..FINE_STEPS {
            let tried = self.path.at(strength)?;
            let (at, z) = (strength.ln(), beyond(&tried));
            if z >= 0.0 {
                high = Some((z, tried));
            } else {
                low = Some((at, z));
            }
            let next = match (&low, &high) {
                (_, Some((z, _))) if *z < ENOUGH => break,
                (Some((low, below)), Some((above, found))) => {
                    let top = found.strength.ln();
                    if top - low < SAME {
                        break;
                    }
                    let share = (below / (below - above)).clamp(0.1, 0.9);
                    low + share * (top - low) + 0.1 * SAME
                }
                // on a plateau, where a rival hides the effect over a range of sizes, ever longer
                _ => {
                    let stride = (z.abs() / SLOPE).clamp(least_step, std::f64::consts::LN_2);
                    least_step = (2.0 * least_step).min(std::f64::consts::LN_2);
                    at - stride * z.signum() + 0.1 * SAME
                }
            };
            strength = next.exp();
            if !self.path.is_allowed(strength) {
                break;
            }
        }
        high.map(|(_, tried)| tried)
    }
}

/// What the readings would show of a candidate; nothing can be found where bearings and planes use up all that they hold.
/// The rivals that were fitted are those of the size that matters.
pub fn effect(
    planned: &PlannedModel,
    number: usize,
    probability: f64,
    is_saturated: bool,
) -> (EffectPlan, Vec<FittedRival>) {
    let candidate = &planned.candidates[number];
    let with = planned.with(candidate.placed);
    let has_size = candidate.unknowns > 0;
    let mut path = EffectPath::new(planned, number, &with);
    let relevant = path.as_ref().and_then(|path| path.at(if has_size { path.relevant()? } else { 1.0 }));
    let found = |path: &Option<EffectPath>, of: fn(&Outcome) -> f64| {
        let (path, relevant) = (path.as_ref()?, relevant.as_ref()?);
        if is_saturated {
            return None;
        }
        if !has_size {
            return path.at(1.0).filter(|tried| of(&tried.outcome) >= probability);
        }
        path.smallest(relevant.strength, probability, of)
    };
    let mut smallest = found(&path, |outcome| outcome.found);
    if let (Some(path), Some(tried)) = (&mut path, &smallest) {
        path.fitted = path.fitted_rivals(tried);
    }
    let is_hidden = |path: &EffectPath, tried: &Tried| path.beside_fitted(tried).found < probability - NEAR;
    if path.as_ref().zip(smallest.as_ref()).is_some_and(|(path, tried)| is_hidden(path, tried)) {
        // by rivals that imitate it better than their linear directions do
        smallest = found(&path, |outcome| outcome.found);
    }
    let alone = smallest.as_ref().and_then(|_| found(&path, |outcome| outcome.alone));
    let rivals = path.as_ref().zip(relevant.as_ref()).map(|(path, tried)| path.fitted_rivals(tried));
    let rivals = rivals.unwrap_or_default();
    // what fitted rivals change beyond that is whether it is named alone, and what imitates it
    let beside = |tried: Tried, fitted: &[FittedRival]| {
        let mut outcome = outcome(planned, number, &tried.explained, fitted);
        outcome.found = tried.outcome.found;
        outcome.alone = outcome.alone.min(outcome.found);
        Tried { outcome, ..tried }
    };
    let of_smallest = path.as_ref().map_or(&[][..], |path| &path.fitted);
    let smallest = smallest.map(|tried| beside(tried, of_smallest));
    let relevant = relevant.map(|tried| beside(tried, &rivals));
    let size = |tried: &Tried| path.as_ref().map(|path| path.size(tried));
    let told = smallest.as_ref().or(relevant.as_ref());
    let nothing = || {
        let state = EffectState::of_strength(&with, candidate.placed, 1.0);
        EffectSize {
            parameters: state.sized(&with),
            entry: state.entry(&with),
            change: 0.0,
            found: 0.0,
            alone: 0.0,
        }
    };
    let mut at_relevant = relevant.as_ref().and_then(size).unwrap_or_else(nothing);
    if is_saturated {
        (at_relevant.found, at_relevant.alone) = (0.0, 0.0);
    }
    let answer = EffectPlan {
        effect: candidate.placed.effect.name(),
        at: candidate.placed.place.name(with.rotor).map(Cow::into_owned),
        smallest: smallest.as_ref().and_then(size),
        alone: alone.as_ref().and_then(size),
        relevant: at_relevant,
        has_size,
        imitations: told.map(|tried| imitations(planned, &tried.outcome)).unwrap_or_default(),
        knowledge: candidate.placed.effect.knowledge(),
    };
    (answer, rivals)
}

/// Rivals first, then what comes nearest.
fn imitations(planned: &PlannedModel, outcome: &Outcome) -> Vec<Imitation> {
    let label = |candidate: Option<usize>| {
        let rotor = planned.base.fitter.rotor;
        candidate.map_or_else(|| NONE_OF_THESE.to_string(), |k| planned.candidates[k].placed.label(rotor))
    };
    let mut all: Vec<Imitation> = outcome
        .rivals
        .iter()
        .map(|rival| Imitation {
            label: label(rival.candidate),
            left_sd: rival.left_sd,
            is_rival: rival.is_beaten < BEATEN,
        })
        .collect();
    all.sort_by_key(|imitation| !imitation.is_rival);
    let rivals = all.iter().filter(|imitation| imitation.is_rival).count();
    all.truncate(rivals.max(TOLD.min(all.len())));
    all
}

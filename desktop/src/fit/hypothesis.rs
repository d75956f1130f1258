//! What is assumed of a machine: its file, and the effects it might have, as a vector of unknowns.

use std::sync::Arc;

use crate::effects::terms::Terms;
use crate::effects::{ALL, Effect, Parameter, Place, Scales, Unknown};
use crate::machine::bearings::Bearings;
use crate::machine::drawing::Rotor;

/// An effect at its place.
#[derive(Clone, Copy)]
pub struct PlacedEffect {
    pub effect: &'static dyn Effect,
    pub place: Place,
}

impl PlacedEffect {
    /// `effect@place`, or the effect alone where it concerns the whole machine.
    pub fn label(&self, rotor: &Rotor) -> String {
        self.labelled(self.effect.name(), rotor)
    }

    /// The same of the effect that this one is a special case of.
    pub fn general_label(&self, rotor: &Rotor) -> String {
        self.labelled(self.effect.general(), rotor)
    }

    /// Whether this effect is a special case of that one, at the same place.
    pub fn is_case_of(&self, general: &Self) -> bool {
        let (own, its) = (self.effect, general.effect.name());
        own.general() == its && own.name() != its && self.place == general.place
    }

    /// The effects that are special cases of this one, at its place.
    pub fn special_cases(self) -> impl Iterator<Item = Self> {
        ALL.into_iter()
            .map(move |effect: &'static dyn Effect| Self { effect, place: self.place })
            .filter(move |a| a.is_case_of(&self))
    }

    /// Search coordinates of a fit whose last effect is this one, as those of the more general effect at its place.
    pub fn as_general(&self, general: &Self, scales: &Scales, x: &[f64]) -> Option<Vec<f64>> {
        let own = self.effect.parameters(scales);
        let (before, own_x) = x.split_at(x.len() - own.len());
        let own_si: Vec<f64> = own.iter().zip(own_x).map(|(p, v)| p.scale.to_si(*v)).collect();
        let its_si = self.effect.as_general(&own_si)?;
        let its = general.effect.parameters(scales).into_iter().zip(its_si).map(|(p, v)| p.scale.from_si(v));
        Some(before.iter().copied().chain(its).collect())
    }

    fn labelled(&self, name: &str, rotor: &Rotor) -> String {
        self.place.name(rotor).map_or_else(|| name.to_string(), |at| format!("{name}@{at}"))
    }
}

/// A rotor with some effects assumed. Unknowns `x` that enter nonlinearly: those of the bearings, then the parameters of each effect in their own scales.
#[derive(Clone)]
pub struct Hypothesis<'a> {
    /// The machine as its file states it.
    pub rotor: &'a Rotor,
    /// Its bearings, and what data may decide about them.
    pub bearings: Arc<Bearings>,
    pub scales: Scales,
    /// What it is assumed to have beside.
    pub effects: Vec<PlacedEffect>,
}

impl<'a> Hypothesis<'a> {
    pub fn drawn(rotor: &'a Rotor, scales: Scales) -> Self {
        Self { rotor, bearings: Arc::new(Bearings::of(rotor)), scales, effects: Vec::new() }
    }

    /// The same with one more effect.
    pub fn with(&self, effect: PlacedEffect) -> Self {
        let mut more = self.clone();
        more.effects.push(effect);
        more
    }

    /// Parameters of all effects that are searched, in order.
    pub fn parameters(&self) -> Vec<Parameter> {
        self.effects.iter().flat_map(|a| a.effect.parameters(&self.scales)).collect()
    }

    /// Parameters of all effects that are solved for, in order.
    pub fn unknowns(&self) -> Vec<Unknown> {
        self.effects.iter().flat_map(|a| a.effect.unknowns(self.rotor, a.place)).collect()
    }

    /// Search coordinates of the file's bearings, everything of the effects at zero.
    pub fn origin(&self) -> Vec<f64> {
        let mut x = self.bearings.stated();
        x.resize(self.size(), 0.0);
        x
    }

    /// Length of `x`.
    pub fn size(&self) -> usize {
        self.bearings.count() + self.parameters().len()
    }

    /// Supports, readings and physics at `x`; the linear unknowns are left out.
    pub fn terms(&self, x: &[f64]) -> Terms {
        let mut terms = Terms::on(self.rotor, self.bearings.supports(x));
        let mut at = self.bearings.count();
        for placed in &self.effects {
            let parameters = placed.effect.parameters(&self.scales);
            let si: Vec<f64> = parameters.iter().zip(&x[at..]).map(|(p, v)| p.scale.to_si(*v)).collect();
            placed.effect.apply(self.rotor, placed.place, &si, &self.scales, &mut terms);
            at += parameters.len();
        }
        terms
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::physical;
    use crate::testing::sample_rotor;

    #[test]
    fn special_case_in_terms_of_the_general_effect_is_the_same() {
        let rotor = sample_rotor();
        let scales = physical::scales(&rotor, &Terms::drawn(&rotor), 600.0, 1e-5);
        let drawn = Hypothesis::drawn(&rotor, scales);
        let mut seen = Vec::new();
        for effect in ALL {
            for place in effect.places(&rotor) {
                let general = PlacedEffect { effect, place };
                for special in general.special_cases() {
                    let own = special.effect.parameters(&drawn.scales);
                    let usual = special.effect.typical(&drawn.scales);
                    let own = own.iter().zip(&usual).map(|(p, v)| p.scale.from_si(*v));
                    let x: Vec<f64> = drawn.origin().into_iter().chain(own).collect();
                    let Some(same) = special.as_general(&general, &drawn.scales, &x) else { continue };
                    let (a, b) = (drawn.with(special).terms(&x), drawn.with(general).terms(&same));
                    for ((_, a), (_, b)) in a.supports.iter().zip(&b.supports) {
                        let [a, b] = [a, b].map(|law| law.dynamic_stiffness(300.0, [0.0; 2]));
                        assert!((a - b).norm() <= 1e-12 * a.norm(), "{}", special.label(&rotor));
                    }
                    let gains = a.gains.iter().zip(&b.gains);
                    assert!(gains.clone().all(|(a, b)| (a - b).norm() < 1e-12), "{}", special.label(&rotor));
                    seen.push(special.effect.name());
                }
            }
        }
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen, ["pedestal", "probe_reversed"]);
    }
}

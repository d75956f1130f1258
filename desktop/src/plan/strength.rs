//! An effect of any strength.

use nalgebra::Complex;

use super::answer::SizedParameter;
use crate::effects::{Scale, Unknown, entry};
use crate::fit::hypothesis::{Hypothesis, PlacedEffect};
use crate::machine::drawing::EffectEntry;

type C = Complex<f64>;

/// Angle from one phasor of an effect to the next, and of the first, degrees: the golden angle, so that no two are alike or opposed.
const BETWEEN_PHASORS_DEG: f64 = 137.508;
const FIRST_PHASOR_DEG: f64 = 60.0;
/// Strengths above this, relative to a typical effect, are none that a machine has.
const STRONGEST: f64 = 1e4;

/// An effect at a place with numbers.
#[derive(Clone)]
pub struct EffectState {
    pub placed: PlacedEffect,
    /// Real parameters, SI units.
    pub parameters: Vec<f64>,
    /// Magnitude of the phasors that act, in the unit of their parameter.
    pub magnitude: f64,
}

/// Its phasors that act: those of a list all alike, else the last, which sets the effect apart from its special cases.
fn acting(unknowns: &[Unknown]) -> impl Fn(usize) -> bool {
    let last = unknowns.last().map(|u| u.name);
    let names: Vec<&str> = unknowns.iter().map(|u| u.name).collect();
    move |k| Some(names[k]) == last
}

impl EffectState {
    /// An effect so many times as strong as a typical one; of phasors, which have no typical size, so many units.
    pub fn of_strength(with: &Hypothesis, placed: PlacedEffect, strength: f64) -> Self {
        let typical = placed.effect.typical(&with.scales);
        let parameters = placed.effect.strengthened(&with.scales, &typical, strength);
        Self { placed, parameters, magnitude: strength }
    }

    /// Search coordinates of its parameters.
    pub fn coordinates(&self, with: &Hypothesis) -> Vec<f64> {
        let all = self.placed.effect.parameters(&with.scales).into_iter().zip(&self.parameters);
        all.map(|(p, v)| p.scale.from_si(*v)).collect()
    }

    /// Its linear unknowns.
    pub fn phasors(&self, with: &Hypothesis) -> Vec<C> {
        let unknowns = self.placed.effect.unknowns(with.rotor, self.placed.place);
        let acts = acting(&unknowns);
        let at = |k: usize| (FIRST_PHASOR_DEG + BETWEEN_PHASORS_DEG * k as f64).to_radians();
        let size = |k: usize| if acts(k) { self.magnitude } else { 0.0 };
        (0..unknowns.len()).map(|k| C::from_polar(size(k), at(k))).collect()
    }

    /// Whether physics allows it.
    pub fn is_allowed(&self, with: &Hypothesis) -> bool {
        let parameters = self.placed.effect.parameters(&with.scales);
        let real = parameters.iter().zip(&self.parameters).all(|(p, v)| {
            let far = match p.scale {
                Scale::Linear(unit) => (v / unit).abs() > STRONGEST,
                Scale::Logarithmic => false,
            };
            v.is_finite() && (p.bounds[0]..=p.bounds[1]).contains(v) && !far
        });
        let unknowns = self.placed.effect.unknowns(with.rotor, self.placed.place);
        real && unknowns.iter().all(|u| self.magnitude <= u.largest)
    }

    /// The numbers that grow with it.
    pub fn sized(&self, with: &Hypothesis) -> Vec<SizedParameter> {
        let stronger = Self::of_strength(with, self.placed, 2.0);
        let weaker = Self::of_strength(with, self.placed, 1.0);
        let changes = stronger.parameters.iter().zip(&weaker.parameters).map(|(a, b)| a != b);
        let parameters =
            self.placed.effect.parameters(&with.scales).into_iter().zip(&self.parameters).zip(changes);
        let real = parameters.filter(|(_, changes)| *changes).map(|((p, value), _)| SizedParameter {
            name: p.name,
            unit: p.unit,
            value: *value,
        });
        let unknowns = self.placed.effect.unknowns(with.rotor, self.placed.place);
        let phasor =
            unknowns.last().map(|u| SizedParameter { name: u.name, unit: u.unit, value: self.magnitude });
        real.chain(phasor).collect()
    }

    /// As a rotor's file states it.
    pub fn entry(&self, with: &Hypothesis) -> EffectEntry {
        let (effect, place) = (self.placed.effect, self.placed.place);
        entry::written(with.rotor, effect, place, &with.scales, &self.parameters, &self.phasors(with))
    }
}

//! An effect, its place and its size, drawn at random for somebody to find.
//!
//! The size is measured by what shows of it: of the change that the effect makes in the noise-free readings, what a fit of
//! bearings, unbalance and the drawing's tolerances leaves, to first order, is summed in standard deviations of the noise; a
//! whole fit must confirm that it is visible, as a sharp resonance that moves is no small change. Every sum from just visible
//! to strong is as likely on a logarithmic scale; an effect that physics, or what machines have, bounds below its sum takes the
//! size at the bound, if that is visible.

use nalgebra::Complex;
use rand::Rng;
use rand::rngs::StdRng;
use rand::seq::IndexedRandom;
use rand_distr::StandardNormal;

use super::visible::Visibility;
use super::{HiddenEffect, shown, steady, stream, usual};
use crate::effects::{ALL, Effect, Parameter, Place, Scale, Scales, Unknown, entry};
use crate::error::Error;
use crate::machine::drawing::{EffectEntry, Noise, Rotor};

type C = Complex<f64>;

const HIDDEN_STREAM: u64 = 0x6869_6465;
/// What a just visible effect leaves, in standard deviations: the logarithm of its evidence, half of the square, then beats
/// the odds against one effect of some dozens by far.
pub const JUST_VISIBLE_SD: f64 = 7.0;
/// What a strong one leaves: of some hundred readings more than each one's noise many times over.
pub const STRONG_SD: f64 = 100.0;
/// Effects that are drawn until one is visible.
const DRAWS: usize = 60;
/// Sizes that are tried of one effect, and how near to its sum one must come, as a logarithm.
const ROUNDS: usize = 8;
const NEAR: f64 = 0.2;
/// Largest step of the size in one round, as a factor.
const STEP: f64 = 30.0;
/// Standard deviation of the logarithm of each parameter around those that searches start from.
const SPREAD: f64 = 0.3;

/// What a hidden effect is drawn for.
pub struct Search<'a> {
    /// The rotor that somebody will hold against the readings.
    pub file: &'a Rotor,
    pub scales: &'a Scales,
    pub unbalance_kg_m: &'a [C],
    pub speeds_rpm: &'a [f64],
    pub noise: Noise,
}

/// An effect at a place with the parameters of unit strength.
struct Drawn {
    effect: &'static dyn Effect,
    place: Place,
    parameters: Vec<f64>,
    phasors: Vec<C>,
}

impl Search<'_> {
    /// Draws an effect that this machine can have.
    ///
    /// # Errors
    /// If no effect is visible in such readings.
    pub fn draw(&self, machine: &Rotor, seed: u64) -> Result<HiddenEffect, Error> {
        // one seed hides something else in every machine
        let name = self.file.name.bytes().fold(HIDDEN_STREAM, |sum, b| sum.rotate_left(7) ^ u64::from(b));
        let mut random = stream(seed, name);
        let has = |effect: &dyn Effect, place: &Place| {
            let at = place.name(machine);
            machine.effect.iter().any(|e| e.kind == effect.name() && e.at.as_deref() == at.as_deref())
        };
        let free = |effect: &'static dyn Effect| {
            let mut places = effect.places(self.file);
            places.retain(|place| !has(effect, place));
            (effect, places)
        };
        let choices: Vec<_> = ALL.into_iter().map(free).filter(|(_, places)| !places.is_empty()).collect();
        let visibility = Visibility::new(self.file, self.unbalance_kg_m, self.speeds_rpm, &self.noise)?;
        let was_steady = steady::unstable_from_rpm(machine, self.speeds_rpm)?.is_none();
        for _ in 0..DRAWS {
            let Some((effect, places)) = choices.choose(&mut random) else { break };
            let Some(place) = places.choose(&mut random) else { continue };
            let target_sd = random.random_range(JUST_VISIBLE_SD.ln()..STRONG_SD.ln()).exp();
            let drawn = self.at_random(*effect, *place, &mut random);
            let Some(hidden) = self.sized(&drawn, target_sd, &visibility) else { continue };
            let fitted_sd = visibility.after_fit(&with(self.file, &hidden.entry), &self.noise);
            let visible_sd = hidden.visible_sd.min(fitted_sd);
            if visible_sd < JUST_VISIBLE_SD {
                continue;
            }
            let hidden = HiddenEffect { visible_sd, ..hidden };
            let with = with(machine, &hidden.entry);
            let is_possible = with.validate().is_ok()
                && shown::noise_free(&with, self.unbalance_kg_m, self.speeds_rpm).is_ok()
                && (!was_steady || steady::unstable_from_rpm(&with, self.speeds_rpm)?.is_none());
            if is_possible {
                return Ok(hidden);
            }
        }
        Err(Error::Unsuitable(
            "no effect would be visible in these readings; simulate more speeds, or less noise".into(),
        ))
    }

    fn at_random(&self, effect: &'static dyn Effect, place: Place, random: &mut StdRng) -> Drawn {
        let starts = effect.starts(self.scales);
        let mut parameters = starts.choose(random).cloned().unwrap_or_default();
        for value in &mut parameters {
            *value *= (SPREAD * random.sample::<f64, _>(StandardNormal)).exp();
        }
        let phasor = |u: &Unknown| {
            let size = self.usual_size(u) * random.random_range(0.3..1.0);
            C::from_polar(size, random.random_range(-180.0..180.0_f64).to_radians())
        };
        let phasors = effect.unknowns(self.file, place).iter().map(phasor).collect();
        Drawn { effect, place, parameters, phasors }
    }

    /// A size that shows, for the search to begin from.
    fn usual_size(&self, u: &Unknown) -> f64 {
        let force_n = 0.1 * self.scales.stiffness_n_m * self.scales.amplitude_m;
        match u.unit {
            "m" => 0.3 * self.scales.amplitude_m,
            "N" => force_n,
            "N·m" => 0.1 * force_n * self.file.length_m(),
            "kg·m" => 0.3 * self.unbalance_kg_m.iter().map(|u| u.norm()).fold(1e-9, f64::max),
            _ => 1e-3,
        }
    }

    /// The effect in the size that leaves this sum, in the largest that is possible if that leaves less.
    fn sized(&self, drawn: &Drawn, target_sd: f64, visibility: &Visibility) -> Option<HiddenEffect> {
        let of_strength = |strength: f64| {
            let entry = self.entry(drawn, strength)?;
            let with = with(self.file, &entry);
            with.validate().ok()?;
            let visible_sd = visibility.of(&with)?;
            Some(HiddenEffect { entry, visible_sd })
        };
        if drawn.parameters.is_empty() && drawn.phasors.is_empty() {
            // a switch has no size
            return of_strength(1.0).filter(|found| found.visible_sd >= JUST_VISIBLE_SD);
        }
        let mut best: Option<HiddenEffect> = None;
        let off = |found: &HiddenEffect| (found.visible_sd / target_sd).ln().abs();
        let (mut strength, mut impossible) = (1.0_f64, f64::INFINITY);
        for _ in 0..ROUNDS {
            let Some(found) = of_strength(strength) else {
                impossible = impossible.min(strength);
                strength *= 0.3;
                continue;
            };
            let step = (target_sd / found.visible_sd).clamp(1.0 / STEP, STEP);
            let next = strength * step;
            // what is impossible is approached from below
            strength = if next < impossible { next } else { (strength * impossible).sqrt() };
            if best.as_ref().is_none_or(|best| off(&found) < off(best)) {
                best = Some(found);
            }
            if best.as_ref().is_some_and(|best| off(best) < NEAR) {
                break;
            }
        }
        best.filter(|found| (JUST_VISIBLE_SD..=STRONG_SD).contains(&found.visible_sd))
    }

    /// The effect at a strength, if its parameters are within their bounds.
    fn entry(&self, drawn: &Drawn, strength: f64) -> Option<EffectEntry> {
        let Drawn { effect, place, .. } = drawn;
        let values = effect.strengthened(self.scales, &drawn.parameters, strength);
        let parameters = effect.parameters(self.scales);
        let usual = |name: &str, value: f64| {
            let [low, high] = usual::bounds(effect.name(), name, self.scales);
            low <= value && value <= high
        };
        let within = |(p, value): (&Parameter, &f64)| {
            let is_size = p.scale != Scale::Logarithmic || *value > 0.0;
            let is_allowed = value.is_finite() && p.bounds[0] <= *value && *value <= p.bounds[1];
            is_size && is_allowed && usual(p.name, *value)
        };
        let phasors: Vec<C> = drawn.phasors.iter().map(|u| u * strength).collect();
        let unknowns = effect.unknowns(self.file, *place);
        let is_possible = parameters.iter().zip(&values).all(within)
            && unknowns
                .iter()
                .zip(&phasors)
                .all(|(u, value)| value.norm() <= u.largest && usual(u.name, value.norm()));
        is_possible.then(|| entry::written(self.file, *effect, *place, self.scales, &values, &phasors))
    }
}

/// A machine with one effect more.
fn with(machine: &Rotor, entry: &EffectEntry) -> Rotor {
    let mut with = machine.clone();
    with.effect.push(entry.clone());
    with
}

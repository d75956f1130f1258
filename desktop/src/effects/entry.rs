//! Effects as a rotor's file keeps them: `[[effect]]` with kind, place and parameters.

use std::borrow::Cow;
use std::collections::BTreeMap;

use nalgebra::Complex;

use super::{Effect, Pattern, Place, Scales, add_unknown, find};
use crate::effects::limits::{nearest_allowed, nearest_carried};
use crate::effects::terms::Terms;
use crate::machine::drawing::{EffectEntry, ParameterValue, Rotor};
use crate::machine::span::Span;

/// No shaft turns faster; the settings of effects are speeds.
const FASTEST_RAD_S: f64 = 1e6;

/// The effect and place that a kind and a name stand for.
///
/// # Errors
/// One clause on what was expected: no such effect, or no such place for it.
pub fn resolve(rotor: &Rotor, kind: &str, at: Option<&str>) -> Result<(&'static dyn Effect, Place), String> {
    let Some(effect) = find(kind) else {
        let names: Vec<&str> = super::ALL.iter().map(|e| e.name()).collect();
        return Err(format!("there is no effect \"{kind}\", expected one of {}", names.join(", ")));
    };
    let mut everywhere = vec![Place::Machine, Place::LeftEnd];
    everywhere.extend((0..rotor.bearing.len()).map(Place::Bearing));
    everywhere.extend((0..rotor.disk.len()).map(Place::Disk));
    everywhere.extend((0..rotor.probe.len()).map(Place::Probe));
    everywhere.extend((0..rotor.run.len()).map(Place::Run));
    // the file may state a length that is none of those sought
    let takes_spans = effect.places(rotor).iter().any(|p| matches!(p, Place::Span(_)));
    if let Some(span) = at.and_then(Span::parse).filter(|span| takes_spans && span.is_on(rotor)) {
        return Ok((effect, Place::Span(span)));
    }
    everywhere.extend(effect.places(rotor).into_iter().filter(|p| matches!(p, Place::Span(_))));
    // a file may state what is not sought on its machine
    let stated = effect.not_sought(rotor).is_some();
    let offered = |p: &Place| effect.places(rotor).contains(p) || (stated && *p == Place::Machine);
    if let Some(place) = everywhere.iter().find(|p| p.name(rotor).as_deref() == at && offered(p)) {
        return Ok((effect, *place));
    }
    let places: Vec<String> = everywhere
        .iter()
        .filter(|p| offered(p))
        .filter_map(|p| p.name(rotor))
        .map(|n| format!("\"{n}\""))
        .collect();
    Err(match (at, places.is_empty()) {
        _ if !stated && effect.places(rotor).is_empty() => format!("{kind} has no place on this machine"),
        (Some(at), true) => format!("{kind} concerns the whole machine and has no place \"{at}\""),
        (Some(at), false) => format!("{kind} cannot sit at \"{at}\", expected one of {}", places.join(", ")),
        (None, _) => format!("{kind} needs a place, one of {}", places.join(", ")),
    })
}

/// Checks an entry: its kind, its place and every parameter.
///
/// # Errors
/// One clause on what was expected.
pub fn check(rotor: &Rotor, entry: &EffectEntry) -> Result<(), String> {
    let (effect, place) = resolve(rotor, &entry.kind, entry.at.as_deref())?;
    let scales = scales_of(rotor);
    let mut known: Vec<&str> = effect.settings(&scales).iter().map(|(name, _)| *name).collect();
    for p in effect.parameters(&scales) {
        known.push(p.name);
        match entry.parameters.get(p.name) {
            Some(ParameterValue::Real(v)) if v.is_finite() => {}
            _ => return Err(format!("the parameter {} is missing or not a number ({})", p.name, p.unit)),
        }
    }
    for (name, _) in effect.settings(&scales) {
        match entry.parameters.get(name) {
            Some(ParameterValue::Real(v)) if *v > 0.0 && *v <= FASTEST_RAD_S => {}
            _ => return Err(format!("the setting {name} is missing or not a positive number")),
        }
    }
    let unknowns = effect.unknowns(rotor, place);
    for u in &unknowns {
        known.push(u.name);
        if phasor(entry, u.name, u.pattern).is_none() {
            return Err(format!("the parameter {} is missing or not [real, imaginary] ({})", u.name, u.unit));
        }
    }
    match entry.parameters.keys().find(|name| !known.contains(&name.as_str())) {
        Some(name) => Err(format!("the parameter {name} is not known, expected {}", known.join(", "))),
        None => Ok(()),
    }
}

/// The `[[effect]]` of a rotor's file with these parameters; phasors in the order of its unknowns. A parameter beyond its physical bound is
/// written as that bound.
pub fn written(
    rotor: &Rotor,
    effect: &'static dyn Effect,
    place: Place,
    scales: &Scales,
    parameters: &[f64],
    phasors: &[Complex<f64>],
) -> EffectEntry {
    let mut all = BTreeMap::new();
    for (p, v) in effect.parameters(scales).iter().zip(parameters) {
        all.insert(p.name.to_string(), ParameterValue::Real(nearest_allowed(p, *v)));
    }
    for (name, v) in effect.settings(scales) {
        all.insert(name.to_string(), ParameterValue::Real(v));
    }
    let unknowns = effect.unknowns(rotor, place);
    let stated: Vec<Complex<f64>> =
        unknowns.iter().zip(phasors).map(|(u, v)| nearest_carried(u, *v)).collect();
    let pair = |v: &Complex<f64>| [v.re, v.im];
    match (unknowns.first(), &stated[..]) {
        (Some(u), many) if u.pattern.in_list().is_some() => {
            all.insert(u.name.to_string(), ParameterValue::Phasors(many.iter().map(pair).collect()));
        }
        _ => all.extend(
            unknowns.iter().zip(&stated).map(|(u, v)| (u.name.to_string(), ParameterValue::Phasor(pair(v)))),
        ),
    }
    let at = place.name(rotor).map(Cow::into_owned);
    EffectEntry { kind: effect.name().to_string(), at, parameters: all }
}

/// Real parameters of an entry in the order of the effect; zero where one is missing.
pub fn real_parameters(effect: &dyn Effect, entry: &EffectEntry, scales: &Scales) -> Vec<f64> {
    let value = |name: &str| match entry.parameters.get(name) {
        Some(ParameterValue::Real(v)) => *v,
        _ => 0.0,
    };
    effect.parameters(scales).iter().map(|p| value(p.name)).collect()
}

/// SI units of the parameters of an entry, by name; empty where the entry is of no effect or place.
pub fn units(rotor: &Rotor, entry: &EffectEntry) -> BTreeMap<&'static str, &'static str> {
    let Ok((effect, place)) = resolve(rotor, &entry.kind, entry.at.as_deref()) else {
        return BTreeMap::new();
    };
    let scales = scales_of(rotor);
    let settings = effect.settings(&scales).into_iter().map(|(name, _)| (name, "rad/s"));
    let real = effect.parameters(&scales).into_iter().map(|p| (p.name, p.unit));
    real.chain(settings).chain(effect.unknowns(rotor, place).into_iter().map(|u| (u.name, u.unit))).collect()
}

/// The terms of a machine with the effects of its file.
pub fn terms_of(rotor: &Rotor) -> Terms {
    let mut terms = Terms::drawn(rotor);
    apply_all(rotor, &mut terms);
    terms
}

/// Applies every effect of the file at its stated parameters.
fn apply_all(rotor: &Rotor, terms: &mut Terms) {
    let scales = scales_of(rotor);
    for entry in &rotor.effect {
        let Ok((effect, place)) = resolve(rotor, &entry.kind, entry.at.as_deref()) else { continue };
        effect.apply(rotor, place, &real_parameters(effect, entry, &scales), &scales, terms);
        for u in effect.unknowns(rotor, place) {
            if let Some(value) = phasor(entry, u.name, u.pattern) {
                add_unknown(&u, value, terms);
            }
        }
    }
}

/// Reference speed that an effect of the file states, rad/s.
pub fn reference_rad_s(rotor: &Rotor) -> Option<f64> {
    rotor.effect.iter().find_map(|e| match e.parameters.get("ref") {
        Some(ParameterValue::Real(v)) if *v > 0.0 => Some(*v),
        _ => None,
    })
}

/// Scales for parameters in SI units, where only the reference speed matters.
fn scales_of(rotor: &Rotor) -> Scales {
    let reference_rad_s = reference_rad_s(rotor).unwrap_or(1.0);
    Scales {
        stiffness_n_m: 1.0,
        sagging_n_m: 0.0,
        rotor_kg: f64::INFINITY,
        fastest_rad_s: reference_rad_s,
        reference_rad_s,
        amplitude_m: 1.0,
    }
}

/// What an entry states of a linear unknown, if it is a finite number.
pub(crate) fn phasor(entry: &EffectEntry, name: &str, pattern: Pattern) -> Option<Complex<f64>> {
    let pair = match (entry.parameters.get(name)?, pattern.in_list()) {
        (ParameterValue::Phasors(all), Some(number)) => *all.get(number)?,
        (ParameterValue::Phasor(pair), _) => *pair,
        _ => return None,
    };
    pair.iter().all(|v| v.is_finite()).then(|| Complex::new(pair[0], pair[1]))
}

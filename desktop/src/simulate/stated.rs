//! An effect as somebody states it: its name, its place, and some of its parameters.

use std::collections::BTreeMap;

use crate::effects::entry::{resolve, terms_of};
use crate::effects::{Parameter, Scale, Scales, Unknown};
use crate::error::Error;
use crate::machine::drawing::{EffectEntry, ParameterValue, Rotor};

/// An effect that is stated; its parameters are in SI units, under the names of `[[effect]] parameters`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StatedEffect {
    pub kind: String,
    pub at: Option<String>,
    /// A number may stand for a phasor at 0°, and a phasor for a list of one.
    pub parameters: Vec<(String, ParameterValue)>,
}

impl StatedEffect {
    /// `effect@place`, or the effect alone.
    pub fn of_label(label: &str) -> Self {
        let (kind, at) = match label.split_once('@') {
            Some((kind, at)) => (kind, Some(at.to_string())),
            None => (label, None),
        };
        Self { kind: kind.into(), at, parameters: Vec::new() }
    }

    pub fn label(&self) -> String {
        self.at.as_ref().map_or_else(|| self.kind.clone(), |at| format!("{}@{at}", self.kind))
    }

    /// The effect as a file of this rotor states it. A parameter that is not stated is zero where that is none of the
    /// effect, as long as another is stated.
    ///
    /// # Errors
    /// If there is no such effect, place or parameter, a parameter is missing, or the rotor has the effect already.
    pub(super) fn entry(&self, rotor: &Rotor, scales: &Scales) -> Result<EffectEntry, Error> {
        let label = self.label();
        let wrong = |what: String| Error::UnknownEffect(what);
        let (effect, place) = resolve(rotor, &self.kind, self.at.as_deref()).map_err(wrong)?;
        if rotor.effect.iter().any(|e| (&e.kind, &e.at) == (&self.kind, &self.at)) {
            return Err(wrong(format!("{label} is stated twice, or in the rotor's file already")));
        }
        let known = Known {
            parameters: effect.parameters(scales),
            settings: effect.settings(scales),
            unknowns: effect.unknowns(rotor, place),
        };
        let parameters = self.complete(&known, rotor).map_err(|what| wrong(format!("{label}: {what}")))?;
        let entry = EffectEntry { kind: self.kind.clone(), at: self.at.clone(), parameters };
        let with =
            Rotor { effect: [&rotor.effect[..], std::slice::from_ref(&entry)].concat(), ..rotor.clone() };
        if known.unknowns.is_empty() && terms_of(&with) == terms_of(rotor) {
            let why = effect.not_sought(rotor).unwrap_or("changes nothing with these parameters");
            return Err(Error::EffectNotAddable { effect: label, why: why.into() });
        }
        Ok(entry)
    }

    /// Every parameter of the effect.
    fn complete(&self, known: &Known, rotor: &Rotor) -> Result<BTreeMap<String, ParameterValue>, String> {
        for (k, (name, _)) in self.parameters.iter().enumerate() {
            if !known.names().any(|own| own == name) {
                return Err(match known.listed().as_str() {
                    "" => format!("there is no parameter {name}, the effect has none"),
                    listed => format!("there is no parameter {name}, expected {listed}"),
                });
            }
            if self.parameters[..k].iter().any(|(before, _)| before == name) {
                return Err(format!("the parameter {name} is stated twice"));
            }
        }
        if self.parameters.is_empty() && !known.listed().is_empty() {
            return Err(format!("its size is not stated, expected {}", known.listed()));
        }
        let stated = |name: &str| self.parameters.iter().find(|(own, _)| own == name).map(|(_, value)| value);
        let mut all = BTreeMap::new();
        for p in &known.parameters {
            let value = match stated(p.name) {
                Some(value) => real(p.name, value)?,
                None if means_none(p) => 0.0,
                None => {
                    return Err(format!("the parameter {} is missing, expected {}", p.name, known.listed()));
                }
            };
            all.insert(p.name.to_string(), ParameterValue::Real(value));
        }
        for (name, usual) in &known.settings {
            let value = stated(name).map_or(Ok(*usual), |value| real(name, value))?;
            all.insert((*name).to_string(), ParameterValue::Real(value));
        }
        for u in &known.unknowns {
            let value = match (stated(u.name), u.pattern.in_list()) {
                (value, Some(_)) => ParameterValue::Phasors(list(u, value, known.unknowns.len(), rotor)?),
                (value, None) => ParameterValue::Phasor(value.map_or(Ok([0.0; 2]), |v| phasor(u.name, v))?),
            };
            all.insert(u.name.to_string(), value);
        }
        Ok(all)
    }
}

/// The parameters that an effect has at a place.
struct Known {
    parameters: Vec<Parameter>,
    settings: Vec<(&'static str, f64)>,
    unknowns: Vec<Unknown>,
}

impl Known {
    fn names(&self) -> impl Iterator<Item = &'static str> {
        let settings = self.settings.iter().map(|(name, _)| *name);
        self.parameters.iter().map(|p| p.name).chain(settings).chain(self.unknowns.iter().map(|u| u.name))
    }

    /// Names with their units, in words.
    fn listed(&self) -> String {
        let with_unit =
            |name: &str, unit: &str| if unit.is_empty() { name.into() } else { format!("{name} ({unit})") };
        let mut all: Vec<String> = self.parameters.iter().map(|p| with_unit(p.name, p.unit)).collect();
        all.extend(self.settings.iter().map(|(name, _)| with_unit(name, "rad/s")));
        all.extend(self.unknowns.iter().map(|u| with_unit(u.name, u.unit)));
        // a list has one name for all of its phasors
        all.dedup();
        all.join(", ")
    }
}

/// Whether zero is a size of the parameter, and none of the effect.
fn means_none(p: &Parameter) -> bool {
    matches!(p.scale, Scale::Linear(_)) && p.bounds[0] <= 0.0 && 0.0 <= p.bounds[1]
}

fn real(name: &str, value: &ParameterValue) -> Result<f64, String> {
    match value {
        ParameterValue::Real(v) if v.is_finite() => Ok(*v),
        _ => Err(format!("the parameter {name} is one number, as in {name}=0.5")),
    }
}

fn phasor(name: &str, value: &ParameterValue) -> Result<[f64; 2], String> {
    match value {
        ParameterValue::Real(v) if v.is_finite() => Ok([*v, 0.0]),
        ParameterValue::Phasor(pair) if pair.iter().all(|v| v.is_finite()) => Ok(*pair),
        _ => Err(format!("the parameter {name} is one phasor, as in {name}=2e-6@30")),
    }
}

/// A phasor for each probe or plane.
fn list(
    u: &Unknown,
    value: Option<&ParameterValue>,
    count: usize,
    rotor: &Rotor,
) -> Result<Vec<[f64; 2]>, String> {
    let all = match value {
        None => vec![[0.0; 2]; count],
        Some(ParameterValue::Phasors(all)) => all.clone(),
        Some(one) => vec![phasor(u.name, one)?],
    };
    if all.len() == count && all.as_flattened().iter().all(|v| v.is_finite()) {
        return Ok(all);
    }
    let (each, names): (&str, Vec<&str>) = match u.unit {
        "kg·m" => ("plane", rotor.plane.iter().map(|p| p.name.as_str()).collect()),
        _ => ("probe", rotor.probe.iter().map(|p| p.name.as_str()).collect()),
    };
    Err(format!(
        "the parameter {} has {} phasors, expected one for each {each}: {}",
        u.name,
        all.len(),
        names.join(", ")
    ))
}

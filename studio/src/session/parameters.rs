//! The numbers of a model that a person can move and hold.

use std::f64::consts::PI;

use anyhow::{Result, anyhow, bail};
use rotor_edge::render::quantity::about;
use rotor_edge_desktop::diagnose::HeldParameter;
use rotor_edge_desktop::effects::terms::Terms;
use rotor_edge_desktop::effects::{Scale, entry, physical};
use rotor_edge_desktop::machine::bearings::Bearings;
use rotor_edge_desktop::machine::drawing::{EffectEntry, ParameterValue, Rotor};
use rotor_edge_desktop::units::rad_s;
use serde::{Deserialize, Serialize};

/// A slider reaches from a part of a positive number to as many times it.
const REACH_FACTOR: f64 = 8.0;
/// And of a number that may change sign to so many times its size to either side.
const REACH_SIZES: f64 = 3.0;

/// For the reach of sliders at zero, where a file states no speed and amplitudes are not known.
const USUAL_RPM: f64 = 3000.0;
const USUAL_AMPLITUDE_M: f64 = 1e-5;

/// Which number of a model.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParameterId {
    /// Number of the bearing in the file, and its symbol as `k_xx`.
    Bearing(usize, String),
    /// Number of the effect in the file, and its parameter.
    Effect(usize, String),
    /// The same of a phasor: number of the phasor in a list, and its size or angle.
    Phasor(usize, String, usize, Part),
    /// Unbalance of a plane.
    Plane(usize, Part),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    Size,
    Angle,
}

impl ParameterId {
    /// As a fit holds it; `None` of what is solved for.
    pub fn held(&self) -> Option<HeldParameter> {
        match self {
            Self::Bearing(number, symbol) => {
                Some(HeldParameter::Bearing { number: *number, symbol: symbol.clone() })
            }
            Self::Effect(number, name) => Some(HeldParameter::Effect { number: *number, name: name.clone() }),
            Self::Phasor(..) | Self::Plane(..) => None,
        }
    }

    /// Number of the effect that it belongs to, if to one.
    pub fn effect(&self) -> Option<usize> {
        match self {
            Self::Effect(number, _) | Self::Phasor(number, ..) => Some(*number),
            Self::Bearing(..) | Self::Plane(..) => None,
        }
    }
}

/// How far a slider reaches.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Range {
    Logarithmic([f64; 2]),
    Linear([f64; 2]),
}

impl Range {
    /// Around a number.
    fn around(value: f64, scale: Scale) -> Self {
        match scale {
            Scale::Logarithmic if value > 0.0 => {
                Self::Logarithmic([value / REACH_FACTOR, value * REACH_FACTOR])
            }
            _ => {
                let unit = if let Scale::Linear(unit) = scale { unit.abs() } else { 1.0 };
                let reach = REACH_SIZES * if value == 0.0 { unit } else { value.abs() };
                Self::Linear([-reach, reach])
            }
        }
    }

    fn share(self, value: f64) -> f64 {
        let share = match self {
            Self::Logarithmic([low, high]) => (value / low).ln() / (high / low).ln(),
            Self::Linear([low, high]) => (value - low) / (high - low),
        };
        share.clamp(0.0, 1.0)
    }

    fn value(self, share: f64) -> f64 {
        match self {
            Self::Logarithmic([low, high]) => low * (high / low).powf(share),
            Self::Linear([low, high]) => low + share * (high - low),
        }
    }
}

/// A number of a model as the page shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub id: ParameterId,
    /// The bearing, effect or plane that it belongs to.
    pub owner: String,
    pub name: String,
    unit: String,
    pub value: f64,
    range: Range,
}

impl Parameter {
    /// Where on its slider another value is, 0 to 1.
    pub fn share(&self, value: f64) -> f64 {
        self.range.share(value)
    }

    pub fn at(&self, share: f64) -> f64 {
        self.range.value(share.clamp(0.0, 1.0))
    }

    /// A value with its unit.
    pub fn text(&self, value: f64) -> String {
        about(value, &self.unit)
    }
}

/// Every number of a model; where sliders begin.
pub fn all(rotor: &Rotor) -> Vec<Parameter> {
    let bearings = Bearings::of(rotor);
    let mut found: Vec<Parameter> = bearings
        .unknowns()
        .iter()
        .map(|u| {
            let value = u.law.scale.to_si(u.law.stated);
            Parameter {
                id: ParameterId::Bearing(u.bearing, u.law.symbol.clone()),
                owner: format!("bearing {}", rotor.bearing[u.bearing].name),
                name: u.law.symbol.clone(),
                unit: u.law.unit.into(),
                value,
                range: Range::around(value, u.law.scale),
            }
        })
        .collect();
    found.sort_by_key(|p| match p.id {
        ParameterId::Bearing(bearing, _) => bearing,
        _ => usize::MAX,
    });
    for (number, e) in rotor.effect.iter().enumerate() {
        found.extend(of_effect(rotor, number, e));
    }
    for (number, plane) in rotor.plane.iter().enumerate() {
        let owner = format!("unbalance at {}", plane.name);
        let (size, angle) =
            (1e-6 * plane.unbalance_g_mm.unwrap_or(0.0), plane.angle_deg.unwrap_or(0.0).to_radians());
        found.extend(phasor(|part| ParameterId::Plane(number, part), &owner, "", "kg·m", [size, angle]));
    }
    found
}

fn of_effect(rotor: &Rotor, number: usize, e: &EffectEntry) -> Vec<Parameter> {
    let Ok((effect, _)) = entry::resolve(rotor, &e.kind, e.at.as_deref()) else { return Vec::new() };
    let kind = e.kind.replace('_', " ");
    let owner = e.at.as_ref().map_or_else(|| kind.clone(), |at| format!("{kind} at {at}"));
    let fastest_rad_s = rad_s(rotor.fastest_rpm.unwrap_or(USUAL_RPM));
    let scales = physical::scales(rotor, &Terms::drawn(rotor), fastest_rad_s, USUAL_AMPLITUDE_M);
    let units = entry::units(rotor, e);
    let values = entry::real_parameters(effect, e, &scales);
    let mut found: Vec<Parameter> = effect
        .parameters(&scales)
        .iter()
        .zip(values)
        .map(|(p, value)| Parameter {
            id: ParameterId::Effect(number, p.name.into()),
            owner: owner.clone(),
            name: p.name.into(),
            unit: p.unit.into(),
            value,
            range: Range::around(value, p.scale),
        })
        .collect();
    for (name, value) in &e.parameters {
        let unit = units.get(name.as_str()).copied().unwrap_or_default();
        let phasors = match value {
            ParameterValue::Phasor(one) => vec![*one],
            ParameterValue::Phasors(all) => all.clone(),
            ParameterValue::Real(_) => Vec::new(),
        };
        for (k, [re, im]) in phasors.iter().enumerate() {
            let id = |part| ParameterId::Phasor(number, name.clone(), k, part);
            let name = if phasors.len() > 1 { format!("{name} {}", k + 1) } else { name.clone() };
            found.extend(phasor(id, &owner, &format!("{name} "), unit, [re.hypot(*im), im.atan2(*re)]));
        }
    }
    found
}

/// Size and angle of a phasor.
fn phasor(
    id: impl Fn(Part) -> ParameterId,
    owner: &str,
    name: &str,
    unit: &str,
    [size, angle]: [f64; 2],
) -> [Parameter; 2] {
    let size = Parameter {
        id: id(Part::Size),
        owner: owner.into(),
        name: format!("{name}size"),
        unit: unit.into(),
        value: size,
        range: Range::Linear([0.0, REACH_SIZES * if size > 0.0 { size } else { 1.0 }]),
    };
    let angle = Parameter {
        id: id(Part::Angle),
        owner: owner.into(),
        name: format!("{name}angle"),
        unit: "rad".into(),
        value: angle,
        range: Range::Linear([-PI, PI]),
    };
    [size, angle]
}

/// Sets one number of a model, SI units.
///
/// # Errors
/// If the model has no such number, or it is none that a file can have.
pub fn set(rotor: &mut Rotor, id: &ParameterId, value: f64) -> Result<()> {
    if !value.is_finite() {
        bail!("a parameter is no number, expected one");
    }
    let missing = || anyhow!("the model has no such parameter, expected one of its list");
    match id {
        ParameterId::Bearing(bearing, symbol) => {
            let bearings = Bearings::of(rotor);
            let is_it = |u: &rotor_edge_desktop::machine::bearings::BearingUnknown| {
                u.bearing == *bearing && u.law.symbol == *symbol
            };
            let at = bearings.unknowns().iter().position(is_it).ok_or_else(missing)?;
            let mut x = bearings.stated();
            x[at] = bearings.unknowns()[at].law.scale.from_si(value);
            bearings.assign(rotor, &x);
        }
        ParameterId::Effect(number, name) => {
            let entry = rotor.effect.get_mut(*number).ok_or_else(missing)?;
            let known = entry.parameters.get_mut(name).ok_or_else(missing)?;
            *known = ParameterValue::Real(value);
        }
        ParameterId::Phasor(number, name, k, part) => {
            let entry = rotor.effect.get_mut(*number).ok_or_else(missing)?;
            let pair = match entry.parameters.get_mut(name) {
                Some(ParameterValue::Phasor(one)) if *k == 0 => one,
                Some(ParameterValue::Phasors(all)) => all.get_mut(*k).ok_or_else(missing)?,
                _ => return Err(missing()),
            };
            let [re, im] = *pair;
            let (size, angle) = match part {
                Part::Size => (value, im.atan2(re)),
                Part::Angle => (re.hypot(im), value),
            };
            *pair = [size * angle.cos(), size * angle.sin()];
        }
        ParameterId::Plane(number, part) => {
            let plane = rotor.plane.get_mut(*number).ok_or_else(missing)?;
            match part {
                Part::Size => plane.unbalance_g_mm = Some(1e6 * value),
                Part::Angle => plane.angle_deg = Some(value.to_degrees()),
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::files::InputFiles;
    use crate::session::step::Step;

    #[test]
    fn every_parameter_is_set_where_it_is_read() {
        let (rotor, readings) = InputFiles::sample().parsed().unwrap();
        let with = Step::adding(&rotor, &readings, "seal", Some("disk 3")).unwrap();
        let with = Step::adding(&with.rotor, &readings, "shaft_bow", None).unwrap().rotor;
        let parameters = all(&with);
        assert!(parameters.len() > 12, "{parameters:?}");
        for p in &parameters {
            let mut moved = with.clone();
            let value = p.at(0.8);
            set(&mut moved, &p.id, value).unwrap();
            let found = all(&moved).into_iter().find(|other| other.id == p.id).unwrap().value;
            assert!((found - value).abs() < 1e-9 * value.abs().max(1e-12), "{:?}: {found}, {value}", p.id);
            assert!((p.share(p.value) - p.share(p.at(p.share(p.value)))).abs() < 1e-9);
        }
    }

    #[test]
    fn parameter_that_a_model_lacks_is_refused() {
        let (mut rotor, _) = InputFiles::sample().parsed().unwrap();
        for id in [ParameterId::Bearing(0, "k_zz".into()), ParameterId::Effect(3, "k".into())] {
            assert!(set(&mut rotor, &id, 1.0).is_err());
        }
        assert!(set(&mut rotor, &ParameterId::Plane(0, Part::Size), f64::NAN).is_err());
    }
}

//! What conditions of operation change, as `track --method joint` answers it.

use rotor_edge_desktop::interval::HALF_95;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::track::{BearingEffect, ConditionEffect, LogChange, PlaneEffect};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};
use serde::Serialize;

use super::names::coefficient_names;

/// A change for a step of a condition, percent, with the half-width of its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RelativeChange {
    pub percent: f64,
    pub half_width_percent: f64,
}

/// Change of a bearing coefficient for a step of a condition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoefficientChange {
    pub name: String,
    pub percent: f64,
    pub half_width_percent: f64,
}

/// What a step of a condition changes at a bearing: its direct stiffness and damping on average over x and y, and each coefficient.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BearingEffectAnswer {
    pub name: String,
    pub stiffness: RelativeChange,
    pub damping: RelativeChange,
    pub coefficients: Vec<CoefficientChange>,
}

/// What a step of a condition adds to the unbalance of a plane on the last day; the half-width (95 %) is that of a component.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneEffectAnswer {
    pub name: String,
    pub change_g_mm: f64,
    pub angle_deg: f64,
    pub half_width_g_mm: f64,
}

/// What a condition of operation changes, for a step of it in its unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConditionAnswer {
    pub name: String,
    pub unit: &'static str,
    /// Mean over the record; the constants of the bearings are those at the mean.
    pub mean: f64,
    pub step: f64,
    /// Whether bearings or unbalance follow it.
    pub used: bool,
    /// Logarithm of how much more probable the record is with its likeliest effect, less that of the number of trials; used from
    /// 4.6 on.
    pub log_evidence: f64,
    pub bearings: Vec<BearingEffectAnswer>,
    pub planes: Vec<PlaneEffectAnswer>,
    /// Another part of the machine that may follow it instead; None if that is improbable.
    pub other: Option<OtherEffectAnswer>,
}

/// Another part of the machine that may follow a condition: unbalance or bearings. Intervals are the mixture of both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OtherEffectAnswer {
    pub part: &'static str,
    pub probability: f64,
}

impl From<LogChange> for RelativeChange {
    fn from(change: LogChange) -> Self {
        let factor = change.log.exp();
        Self { percent: 100.0 * (factor - 1.0), half_width_percent: 100.0 * factor * HALF_95 * change.sd }
    }
}

impl ConditionAnswer {
    pub fn of(rotor: &Rotor, effect: &ConditionEffect) -> Self {
        let names = coefficient_names(rotor);
        let coefficient = |(i, change): &(usize, LogChange)| {
            let RelativeChange { percent, half_width_percent } = (*change).into();
            CoefficientChange { name: names[*i].clone(), percent, half_width_percent }
        };
        let bearing = |b: &BearingEffect| BearingEffectAnswer {
            name: rotor.bearing[b.bearing].name.clone(),
            stiffness: b.stiffness.into(),
            damping: b.damping.into(),
            coefficients: b.coefficients.iter().map(coefficient).collect(),
        };
        let plane = |p: &PlaneEffect| {
            let [change_g_mm, angle_deg] = g_mm_deg(p.change_kg_m);
            PlaneEffectAnswer {
                name: rotor.plane[p.plane].name.clone(),
                change_g_mm,
                angle_deg,
                half_width_g_mm: HALF_95 * p.sd_kg_m * G_MM,
            }
        };
        Self {
            name: effect.condition.words(),
            unit: effect.condition.unit.symbol(),
            mean: effect.mean,
            step: effect.step,
            used: effect.is_used(),
            log_evidence: effect.evidence,
            bearings: effect.bearings.iter().map(bearing).collect(),
            planes: effect.planes.iter().map(plane).collect(),
            other: effect.other.map(|other| OtherEffectAnswer {
                part: if other.is_unbalance { "unbalance" } else { "bearings" },
                probability: other.probability,
            }),
        }
    }
}

//! Answer of `identify`.

use rotor_edge_desktop::diagnose::PlaneUnbalances;
use rotor_edge_desktop::identify::{BearingParameter, Identifiability, PhaseOne};
use rotor_edge_desktop::unbalance::g_mm_deg;
use serde::Serialize;

use super::alphabetical;
use super::findings::DeterminedAnswer;

/// Bearings and unbalance of a machine's first days (phase I).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identification {
    pub bearings: Vec<IdentifiedCoefficient>,
    pub planes: Vec<IdentifiedPlane>,
    #[serde(serialize_with = "alphabetical")]
    pub determined: DeterminedAnswer,
    pub residual_um: f64,
    pub residual_ratio: f64,
    pub chi2_per_value: f64,
}

/// A coefficient of a bearing: N/m, or N·s/m for damping.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentifiedCoefficient {
    pub bearing: String,
    pub symbol: String,
    pub value: f64,
    pub start: f64,
    pub relative_sd: f64,
    /// Whether the data fix it; else it stayed at its start or bound.
    pub identified: bool,
    /// Where the value comes from.
    #[serde(skip)]
    pub origin: Identifiability,
}

/// A plane of the first days.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentifiedPlane {
    pub name: String,
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
    pub relative_sd: f64,
}

impl From<&PhaseOne> for Identification {
    fn from(found: &PhaseOne) -> Self {
        let coefficient = |p: &BearingParameter| IdentifiedCoefficient {
            bearing: p.bearing.clone(),
            symbol: p.symbol.clone(),
            value: p.value,
            start: p.start,
            relative_sd: p.relative_sd,
            identified: p.identified == Identifiability::FromData,
            origin: p.identified,
        };
        let planes =
            found.rotor.plane.iter().zip(found.unbalance_kg_m.iter()).zip(&found.unbalance_relative_sd);
        Self {
            bearings: found.bearings.iter().map(coefficient).collect(),
            planes: planes
                .map(|((plane, u), sd)| {
                    let [unbalance_g_mm, angle_deg] = g_mm_deg(*u);
                    IdentifiedPlane { name: plane.name.clone(), unbalance_g_mm, angle_deg, relative_sd: *sd }
                })
                .collect(),
            determined: determined(found),
            residual_um: found.residual_um,
            residual_ratio: found.residual_ratio,
            chi2_per_value: found.chi2_per_value,
        }
    }
}

/// The planes with their intervals, or why there are none.
fn determined(found: &PhaseOne) -> DeterminedAnswer {
    let covariance = found.unbalance_covariance();
    if covariance.iter().any(|v| !v.is_finite()) {
        return DeterminedAnswer::open("the data leave the planes open");
    }
    let names = found.rotor.plane.iter().map(|p| p.name.as_str());
    (&PlaneUnbalances::new(names, found.unbalance_kg_m.as_slice(), &covariance)).into()
}

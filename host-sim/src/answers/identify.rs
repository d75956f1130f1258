//! Answer of `identify`.

use rotor_edge_desktop::diagnose::PlaneUnbalances;
use rotor_edge_desktop::identify::{BearingParameter, Departure, Identifiability, PhaseOne};
use rotor_edge_desktop::unbalance::g_mm_deg;
use serde::Serialize;

use super::alphabetical;
use super::findings::DeterminedAnswer;
use super::shared::ZERO_TO_PEAK;

/// Bearings and unbalance of a machine's first days (phase I).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Identification {
    pub bearings: Vec<IdentifiedCoefficient>,
    pub planes: Vec<IdentifiedPlane>,
    #[serde(serialize_with = "alphabetical")]
    pub determined: DeterminedAnswer,
    pub residual_um: f64,
    /// What lengths in µm of the motion are: zero to peak.
    pub amplitude_convention: &'static str,
    pub residual_ratio: f64,
    pub chi2_per_value: f64,
    /// What was assumed, and what is odd in the data, one sentence each.
    pub remarks: Vec<String>,
}

/// A coefficient of a bearing, or a parameter of its film or table, in the SI ``unit``.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentifiedCoefficient {
    pub bearing: String,
    pub symbol: String,
    pub unit: &'static str,
    pub value: f64,
    pub start: f64,
    /// Standard deviation over the value; over the unit where the value may be zero. None where it is not known.
    pub relative_sd: Option<f64>,
    /// Least and most, where the model is adequate; None at a bound.
    pub interval_95: Option<[f64; 2]>,
    /// Whether the data fix it; else it stayed at its start or bound.
    pub identified: bool,
    /// Where the value comes from.
    #[serde(skip)]
    pub origin: Identifiability,
}

/// A number of a bearing that the data contradict, in the SI ``unit``: the 95 % interval does not reach the stated 95 % range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DepartureAnswer {
    pub bearing: String,
    pub symbol: String,
    pub unit: &'static str,
    /// By the data alone, without the stated number.
    pub value: f64,
    pub interval_95: [f64; 2],
    pub stated: f64,
    /// Least and most of the stated number by its tolerance.
    pub stated_interval_95: [f64; 2],
}

impl DepartureAnswer {
    /// Where it is not as stated.
    pub fn of(p: &BearingParameter) -> Option<Self> {
        p.departure.map(|Departure { value, interval_95, stated_95 }| Self {
            bearing: p.bearing.clone(),
            symbol: p.symbol.clone(),
            unit: p.unit,
            value,
            interval_95,
            stated: p.start,
            stated_interval_95: stated_95,
        })
    }
}

/// A plane of the first days.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentifiedPlane {
    pub name: String,
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
    /// Standard deviation over the size; ``determined`` has the 95 % intervals.
    pub relative_sd: f64,
}

impl From<&BearingParameter> for IdentifiedCoefficient {
    fn from(p: &BearingParameter) -> Self {
        Self {
            bearing: p.bearing.clone(),
            symbol: p.symbol.clone(),
            unit: p.unit,
            value: p.value,
            start: p.start,
            relative_sd: Some(p.relative_sd).filter(|sd| sd.is_finite()),
            interval_95: p.interval_95,
            identified: p.identified == Identifiability::FromData,
            origin: p.identified,
        }
    }
}

impl From<&PhaseOne> for Identification {
    fn from(found: &PhaseOne) -> Self {
        let planes =
            found.rotor.plane.iter().zip(found.unbalance_kg_m.iter()).zip(&found.unbalance_relative_sd);
        Self {
            bearings: found.bearings.iter().map(IdentifiedCoefficient::from).collect(),
            planes: planes
                .map(|((plane, u), sd)| {
                    let [unbalance_g_mm, angle_deg] = g_mm_deg(*u);
                    IdentifiedPlane { name: plane.name.clone(), unbalance_g_mm, angle_deg, relative_sd: *sd }
                })
                .collect(),
            determined: determined(found),
            residual_um: found.residual_um,
            amplitude_convention: ZERO_TO_PEAK,
            residual_ratio: found.residual_ratio,
            chi2_per_value: found.chi2_per_value,
            remarks: found.remarks.clone(),
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
    DeterminedAnswer::of(
        &PlaneUnbalances::new(names, found.unbalance_kg_m.as_slice(), &covariance),
        found.model_fits,
    )
}

//! What data determine besides the verdict: the noise as it was found, the planes with their intervals, a cause outside the list of
//! effects, runs whose stated weights are refuted.

use rotor_edge_desktop::diagnose::{
    Account, EquivalentForce, ForceGrowth, FoundWeight, Nature, PlaneUnbalance, PlaneUnbalances, RefutedRun,
    Scatter, UnknownCause,
};
use serde::Serialize;

/// The noise as it was found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NoiseAnswer {
    /// Times what is stated.
    pub scale: f64,
    /// From reading to reading.
    pub correlation: f64,
    /// What runs differ by, of the response.
    pub between_runs: f64,
}

/// A plane and how well the data know it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeterminedPlaneAnswer {
    pub name: String,
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
    /// Least and most, g·mm.
    pub interval_95: [f64; 2],
    /// The angle is known to so much either way.
    pub angle_95_deg: f64,
    /// Half axes of the 95 % region, g·mm, and the direction of the first, degrees.
    pub region: [f64; 3],
    /// Whether the region leaves zero out.
    pub determined: bool,
}

/// The planes as the data determine them; ``why`` says it where they do not, or where the model is rejected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeterminedAnswer {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planes: Option<Vec<DeterminedPlaneAnswer>>,
    /// Condition number of the planes: a 1 % model error can become this many percent in the unbalance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub condition: Option<[f64; 1]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<&'static str>,
    /// Whether the model describes the data; if not, no interval of its bearings and planes holds.
    pub model_adequate: bool,
}

/// Why a rejected model has no intervals.
pub const REJECTED: &str =
    "The model does not describe these data, so no 95 % interval is stated and fitted values can be far off.";

/// Something that no known effect is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnknownCauseAnswer {
    /// force, bearings, stiffness or drawing.
    pub acts_like: &'static str,
    pub drawing: Option<String>,
    pub position_m: f64,
    pub place_probability: f64,
    pub probability: f64,
    pub growth: Option<&'static str>,
    /// The same as a kind.
    #[serde(skip)]
    pub force_growth: Option<ForceGrowth>,
    pub whirl: Option<&'static str>,
    pub forward_share: Option<f64>,
    pub speed_rpm: Option<f64>,
    pub force_n: Option<f64>,
    pub looks_like: &'static str,
}

/// A weight as the rotor's file has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StatedWeight {
    pub plane: String,
    pub magnitude_g_mm: f64,
    pub angle_deg: f64,
}

/// A weight as the data have it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundWeightAnswer {
    pub plane: String,
    pub magnitude_g_mm: f64,
    pub angle_deg: f64,
    /// Least and most, g·mm.
    pub interval_95: [f64; 2],
    pub angle_95_deg: f64,
    /// What would make one of the other.
    pub account: Option<String>,
}

/// A run whose stated weights are not true.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RefutedRunAnswer {
    pub run: String,
    pub probability: f64,
    pub stated: Vec<StatedWeight>,
    pub found: Vec<FoundWeightAnswer>,
    /// Whether the model that finds them describes the data; if not, no interval holds.
    pub model_adequate: bool,
    /// The same in a sentence.
    #[serde(skip)]
    pub words: String,
}

impl From<&Scatter> for NoiseAnswer {
    fn from(scatter: &Scatter) -> Self {
        Self { scale: scatter.scale, correlation: scatter.correlation, between_runs: scatter.between_runs }
    }
}

impl From<&PlaneUnbalance> for DeterminedPlaneAnswer {
    fn from(p: &PlaneUnbalance) -> Self {
        Self {
            name: p.name.clone(),
            unbalance_g_mm: p.unbalance_g_mm,
            angle_deg: p.angle_deg,
            interval_95: p.interval_95_g_mm,
            angle_95_deg: p.angle_95_deg,
            region: p.region.ellipse(),
            determined: p.is_determined(),
        }
    }
}

impl DeterminedAnswer {
    /// Of the planes of a model, which describes the data or not.
    pub fn of(determined: &PlaneUnbalances, model_adequate: bool) -> Self {
        Self {
            planes: Some(determined.planes.iter().map(DeterminedPlaneAnswer::from).collect()),
            condition: Some([determined.separation.condition]),
            why: (!model_adequate).then_some(REJECTED),
            model_adequate,
        }
    }

    /// Of planes that the data leave open.
    pub fn open(why: &'static str) -> Self {
        Self { planes: None, condition: None, why: Some(why), model_adequate: true }
    }
}

impl From<&UnknownCause> for UnknownCauseAnswer {
    fn from(cause: &UnknownCause) -> Self {
        let (acts_like, drawing) = match &cause.nature {
            Nature::Force(_) => ("force", None),
            Nature::Bearings(_) => ("bearings", None),
            Nature::Stiffness(_) => ("stiffness", None),
            Nature::Drawing(what) => ("drawing", Some(what.clone())),
        };
        let force = cause.force();
        Self {
            acts_like,
            drawing,
            position_m: cause.position_m,
            place_probability: cause.place_probability,
            probability: cause.probability,
            growth: force.map(EquivalentForce::growth_in_words),
            force_growth: force.map(|f| f.growth),
            whirl: force.map(EquivalentForce::whirl),
            forward_share: force.map(|f| f.forward),
            speed_rpm: force.map(|f| f.speed_rpm),
            force_n: force.map(|f| f.force_n),
            looks_like: cause.looks_like(),
        }
    }
}

impl From<&RefutedRun> for RefutedRunAnswer {
    fn from(r: &RefutedRun) -> Self {
        let stated = |w: &FoundWeight| StatedWeight {
            plane: w.found.name.clone(),
            magnitude_g_mm: w.stated_g_mm.norm(),
            angle_deg: w.stated_g_mm.arg().to_degrees(),
        };
        let found = |w: &FoundWeight| FoundWeightAnswer {
            plane: w.found.name.clone(),
            magnitude_g_mm: w.found.unbalance_g_mm,
            angle_deg: w.found.angle_deg,
            interval_95: w.found.interval_95_g_mm,
            angle_95_deg: w.found.angle_95_deg,
            account: w.account.map(Account::words),
        };
        Self {
            run: r.run.clone(),
            probability: r.probability,
            stated: r.weights.iter().map(stated).collect(),
            found: r.weights.iter().map(found).collect(),
            model_adequate: r.model_fits,
            words: r.words(),
        }
    }
}

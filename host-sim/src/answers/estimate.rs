//! Answer of `estimate`.

use nalgebra::Complex;
use rotor_edge_desktop::balance::estimate::sessions::{SessionReport, SessionSource};
use rotor_edge_desktop::balance::estimate::{RefutedWeights, RunEstimate, RunEstimates};
use rotor_edge_desktop::unbalance::G_MM;
use rotor_edge_desktop::unbalance::region::UnbalanceRegion;
use serde::Serialize;

use super::shared::PlaneUnbalance;

/// The unbalance of each run relative to a base run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimatesAnswer {
    pub base: String,
    pub estimates: Vec<RunEstimateAnswer>,
    pub condition: Vec<ConditionAnswer>,
    pub determined: PlanesDetermined,
    pub sessions: SessionsAnswer,
    pub refuted_runs: Vec<RefutedWeightsAnswer>,
    pub remarks: Vec<String>,
    /// Names of the planes.
    #[serde(skip)]
    pub planes: Vec<String>,
}

/// What holds a plane's unbalance with 95 %: half axes, g·mm, and the direction of the first, degrees.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegionAnswer {
    pub semi_axes_g_mm: [f64; 2],
    pub major_deg: f64,
    /// Of both components, cosine first.
    pub covariance_g2_mm2: [[f64; 2]; 2],
}

/// A plane of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimatedPlane {
    pub name: String,
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
    /// Least and most, g·mm.
    pub interval_95: [f64; 2],
    pub region: RegionAnswer,
}

/// The same by influence coefficients, where they can.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InfluenceAnswer {
    pub planes: Option<Vec<PlaneUnbalance>>,
}

/// A run beyond the base run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunEstimateAnswer {
    pub run: String,
    /// As the measurement states it.
    pub session: Option<String>,
    pub speed_rpm: Vec<f64>,
    pub planes: Vec<EstimatedPlane>,
    pub influence: InfluenceAnswer,
    /// As the rotor's file has it.
    pub stated: Option<Vec<PlaneUnbalance>>,
}

/// How far the planes can be told apart at a speed, at all together where there is none; ``whitened`` beside the noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConditionAnswer {
    pub speed_rpm: Option<f64>,
    pub condition: Option<f64>,
    pub whitened: Option<f64>,
}

/// How well the data know the planes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanesDetermined {
    pub poorly: bool,
    pub worst_sd_g_mm: Option<f64>,
    pub words: Vec<String>,
}

/// Sessions of measurement, and how far base and scale shift between them (standard deviations).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionsAnswer {
    /// ``stated``, by ``pauses`` between times, by ``blocks`` of consecutive runs, or one session ``assumed``.
    pub source: &'static str,
    /// Sessions or blocks with stated weights that the shift is learned from; of one it is assumed.
    pub learned_from: usize,
    /// Runs that count as new sessions.
    pub new_runs: usize,
    /// Shift of the base, in units of the scatter between mountings.
    pub base_shift: f64,
    /// Shift of the scale of a plane, relative.
    pub scale_shift: f64,
    /// Mean 95 % half-width of the new runs, g·mm; none without new runs.
    pub half_width_g_mm: Option<f64>,
    /// The same if they were of the session of the base run.
    pub half_width_same_session_g_mm: Option<f64>,
    pub words: Vec<String>,
}

/// A run whose stated weights cannot be true.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RefutedWeightsAnswer {
    pub run: String,
    pub probability: f64,
    pub stated: Vec<PlaneUnbalance>,
    pub found: Vec<PlaneUnbalance>,
}

impl EstimatesAnswer {
    /// Of the estimates of all runs; `planes` are the names of the rotor's.
    pub fn of(found: &RunEstimates, planes: &[&str]) -> Self {
        Self {
            base: found.base.clone(),
            estimates: found.runs.iter().map(|e| RunEstimateAnswer::of(e, planes)).collect(),
            condition: (found.determined.conditions.iter())
                .map(|c| ConditionAnswer {
                    speed_rpm: c.speed_rpm,
                    condition: finite(c.condition),
                    whitened: finite(c.whitened),
                })
                .collect(),
            determined: PlanesDetermined {
                poorly: found.determined.poorly,
                worst_sd_g_mm: finite(found.determined.worst_sd_g_mm),
                words: found.determined.words.clone(),
            },
            sessions: SessionsAnswer::of(&found.sessions),
            refuted_runs: found.refuted.iter().map(|r| RefutedWeightsAnswer::of(r, planes)).collect(),
            remarks: found.remarks.clone(),
            planes: planes.iter().map(ToString::to_string).collect(),
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn points(unbalance_g_mm: &[Complex<f64>], planes: &[&str]) -> Vec<PlaneUnbalance> {
    unbalance_g_mm.iter().zip(planes).map(|(u, name)| PlaneUnbalance::of(name, *u / G_MM)).collect()
}

impl SessionsAnswer {
    fn of(found: &SessionReport) -> Self {
        Self {
            source: match found.source {
                SessionSource::Stated => "stated",
                SessionSource::Pauses => "pauses",
                SessionSource::Blocks => "blocks",
                SessionSource::Assumed => "assumed",
            },
            learned_from: found.between.sessions,
            new_runs: found.new_runs,
            base_shift: found.between.base,
            scale_shift: found.between.scale,
            half_width_g_mm: found.half_width_g_mm.map(|[with, _]| with),
            half_width_same_session_g_mm: found.half_width_g_mm.map(|[_, without]| without),
            words: found.words.clone(),
        }
    }
}

impl RunEstimateAnswer {
    fn of(e: &RunEstimate, planes: &[&str]) -> Self {
        Self {
            run: e.run.clone(),
            session: e.session.clone(),
            speed_rpm: e.speeds_rpm.clone(),
            planes: e.planes.iter().zip(planes).map(|(p, name)| EstimatedPlane::of(p, name)).collect(),
            influence: InfluenceAnswer { planes: e.influence_g_mm.as_deref().map(|u| points(u, planes)) },
            stated: e.stated_g_mm.as_deref().map(|u| points(u, planes)),
        }
    }
}

impl EstimatedPlane {
    fn of(p: &UnbalanceRegion, name: &str) -> Self {
        let PlaneUnbalance { name, unbalance_g_mm, angle_deg } =
            PlaneUnbalance::of(name, p.unbalance_g_mm / G_MM);
        let c = p.covariance_g2_mm2;
        Self {
            name,
            unbalance_g_mm,
            angle_deg,
            interval_95: p.magnitude_95_g_mm(),
            region: RegionAnswer {
                semi_axes_g_mm: p.semi_axes_g_mm,
                major_deg: p.major_deg,
                covariance_g2_mm2: [[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]],
            },
        }
    }
}

impl RefutedWeightsAnswer {
    fn of(r: &RefutedWeights, planes: &[&str]) -> Self {
        Self {
            run: r.run.clone(),
            probability: r.probability,
            stated: points(&r.stated_g_mm, planes),
            found: points(&r.found_g_mm, planes),
        }
    }
}

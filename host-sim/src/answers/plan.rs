//! Answer of `plan`.

use rotor_edge_desktop::plan::{Decision, EffectPlan, EffectSize, FurtherMeasurement, Imitation, Plan};
use serde::Serialize;

use super::shared::PlaneUnbalance;

/// What measurements could show before they are made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanAnswer {
    /// The machine as its file calls it.
    pub machine: String,
    /// Readings of all runs together.
    pub readings: usize,
    /// Names of the runs; none for a single one without a name.
    pub runs: Vec<String>,
    /// Slowest and fastest speed.
    pub range_rpm: [f64; 2],
    /// With which an effect of the smallest size is found.
    pub probability: f64,
    /// The unbalance that the machine is taken with.
    pub unbalance: Vec<PlaneUnbalance>,
    pub noise: PlannedNoise,
    /// Why nothing can be found, if bearings and planes use up what the readings hold.
    pub saturated: Option<String>,
    /// Effects that are found at the size that matters, and those that are named alone there.
    pub found: usize,
    pub named_alone: usize,
    pub effects: Vec<PlannedEffect>,
    pub planes: Vec<PlannedPlane>,
    /// Further measurements, those that help most first.
    pub next: Vec<NextMeasurement>,
    /// What would decide between the effects of ``--between``; none if nothing is to be decided.
    pub between: Option<DecisionAnswer>,
    pub remarks: Vec<String>,
}

/// Noise of the readings: a share of the amplitude and a floor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlannedNoise {
    pub relative: f64,
    pub floor_um: f64,
}

/// A parameter of an effect; of a phasor its magnitude.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedParameter {
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    pub value: f64,
}

/// An effect of a certain size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedSize {
    /// Those that grow with the effect.
    pub parameters: Vec<PlannedParameter>,
    /// By how much it changes the vibration, of the vibration, root mean square over the readings.
    pub change: f64,
    /// Probability that it is found, alone or in a group.
    pub found: f64,
    /// Probability that it is named alone.
    pub alone: f64,
}

/// A candidate that imitates an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImitationAnswer {
    /// ``effect@place``.
    pub effect: String,
    /// What it leaves unexplained, in standard deviations of the noise.
    pub left_sd: f64,
}

/// What the measurements would show of an effect at a place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedEffect {
    pub effect: &'static str,
    pub at: Option<String>,
    /// The smallest that is found, alone or in a group; none if none is.
    pub smallest: Option<PlannedSize>,
    /// The smallest that is named alone; none if none is.
    pub smallest_alone: Option<PlannedSize>,
    /// The size that matters: it changes the vibration by a tenth, or by as much as it can.
    pub relevant: PlannedSize,
    /// Whether it is found at the size that matters, or at all where it has no size.
    pub found: bool,
    /// Candidates that a diagnosis would not tell from it at the smallest size.
    pub confused_with: Vec<ImitationAnswer>,
    /// The candidates that imitate it best, told from it or not.
    pub imitations: Vec<ImitationAnswer>,
    /// Whether it has a size at all.
    #[serde(skip)]
    pub has_size: bool,
    /// ``effect@place``.
    #[serde(skip)]
    pub label: String,
}

/// The unbalance of a plane as the measurements would know it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedPlane {
    pub name: String,
    pub unbalance_g_mm: f64,
    /// 95 % half-width in the direction in which it is known least, g·mm; none if it is not known at all.
    pub accuracy: Option<f64>,
    /// 95 % half-width of the angle.
    pub angle_95_deg: f64,
}

/// A measurement beyond the planned ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextMeasurement {
    pub measurement: String,
    /// Expected information on what is missing and on the unbalance, bits.
    pub gain: f64,
    /// By how many more effects are found at the size that matters.
    pub found_more: i64,
    /// By how many more are named alone there, rivals taken as linear.
    pub named_alone_more: i64,
    /// 95 % half-width of each plane's unbalance with it, of that without.
    pub accuracy_ratio: Vec<f64>,
}

/// Which further measurement decides between effects that a diagnosis cannot tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DecisionAnswer {
    /// ``effect@place`` of each.
    pub effects: Vec<String>,
    /// The measurement, or two together, that decide most probably; none if none could be tried.
    pub measurement: Option<String>,
    /// With which one of the effects, of the size that matters, is named alone then, on average over them.
    pub probability: f64,
    /// The same by the planned measurements alone.
    pub probability_without: f64,
}

impl From<&Decision> for DecisionAnswer {
    fn from(decision: &Decision) -> Self {
        Self {
            effects: decision.effects.clone(),
            measurement: decision.measurement.as_ref().map(|m| m.measurement.clone()),
            probability: decision.then,
            probability_without: decision.now,
        }
    }
}

impl PlanAnswer {
    pub fn of(machine: &str, plan: &Plan) -> Self {
        let effects: Vec<PlannedEffect> = plan.effects.iter().map(PlannedEffect::from).collect();
        let ends = plan
            .speeds_rpm
            .iter()
            .fold([f64::INFINITY, 0.0_f64], |[low, high], v| [low.min(*v), high.max(*v)]);
        let unbalance = plan.unbalance.iter().map(|(name, [unbalance_g_mm, angle_deg])| PlaneUnbalance {
            name: name.clone(),
            unbalance_g_mm: *unbalance_g_mm,
            angle_deg: *angle_deg,
        });
        let planes = plan.planes.planes.iter().map(|p| PlannedPlane {
            name: p.name.clone(),
            unbalance_g_mm: p.unbalance_g_mm,
            accuracy: Some(p.region.semi_axes_g_mm[0]).filter(|half| half.is_finite()),
            angle_95_deg: p.angle_95_deg,
        });
        let mut remarks = plan.remarks.clone();
        remarks.extend(plan.planes.alike());
        Self {
            machine: machine.into(),
            readings: plan.readings,
            runs: plan.runs.clone(),
            range_rpm: ends,
            probability: plan.probability,
            unbalance: unbalance.collect(),
            noise: PlannedNoise { relative: plan.noise.relative, floor_um: plan.noise.floor_um },
            saturated: plan.saturated.clone(),
            found: effects.iter().filter(|e| e.found).count(),
            named_alone: effects.iter().filter(|e| e.relevant.alone >= plan.probability).count(),
            effects,
            planes: planes.collect(),
            next: plan.next.iter().map(NextMeasurement::from).collect(),
            between: plan.between.as_ref().map(DecisionAnswer::from),
            remarks,
        }
    }
}

impl From<&EffectSize> for PlannedSize {
    fn from(size: &EffectSize) -> Self {
        let parameter = |p: &rotor_edge_desktop::plan::SizedParameter| PlannedParameter {
            name: p.name,
            unit: p.unit,
            value: p.value,
        };
        Self {
            parameters: size.parameters.iter().map(parameter).collect(),
            change: size.change,
            found: size.found,
            alone: size.alone,
        }
    }
}

impl From<&Imitation> for ImitationAnswer {
    fn from(imitation: &Imitation) -> Self {
        Self { effect: imitation.label.clone(), left_sd: imitation.left_sd }
    }
}

impl From<&EffectPlan> for PlannedEffect {
    fn from(e: &EffectPlan) -> Self {
        Self {
            effect: e.effect,
            at: e.at.clone(),
            smallest: e.smallest.as_ref().map(PlannedSize::from),
            smallest_alone: e.alone.as_ref().map(PlannedSize::from),
            relevant: PlannedSize::from(&e.relevant),
            found: e.is_found_at_relevant_size(),
            confused_with: e.confused_with().map(ImitationAnswer::from).collect(),
            imitations: e.imitations.iter().map(ImitationAnswer::from).collect(),
            has_size: e.has_size,
            label: e.label(),
        }
    }
}

fn more([with, without]: [usize; 2]) -> i64 {
    with as i64 - without as i64
}

impl From<&FurtherMeasurement> for NextMeasurement {
    fn from(m: &FurtherMeasurement) -> Self {
        Self {
            measurement: m.measurement.clone(),
            gain: m.gain_bits,
            found_more: more(m.found),
            named_alone_more: more(m.alone),
            accuracy_ratio: m.half_widths.clone(),
        }
    }
}

//! The answer of a plan.

use super::{Campaign, UnbalanceSource};
use crate::diagnose::PlaneUnbalances;
use crate::effects::Knowledge;
use crate::machine::drawing::{EffectEntry, Noise};

/// A parameter of an effect; of a phasor its magnitude.
#[derive(Debug, Clone, PartialEq)]
pub struct SizedParameter {
    /// As in `[[effect]] parameters`.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    pub value: f64,
}

/// An effect of a certain size.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectSize {
    /// Those that grow with the effect.
    pub parameters: Vec<SizedParameter>,
    /// As a rotor's file states it.
    pub entry: EffectEntry,
    /// Change of the readings by it, relative to them, root mean square.
    pub change: f64,
    /// Probability that it is found, alone or in a group.
    pub found: f64,
    /// Probability that it is named alone.
    pub alone: f64,
}

/// A candidate that fits the readings nearly as well as the effect that makes them.
#[derive(Debug, Clone, PartialEq)]
pub struct Imitation {
    /// `effect@place`.
    pub label: String,
    /// What it leaves unexplained, in standard deviations of the noise.
    pub left_sd: f64,
    /// Whether a diagnosis would hardly tell the two apart.
    pub is_rival: bool,
}

/// What the measurements would show of an effect at a place.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectPlan {
    pub effect: &'static str,
    /// Name of the bearing, disk, probe or run; `None` for the whole machine.
    pub at: Option<String>,
    /// The smallest that is found with the probability asked for, alone or in a group; `None` if none is.
    pub smallest: Option<EffectSize>,
    /// The smallest that is named alone with that probability; `None` if none is.
    pub alone: Option<EffectSize>,
    /// The one that changes the readings by a tenth, or by as much as it can; for an effect without parameters the only one.
    pub relevant: EffectSize,
    /// Whether it has a size at all.
    pub has_size: bool,
    /// Candidates that imitate it at the smallest size, the best first; at the relevant size where none is found.
    pub imitations: Vec<Imitation>,
    pub knowledge: Knowledge,
}

impl EffectPlan {
    /// `effect@place`, or the effect alone.
    pub fn label(&self) -> String {
        self.at.as_ref().map_or_else(|| self.effect.to_string(), |at| format!("{}@{at}", self.effect))
    }

    /// Whether it is found where it changes the readings by no more than a tenth, or at all where it has no size.
    pub fn is_found_at_relevant_size(&self) -> bool {
        match (&self.smallest, self.has_size) {
            (Some(smallest), true) => smallest.change <= self.relevant.change * (1.0 + 1e-6),
            (smallest, _) => smallest.is_some(),
        }
    }

    /// Candidates that it is confused with.
    pub fn confused_with(&self) -> impl Iterator<Item = &Imitation> {
        self.imitations.iter().filter(|i| i.is_rival)
    }
}

/// A measurement beyond the planned ones.
#[derive(Debug, Clone, PartialEq)]
pub struct FurtherMeasurement {
    pub measurement: String,
    /// The planned measurements with this one.
    pub campaign: Campaign,
    /// Expected information on what is missing and on the unbalance, bits.
    pub gain_bits: f64,
    /// Effects that would be found at their relevant size, and how many without it.
    pub found: [usize; 2],
    /// Effects that would be named alone at their relevant size, and how many without it.
    pub alone: [usize; 2],
    /// Probability that an effect of its relevant size is named alone, by label.
    pub alone_of: Vec<(String, f64)>,
    /// 95 % half-width of each plane's unbalance with it, relative to that without.
    pub half_widths: Vec<f64>,
}

/// What would decide between some effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// `effect@place` of each.
    pub effects: Vec<String>,
    /// Probability that a diagnosis of the planned measurements names an effect of the relevant size alone, averaged over these effects.
    pub now: f64,
    /// The same probability with the further measurement.
    pub then: f64,
    /// The measurement, or two together, that decide most probably. `None` if none was tried.
    pub measurement: Option<FurtherMeasurement>,
}

/// What measurements could show.
#[derive(Debug, Clone)]
pub struct Plan {
    pub readings: usize,
    /// Names of the runs; empty for a single one without a name.
    pub runs: Vec<String>,
    pub speeds_rpm: Vec<f64>,
    /// With which effects are to be found.
    pub probability: f64,
    /// Size and angle of the unbalance that the machine is taken with, g·mm and degrees, by plane.
    pub unbalance: Vec<(String, [f64; 2])>,
    pub unbalance_source: UnbalanceSource,
    pub noise: Noise,
    /// Why no effect can be found at all, if bearings and planes use up what the readings hold.
    pub saturated: Option<String>,
    pub effects: Vec<EffectPlan>,
    /// The unbalances with their 95 % regions.
    pub planes: PlaneUnbalances,
    /// Further measurements, those that help most first.
    pub next: Vec<FurtherMeasurement>,
    /// What would decide between the effects of the request.
    pub between: Option<Decision>,
    /// The measurements that are planned.
    pub campaign: Campaign,
    /// What was assumed, one sentence each.
    pub remarks: Vec<String>,
}

//! What measurements could show before they are made: which effects would be found at which size, what they would be confused
//! with, how well the unbalance would be known, and which further measurement helps most.
//!
//! Around the machine as its file states it, the readings are taken as linear in what a fit can follow: bearings within their priors,
//! planes, errors of the drawing within their tolerances. An effect changes the readings by its signal. The visible signal is the part
//! that none of these follows. Its square in noise units is the non-centrality of the gain in χ² by which a diagnosis judges (Wald 1943).
//! The diagnosis weighs the effect against its rivals, an unknown cause and noise alone by their evidence (`crate::statistics::evidence`);
//! the distribution of that evidence gives the probability that the effect is claimed. Large effects move the bearings far: near the
//! smallest size the model and the strongest rivals are fitted to the changed readings, without noise.
//!
//! | module | holds |
//! |---|---|
//! | `campaign` | runs, speeds and unbalance; the readings that the machine as stated would give |
//! | `model` | the machine in such readings: what a fit follows, what candidates and unknown causes can imitate |
//! | `noise` | the noise of readings that an effect changes |
//! | `strength` | an effect from nothing to more than a machine has |
//! | `power` | probability that an effect is found |
//! | `smallest` | the smallest effect that is found |
//! | `further` | which further measurement helps most |
//! | `decision` | which one, or two, decide between some effects |

mod answer;
mod campaign;
mod decision;
mod further;
mod imitation;
mod model;
mod noise;
mod planned;
mod power;
mod smallest;
mod strength;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

pub use answer::{Decision, EffectPlan, EffectSize, FurtherMeasurement, Imitation, Plan, SizedParameter};
pub use campaign::{Campaign, PlanRequest, UnbalanceSource, runs_of};

use crate::diagnose::rank;
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::fit::progress::ProgressListener;
use crate::machine::drawing::{Rotor, Tolerance};
use further::{Further, SoughtEffect};
use planned::PlannedModel;
use power::FittedRival;

/// What measurements of a machine could show.
///
/// # Errors
/// If the request contradicts the rotor, there is nothing to fit, or the machine is singular as stated.
pub fn plan(rotor: &Rotor, request: &PlanRequest) -> Result<Plan, Error> {
    plan_telling(rotor, request, &|_, _| ())
}

/// The same for somebody who waits: `told` hears how many steps are done, of how many that are planned so far.
///
/// # Errors
/// As [`plan`].
pub fn plan_telling(rotor: &Rotor, request: &PlanRequest, told: ProgressListener) -> Result<Plan, Error> {
    let campaign = Campaign::new(rotor, request)?;
    let readings = campaign.readings()?;
    let noise = campaign.noise;
    let fitter = Fitter::new(&campaign.rotor, Data::new(&campaign.rotor, &noise, &readings)).telling(told);
    crate::diagnose::checks::enough(&fitter)?;
    let planned = PlannedModel::of(&fitter, noise)?;
    let saturated = rank::saturation(&planned.base);
    let progress = &fitter.progress;
    progress.plan(planned.candidates.len());
    let look = |number: usize| {
        let found = smallest::effect(&planned, number, request.probability, saturated.is_some());
        progress.step();
        found
    };
    let (effects, rivals): (Vec<EffectPlan>, Vec<Vec<FittedRival>>) =
        (0..planned.candidates.len()).into_par_iter().map(look).unzip();
    let planes = planned.planes()?;
    let sizes = SoughtEffect::all(&planned, &effects, &rivals);
    let now = Further::found_by(&planned, &sizes, &planes);
    let further = Further::of(&campaign, &planned, &sizes, &now);
    let between = match request.between.is_empty() {
        true => None,
        false => Some(Decision::between(&request.between, &campaign, &sizes, &now, &further)?),
    };
    let next = further.into_iter().map(|(_, measurement)| measurement).collect();
    let mut remarks = Vec::new();
    remarks.extend(campaign.remark());
    remarks.extend(noise.assumption(&campaign.rotor));
    remarks.extend(Tolerance::assumption(&campaign.rotor));
    Ok(Plan {
        readings: readings.len(),
        runs: campaign.rotor.run.iter().filter(|run| !run.slow_roll).map(|run| run.name.clone()).collect(),
        speeds_rpm: request.speeds_rpm.clone(),
        probability: request.probability,
        unbalance: campaign.stated(),
        unbalance_source: campaign.source,
        noise,
        saturated,
        effects,
        planes,
        next,
        between,
        campaign,
        remarks,
    })
}

//! Which further measurement helps most.
//!
//! Each measurement is added to the planned ones, and the answer is worked out anew for effects of the sizes that matter. Its gain is the
//! expected information in bits. On which effect is missing, the gain is the lower bound on the mutual information of Kolchinsky and Tracey
//! (Entropy 2017, 19, 361), with the Bhattacharyya distance of each pair of effects. On the unbalance of a plane, the gain is the logarithm
//! of the factor by which the area of its 95 % region shrinks.

use nalgebra::Complex;
use rayon::prelude::*;

use super::answer::{EffectPlan, FurtherMeasurement};
use super::campaign::Campaign;
use super::imitation::Candidate;
use super::planned::PlannedModel;
use super::power::{Explained, FittedRival, Outcome, outcome};
use super::strength::EffectState;
use crate::diagnose::advice::{self, Measurement};
use crate::diagnose::base::{BaseModel, same};
use crate::diagnose::{PlaneUnbalances, rank};
use crate::effects::entry;
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::fit::hypothesis::PlacedEffect;
use crate::machine::drawing::{EffectEntry, ParameterValue, Rotor};

/// Readings that are averaged into one.
const AVERAGED: f64 = 4.0;
/// A pair of probes nearer than this share of the shaft's length to another is no further one.
const SAME_PLACE: f64 = 0.02;
/// Pairs of probes between bearings beside those at disks.
const BETWEEN_BEARINGS: [f64; 3] = [0.25, 0.5, 0.75];
/// Pairs of probes that are tried.
const MOST_PAIRS: usize = 6;

/// An effect of the size that matters.
pub struct SoughtEffect {
    pub placed: PlacedEffect,
    pub entry: EffectEntry,
    /// Rivals that were fitted to the planned measurements, with what each leaves as [`FittedRival`] has it.
    pub rivals: Vec<(PlacedEffect, f64)>,
}

impl SoughtEffect {
    /// Those of a plan with the rivals that were fitted to each.
    pub fn all(planned: &PlannedModel, effects: &[EffectPlan], rivals: &[Vec<FittedRival>]) -> Vec<Self> {
        let placed = |rival: &FittedRival| (planned.candidates[rival.candidate].placed, rival.share);
        let of = |((candidate, effect), rivals): ((&Candidate, &EffectPlan), &Vec<FittedRival>)| Self {
            placed: candidate.placed,
            entry: effect.relevant.entry.clone(),
            rivals: rivals.iter().map(placed).collect(),
        };
        planned.candidates.iter().zip(effects).zip(rivals).map(of).collect()
    }

    /// Its rivals among these candidates.
    fn rivals_among(&self, candidates: &[Candidate]) -> Vec<FittedRival> {
        let number = |placed: &PlacedEffect| candidates.iter().position(|c| same(&c.placed, placed));
        let of = |(placed, share): &(PlacedEffect, f64)| {
            number(placed).map(|candidate| FittedRival { candidate, share: *share })
        };
        self.rivals.iter().filter_map(of).collect()
    }
}

/// What is measured beyond a plan.
#[derive(Clone)]
pub enum Addition {
    Measurement(Measurement),
    /// Several readings averaged into each.
    Averages,
}

impl Addition {
    /// Everything that one could go on with.
    fn all(planned: &PlannedModel) -> Vec<Self> {
        measurements(planned).into_iter().map(Self::Measurement).chain([Self::Averages]).collect()
    }

    pub fn name(&self) -> String {
        match self {
            Self::Measurement(m) => m.name.clone(),
            Self::Averages => format!("{AVERAGED:.0} readings averaged at every speed"),
        }
    }

    /// A campaign with it.
    pub fn to(&self, campaign: &Campaign) -> Campaign {
        match self {
            Self::Measurement(m) => campaign.with(m),
            Self::Averages => campaign.averaged(AVERAGED),
        }
    }
}

/// What can be found with some measurements, effect by effect of the size that matters.
pub struct Further {
    found: usize,
    alone: usize,
    /// Probability of each effect to be named alone, by label.
    pub alone_of: Vec<(String, f64)>,
    bits: f64,
    half_widths: Vec<f64>,
}

impl Further {
    /// Further measurements beside planned ones, with which `now` can be found, those that help most first.
    pub fn of(
        campaign: &Campaign,
        planned: &PlannedModel,
        sizes: &[SoughtEffect],
        now: &Self,
    ) -> Vec<(Addition, FurtherMeasurement)> {
        let additions = Addition::all(planned);
        let progress = &planned.base.fitter.progress;
        progress.plan(additions.len());
        let try_one = |addition: Addition| {
            let then = Self::beyond(now, addition.name(), addition.to(campaign), sizes);
            progress.step();
            Some((addition, then?))
        };
        let mut all: Vec<(Addition, FurtherMeasurement)> =
            additions.into_par_iter().filter_map(try_one).collect();
        all.sort_by(|(_, a), (_, b)| b.gain_bits.total_cmp(&a.gain_bits));
        all
    }

    /// With the measurements of a campaign.
    ///
    /// # Errors
    /// If the machine is singular.
    fn by(campaign: &Campaign, sizes: &[SoughtEffect]) -> Result<Self, Error> {
        let readings = campaign.readings()?;
        let fitter = Fitter::new(&campaign.rotor, Data::new(&campaign.rotor, &campaign.noise, &readings));
        let placed: Vec<PlacedEffect> = sizes.iter().map(|sought| sought.placed).collect();
        let planned = PlannedModel::looking_for(BaseModel::as_stated(&fitter)?, campaign.noise, &placed)?;
        let planes = planned.planes()?;
        Ok(Self::found_by(&planned, sizes, &planes))
    }

    pub fn found_by(planned: &PlannedModel, sizes: &[SoughtEffect], planes: &PlaneUnbalances) -> Self {
        let is_saturated = rank::saturation(&planned.base).is_some();
        let look = |number: usize| {
            let placed = planned.candidates[number].placed;
            let with = planned.with(placed);
            let sought = sizes.iter().find(|sought| same(&sought.placed, &placed))?;
            let state = stated(&with.scales, with.rotor, placed, &sought.entry);
            let change = planned.change(&with, &planned.forward(&with).ok()?, &state)?;
            let signal = planned.signal_beside_fit(&change)?;
            let explained = Explained::of(planned, number, &signal);
            let outcome = outcome(planned, number, &explained, &sought.rivals_among(&planned.candidates));
            Some((placed.label(with.rotor), outcome))
        };
        let looked: Vec<(String, Outcome)> =
            (0..planned.candidates.len()).into_par_iter().filter_map(look).collect();
        let (labels, outcomes): (Vec<String>, Vec<Outcome>) = looked.into_iter().unzip();
        let alone = outcomes.iter().map(|o| if is_saturated { 0.0 } else { o.alone });
        let count = |of: &dyn Fn(&Outcome) -> f64| match is_saturated {
            true => 0,
            false => outcomes.iter().filter(|o| of(o) >= super::smallest::PROBABLE).count(),
        };
        let bits = if is_saturated { 0.0 } else { outcomes.iter().map(|o| o.bits).sum::<f64>() };
        Self {
            found: count(&|o| o.found),
            alone: count(&|o| o.alone),
            alone_of: labels.into_iter().zip(alone).collect(),
            bits: bits / outcomes.len().max(1) as f64,
            half_widths: planes.planes.iter().map(|p| p.region.semi_axes_g_mm[0]).collect(),
        }
    }

    /// What the measurements of a campaign are worth beyond those with which so much is found; `None` where the machine cannot be computed
    /// in them, which is no help.
    pub fn beyond(
        before: &Self,
        measurement: String,
        campaign: Campaign,
        sizes: &[SoughtEffect],
    ) -> Option<FurtherMeasurement> {
        let then = Self::by(&campaign, sizes).ok()?;
        let ratio = |(then, now): (&f64, &f64)| if *now > 0.0 && now.is_finite() { then / now } else { 1.0 };
        let half_widths: Vec<f64> = then.half_widths.iter().zip(&before.half_widths).map(ratio).collect();
        let by_planes: f64 = half_widths.iter().map(|r| -2.0 * r.max(f64::MIN_POSITIVE).log2()).sum();
        Some(FurtherMeasurement {
            measurement,
            campaign,
            gain_bits: then.bits - before.bits + by_planes,
            found: [then.found, before.found],
            alone: [then.alone, before.alone],
            alone_of: then.alone_of,
            half_widths,
        })
    }
}

/// Numbers of an effect as a rotor's file states it.
fn stated(
    scales: &crate::effects::Scales,
    rotor: &Rotor,
    placed: PlacedEffect,
    entry: &EffectEntry,
) -> EffectState {
    let unknowns = placed.effect.unknowns(rotor, placed.place);
    let magnitude = unknowns.last().map_or(1.0, |u| match entry.parameters.get(u.name) {
        Some(ParameterValue::Phasor([re, im])) => Complex::new(*re, *im).norm(),
        Some(ParameterValue::Phasors(all)) => {
            all.last().map_or(0.0, |[re, im]| Complex::new(*re, *im).norm())
        }
        _ => 0.0,
    });
    EffectState { placed, parameters: entry::real_parameters(placed.effect, entry, scales), magnitude }
}

/// Measurements that one could go on with: those of a diagnosis, and pairs of probes between bearings.
fn measurements(planned: &PlannedModel) -> Vec<Measurement> {
    let (base, rotor) = (&planned.base, planned.base.fitter.rotor);
    let (pairs, mut all): (Vec<Measurement>, Vec<Measurement>) =
        advice::measurements(base, rotor).into_iter().partition(|m| !m.extra.is_empty());
    let length_m = rotor.length_m();
    let apart = |z: f64, other: f64| (z - other).abs() > SAME_PLACE * length_m;
    let mut places: Vec<f64> = pairs.iter().map(|m| m.extra[0].position_m).collect();
    let mut bearings: Vec<f64> = rotor.bearing.iter().map(|b| b.position_m).collect();
    bearings.sort_by(f64::total_cmp);
    for share in BETWEEN_BEARINGS {
        let between = bearings.windows(2).map(|ends| ends[0] + share * (ends[1] - ends[0]));
        let fresh: Vec<f64> = between.filter(|z| places.iter().all(|other| apart(*z, *other))).collect();
        places.extend(fresh);
    }
    places.retain(|z| rotor.probe.iter().all(|p| apart(*z, p.position_m)));
    places.truncate(MOST_PAIRS);
    all.extend(places.into_iter().map(|z| pair(rotor, z)));
    all
}

/// A further pair of X/Y probes at a position, m.
pub fn pair(rotor: &Rotor, position_m: f64) -> Measurement {
    let at = rotor.disk.iter().find(|d| (d.position_m - position_m).abs() < 1e-9);
    let beside = at.map_or_else(String::new, |disk| format!(" ({})", disk.name));
    Measurement {
        name: format!("a further X/Y pair of probes at {position_m:.3} m{beside}"),
        speeds_rpm: Vec::new(),
        extra: advice::pair_at(rotor, &format!("{position_m:.3} m"), position_m),
        weight: None,
    }
}

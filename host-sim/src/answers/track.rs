//! Answer of `track`.

use nalgebra::Complex;
use rotor_edge_desktop::interval::interval_95;
use rotor_edge_desktop::machine::drawing::{Plane, Rotor};
use rotor_edge_desktop::track::{
    CaseFit, ConstantPart, CredibleIntervals, Event, Flag, FlagCause, Instrument, JointFindings, Quality,
    ReadingEstimate, Reidentified, SamplerKind, Sampling, SecondSpeed, Track,
};
use rotor_edge_desktop::unbalance::{G_MM, static_and_dynamic};
use serde::Serialize;

use super::compare::ResidualAnswer;
use super::names::{coefficient_names, kind_name, method_name, sampler_name, scope_name};
use super::shared::{ByName, PlaneUnbalance, UnbalanceAnswer, ZERO_TO_PEAK};
use super::track_conditions::ConditionAnswer;

/// The unbalance of a long record while bearings change.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackAnswer {
    pub method: &'static str,
    /// When day 0 was (ISO 8601).
    pub begin: Option<String>,
    pub readings: usize,
    pub residual_um: ResidualAnswer,
    /// What lengths in µm of the motion are: zero to peak.
    pub amplitude_convention: &'static str,
    pub residual_ratio: AroundEvent,
    pub event_d: Option<f64>,
    pub reduction_against_fixed: ReductionAnswer,
    pub flags: Vec<FlagAnswer>,
    pub reidentified: Vec<ReidentifiedAnswer>,
    pub estimates: Vec<EstimateAnswer>,
    /// How good the samples of bayes are.
    pub sampling: Option<SamplingAnswer>,
    pub joint: Option<JointAnswer>,
    pub undiagnosed_since_d: Option<f64>,
    pub remarks: Vec<String>,
    /// Readings of the record; `readings` counts those with an estimate.
    #[serde(skip)]
    pub recorded: usize,
}

/// Mean residual, of the features.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AroundEvent {
    pub before_event: Option<f64>,
    pub after_event: Option<f64>,
}

/// By how much the residual is smaller than with constant bearings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReductionAnswer {
    pub whole: Option<f64>,
    pub after_event: Option<f64>,
}

/// A residual that stayed high; ``cause`` is model, unbalance or instrument.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlagAnswer {
    pub since_d: f64,
    pub time_d: f64,
    /// The same as a date (ISO 8601), where it is known when day 0 was.
    pub time: Option<String>,
    pub suspect: String,
    pub cause: &'static str,
}

/// One of the ways in which bearings may have changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseAnswer {
    pub case: u8,
    pub residual_um: f64,
    pub unknowns: usize,
    pub criterion: f64,
    pub bearings: ByName<f64>,
    pub planes: Vec<PlaneUnbalance>,
}

/// Bearings that were identified anew, SI units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReidentifiedAnswer {
    pub since_d: f64,
    pub time_d: f64,
    pub case: u8,
    pub bearing: String,
    pub bearings: ByName<f64>,
    pub cases: Vec<CaseAnswer>,
    /// Bearings that the machine has.
    #[serde(skip)]
    pub of_bearings: usize,
}

/// Ends of a plane's 95 % interval.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneInterval {
    pub name: String,
    pub unbalance_g_mm: [f64; 2],
    pub angle_deg: [f64; 2],
}

/// Ends of the 95 % intervals of an estimate; bearings in SI units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimateInterval {
    pub planes: Vec<PlaneInterval>,
    pub bearings: ByName<[f64; 2]>,
}

/// A day.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimateAnswer {
    pub time_d: f64,
    pub time: Option<String>,
    pub planes: Vec<PlaneUnbalance>,
    #[serde(rename = "static")]
    pub static_unbalance: UnbalanceAnswer,
    pub dynamic: UnbalanceAnswer,
    pub residual_um: f64,
    pub residual_ratio: f64,
    pub flagged: bool,
    pub interval_95: Option<EstimateInterval>,
}

/// Samples of a day, or of several: accepted proposals, effective samples of the mean and of the tails, R-hat.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QualityAnswer {
    pub acceptance: f64,
    pub effective_samples: f64,
    pub effective_samples_tail: f64,
    pub r_hat: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_d: Option<f64>,
}

/// How good the samples of bayes are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SamplingAnswer {
    pub sampler: &'static str,
    pub proposals: usize,
    pub chains: usize,
    pub median: Option<QualityAnswer>,
    pub worst: Option<QualityAnswer>,
    pub days: Vec<QualityAnswer>,
    /// The samplers of the paper, side by side.
    #[serde(flatten)]
    pub paper: Option<PaperSamplers>,
}

/// The paper's random walk beside adaptive Metropolis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PaperSamplers {
    pub metropolis: Option<QualityAnswer>,
    pub adaptive_metropolis: Option<QualityAnswer>,
}

/// Something that changed the machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventAnswer {
    pub time_d: f64,
    pub time: Option<String>,
    pub interval_95_d: [f64; 2],
    pub changed: String,
    /// machine, restart (bearings and unbalance are new after an outage), probe gain or keyphasor.
    pub kind: &'static str,
    /// Gain of the probe after it over that before, of a probe gain.
    pub gain: Option<f64>,
    /// Angle by which all probes are turned, of a keyphasor.
    pub turn_deg: Option<f64>,
    /// Whether it is an outage that was stated; its evidence is not judged and is 0.
    pub stated: bool,
    pub log_evidence: f64,
    /// Whether the machine changed between its bearings.
    #[serde(skip)]
    pub is_elsewhere: bool,
}

/// An event with too little evidence to be claimed; intervals are the mixture with it and without it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PossibleEventAnswer {
    pub event: EventAnswer,
    pub probability: f64,
}

/// The constant part of a number of a bearing, SI unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstantAnswer {
    pub name: String,
    pub value: f64,
    /// Standard deviation over the value.
    pub relative_sd: f64,
    /// Least and most.
    pub interval_95: [f64; 2],
    pub from_data: bool,
}

/// Bearings from a day on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateAnswer {
    pub since_d: f64,
    pub bearings: Vec<ConstantAnswer>,
}

/// What a second reading a day at another speed would give after some days of readings. Half-widths (95 %) are those of a
/// component of the planes' unbalance, rms over the planes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SecondSpeedAnswer {
    pub speed_rpm: f64,
    pub days: f64,
    pub half_width_g_mm: f64,
    /// The same with readings at the record's speed alone.
    pub without_g_mm: f64,
    pub gain_g_mm: f64,
}

impl From<&SecondSpeed> for SecondSpeedAnswer {
    fn from(advice: &SecondSpeed) -> Self {
        let (half_width_g_mm, without_g_mm) = (advice.half_width_kg_m * G_MM, advice.without_kg_m * G_MM);
        Self {
            speed_rpm: advice.speed_rpm,
            days: advice.days,
            half_width_g_mm,
            without_g_mm,
            gain_g_mm: without_g_mm - half_width_g_mm,
        }
    }
}

/// What all days together say.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointAnswer {
    pub events: Vec<EventAnswer>,
    pub possible_events: Vec<PossibleEventAnswer>,
    pub states: Vec<StateAnswer>,
    /// Standard deviation of what comes and goes over the value.
    pub wander_relative_sd: ByName<f64>,
    pub wander_days: f64,
    pub left_out_d: Vec<f64>,
    pub effects: Vec<String>,
    /// One for each condition of operation that the record has and that changes.
    pub conditions: Vec<ConditionAnswer>,
    /// The second speed that helps most; None where the record has several, or none helps.
    pub second_speed: Option<SecondSpeedAnswer>,
}

/// The moment of a day in ISO 8601, where it is known.
type Moment<'a> = &'a dyn Fn(f64) -> Option<String>;

impl TrackAnswer {
    /// Of a followed record of so many readings; `moment` is when a day was.
    pub fn of(rotor: &Rotor, track: &Track, recorded: usize, moment: Moment) -> Self {
        let sum: f64 = track.estimates.iter().map(|e| e.residual.e_um).sum();
        let ratio = |keep: &dyn Fn(&&ReadingEstimate) -> bool| {
            let kept: Vec<f64> = track.estimates.iter().filter(keep).map(|e| e.residual.ratio()).collect();
            (!kept.is_empty()).then(|| kept.iter().sum::<f64>() / kept.len() as f64)
        };
        let event_d = track.event_d.unwrap_or(f64::INFINITY);
        let [whole, after_event] = track.reduction();
        Self {
            method: method_name(track.method),
            begin: moment(0.0),
            readings: track.estimates.len(),
            residual_um: ResidualAnswer { sum, mean: sum / track.estimates.len() as f64 },
            amplitude_convention: ZERO_TO_PEAK,
            residual_ratio: AroundEvent {
                before_event: ratio(&|e| e.time_d < event_d),
                after_event: ratio(&|e| e.time_d >= event_d),
            },
            event_d: track.event_d,
            reduction_against_fixed: ReductionAnswer { whole, after_event },
            flags: track.flags.iter().map(|f| FlagAnswer::of(rotor, f, moment)).collect(),
            reidentified: track.reidentified.iter().map(|r| ReidentifiedAnswer::of(rotor, r)).collect(),
            estimates: track.estimates.iter().map(|e| EstimateAnswer::of(rotor, e, moment)).collect(),
            sampling: track.sampling.as_ref().map(SamplingAnswer::from),
            joint: track.joint.as_ref().map(|j| JointAnswer::of(rotor, j, moment)),
            undiagnosed_since_d: track.undiagnosed_since_d,
            remarks: track.remarks.clone(),
            recorded,
        }
    }
}

fn planes(rotor: &Rotor, unbalance_kg_m: &[Complex<f64>]) -> Vec<PlaneUnbalance> {
    rotor.plane.iter().zip(unbalance_kg_m).map(|(p, u)| PlaneUnbalance::of(&p.name, *u)).collect()
}

fn bearings(rotor: &Rotor, logs: &[f64]) -> ByName<f64> {
    coefficient_names(rotor).into_iter().zip(logs.iter().map(|log| log.exp())).collect()
}

impl FlagAnswer {
    fn of(rotor: &Rotor, flag: &Flag, moment: Moment) -> Self {
        Self {
            since_d: flag.since_d,
            time_d: flag.time_d,
            time: moment(flag.time_d),
            suspect: rotor.bearing[flag.suspect].name.clone(),
            cause: match flag.cause {
                FlagCause::Model => "model",
                FlagCause::Unbalance => "unbalance",
                FlagCause::Instrument => "instrument",
            },
        }
    }
}

impl ReidentifiedAnswer {
    fn of(rotor: &Rotor, r: &Reidentified) -> Self {
        let case = |c: &CaseFit| CaseAnswer {
            case: c.case,
            residual_um: c.residual_um,
            unknowns: c.unknowns,
            criterion: c.criterion,
            bearings: bearings(rotor, &c.logs),
            planes: planes(rotor, &c.unbalance_kg_m),
        };
        Self {
            since_d: r.since_d,
            time_d: r.time_d,
            case: r.case,
            bearing: rotor.bearing[r.bearing].name.clone(),
            bearings: bearings(rotor, &r.logs),
            cases: r.cases.iter().map(case).collect(),
            of_bearings: rotor.bearing.len(),
        }
    }
}

impl EstimateAnswer {
    fn of(rotor: &Rotor, e: &ReadingEstimate, moment: Moment) -> Self {
        let [fixed, couple] = static_and_dynamic(&rotor.plane_positions_m(), &e.unbalance_kg_m);
        Self {
            time_d: e.time_d,
            time: moment(e.time_d),
            planes: planes(rotor, &e.unbalance_kg_m),
            static_unbalance: UnbalanceAnswer::of(fixed),
            dynamic: UnbalanceAnswer::of(couple),
            residual_um: e.residual.e_um,
            residual_ratio: e.residual.ratio(),
            flagged: e.flagged,
            interval_95: e.spread.as_ref().map(|s| EstimateInterval::of(rotor, s)),
        }
    }
}

impl EstimateInterval {
    fn of(rotor: &Rotor, spread: &CredibleIntervals) -> Self {
        let plane = |(j, p): (usize, &Plane)| {
            let [unbalance_g_mm, angle_deg] = plane_ends(spread, j);
            PlaneInterval { name: p.name.clone(), unbalance_g_mm, angle_deg }
        };
        let names = coefficient_names(rotor).into_iter();
        let ends = spread.logs.iter().map(|log| [log.low.exp(), log.high.exp()]);
        Self {
            planes: rotor.plane.iter().enumerate().map(plane).collect(),
            bearings: names.zip(ends).collect(),
        }
    }
}

/// Ends of a plane's unbalance, g·mm, and of its angle, degrees.
pub fn plane_ends(spread: &CredibleIntervals, plane: usize) -> [[f64; 2]; 2] {
    let (size, angle) = (spread.magnitude_kg_m[plane], spread.angle_rad[plane]);
    [[size.low.max(0.0) * G_MM, size.high * G_MM], [angle.low.to_degrees(), angle.high.to_degrees()]]
}

impl QualityAnswer {
    fn of(q: &Quality, time_d: Option<f64>) -> Self {
        Self {
            acceptance: q.acceptance,
            effective_samples: q.effective_bulk,
            effective_samples_tail: q.effective_tail,
            r_hat: q.r_hat,
            time_d,
        }
    }
}

impl From<&Sampling> for SamplingAnswer {
    fn from(sampling: &Sampling) -> Self {
        let of = |q: Option<Quality>| q.map(|q| QualityAnswer::of(&q, None));
        let is_paper = sampling.sampler == SamplerKind::Metropolis;
        Self {
            sampler: sampler_name(sampling.sampler),
            proposals: sampling.proposals,
            chains: sampling.chains,
            median: of(sampling.median()),
            worst: of(sampling.worst()),
            days: sampling.days.iter().map(|(time_d, q)| QualityAnswer::of(q, Some(*time_d))).collect(),
            paper: is_paper.then(|| PaperSamplers {
                metropolis: of(sampling.median()),
                adaptive_metropolis: of(sampling.adaptive),
            }),
        }
    }
}

impl JointAnswer {
    fn of(rotor: &Rotor, joint: &JointFindings, moment: Moment) -> Self {
        let names = coefficient_names(rotor);
        let event = |e: &Event| EventAnswer {
            time_d: e.time_d,
            time: moment(e.time_d),
            interval_95_d: [e.interval_d.low, e.interval_d.high],
            changed: scope_name(rotor, e.scope),
            kind: kind_name(e.scope),
            gain: e.scope.is_gain().then(|| e.factor.norm()),
            turn_deg: matches!(e.scope.instrument, Some(Instrument::PhaseReference))
                .then(|| e.factor.arg().to_degrees()),
            stated: e.stated,
            log_evidence: e.evidence,
            is_elsewhere: e.scope.elsewhere,
        };
        // over a record an event is taken to be as probable as none
        let possible = |e: &Event| PossibleEventAnswer {
            event: event(e),
            probability: 1.0 / (1.0 + (-e.evidence).exp()),
        };
        let constant = |(name, c): (&String, &ConstantPart)| ConstantAnswer {
            name: name.clone(),
            value: c.log.exp(),
            relative_sd: c.sd,
            interval_95: interval_95(c.log, c.sd).map(f64::exp),
            from_data: c.from_data,
        };
        let state = |(since_d, constants): &(f64, Vec<ConstantPart>)| StateAnswer {
            since_d: *since_d,
            bearings: names.iter().zip(constants).map(constant).collect(),
        };
        Self {
            events: joint.events.iter().map(event).collect(),
            possible_events: joint.possible.iter().map(possible).collect(),
            states: joint.constants.iter().map(state).collect(),
            wander_relative_sd: names.iter().cloned().zip(joint.walk_sd.iter().copied()).collect(),
            wander_days: joint.walk_days,
            left_out_d: joint.left_out_d.clone(),
            effects: joint.effects.clone(),
            conditions: joint.conditions.iter().map(|c| ConditionAnswer::of(rotor, c)).collect(),
            second_speed: joint.second_speed.as_ref().map(SecondSpeedAnswer::from),
        }
    }
}

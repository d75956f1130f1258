//! The unbalance of each run relative to a base run, from runs of which the weights are stated.
//!
//! | module | holds |
//! |---|---|
//! | [`mounting`] | readings as runs at common speeds, repeats averaged |
//! | [`prior`] | the prior of the influence from the model |
//! | [`scatter`] | scatter between mountings |
//! | [`sessions`], [`shift`] | sessions of measurement, and how far base and scale shift between them |
//! | [`learning`] | influence and scatter from the runs |
//! | [`refutation`] | stated weights that cannot be true |
//! | [`region`] | the unbalance of a run, with its region |
//! | [`without_model`] | the same by influence coefficients alone |
//! | [`condition`] | condition number of the planes, and measurements that would improve it |
//!
//! With few runs the physics decides, with many the data: the model is the mean of a Gaussian prior whose covariance comes from
//! its own parameters and from a discrepancy in proportion to the response.

pub mod condition;
pub mod learning;
pub mod mounting;
pub mod prior;
pub mod refutation;
pub mod region;
pub mod scatter;
#[cfg(test)]
mod session_tests;
pub mod sessions;
pub mod shift;
#[cfg(test)]
mod tests;
pub mod without_model;

use nalgebra::{Complex, DVector};

use crate::error::Error;
use crate::machine::drawing::{Rotor, Tolerance};
use crate::measurement::Reading;
use crate::unbalance::region::UnbalanceRegion;
use condition::ConditionReport;
use learning::{InfluenceLearner, LearnedInfluence};
use mounting::Mountings;
use prior::MachinePrior;
use refutation::{REFUTED, RefutationTest, without_each};
use region::estimated;
use scatter::ScatterStructure;
use sessions::{SessionReport, SessionSource, Sessions};
use shift::SessionScatter;
use without_model::{coefficients, unbalance_g_mm};

type C = Complex<f64>;

/// Points of the model around which it is taken as linear.
const POINTS: usize = 8;
/// After how many of them readings are moved to the common speeds.
const MOVED: usize = 5;
/// Rounds of learning at each.
const LEARNING: usize = 3;
/// Longest step of a parameter between them, standard deviations.
const LONGEST_STEP: f64 = 1.5;

#[derive(Debug, Clone, Default)]
pub struct EstimateOptions {
    /// The run that the others are compared with; unless stated, the one without weights.
    pub base: Option<String>,
    /// Nothing is learned from the stated weights of the run that is estimated.
    pub leave_one_out: bool,
    /// All stated weights are taken as true.
    pub trust_weights: bool,
}

/// The unbalance of a run relative to the base run.
#[derive(Debug, Clone)]
pub struct RunEstimate {
    pub run: String,
    /// As the measurement states it.
    pub session: Option<String>,
    /// Speeds that it comes from, rpm.
    pub speeds_rpm: Vec<f64>,
    /// By the model and the runs, plane by plane.
    pub planes: Vec<UnbalanceRegion>,
    /// By influence coefficients alone, g·mm; `None` where the runs do not determine them.
    pub influence_g_mm: Option<Vec<C>>,
    pub stated_g_mm: Option<Vec<C>>,
}

/// A run whose stated weights cannot be true.
#[derive(Debug, Clone)]
pub struct RefutedWeights {
    pub run: String,
    /// Probability that they are not true.
    pub probability: f64,
    pub stated_g_mm: Vec<C>,
    /// Unbalance found without the run, g·mm.
    pub found_g_mm: Vec<C>,
}

#[derive(Debug, Clone)]
pub struct RunEstimates {
    /// Name of the base run.
    pub base: String,
    /// Every run but the base, in the order of the data.
    pub runs: Vec<RunEstimate>,
    /// Whether the planes are told apart.
    pub determined: ConditionReport,
    /// Sessions, and what they add to the intervals.
    pub sessions: SessionReport,
    /// Runs whose stated weights cannot be true, least probable first.
    pub refuted: Vec<RefutedWeights>,
    /// Omissions and doubts, one sentence each.
    pub remarks: Vec<String>,
}

/// Estimates the unbalance of every run relative to the base run.
///
/// # Errors
/// One sentence if there is no base run, no stated run, or the model is singular.
pub fn estimate(
    rotor: &Rotor,
    readings: &[Reading],
    options: &EstimateOptions,
) -> Result<RunEstimates, Error> {
    let measured = Mountings::of(rotor, readings, options.base.as_deref())?;
    let machine = MachinePrior::new(rotor, &measured.speeds_rad_s);
    let mut sessions = Sessions::of(&measured);
    let base = measured.base;
    let base_session = sessions.of[base];
    let mut shares: Vec<f64> =
        measured.runs.iter().map(|m| f64::from(u8::from(m.stated.is_some()))).collect();
    let mut now = converged(rotor, &machine, &measured, &sessions, &shares)?;
    let judge = RefutationTest::of(&now.learner, base).filter(|_| !options.trust_weights);
    if let Some(judge) = &judge {
        shares = judge.shares(&now.learner)?;
        now = converged(rotor, &machine, &measured, &sessions, &shares)?;
    }
    let planes = rotor.plane.len();
    let between = match sessions.in_blocks(planes) {
        Some(blocks) => {
            sessions.source = SessionSource::Blocks;
            let of_blocks = converged(rotor, &machine, &measured, &blocks, &shares)?.learned.between_sessions;
            now.expect_shift(of_blocks, &shares)?;
            of_blocks
        }
        None => now.learned.between_sessions,
    };
    let ConvergedFit { learner, mountings, learned } = now;
    let without = match judge.is_some() || options.leave_one_out {
        true => without_each(&learner, &learned, &shares, base)?,
        false => Vec::new(),
    };
    let probabilities = match &judge {
        Some(judge) => judge.probabilities(&without, &learner)?,
        None => vec![1.0; shares.len()],
    };
    let stated = || learner.stated.iter().flatten().flatten();
    let largest_g_mm = stated().map(|u| u.norm()).fold(0.0, f64::max);
    let found =
        |learned: &LearnedInfluence, k: usize| estimated(learned, &learner.seen[k], planes, largest_g_mm);
    let trusted: Vec<bool> = probabilities.iter().map(|p| *p >= REFUTED).collect();
    let (mut runs, mut refuted) = (Vec::new(), Vec::new());
    for (k, m) in mountings.runs.iter().enumerate().filter(|(k, _)| *k != base) {
        let used: Vec<bool> =
            (0..trusted.len()).map(|i| trusted[i] && !(options.leave_one_out && i == k)).collect();
        let plain = coefficients(&mountings, &used);
        if !trusted[k] {
            refuted.push(RefutedWeights {
                run: m.run.clone(),
                probability: 1.0 - probabilities[k],
                stated_g_mm: m.stated.clone().unwrap_or_default(),
                found_g_mm: found(&without[k], k)?.into_iter().map(|p| p.unbalance_g_mm).collect(),
            });
        }
        runs.push(RunEstimate {
            run: m.run.clone(),
            session: m.session.clone(),
            speeds_rpm: measured_rpm(m, mountings.probes),
            planes: found(if options.leave_one_out { &without[k] } else { &learned }, k)?,
            influence_g_mm: plain.and_then(|all| unbalance_g_mm(&all, &m.phasors)),
            stated_g_mm: m.stated.clone(),
        });
    }
    refuted.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let half_widths = half_widths(&learned, &learner, base_session, planes, largest_g_mm)?;
    let mut remarks = mountings.remarks.clone();
    remarks.extend(Tolerance::assumption(rotor));
    if judge.is_none() && !options.trust_weights {
        remarks.push("The runs with stated weights are too few to tell a wrong weight by the others.".into());
    }
    Ok(RunEstimates {
        base: mountings.runs[base].run.clone(),
        determined: ConditionReport::of(rotor, &machine, &mountings, &learned, largest_g_mm, base_session)?,
        sessions: SessionReport::new(&sessions, &mountings, between, &half_widths),
        runs,
        refuted,
        remarks,
    })
}

/// 95 % half-widths by plane of the runs of another session, g·mm: as they are, and as if they were of the session of the base run.
fn half_widths(
    learned: &LearnedInfluence,
    learner: &InfluenceLearner,
    base_session: Option<usize>,
    planes: usize,
    largest_g_mm: f64,
) -> Result<Vec<[f64; 2]>, Error> {
    let mut half_widths = Vec::new();
    for seen in learner.seen.iter().filter(|seen| seen.session.is_none()) {
        let with = estimated(learned, seen, planes, largest_g_mm)?;
        let without = estimated(learned, &seen.clone().of_session(base_session), planes, largest_g_mm)?;
        let of_plane = |(a, b)| [a, b].map(UnbalanceRegion::half_width_95_g_mm);
        half_widths.extend(with.iter().zip(&without).map(of_plane));
    }
    Ok(half_widths)
}

fn measured_rpm(m: &mounting::Mounting, probes: usize) -> Vec<f64> {
    let seen = |row: &usize| m.phasors[*row].is_some();
    let rows: Vec<usize> = (0..m.phasors.len()).filter(seen).collect();
    let first = rows.chunk_by(|a, b| a / probes == b / probes).map(|rows| rows[0]);
    first.map(|row| crate::units::rpm(m.speeds_rad_s[row])).collect()
}

/// Learned at the most probable parameters of the model.
struct ConvergedFit {
    learner: InfluenceLearner,
    /// With readings moved to the common speeds.
    mountings: Mountings,
    learned: LearnedInfluence,
}

impl ConvergedFit {
    /// Takes its one session for the mean of the sessions that this shift was learned from.
    fn expect_shift(&mut self, between: SessionScatter, shares: &[f64]) -> Result<(), Error> {
        self.learner.between_sessions = Some(between.of_mean());
        self.learned = self.learner.learn(shares, Some(&self.learned), LEARNING)?;
        Ok(())
    }
}

/// Moves the model to where these shares of the runs say, and readings to the common speeds by it.
fn converged(
    rotor: &Rotor,
    machine: &MachinePrior,
    measured: &Mountings,
    sessions: &Sessions,
    shares: &[f64],
) -> Result<ConvergedFit, Error> {
    let mut mountings = measured.clone();
    let mut parameters = DVector::zeros(machine.parameters());
    let mut before: Option<LearnedInfluence> = None;
    let mut points = 0;
    loop {
        let linear = machine.near(parameters.clone())?;
        let structure = ScatterStructure::new(rotor, &linear.influence, &mountings.levels_um());
        let learner = InfluenceLearner::new(&mountings, sessions, linear, structure);
        let learned = learner.learn(shares, before.as_ref(), LEARNING)?;
        points += 1;
        if points == POINTS {
            return Ok(ConvergedFit { learner, mountings, learned });
        }
        let step = &learned.parameters - &parameters;
        parameters += step.map(|d| d.clamp(-LONGEST_STEP, LONGEST_STEP));
        before = Some(learned);
        if points == MOVED {
            mountings = measured.at_common_speeds(&machine.speed_slopes(&parameters)?);
        }
    }
}

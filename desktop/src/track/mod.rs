//! The unbalance of a long record, while the machine's bearings change.
//!
//! | method | what it does |
//! |---|---|
//! | [`Method::Fixed`] | phase I once, phase II daily, bearings constant |
//! | [`Method::Adaptive`] | bearings identified anew when the residual jumps and stays (Machines 2023, 11, 976) |
//! | [`Method::Bayes`] | bearings and unbalance sampled daily, and widely after a jump (Sensors 2024, 24, 8123) |
//! | [`Method::Joint`] | all days in one state-space model: bearings walk at random, the unbalance drifts and jumps |
//!
//! | module | holds |
//! |---|---|
//! | `faults` | checks of a record; an error names the row |
//! | `record`, `operating_point` | readings, each with the machine solved at its speed |
//! | `answer` | configuration and results |
//! | `conditions` | load, temperatures and pressures as covariates |
//! | `planes` | check that one reading determines the unbalance of every plane |
//! | [`detector`], `step` | residual and its baseline; step or random walk |
//! | `daily` | phase I, phase II and the fixed method |
//! | `cases`, `adaptive` | the four cases of a re-identification |
//! | `bayes` | bearings and unbalance sampled; the paper's random walk, and an independence sampler |
//! | `joint` | all days together |
//! | `filtered` | the joint method with the data up to each day only |

mod adaptive;
mod answer;
mod bayes;
mod cases;
mod coefficients;
mod conditions;
mod daily;
pub mod detector;
mod faults;
mod filtered;
mod joint;
mod operating_point;
mod planes;
mod record;
mod step;

pub use answer::{
    Config, CredibleIntervals, Flag, FlagCause, Interval, Method, Outage, PROPOSALS, PROPOSALS_AS_PRINTED,
    ReadingEstimate, Reidentified,
};
pub use bayes::sampling::{PosteriorSample, Quality, SamplerKind, Sampling};
pub use cases::CaseFit;
pub use coefficients::Logs;
pub use coefficients::{FollowedNumber, followed};
pub use detector::{DetectorThresholds, ReadingResidual};
pub use faults::check as check_record;
pub use filtered::filtered;
pub use joint::{
    BearingEffect, BearingSet, ConditionEffect, ConstantPart, Event, Instrument, JointFindings, LaterRunup,
    LogChange, OtherEffect, PlaneEffect, Scope, SecondSpeed,
};

use crate::error::Error;
use crate::identify::PhaseOne;
use crate::machine::drawing::Rotor;
use crate::machine::tolerance::Deviations;
use crate::measurement::{Condition, Reading};
use crate::statistics::interval::HALF_95;
use daily::Tracking;

#[derive(Debug, Clone)]
pub struct Track {
    pub method: Method,
    /// Phase I, unless the file was identified.
    pub phase_one: Option<PhaseOne>,
    /// One for each usable reading.
    pub estimates: Vec<ReadingEstimate>,
    pub flags: Vec<Flag>,
    pub reidentified: Vec<Reidentified>,
    /// First day of a changed machine, if no run-up was taken since. Near one speed an effect that the file lacks
    /// looks like changed bearings.
    pub undiagnosed_since_d: Option<f64>,
    /// The same readings with constant bearings: the reference for every method.
    pub fixed: Vec<ReadingEstimate>,
    /// First day on which the constant bearings failed for good, if they did.
    pub event_d: Option<f64>,
    /// Convergence of the chains, of [`Method::Bayes`].
    pub sampling: Option<Sampling>,
    /// Events, constants and process model, of [`Method::Joint`].
    pub joint: Option<JointFindings>,
    /// Remarks on the record, one sentence each.
    pub remarks: Vec<String>,
}

impl Track {
    /// Mean residual of these estimates from a day on, µm.
    fn mean_um(estimates: &[ReadingEstimate], from_d: f64) -> Option<f64> {
        let after: Vec<f64> =
            estimates.iter().filter(|e| e.time_d >= from_d).map(|e| e.residual.e_um).collect();
        (!after.is_empty()).then(|| after.iter().sum::<f64>() / after.len() as f64)
    }

    /// How much smaller the mean residual is than with constant bearings: over the whole record, and from
    /// the event on.
    pub fn reduction(&self) -> [Option<f64>; 2] {
        [Some(f64::NEG_INFINITY), self.event_d].map(|from| {
            let from = from?;
            let (own, fixed) = (Self::mean_um(&self.estimates, from)?, Self::mean_um(&self.fixed, from)?);
            Some(1.0 - own / fixed)
        })
    }
}

/// Follows a record of this rotor; a run-up in the state of the first days helps phase I, later ones help
/// [`Method::Joint`] alone. `progress` takes the steps done and their total.
///
/// # Errors
/// If the record cannot be followed: too short, begun after an event, a dead probe.
pub fn track(
    rotor: &Rotor,
    record: &[Reading],
    runup: &[Reading],
    later: &[LaterRunup],
    config: &Config,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Track, Error> {
    rotor.validate()?;
    coefficients::can_follow(rotor)?;
    let tracking = Tracking::begin(rotor, record, runup, config)?;
    let fixed = tracking.fixed(&mut |_, _| ());
    let event_d = fixed.flags.first().map(|f| f.since_d);
    let (mut sampling, mut joint) = (None, None);
    let run = match config.method {
        Method::Fixed => fixed.clone(),
        Method::Adaptive => tracking.adaptive(progress),
        Method::Bayes => {
            let (run, found) =
                if config.paper { tracking.bayes_as_printed(progress) } else { tracking.bayes(progress) };
            sampling = found;
            run
        }
        Method::Joint => {
            let (run, found) = tracking.joint(record, runup, later, progress)?;
            joint = Some(found);
            run
        }
    };
    let estimates = tracking.with_weights(run.estimates);
    let fixed = tracking.with_weights(fixed.estimates);
    let mut remarks = tracking.remarks;
    remarks.extend(left_out_of_intervals(rotor, tracking.phase_one.as_ref()));
    if config.method != Method::Joint && !config.conditions.is_empty() {
        let columns: Vec<String> = config.conditions.iter().map(Condition::column).collect();
        remarks.push(format!(
            "This method does not use the conditions of operation ({}); --method joint does.",
            columns.join(", ")
        ));
    }
    if joint.as_ref().is_some_and(|j| !j.settled) {
        remarks.push(
            "How bearings and unbalance move had not been learned to the end when the rounds for it ran out: intervals \
             may be off."
                .into(),
        );
    }
    let events = joint.iter().flat_map(|j| &j.events).filter(|e| e.scope.is_of_model()).map(|e| e.time_d);
    let changed = run.reidentified.iter().map(|r| r.since_d).chain(events);
    let undiagnosed =
        changed.filter(|since| later.iter().all(|l| l.time_d < *since)).min_by(|a, b| a.total_cmp(b));
    Ok(Track {
        method: config.method,
        undiagnosed_since_d: undiagnosed,
        phase_one: tracking.phase_one,
        estimates,
        flags: run.flags,
        reidentified: run.reidentified,
        fixed,
        event_d,
        sampling,
        joint,
        remarks,
    })
}

/// A sentence on errors of the drawing, which no estimate of a record allows for; `None` where the drawing is exact.
fn left_out_of_intervals(rotor: &Rotor, phase_one: Option<&PhaseOne>) -> Option<String> {
    if Deviations::of(rotor).is_empty() {
        return None;
    }
    let by = phase_one.map_or_else(String::new, |found| {
        let largest = found.unbalance_errors_by_drawing().into_iter().fold(0.0, f64::max);
        format!(" by up to {:.0} % (95 %)", 100.0 * HALF_95 * largest)
    });
    Some(format!(
        "The drawing counts as exact: its errors change the unbalance{by}, about the same on all days, and are in no interval."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::Tolerance;
    use crate::testing::sample_rotor;

    #[test]
    fn track_says_what_its_intervals_leave_out_of_the_drawing() {
        let exact = Rotor { tolerance: Some(Tolerance::exact()), ..sample_rotor() };
        assert_eq!(left_out_of_intervals(&exact, None), None);
        let said = left_out_of_intervals(&Rotor { tolerance: None, ..sample_rotor() }, None).unwrap();
        assert!(said.contains("its errors change the unbalance, about the same on all days"), "{said}");
    }
}

//! What all days together say, as the estimates, flags and re-identifications of a track.

use nalgebra::{Complex, DVector};

use super::answer::{Constant, Joint};
use super::kalman::Gaussian;
use super::passes::Problem;
use super::search::Found;
use super::state::{Layout, Scope};
use crate::track::answer::{Cause, Flag, Interval, Reidentified, Spread};
use crate::track::coefficients::{COEFFICIENTS, PRIOR_LOG_SD, coefficient};
use crate::track::daily::{Run, Tracking};
use crate::track::operating_point::Logs;

type C = Complex<f64>;

/// Half of a 95 % interval, in standard deviations.
const HALF: f64 = 1.96;

impl Tracking<'_> {
    /// What was found, as estimates.
    pub(super) fn estimates(&self, problem: &Problem, found: &Found, effects: Vec<String>) -> (Run, Joint) {
        let layout = problem.layout;
        let mut run = Run::default();
        let mut known_then_kg_m = Vec::new();
        let scaled = |x: &DVector<f64>| -> Vec<C> {
            layout.unbalance(x).iter().map(|u| u * problem.unit_kg_m).collect()
        };
        for (k, day) in problem.own() {
            let state = &found.smoothed[k];
            let Some(mut estimate) = self.estimate(day, &layout.logs(&state.mean), scaled(&state.mean))
            else {
                continue;
            };
            estimate.spread = Some(spread(layout, state, problem.unit_kg_m));
            estimate.suspicious = found.pass.impossible[k];
            known_then_kg_m.push(scaled(&found.pass.filtered[k].mean));
            run.estimates.push(estimate);
        }
        for (event, k) in found.events.iter().zip(&found.at) {
            let [before, after] = [k - 1, *k].map(|k| layout.constant_logs(&found.smoothed[k].mean));
            let suspect = suspect(event.scope, &before, &after);
            let of_model = event.scope.bearings.contains(&true);
            let cause = if of_model { Cause::Model } else { Cause::Unbalance };
            run.flags.push(Flag { since_d: event.time_d, time_d: event.time_d, suspect, cause });
            if of_model {
                let both = event.scope.bearings == [true; 2];
                run.reidentified.push(Reidentified {
                    since_d: event.time_d,
                    time_d: event.time_d,
                    case: 1 + u8::from(event.scope.unbalance) + if both { 2 } else { 0 },
                    bearing: suspect,
                    cases: Vec::new(),
                    logs: after,
                });
            }
        }
        let states = std::iter::once(0).chain(found.at.iter().copied());
        let constants = states.map(|k| {
            let state = &found.smoothed[k];
            let (logs, sd) = (layout.constant_logs(&state.mean), layout.constant_sd(&state.covariance));
            let of = |(log, sd): (&f64, &f64)| Constant {
                log: *log,
                sd: *sd,
                from_data: *sd < 0.5 * PRIOR_LOG_SD,
            };
            (problem.epochs[k].time_d, logs.iter().zip(&sd).map(of).collect())
        });
        let settled = &found.motion.push / (1.0 - found.motion.keep.powi(2));
        let joint = Joint {
            constants: constants.collect(),
            wander: std::array::from_fn(|i| settled[(i, i)].sqrt()),
            wander_days: -problem.pace_d / found.motion.keep.ln(),
            left_out_d: problem
                .own()
                .filter(|(k, _)| found.pass.impossible[*k])
                .map(|(_, d)| d.time_d)
                .collect(),
            events: found.events.clone(),
            effects,
            known_then_kg_m,
        };
        (run, joint)
    }
}

/// The bearing that an event changed; of both, the one that changed more.
fn suspect(scope: Scope, before: &Logs, after: &Logs) -> usize {
    let change = |bearing: usize| {
        let own = |i: &usize| coefficient(*i).0 == bearing;
        (0..COEFFICIENTS).filter(own).map(|i| (after[i] - before[i]).powi(2)).sum::<f64>()
    };
    match scope.bearings {
        [true, false] => 0,
        [false, true] => 1,
        _ => usize::from(change(1) > change(0)),
    }
}

/// Intervals of a state.
fn spread(layout: Layout, state: &Gaussian, unit_kg_m: f64) -> Spread {
    let (logs, sd) = (layout.logs(&state.mean), layout.logs_sd(&state.covariance));
    let linearised_at = |at: f64, sd: f64| Interval { low: at - HALF * sd, high: at + HALF * sd };
    let along = |j: usize, turn: f64| {
        // standard deviation of the plane's unbalance along its own direction, or across it
        let u = C::from_polar(1.0, layout.unbalance(&state.mean)[j].arg() + turn);
        let c = |a: usize, b: usize| state.covariance[(2 * j + a, 2 * j + b)];
        let variance = u.re * u.re * c(0, 0) + 2.0 * u.re * u.im * c(0, 1) + u.im * u.im * c(1, 1);
        variance.max(0.0).sqrt()
    };
    let planes = 0..layout.planes;
    let size = |j: usize| layout.unbalance(&state.mean)[j].norm();
    let angle = |j: usize| layout.unbalance(&state.mean)[j].arg();
    Spread {
        logs: std::array::from_fn(|i| linearised_at(logs[i], sd[i])),
        magnitude_kg_m: planes
            .clone()
            .map(|j| linearised_at(size(j) * unit_kg_m, along(j, 0.0) * unit_kg_m))
            .collect(),
        angle_rad: planes
            .map(|j| linearised_at(angle(j), along(j, std::f64::consts::FRAC_PI_2) / size(j).max(1e-9)))
            .collect(),
    }
}

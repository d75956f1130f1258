//! Estimates, flags and re-identifications from the smoothed states.

use nalgebra::Complex;
use statrs::distribution::{ContinuousCDF, Normal};

use super::answer::{ConstantPart, JointFindings};
use super::conclude::SmoothedHistory;
use super::coordinate::Coordinate;
use super::kalman::Gaussian;
use super::passes::JointProblem;
use super::scope::Scope;
use super::state::{Layout, MarginalState};
use crate::statistics::interval::HALF_95;
use crate::track::answer::{CredibleIntervals, Flag, FlagCause, Interval, ReadingEstimate, Reidentified};
use crate::track::coefficients::FollowedNumber;
use crate::track::daily::{self, TrackedRecord, Tracking};
use crate::track::detector::{ReadingResidual, largest};
use crate::track::record::Day;

type C = Complex<f64>;

/// Share of the probability that an interval leaves out at either end.
const TAIL: f64 = 0.025;
/// Halvings by which a quantile is found.
const HALVINGS: usize = 40;

impl Tracking<'_> {
    /// Estimates of the record's readings, and the findings beside them.
    pub(super) fn estimates(
        &self,
        problem: &JointProblem,
        found: &SmoothedHistory,
        effects: Vec<String>,
    ) -> (TrackedRecord, JointFindings) {
        let layout = &problem.layout;
        let mut run = TrackedRecord::default();
        let mut filter_states = Vec::new();
        for (k, day) in problem.own() {
            let under = |state: &Gaussian| layout.known_under(state, &day.conditions);
            let rivals = found.rivals.iter().map(|rival| (rival.weight, &rival.states[k]));
            let state = &under(&found.smoothed[k]);
            let found_now = of_state(layout, day, &self.bearing_of, state, rivals.collect());
            let Some(mut estimate) = found_now else { continue };
            estimate.suspicious = found.pass.impossible[k];
            let filtered = &under(&found.pass.visits[k].filtered());
            filter_states.push(layout.filter_states(
                filtered,
                &day.weights_kg_m,
                &found.motion,
                problem.pace_d,
            ));
            run.estimates.push(estimate);
        }
        for (event, k) in found.events.iter().zip(&found.at) {
            let states = [k - 1, *k].map(|k| &found.smoothed[k].mean);
            let [before, after] = states.map(|x| layout.constant_logs(x));
            let suspect = match event.scope.has_factors() {
                true => self.most_changed(states.map(|x| layout.factor(x))),
                false => suspect(event.scope, &layout.numbers, &before, &after),
            };
            let cause = match event.scope {
                scope if scope.instrument.is_some() => FlagCause::Instrument,
                scope if scope.is_of_model() => FlagCause::Model,
                _ => FlagCause::Unbalance,
            };
            run.flags.push(Flag { since_d: event.time_d, time_d: event.time_d, suspect, cause });
            if !event.scope.bearings.is_empty() {
                let several = event.scope.bearings.len() > 1;
                run.reidentified.push(Reidentified {
                    since_d: event.time_d,
                    time_d: event.time_d,
                    case: 1 + u8::from(event.scope.unbalance) + if several { 2 } else { 0 },
                    bearing: suspect,
                    cases: Vec::new(),
                    logs: after,
                });
            }
        }
        let settled = found.motion.settled();
        let joint = JointFindings {
            constants: constants(problem, found),
            walk_sd: settled.diagonal().iter().map(|variance| variance.sqrt()).collect(),
            walk_days: -problem.pace_d / found.motion.keep.ln(),
            left_out_d: problem
                .own()
                .filter(|(k, _)| found.pass.impossible[*k])
                .map(|(_, d)| d.time_d)
                .collect(),
            events: found.events.clone(),
            possible: found.possible.clone(),
            effects,
            settled: found.settled,
            filter_states,
            conditions: problem.condition_effects(found),
            second_speed: None,
        };
        (run, joint)
    }

    /// The bearing whose probes' factors changed most.
    fn most_changed(&self, [before, after]: [Vec<C>; 2]) -> usize {
        let mut changes = vec![0.0; self.rotor.bearing.len()];
        for ((b, before), after) in self.bearing_of.iter().zip(before).zip(after) {
            changes[*b] += (after / before).ln().norm_sqr();
        }
        largest(changes.into_iter())
    }
}

/// The estimate of a reading by a state under its conditions; `rivals` are those of other explanations, each with its probability
/// relative to this one.
pub(super) fn of_state(
    layout: &Layout,
    day: &Day,
    bearing_of: &[usize],
    state: &Gaussian,
    rivals: Vec<(f64, &MarginalState)>,
) -> Option<ReadingEstimate> {
    let mut estimate =
        daily::estimate(day, bearing_of, &layout.logs(&state.mean), layout.unbalance(&state.mean))?;
    let factors = layout.factor(&state.mean);
    estimate.calculated_m.iter_mut().zip(factors).for_each(|(y, factor)| *y *= factor);
    estimate.residual = ReadingResidual::new(&estimate.calculated_m, &day.measured_m, bearing_of);
    estimate.spread = Some(spread(layout, state, rivals, &day.weights_kg_m));
    Some(estimate)
}

/// Constant parts of the bearings from the start and from each event on, with the first day of each.
fn constants(problem: &JointProblem, found: &SmoothedHistory) -> Vec<(f64, Vec<ConstantPart>)> {
    let layout = &problem.layout;
    let from = |k: usize| {
        let state = &found.smoothed[k];
        let (logs, sd) = (layout.constant_logs(&state.mean), layout.constant_sd(&state.covariance));
        let of = |((log, sd), number): ((&f64, &f64), &FollowedNumber)| ConstantPart {
            log: *log,
            sd: *sd,
            from_data: *sd < 0.5 * number.law.prior_sd,
        };
        (problem.epochs[k].time_d, logs.iter().zip(&sd).zip(&layout.numbers[..]).map(of).collect())
    };
    std::iter::once(0).chain(found.at.iter().copied()).map(from).collect()
}

/// The bearing that an event changed; if several did, or none, the one with the largest change.
fn suspect(scope: Scope, numbers: &[FollowedNumber], before: &[f64], after: &[f64]) -> usize {
    let bearings = numbers.iter().map(|n| n.bearing + 1).max().unwrap_or_default();
    let is_meant = |bearing: usize| scope.bearings.is_empty() || scope.bearings.contains(bearing);
    let mut changes = vec![f64::NEG_INFINITY; bearings];
    for (n, (before, after)) in
        numbers.iter().zip(before.iter().zip(after)).filter(|(n, _)| is_meant(n.bearing))
    {
        let change = ((after - before) / n.law.prior_sd).powi(2);
        changes[n.bearing] = changes[n.bearing].max(0.0) + change;
    }
    largest(changes.into_iter())
}

/// Intervals of a mixture of the state with those under other scopes of an event, each with its probability relative to
/// the state's own; with these weights in the planes (kg·m).
fn spread(
    layout: &Layout,
    state: &Gaussian,
    rivals: Vec<(f64, &MarginalState)>,
    weights_kg_m: &[C],
) -> CredibleIntervals {
    let own = layout.marginal(state);
    let all: Vec<(f64, &MarginalState)> = std::iter::once((1.0, &own)).chain(rivals).collect();
    let part = |i: usize, (weight, s): &(f64, &MarginalState)| MixturePart {
        weight: *weight,
        at: s.logs[i],
        sd: s.logs_sd[i],
    };
    let log = |i: usize| interval(&all.iter().map(|one| part(i, one)).collect::<Vec<_>>());
    let weights = weights_kg_m.iter().enumerate();
    let (magnitude_kg_m, angle_rad) = weights.map(|(j, weight)| plane(layout, &all, j, *weight)).unzip();
    CredibleIntervals { logs: (0..layout.coefficients()).map(log).collect(), magnitude_kg_m, angle_rad }
}

/// Intervals of a plane's magnitude, kg·m, and angle, rad, unwrapped around the first state's, with a weight in the plane.
fn plane(layout: &Layout, states: &[(f64, &MarginalState)], j: usize, weight: C) -> (Interval, Interval) {
    let (own, _) = states[0].1.coordinates[j];
    let angle = (layout.planes[j].unbalance(own) + weight).arg();
    let is_relative = matches!(layout.planes[j], Coordinate::Relative { .. }) && weight == C::from(0.0);
    let (mut sizes, mut angles) = (Vec::new(), Vec::new());
    for (share, state) in states.iter().copied() {
        let (z, [real, both, imaginary]) = state.coordinates[j];
        let unbalance = layout.planes[j].unbalance(z) + weight;
        // along a direction of the coordinate
        let sd = |d: C| {
            let variance = d.re * d.re * real + 2.0 * d.re * d.im * both + d.im * d.im * imaginary;
            variance.max(0.0).sqrt()
        };
        // turned the short way from the first state's
        let turned = angle + (unbalance * C::from_polar(1.0, -angle)).arg();
        let (at, size_sd, turn_sd) = if is_relative {
            (unbalance.norm().ln(), sd(C::from(1.0)), sd(C::i()))
        } else {
            let along = layout.planes[j].slope(z).conj() * C::from_polar(1.0, unbalance.arg());
            let turn_sd = sd(C::i() * along) / unbalance.norm().max(f64::MIN_POSITIVE);
            // the angle of an unbalance that may be zero is anything
            (unbalance.norm(), sd(along), turn_sd.min(std::f64::consts::PI / HALF_95))
        };
        sizes.push(MixturePart { weight: share, at, sd: size_sd });
        angles.push(MixturePart { weight: share, at: turned, sd: turn_sd });
    }
    let size = interval(&sizes);
    let size = match is_relative {
        true => Interval { low: size.low.exp(), high: size.high.exp() },
        false => Interval { low: size.low.max(0.0), ..size },
    };
    (size, interval(&angles))
}

/// One Gaussian of a mixture.
struct MixturePart {
    weight: f64,
    at: f64,
    sd: f64,
}

/// Central 95 % interval of a mixture of Gaussians.
fn interval(parts: &[MixturePart]) -> Interval {
    if let [one] = parts {
        return Interval { low: one.at - HALF_95 * one.sd, high: one.at + HALF_95 * one.sd };
    }
    let standard = Normal::standard();
    let total: f64 = parts.iter().map(|p| p.weight).sum();
    let below = |x: f64| {
        let part = |p: &MixturePart| p.weight * standard.cdf((x - p.at) / p.sd.max(f64::MIN_POSITIVE));
        parts.iter().map(part).sum::<f64>() / total
    };
    let ends = parts.iter().flat_map(|p| [p.at - 2.0 * HALF_95 * p.sd, p.at + 2.0 * HALF_95 * p.sd]);
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let quantile = |share: f64| {
        let (mut low, mut high) = (low, high);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if below(middle) < share { &mut low } else { &mut high }) = middle;
        }
        0.5 * (low + high)
    };
    Interval { low: quantile(TAIL), high: quantile(1.0 - TAIL) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mixture_of_equal_gaussians_has_their_interval() {
        let part = |weight: f64| MixturePart { weight, at: 3.0, sd: 0.5 };
        let both = interval(&[part(1.0), part(0.2)]);
        assert!(
            (both.low - (3.0 - HALF_95 * 0.5)).abs() < 1e-3
                && (both.high - (3.0 + HALF_95 * 0.5)).abs() < 1e-3
        );
    }

    #[test]
    fn mixture_interval_includes_plausible_explanations_only() {
        let own = MixturePart { weight: 1.0, at: 0.0, sd: 0.1 };
        let [likely, unlikely] = [0.5, 1e-3].map(|weight| MixturePart { weight, at: 2.0, sd: 0.1 });
        let own_again = || MixturePart { weight: 1.0, at: 0.0, sd: 0.1 };
        assert!(interval(&[own, likely]).high > 2.0);
        assert!(interval(&[own_again(), unlikely]).high < 0.3);
    }
}

//! The second speed a day at which readings would tell most of the unbalance.
//!
//! Covariances of a Kalman filter do not depend on the readings, so the filter's last state says what readings to come
//! will leave unknown.

use nalgebra::{Complex, DVector};

use super::answer::SecondSpeed;
use super::conclude::SmoothedHistory;
use super::kalman::{Gaussian, Innovation};
use super::passes::JointProblem;
use super::state::Layout;
use crate::machine::drawing::Rotor;
use crate::statistics::interval::HALF_95;
use crate::track::daily::Tracking;
use crate::track::operating_point::FollowedMachine;
use crate::track::record::Day;
use crate::units::{rad_s, rpm, same_speed};

type C = Complex<f64>;

/// Days of readings that are looked ahead.
const AHEAD_D: f64 = 30.0;
/// Speeds that are tried, over the record's.
const SHARES: [f64; 6] = [0.6, 0.7, 0.8, 0.9, 1.05, 1.1];
/// Most motion at a second speed over that at the record's: a plant does not run in a resonance to measure.
const MOST_MOTION: f64 = 2.0;

impl Tracking<'_> {
    /// The best second speed of a record at one speed, on a model of the machine as it is now; `None` if the record has
    /// several speeds already, or none helps.
    pub(super) fn second_speed(
        &self,
        problem: &JointProblem,
        found: &SmoothedHistory,
        rotor: &Rotor,
    ) -> Option<SecondSpeed> {
        let (_, last) = problem.own().last()?;
        if problem.own().any(|(_, day)| !same_speed(day.speed_rad_s, last.speed_rad_s)) {
            return None;
        }
        let now = &found.pass.visits.last()?.filtered();
        let machine = FollowedMachine::of(rotor);
        let at = |speed_rad_s: f64| {
            let point = machine.at(speed_rad_s).ok()?;
            let measured_m = vec![Some(C::from(0.0)); self.rotor.probe.len()];
            let point = point.with_weights(&last.weights_kg_m);
            Some(Day { speed_rad_s, point, measured_m, ..last.clone() })
        };
        let motion_m = |day: &Day| {
            let shown = problem.layout.shown(day, &now.mean)?;
            Some(shown.iter().map(|y| y.norm()).fold(0.0, f64::max))
        };
        let usual = at(last.speed_rad_s)?;
        let most_m = MOST_MOTION * motion_m(&usual)?;
        let fastest_rad_s = rotor.fastest_rpm.map_or(last.speed_rad_s, rad_s);
        let without_kg_m = problem.half_width_ahead(found, now, &[&usual])?;
        let with = |share: f64| {
            let day = at(share * last.speed_rad_s).filter(|day| day.speed_rad_s <= fastest_rad_s)?;
            motion_m(&day).filter(|m| *m <= most_m)?;
            Some((rpm(day.speed_rad_s), problem.half_width_ahead(found, now, &[&usual, &day])?))
        };
        let best = SHARES.into_iter().filter_map(with).min_by(|a, b| a.1.total_cmp(&b.1));
        let (speed_rpm, half_width_kg_m) = best.filter(|(_, half_width)| *half_width < without_kg_m)?;
        Some(SecondSpeed { speed_rpm, days: AHEAD_D, half_width_kg_m, without_kg_m })
    }
}

impl JointProblem {
    /// Half-width of the unbalance after days with these readings at every pace, from a state on.
    fn half_width_ahead(&self, found: &SmoothedHistory, now: &Gaussian, readings: &[&Day]) -> Option<f64> {
        let step = self.layout.step(1.0, &found.motion, None, false);
        let point = &now.mean;
        let linear: Vec<_> =
            readings.iter().map(|day| self.layout.linear(day, point, &self.noise)).collect::<Option<_>>()?;
        let mut state = now.clone();
        for _ in 0..(AHEAD_D / self.pace_d).ceil() as usize {
            state = state.predicted(&step);
            for reading in &linear {
                let nothing = DVector::zeros(reading.variance.len());
                state = Innovation::new(&state, &reading.slope, &nothing, &reading.variance)?.update(&state);
            }
        }
        let last = &readings[0].conditions;
        let (point, state) = (self.layout.under(point.clone(), last), self.layout.known_under(&state, last));
        Some(self.layout.half_width_kg_m(&point, &state))
    }
}

impl Layout {
    /// 95 % half-width of a component of the unbalance, rms over the planes, linearised at a point.
    fn half_width_kg_m(&self, point: &DVector<f64>, state: &Gaussian) -> f64 {
        let variance = |j: usize| {
            let slope = self.planes[j].slope(self.coordinate(point, j)).norm_sqr();
            slope * (state.covariance[(2 * j, 2 * j)] + state.covariance[(2 * j + 1, 2 * j + 1)])
        };
        let planes = self.planes.len();
        HALF_95 * ((0..planes).map(variance).sum::<f64>() / (2 * planes) as f64).sqrt()
    }
}

//! The record as the filter sees it, and runs of filter and smoother along it.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::kalman::{Gaussian, Innovation, Step, smooth};
use super::state::{Layout, Motion, Scope};
use crate::machine::drawing::Noise;
use crate::track::coefficients::COEFFICIENTS;
use crate::track::operating_point::Logs;
use crate::track::record::Day;

type C = nalgebra::Complex<f64>;

/// Chance that a reading of a machine without an event is called impossible.
const CHANCE: f64 = 1e-6;
/// Rounds over which states settle around their own answer at most, and the change of the likelihood's
/// logarithm below which they have settled: little against what an event has to be worth.
const ROUNDS: usize = 10;
const SETTLED: f64 = 0.5;
/// Rounds over which the wander alone settles.
const WANDER_ROUNDS: usize = 3;

/// All readings of one time.
pub struct Epoch {
    pub time_d: f64,
    /// The record's own reading, if there is one.
    pub own: Option<Day>,
    /// Run-ups of that time.
    pub beside: Vec<Day>,
}

/// The record as the filter sees it.
pub struct Problem {
    pub layout: Layout,
    pub noise: Noise,
    pub unit_kg_m: f64,
    /// Days between readings, as a rule.
    pub pace_d: f64,
    pub epochs: Vec<Epoch>,
    pub guess: Logs,
    pub unbalance: Vec<C>,
}

/// An event at an epoch.
pub type Change = (usize, Scope);

/// One run of the filter.
pub struct Pass {
    pub filtered: Vec<Gaussian>,
    pub steps: Vec<Step>,
    pub log_likelihood: f64,
    pub impossible: Vec<bool>,
}

impl Problem {
    /// The filter along the record, linearised around these states; around its own predictions if there
    /// are none.
    pub fn filter(
        &self,
        motion: &Motion,
        changes: &[Change],
        linearised_at: Option<&[DVector<f64>]>,
    ) -> Option<Pass> {
        let mut at = self.layout.start(&self.guess, &self.unbalance, motion);
        let mut pass =
            Pass { filtered: Vec::new(), steps: Vec::new(), log_likelihood: 0.0, impossible: Vec::new() };
        for (k, epoch) in self.epochs.iter().enumerate() {
            if k > 0 {
                let days = (epoch.time_d - self.epochs[k - 1].time_d) / self.pace_d;
                let scope = changes.iter().find(|(at, _)| *at == k).map(|(_, scope)| *scope);
                let step = self.layout.step(days, motion, scope);
                at = at.predicted(&step);
                pass.steps.push(step);
            }
            let mut impossible = false;
            for (n, day) in epoch.own.iter().chain(&epoch.beside).enumerate() {
                let point =
                    linearised_at.map_or_else(|| at.mean.clone(), |linearised_at| linearised_at[k].clone());
                let (slope, left, variance) = self.layout.linear(day, &point, self.unit_kg_m, &self.noise)?;
                let left = left - &slope * (&at.mean - &point);
                let innovation = Innovation::new(&at, &slope, left, &variance)?;
                let limit = impossible_from(variance.len());
                pass.log_likelihood -= 0.5 * (innovation.squared.min(limit) + innovation.log_det);
                if innovation.squared > limit && n == 0 && epoch.own.is_some() {
                    impossible = true;
                } else {
                    at = innovation.update(&at);
                }
            }
            pass.impossible.push(impossible);
            pass.filtered.push(at.clone());
        }
        Some(pass)
    }

    /// Filter and smoother, again and again around their own answer, `at_rest` or with its wander.
    pub fn settle(
        &self,
        motion: &Motion,
        changes: &[Change],
        linearised_at: &[DVector<f64>],
        at_rest: bool,
    ) -> Option<(Pass, Vec<DVector<f64>>)> {
        let mut linearised_at = linearised_at.to_vec();
        let mut pass = self.filter(motion, changes, Some(&linearised_at))?;
        for _ in 0..ROUNDS {
            let (smoothed, _) = smooth(&pass.filtered, &pass.steps);
            let point = |g: Gaussian| if at_rest { self.layout.at_rest(g.mean) } else { g.mean };
            linearised_at = smoothed.into_iter().map(point).collect();
            let before = pass.log_likelihood;
            pass = self.filter(motion, changes, Some(&linearised_at))?;
            if (pass.log_likelihood - before).abs() < SETTLED {
                break;
            }
        }
        Some((pass, linearised_at))
    }

    /// The wander of each epoch once more, with everything else as it was found: around its own answer, so
    /// that it need not be small for the features to be linear in it.
    pub fn wander_again(&self, motion: &Motion, pass: &Pass, states: &mut [Gaussian]) -> Option<()> {
        let (at, all) = (self.layout.wander(), COEFFICIENTS);
        let part = |m: &DMatrix<f64>| m.view((at, at), (all, all)).into_owned();
        let settled = &motion.push / (1.0 - motion.keep.powi(2));
        let start = Gaussian { mean: DVector::zeros(all), covariance: settled };
        let steps: Vec<Step> = pass
            .steps
            .iter()
            .map(|s| Step { transition: part(&s.transition), noise: part(&s.noise) })
            .collect();
        for _ in 0..WANDER_ROUNDS {
            let (mut now, mut filtered) = (start.clone(), Vec::new());
            for (k, epoch) in self.epochs.iter().enumerate() {
                if k > 0 {
                    now = now.predicted(&steps[k - 1]);
                }
                let point = &states[k].mean;
                for day in epoch.own.iter().filter(|_| !pass.impossible[k]).chain(&epoch.beside) {
                    let (slope, left, variance) =
                        self.layout.linear(day, point, self.unit_kg_m, &self.noise)?;
                    let slope = slope.columns(at, all).into_owned();
                    let left = left - &slope * (&now.mean - point.rows(at, all));
                    now = Innovation::new(&now, &slope, left, &variance)?.update(&now);
                }
                filtered.push(now.clone());
            }
            let (smoothed, _) = smooth(&filtered, &steps);
            for (state, wander) in states.iter_mut().zip(smoothed) {
                state.mean.rows_mut(at, all).copy_from(&wander.mean);
            }
        }
        Some(())
    }

    /// Epochs with a reading of the record.
    pub fn own(&self) -> impl Iterator<Item = (usize, &Day)> {
        self.epochs.iter().enumerate().filter_map(|(k, e)| Some((k, e.own.as_ref()?)))
    }
}

/// Squared innovation beyond which a reading of so many numbers is called impossible.
fn impossible_from(numbers: usize) -> f64 {
    ChiSquared::new(numbers as f64).map_or(f64::INFINITY, |c| c.inverse_cdf(1.0 - CHANCE))
}

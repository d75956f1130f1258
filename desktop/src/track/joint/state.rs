//! What the joint method takes to change with time, and how the features depend on it.
//!
//! | part | numbers | from day to day |
//! |---|---|---|
//! | unbalance `u` | two a plane | moves by its rate |
//! | its rate `v` | two a plane | fades over days, pushed at random |
//! | bearings `m` | eight logarithms | constant, but for events |
//! | wander `w` of the bearings | eight logarithms | returns to zero over days, pushed at random |
//!
//! The bearings of a day are `m + w`. Unbalance is in units of the larger plane's at the start.

use nalgebra::{Complex, DMatrix, DVector};

use super::kalman::{Gaussian, Step};
use crate::track::coefficients::{COEFFICIENTS, PRIOR_LOG_SD};
use crate::track::operating_point::Logs;
use crate::track::record::Day;

type C = Complex<f64>;

/// Standard deviation of the wander's daily push before anything is learned.
const FIRST_PUSH: f64 = 0.03;
/// The same of the unbalance's rate, in units of the unbalance.
const FIRST_RATE_PUSH: f64 = 0.002;
/// Days in which wander and rate fade, before anything is learned.
const FIRST_DAYS: f64 = 10.0;
/// Standard deviation of the unbalance at the start and of its jump at an event, in units of itself.
const START_SD: f64 = 0.5;
const JUMP_SD: f64 = 0.3;

/// How wander and unbalance move; learned from the record.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Covariance of the wander's daily push.
    pub push: DMatrix<f64>,
    /// What is left of the wander after a day.
    pub keep: f64,
    /// Variance of the rate's daily push.
    pub rate_push: f64,
    /// What is left of the rate after a day.
    pub rate_keep: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            push: DMatrix::identity(COEFFICIENTS, COEFFICIENTS) * FIRST_PUSH.powi(2),
            keep: (-1.0 / FIRST_DAYS).exp(),
            rate_push: FIRST_RATE_PUSH.powi(2),
            rate_keep: (-1.0 / FIRST_DAYS).exp(),
        }
    }
}

/// What an event may have changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    /// Each bearing.
    pub bearings: [bool; 2],
    /// The unbalance.
    pub unbalance: bool,
}

impl Scope {
    /// Everything that an event can be.
    pub const ALL: [Self; 7] = [
        Self { bearings: [false, false], unbalance: true },
        Self { bearings: [true, false], unbalance: false },
        Self { bearings: [false, true], unbalance: false },
        Self { bearings: [true, false], unbalance: true },
        Self { bearings: [false, true], unbalance: true },
        Self { bearings: [true, true], unbalance: false },
        Self { bearings: [true, true], unbalance: true },
    ];
}

/// Where each part of the state is.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Planes.
    pub planes: usize,
}

impl Layout {
    /// Real numbers of the unbalance.
    pub fn flat(self) -> usize {
        2 * self.planes
    }

    fn bearings(self) -> usize {
        2 * self.flat()
    }

    /// First of the wander.
    pub fn wander(self) -> usize {
        self.bearings() + COEFFICIENTS
    }

    /// Length of the state.
    pub fn size(self) -> usize {
        self.wander() + COEFFICIENTS
    }

    /// Bearings of a state.
    pub fn logs(self, x: &DVector<f64>) -> Logs {
        std::array::from_fn(|i| x[self.bearings() + i] + x[self.wander() + i])
    }

    /// Constant part of the bearings.
    pub fn constant_logs(self, x: &DVector<f64>) -> Logs {
        std::array::from_fn(|i| x[self.bearings() + i])
    }

    /// Standard deviations of the constant part.
    pub fn constant_sd(self, covariance: &DMatrix<f64>) -> Logs {
        std::array::from_fn(|i| covariance[(self.bearings() + i, self.bearings() + i)].max(0.0).sqrt())
    }

    /// Standard deviations of the bearings.
    pub fn logs_sd(self, covariance: &DMatrix<f64>) -> Logs {
        std::array::from_fn(|i| {
            let (m, w) = (self.bearings() + i, self.wander() + i);
            (covariance[(m, m)] + covariance[(w, w)] + 2.0 * covariance[(m, w)]).max(0.0).sqrt()
        })
    }

    /// Unbalance of a state in its units.
    pub fn unbalance(self, x: &DVector<f64>) -> Vec<C> {
        (0..self.planes).map(|j| C::new(x[2 * j], x[2 * j + 1])).collect()
    }

    /// The state with these bearings and this unbalance, without wander or rate.
    pub fn at(self, logs: &Logs, unbalance: &[C]) -> DVector<f64> {
        let mut x = DVector::zeros(self.size());
        for (j, u) in unbalance.iter().enumerate() {
            (x[2 * j], x[2 * j + 1]) = (u.re, u.im);
        }
        for (i, log) in logs.iter().enumerate() {
            x[self.bearings() + i] = *log;
        }
        x
    }

    /// The state on the constant part of its bearings alone.
    ///
    /// Here readings are linearised, not at the day's own wander: constants that make the features more
    /// sensitive need less wander to explain the same readings, and if the sensitivity followed the estimated
    /// wander, hundreds of days would pull the constants that way.
    pub fn at_rest(self, mut x: DVector<f64>) -> DVector<f64> {
        x.rows_mut(self.wander(), COEFFICIENTS).fill(0.0);
        x
    }

    /// What is known before any reading: bearings as the file guesses them, the unbalance about as phase I
    /// found it.
    pub fn start(self, logs: &Logs, unbalance: &[C], motion: &Motion) -> Gaussian {
        let mut covariance = DMatrix::zeros(self.size(), self.size());
        for i in 0..self.flat() {
            covariance[(i, i)] = START_SD.powi(2);
            let rate = self.flat() + i;
            covariance[(rate, rate)] = motion.rate_push / (1.0 - motion.rate_keep.powi(2));
        }
        for i in 0..COEFFICIENTS {
            covariance[(self.bearings() + i, self.bearings() + i)] = PRIOR_LOG_SD.powi(2);
        }
        let settled = &motion.push / (1.0 - motion.keep.powi(2));
        let at = self.wander();
        covariance.view_mut((at, at), (COEFFICIENTS, COEFFICIENTS)).copy_from(&settled);
        Gaussian { mean: self.at(logs, unbalance), covariance }
    }

    /// From one time to one `days` later, with an event in between or none.
    pub fn step(self, days: f64, motion: &Motion, event: Option<Scope>) -> Step {
        let mut transition = DMatrix::identity(self.size(), self.size());
        let mut noise = DMatrix::zeros(self.size(), self.size());
        let fade = |keep: f64| (keep.powf(days), (1.0 - keep.powf(2.0 * days)) / (1.0 - keep * keep));
        let ((rate_keep, rate_gain), (keep, gain)) = (fade(motion.rate_keep), fade(motion.keep));
        // a fading rate moves the unbalance by its sum over the days
        let reach = (1.0 - rate_keep) / (1.0 - motion.rate_keep);
        for i in 0..self.flat() {
            transition[(i, self.flat() + i)] = reach;
            transition[(self.flat() + i, self.flat() + i)] = rate_keep;
            noise[(self.flat() + i, self.flat() + i)] = motion.rate_push * rate_gain;
            // pushes between two readings far apart move the unbalance as well
            noise[(i, i)] = motion.rate_push * rate_gain * (days - 1.0).max(0.0).powi(2) / 3.0 + 1e-12;
        }
        for i in 0..COEFFICIENTS {
            transition[(self.wander() + i, self.wander() + i)] = keep;
            noise[(self.bearings() + i, self.bearings() + i)] = 1e-12;
        }
        let at = self.wander();
        noise.view_mut((at, at), (COEFFICIENTS, COEFFICIENTS)).copy_from(&(&motion.push * gain));
        if let Some(scope) = event {
            for i in
                (0..COEFFICIENTS).filter(|i| scope.bearings[crate::track::coefficients::coefficient(*i).0])
            {
                noise[(self.bearings() + i, self.bearings() + i)] += PRIOR_LOG_SD.powi(2);
            }
            for i in (0..self.flat()).filter(|_| scope.unbalance) {
                noise[(i, i)] += JUMP_SD.powi(2);
            }
        }
        Step { transition, noise }
    }

    /// A reading as linear in the state around a point: slope, what was measured minus what the point
    /// shows (µm), and the variance of the noise, of the components that were not lost.
    pub fn linear(
        self,
        day: &Day,
        linearised_at: &DVector<f64>,
        unit_kg_m: f64,
        noise: &crate::machine::drawing::Noise,
    ) -> Option<(DMatrix<f64>, DVector<f64>, DVector<f64>)> {
        let logs = self.logs(linearised_at);
        let unbalance: Vec<C> = self.unbalance(linearised_at).iter().map(|u| u * unit_kg_m).collect();
        let motion = day.point.on(&logs)?;
        let shown = motion.at(&unbalance);
        let slopes = day.point.slopes(&logs, &motion, &unbalance);
        let seen: Vec<usize> = (0..shown.len()).filter(|p| day.measured_m[*p].is_some()).collect();
        let mut slope = DMatrix::zeros(2 * seen.len(), self.size());
        let mut left = DVector::zeros(2 * seen.len());
        let mut variance = DVector::zeros(2 * seen.len());
        for (row, p) in seen.into_iter().enumerate() {
            let mut set = |column: usize, y: C| {
                (slope[(2 * row, column)], slope[(2 * row + 1, column)]) = (y.re * 1e6, y.im * 1e6);
            };
            for j in 0..self.planes {
                let per = motion.probes[j * shown.len() + p] * unit_kg_m;
                set(2 * j, per);
                set(2 * j + 1, C::i() * per);
            }
            for (i, y) in slopes[p].iter().enumerate() {
                set(self.bearings() + i, *y);
                set(self.wander() + i, *y);
            }
            let difference = (day.measured_m[p].unwrap_or_default() - shown[p]) * 1e6;
            (left[2 * row], left[2 * row + 1]) = (difference.re, difference.im);
            // by what the machine shows, not by what the noise made of it
            let sigma_um = noise.relative * shown[p].norm() * 1e6 + noise.floor_um;
            (variance[2 * row], variance[2 * row + 1]) = (sigma_um * sigma_um, sigma_um * sigma_um);
        }
        Some((slope, left, variance))
    }
}

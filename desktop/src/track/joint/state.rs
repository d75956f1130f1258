//! State vector of the joint method, and its measurement equation.
//!
//! | part | numbers | from day to day |
//! |---|---|---|
//! | coordinate `z` of the unbalance ([`Coordinate`]) | two a plane | moves by its rate |
//! | its rate | two a plane | decays over days, with process noise |
//! | bearings `m` | a logarithm for each followed number, four of a bearing with constant coefficients | constant, but for events |
//! | random walk `w` of the bearings | as many | reverts to zero over days, with process noise |
//! | coefficients of covariates ([`Regressor`]) | one a component that follows one | constant |
//! | factor of each probe | two a probe | one, but for events elsewhere than at the bearings or of an instrument |
//!
//! The bearings of a day are `m + w`, and what its conditions change. A probe's complex factor `exp(d)` multiplies the modelled response. Near one speed,
//! with little change of the unbalance, a support or force that the model lacks has no other visible effect.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, DVector};

use super::coordinate::Coordinate;
use super::kalman::{Gaussian, Transition};
use super::motion::ProcessModel;
use super::regressor::Regressor;
use super::scope::{EventAt, Instrument, Scope};
use crate::machine::drawing::Noise;
use crate::track::coefficients::{FollowedNumber, Logs};
use crate::track::record::Day;

type C = Complex<f64>;

/// Standard deviation of the logarithm of a probe's factor after an event elsewhere: as wide as that of a bearing
/// coefficient.
const FACTOR_SD: f64 = 0.5;
/// Standard deviation of the unbalance's coordinate at the start, and of its jump at an event.
const START_SD: f64 = 0.5;
const JUMP_SD: f64 = 0.3;
/// The same after an outage: of the logarithm of its size, and of an angle that may be any.
const NEW_LOG_SD: f64 = 1.0;
const NEW_ANGLE_SD: f64 = std::f64::consts::PI / 1.732_050_807_568_877_2;
/// Standard deviation of a turned phase reference, rad: that of the effect `keyphasor_offset`.
const TURN_SD: f64 = 1.0;

/// A shock of unit variance: components that it changes together, each with its standard deviation.
pub type Shock = Vec<(usize, f64)>;

/// Layout of the state vector, and the coordinate of each plane's unbalance.
#[derive(Debug, Clone)]
pub struct Layout {
    pub planes: Vec<Coordinate>,
    /// Where the planes are, m.
    pub positions_m: Vec<f64>,
    /// Numbers of all bearings that are followed.
    pub numbers: Arc<[FollowedNumber]>,
    pub regressors: Vec<Regressor>,
    pub probes: usize,
    /// Whether the probes' factors are part of the state; without an event they stay one, and would double the run time.
    pub has_factors: bool,
}

/// A reading linearised around a point, without lost probes.
pub struct LinearReading {
    /// µm per unit of the state.
    pub slope: DMatrix<f64>,
    /// Measured minus calculated at the point, µm.
    pub left: DVector<f64>,
    /// Variance of the noise, µm².
    pub variance: DVector<f64>,
}

/// Bearings and unbalance of a state with their variances, by which intervals are formed: of many explanations of a long record, whole
/// covariances would be most of the memory.
pub struct MarginalState {
    /// Logarithms of the bearings and their standard deviations.
    pub logs: Logs,
    pub logs_sd: Logs,
    /// Coordinates of the unbalance, and variance of the real part, covariance and variance of the imaginary part.
    pub coordinates: Vec<(C, [f64; 3])>,
}

impl Layout {
    /// Number of real coordinates of the unbalance.
    pub fn flat(&self) -> usize {
        2 * self.planes.len()
    }

    /// Number of the bearings' logarithms.
    pub fn coefficients(&self) -> usize {
        self.numbers.len()
    }

    /// Index of the bearings' first constant.
    pub fn bearings(&self) -> usize {
        2 * self.flat()
    }

    /// Index of the random walk's first coordinate.
    pub fn walk(&self) -> usize {
        self.bearings() + self.coefficients()
    }

    /// Index of the first covariate's coefficient.
    pub fn regression(&self) -> usize {
        self.walk() + self.coefficients()
    }

    fn factors(&self) -> usize {
        self.regression() + self.regressors.len()
    }

    pub fn size(&self) -> usize {
        self.factors() + if self.has_factors { 2 * self.probes } else { 0 }
    }

    /// The layout for these events, with factors only if one needs them.
    pub fn for_changes(&self, changes: &[EventAt]) -> Self {
        Self { has_factors: changes.iter().any(|(_, scope)| scope.has_factors()), ..self.clone() }
    }

    pub fn factor(&self, x: &DVector<f64>) -> Vec<C> {
        let at = |p: usize| self.factors() + 2 * p;
        let of =
            |p: usize| if self.has_factors { C::new(x[at(p)], x[at(p) + 1]).exp() } else { C::from(1.0) };
        (0..self.probes).map(of).collect()
    }

    /// A state with these factors instead of its own.
    pub fn with_factor(&self, mut x: DVector<f64>, factor: &[C]) -> DVector<f64> {
        for (p, f) in factor.iter().enumerate() {
            let d = f.ln();
            (x[self.factors() + 2 * p], x[self.factors() + 2 * p + 1]) = (d.re, d.im);
        }
        x
    }

    /// Logarithms of the bearing coefficients, random walk included.
    pub fn logs(&self, x: &DVector<f64>) -> Logs {
        (0..self.coefficients()).map(|i| x[self.bearings() + i] + x[self.walk() + i]).collect()
    }

    /// Constant part of the bearings.
    pub fn constant_logs(&self, x: &DVector<f64>) -> Logs {
        (0..self.coefficients()).map(|i| x[self.bearings() + i]).collect()
    }

    /// Standard deviations of the constant part.
    pub fn constant_sd(&self, covariance: &DMatrix<f64>) -> Logs {
        let sd = |i: usize| covariance[(self.bearings() + i, self.bearings() + i)].max(0.0).sqrt();
        (0..self.coefficients()).map(sd).collect()
    }

    /// Standard deviations of the bearings.
    pub fn logs_sd(&self, covariance: &DMatrix<f64>) -> Logs {
        let sd = |i: usize| {
            let (m, w) = (self.bearings() + i, self.walk() + i);
            (covariance[(m, m)] + covariance[(w, w)] + 2.0 * covariance[(m, w)]).max(0.0).sqrt()
        };
        (0..self.coefficients()).map(sd).collect()
    }

    /// Coordinate of a plane's unbalance.
    pub fn coordinate(&self, x: &DVector<f64>, plane: usize) -> C {
        C::new(x[2 * plane], x[2 * plane + 1])
    }

    /// Bearings and unbalance of a state with their variances.
    pub fn marginal(&self, state: &Gaussian) -> MarginalState {
        let coordinate = |j: usize| {
            let c = |a: usize, b: usize| state.covariance[(2 * j + a, 2 * j + b)];
            (self.coordinate(&state.mean, j), [c(0, 0), c(0, 1), c(1, 1)])
        };
        MarginalState {
            logs: self.logs(&state.mean),
            logs_sd: self.logs_sd(&state.covariance),
            coordinates: (0..self.planes.len()).map(coordinate).collect(),
        }
    }

    /// Unbalance of a state, kg·m.
    pub fn unbalance(&self, x: &DVector<f64>) -> Vec<C> {
        self.planes.iter().enumerate().map(|(j, c)| c.unbalance(self.coordinate(x, j))).collect()
    }

    /// The state with these bearings and these coordinates of the unbalance; random walk and rate are zero.
    pub fn at(&self, logs: &[f64], coordinates: &[C]) -> DVector<f64> {
        let mut x = DVector::zeros(self.size());
        for (j, z) in coordinates.iter().enumerate() {
            (x[2 * j], x[2 * j + 1]) = (z.re, z.im);
        }
        for (i, log) in logs.iter().enumerate() {
            x[self.bearings() + i] = *log;
        }
        x
    }

    /// The same with the coefficients of covariates that another state has.
    pub fn at_like(&self, other: &DVector<f64>, logs: &[f64], coordinates: &[C]) -> DVector<f64> {
        let mut x = self.at(logs, coordinates);
        let (at, count) = (self.regression(), self.regressors.len());
        x.rows_mut(at, count).copy_from(&other.rows(at, count));
        x
    }

    /// The state without its random walk.
    ///
    /// Readings are linearised here and not at the day's own random walk. Otherwise constants with higher sensitivity would
    /// need a smaller random walk for the same readings, and hundreds of days would bias the constants that way.
    pub fn at_rest(&self, mut x: DVector<f64>) -> DVector<f64> {
        x.rows_mut(self.walk(), self.coefficients()).fill(0.0);
        x
    }

    /// Prior before any reading: bearings of the file, unbalance of phase I.
    pub fn start(&self, logs: &[f64], motion: &ProcessModel) -> Gaussian {
        let mut covariance = DMatrix::zeros(self.size(), self.size());
        for i in 0..self.flat() {
            covariance[(i, i)] = START_SD.powi(2);
            let rate = self.flat() + i;
            covariance[(rate, rate)] = motion.rate_push / (1.0 - motion.rate_keep.powi(2));
        }
        for (i, number) in self.numbers.iter().enumerate() {
            covariance[(self.bearings() + i, self.bearings() + i)] = number.law.prior_sd.powi(2);
        }
        let at = self.walk();
        covariance
            .view_mut((at, at), (self.coefficients(), self.coefficients()))
            .copy_from(&motion.settled());
        for (i, regressor) in self.regressors.iter().enumerate() {
            covariance[(self.component_of(i), self.component_of(i))] = regressor.sd.powi(2);
        }
        Gaussian { mean: self.at(logs, &vec![C::from(0.0); self.planes.len()]), covariance }
    }

    /// Shocks of an event of this scope.
    pub fn jump(&self, scope: Scope) -> Vec<Shock> {
        let bearings = self.numbers.iter().enumerate().filter(|(_, n)| scope.bearings.contains(n.bearing));
        let unbalance = (0..self.flat()).filter(|_| scope.unbalance);
        let factors = (self.factors()..self.size()).filter(|_| scope.elsewhere);
        let instrument = match scope.instrument {
            None => Vec::new(),
            Some(Instrument::Gain(p)) => vec![(self.factors() + 2 * p, FACTOR_SD)],
            Some(Instrument::PhaseReference) => {
                (0..self.probes).map(|p| (self.factors() + 2 * p + 1, TURN_SD)).collect()
            }
        };
        bearings
            .map(|(i, n)| vec![(self.bearings() + i, n.law.prior_sd)])
            .chain(unbalance.map(|i| vec![(i, JUMP_SD)]))
            .chain(factors.map(|i| vec![(i, FACTOR_SD)]))
            .chain((!instrument.is_empty()).then_some(instrument))
            .collect()
    }

    /// Transition to a machine that is new after an outage: `logs` and `coordinates` are its prior means. Instruments stay
    /// as they were, and conditions act as they did.
    pub fn restart(&self, logs: &[f64], coordinates: &[C], motion: &ProcessModel) -> Transition {
        let mut noise = self.start(logs, motion).covariance;
        for (j, plane) in self.planes.iter().enumerate() {
            let angle_sd = match plane {
                Coordinate::Relative { .. } => NEW_ANGLE_SD,
                Coordinate::Absolute { .. } => NEW_LOG_SD,
            };
            noise[(2 * j, 2 * j)] = NEW_LOG_SD.powi(2);
            noise[(2 * j + 1, 2 * j + 1)] = angle_sd.powi(2);
        }
        let kept = self.regression()..self.size();
        kept.clone().for_each(|i| noise[(i, i)] = 0.0);
        let keep = DVector::from_fn(self.size(), |i, _| if kept.contains(&i) { 1.0 } else { 0.0 });
        Transition { keep, reach: Vec::new(), shift: self.at(logs, coordinates), noise }
    }

    /// Transition over `paces`, with an event or without. If a new model `described` the machine in between, the factors
    /// start again from one.
    pub fn step(
        &self,
        paces: f64,
        motion: &ProcessModel,
        event: Option<Scope>,
        described: bool,
    ) -> Transition {
        let (size, flat) = (self.size(), self.flat());
        let mut keep = DVector::from_element(size, 1.0);
        let mut noise = DMatrix::zeros(size, size);
        let fade = |keep: f64| (keep.powf(paces), (1.0 - keep.powf(2.0 * paces)) / (1.0 - keep * keep));
        let ((rate_keep, rate_gain), (walk_keep, gain)) = (fade(motion.rate_keep), fade(motion.keep));
        for i in 0..flat {
            keep[flat + i] = rate_keep;
            noise[(flat + i, flat + i)] = motion.rate_push * rate_gain;
            // process noise of the rate between two distant readings also moves the unbalance
            noise[(i, i)] = motion.rate_push * rate_gain * (paces - 1.0).max(0.0).powi(2) / 3.0;
        }
        // a decaying rate moves the unbalance by its sum over the time
        let reach = (1.0 - rate_keep) / (1.0 - motion.rate_keep);
        keep.rows_mut(self.walk(), self.coefficients()).fill(walk_keep);
        let at = self.walk();
        noise
            .view_mut((at, at), (self.coefficients(), self.coefficients()))
            .copy_from(&(&motion.push * gain));
        if described {
            keep.rows_mut(self.factors(), size - self.factors()).fill(0.0);
        }
        for shock in event.iter().flat_map(|scope| self.jump(*scope)) {
            for ((i, a), (j, b)) in shock.iter().flat_map(|one| shock.iter().map(move |other| (one, other))) {
                noise[(*i, *j)] += a * b;
            }
        }
        let reach = (0..flat).map(|i| (i, flat + i, reach)).collect();
        Transition { keep, reach, shift: DVector::zeros(size), noise }
    }

    /// Calculated phasors of a state, m; `None` if the machine is singular there.
    pub fn shown(&self, day: &Day, x: &DVector<f64>) -> Option<Vec<C>> {
        let x = self.under(x.clone(), &day.conditions);
        let motion = day.point.on(&self.logs(&x))?;
        Some(motion.at(&self.unbalance(&x)).iter().zip(self.factor(&x)).map(|(y, f)| y * f).collect())
    }

    /// A reading linearised at a point; `None` if the machine is singular there.
    pub fn linear(&self, day: &Day, linearised_at: &DVector<f64>, noise: &Noise) -> Option<LinearReading> {
        let linearised_at = &self.under(linearised_at.clone(), &day.conditions);
        let logs = self.logs(linearised_at);
        let unbalance = self.unbalance(linearised_at);
        let motion = day.point.on(&logs)?;
        let factor = self.factor(linearised_at);
        let shown: Vec<C> = motion.at(&unbalance).iter().zip(&factor).map(|(y, f)| y * f).collect();
        let slopes = day.point.slopes(&logs, &motion, &unbalance);
        let seen: Vec<usize> = (0..shown.len()).filter(|p| day.measured_m[*p].is_some()).collect();
        let mut slope = DMatrix::zeros(2 * seen.len(), self.size());
        let mut left = DVector::zeros(2 * seen.len());
        let mut variance = DVector::zeros(2 * seen.len());
        for (row, p) in seen.into_iter().enumerate() {
            let mut set = |column: usize, y: C| {
                (slope[(2 * row, column)], slope[(2 * row + 1, column)]) = (y.re * 1e6, y.im * 1e6);
            };
            for (j, plane) in self.planes.iter().enumerate() {
                let per = motion.probes[j * shown.len() + p] * plane.slope(self.coordinate(linearised_at, j));
                set(2 * j, per * factor[p]);
                set(2 * j + 1, C::i() * per * factor[p]);
            }
            for (i, y) in slopes.row(p).iter().enumerate() {
                set(self.bearings() + i, *y * factor[p]);
                set(self.walk() + i, *y * factor[p]);
            }
            if self.has_factors {
                set(self.factors() + 2 * p, shown[p]);
                set(self.factors() + 2 * p + 1, C::i() * shown[p]);
            }
            let difference = (day.measured_m[p].unwrap_or_default() - shown[p]) * 1e6;
            (left[2 * row], left[2 * row + 1]) = (difference.re, difference.im);
            // noise relative to the calculated phasor, not to the noisy one
            let sigma_um = noise.sigma_m(shown[p]) * 1e6;
            (variance[2 * row], variance[2 * row + 1]) = (sigma_um * sigma_um, sigma_um * sigma_um);
        }
        for (from, onto, value) in self.added(&day.conditions) {
            let own = slope.column(onto) * value;
            slope.set_column(from, &own);
        }
        Some(LinearReading { slope, left, variance })
    }
}

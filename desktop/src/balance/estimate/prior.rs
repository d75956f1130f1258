//! Prior of the influence of each plane from the model: a mean and a covariance.
//!
//! The covariance has two parts. One is that of the model's own parameters: bearings and drawing as far as the
//! file trusts them, and gain and angle of every probe, which are not trusted at all, so that a probe that is not where its
//! neighbour says costs nothing. The other is what no parameter of the model can mend, in proportion to the response.

use nalgebra::{Complex, DMatrix, DVector};

use crate::balance::influence::regression::stacked;
use crate::error::Error;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::Rotor;
use crate::machine::tolerance::Deviations;
use crate::model::Model;
use crate::reduction::basis;
use crate::reduction::sizes::WEIGHTS;

type C = Complex<f64>;

/// Standard deviation of the logarithm of a probe's gain, and of its angle, rad: as good as unknown.
const GAIN_SD: f64 = 1.0;
/// Discrepancy, relative: of all planes at one speed, of one plane at all speeds, of one plane at one speed; each by probe.
/// A guess of a few percent; how many times as large it is, is learned from the runs.
const DISCREPANCY: [f64; 3] = [0.03, 0.02, 0.01];
/// Step of the derivatives, standard deviations.
const STEP: f64 = 1e-3;
/// Relative step along the speed.
const SPEED_STEP: f64 = 1e-3;

/// The machine as a function of its parameters, in standard deviations of their prior.
pub struct MachinePrior<'a> {
    rotor: &'a Rotor,
    bearings: Bearings,
    deviations: Deviations,
    speeds_rad_s: &'a [f64],
}

/// The model near one point of its parameters.
#[derive(Debug, Clone)]
pub struct LinearInfluence {
    /// The point of linearisation, in standard deviations.
    pub parameters: DVector<f64>,
    /// Influence there: rows × planes, µm per g·mm.
    pub influence: DMatrix<C>,
    /// Prior mean of the influence, stacked as [`stacked`] does.
    pub mean: DVector<f64>,
    /// Its change per standard deviation of each parameter.
    pub slopes: DMatrix<f64>,
    /// Covariance of the discrepancy at its guessed size.
    pub discrepancy: DMatrix<f64>,
}

impl<'a> MachinePrior<'a> {
    /// A rotor at these speeds.
    pub fn new(rotor: &'a Rotor, speeds_rad_s: &'a [f64]) -> Self {
        Self { rotor, bearings: Bearings::of(rotor), deviations: Deviations::of(rotor), speeds_rad_s }
    }

    /// Number of parameters: bearings, drawing, then gain and angle of each probe.
    pub fn parameters(&self) -> usize {
        self.mechanical() + 2 * self.rotor.probe.len()
    }

    fn mechanical(&self) -> usize {
        self.bearings.count() + self.deviations.len()
    }

    /// The rotor as its drawing may have been built.
    fn built(&self, parameters: &DVector<f64>) -> Rotor {
        let t = parameters.rows(self.bearings.count(), self.deviations.len()).into_owned();
        let (mut built, offsets) = self.deviations.apply(self.rotor, &t);
        let length_m = built.length_m();
        let places = built.bearing.iter_mut().map(|b| &mut b.position_m).zip(offsets.bearing_m);
        let places = places.chain(built.disk.iter_mut().map(|d| &mut d.position_m).zip(offsets.disk_m));
        let places = places.chain(built.probe.iter_mut().map(|p| &mut p.position_m).zip(offsets.probe_m));
        let places = places.chain(built.plane.iter_mut().map(|p| &mut p.position_m).zip(offsets.plane_m));
        for (position_m, offset_m) in places {
            *position_m = (*position_m + offset_m).clamp(0.0, length_m);
        }
        // weights of runs would be marks of the mesh
        built.run.clear();
        built
    }

    fn with_bearings(&self, model: &Model, parameters: &DVector<f64>) -> Model {
        let stated = self.bearings.stated();
        let unknowns = self.bearings.unknowns().iter().zip(&stated).enumerate();
        let x: Vec<f64> = unknowns.map(|(i, (u, x))| x + u.law.prior_sd * parameters[i]).collect();
        let mut model = model.clone();
        for (support, law) in model.supports.iter_mut().zip(self.bearings.supports(&x)) {
            support.law = law;
        }
        model
    }

    fn gains(&self, parameters: &DVector<f64>) -> Vec<C> {
        let first = self.mechanical();
        let gain =
            |p: usize| (C::new(parameters[first + 2 * p], parameters[first + 2 * p + 1]) * GAIN_SD).exp();
        (0..self.rotor.probe.len()).map(gain).collect()
    }

    /// Influence of the planes at speeds, rows × planes, µm per g·mm.
    fn influence(&self, model: &Model, gains: &[C], speeds_rad_s: &[f64]) -> Result<DMatrix<C>, Error> {
        let probes = self.rotor.probe.len();
        let mut all = DMatrix::zeros(speeds_rad_s.len() * probes, self.rotor.plane.len());
        for (s, speed) in speeds_rad_s.iter().enumerate() {
            let per_unbalance = model.response(*speed)?.per_unbalance;
            for (p, gain) in gains.iter().enumerate() {
                all.row_mut(s * probes + p).copy_from(&(per_unbalance.row(p) * *gain));
            }
        }
        Ok(all)
    }

    /// Influence at other speeds, for advice.
    ///
    /// # Errors
    /// If the model is singular there.
    pub fn influence_at(&self, parameters: &DVector<f64>, speeds_rad_s: &[f64]) -> Result<DMatrix<C>, Error> {
        let model = self.with_bearings(&basis::reduced(&self.built(parameters), WEIGHTS), parameters);
        self.influence(&model, &self.gains(parameters), speeds_rad_s)
    }

    /// Relative change of each row's response per relative change of speed.
    ///
    /// # Errors
    /// If the model is singular.
    pub fn speed_slopes(&self, parameters: &DVector<f64>) -> Result<Vec<C>, Error> {
        let faster: Vec<f64> = self.speeds_rad_s.iter().map(|w| w * (1.0 + SPEED_STEP)).collect();
        let now = self.influence_at(parameters, self.speeds_rad_s)?.column_sum();
        let then = self.influence_at(parameters, &faster)?.column_sum();
        Ok(now.iter().zip(then.iter()).map(|(a, b)| (b / a).ln() / SPEED_STEP.ln_1p()).collect())
    }

    /// The model near these parameters.
    ///
    /// # Errors
    /// If the model is singular.
    pub fn near(&self, parameters: DVector<f64>) -> Result<LinearInfluence, Error> {
        let drawn = basis::reduced(&self.built(&parameters), WEIGHTS);
        let gains = self.gains(&parameters);
        let at = |model: &Model, parameters: &DVector<f64>| {
            self.influence(&self.with_bearings(model, parameters), &gains, self.speeds_rad_s)
        };
        let influence = at(&drawn, &parameters)?;
        let here = stacked(&influence);
        let probes = self.rotor.probe.len();
        let mut slopes = DMatrix::zeros(here.len(), self.parameters());
        for k in 0..self.mechanical() {
            let mut beside = parameters.clone();
            beside[k] += STEP;
            let moved = if k < self.bearings.count() {
                at(&drawn, &beside)?
            } else {
                at(&basis::reduced(&self.built(&beside), WEIGHTS), &beside)?
            };
            slopes.set_column(k, &((stacked(&moved) - &here) / STEP));
        }
        for p in 0..probes {
            for (part, unit) in [C::new(GAIN_SD, 0.0), C::new(0.0, GAIN_SD)].into_iter().enumerate() {
                let turned = influence
                    .map_with_location(|row, _, h| if row % probes == p { h * unit } else { C::from(0.0) });
                slopes.set_column(self.mechanical() + 2 * p + part, &stacked(&turned));
            }
        }
        let mean = here - &slopes * &parameters;
        Ok(LinearInfluence {
            discrepancy: discrepancy(&influence, probes),
            mean,
            slopes,
            influence,
            parameters,
        })
    }
}

/// Circular, in proportion to the response.
fn discrepancy(influence: &DMatrix<C>, probes: usize) -> DMatrix<f64> {
    let rows = influence.nrows();
    let place = |i: usize| (i / (2 * rows), i % (2 * rows) / rows, i % rows);
    let [at_speed, of_plane, alone] = DISCREPANCY.map(|d| d * d);
    let size = 2 * influence.len();
    DMatrix::from_fn(size, size, |a, b| {
        let ((j, part, row), (k, part2, row2)) = (place(a), place(b));
        if row % probes != row2 % probes {
            return 0.0;
        }
        let (same_speed, same_plane) = (row / probes == row2 / probes, j == k);
        let variance = f64::from(u8::from(same_speed)) * at_speed
            + f64::from(u8::from(same_plane)) * of_plane
            + f64::from(u8::from(same_speed && same_plane)) * alone;
        let turn = influence[(row, j)] * influence[(row2, k)].conj() * variance;
        match (part, part2) {
            (0, 0) | (1, 1) => turn.re,
            (0, _) => -turn.im,
            _ => turn.im,
        }
    })
}

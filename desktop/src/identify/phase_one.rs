//! Phase I: bearings and unbalance of the first days (Bera et al., Machines 2023, 11, 976).
//!
//! A particle swarm moves over the eight bearing coefficients inside the search range; the unbalance,
//! the other four of the paper's twelve unknowns, enters linearly and is solved for exactly at each
//! particle. Its objective is the summed residual of all readings. A Levenberg–Marquardt fit weighted
//! by the noise then finishes from the swarm's best and from the file's guess, with a weak prior at
//! that guess: three days at one speed leave most of the eight open, and an open coefficient should
//! stay where the drawing put it, not where the swarm happened to stop.

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::particleswarm::ParticleSwarm;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{Complex, DMatrix, DVector, Dyn, Owned, U8};
use rand::SeedableRng;
use rand::rngs::StdRng;

use super::bearings::{
    BearingParameter, COEFFICIENTS, Identified, LogCoefficients, PRIOR_LOG_SD, assign, logarithms, place,
    ranges, slope, symbol,
};
use super::observations::{Observations, Solution, assumed_noise};
use crate::error::Error;
use crate::measurement::Reading;
use crate::rotor::{Rotor, SearchBounds};
use crate::unbalance::g_mm_deg;

/// Settings of phase I.
#[derive(Debug, Clone, Copy)]
pub struct PhaseOneConfig {
    /// Particles of the swarm.
    pub particles: usize,
    /// Moves of every particle.
    pub iterations: u64,
    /// Seed of the swarm.
    pub seed: u64,
    /// Search range; the rotor's `[identify]`, or 2.5 times either way around its guess, if absent.
    pub bounds: Option<SearchBounds>,
}

impl Default for PhaseOneConfig {
    fn default() -> Self {
        Self { particles: 40, iterations: 40, seed: 1, bounds: None }
    }
}

/// Result of phase I.
#[derive(Debug, Clone)]
pub struct PhaseOne {
    /// The rotor with its identified bearings and planes.
    pub rotor: Rotor,
    /// The eight coefficients.
    pub bearings: Vec<BearingParameter>,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: DVector<Complex<f64>>,
    /// Relative standard deviation of each plane's unbalance with the bearings open.
    pub unbalance_relative_sd: Vec<f64>,
    /// Σ|f_model − f_measured| over all readings, µm.
    pub residual_um: f64,
    /// The same over Σ|f_measured|.
    pub residual_ratio: f64,
    /// χ² per measured component, noise-weighted.
    pub chi2_per_value: f64,
    /// Summed residual where the swarm ended, µm.
    pub swarm_residual_um: f64,
}

/// Identifies bearings and unbalance from readings of one machine in one state.
///
/// # Errors
/// If there are too few values, or the machine is singular on every trial.
pub fn identify(rotor: &Rotor, readings: &[Reading], config: &PhaseOneConfig) -> Result<PhaseOne, Error> {
    let noise = rotor.noise.unwrap_or_else(|| assumed_noise(readings));
    let observations = Observations::new(rotor, &noise, readings)?;
    let guess = logarithms(rotor);
    let bounds = config.bounds.or(rotor.identify);
    let [low, high] = ranges(&guess, bounds.as_ref());
    let found = swarm(&observations, low, high, config)?;
    let swarm_residual_um = observations
        .solve(&found)
        .ok_or_else(|| Error::Unsuitable("the machine is singular on every trial bearing".into()))?
        .residual_um;

    let within = |logs: LogCoefficients| logs.zip_zip_map(&low, &high, |v, l, h| v.clamp(l, h));
    let best = [found, within(guess)]
        .into_iter()
        .map(|start| Fit::run(&observations, guess, start))
        .min_by(|a, b| a.cost().total_cmp(&b.cost()))
        .expect("two starts were tried");
    let at_bound = best.logs.zip_zip_map(&low, &high, |v, l, h| f64::from(u8::from(v < l || v > h)));
    let fit = Fit::at(&observations, guess, within(best.logs));
    let Some(solution) = &fit.solution else {
        return Err(Error::Unsuitable("the machine is singular on the identified bearings".into()));
    };

    let covariance = fit.covariance();
    let bearings = (0..COEFFICIENTS)
        .map(|i| {
            let relative_sd = covariance[(i, i)].sqrt();
            let identified = if at_bound[i] > 0.0 {
                Identified::AtBound
            } else if relative_sd < 0.5 * PRIOR_LOG_SD {
                Identified::FromData
            } else {
                Identified::StayedAtStart
            };
            BearingParameter {
                bearing: rotor.bearing[place(i).0].name.clone(),
                symbol: symbol(i),
                value: fit.logs[i].exp(),
                start: guess[i].exp(),
                relative_sd,
                identified,
            }
        })
        .collect();
    let mut identified = rotor.clone();
    assign(&mut identified, &fit.logs);
    for (plane, u) in identified.plane.iter_mut().zip(solution.unbalance_kg_m.iter()) {
        let [magnitude, angle] = g_mm_deg(*u);
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(magnitude), Some(angle));
    }
    let unbalance_relative_sd = fit.unbalance_relative_sd(solution, &covariance);
    Ok(PhaseOne {
        rotor: identified,
        bearings,
        unbalance_kg_m: solution.unbalance_kg_m.clone(),
        unbalance_relative_sd,
        residual_um: solution.residual_um,
        residual_ratio: solution.residual_um / observations.feature_sum_um(),
        chi2_per_value: solution.weighted.norm_squared() / (2 * observations.values()) as f64,
        swarm_residual_um,
    })
}

struct SummedResidual<'a>(&'a Observations<'a>);

impl CostFunction for SummedResidual<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, logs: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        let logs = LogCoefficients::from_column_slice(logs);
        Ok(self.0.solve(&logs).map_or(f64::MAX, |s| s.residual_um))
    }
}

fn swarm(
    observations: &Observations,
    low: LogCoefficients,
    high: LogCoefficients,
    config: &PhaseOneConfig,
) -> Result<LogCoefficients, Error> {
    let range = (low.as_slice().to_vec(), high.as_slice().to_vec());
    let solver =
        ParticleSwarm::new(range, config.particles).with_rng_generator(StdRng::seed_from_u64(config.seed));
    let result = Executor::new(SummedResidual(observations), solver)
        .configure(|state| state.max_iters(config.iterations))
        .ctrlc(false)
        .run()
        .map_err(|e| Error::Unsuitable(format!("phase I: {e}")))?;
    let best =
        result.state.get_best_param().ok_or_else(|| Error::Unsuitable("phase I found nothing".into()))?;
    Ok(LogCoefficients::from_column_slice(&best.position))
}

/// Noise-weighted least squares with the weak prior, as Levenberg–Marquardt wants it.
struct Fit<'a> {
    observations: &'a Observations<'a>,
    guess: LogCoefficients,
    logs: LogCoefficients,
    solution: Option<Solution>,
}

impl<'a> Fit<'a> {
    fn at(observations: &'a Observations<'a>, guess: LogCoefficients, logs: LogCoefficients) -> Self {
        let mut fit = Self { observations, guess, logs, solution: None };
        fit.set_params(&logs);
        fit
    }

    fn run(observations: &'a Observations<'a>, guess: LogCoefficients, start: LogCoefficients) -> Self {
        LevenbergMarquardt::new().minimize(Self::at(observations, guess, start)).0
    }

    fn cost(&self) -> f64 {
        self.residuals().map_or(f64::INFINITY, |r| r.norm_squared())
    }

    /// Covariance of the logarithms: inverse of the information in data and prior.
    fn covariance(&self) -> DMatrix<f64> {
        let jacobian = self.jacobian().expect("the fit ended on a regular machine");
        let information = jacobian.tr_mul(&jacobian);
        let information = DMatrix::from_fn(COEFFICIENTS, COEFFICIENTS, |i, j| information[(i, j)]);
        information.try_inverse().expect("the prior makes the information positive definite")
    }

    /// First-order propagation of the bearings' uncertainty into each plane's unbalance, by
    /// differences along the principal directions of the covariance.
    fn unbalance_relative_sd(&self, solution: &Solution, covariance: &DMatrix<f64>) -> Vec<f64> {
        let eigen = covariance.clone().symmetric_eigen();
        let u = &solution.unbalance_kg_m;
        let mut variance = vec![0.0; u.len()];
        for k in 0..COEFFICIENTS {
            let sd = eigen.eigenvalues[k].max(0.0).sqrt();
            let step = LogCoefficients::from_fn(|i, _| eigen.eigenvectors[(i, k)] * sd);
            let Some(moved) = self.observations.solve(&(self.logs + step)) else { continue };
            for (v, (a, b)) in variance.iter_mut().zip(moved.unbalance_kg_m.iter().zip(u.iter())) {
                *v += (a - b).norm_sqr();
            }
        }
        variance.iter().zip(u.iter()).map(|(v, u)| v.sqrt() / u.norm().max(f64::MIN_POSITIVE)).collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, U8> for Fit<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U8>;
    type ParameterStorage = Owned<f64, U8>;

    fn set_params(&mut self, logs: &LogCoefficients) {
        self.logs = *logs;
        self.solution = self.observations.solve(logs);
    }

    fn params(&self) -> LogCoefficients {
        self.logs
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let weighted = &self.solution.as_ref()?.weighted;
        let data = weighted.iter().flat_map(|r| [r.re, r.im]);
        let prior = (self.logs - self.guess) / PRIOR_LOG_SD;
        Some(DVector::from_iterator(2 * weighted.len() + COEFFICIENTS, data.chain(prior.iter().copied())))
    }

    fn jacobian(&self) -> Option<nalgebra::OMatrix<f64, Dyn, U8>> {
        let solution = self.solution.as_ref()?;
        let d = self.observations.derivative(
            solution,
            COEFFICIENTS,
            |i| 2 * place(i).0 + place(i).1,
            |i, speed| slope(i, &self.logs, speed),
        );
        let rows = d.nrows();
        Some(nalgebra::OMatrix::<f64, Dyn, U8>::from_fn(2 * rows + COEFFICIENTS, |row, i| {
            if row >= 2 * rows {
                if row - 2 * rows == i { 1.0 / PRIOR_LOG_SD } else { 0.0 }
            } else if row % 2 == 0 {
                d[(row / 2, i)].re
            } else {
                d[(row / 2, i)].im
            }
        }))
    }
}

//! Trial runs as equations, and the influence coefficients that they determine.
//!
//! At each speed the runs are `Y = Y₀ + Σ A U`, U the trial weights: least squares for Y₀, the machine without any, and A.
//! Where there are more runs than coefficients, χ² says whether the machine is linear.

use nalgebra::{Complex, DMatrix, DVector};

use super::regression::{Observation, Underdetermined, least_squares};
use super::{InfluenceCoefficients, stacked};
use crate::balance::ReducedChiSquare;
use crate::balance::sense::PhaseSense;
use crate::balance::speeds::Speeds;
use crate::error::Error;

type C = Complex<f64>;
/// Number of each run, what it is off by, and the standard deviation of that.
type RunOffsets = Vec<(usize, C, f64)>;

/// Weights below this, relative to the largest, are rounding.
const ROUNDING: f64 = 1e-9;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPhasor {
    /// In m with a rotor's file, else in the data's own unit.
    pub phasor: C,
    /// Standard deviation of its components.
    pub sigma: f64,
}

/// One reading under known weights.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialReading {
    pub run: usize,
    pub speed: usize,
    /// By place; in kg·m with a rotor's file, else in g·mm.
    pub weights: Vec<C>,
    /// By probe; `None` where the reading was lost.
    pub probes: Vec<Option<MeasuredPhasor>>,
}

#[derive(Debug, Clone)]
pub struct Trials {
    pub readings: Vec<TrialReading>,
    /// Names of the places where weights sat: the correction planes first.
    pub places: Vec<String>,
    /// How many of them are correction planes.
    pub planes: usize,
    pub probes: Vec<String>,
    pub speeds: Speeds,
    /// Names of the runs, by their number.
    pub runs: Vec<String>,
    /// Whether `sigma` is the noise of a reading, and not only its size relative to the others'.
    pub is_noise_known: bool,
    /// Whether a place without weights at a speed is taken to change nothing there; else the speed is left out.
    pub untried_is_nothing: bool,
    /// Number of the run that the weights are to be added to; none for the machine without any weight.
    pub onto: Option<usize>,
}

#[derive(Debug, Clone)]
pub struct TrialFit {
    pub coefficients: Vec<InfluenceCoefficients>,
    /// Misfit of the readings beyond the unknowns; `None` if there are no more readings than unknowns.
    pub misfit: Option<ReducedChiSquare>,
    /// What each reading is off from the fit by.
    pub residuals: Vec<RunResidual>,
    /// Whether phases have the right sign.
    pub sense: PhaseSense,
    /// Slowest and fastest of the speeds that were taken as one and lie furthest apart, rpm.
    pub widest_rpm: [f64; 2],
    /// Speeds that too few runs share, rpm.
    pub left_out_rpm: Vec<f64>,
}

/// Residual of a reading: its phasor less that of the fitted coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunResidual {
    pub run: usize,
    /// Number of the coefficients that it belongs to.
    pub row: usize,
    pub off: C,
    pub sigma: f64,
}

impl TrialFit {
    /// χ² per value of what moves the weights, and its degrees of freedom: the part of the runs' residuals that weights could make.
    ///
    /// An error of a run that all probes and speeds share, as a weight elsewhere than stated, does not average out over them. The
    /// residual of every run is turned into the weights of least squares that would make it. Their squares are compared with those
    /// of independent readings.
    pub fn misfit_of_weights(&self) -> Option<ReducedChiSquare> {
        let misfit = self.misfit?;
        let (per_weight, _) = stacked(&self.coefficients);
        let (rows, planes) = per_weight.shape();
        let inverse = (per_weight.adjoint() * &per_weight).try_inverse()?;
        let to_weights = inverse * per_weight.adjoint();
        let runs = self.residuals.iter().map(|r| r.run).max()? + 1;
        let mut made = DMatrix::<C>::zeros(planes, runs);
        let mut variance = vec![0.0; rows];
        let mut count = vec![0; rows];
        for r in &self.residuals {
            for j in 0..planes {
                made[(j, r.run)] += to_weights[(j, r.row)] * r.off;
            }
            variance[r.row] += r.sigma * r.sigma;
            count[r.row] += 1;
        }
        // complex values beyond the unknowns of a row, the same for all but lost readings
        let beyond = misfit.freedom as f64 / (2 * rows) as f64;
        let expected = |j: usize| -> f64 {
            let row = |i: usize| to_weights[(j, i)].norm_sqr() * 2.0 * variance[i] / f64::from(count[i]);
            (0..rows).map(row).sum::<f64>() * beyond
        };
        let ratio = |j: usize| made.row(j).norm_squared() / expected(j);
        let chi2_per_value = (0..planes).map(ratio).sum::<f64>() / planes as f64;
        let freedom = (2.0 * beyond * rows.min(planes) as f64).round().max(1.0) as usize;
        chi2_per_value.is_finite().then_some(ReducedChiSquare { chi2_per_value, freedom })
    }
}

impl Trials {
    /// Places whose effect is an unknown of a probe at a speed.
    fn tried(&self, speed: usize, probe: usize) -> Vec<usize> {
        // weights of sets are found by a linear map, and one that is not there is then zero but for rounding
        let least = ROUNDING * self.largest();
        let is_tried = |place: &usize| {
            let mut here = self.readings.iter().filter(|t| t.speed == speed && t.probes[probe].is_some());
            !self.untried_is_nothing || here.any(|t| t.weights[*place].norm() > least)
        };
        (0..self.places.len()).filter(is_tried).collect()
    }

    /// Largest trial weight, to scale the equations with.
    fn largest(&self) -> f64 {
        self.readings.iter().flat_map(|t| &t.weights).map(|w| w.norm()).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Coefficients of every probe at every speed that enough runs share, of all runs.
    ///
    /// # Errors
    /// One sentence if a correction plane has no trial weight, or no speed has enough runs.
    pub fn least_squares(&self) -> Result<TrialFit, Error> {
        for (k, plane) in self.places.iter().enumerate().take(self.planes) {
            if self.readings.iter().all(|t| t.weights[k] == C::from(0.0)) {
                return Err(Error::NoTrialWeight { plane: plane.clone() });
            }
        }
        let mut fitted = TrialFit {
            coefficients: Vec::new(),
            misfit: None,
            residuals: Vec::new(),
            sense: PhaseSense::new(self.probes.len()),
            widest_rpm: [1.0; 2],
            left_out_rpm: Vec::new(),
        };
        let (mut chi2, mut freedom, mut dependent) = (0.0, 0, false);
        for (speed, ends_rpm) in self.speeds.ends_rpm.iter().enumerate() {
            let before = fitted.coefficients.len();
            for probe in 0..self.probes.len() {
                match self.at(speed, probe, &mut fitted.sense) {
                    Ok((found, off)) => {
                        let row = fitted.coefficients.len();
                        freedom += 2 * (off.len() - 1 - self.tried(speed, probe).len());
                        for (run, off, sigma) in off {
                            chi2 += off.norm_sqr() / (sigma * sigma);
                            fitted.residuals.push(RunResidual { run, row, off, sigma });
                        }
                        fitted.coefficients.push(found);
                    }
                    Err(Underdetermined::Dependent) => dependent = true,
                    Err(Underdetermined::TooFew) => (),
                }
            }
            let [slowest, fastest] = fitted.widest_rpm;
            if fitted.coefficients.len() == before {
                fitted.left_out_rpm.push(self.speeds.mean_rpm[speed]);
            } else if ends_rpm[1] / ends_rpm[0] > fastest / slowest {
                fitted.widest_rpm = *ends_rpm;
            }
        }
        if fitted.coefficients.is_empty() {
            return Err(self.why_none(dependent));
        }
        fitted.misfit =
            (freedom > 0).then(|| ReducedChiSquare { chi2_per_value: chi2 / freedom as f64, freedom });
        Ok(fitted)
    }

    /// Coefficients of one probe at one speed, and what each run is off from them by, with its standard deviation.
    fn at(
        &self,
        speed: usize,
        probe: usize,
        sense: &mut PhaseSense,
    ) -> Result<(InfluenceCoefficients, RunOffsets), Underdetermined> {
        let here = self.readings.iter().filter(|t| t.speed == speed);
        let rows: Vec<(&TrialReading, MeasuredPhasor)> =
            here.filter_map(|t| Some((t, t.probes[probe]?))).collect();
        if !rows.iter().any(|(t, _)| self.onto.is_none_or(|run| t.run == run)) {
            return Err(Underdetermined::TooFew);
        }
        let scale = self.largest();
        let tried = self.tried(speed, probe);
        if tried.is_empty() {
            return Err(Underdetermined::TooFew);
        }
        let observation = |(t, y): &(&TrialReading, MeasuredPhasor)| Observation {
            weights: tried.iter().map(|place| t.weights[*place] / scale).collect(),
            phasor: y.phasor,
            sigma: y.sigma,
        };
        let observed: Vec<Observation> = rows.iter().map(observation).collect();
        let fit = least_squares(&observed)?;
        let unknowns = 1 + tried.len();
        let design = DMatrix::from_fn(rows.len(), unknowns, |i, j| match j {
            0 => C::from(observed[i].sigma.recip()),
            _ => observed[i].weights[j - 1] / observed[i].sigma,
        });
        let measured = DVector::from_iterator(rows.len(), observed.iter().map(|o| o.phasor / o.sigma));
        sense.add(probe, &design, &measured);
        let left = measured - design * fit.complex_mean(0);
        let speed_rpm = self.speeds.mean_rpm[speed];
        let planes: Vec<usize> = tried.into_iter().filter(|place| *place < self.planes).collect();
        let mut found = InfluenceCoefficients::new(probe, speed_rpm, &fit, planes.len(), scale);
        if let Some(run) = self.onto {
            let own: Vec<&Observation> =
                rows.iter().zip(&observed).filter(|((t, _), _)| t.run == run).map(|(_, o)| o).collect();
            found.start_from(&own, &fit, scale);
        }
        let found = found.among(&planes, self.planes);
        let off = rows.iter().zip(left.iter()).map(|((t, y), left)| (t.run, left * y.sigma, y.sigma));
        Ok((found, off.collect()))
    }

    /// Why no speed has coefficients.
    fn why_none(&self, dependent: bool) -> Error {
        let planes = self.places.len();
        if dependent {
            return Error::DependentTrialWeights { planes };
        }
        let speeds = &self.speeds.mean_rpm;
        let [slowest_rpm, fastest_rpm] = [speeds.first(), speeds.last()].map(|s| s.copied().unwrap_or(0.0));
        let nearest = speeds.windows(2).map(|w| w[1] / w[0] - 1.0).fold(f64::INFINITY, f64::min);
        let advice = match nearest {
            near if near < 0.05 => format!(
                "; the nearest of their speeds differ by {:.2} %, and up to {:.2} % are taken as one (--same-speed)",
                100.0 * near,
                100.0 * self.speeds.same
            ),
            _ => "; run all of them over the same speeds".into(),
        };
        Error::TooFewRuns { planes, slowest_rpm, fastest_rpm, advice }
    }
}

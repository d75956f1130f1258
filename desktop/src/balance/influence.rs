//! Influence coefficients: what a unit of unbalance in a plane does at a probe and speed, from trial runs.
//!
//! At each speed the runs are `Y = Y₀ + Σ A U`, U the trial weights: least squares for Y₀, the machine
//! without any, and A. Nothing of the machine needs to be known but that it is linear; where there are more
//! runs than coefficients, χ² says whether it is. Units are those of the trials: m and kg·m where they come with a rotor's file, else
//! the data's own and g·mm.

use nalgebra::{Complex, DMatrix, DVector};

use super::sense::Sense;
use super::speeds::Speeds;
use super::{Misfit, NormalEquations};
use crate::decomposition::singular_values;
use crate::error::Error;

type C = Complex<f64>;

/// Trial weights, scaled to one, that span less than this do not tell planes apart.
const INDEPENDENT: f64 = 1e-3;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// In m with a rotor's file, else in the data's own unit.
    pub phasor: C,
    /// Standard deviation of its components.
    pub sigma: f64,
}

/// One reading under known weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    pub run: usize,
    pub speed: usize,
    /// By place; in kg·m with a rotor's file, else in g·mm.
    pub weights: Vec<C>,
    /// By probe; `None` where the reading was lost.
    pub probes: Vec<Option<Value>>,
}

#[derive(Debug, Clone)]
pub struct Trials {
    pub readings: Vec<Trial>,
    /// Names of the places where weights sat: the correction planes first.
    pub places: Vec<String>,
    /// How many of them are correction planes.
    pub planes: usize,
    pub probes: Vec<String>,
    pub speeds: Speeds,
    /// Number of the run that the weights are to be added to; none for the machine without any weight.
    pub onto: Option<usize>,
}

/// Coefficients of one probe at one speed.
#[derive(Debug, Clone)]
pub struct Coefficients {
    pub probe: usize,
    /// Mean speed of the runs, rpm.
    pub speed_rpm: f64,
    /// The machine that the weights are to be added to.
    pub before: C,
    /// Per unbalance in each correction plane.
    pub per_weight: Vec<C>,
    /// Covariance of both per component.
    pub covariance: DMatrix<C>,
}

#[derive(Debug, Clone)]
pub struct Fitted {
    /// By speed and probe.
    pub coefficients: Vec<Coefficients>,
    /// Of what the coefficients do not need; `None` if they need all.
    pub misfit: Option<Misfit>,
    /// Whether phases have the right sign.
    pub sense: Sense,
    /// Slowest and fastest of the speeds that were taken as one and lie furthest apart, rpm.
    pub widest_rpm: [f64; 2],
    /// Speeds that too few runs share, rpm.
    pub left_out_rpm: Vec<f64>,
}

impl Trials {
    fn unknowns(&self) -> usize {
        1 + self.places.len()
    }

    /// Largest trial weight, to scale the equations with.
    fn largest(&self) -> f64 {
        self.readings.iter().flat_map(|t| &t.weights).map(|w| w.norm()).fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Coefficients of every probe at every speed that enough runs share.
    ///
    /// # Errors
    /// One sentence if a correction plane has no trial weight, no speed has enough runs, or the phases are reversed.
    pub fn fit(&self) -> Result<Fitted, Error> {
        for (k, plane) in self.places.iter().enumerate().take(self.planes) {
            if self.readings.iter().all(|t| t.weights[k] == C::from(0.0)) {
                return Err(Error::Unsuitable(format!(
                    "no run has a trial weight in plane \"{plane}\", so its influence is not known; measure a run with one and state it"
                )));
            }
        }
        let mut fitted = Fitted {
            coefficients: Vec::new(),
            misfit: None,
            sense: Sense::new(self.probes.len()),
            widest_rpm: [1.0; 2],
            left_out_rpm: Vec::new(),
        };
        let (mut chi2, mut freedom, mut dependent) = (0.0, 0, false);
        for (speed, ends_rpm) in self.speeds.ends_rpm.iter().enumerate() {
            let before = fitted.coefficients.len();
            for probe in 0..self.probes.len() {
                match self.at(speed, probe, &mut fitted.sense) {
                    Row::Coefficients(found, chi2_here, freedom_here) => {
                        fitted.coefficients.push(found);
                        chi2 += chi2_here;
                        freedom += freedom_here;
                    }
                    Row::Dependent => dependent = true,
                    Row::TooFew => (),
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
            return Err(Error::Unsuitable(self.why_none(dependent)));
        }
        fitted.sense.check(&self.probes)?;
        fitted.misfit = (freedom > 0).then(|| Misfit { chi2_per_value: chi2 / freedom as f64, freedom });
        Ok(fitted)
    }

    fn at(&self, speed: usize, probe: usize, sense: &mut Sense) -> Row {
        let here = self.readings.iter().filter(|t| t.speed == speed);
        let rows: Vec<(&Trial, Value)> = here.filter_map(|t| Some((t, t.probes[probe]?))).collect();
        let unknowns = self.unknowns();
        let of_onto = |t: &Trial| self.onto.is_none_or(|run| t.run == run);
        if rows.len() < unknowns || !rows.iter().any(|(t, _)| of_onto(t)) {
            return Row::TooFew;
        }
        let scale = self.largest();
        let plain = DMatrix::from_fn(rows.len(), unknowns, |i, j| match j {
            0 => C::from(1.0),
            _ => rows[i].0.weights[j - 1] / scale,
        });
        if singular_values(plain.clone()).min() < INDEPENDENT {
            return Row::Dependent;
        }
        let design = DMatrix::from_fn(rows.len(), unknowns, |i, j| plain[(i, j)] / rows[i].1.sigma);
        let measured = DVector::from_iterator(rows.len(), rows.iter().map(|(_, y)| y.phasor / y.sigma));
        let Some(inverse) = (design.adjoint() * &design).try_inverse() else { return Row::Dependent };
        let solve = inverse * design.adjoint();
        let left = &measured - &design * (&solve * &measured);
        sense.add(probe, &design, &measured);
        // what is told, as linear in the readings of unit variance
        let planes = self.planes;
        let onto = rows.iter().filter(|(t, _)| self.onto == Some(t.run)).count() as f64;
        let told = DMatrix::from_fn(1 + planes, rows.len(), |i, j| match (i, self.onto) {
            (0, None) => solve[(0, j)],
            (0, Some(run)) if rows[j].0.run == run => C::from(rows[j].1.sigma / onto),
            (0, Some(_)) => C::from(0.0),
            _ => solve[(i, j)] / scale,
        });
        let values = &told * &measured;
        let found = Coefficients {
            probe,
            speed_rpm: self.speeds.mean_rpm[speed],
            before: values[0],
            per_weight: values.iter().skip(1).copied().collect(),
            covariance: &told * told.adjoint(),
        };
        Row::Coefficients(found, left.norm_squared(), 2 * (rows.len() - unknowns))
    }

    /// Why no speed has coefficients.
    fn why_none(&self, dependent: bool) -> String {
        let places = self.places.len();
        let planes = format!("{places} plane{}", if places == 1 { "" } else { "s" });
        let unknowns = self.unknowns();
        if dependent {
            return format!(
                "the trial weights do not tell the planes apart: {planes} need {unknowns} runs with independent trial weights at one \
                 speed, as one run without weights and one with a weight in each plane"
            );
        }
        let speeds = &self.speeds.mean_rpm;
        let [slowest, fastest] = [speeds.first(), speeds.last()].map(|s| s.copied().unwrap_or(0.0));
        let nearest = speeds.windows(2).map(|w| w[1] / w[0] - 1.0).fold(f64::INFINITY, f64::min);
        let advice = match nearest {
            near if near < 0.05 => format!(
                "; the nearest of their speeds differ by {:.2} %, and up to {:.2} % are taken as one (--same-speed)",
                100.0 * near,
                100.0 * self.speeds.same
            ),
            _ => "; run all of them over the same speeds".into(),
        };
        format!(
            "no speed between {slowest:.0} and {fastest:.0} rpm was measured in {unknowns} runs with independent trial weights, \
             which {planes} need{advice}"
        )
    }
}

/// What one probe's readings at one speed give.
enum Row {
    /// With χ² and the degrees of freedom.
    Coefficients(Coefficients, f64, usize),
    TooFew,
    Dependent,
}

impl Coefficients {
    /// Variance per component of the vibration under weights.
    pub fn variance(&self, weights: &[C]) -> f64 {
        let v = DVector::from_fn(self.covariance.nrows(), |i, _| match i {
            0 => C::from(1.0),
            i => weights[i - 1],
        });
        (v.transpose() * &self.covariance * v.conjugate())[(0, 0)].re.max(0.0)
    }

    /// `Y₀ + Σ A U`, in the unit of the trials.
    pub fn under(&self, weights: &[C]) -> C {
        self.before + self.per_weight.iter().zip(weights).map(|(a, w)| a * w).sum::<C>()
    }
}

/// Influence of every plane, a row a coefficient, and the vibration before.
pub fn stacked(all: &[Coefficients]) -> (DMatrix<C>, DVector<C>) {
    let planes = all.first().map_or(0, |c| c.per_weight.len());
    let per_weight = DMatrix::from_fn(all.len(), planes, |i, j| all[i].per_weight[j]);
    (per_weight, DVector::from_iterator(all.len(), all.iter().map(|c| c.before)))
}

/// Normal equations of the weights of least squares. Squares of measured coefficients are too large by their variance, which
/// would make the weights too small: it is taken off.
pub(super) fn normal_equations(all: &[Coefficients]) -> NormalEquations {
    let (per_weight, before) = stacked(all);
    let planes = per_weight.ncols();
    let excess = |j: usize, k: usize| all.iter().map(|c| 2.0 * c.covariance[(k, j + 1)]).sum::<C>();
    let matrix = DMatrix::from_fn(planes, planes, |j, k| excess(j, k + 1));
    NormalEquations::of(&per_weight, &before).less(matrix, &DVector::from_fn(planes, |j, _| excess(j, 0)))
}

/// Standard deviation per component of weights of least squares: how what is not known of the machine moves the weights that
/// are best for it. `inverse` is that of the normal matrix.
pub(super) fn standard_deviations(all: &[Coefficients], inverse: &DMatrix<C>, weights: &[C]) -> Vec<f64> {
    let planes = weights.len();
    let mut middle = DMatrix::zeros(planes, planes);
    for c in all {
        let (moved, left) = (c.variance(weights), c.under(weights).norm_sqr());
        for j in 0..planes {
            for k in 0..planes {
                // of the vibration, and of the direction along which what is left is projected
                middle[(j, k)] +=
                    c.per_weight[j].conj() * c.per_weight[k] * moved + c.covariance[(k + 1, j + 1)] * left;
            }
        }
    }
    let moved = inverse * middle * inverse;
    (0..planes).map(|j| moved[(j, j)].re.max(0.0).sqrt()).collect()
}

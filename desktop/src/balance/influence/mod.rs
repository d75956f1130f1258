//! Influence coefficients: vibration per unit of unbalance in a plane, at a probe and speed.
//!
//! | module | holds |
//! |---|---|
//! | [`regression`] | the one fit: runs with known weights, with or without a prior |
//! | [`trials`] | trial runs as equations, without a model of the machine |
//! | [`contradiction`] | the one run that contradicts the others |
//!
//! Nothing of the machine needs to be known but that it is linear. Units are those of the runs: m and kg·m where they come with
//! a rotor's file, else the data's own and g·mm.

pub mod contradiction;
pub mod regression;
pub mod trials;

use nalgebra::{Complex, DMatrix, DVector};

use super::NormalEquations;
use regression::{InfluencePosterior, Observation};

type C = Complex<f64>;

/// Coefficients of one probe at one speed.
#[derive(Debug, Clone)]
pub struct InfluenceCoefficients {
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

impl InfluenceCoefficients {
    /// From a regression of one row, of whose planes the first are correction planes; its weights were divided by `scale`.
    pub fn new(probe: usize, speed_rpm: f64, fit: &InfluencePosterior, planes: usize, scale: f64) -> Self {
        let mean = fit.complex_mean(0);
        let covariance = fit.circular_covariance();
        let divide = |i: usize| if i == 0 { 1.0 } else { scale };
        Self {
            probe,
            speed_rpm,
            before: mean[0],
            per_weight: (1..=planes).map(|j| mean[j] / scale).collect(),
            covariance: DMatrix::from_fn(1 + planes, 1 + planes, |i, j| {
                covariance[(i, j)] / (divide(i) * divide(j))
            }),
        }
    }

    /// The same among so many planes, of which these have the coefficients and the others change nothing.
    fn among(self, these: &[usize], planes: usize) -> Self {
        if these.len() == planes {
            return self;
        }
        let mut per_weight = vec![C::from(0.0); planes];
        let mut covariance = DMatrix::zeros(1 + planes, 1 + planes);
        let place = |i: usize| if i == 0 { 0 } else { 1 + these[i - 1] };
        for i in 0..=these.len() {
            for j in 0..=these.len() {
                covariance[(place(i), place(j))] = self.covariance[(i, j)];
            }
        }
        these.iter().zip(&self.per_weight).for_each(|(plane, a)| per_weight[*plane] = *a);
        Self { per_weight, covariance, ..self }
    }

    /// Takes the mean of these readings of the same fit for the machine that weights are added to.
    fn start_from(&mut self, own: &[&Observation], fit: &InfluencePosterior, scale: f64) {
        let count = own.len() as f64;
        self.before = own.iter().map(|o| o.phasor).sum::<C>() / count;
        // as linear in the errors of the readings
        let covariance = fit.circular_covariance();
        let design = DMatrix::from_fn(1, covariance.nrows(), |_, k| match k {
            0 => C::from(1.0),
            _ => own.iter().map(|o| o.weights[k - 1]).sum::<C>() / count,
        });
        let with_fit = design * covariance;
        self.covariance[(0, 0)] =
            C::from(own.iter().map(|o| o.sigma * o.sigma).sum::<f64>() / (count * count));
        for j in 1..self.covariance.ncols() {
            let shared = with_fit[(0, j)] / scale;
            self.covariance[(0, j)] = shared;
            self.covariance[(j, 0)] = shared.conj();
        }
    }

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
pub fn stacked(all: &[InfluenceCoefficients]) -> (DMatrix<C>, DVector<C>) {
    let planes = all.first().map_or(0, |c| c.per_weight.len());
    let per_weight = DMatrix::from_fn(all.len(), planes, |i, j| all[i].per_weight[j]);
    (per_weight, DVector::from_iterator(all.len(), all.iter().map(|c| c.before)))
}

/// Normal equations of the weights of least squares. Squares of measured coefficients are too large by their variance, which
/// would make the weights too small: it is taken off.
pub(super) fn normal_equations(all: &[InfluenceCoefficients]) -> NormalEquations {
    let (per_weight, before) = stacked(all);
    let planes = per_weight.ncols();
    let excess = |j: usize, k: usize| all.iter().map(|c| 2.0 * c.covariance[(k, j + 1)]).sum::<C>();
    let matrix = DMatrix::from_fn(planes, planes, |j, k| excess(j, k + 1));
    NormalEquations::of(&per_weight, &before).less(matrix, &DVector::from_fn(planes, |j, _| excess(j, 0)))
}

/// Standard deviation per component of weights of least squares: how what is not known of the machine moves the weights that
/// are best for it. `inverse` is that of the normal matrix.
pub(super) fn standard_deviations(
    all: &[InfluenceCoefficients],
    inverse: &DMatrix<C>,
    weights: &[C],
) -> Vec<f64> {
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

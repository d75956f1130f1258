//! Which weights are best: least squares, or the least of the largest vibration, with a largest weight a plane.
//!
//! Least squares without limits has normal equations. With limits it is a quadratic programme over discs, and the least
//! largest vibration is a second-order cone programme (Foiles, Allaire and Gunter, Shock and Vibration 5, 1998): both are convex
//! and have one optimum that is certified.

use clarabel::solver::SupportedConeT::SecondOrderConeT;
use nalgebra::{Complex, DMatrix, DVector};

use super::NormalEquations;
use crate::cone::Programme;
use crate::error::Error;

type C = Complex<f64>;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Criterion {
    /// The sum of squared amplitudes.
    #[default]
    LeastSquares,
    /// The largest amplitude.
    MinMax,
}

impl Criterion {
    /// What is to be made least, of the vibration `before + per_weight · weights`.
    pub fn cost(self, per_weight: &DMatrix<C>, before: &DVector<C>, weights: &[C]) -> f64 {
        let left = before + per_weight * DVector::from_column_slice(weights);
        match self {
            Self::LeastSquares => left.norm_squared(),
            Self::MinMax => left.iter().map(|y| y.norm()).fold(0.0, f64::max),
        }
    }
}

/// The optimum by a criterion, no weight longer than its limit.
pub(super) fn best(
    criterion: Criterion,
    equations: &NormalEquations,
    (per_weight, before): (&DMatrix<C>, &DVector<C>),
    limits: &[f64],
) -> Result<DVector<C>, Error> {
    match criterion {
        Criterion::MinMax => least_largest(per_weight, before, limits),
        Criterion::LeastSquares => {
            let inverse = equations.matrix.clone().try_inverse();
            let free = -(inverse.ok_or_else(|| {
                Error::Unsuitable(
                    "the correction planes have the same effect on every probe; choose fewer planes".into(),
                )
            })? * &equations.right);
            match free.iter().zip(limits).all(|(w, limit)| w.norm() <= *limit) {
                true => Ok(free),
                false => least_squares_within(equations, limits),
            }
        }
    }
}

/// Weights that make the largest of `|before + per_weight · w|` least, none longer than its limit.
///
/// # Errors
/// If no plane moves any probe, or the programme cannot be solved.
pub fn least_largest(
    per_weight: &DMatrix<C>,
    before: &DVector<C>,
    limits: &[f64],
) -> Result<DVector<C>, Error> {
    let level = before.iter().map(|y| y.norm()).fold(0.0, f64::max);
    if level == 0.0 {
        return Ok(DVector::zeros(per_weight.ncols()));
    }
    let planes = per_weight.ncols();
    let scale = scales((0..planes).map(|j| per_weight.column(j).norm() / level))?;
    let mut programme = Programme::default();
    let bound = 2 * planes;
    for (i, y) in before.iter().enumerate() {
        programme.push(bound, -1.0);
        programme.end_row(0.0);
        for axis in 0..2 {
            for j in 0..planes {
                let a = per_weight[(i, j)] * scale[j] / level;
                let [x, y] = [[a.re, -a.im], [a.im, a.re]][axis];
                programme.push(2 * j, -x);
                programme.push(2 * j + 1, -y);
            }
            programme.end_row([y.re, y.im][axis] / level);
        }
        programme.cones.push(SecondOrderConeT(3));
    }
    within(&mut programme, &scale, limits);
    let mut cost = vec![0.0; bound + 1];
    cost[bound] = 1.0;
    let x = programme.solve("the search for the least largest vibration", &cost)?;
    Ok(weights(&x, &scale))
}

/// Weights of least squares, none longer than its limit.
fn least_squares_within(equations: &NormalEquations, limits: &[f64]) -> Result<DVector<C>, Error> {
    let NormalEquations { matrix, right, .. } = equations;
    let planes = right.len();
    // unknowns of the size of one: each weight by what it does, all by the largest
    let by_effect = scales((0..planes).map(|j| matrix[(j, j)].re.max(0.0).sqrt()))?;
    let pull = |j: usize| right[j].norm() * by_effect[j];
    let size = (0..planes).map(pull).fold(0.0, f64::max);
    if size == 0.0 {
        return Ok(DVector::zeros(planes));
    }
    let scale: Vec<f64> = by_effect.iter().map(|s| s * size).collect();
    let mut programme = Programme::default();
    for j in 0..planes {
        for k in 0..=j {
            let m = matrix[(k, j)] * by_effect[k] * by_effect[j];
            // upper triangle of [[re, −im], [im, re]] by pairs
            programme.quadratic.push((2 * k, 2 * j, m.re));
            programme.quadratic.push((2 * k + 1, 2 * j + 1, m.re));
            if k < j {
                programme.quadratic.push((2 * k, 2 * j + 1, -m.im));
                programme.quadratic.push((2 * k + 1, 2 * j, m.im));
            }
        }
    }
    within(&mut programme, &scale, limits);
    let cost: Vec<f64> = (0..planes)
        .flat_map(|j| {
            let r = right[j] * by_effect[j] / size;
            [r.re, r.im]
        })
        .collect();
    let x = programme.solve("least squares within the largest weights", &cost)?;
    Ok(weights(&x, &scale))
}

/// What each unknown is a multiple of: one over the effect of its plane.
fn scales(effects: impl Iterator<Item = f64>) -> Result<Vec<f64>, Error> {
    let all: Vec<f64> = effects.map(|effect| 1.0 / effect).collect();
    match all.iter().all(|s| s.is_finite()) {
        true => Ok(all),
        false => Err(Error::Unsuitable(
            "a weight in one correction plane changes no probe's reading; choose other planes".into(),
        )),
    }
}

fn within(programme: &mut Programme, scale: &[f64], limits: &[f64]) {
    for (j, limit) in limits.iter().enumerate().filter(|(_, limit)| limit.is_finite()) {
        programme.bound_pair(2 * j, limit / scale[j]);
    }
}

fn weights(x: &[f64], scale: &[f64]) -> DVector<C> {
    DVector::from_fn(scale.len(), |j, _| C::new(x[2 * j], x[2 * j + 1]) * scale[j])
}

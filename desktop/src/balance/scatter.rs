//! How far noise moves the best weights: by formula where nothing holds them, else by drawing it again and again.

use nalgebra::{Complex, DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::NormalEquations;
use super::influence::{InfluenceCoefficients, stacked, standard_deviations};
use super::optimum::{Criterion, best};
use crate::error::Error;

type C = Complex<f64>;

const DRAWS: usize = 200;

/// Whether weights are those of least squares and at no limit, so that formulas hold.
pub(super) fn is_free(criterion: Criterion, weights: &[C], limits: &[f64]) -> bool {
    let is_within = |(w, limit): (&C, &f64)| w.norm() < limit * (1.0 - 1e-6);
    criterion == Criterion::LeastSquares && weights.iter().zip(limits).all(is_within)
}

/// Standard deviation per component of weights which `found` finds anew with each draw of the noise.
pub(super) fn drawn(
    weights: &[C],
    mut found: impl FnMut(&mut dyn FnMut() -> C) -> Result<DVector<C>, Error>,
) -> Result<Vec<f64>, Error> {
    let mut random = StdRng::seed_from_u64(1);
    let mut normal = || C::new(random.sample(StandardNormal), random.sample(StandardNormal));
    let mut squares = vec![0.0; weights.len()];
    for _ in 0..DRAWS {
        let moved = found(&mut normal)?;
        let pairs = moved.iter().zip(weights);
        squares.iter_mut().zip(pairs).for_each(|(s, (a, b))| *s += (a - b).norm_sqr());
    }
    Ok(squares.into_iter().map(|s| (0.5 * s / DRAWS as f64).sqrt()).collect())
}

/// The same of weights that come from these coefficients; `inverse` is that of their normal matrix.
pub(super) fn of_coefficients(
    all: &[InfluenceCoefficients],
    criterion: Criterion,
    limits: &[f64],
    inverse: &DMatrix<C>,
    weights: &[C],
) -> Result<Vec<f64>, Error> {
    if is_free(criterion, weights, limits) {
        return Ok(standard_deviations(all, inverse, weights));
    }
    let roots: Vec<DMatrix<C>> = all
        .iter()
        .map(|c| {
            // a covariance may lack a rank where two values come from one reading
            let jitter = 1e-12 * c.covariance.trace().re.max(f64::MIN_POSITIVE);
            let size = c.covariance.nrows();
            let firm = &c.covariance + DMatrix::identity(size, size) * C::from(jitter);
            firm.cholesky().map_or_else(|| DMatrix::zeros(size, size), |root| root.l())
        })
        .collect();
    drawn(weights, |normal| {
        let moved: Vec<InfluenceCoefficients> = (all.iter().zip(&roots))
            .map(|(c, root)| {
                let off = root * DVector::from_fn(root.nrows(), |_, _| normal());
                let per_weight = c.per_weight.iter().zip(off.iter().skip(1)).map(|(a, d)| a + d).collect();
                InfluenceCoefficients { before: c.before + off[0], per_weight, ..c.clone() }
            })
            .collect();
        let (per_weight, before) = stacked(&moved);
        best(criterion, &NormalEquations::of(&per_weight, &before), (&per_weight, &before), limits)
    })
}

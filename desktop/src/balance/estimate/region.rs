//! The unbalance of one mounting from the learned influence, with its 95 % region.

use nalgebra::{Complex, DMatrix, DVector, Matrix2};

use super::learning::{LearnedInfluence, MountingComponents, placement};
use crate::balance::influence::regression::factor;
use crate::error::Error;
use crate::unbalance::region::UnbalanceRegion;

type C = Complex<f64>;

/// Rounds over the covariance, which depends on the unbalance through the covariance of the influence.
const ROUNDS: usize = 8;
/// An unbalance this many times the largest stated weight is not expected; keeps planes apart that nothing else does.
const EXPECTED: f64 = 10.0;

/// Unbalance of every plane of a mounting relative to the base run.
///
/// Generalised least squares with the covariance of the mounting and of the influence.
///
/// # Errors
/// If a covariance is singular.
pub fn estimated(
    learned: &LearnedInfluence,
    seen: &MountingComponents,
    planes: usize,
    largest_g_mm: f64,
) -> Result<Vec<UnbalanceRegion>, Error> {
    let mut unbalance = DVector::zeros(2 * planes);
    let (mut covariance, mut by_session) = (DMatrix::zeros(0, 0), DMatrix::zeros(0, 0));
    let complex = |u: &DVector<f64>| (0..planes).map(|j| C::new(u[j], u[planes + j])).collect::<Vec<_>>();
    let expected = DMatrix::from_diagonal_element(2 * planes, 2 * planes, (EXPECTED * largest_g_mm).powi(-2));
    let bare = learned.predict(seen, &vec![C::from(0.0); planes], false).mean;
    for _ in 0..ROUNDS {
        let expectation = learned.predict(seen, &complex(&unbalance), false);
        let noise = factor(expectation.covariance)?;
        let weighted = noise.solve(&expectation.per_weight);
        let solved = factor(expectation.per_weight.tr_mul(&weighted) + &expected)?;
        unbalance = solved.solve(&weighted.tr_mul(&(&seen.y - &bare)));
        covariance = solved.inverse();
        let gain = weighted * &covariance;
        by_session = gain.tr_mul(&(expectation.between_sessions * &gain));
    }
    let found = complex(&unbalance);
    covariance += placement(&found, learned.placement);
    let of = |j: usize| {
        let at = [j, planes + j];
        let of_plane = |whole: &DMatrix<f64>| Matrix2::from_fn(|a, b| whole[(at[a], at[b])]);
        let of_session = of_plane(&by_session).trace() / of_plane(&covariance).trace();
        // of a sum of two estimated variances (Satterthwaite 1946)
        let terms = [
            (1.0 - of_session).powi(2) / learned.freedom(),
            of_session.powi(2) / learned.between_sessions.freedom(),
        ];
        UnbalanceRegion::new(found[j], of_plane(&covariance), terms.iter().sum::<f64>().recip())
    };
    Ok((0..planes).map(of).collect())
}

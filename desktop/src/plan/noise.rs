//! Noise of readings that an effect changes. Relative noise follows the size of the readings, so a machine that vibrates more hides more.

use nalgebra::{DMatrix, DVector};

use crate::decomposition::{svd, transposed_product};
use crate::fit::forward::ExpectedCost;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::{Drawing, Fit, Fitter};
use crate::statistics::evidence::Sizes;

/// Directions whose singular value is below this share of the largest are none.
const LEAST_DIRECTION: f64 = 1e-7;

/// What readings are judged by: their noise, and what the model follows of them. Columns hold readings, whitened by noise and
/// errors of the drawing, then priors of the bearings.
pub struct PlannedNoise {
    /// From the noise of the readings as stated to this one; `None` where it is that.
    from_stated: Option<Reweighing>,
    /// What bearings, planes and stated effects follow, as orthonormal columns.
    followed: DMatrix<f64>,
    cost: ExpectedCost,
    /// Cost where nothing is missed.
    least_cost: f64,
    readings: usize,
    pub sizes: Sizes,
}

/// Noise of the same readings, before and after they are changed.
pub struct Reweighing {
    pub before: Drawing,
    pub after: Drawing,
    /// Standard deviation before over the one after, of each real number.
    pub ratios: DVector<f64>,
}

impl Reweighing {
    /// The same noise once more.
    pub fn as_it_is(&self) -> Self {
        Self { before: self.before.as_it_is(), after: self.after.as_it_is(), ratios: self.ratios.clone() }
    }

    /// The same columns in the noise after the change.
    fn apply(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let count = self.ratios.len();
        let mut readings = columns.rows(0, count).into_owned();
        self.before.unwhiten(&mut readings);
        readings.column_iter_mut().for_each(|mut column| column.component_mul_assign(&self.ratios));
        self.after.whiten(&mut readings);
        let mut all = columns.clone();
        all.rows_mut(0, count).copy_from(&readings);
        all
    }
}

impl PlannedNoise {
    /// Of the readings as stated; `followed` is what the model follows of them.
    pub fn stated(
        fitter: &Fitter,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        followed: DMatrix<f64>,
    ) -> Self {
        let readings = followed.nrows() - hypothesis.bearings.unknowns().len();
        let cost = fitter.expected_cost(fit, drawing);
        Self {
            from_stated: None,
            followed: orthonormal(followed),
            least_cost: cost.of(&DVector::zeros(readings)),
            cost,
            readings,
            sizes: fitter.sizes,
        }
    }

    /// Of the readings when they are changed, to which the model is fitted.
    pub fn changed(&self, fitter: &Fitter, fit: &Fit, reweighing: Reweighing) -> Self {
        let cost = fitter.expected_cost(fit, &reweighing.after);
        Self {
            followed: orthonormal(reweighing.apply(&self.followed)),
            least_cost: cost.of(&DVector::zeros(self.readings)),
            cost,
            readings: self.readings,
            sizes: fitter.sizes,
            from_stated: Some(reweighing),
        }
    }

    /// Whether it is that of the readings as stated.
    pub fn is_stated(&self) -> bool {
        self.from_stated.is_none()
    }

    /// Columns that are whitened by the noise of the readings as stated, in this one.
    pub fn of_stated(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        self.from_stated.as_ref().map_or_else(|| columns.clone(), |reweighing| reweighing.apply(columns))
    }

    /// What nothing of the model follows.
    pub fn unfollowed(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        let followed = transposed_product(&self.followed, &columns);
        columns.gemm(-1.0, &self.followed, &followed, 1.0);
        columns
    }

    /// What missing this costs on average beside missing nothing, twice a log likelihood.
    pub fn loss(&self, missed: &DVector<f64>) -> f64 {
        let priors = missed.rows(self.readings, missed.len() - self.readings).norm_squared();
        self.cost.of(&missed.rows(0, self.readings).into_owned()) + priors - self.least_cost
    }
}

/// An orthonormal basis of what columns span.
pub fn orthonormal(mut columns: DMatrix<f64>) -> DMatrix<f64> {
    let rows = columns.nrows();
    if columns.is_empty() {
        // an effect that the model follows altogether
        return columns;
    }
    for mut column in columns.column_iter_mut() {
        let size = column.norm();
        if size > f64::MIN_POSITIVE {
            column /= size;
        }
    }
    // the small factor is a far shorter way to the singular vectors
    let (basis, factor) = columns.qr().unpack();
    let Some((Some(u), sizes)) = svd(factor).map(|found| (found.u, found.singular_values)) else {
        return DMatrix::zeros(rows, 0);
    };
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let kept: Vec<usize> =
        (0..sizes.len()).filter(|k| sizes[*k] > LEAST_DIRECTION * largest && sizes[*k] > 0.0).collect();
    basis * u.select_columns(&kept)
}

//! Shift of a session: of the base as a whole, and of the scale of each plane.
//!
//! `Y = Y₀ + b + H (1 + g) U`: b a vector over the rows whose covariance is a multiple of the scatter between mountings, g a complex
//! number for each plane. Both are common to the runs of a session and Gaussian around zero; the sizes are learned from the
//! sessions with stated weights, each guess an inverse gamma prior.

use nalgebra::{Complex, DMatrix, DVector};

use super::scatter::real;
use crate::balance::influence::regression::{InfluencePosterior, Regression, factor};
use crate::decomposition::hermitian;
use crate::error::Error;

type C = Complex<f64>;

/// Guessed standard deviation of the shift of the base, in units of the scatter between mountings: a session is a mounting too.
const GUESSED_BASE: f64 = 1.0;
/// Guessed standard deviation of the scale of a plane: influence coefficients of one machine repeat to some five percent.
const GUESSED_SCALE: f64 = 0.05;
/// Combinations of weights with less effect than this, relative and squared, move no base.
const ALIKE: f64 = 1e-9;
/// Weight of each guess, in sessions.
const GUESS_WEIGHT: f64 = 1.0;

/// Sizes of the shifts between sessions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SessionScatter {
    /// Standard deviation of the shift of the base, in units of the scatter between mountings.
    pub base: f64,
    /// Standard deviation of the scale of a plane, relative, by component.
    pub scale: f64,
    /// Number of sessions that they are learned from.
    pub sessions: usize,
}

impl SessionScatter {
    pub const GUESSED: Self = Self { base: GUESSED_BASE, scale: GUESSED_SCALE, sessions: 1 };

    /// Degrees of freedom: two of each session. The guess stands for one and the mean takes one; a guess alone counts as two, as it
    /// is known within a factor of two.
    pub fn freedom(&self) -> f64 {
        2.0 * self.sessions.max(2) as f64
    }

    /// Covariance of the shifts of a session: components of the base, then real and imaginary parts of the scales.
    fn covariance(&self, scatter: &DMatrix<f64>, planes: usize) -> DMatrix<f64> {
        let n = scatter.nrows();
        let mut covariance =
            DMatrix::from_diagonal_element(n + 2 * planes, n + 2 * planes, self.scale.powi(2));
        covariance.view_mut((0, 0), (n, n)).copy_from(&(scatter * self.base.powi(2)));
        covariance
    }

    /// The most probable sizes by the shifts of the sessions. That of the base counts where weights can move it: only this part
    /// of it moves an unbalance.
    ///
    /// # Errors
    /// If the scatter is singular.
    pub fn of(
        effects: &[SessionEffect],
        scatter: &DMatrix<f64>,
        posterior: &InfluencePosterior,
    ) -> Result<Self, Error> {
        let n = scatter.nrows();
        let per_weight = real(&posterior.per_weight());
        let weighted = factor(scatter.clone())?.solve(&per_weight);
        let size = hermitian(per_weight.tr_mul(&weighted));
        let least = ALIKE * size.eigenvalues.max();
        let told: Vec<usize> = (0..size.eigenvalues.len()).filter(|i| size.eigenvalues[*i] > least).collect();
        let directions: Vec<DVector<f64>> = told
            .iter()
            .map(|i| &weighted * size.eigenvectors.column(*i) / size.eigenvalues[*i].sqrt())
            .collect();
        let [mut base, mut scale] = [GUESSED_BASE, GUESSED_SCALE].map(|guess| GUESS_WEIGHT * guess * guess);
        for effect in effects {
            let mean = effect.mean(posterior);
            let squares = &mean * mean.transpose()
                + &effect.covariance
                + &effect.towards * &posterior.covariance * effect.towards.transpose();
            let of_base = squares.view((0, 0), (n, n));
            let moved: f64 = directions.iter().map(|d| d.dot(&(of_base * d))).sum();
            base += moved / directions.len().max(1) as f64;
            let scales = squares.nrows() - n;
            scale += squares.view((n, n), (scales, scales)).trace() / scales as f64;
        }
        let count = GUESS_WEIGHT + effects.len() as f64;
        Ok(Self { base: (base / count).sqrt(), scale: (scale / count).sqrt(), sessions: effects.len() })
    }

    /// Sizes for one session in place of those that these are learned from: it has the error of their mean, another that and its
    /// own.
    pub fn of_mean(self) -> Self {
        let by = (0.5 * (1.0 + (self.sessions as f64).recip())).sqrt();
        Self { base: self.base * by, scale: self.scale * by, ..self }
    }
}

/// Components of the rows per component of a session's shift, under these weights.
pub fn shift_design(influence: &DMatrix<C>, weights: &[C]) -> DMatrix<f64> {
    let n = 2 * influence.nrows();
    let scaled =
        real(&DMatrix::from_fn(influence.nrows(), weights.len(), |row, j| influence[(row, j)] * weights[j]));
    let mut design = DMatrix::zeros(n, n + scaled.ncols());
    design.view_mut((0, 0), (n, n)).fill_with_identity();
    design.view_mut((0, n), scaled.shape()).copy_from(&scaled);
    design
}

/// The shift of a session given its runs: `offset − towards · (Y₀ and A)`, and its covariance.
#[derive(Debug, Clone)]
pub struct SessionEffect {
    offset: DVector<f64>,
    towards: DMatrix<f64>,
    pub covariance: DMatrix<f64>,
}

impl SessionEffect {
    pub fn mean(&self, posterior: &InfluencePosterior) -> DVector<f64> {
        &self.offset - &self.towards * &posterior.mean
    }

    /// Design of Y₀ and A of a mounting where the shift follows them.
    pub fn followed(&self, design: &DMatrix<f64>, shift: &DMatrix<f64>) -> DMatrix<f64> {
        design - shift * &self.towards
    }
}

/// What the runs of a session tell of its shift.
#[derive(Debug, Clone)]
pub struct SessionRuns {
    precision: DMatrix<f64>,
    coupling: DMatrix<f64>,
    right: DVector<f64>,
}

impl SessionRuns {
    /// No run yet: beside so many components of Y₀ and A.
    ///
    /// # Errors
    /// If the scatter is singular.
    pub fn none(
        sizes: &SessionScatter,
        scatter: &DMatrix<f64>,
        planes: usize,
        others: usize,
    ) -> Result<Self, Error> {
        let precision = factor(sizes.covariance(scatter, planes))?.inverse();
        let shifts = precision.nrows();
        Ok(Self { precision, coupling: DMatrix::zeros(shifts, others), right: DVector::zeros(shifts) })
    }

    /// Adds a run with a share between 0 and 1, as [`Regression::add`] does.
    pub fn add(
        &mut self,
        [shift, design]: [&DMatrix<f64>; 2],
        inverse: &DMatrix<f64>,
        y: &DVector<f64>,
        share: f64,
    ) {
        let weighted = shift.tr_mul(inverse) * share;
        self.precision += &weighted * shift;
        self.coupling += &weighted * design;
        self.right += weighted * y;
    }

    /// The shift, which the regression of the same runs then allows for.
    ///
    /// # Errors
    /// If its covariance is singular.
    pub fn effect(self, regression: Option<&mut Regression>) -> Result<SessionEffect, Error> {
        let covariance = factor(self.precision)?.inverse();
        if let Some(regression) = regression {
            regression.marginalize(&covariance, &self.coupling, &self.right);
        }
        Ok(SessionEffect {
            offset: &covariance * self.right,
            towards: &covariance * self.coupling,
            covariance,
        })
    }
}

//! The machine in the planned readings: what a fit follows of a change, and what candidates make of the rest.

use nalgebra::{Complex, DMatrix, DVector};

use super::strength::EffectState;
use crate::decomposition::svd;
use crate::diagnose::PlaneUnbalances;
use crate::diagnose::base::BaseModel;
use crate::error::Error;
use crate::fit::forward::{ExpectedCost, ForwardModel};
use crate::fit::hypothesis::{Hypothesis, PlacedEffect};
use crate::fit::{Effort, starts_for};

type C = Complex<f64>;

/// Directions whose singular value is below this share of the largest are none.
const LEAST_DIRECTION: f64 = 1e-7;

/// A machine in readings that it would give itself.
pub struct PlannedReadings<'a> {
    pub base: BaseModel<'a>,
    cost: ExpectedCost,
    /// Cost where nothing is missed.
    least_cost: f64,
    /// What bearings, planes and stated effects follow, as orthonormal columns: readings, whitened, then priors of the bearings.
    followed: DMatrix<f64>,
    /// The readings as they are, and as the model predicts them, in noise units.
    readings: DVector<f64>,
    stated: DVector<f64>,
}

/// A change of the readings by an effect.
#[derive(Debug, Clone)]
pub struct Signal {
    /// What nothing of the model follows: readings, whitened, then priors of the bearings.
    pub visible: DVector<f64>,
    /// The same with the model taken as linear around the machine as stated, which is where a candidate that imitates the effect
    /// well has its bearings.
    pub linear: DVector<f64>,
    /// Change of the readings relative to them, root mean square in noise units.
    pub change: f64,
}

impl<'a> PlannedReadings<'a> {
    /// Of the base model of readings that are the machine's own as its file states it.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn of(base: BaseModel<'a>) -> Result<Self, Error> {
        let fitter = base.fitter;
        let (drawing, fit) = &base.search;
        let own = fitter.tangent(&base.hypothesis, &fit.x, drawing, &fit.amplitudes)?;
        let priors = base.hypothesis.bearings.unknowns();
        let (rows, count) = own.shape();
        let mut followed = own.resize_vertically(rows + priors.len(), 0.0);
        for (i, u) in priors.iter().enumerate() {
            followed[(rows + i, i)] = u.law.prior_sd.recip();
        }
        debug_assert!(count >= priors.len(), "bearings come first");
        let cost = fitter.expected_cost(fit, drawing);
        let readings = fitter.data.values().flat_map(|v| {
            let y = v.measured_m / v.sigma_m;
            [y.re, y.im]
        });
        let forward = fitter.forward(&base.hypothesis, drawing, &fit.amplitudes)?;
        let stated =
            forward.at(&fit.x, &fit.unknowns).ok_or(Error::SingularMachine { tried: "as stated" })?;
        drop(forward);
        Ok(Self {
            stated,
            least_cost: cost.of(&DVector::zeros(rows)),
            cost,
            followed: orthonormal(followed),
            readings: DVector::from_iterator(rows, readings),
            base,
        })
    }

    /// The model with an effect.
    pub fn with(&self, placed: PlacedEffect) -> Hypothesis<'a> {
        self.base.hypothesis.with(placed)
    }

    /// Predicts the readings of a hypothesis.
    ///
    /// # Errors
    /// If the shaft cannot be solved.
    pub fn forward<'p>(&'p self, with: &'p Hypothesis<'p>) -> Result<ForwardModel<'p>, Error> {
        let (drawing, fit) = &self.base.search;
        self.base.fitter.forward(with, drawing, &fit.amplitudes)
    }

    /// The readings with an effect less those without, in noise units; `None` if the machine is singular.
    pub fn change(
        &self,
        with: &Hypothesis,
        forward: &ForwardModel,
        state: &EffectState,
    ) -> Option<DVector<f64>> {
        let fit = &self.base.search.1;
        let x: Vec<f64> = fit.x.iter().copied().chain(state.coordinates(with)).collect();
        let unknowns: Vec<C> = fit.unknowns.iter().copied().chain(state.phasors(with)).collect();
        let seen = forward.at(&x, &unknowns)?;
        Some(seen - &self.stated).filter(|change| change.iter().all(|v| v.is_finite()))
    }

    /// The signal of a change of the readings, in noise units.
    pub fn signal(&self, change: DVector<f64>) -> Signal {
        let share = change.norm() / self.readings.norm().max(f64::MIN_POSITIVE);
        let visible = self.visible(DMatrix::from_columns(&[change]));
        let visible = visible.column(0).into_owned();
        Signal { linear: visible.clone(), visible, change: share }
    }

    /// The same where the model is fitted to the changed readings: it follows large changes otherwise than small ones. `None` if
    /// that fit fails.
    pub fn signal_beside_fit(&self, change: &DVector<f64>) -> Option<Signal> {
        let BaseModel { fitter, hypothesis, search: (drawing, fit), .. } = &self.base;
        let changed = fitter.changed(change);
        let start = std::slice::from_ref(&fit.x);
        let there = changed.fit(hypothesis, start, drawing, Effort::Rough, Some(&fit.amplitudes)).ok()?;
        let visible = changed.missed(hypothesis, &there, drawing) - fitter.missed(hypothesis, fit, drawing);
        Some(Signal { visible, ..self.signal(change.clone()) })
    }

    /// What a candidate costs at its best where the readings are changed, fitted as a diagnosis does; `None` if that fails.
    pub fn loss_of_fitted(&self, placed: PlacedEffect, change: &DVector<f64>) -> Option<f64> {
        let BaseModel { fitter, hypothesis, search: (drawing, fit), .. } = &self.base;
        let (changed, with) = (fitter.changed(change), self.with(placed));
        let starts = starts_for(hypothesis, fit, placed);
        // the bearings of the fit are those of the file
        let starts: Vec<Vec<f64>> = starts.into_iter().step_by(2).collect();
        let there = changed.fit(&with, &starts, drawing, Effort::Rough, Some(&fit.amplitudes)).ok()?;
        Some(self.loss(&(changed.missed(&with, &there, drawing) - fitter.missed(hypothesis, fit, drawing))))
    }

    /// Of changes of the readings, one a column, what nothing of the model follows.
    pub fn visible(&self, mut changes: DMatrix<f64>) -> DMatrix<f64> {
        self.base.search.0.whiten(&mut changes);
        self.unfollowed(changes)
    }

    /// The same of changes that are whitened.
    pub fn unfollowed(&self, whitened: DMatrix<f64>) -> DMatrix<f64> {
        let left = whitened.resize_vertically(self.followed.nrows(), 0.0);
        &left - &self.followed * self.followed.tr_mul(&left)
    }

    /// What missing this costs on average beside missing nothing, twice a log likelihood.
    pub fn loss(&self, missed: &DVector<f64>) -> f64 {
        let rows = self.readings.len();
        let priors = missed.rows(rows, missed.len() - rows).norm_squared();
        self.cost.of(&missed.rows(0, rows).into_owned()) + priors - self.least_cost
    }

    /// The unbalances of the planes with their 95 % regions.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn planes(&self) -> Result<PlaneUnbalances, Error> {
        let BaseModel { fitter, hypothesis, search: (drawing, fit), .. } = &self.base;
        let covariance = fitter.covariance(hypothesis, fit, drawing)?;
        Ok(PlaneUnbalances::by(&self.base, fit, covariance.as_ref()))
    }
}

/// An orthonormal basis of what columns span.
pub fn orthonormal(mut columns: DMatrix<f64>) -> DMatrix<f64> {
    let rows = columns.nrows();
    for mut column in columns.column_iter_mut() {
        let size = column.norm();
        if size > f64::MIN_POSITIVE {
            column /= size;
        }
    }
    let Some((Some(u), sizes)) = svd(columns).map(|found| (found.u, found.singular_values)) else {
        return DMatrix::zeros(rows, 0);
    };
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let kept: Vec<usize> =
        (0..sizes.len()).filter(|k| sizes[*k] > LEAST_DIRECTION * largest && sizes[*k] > 0.0).collect();
    u.select_columns(&kept)
}

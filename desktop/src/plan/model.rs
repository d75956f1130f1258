//! The machine in the planned readings: what a fit follows of a change, and what candidates make of the rest.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, DVector};

use super::noise::{PlannedNoise, Reweighing};
use super::strength::EffectState;
use crate::diagnose::PlaneUnbalances;
use crate::diagnose::base::{BaseModel, of_file};
use crate::error::Error;
use crate::fit::forward::ForwardModel;
use crate::fit::hypothesis::{Hypothesis, PlacedEffect};
use crate::fit::{Drawing, Effort, Fit, Fitter, starts_for};
use crate::machine::drawing::Noise;

type C = Complex<f64>;

/// Where the misfit of a fit differs from that of the linear model by less than this share, the optimum is the one next to the model.
const NEARLY_LINEAR: f64 = 0.1;

/// A machine in readings that it would give itself.
pub struct PlannedReadings<'a> {
    pub base: BaseModel<'a>,
    noise: Noise,
    /// Search coordinates that a diagnosis fits the model from, beside those of the fit.
    starts: [Vec<f64>; 2],
    /// What the readings without a change are judged by.
    stated_noise: Arc<PlannedNoise>,
    /// The readings as they are, and as the model predicts them, in noise units.
    readings: DVector<f64>,
    stated: DVector<f64>,
}

/// A change of the readings by an effect.
#[derive(Clone)]
pub struct Signal {
    /// What the changed readings are judged by.
    pub noise: Arc<PlannedNoise>,
    /// What nothing of the model follows: readings, whitened, then priors of the bearings.
    pub visible: DVector<f64>,
    /// The same with the model taken as linear around the machine as stated, which is where a candidate that imitates the effect
    /// well has its bearings.
    pub linear: DVector<f64>,
    /// Change of the readings relative to them, root mean square in noise units.
    pub change: f64,
}

impl<'a> PlannedReadings<'a> {
    /// Of the base model of readings that are the machine's own as its file states it, with this noise.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn of(base: BaseModel<'a>, noise: Noise) -> Result<Self, Error> {
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
        let readings = fitter.data.values().flat_map(|v| {
            let y = v.measured_m / v.sigma_m;
            [y.re, y.im]
        });
        let forward = fitter.forward(&base.hypothesis, drawing, &fit.amplitudes)?;
        let stated =
            forward.at(&fit.x, &fit.unknowns).ok_or(Error::SingularMachine { tried: "as stated" })?;
        drop(forward);
        let (_, [_, softer, stiffer]) = of_file(fitter)?;
        Ok(Self {
            stated,
            noise,
            starts: [softer, stiffer],
            stated_noise: Arc::new(PlannedNoise::stated(fitter, &base.hypothesis, fit, drawing, followed)),
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

    /// Root mean square of a change relative to the readings, in noise units.
    fn share(&self, change: &DVector<f64>) -> f64 {
        change.norm() / self.readings.norm().max(f64::MIN_POSITIVE)
    }

    /// The signal of a change of the readings, in noise units.
    pub fn signal(&self, change: DVector<f64>) -> Signal {
        let share = self.share(&change);
        let visible = self.visible(DMatrix::from_columns(&[change]));
        let visible = visible.column(0).into_owned();
        Signal { noise: self.stated_noise.clone(), linear: visible.clone(), visible, change: share }
    }

    /// The same where the model is fitted to the changed readings, which have the noise of their size: it follows large changes
    /// otherwise than small ones. `None` if that fit fails.
    pub fn signal_beside_fit(&self, change: &DVector<f64>) -> Option<Signal> {
        let BaseModel { fitter, hypothesis, search: (drawing, fit), .. } = &self.base;
        let (changed, Reweighing { before, after, ratios }) = self.changed(change);
        let amplitudes = Some(&fit.amplitudes);
        let stated = [fitter.missed(hypothesis, fit, drawing), self.signal(change.clone()).visible];
        let signal = |there: &Fit, after: Drawing| {
            let missed = changed.missed(hypothesis, there, &after);
            let reweighing = Reweighing { before: before.as_it_is(), after, ratios: ratios.clone() };
            let noise = Arc::new(self.stated_noise.changed(&changed, there, reweighing));
            let [before, linear] = (stated.each_ref())
                .map(|stated| noise.of_stated(&DMatrix::from_columns(std::slice::from_ref(stated))));
            let linear = noise.unfollowed(linear).column(0).into_owned();
            Signal { visible: missed - before.column(0), linear, change: self.share(change), noise }
        };
        let fitted = |starts: &[Vec<f64>], drawing: &Drawing| {
            changed.fit(hypothesis, starts, drawing, Effort::Rough, amplitudes).ok()
        };
        // the errors of the drawing follow as well, further than they are linear
        let followed = |there: Fit, drawing: &Drawing| -> Option<Signal> {
            let (there, own) =
                changed.on_common_optimum(hypothesis, &there, drawing, Effort::Rough, None).ok()?;
            Some(signal(&there, own))
        };
        let found = followed(fitted(std::slice::from_ref(&fit.x), &after)?, &after)?;
        if (&found.visible - &found.linear).norm() <= NEARLY_LINEAR * found.linear.norm() {
            return Some(found);
        }
        // a change that is large enough has several optima, and a diagnosis looks for them on the drawing as stated
        let [softer, stiffer] = &self.starts;
        let exact = changed.exact_drawing();
        let further = followed(fitted(&[fit.x.clone(), softer.clone(), stiffer.clone()], &exact)?, &exact)?;
        let cost = |signal: &Signal| signal.visible.norm_squared();
        Some(if cost(&further) < cost(&found) { further } else { found })
    }

    /// The same machine where the readings are changed, and their noise with them.
    fn changed(&self, change: &DVector<f64>) -> (Fitter<'a>, Reweighing) {
        let BaseModel { fitter, search: (drawing, _), .. } = &self.base;
        let changed = fitter.changed(change, &self.noise);
        let pairs = fitter.data.values().zip(changed.data.values());
        let ratios: Vec<f64> =
            pairs.flat_map(|(before, after)| [before.sigma_m / after.sigma_m; 2]).collect();
        let ratios = DVector::from_vec(ratios);
        let after: Drawing = drawing.reweighed(&ratios);
        (changed, Reweighing { before: drawing.as_it_is(), after, ratios })
    }

    /// What a candidate costs at its best where the readings are changed, fitted as a diagnosis does; `None` if that fails.
    pub fn loss_of_fitted(&self, placed: PlacedEffect, change: &DVector<f64>) -> Option<f64> {
        let BaseModel { fitter, hypothesis, search: (drawing, fit), .. } = &self.base;
        let ((changed, reweighing), with) = (self.changed(change), self.with(placed));
        let starts = starts_for(hypothesis, fit, placed);
        // the bearings of the fit are those of the file
        let starts: Vec<Vec<f64>> = starts.into_iter().step_by(2).collect();
        let amplitudes = Some(&fit.amplitudes);
        let there = changed.fit(&with, &starts, &reweighing.after, Effort::Rough, amplitudes).ok()?;
        let (there, own) =
            changed.on_common_optimum(&with, &there, &reweighing.after, Effort::Rough, None).ok()?;
        let missed = changed.missed(&with, &there, &own);
        let noise = self.stated_noise.changed(&changed, &there, Reweighing { after: own, ..reweighing });
        let before = noise.of_stated(&DMatrix::from_columns(&[fitter.missed(hypothesis, fit, drawing)]));
        Some(noise.loss(&(missed - before.column(0))))
    }

    /// Of changes of the readings, one a column, what nothing of the model follows.
    pub fn visible(&self, mut changes: DMatrix<f64>) -> DMatrix<f64> {
        self.base.search.0.whiten(&mut changes);
        self.unfollowed(changes)
    }

    /// The same of changes that are whitened.
    pub fn unfollowed(&self, whitened: DMatrix<f64>) -> DMatrix<f64> {
        let rows = whitened.nrows() + self.base.hypothesis.bearings.unknowns().len();
        self.stated_noise.unfollowed(whitened.resize_vertically(rows, 0.0))
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

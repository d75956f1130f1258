//! A model at its best fit, and every candidate tried on top of it.

use std::sync::Arc;

use nalgebra::DVector;

use super::as_file::as_file;
use super::parameters;
use crate::effects::{ALL, Effect, Place, Scales, entry};
use crate::error::Error;
use crate::fit::data::Data;
use crate::fit::hypothesis::{Hypothesis, PlacedEffect};
use crate::fit::{Drawing, Effort, Fit, Fitter};
use crate::machine::bearings::Bearings;
use crate::machine::drawing::Rotor;
use crate::statistics::scatter::Scatter;

/// A candidate with its fit.
#[derive(Clone)]
pub struct CandidateFit {
    pub placed: PlacedEffect,
    pub fit: Fit,
    /// For it over the model: twice the logarithm of the Bayes factor.
    pub evidence: f64,
    /// The same in the search, whose noise and drawing all candidates share.
    pub sought: f64,
    pub disqualified: Option<String>,
    /// The drawing's errors taken around this fit, where that was done.
    pub own_drawing: Option<Arc<Drawing>>,
    /// Whether noise and drawing's errors are both settled.
    pub is_settled: bool,
    /// The fit on its drawing before its noise was settled, where people see that one.
    pub in_stated_noise: Option<(Fit, Arc<Drawing>)>,
}

impl CandidateFit {
    pub fn drawing<'t>(&'t self, base: &'t BaseModel) -> &'t Drawing {
        self.own_drawing.as_deref().unwrap_or(&base.search.0)
    }

    /// The fit that people see, as [`BaseModel::shown`] has it.
    pub fn shown(&self) -> &Fit {
        self.in_stated_noise.as_ref().map_or(&self.fit, |(fit, _)| fit)
    }
}

/// A fit in the noise as stated.
pub struct FitInStatedNoise {
    /// Squared misfit in standard deviations as stated.
    pub chi2: f64,
    /// The fit and its drawing, where people see them. Of many models this would be most of the memory.
    seen: Option<(Fit, Arc<Drawing>)>,
}

impl FitInStatedNoise {
    /// Of a model whose noise is as stated, or is not asked for.
    pub fn as_it_is(fit: &Fit) -> Self {
        Self { chi2: fit.stated_chi2, seen: None }
    }

    /// Of a model whose noise was settled to its own after this fit.
    fn before(fit: Fit, drawing: Drawing, own: &Scatter) -> Self {
        let chi2 = fit.stated_chi2;
        Self { chi2, seen: own.is_most_correlated().then(|| (fit, Arc::new(drawing))) }
    }
}

/// The model of the file, fitted, and everything that candidates start from.
pub struct BaseModel<'a> {
    pub fitter: &'a Fitter<'a>,
    pub hypothesis: Hypothesis<'a>,
    /// How many of its effects the file states.
    pub stated: usize,
    pub drawing: Arc<Drawing>,
    pub fit: Fit,
    pub in_stated_noise: FitInStatedNoise,
    /// Where candidates are searched: noise as stated, errors of the drawing taken as linear around the drawing as
    /// stated; for the most probable noise and errors of a model that lacks something make up for what it lacks.
    pub search: (Drawing, Fit),
}

/// A fitted model apart from what it was fitted with.
pub struct FittedModel {
    bearings: Arc<Bearings>,
    scales: Scales,
    effects: Vec<PlacedEffect>,
    stated: usize,
    drawing: Arc<Drawing>,
    fit: Fit,
    in_stated_noise: FitInStatedNoise,
    search: (Drawing, Fit),
}

impl From<BaseModel<'_>> for FittedModel {
    fn from(base: BaseModel) -> Self {
        let BaseModel { hypothesis, stated, drawing, fit, in_stated_noise, search, .. } = base;
        let Hypothesis { bearings, scales, effects, .. } = hypothesis;
        Self { bearings, scales, effects, stated, drawing, fit, in_stated_noise, search }
    }
}

impl FittedModel {
    /// The model again, by what it was fitted with.
    pub fn of<'a>(self, fitter: &'a Fitter<'a>) -> BaseModel<'a> {
        let Self { bearings, scales, effects, stated, drawing, fit, in_stated_noise, search } = self;
        let hypothesis = Hypothesis { rotor: fitter.rotor, bearings, scales, effects };
        BaseModel { fitter, hypothesis, stated, drawing, fit, in_stated_noise, search }
    }
}

/// The model of a file as a hypothesis: its effects refitted along with bearings and planes, but for those of runs that
/// the data do not hold; and where to start from.
pub fn of_file<'a>(fitter: &Fitter<'a>) -> Result<(Hypothesis<'a>, [Vec<f64>; 3]), Error> {
    let rotor = fitter.rotor;
    let mut hypothesis = Hypothesis::drawn(rotor, fitter.scales(None));
    let mut x = hypothesis.bearings.stated();
    for e in &rotor.effect {
        let (effect, place) =
            entry::resolve(rotor, &e.kind, e.at.as_deref()).map_err(Error::UnknownEffect)?;
        if matches!(place, Place::Run(k) if !fitter.data.has_run(k)) {
            continue;
        }
        let values = entry::real_parameters(effect, e, &hypothesis.scales);
        let scaled = effect.parameters(&hypothesis.scales);
        x.extend(scaled.iter().zip(&values).map(|(p, v)| p.scale.from_si(*v)));
        hypothesis = hypothesis.with(PlacedEffect { effect, place });
    }
    let (bearings, effects) = x.split_at(hypothesis.bearings.count());
    let shifted = |stiffness: f64, damping: f64| {
        [&hypothesis.bearings.shifted(bearings, stiffness, damping), effects].concat()
    };
    let starts = [x.clone(), shifted(0.35, -0.35), shifted(-0.35, 0.35)];
    Ok((hypothesis, starts))
}

/// The fit of a hypothesis where candidates are searched.
struct SearchFit<'a> {
    hypothesis: Hypothesis<'a>,
    /// On the drawing as stated, with no allowance for its errors.
    fit: Fit,
    exact: Drawing,
    /// The drawing's errors taken as linear around the drawing as stated, and the fit with them.
    around: Drawing,
    there: Fit,
}

impl<'a> SearchFit<'a> {
    fn of(
        fitter: &Fitter<'a>,
        hypothesis: Hypothesis<'a>,
        starts: &[Vec<f64>],
        effort: Effort,
    ) -> Result<Self, Error> {
        let exact = fitter.exact_drawing();
        let hypothesis = Hypothesis { scales: fitter.scales(None), ..hypothesis };
        let rough = fitter.fit(&hypothesis, starts, &exact, effort, Some(&fitter.still()))?;
        let hypothesis = Hypothesis { scales: fitter.scales(Some(&rough)), ..hypothesis };
        let x = rescaled(
            &Hypothesis { scales: fitter.scales(None), ..hypothesis.clone() },
            &hypothesis,
            &rough.x,
        );
        let fit = fitter.fit(&hypothesis, &[x], &exact, effort, Some(&rough.amplitudes))?;
        let around = fitter.around_the_stated(&hypothesis, &fit)?;
        let start = [fit.x.clone()];
        let there = fitter.fit(&hypothesis, &start, &around, effort, Some(&fit.amplitudes))?;
        Ok(Self { hypothesis, fit, exact, around, there })
    }
}

impl<'a> BaseModel<'a> {
    /// Fits the model of the file: bearings, planes and its effects' parameters.
    pub fn fit(fitter: &'a Fitter<'a>) -> Result<Self, Error> {
        let (hypothesis, starts) = of_file(fitter)?;
        let (stated, effects) = (hypothesis.effects.len(), &starts[0][hypothesis.bearings.count()..]);
        let before = fitter.found_before.as_ref();
        let before = before.map(|found| ([&found.bearings, effects].concat(), found.deviation.clone()));
        let starts: Vec<Vec<f64>> = before.iter().map(|(x, _)| x).chain(&starts).cloned().collect();
        Self::fit_base(fitter, hypothesis, stated, &starts, before)
    }

    /// The model of the file where the readings are its own: nothing has to be sought.
    pub fn as_stated(fitter: &'a Fitter<'a>) -> Result<Self, Error> {
        let (hypothesis, [start, ..]) = of_file(fitter)?;
        let stated = hypothesis.effects.len();
        let SearchFit { hypothesis, fit, exact: drawing, around, there } =
            SearchFit::of(fitter, hypothesis, &[start], Effort::Search)?;
        let drawing = Arc::new(drawing);
        let in_stated_noise = FitInStatedNoise::as_it_is(&fit);
        Ok(Self { fitter, hypothesis, stated, drawing, fit, in_stated_noise, search: (around, there) })
    }

    /// Fits a hypothesis, of whose effects the file states the first so many, from these starts in the scales of the file, taking the
    /// drawing's errors anew around each fit; or from `before`, a start and errors of the drawing, where that explains the data better.
    pub fn fit_base(
        fitter: &'a Fitter<'a>,
        hypothesis: Hypothesis<'a>,
        stated: usize,
        starts: &[Vec<f64>],
        before: Option<(Vec<f64>, DVector<f64>)>,
    ) -> Result<Self, Error> {
        let file = Hypothesis { scales: fitter.scales(None), ..hypothesis.clone() };
        let SearchFit { hypothesis, fit, exact: mut drawing, around, there } =
            SearchFit::of(fitter, hypothesis, starts, Effort::Search)?;
        let mut fit = fit;
        if !fitter.drawing_is_exact() {
            let before = before.map(|(x, deviation)| (rescaled(&file, &hypothesis, &x), deviation));
            (fit, drawing) = fitter.on_common_optimum(&hypothesis, &fit, &drawing, Effort::Search, before)?;
        }
        let before = (fit.clone(), drawing.as_it_is());
        let (fit, drawing) = fitter.under_own_scatter(&hypothesis, fit, drawing);
        let in_stated_noise = FitInStatedNoise::before(before.0, before.1, &drawing.scatter());
        let drawing = Arc::new(drawing);
        Ok(Self { fitter, hypothesis, stated, drawing, fit, in_stated_noise, search: (around, there) })
    }

    /// The model with a candidate: from the candidate's own fit where its drawing errors are settled already, else from the file.
    pub fn grown(&self, t: &CandidateFit) -> Result<Self, Error> {
        self.unfitted_with(t).grown()
    }

    /// What the model with a candidate grows from.
    pub fn unfitted_with(&self, t: &CandidateFit) -> UnfittedModel<'a> {
        let Self { fitter, stated, .. } = *self;
        UnfittedModel { fitter, stated, with: self.hypothesis.with(t.placed), tried: t.clone() }
    }

    /// The model with a candidate at the fit of the search, which shows what further effects could explain: nothing is fitted anew.
    pub fn with_unsettled(&self, t: &CandidateFit) -> Self {
        let drawing = t.own_drawing.clone().unwrap_or_else(|| self.drawing.clone());
        Self {
            fitter: self.fitter,
            hypothesis: self.hypothesis.with(t.placed),
            stated: self.stated,
            in_stated_noise: FitInStatedNoise::as_it_is(&t.fit),
            drawing,
            fit: t.fit.clone(),
            search: (self.search.0.as_it_is(), t.fit.clone()),
        }
    }

    /// The model as far as candidates are sought beside it: of many models their own drawings would be most of the memory.
    pub fn for_search(self) -> Self {
        let (drawing, fit) = (Arc::new(self.search.0.as_it_is()), self.search.1.clone());
        Self { in_stated_noise: FitInStatedNoise::as_it_is(&fit), drawing, fit, ..self }
    }

    /// Search coordinates of the file: its bearings, and its effects as far as they have been fitted.
    pub fn hypothesis_start(&self) -> Vec<f64> {
        let bearings = &self.hypothesis.bearings;
        bearings.stated().into_iter().chain(self.fit.x[bearings.count()..].iter().copied()).collect()
    }

    /// Everything that can sit on this rotor and is not in the model.
    pub fn possible(&self) -> Vec<PlacedEffect> {
        let rotor = self.fitter.rotor;
        let present = |a: &PlacedEffect| self.hypothesis.effects.iter().any(|e| same(e, a));
        ALL.into_iter()
            .flat_map(|effect: &'static dyn Effect| {
                effect.places(rotor).into_iter().map(move |place| PlacedEffect { effect, place })
            })
            .filter(|a| !present(a) && self.is_seen(a))
            .collect()
    }

    /// Whether the data can hold an effect: one of a run needs readings of it and of another run that is as the planes
    /// have it, or it would be the planes themselves.
    fn is_seen(&self, a: &PlacedEffect) -> bool {
        let Place::Run(k) = a.place else { return true };
        let differs = |run| self.hypothesis.effects.iter().any(|e| e.place == Place::Run(run));
        let as_the_planes = |listed: Option<usize>| listed != Some(k) && !listed.is_some_and(differs);
        let data = &self.fitter.data;
        data.has_run(k) && data.rows.iter().any(|row| as_the_planes(row.listed))
    }

    /// Evidence for this model over another of the same file, in the search of each.
    pub fn sought_over(&self, other: &Self) -> f64 {
        let own = |base: &Self| self.fitter.cost_under_own_scatter(&base.search.1, &base.search.0);
        let unknowns = self.search.1.effect_unknowns - other.search.1.effect_unknowns;
        self.fitter.sizes.evidence(own(other) - own(self), unknowns)
    }

    /// Why physics does not allow an effect that the file does not state.
    pub fn beyond_physics(&self, with: &Hypothesis, fit: &Fit) -> Option<String> {
        parameters::of_each(with, fit)[self.stated..].iter().find_map(|p| parameters::beyond_physics(p))
    }

    /// Whether physics allows every effect that the file does not state.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn is_physical(&self) -> Result<bool, Error> {
        let mut fit = self.fit.clone();
        fit.covariance = self.fitter.covariance(&self.hypothesis, &fit, &self.drawing)?;
        Ok(self.beyond_physics(&self.hypothesis, &fit).is_none())
    }

    /// The fit that people see, and its drawing: that under its own noise, unless this is as correlated as noise can be. Such noise takes
    /// what the model lacks for its own, and the fit need not follow the readings any more.
    pub fn shown(&self) -> (&Fit, &Arc<Drawing>) {
        match &self.in_stated_noise.seen {
            Some((fit, drawing)) => (fit, drawing),
            None => (&self.fit, &self.drawing),
        }
    }

    /// The file of the fit that people see.
    pub fn written(&self) -> Rotor {
        let (fit, drawing) = self.shown();
        self.fitter.corrected(as_file(&self.hypothesis, fit), fit, drawing)
    }

    /// The model's fit by which people are told how far it is off: the one that is closer in noise as stated, for where
    /// something is missing the noise that is left is no measure.
    pub fn closest(&self) -> &Fit {
        let shown = self.shown().0;
        if shown.stated_chi2 <= self.search.1.stated_chi2 { shown } else { &self.search.1 }
    }

    /// sqrt(Σ|Y_model − Y|² / Σ|Y|²).
    pub fn relative_error(&self, fit: &Fit) -> f64 {
        relative_error(&self.fitter.data, fit)
    }
}

/// A model with a candidate before it is fitted, which does without the model that the candidate was sought beside.
pub struct UnfittedModel<'a> {
    fitter: &'a Fitter<'a>,
    stated: usize,
    with: Hypothesis<'a>,
    tried: CandidateFit,
}

impl<'a> UnfittedModel<'a> {
    /// As [`BaseModel::grown`].
    pub fn grown(self) -> Result<BaseModel<'a>, Error> {
        let Self { fitter, stated, with, tried: t } = self;
        let file = Hypothesis { scales: fitter.scales(None), ..with.clone() };
        let starts = [rescaled(&with, &file, &t.fit.x)];
        let Some(own) = t.own_drawing else {
            let base = BaseModel::fit_base(fitter, with, stated, &starts, None)?;
            let in_stated_noise = FitInStatedNoise::as_it_is(&base.fit);
            return Ok(BaseModel { in_stated_noise, ..base });
        };
        let (mut fit, drawing) = if t.is_settled {
            (t.fit, own)
        } else {
            let (fit, own) = fitter.under_own_scatter(&with, t.fit, own.as_it_is());
            (fit, Arc::new(own))
        };
        let SearchFit { hypothesis, around, there, .. } =
            SearchFit::of(fitter, with.clone(), &starts, Effort::Search)?;
        (fit.x, fit.covariance) = (rescaled(&with, &hypothesis, &fit.x), None);
        let in_stated_noise = FitInStatedNoise::as_it_is(&fit);
        let search = (around, there);
        Ok(BaseModel { fitter, hypothesis, stated, drawing, fit, in_stated_noise, search })
    }
}

/// Whether the noise that a model leaves can be the noise that was stated: within two standard deviations of how far
/// that is trusted, and neither as correlated nor as different from run to run as noise can be.
pub fn explains(scatter: &Scatter, base: &BaseModel) -> bool {
    let of_size = scatter.neg2_log_prior(base.fitter.stated_log_sd()) <= 4.0 || scatter.scale < 1.0;
    of_size && !scatter.is_at_edge()
}

/// sqrt(Σ|Y_model − Y|² / Σ|Y|²) of a fit.
fn relative_error(data: &Data, fit: &Fit) -> f64 {
    let misfit: f64 = data.values().zip(&fit.predicted_m).map(|(v, p)| (p - v.measured_m).norm_sqr()).sum();
    let all: f64 = data.values().map(|v| v.measured_m.norm_sqr()).sum();
    (misfit / all.max(f64::MIN_POSITIVE)).sqrt()
}

pub fn same(a: &PlacedEffect, b: &PlacedEffect) -> bool {
    a.effect.name() == b.effect.name() && a.place == b.place
}

/// Search coordinates of `from` in the scales of `to`.
fn rescaled(from: &Hypothesis, to: &Hypothesis, x: &[f64]) -> Vec<f64> {
    let (bearings, effects) = x.split_at(from.bearings.count());
    let pairs = from.parameters().into_iter().zip(to.parameters()).zip(effects);
    let own = pairs.map(|((old, new), v)| new.scale.from_si(old.scale.to_si(*v)));
    bearings.iter().copied().chain(own).collect()
}

//! Candidates beside a model: sought from several starts, and the best of them settled.

use std::sync::Arc;

use rayon::prelude::*;

use super::base::{BaseModel, CandidateFit, explains};
use super::explained::{ExplainedData, OtherExplanation};
use super::screening::{NoiseLimit, Screening};
use crate::effects::Place;
use crate::error::Error;
use crate::fit::hypothesis::PlacedEffect;
use crate::fit::{Effort, Fit, starts_for};
use crate::statistics::scatter::Scatter;
use crate::statistics::significance::NEGLIGIBLE;

/// Candidates whose drawing errors are settled together with them.
const REFINED: usize = 10;
/// Further candidates, which the search around the drawing as stated passes over.
const REFINED_ON_OWN_DRAWING: usize = 5;
/// Candidates whose drawing errors are settled before all others.
const SETTLED_FIRST: usize = 2;
/// Candidates that are fitted to all of many readings.
const LIKELY: usize = 16;

impl BaseModel<'_> {
    /// Every candidate on top of the model, strongest evidence first, those that physics rules out last.
    pub fn try_all(&self) -> Result<Vec<CandidateFit>, Error> {
        self.try_all_or(&mut || Ok(None))
    }

    /// The same where something else may explain the data: it is asked for where the likeliest candidates do not, and where it does, the
    /// search for those that are beyond doubt less probable ends early.
    pub fn try_all_or(&self, otherwise: OtherExplanation) -> Result<Vec<CandidateFit>, Error> {
        self.refined(self.attempts(usize::MAX)?, otherwise)
    }

    /// What may be worth adding to a model that has an effect already, strongest evidence first: of many readings, those candidates that
    /// are worth most on a part of them, with noise and drawing errors of the best settled.
    pub fn try_likely(&self) -> Result<Vec<CandidateFit>, Error> {
        self.refined(self.attempts(LIKELY)?, &mut || Ok(None))
    }

    /// The same candidates where the model or one of the likeliest explains the data. Where none does, the set still has to grow, and they are
    /// as [`Self::try_likely_unsettled`] has them.
    pub fn try_likely_settled_if_explained(&self) -> Result<Vec<CandidateFit>, Error> {
        let mut tried = self.attempts(LIKELY)?;
        strongest_first(&mut tried);
        let mut likeliest = tried[..SETTLED_FIRST.min(tried.len())].to_vec();
        let is_explained = explains(&self.drawing.scatter(), self)
            || self.on_own_drawings_below(&mut likeliest, None)?.is_some();
        if is_explained { self.refined(tried, &mut || Ok(None)) } else { self.unsettled(tried) }
    }

    /// The same candidates, compared in the noise and drawing of the search: enough to choose what is worth settling, which takes ten
    /// times as long where the drawing has tolerances.
    pub fn try_likely_unsettled(&self) -> Result<Vec<CandidateFit>, Error> {
        self.unsettled(self.attempts(LIKELY)?)
    }

    fn unsettled(&self, mut tried: Vec<CandidateFit>) -> Result<Vec<CandidateFit>, Error> {
        strongest_first(&mut tried);
        let many = REFINED.min(tried.len());
        // fits that stopped early can be far from what they are worth
        let finished: Result<Vec<CandidateFit>, Error> = tried[..many]
            .par_iter()
            .map(|t| self.tried(t.placed, std::slice::from_ref(&t.fit.x), Effort::Search))
            .collect();
        tried.splice(..many, finished?);
        strongest_first(&mut tried);
        Ok(tried)
    }

    /// Whether this model leaves no more than such noise, with errors of the drawing as far as they are linear around the stated one.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn leaves_only_noise(&self, noise: &Scatter) -> Result<bool, Error> {
        let fit = &self.search.1;
        let limit = self.noise_limit(noise)?;
        let start = std::slice::from_ref(&fit.x);
        Ok(limit.place_of_fit(self.fitter, &self.hypothesis, start, &fit.amplitudes).is_some())
    }

    /// The noise that a fit may leave, with errors of the drawing as far as they are linear around the stated one.
    fn noise_limit(&self, noise: &Scatter) -> Result<NoiseLimit, Error> {
        let fit = &self.search.1;
        let drawing = self.fitter.around_the_stated(&self.hypothesis, fit)?;
        Ok(NoiseLimit::of(noise, self.fitter, fit, &drawing))
    }

    /// Whether a candidate of those that are asked for exists beside which this model leaves no more than such noise, first on a part of the
    /// readings and then on all. Of few readings it is taken to exist, as the question takes as long there as to try all candidates.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn can_leave_only_noise_with(
        &self,
        noise: &Scatter,
        is_asked: &(dyn Fn(&PlacedEffect) -> bool + Sync),
    ) -> Result<bool, Error> {
        let mut possible = self.possible();
        possible.retain(is_asked);
        let places = possible.iter().map(|a| a.place);
        let Some(part) = Screening::beside(self.fitter, &self.hypothesis, &self.search.1, places)? else {
            return Ok(true);
        };
        let (on_part, on_all) = (part.noise_limit(noise), self.noise_limit(noise)?);
        let can = |a: PlacedEffect| {
            let with = self.hypothesis.with(a);
            let place = part.where_only_noise_is_left(&with, &self.starts(a), &on_part);
            let on_all = |x| on_all.place_of_fit(self.fitter, &with, &[x], &self.search.1.amplitudes);
            place.and_then(on_all).is_some()
        };
        Ok(possible.into_par_iter().any(can))
    }

    /// Fits of candidates; of many readings on a part first, and those of the `kept` that are worth most there on all. Those beyond
    /// [`LIKELY`] take a short run on all, as what they are worth need not be exact.
    fn attempts(&self, kept: usize) -> Result<Vec<CandidateFit>, Error> {
        let (screened, possible) = self.screened(self.possible());
        let progress = &self.fitter.progress;
        progress.plan(possible.len());
        let places = possible.iter().map(|a| a.place);
        let part = Screening::beside(self.fitter, &self.hypothesis, &self.search.1, places)?;
        let told = possible.into_par_iter().inspect(|_| progress.step());
        let mut tried: Vec<CandidateFit> = match part {
            None => told.filter_map(|a| self.attempt(a).ok()).collect(),
            Some(part) => {
                let look = |a: PlacedEffect| {
                    let (x, evidence) = part.best(&self.hypothesis.with(a), &self.starts(a)).ok()?;
                    Some((a, x, evidence))
                };
                let mut seen: Vec<(PlacedEffect, Vec<f64>, f64)> = told.filter_map(look).collect();
                seen.sort_by(|a, b| b.2.total_cmp(&a.2));
                seen.truncate(kept);
                let fit = |(rank, (a, x, _)): (usize, (PlacedEffect, Vec<f64>, f64))| {
                    let effort = if rank < LIKELY { Effort::Rough } else { Effort::Glance };
                    self.tried(a, &[x], effort).ok()
                };
                seen.into_par_iter().enumerate().filter_map(fit).collect()
            }
        };
        tried.extend(screened);
        Ok(tried)
    }

    /// Candidates with the best of them refined, strongest evidence first.
    fn refined(
        &self,
        mut tried: Vec<CandidateFit>,
        otherwise: OtherExplanation,
    ) -> Result<Vec<CandidateFit>, Error> {
        strongest_first(&mut tried);
        let mut many = REFINED.min(tried.len());
        self.fitter.progress.plan(many);
        let mut explained = self.on_own_drawings(&mut tried[..many], None, otherwise)?;
        if explained.as_ref().is_none_or(|by| by.least_evidence < 0.0) {
            let further = self.likely_on_own_drawing(&mut tried[many..]);
            self.fitter.progress.plan(further);
            explained =
                self.on_own_drawings(&mut tried[many..many + further], explained, &mut || Ok(None))?;
            many += further;
        }
        tried[..many].par_iter_mut().try_for_each(|t| {
            // the evidence of one that is beyond doubt less probable need not be exact
            if explained.as_ref().is_none_or(|by| t.evidence > by.least_evidence) {
                self.take_own_noise(t);
            }
            self.fitter.progress.step();
            self.finish(t)
        })?;
        self.seek_from_special_cases(&mut tried)?;
        // behind those whose noise and drawing errors were settled
        let (settled, rest): (Vec<_>, Vec<_>) = tried.iter_mut().partition(|t| t.own_drawing.is_some());
        let least = settled.iter().map(|t| t.evidence).fold(f64::INFINITY, f64::min);
        rest.into_iter().for_each(|t| t.evidence = t.evidence.min(least));
        strongest_first(&mut tried);
        Ok(tried)
    }

    /// Settles the drawing's errors together with each of these candidates, of which the likeliest come first. What the best of them, or
    /// something else, makes of the data, if it explains them.
    fn on_own_drawings(
        &self,
        tried: &mut [CandidateFit],
        before: Option<ExplainedData>,
        otherwise: OtherExplanation,
    ) -> Result<Option<ExplainedData>, Error> {
        // of an exact drawing nothing is settled that would be worth ending early
        let first = if self.fitter.drawing_is_exact() { tried.len() } else { SETTLED_FIRST.min(tried.len()) };
        let (first, rest) = tried.split_at_mut(first);
        let explained = match self.on_own_drawings_below(first, before)? {
            None => otherwise()?,
            by_candidate => by_candidate,
        };
        self.on_own_drawings_below(rest, explained)
    }

    /// The same, where the search ends early for candidates that are beyond doubt less probable than the one before.
    fn on_own_drawings_below(
        &self,
        tried: &mut [CandidateFit],
        before: Option<ExplainedData>,
    ) -> Result<Option<ExplainedData>, Error> {
        let most = before.as_ref().map_or(f64::INFINITY, |by| by.most);
        let noise: Result<Vec<Scatter>, Error> =
            tried.par_iter_mut().map(|t| self.take_own_drawing(t, most)).collect();
        let best = tried.iter().zip(noise?).max_by(|a, b| a.0.evidence.total_cmp(&b.0.evidence));
        let best = best.filter(|(_, noise)| explains(noise, self));
        let best = best.map(|(t, _)| ExplainedData::by(&t.fit, t.evidence));
        let all = best.into_iter().chain(before);
        Ok(all.max_by(|a, b| a.least_evidence.total_cmp(&b.least_evidence)))
    }

    /// The model can fit far better on the drawing errors of its own optimum than around the stated drawing. The search around the stated
    /// drawing then misses effects that show only with such errors, so candidates are sought with them too. The best few come first, with
    /// that drawing and their fit on it; the number of them is returned.
    fn likely_on_own_drawing(&self, tried: &mut [CandidateFit]) -> usize {
        let stated = self.fitter.cost_under_own_scatter(&self.search.1, &self.search.0);
        if self.fitter.drawing_is_exact() || stated - self.fit.cost < -2.0 * NEGLIGIBLE.ln() {
            return 0;
        }
        let count = self.hypothesis.bearings.count();
        let seek = |t: &CandidateFit| -> Option<(Fit, f64)> {
            // one of a run hardly moves the bearings, and shows on any drawing
            if matches!(t.placed.place, Place::Run(_)) {
                return None;
            }
            let start = [&self.fit.x[..count], &t.fit.x[count..]].concat();
            let with = self.hypothesis.with(t.placed);
            let amplitudes = Some(&self.fit.amplitudes);
            let fit = self.fitter.fit(&with, &[start], &self.drawing, Effort::Rough, amplitudes).ok()?;
            let evidence = self.fitter.evidence(&self.fit, &fit);
            Some((fit, evidence))
        };
        let sought: Vec<Option<(Fit, f64)>> = tried.par_iter().map(seek).collect();
        let evidence = |k: &usize| sought[*k].as_ref().map_or(f64::NEG_INFINITY, |(_, evidence)| *evidence);
        let mut order: Vec<usize> = (0..tried.len()).filter(|k| evidence(k) > 0.0).collect();
        order.sort_by(|a, b| evidence(b).total_cmp(&evidence(a)));
        order.truncate(REFINED_ON_OWN_DRAWING);
        let likely = order.len();
        for k in &order {
            if let Some((fit, _)) = &sought[*k] {
                (tried[*k].fit, tried[*k].own_drawing) = (fit.clone(), Some(self.drawing.clone()));
            }
        }
        tried.sort_by_key(|t| t.own_drawing.is_none());
        likely
    }

    /// An effect fits at least as well as its special case. An effect that fits worse, or that is not settled while its special case
    /// is, is sought again from the fit of the special case.
    fn seek_from_special_cases(&self, tried: &mut [CandidateFit]) -> Result<(), Error> {
        let start = |t: &CandidateFit| {
            let settled = tried.iter().filter(|s| s.is_settled);
            let special = settled.filter(|s| s.placed.is_case_of(&t.placed));
            let special = special.min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))?;
            let is_worse = !t.is_settled || t.fit.cost > special.fit.cost;
            let x = &special.fit.x;
            special.placed.as_general(&t.placed, &self.hypothesis.scales, x).filter(|_| is_worse)
        };
        let starts: Vec<Option<Vec<f64>>> = tried.iter().map(start).collect();
        tried.par_iter_mut().zip(starts).try_for_each(|(t, start)| {
            if let Some(start) = start {
                *t = self.settled(self.tried(t.placed, &[start], Effort::Rough)?)?;
            }
            Ok(())
        })
    }

    /// Of many candidates that are linear and act in one run alone, the best few are left to be fitted; the others come with a fit
    /// that solves for them alone. An effect of one run among many hardly moves the bearings, so that this is its evidence but for
    /// little.
    fn screened(&self, possible: Vec<PlacedEffect>) -> (Vec<CandidateFit>, Vec<PlacedEffect>) {
        let of_a_run = |a: &PlacedEffect| {
            matches!(a.place, Place::Run(_)) && a.effect.parameters(&self.hypothesis.scales).is_empty()
        };
        let (of_runs, mut left): (Vec<_>, Vec<_>) = possible.into_iter().partition(of_a_run);
        if of_runs.len() <= 2 * REFINED {
            left.extend(of_runs);
            return (Vec::new(), left);
        }
        let (_, base) = &self.search;
        let alone = |a| self.tried(a, std::slice::from_ref(&base.x), Effort::Linear).ok();
        let mut screened: Vec<CandidateFit> = of_runs.into_par_iter().filter_map(alone).collect();
        strongest_first(&mut screened);
        let rest = screened.split_off(REFINED.min(screened.len()));
        left.extend(screened.into_iter().map(|t| t.placed));
        (rest, left)
    }

    fn attempt(&self, placed: PlacedEffect) -> Result<CandidateFit, Error> {
        self.tried(placed, &self.starts(placed), Effort::Rough)
    }

    fn starts(&self, placed: PlacedEffect) -> Vec<Vec<f64>> {
        let starts = starts_for(&self.hypothesis, &self.search.1, placed);
        if self.hypothesis.effects.len() > self.stated {
            // with an effect in place the bearings are no longer driven off by what is missing: from there alone
            return starts.into_iter().step_by(2).collect();
        }
        starts
    }

    /// A candidate fitted from these starts.
    fn tried(
        &self,
        placed: PlacedEffect,
        starts: &[Vec<f64>],
        effort: Effort,
    ) -> Result<CandidateFit, Error> {
        let (drawing, base) = &self.search;
        let with = self.hypothesis.with(placed);
        let fit = self.fitter.fit(&with, starts, drawing, effort, Some(&base.amplitudes))?;
        let under_own = |fit: &Fit| self.fitter.cost_under_own_scatter(fit, drawing);
        let unknowns = fit.effect_unknowns - base.effect_unknowns;
        let evidence = self.fitter.sizes.evidence(under_own(base) - under_own(&fit), unknowns);
        Ok(CandidateFit {
            placed,
            evidence,
            sought: evidence,
            fit,
            disqualified: None,
            own_drawing: None,
            is_settled: false,
            in_stated_noise: None,
        })
    }

    /// A candidate fitted, its noise and drawing errors settled, with uncertainties.
    pub fn refined_attempt(&self, placed: PlacedEffect) -> Result<CandidateFit, Error> {
        let settled = |a| self.settled(self.attempt(a)?);
        let mut tried = vec![settled(placed)?];
        // a special case that cannot be fitted is no help, and no harm
        tried.extend(placed.special_cases().filter_map(|a| settled(a).ok()));
        self.seek_from_special_cases(&mut tried)?;
        Ok(tried.swap_remove(0))
    }

    /// A settled candidate with the fit that people see, and whether noise explains what it leaves.
    ///
    /// # Errors
    /// If the machine is singular at that fit.
    pub fn as_shown(&self, mut t: CandidateFit) -> Result<(CandidateFit, bool), Error> {
        let explained = explains(&t.drawing(self).scatter(), self);
        if let Some((fit, own)) = t.in_stated_noise.take() {
            (t.fit, t.own_drawing) = (fit, Some(own));
            self.finish(&mut t)?;
        }
        Ok((t, explained))
    }

    fn settled(&self, mut t: CandidateFit) -> Result<CandidateFit, Error> {
        self.take_own_drawing(&mut t, f64::INFINITY)?;
        self.take_own_noise(&mut t);
        self.finish(&mut t)?;
        Ok(t)
    }

    /// Settles drawing errors together with a candidate; its evidence is then that under the noise which it leaves, which is returned. A
    /// candidate that will not come below this cost is left at what it has.
    fn take_own_drawing(&self, t: &mut CandidateFit, most: f64) -> Result<Scatter, Error> {
        let with = self.hypothesis.with(t.placed);
        let (fit, own) = if self.fitter.drawing_is_exact() {
            let start = [t.fit.x.clone()];
            let drawing = self.fitter.exact_drawing();
            let amplitudes = Some(&t.fit.amplitudes);
            (self.fitter.fit(&with, &start, &drawing, Effort::Search, amplitudes)?, drawing)
        } else {
            self.fitter.on_common_optimum_below(most, &with, &t.fit, t.drawing(self), Effort::Search)?
        };
        let (noise, cost) = self.fitter.own_scatter(&fit, &own);
        // of no size at all, an effect costs nothing
        let gain = (self.fit.cost - cost).max(0.0);
        t.evidence = self.fitter.sizes.evidence(gain, fit.effect_unknowns - self.fit.effect_unknowns);
        (t.fit, t.own_drawing) = (fit, Some(Arc::new(own)));
        Ok(noise)
    }

    /// Settles noise and drawing errors together with a candidate whose drawing errors are settled under the noise as stated.
    fn take_own_noise(&self, t: &mut CandidateFit) {
        let with = self.hypothesis.with(t.placed);
        let (fit, own) = self.fitter.under_own_scatter(&with, t.fit.clone(), t.drawing(self).as_it_is());
        t.evidence = self.fitter.evidence(&self.fit, &fit);
        let is_most_correlated = own.scatter().is_most_correlated();
        let in_stated_noise = std::mem::replace(&mut t.fit, fit);
        let before = t.own_drawing.replace(Arc::new(own)).filter(|_| is_most_correlated);
        t.in_stated_noise = before.map(|before| (in_stated_noise, before));
        t.is_settled = true;
    }

    /// Adds uncertainties, and says whether physics allows the parameters.
    pub fn finish(&self, t: &mut CandidateFit) -> Result<(), Error> {
        let with = self.hypothesis.with(t.placed);
        t.fit.covariance = self.fitter.covariance(&with, &t.fit, t.drawing(self))?;
        t.disqualified = self.beyond_physics(&with, &t.fit);
        Ok(())
    }
}

fn strongest_first(tried: &mut [CandidateFit]) {
    let key = |t: &CandidateFit| if t.disqualified.is_some() { f64::NEG_INFINITY } else { t.evidence };
    tried.sort_by(|a, b| key(b).total_cmp(&key(a)).then(b.evidence.total_cmp(&a.evidence)));
}

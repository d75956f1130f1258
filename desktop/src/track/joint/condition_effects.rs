//! What conditions of operation change, from the smoothed coefficients of the covariates.

use nalgebra::{Complex, DVector};

use super::answer::{BearingEffect, ConditionEffect, LogChange, OtherEffect, PlaneEffect};
use super::conclude::SmoothedHistory;
use super::kalman::Gaussian;
use super::passes::JointProblem;
use crate::bearing::law::Role;
use crate::track::conditions::Covariate;

impl JointProblem {
    /// One for each covariate, whether it changes anything or not.
    pub(super) fn condition_effects(&self, found: &SmoothedHistory) -> Vec<ConditionEffect> {
        let all = self.covariates.iter().enumerate();
        all.map(|(c, covariate)| ConditionEffect {
            condition: covariate.condition.clone(),
            mean: covariate.mean,
            step: covariate.step,
            evidence: self.evidence.get(c).copied().unwrap_or(f64::NEG_INFINITY),
            bearings: self.bearing_effects(found, c, covariate),
            planes: self.plane_effects(found, c, covariate),
            other: found.other_part.as_ref().filter(|other| other.covariate == c).map(|other| OtherEffect {
                is_unbalance: other.is_unbalance,
                probability: 1.0 / (1.0 + (-other.log_odds).exp()),
            }),
        })
        .collect()
    }

    /// Component of the state with the coefficient of a covariate for another component.
    fn component(&self, covariate: usize, onto: usize) -> Option<usize> {
        let layout = &self.layout;
        let regressor = layout.regressors.iter().position(|r| (r.covariate, r.onto) == (covariate, onto))?;
        Some(layout.component_of(regressor))
    }

    fn bearing_effects(
        &self,
        found: &SmoothedHistory,
        c: usize,
        covariate: &Covariate,
    ) -> Vec<BearingEffect> {
        let Some(last) = found.smoothed.last() else { return Vec::new() };
        let Some(point) = self.own().last().map(|(_, day)| &day.point) else { return Vec::new() };
        let logs = self.layout.logs(&last.mean);
        let scale = covariate.step / covariate.scale;
        let of = |i: usize| self.component(c, self.layout.bearings() + i);
        let one = |bearing: usize| {
            let own = |i: &usize| self.layout.numbers[*i].bearing == bearing;
            let own: Vec<(usize, usize)> =
                (0..self.layout.coefficients()).filter(own).filter_map(|i| Some((i, of(i)?))).collect();
            let [numbers, components]: [Vec<usize>; 2] =
                [own.iter().map(|(i, _)| *i).collect(), own.iter().map(|(_, at)| *at).collect()];
            let mean = |role: Role| {
                let slopes = point.direct_slopes(bearing, role, &logs, &numbers);
                change(last, components.iter().copied().zip(slopes), scale)
            };
            (!own.is_empty()).then(|| BearingEffect {
                bearing,
                stiffness: mean(Role::Stiffness),
                damping: mean(Role::Damping),
                coefficients: own.iter().map(|(i, at)| (*i, change(last, [(*at, 1.0)], scale))).collect(),
            })
        };
        (0..self.bearings).filter_map(one).collect()
    }

    fn plane_effects(&self, found: &SmoothedHistory, c: usize, covariate: &Covariate) -> Vec<PlaneEffect> {
        let last = self.own().last().and_then(|(k, day)| Some((found.smoothed.get(k)?, day)));
        let Some((state, day)) = last else { return Vec::new() };
        let scale = covariate.step / covariate.scale;
        let here = self.layout.under(state.mean.clone(), &day.conditions);
        let one = |plane: usize| {
            let [re, im] = [self.component(c, 2 * plane)?, self.component(c, 2 * plane + 1)?];
            let slope = self.layout.planes[plane].slope(self.layout.coordinate(&here, plane));
            let variance = 0.5 * (state.covariance[(re, re)] + state.covariance[(im, im)]);
            Some(PlaneEffect {
                plane,
                change_kg_m: slope * Complex::new(state.mean[re], state.mean[im]) * scale,
                sd_kg_m: slope.norm() * variance.max(0.0).sqrt() * scale,
            })
        };
        (0..self.layout.planes.len()).filter_map(one).collect()
    }
}

/// Sum of some components of a state, each with its weight, times a scale.
fn change(state: &Gaussian, parts: impl IntoIterator<Item = (usize, f64)>, scale: f64) -> LogChange {
    let mut weights = DVector::zeros(state.mean.len());
    parts.into_iter().for_each(|(at, weight)| weights[at] = scale * weight);
    let variance = weights.dot(&(&state.covariance * &weights));
    LogChange { log: weights.dot(&state.mean), sd: variance.max(0.0).sqrt() }
}

//! A fit under the scatter that its own residuals show.

use nalgebra::DMatrix;

use super::hypothesis::Hypothesis;
use super::{Drawing, Fit, Fitter};
use crate::statistics::between_runs::RunErrors;
use crate::statistics::scatter::Scatter;
use crate::statistics::whitening::Whitening;

/// Rounds of fit and scatter: each bends the other a little.
const ROUNDS: usize = 3;

impl Fitter<'_> {
    /// Fits anew, from a fit, under the most probable scatter of its residuals. The search begins from what the rotor's file
    /// remembers of an earlier one; the prior stays centred at the noise as stated, so that no data count twice.
    /// The last fit stands where the machine is singular in the noise that it leaves.
    pub fn under_own_scatter(&self, hypothesis: &Hypothesis, fit: Fit, drawing: Drawing) -> (Fit, Drawing) {
        let (mut fit, mut drawing) = (fit, drawing);
        let mut remembered = self.rotor.noise.map(|noise| noise.scatter()).filter(|s| *s != Scatter::STATED);
        for _ in 0..ROUNDS {
            let about = self.about(&drawing.whitening, &fit);
            let most_probable = || about.most_probable_scatter(&fit.weighted, fit.unknown_count()).0;
            let found = remembered.take().unwrap_or_else(most_probable);
            if found.is_near(&drawing.scatter()) {
                break;
            }
            let in_it = drawing.under(about.scattered(found));
            // the drawing's errors with it: held linear, they turn a straight valley into a bent one that takes many steps
            let Ok(next) = self.on_nearby_common_optimum(hypothesis, &fit, in_it) else { break };
            (fit, drawing) = next;
        }
        (fit, drawing)
    }

    /// [`Fit::cost`] as it would be under the most probable scatter of its residuals, bearings and effects as they are.
    pub fn cost_under_own_scatter(&self, fit: &Fit, drawing: &Drawing) -> f64 {
        self.own_scatter(fit, drawing).1
    }

    /// The most probable scatter of the residuals of a fit, and [`Fit::cost`] as it would be under it, bearings and effects as they are.
    pub fn own_scatter(&self, fit: &Fit, drawing: &Drawing) -> (Scatter, f64) {
        let prior = fit.cost - fit.chi2 - drawing.whitening.cost();
        let about = self.about(&drawing.whitening, fit);
        let (scatter, cost) = about.most_probable_scatter(&fit.weighted, fit.unknown_count());
        (scatter, prior + cost)
    }

    /// Squared misfit of a fit in standard deviations of another noise, the fit as it is.
    pub fn chi2_under(&self, fit: &Fit, drawing: &Drawing, noise: Scatter) -> f64 {
        let about = self.about(&drawing.whitening, fit).scattered(noise);
        about.apply_with(&DMatrix::zeros(fit.weighted.len(), 0), &fit.weighted).1.norm_squared()
    }

    /// A drawing in this noise, of which the scatter between runs is of what this fit predicts.
    pub fn drawing_in_noise(&self, drawing: &Drawing, fit: &Fit, noise: Scatter) -> Drawing {
        drawing.under(self.about(&drawing.whitening, fit).scattered(noise))
    }

    /// Noise whose scatter between runs is of what this fit predicts.
    pub(super) fn about(&self, whitening: &Whitening, fit: &Fit) -> Whitening {
        whitening.about(RunErrors::new(&self.data.runs_and_sigmas(), &fit.predicted_m))
    }
}

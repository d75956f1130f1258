//! A fit under the scatter that its own residuals show.

use super::data::Amplitudes;
use super::hypothesis::Hypothesis;
use super::{Drawing, Effort, Fit, Fitter};
use crate::error::Error;

/// Rounds of fit and scatter: each bends the other a little.
const ROUNDS: usize = 3;

impl Fitter<'_> {
    /// Fits anew, from a fit, under the most probable scatter of its residuals.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn under_own_scatter(
        &self,
        hypothesis: &Hypothesis,
        fit: Fit,
        drawing: Drawing,
    ) -> Result<(Fit, Drawing), Error> {
        let (mut fit, mut drawing) = (fit, drawing);
        for _ in 0..ROUNDS {
            let (found, _) = drawing.whitening.most_probable_scatter(&fit.weighted, fit.unknown_count());
            if found.is_near(&drawing.scatter()) {
                break;
            }
            drawing = drawing.under(drawing.whitening.scattered(found));
            let amplitudes: Option<&Amplitudes> = Some(&fit.amplitudes);
            fit = self.fit(hypothesis, &[fit.x.clone()], &drawing, Effort::Search, amplitudes)?;
        }
        Ok((fit, drawing))
    }

    /// [`Fit::cost`] as it would be under the most probable scatter of its residuals, bearings and effects as they are.
    pub fn cost_under_own_scatter(&self, fit: &Fit, drawing: &Drawing) -> f64 {
        let prior = fit.cost - fit.chi2 - drawing.whitening.cost();
        prior + drawing.whitening.most_probable_scatter(&fit.weighted, fit.unknown_count()).1
    }
}

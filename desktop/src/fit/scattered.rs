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
    /// Where the search under a scatter ends at a singular machine, the fit before it stands.
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
            let scattered = drawing.under(about.scattered(found));
            // the drawing's errors with it: held linear, they turn a straight valley into a bent one that takes many steps
            let Ok(next) = self.on_nearby_common_optimum(hypothesis, &fit, scattered) else { break };
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

#[cfg(test)]
mod tests {
    use crate::fit::data::Data;
    use crate::fit::hypothesis::Hypothesis;
    use crate::fit::{Effort, Fitter};
    use crate::machine::drawing::Noise;
    use crate::simulate::{SimulationRequest, simulate};
    use crate::statistics::scatter::Scatter;
    use crate::testing::sample_rotor;

    #[test]
    fn fit_stands_where_search_under_own_scatter_is_singular() {
        let stated =
            Noise { relative: 0.01, floor_um: 0.05, scale: None, correlation: None, between_runs: None };
        let twice = Noise { relative: 0.02, floor_um: 0.1, ..stated };
        let rotor = sample_rotor();
        let speeds_rpm = (0..40).map(|k| 600.0 + 200.0 * f64::from(k)).collect();
        let request = SimulationRequest { speeds_rpm, noise: Some(twice), seed: 3, ..Default::default() };
        let readings = simulate(&rotor, &request).unwrap().readings;
        let fitter = Fitter::new(&rotor, Data::new(&rotor, &stated, &readings));
        let model = Hypothesis::drawn(&rotor, fitter.scales(None));
        let start = [model.bearings.stated()];
        let fit = fitter.fit(&model, &start, &fitter.exact_drawing(), Effort::Search, None).unwrap();
        let (found, drawing) = fitter.under_own_scatter(&model, fit.clone(), fitter.exact_drawing());
        assert!((1.6..2.4).contains(&drawing.scatter().scale), "{:?}", drawing.scatter());
        assert!(found.chi2 < 0.5 * fit.chi2);
        // no machine answers on bearings that are no numbers
        let mut lost = fit.clone();
        lost.x.iter_mut().for_each(|x| *x = f64::NAN);
        let (found, drawing) = fitter.under_own_scatter(&model, lost, fitter.exact_drawing());
        assert_eq!((found.chi2, found.weighted), (fit.chi2, fit.weighted));
        assert_eq!(drawing.scatter(), Scatter::STATED);
    }
}

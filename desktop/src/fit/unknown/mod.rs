//! What is not in the list: an unknown force on the shaft, an unknown dynamic stiffness, a drawing that is off.
//!
//! Whatever a model lacks acts on the shaft as a force: the equivalent load of Markert, Platz and Seidler (Shock and
//! Vibration 2001, 8, 379) and of Bachschmid, Pennacchi and Vania (J. Sound Vib. 2002, 254, 327), found by least squares
//! in the frequency domain. Here it has a Gaussian prior: a sum of smooth functions of speed with independent factors
//! of one unknown size. So it is allowed for like errors of the drawing are, its size is
//! the one that explains the data best, and what it costs to be so free is part of its evidence. A dynamic stiffness is a
//! force that follows the motion there, to first order that of the model.

mod assumption;
mod functions;
mod screening;

use nalgebra::{Complex, DVector};

use super::hypothesis::Hypothesis;
use super::{Drawing, Effort, Fit, Fitter, singular};
use crate::error::Error;
use crate::machine::tolerance::Deviations;
use crate::statistics::scatter::Scatter;
use crate::statistics::whitening::Whitening;
pub use assumption::Assumption;
use assumption::AssumptionResponse;

type C = Complex<f64>;

/// Rounds over size, noise and fit.
const ROUNDS: usize = 5;

/// An unknown cause found beside a hypothesis.
#[derive(Debug, Clone)]
pub struct UnknownFit {
    pub assumption: Assumption,
    /// The hypothesis fitted anew beside it; its cost includes the freedom of what was assumed.
    pub fit: Fit,
    /// The noise that is left.
    pub scatter: Scatter,
    /// Most probable values of the real unknowns.
    pub unknowns: DVector<f64>,
    /// How many of them the data determine rather than their prior.
    pub determined: f64,
    /// Speed of each reading, rad/s, and the force at each place then, N: forward, backward.
    pub forces_n: Vec<(f64, Vec<[C; 2]>)>,
}

impl Fitter<'_> {
    /// Fits a hypothesis with an unknown cause beside it.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn with_unknown(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        assumption: &Assumption,
    ) -> Result<UnknownFit, Error> {
        let mut fit = fit.clone();
        let mut noise = self.about(&drawing.whitening, &fit).scattered(Scatter::STATED);
        let mut size: Option<f64> = None;
        let mut best: Option<UnknownFit> = None;
        for round in 0..ROUNDS {
            let shown =
                self.shown(hypothesis, &fit, drawing, std::slice::from_ref(assumption))?.swap_remove(0);
            let now = size.unwrap_or_else(|| first_size(&fit, &shown.response));
            let with = drawing.under(noise.with(&(&shown.response * now)));
            fit = self.fit(hypothesis, &[fit.x.clone()], &with, Effort::Search, Some(&fit.amplitudes))?;
            if best.as_ref().is_none_or(|b| fit.cost < b.fit.cost) {
                best = Some(found(assumption, &shown, now, &fit, &with.whitening));
            }
            size = Some(now * with.whitening.growth(&fit.weighted, shown.response.ncols()));
            if round > 0 {
                let found = with.whitening.most_probable_scatter(&fit.weighted, fit.unknown_count()).0;
                noise = noise.scattered(found);
            }
        }
        best.ok_or_else(singular)
    }
}

impl Fitter<'_> {
    /// The error of the drawing that is most beyond its tolerance among these, the real unknowns of [`Assumption::Drawing`]:
    /// in words, and where, m from the left end.
    pub fn worst_of_drawing(&self, unknowns: &DVector<f64>) -> (String, f64) {
        self.suspected_deviations().worst(self.rotor, unknowns)
    }

    /// What can be wrong in the drawing: what its tolerance says, or what is usual where it states none.
    fn suspected_deviations(&self) -> Deviations {
        if self.deviations.is_empty() { Deviations::usual(self.rotor) } else { self.deviations.clone() }
    }
}

/// What an assumption comes to at a fit under `whitening`, of which it is the last part.
fn found(
    assumption: &Assumption,
    shown: &AssumptionResponse,
    size: f64,
    fit: &Fit,
    whitening: &Whitening,
) -> UnknownFit {
    let (deviations, count) = (whitening.estimate(&fit.weighted), shown.response.ncols());
    let unknowns = deviations.rows(deviations.len() - count, count) * size;
    let places = assumption.positions_m().len();
    let at = |(speed_rad_s, terms): &(f64, Vec<assumption::Term>)| {
        let mut force_n = vec![[C::from(0.0); 2]; places];
        for (j, t) in terms.iter().enumerate() {
            force_n[t.place][t.sense] += t.factor * C::new(unknowns[2 * j], unknowns[2 * j + 1]);
        }
        (*speed_rad_s, force_n)
    };
    UnknownFit {
        assumption: assumption.clone(),
        fit: fit.clone(),
        scatter: whitening.scatter(),
        forces_n: shown.forces.iter().map(at).collect(),
        determined: whitening.determined(count),
        unknowns,
    }
}

/// A size at which what is assumed explains about what the fit leaves beyond its noise.
fn first_size(fit: &Fit, response: &nalgebra::DMatrix<f64>) -> f64 {
    let beyond = (fit.stated_chi2 - fit.values as f64).max(1.0);
    (beyond / response.norm_squared().max(f64::MIN_POSITIVE)).sqrt()
}

//! The drawing around what a fit says of its errors.
//!
//! A fit on the wrong drawing bends the bearings to make up for it, and the errors that it leaves are far
//! from linear. So the errors are sought together with bearings and effects, each with its prior; only
//! around that common optimum are they taken as linear.

use nalgebra::{DMatrix, DVector};

use super::data::Amplitudes;
use super::descent::{Objective, Stop, descend};
use super::drawing_errors::DrawingErrors;
use super::hypothesis::Hypothesis;
use super::problem::Problem;
use super::{Drawing, Effort, Fit, Fitter, singular};
use crate::error::Error;
use crate::machine::drawing::Physics;
use crate::statistics::whitening::Whitening;

/// When the common optimum is found.
const COMMON: Stop = Stop { steps: 60, tolerance: 1e-6 };

impl Fitter<'_> {
    /// The drawing around the most probable errors under a hypothesis, sought from a fit; as stated where it
    /// is exact.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    #[cfg(test)]
    pub fn relinearised(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<Drawing, Error> {
        Ok(self.common_optimum(hypothesis, fit, drawing)?.1)
    }

    /// The drawing as stated, its errors allowed for as far as they are linear around a fit: where to look for
    /// what is missing before anything is known of them. The most probable errors of a wrong hypothesis are
    /// far off, as they make up for what it lacks.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn around_the_stated(&self, hypothesis: &Hypothesis, fit: &Fit) -> Result<Drawing, Error> {
        if self.deviations.is_empty() {
            return Ok(self.exact_drawing());
        }
        let stated = DVector::zeros(self.deviations.len());
        let physics = hypothesis.terms(&fit.x).physics;
        let mut at = JointProblem {
            fitter: self,
            hypothesis,
            amplitudes: &fit.amplitudes,
            physics,
            noise: &self.plain,
            at: DVector::zeros(0),
            now: None,
        };
        at.move_to(&DVector::from_iterator(
            fit.x.len() + stated.len(),
            fit.x.iter().chain(stated.iter()).copied(),
        ));
        Ok(at.linear()?.1)
    }

    /// The most probable errors of the drawing under a hypothesis, sought from a fit, and the fit on them.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn on_common_optimum(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        effort: Effort,
    ) -> Result<(Fit, Drawing), Error> {
        let (x, settled) = self.common_optimum(hypothesis, fit, drawing)?;
        let fit = self.fit(hypothesis, &[x], &settled, effort, Some(&fit.amplitudes))?;
        Ok((fit, settled))
    }

    fn common_optimum(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<(Vec<f64>, Drawing), Error> {
        if self.deviations.is_empty() {
            return Ok((fit.x.clone(), drawing.under(drawing.whitening.of_scatter())));
        }
        let physics = hypothesis.terms(&fit.x).physics;
        let noise = drawing.whitening.of_scatter();
        let mut best = JointProblem {
            fitter: self,
            hypothesis,
            amplitudes: &fit.amplitudes,
            physics,
            noise: &noise,
            at: DVector::zeros(0),
            now: None,
        };
        // what is linear around another drawing can foretell errors that no shaft can have
        let foretold =
            drawing.whitening.estimate(&fit.weighted).resize_vertically(self.deviations.len(), 0.0);
        let stated = DVector::zeros(self.deviations.len());
        let values = [foretold, drawing.deviation.clone(), stated].into_iter().map(|deviation| {
            let at = fit.x.iter().chain(deviation.iter()).copied();
            let at = DVector::from_iterator(fit.x.len() + deviation.len(), at);
            best.move_to(&at);
            (best.value(), at)
        });
        let lowest = values.min_by(|a, b| a.0.total_cmp(&b.0)).ok_or_else(singular)?;
        best.move_to(&lowest.1);
        descend(&mut best, COMMON);
        best.linear()
    }
}

/// Bearings, effects and errors of the drawing together: search coordinates, then errors in standard
/// deviations.
struct JointProblem<'p> {
    fitter: &'p Fitter<'p>,
    hypothesis: &'p Hypothesis<'p>,
    amplitudes: &'p Amplitudes,
    physics: Physics,
    noise: &'p Whitening,
    at: DVector<f64>,
    now: Option<Problem<'p>>,
}

impl JointProblem<'_> {
    fn parts(&self) -> (Vec<f64>, DVector<f64>) {
        let n = self.hypothesis.size();
        (self.at.as_slice()[..n].to_vec(), self.at.rows(n, self.at.len() - n).into_owned())
    }

    /// Where it stands, and the drawing with its errors taken as linear there.
    fn linear(&self) -> Result<(Vec<f64>, Drawing), Error> {
        let (x, deviation) = self.parts();
        let now = self.now.as_ref().ok_or_else(singular)?;
        let jacobian = self.deviation_derivative(now, &deviation).ok_or_else(singular)?;
        let noise = self.noise.with(&jacobian).around(deviation.clone());
        Ok((x, Drawing::new(deviation, noise)))
    }

    fn deviation_derivative(&self, now: &Problem, deviation: &DVector<f64>) -> Option<DMatrix<f64>> {
        let (rotor, shaft) = (self.fitter.rotor, self.fitter.shaft(&self.physics));
        now.error_derivative(&DrawingErrors::new(rotor, shaft, &self.fitter.deviations, deviation))
    }
}

impl Objective for JointProblem<'_> {
    fn position(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn move_to(&mut self, at: &DVector<f64>) {
        self.at = at.clone();
        let (x, deviation) = self.parts();
        let plant = self.fitter.plant(&deviation, &self.physics);
        let problem = |p| self.fitter.problem(self.hypothesis, p, Some(self.amplitudes), self.noise);
        self.now = plant.ok().map(problem);
        if let Some(now) = &mut self.now {
            now.go_to(&x);
        }
    }

    fn value(&self) -> f64 {
        self.now.as_ref().map_or(f64::INFINITY, |now| now.cost() + self.parts().1.norm_squared())
    }

    fn normal_equations(&self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (now, (x, deviation)) = (self.now.as_ref()?, self.parts());
        let by_error = self.deviation_derivative(now, &deviation)?;
        let (mut gram, mut slope) = now.joint_normal_equations(&by_error)?;
        for (j, t) in deviation.iter().enumerate() {
            gram[(x.len() + j, x.len() + j)] += 1.0;
            slope[x.len() + j] += t;
        }
        Some((gram, slope))
    }
}

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
use super::{Drawing, Effort, Fit, Fitter, ShaftKind, singular};
use crate::error::Error;
use crate::statistics::whitening::Whitening;

/// When the common optimum is found.
const COMMON: Stop = Stop::after(60, 1e-6).in_standard_deviations();
/// When what it costs is known roughly.
const COMMON_ROUGHLY: Stop = Stop::after(60, 1e-4).in_tenths_of_standard_deviations();
/// The same from the optimum under another noise.
const NEARBY: Stop = COMMON.nearby();

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
        Ok(self.common_optimum(COMMON, hypothesis, fit, drawing, None)?.1)
    }

    /// The drawing as stated, its errors allowed for as far as they are linear around a fit: where to look for
    /// what is missing before anything is known of them. The most probable errors of a wrong hypothesis are
    /// far off, as they make up for what it lacks.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn around_the_stated(&self, hypothesis: &Hypothesis, fit: &Fit) -> Result<Drawing, Error> {
        if self.drawing_is_exact() {
            return Ok(self.exact_drawing());
        }
        let mut at = JointProblem::new(self, hypothesis, fit, &self.plain);
        at.move_to(&position(&fit.x, &DVector::zeros(self.deviations.len())));
        at.linear()
    }

    /// The most probable errors of the drawing under a hypothesis, sought from a fit, and the fit on them. The search begins from
    /// `before`, search coordinates and errors in standard deviations, where that explains the data better.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn on_common_optimum(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        effort: Effort,
        before: Option<(Vec<f64>, DVector<f64>)>,
    ) -> Result<(Fit, Drawing), Error> {
        let stop = if effort == Effort::Rough { COMMON_ROUGHLY } else { COMMON };
        let (x, settled) = self.common_optimum(stop, hypothesis, fit, drawing, before)?;
        let fit = self.fit(hypothesis, &[x], &settled, effort, Some(&fit.amplitudes))?;
        Ok((fit, settled))
    }

    /// The same for somebody who wants no fit above this cost of data, bearings and drawing: a search that will not come below it ends
    /// early, at what it has.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn on_common_optimum_below(
        &self,
        most: f64,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        effort: Effort,
    ) -> Result<(Fit, Drawing), Error> {
        let (x, settled) = self.common_optimum(COMMON.below(most), hypothesis, fit, drawing, None)?;
        let fit = self.fit(hypothesis, &[x], &settled, effort, Some(&fit.amplitudes))?;
        Ok((fit, settled))
    }

    /// The same from the optimum under another noise, whose errors of the drawing these are. They stay where they are if the machine
    /// is singular where the noise leads them, as it can be with few readings.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn on_nearby_common_optimum(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: Drawing,
    ) -> Result<(Fit, Drawing), Error> {
        let fitted = |x: Vec<f64>, drawing: &Drawing| {
            self.fit(hypothesis, &[x], drawing, Effort::Search, Some(&fit.amplitudes))
        };
        let moved = || -> Option<(Fit, Drawing)> {
            let noise = drawing.whitening.of_scatter();
            let mut at = JointProblem::new(self, hypothesis, fit, &noise);
            at.move_to(&position(&fit.x, &drawing.deviation));
            at.by_error = Some((at.at.clone(), drawing.whitening.by_deviation().clone()));
            descend(&mut at, NEARBY);
            let settled = at.linear().ok()?;
            Some((fitted(at.parts().0, &settled).ok()?, settled))
        };
        if !self.drawing_is_exact()
            && let Some(found) = moved()
        {
            return Ok(found);
        }
        Ok((fitted(fit.x.clone(), &drawing)?, drawing))
    }

    fn common_optimum(
        &self,
        stop: Stop,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        before: Option<(Vec<f64>, DVector<f64>)>,
    ) -> Result<(Vec<f64>, Drawing), Error> {
        if self.drawing_is_exact() {
            return Ok((fit.x.clone(), drawing.under(drawing.whitening.of_scatter())));
        }
        let noise = drawing.whitening.of_scatter();
        let mut best = JointProblem::new(self, hypothesis, fit, &noise);
        // what is linear around another drawing can foretell errors that no shaft can have
        let foretold =
            drawing.whitening.estimate(&fit.weighted).resize_vertically(self.deviations.len(), 0.0);
        let stated = DVector::zeros(self.deviations.len());
        let mut starts: Vec<DVector<f64>> = Vec::new();
        let at_fit =
            [foretold, drawing.deviation.clone(), stated].map(|deviation| position(&fit.x, &deviation));
        for start in at_fit.into_iter().chain(before.map(|(x, deviation)| position(&x, &deviation))) {
            if !starts.contains(&start) {
                starts.push(start);
            }
        }
        let visits: Vec<(f64, DVector<f64>, Option<Problem>)> = (starts.iter())
            .map(|start| {
                best.move_to(start);
                (best.value(), best.at.clone(), best.now.take())
            })
            .collect();
        let lowest = visits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).ok_or_else(singular)?;
        (best.at, best.now) = (lowest.1, lowest.2);
        descend(&mut best, stop);
        Ok((best.parts().0, best.linear()?))
    }
}

/// Search coordinates, then errors in standard deviations.
fn position(x: &[f64], deviation: &DVector<f64>) -> DVector<f64> {
    DVector::from_iterator(x.len() + deviation.len(), x.iter().chain(deviation.iter()).copied())
}

/// Bearings, effects and errors of the drawing together: search coordinates, then errors in standard
/// deviations.
struct JointProblem<'p> {
    fitter: &'p Fitter<'p>,
    hypothesis: &'p Hypothesis<'p>,
    amplitudes: &'p Amplitudes,
    shaft: ShaftKind,
    noise: &'p Whitening,
    at: DVector<f64>,
    now: Option<Problem<'p>>,
    /// Where it was taken last, and change of the model per standard deviation of each error: it takes as long as several moves.
    by_error: Option<(DVector<f64>, DMatrix<f64>)>,
}

impl<'p> JointProblem<'p> {
    /// With supports that depend on amplitudes at those of a fit.
    fn new(
        fitter: &'p Fitter<'p>,
        hypothesis: &'p Hypothesis<'p>,
        fit: &'p Fit,
        noise: &'p Whitening,
    ) -> Self {
        let (amplitudes, shaft) = (&fit.amplitudes, ShaftKind::of(&hypothesis.terms(&fit.x)));
        let at = DVector::zeros(0);
        Self { fitter, hypothesis, amplitudes, shaft, noise, at, now: None, by_error: None }
    }

    fn parts(&self) -> (Vec<f64>, DVector<f64>) {
        let n = self.hypothesis.size();
        (self.at.as_slice()[..n].to_vec(), self.at.rows(n, self.at.len() - n).into_owned())
    }

    /// Change of the model per standard deviation of each error.
    fn by_error(&mut self) -> Option<&DMatrix<f64>> {
        if self.by_error.as_ref().is_none_or(|(at, _)| *at != self.at) {
            let (now, (_, deviation)) = (self.now.as_ref()?, self.parts());
            let (rotor, shaft) = (self.fitter.rotor, self.fitter.shaft(&self.shaft));
            let errors = DrawingErrors::new(rotor, shaft, &self.fitter.deviations, &deviation);
            self.by_error = now.error_derivative(&errors).map(|taken| (self.at.clone(), taken));
        }
        Some(&self.by_error.as_ref()?.1)
    }

    /// The drawing with its errors taken as linear there.
    fn linear(&mut self) -> Result<Drawing, Error> {
        let ((_, deviation), noise) = (self.parts(), self.noise);
        let noise = noise.with(self.by_error().ok_or_else(singular)?).around(deviation.clone());
        let plant = self.now.as_ref().ok_or_else(singular)?.plant.clone();
        Ok(Drawing::new(deviation, noise).solved(&self.shaft, plant))
    }
}

impl Objective for JointProblem<'_> {
    fn position(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn move_to(&mut self, at: &DVector<f64>) {
        self.at = at.clone();
        let (x, deviation) = self.parts();
        let plant = self.fitter.plant(&deviation, &self.shaft);
        let problem = |p| self.fitter.problem(self.hypothesis, p, Some(self.amplitudes), self.noise);
        self.now = plant.ok().map(problem);
        if let Some(now) = &mut self.now {
            now.go_to(&x);
        }
    }

    fn value(&self) -> f64 {
        self.now.as_ref().map_or(f64::INFINITY, |now| now.cost() + self.parts().1.norm_squared())
    }

    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        self.by_error()?;
        let ((_, by_error), (x, deviation)) = (self.by_error.as_ref()?, self.parts());
        let (mut gram, mut slope) = self.now.as_ref()?.joint_normal_equations(by_error)?;
        for (j, t) in deviation.iter().enumerate() {
            gram[(x.len() + j, x.len() + j)] += 1.0;
            slope[x.len() + j] += t;
        }
        Some((gram, slope))
    }
}

//! A hypothesis at points of somebody else's choosing: for searches without derivatives, and for a fit
//! that had to be moved back inside its bounds.

use std::cell::RefCell;

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::{Complex, DVector};

use super::data::{Data, Value};
use super::hypothesis::Hypothesis;
use super::problem::{Amplitudes, Problem};
use super::{Drawing, Effort, Fit, Fitter, Job, MOST_HELD, singular};
use crate::effects::Place;
use crate::error::Error;

/// A hypothesis, ready to be evaluated anywhere. The linear unknowns are solved for, weighted by the
/// noise; search coordinates are those of [`Hypothesis`].
pub trait Trial {
    /// [`summed_residual_um`] there; `None` if the machine is singular.
    fn summed_residual_um(&self, x: &[f64]) -> Option<f64>;

    /// All about this point, covariance included, as if a fit had ended here.
    ///
    /// # Errors
    /// If the machine is singular here.
    fn fit(&self, x: &[f64]) -> Result<Fit, Error>;
}

/// Σ|u_c| + Σ|u_s| of the differences between the data and a model, µm: the objective of Bera et al.,
/// Machines 2023, 11, 976.
pub fn summed_residual_um(data: &Data, predicted_m: &[Complex<f64>]) -> f64 {
    let difference = |(v, y): (&Value, &Complex<f64>)| (v.measured_m - y).l1_norm() * 1e6;
    data.values().zip(predicted_m).map(difference).sum()
}

impl Fitter<'_> {
    /// A hypothesis for trying. Bearings that harden or soften are taken at the given `amplitudes`;
    /// at rest if there are none.
    ///
    /// # Errors
    /// If the shaft cannot be solved, or the hypothesis holds it at too many places.
    pub fn trial<'p>(
        &'p self,
        hypothesis: &'p Hypothesis<'p>,
        drawing: &'p Drawing,
        amplitudes: Option<&'p Amplitudes>,
    ) -> Result<Box<dyn Trial + 'p>, Error> {
        // anywhere: where the shaft is held and what physics is in force do not depend on x
        let mut x = hypothesis.drawn_bearings().to_vec();
        x.resize(hypothesis.size(), 0.0);
        let terms = hypothesis.terms(&x);
        let mut held: Vec<Place> = (0..self.rotor.bearing.len()).map(Place::Bearing).collect();
        for (place, _) in &terms.supports {
            if !held.contains(place) {
                held.push(*place);
            }
        }
        let prepared = self.prepared(drawing, &terms.physics)?;
        let job = Job { fitter: self, hypothesis, starts: &[], drawing, prepared, effort: Effort::Final };
        match held.len() {
            2 => Ok(Box::new(Held::<4>::new(job, held, amplitudes))),
            3 => Ok(Box::new(Held::<6>::new(job, held, amplitudes))),
            4 => Ok(Box::new(Held::<8>::new(job, held, amplitudes))),
            5 => Ok(Box::new(Held::<10>::new(job, held, amplitudes))),
            6 => Ok(Box::new(Held::<12>::new(job, held, amplitudes))),
            more => Err(Error::Unsuitable(format!("{more} held places are more than {MOST_HELD}"))),
        }
    }
}

/// A trial of a shaft that is held at D/2 places.
struct Held<'p, const D: usize> {
    job: Job<'p>,
    problem: RefCell<Problem<'p, D>>,
}

impl<'p, const D: usize> Held<'p, D> {
    fn new(job: Job<'p>, held: Vec<Place>, amplitudes: Option<&'p Amplitudes>) -> Self {
        let problem = Problem::new(
            job.hypothesis,
            &job.fitter.data,
            &job.prepared.plant,
            &job.prepared.tables,
            held,
            amplitudes,
            job.drawing.whitening.as_ref(),
        );
        Self { job, problem: RefCell::new(problem) }
    }

    fn move_to(&self, x: &[f64]) {
        self.problem.borrow_mut().set_params(&DVector::from_column_slice(x));
    }
}

impl<const D: usize> Trial for Held<'_, D> {
    fn summed_residual_um(&self, x: &[f64]) -> Option<f64> {
        self.move_to(x);
        let problem = self.problem.borrow();
        Some(summed_residual_um(&self.job.fitter.data, &problem.evaluated()?.predicted_m))
    }

    fn fit(&self, x: &[f64]) -> Result<Fit, Error> {
        self.move_to(x);
        let problem = self.problem.borrow();
        problem.evaluated().ok_or_else(singular)?;
        self.job.result(&problem)
    }
}

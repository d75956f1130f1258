//! Questions to a fit that is already there: its uncertainty, its sensitivity, its misfit elsewhere.

use nalgebra::{Complex, DMatrix, DVector};

use super::hypothesis::Hypothesis;
use super::problem::{Amplitudes, Problem};
use super::{Drawing, Fit, Fitter, Job, singular};
use crate::effects::Place;
use crate::error::Error;
use crate::rotor::Rotor;

impl Drawing {
    /// The same drawing with its errors taken as known.
    pub fn fixed(&self) -> Self {
        Self::new(self.deviation.clone(), None)
    }
}

impl Fitter<'_> {
    /// Covariance of search coordinates, then of real and imaginary parts of the linear unknowns.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn covariance(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<Option<DMatrix<f64>>, Error> {
        self.ask(hypothesis, fit, drawing, |q| Ok(q.covariance()))
    }

    /// Change of every real number in noise units per search coordinate, and per real and imaginary part
    /// of each linear unknown relative to its size.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn sensitivity(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<DMatrix<f64>, Error> {
        self.ask(hypothesis, fit, drawing, |q| q.sensitivity().ok_or_else(singular))
    }

    /// χ² of this data under a hypothesis fitted to other data.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn chi2_of(&self, hypothesis: &Hypothesis, fit: &Fit, drawing: &Drawing) -> Result<f64, Error> {
        let unknowns = &fit.unknowns;
        let model = self.ask(hypothesis, fit, drawing, |q| q.model(unknowns).ok_or_else(singular))?;
        let measured = self.data.values().flat_map(|v| {
            let y = v.measured_m / v.sigma_m;
            [y.re, y.im]
        });
        Ok(measured.zip(model.iter()).map(|(y, m)| (y - m).powi(2)).sum())
    }

    /// Amplitudes of a shaft that does not move: where a search over them begins.
    pub fn still(&self) -> Amplitudes {
        vec![[[0.0; 2]; 2]; self.data.rows.len()]
    }

    /// A rotor's file with the drawing's errors as a fit found them: what was built, not what was drawn.
    pub fn corrected(&self, rotor: Rotor, fit: &Fit, drawing: &Drawing) -> Rotor {
        let Some(whitening) = &drawing.whitening else { return rotor };
        let (mut built, offsets) = self.deviations.apply(&rotor, &whitening.estimate(&fit.weighted));
        let bearings = built.bearing.iter_mut().map(|b| &mut b.position_m).zip(offsets.bearing_m);
        let disks = built.disk.iter_mut().map(|d| &mut d.position_m).zip(offsets.disk_m);
        let probes = built.probe.iter_mut().map(|p| &mut p.position_m).zip(offsets.probe_m);
        let planes = built.plane.iter_mut().map(|p| &mut p.position_m).zip(offsets.plane_m);
        for (position_m, offset_m) in bearings.chain(disks).chain(probes).chain(planes) {
            *position_m += offset_m;
        }
        built
    }

    fn ask<T>(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        question: impl Fn(&dyn Query) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let prepared = self.prepared(drawing, &hypothesis.terms(&fit.x).physics)?;
        let starts = [fit.x.clone()];
        let job = Job {
            fitter: self,
            hypothesis,
            starts: &starts,
            drawing,
            prepared,
            effort: super::Effort::Search,
        };
        let mut held: Vec<Place> = (0..self.rotor.bearing.len()).map(Place::Bearing).collect();
        for (place, _) in hypothesis.terms(&fit.x).supports {
            if !held.contains(&place) {
                held.push(place);
            }
        }
        let amplitudes = Some(&fit.amplitudes);
        match held.len() {
            2 => question(&job.problem::<4>(&held, amplitudes).at(&fit.x)),
            3 => question(&job.problem::<6>(&held, amplitudes).at(&fit.x)),
            4 => question(&job.problem::<8>(&held, amplitudes).at(&fit.x)),
            5 => question(&job.problem::<10>(&held, amplitudes).at(&fit.x)),
            _ => question(&job.problem::<12>(&held, amplitudes).at(&fit.x)),
        }
    }
}

/// What can be asked of a problem at a point, whatever its size.
trait Query {
    fn covariance(&self) -> Option<DMatrix<f64>>;
    fn sensitivity(&self) -> Option<DMatrix<f64>>;
    fn model(&self, unknowns: &[Complex<f64>]) -> Option<DVector<f64>>;
}

impl<const D: usize> Query for Problem<'_, D> {
    fn covariance(&self) -> Option<DMatrix<f64>> {
        Problem::covariance(self)
    }

    fn sensitivity(&self) -> Option<DMatrix<f64>> {
        let outer = self.raw_derivative()?;
        let unknowns = &self.evaluated()?.unknowns;
        let none = vec![Complex::from(0.0); unknowns.len()];
        let at_rest = self.weighted_model(self.x(), &none)?;
        let mut columns: Vec<DVector<f64>> = outer.column_iter().map(|c| c.clone_owned()).collect();
        for (j, u) in unknowns.iter().enumerate() {
            for axis in [Complex::new(1.0, 0.0), Complex::new(0.0, 1.0)] {
                let mut only = none.clone();
                only[j] = axis * u.norm();
                columns.push(self.weighted_model(self.x(), &only)? - &at_rest);
            }
        }
        Some(DMatrix::from_columns(&columns))
    }

    fn model(&self, unknowns: &[Complex<f64>]) -> Option<DVector<f64>> {
        self.weighted_model(self.x(), unknowns)
    }
}

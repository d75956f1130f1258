//! Fitting hypotheses to measurements.
//!
//! [`plant`] solves the shaft once, [`update`] puts supports on it, [`hypothesis`] says what is
//! unknown, [`problem`] is the least-squares problem, [`tolerance`] allows for the drawing's errors, and
//! [`Fitter`] holds what all hypotheses about one machine share.

pub mod data;
pub mod hypothesis;
pub mod plant;
pub mod problem;
mod queries;
pub mod tolerance;
pub mod trial;
pub mod update;

use std::sync::OnceLock;

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{Complex, DMatrix, DVector};

use crate::basis;
use crate::effects::{Place, Scales, entry};
use crate::error::Error;
use crate::model::Model;
use crate::rotor::{Physics, Rotor};
use crate::structure::{ELEMENTS_PER_SEGMENT, Structure};
use data::Data;
use hypothesis::{Assumed, COEFFICIENTS, Hypothesis, from_si};
use plant::{Plant, Tables};
use problem::{Amplitudes, Problem};
use tolerance::{Deviations, Whitening};

type C = Complex<f64>;

/// Shape functions of a plane that fits are made on: far more than the controller's six, so that what
/// they leave out is far below any noise.
const SHAPES: usize = 24;
/// Speed, relative to the fastest, at which a stiffness that changes with speed is stated: in the
/// middle of a run-up, slope and stiffness are well apart.
const REFERENCE_SPEED: f64 = 0.7;
/// Rounds over the amplitude at bearings that harden or soften.
const AMPLITUDE_ROUNDS: usize = 20;
/// Most held places that a hypothesis can have: two bearings and four disks.
pub const MOST_HELD: usize = 6;

/// The shaft of a rotor whose drawing deviates by `deviation`, with its tables for all rows.
struct Prepared {
    plant: Plant,
    tables: Vec<Tables>,
}

/// The state of the drawing that hypotheses are fitted on.
pub struct Drawing {
    /// Deviations in standard deviations.
    deviation: DVector<f64>,
    /// The correlated noise that other deviations amount to.
    whitening: Option<Whitening>,
    prepared: [OnceLock<Result<Prepared, Error>>; 8],
}

impl Drawing {
    fn new(deviation: DVector<f64>, whitening: Option<Whitening>) -> Self {
        Self { deviation, whitening, prepared: Default::default() }
    }
}

/// A hypothesis at its best fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Search coordinates at the optimum.
    pub x: Vec<f64>,
    /// Linear unknowns: planes (kg·m), then the effects' in their own units.
    pub unknowns: Vec<C>,
    /// Squared misfit in standard deviations, drawing errors allowed for.
    pub chi2: f64,
    /// The same with the prior on the bearings and the spread of the drawing errors: minus twice the
    /// logarithm of the posterior density, up to a constant.
    pub cost: f64,
    /// Real numbers measured.
    pub values: usize,
    /// Unknowns of the effects: real numbers.
    pub effect_unknowns: usize,
    /// Model at every value, m.
    pub predicted_m: Vec<C>,
    /// Squared amplitudes at the bearings, m².
    pub amplitudes: Amplitudes,
    /// Covariance of search coordinates and of real and imaginary parts of the linear unknowns.
    pub covariance: Option<DMatrix<f64>>,
    /// Weighted residuals before drawing errors are allowed for.
    weighted: DVector<f64>,
}

impl Fit {
    /// Bayesian information criterion (Schwarz 1978), up to a constant of the data and bearings.
    pub fn bic(&self) -> f64 {
        self.cost + self.effect_unknowns as f64 * (self.values as f64).ln()
    }

    /// χ² per measured real number.
    pub fn chi2_per_value(&self) -> f64 {
        self.chi2 / self.values as f64
    }
}

/// How thoroughly to search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Short runs from every start, the best to the end.
    Search,
    /// Like `Search`, with the covariance.
    Final,
}

/// One machine's measurements, ready to fit hypotheses to.
pub struct Fitter<'a> {
    /// The machine as its file states it.
    pub rotor: &'a Rotor,
    /// What was measured.
    pub data: Data,
    deviations: Deviations,
}

impl<'a> Fitter<'a> {
    /// Prepares measurements of a rotor.
    pub fn new(rotor: &'a Rotor, data: Data) -> Self {
        Self { rotor, data, deviations: Deviations::of(rotor) }
    }

    /// Scales of the machine; `amplitude_m` at the bearings from a fit, where there is one.
    pub fn scales(&self, base: Option<&Fit>) -> Scales {
        let direct = self.rotor.bearing.iter().map(|b| 0.5 * (b.stiffness_n_m.xx + b.stiffness_n_m.yy));
        let mean_square = base.map_or(1e-10, |fit| {
            let all = fit.amplitudes.iter().flatten().flatten();
            let count = 4 * fit.amplitudes.len().max(1);
            (all.sum::<f64>() / count as f64).max(1e-18)
        });
        let fastest_rad_s = self.data.fastest_rad_s();
        Scales {
            stiffness_n_m: direct.sum::<f64>() / self.rotor.bearing.len() as f64,
            fastest_rad_s,
            reference_rad_s: entry::reference_rad_s(self.rotor).unwrap_or(REFERENCE_SPEED * fastest_rad_s),
            amplitude_m: mean_square.sqrt(),
        }
    }

    /// The drawing as stated, with no allowance for its errors.
    pub fn exact_drawing(&self) -> Drawing {
        Drawing::new(DVector::zeros(self.deviations.len()), None)
    }

    /// Whether the drawing is taken as exact.
    pub fn drawing_is_exact(&self) -> bool {
        self.deviations.is_empty()
    }

    fn prepared<'d>(&self, drawing: &'d Drawing, physics: &Physics) -> Result<&'d Prepared, Error> {
        let slot = usize::from(physics.gyroscopic)
            + 2 * usize::from(physics.shear_deformation)
            + 4 * usize::from(physics.rotary_inertia);
        let made = drawing.prepared[slot].get_or_init(|| self.prepare(&drawing.deviation, physics));
        made.as_ref().map_err(Clone::clone)
    }

    fn prepare(&self, deviation: &DVector<f64>, physics: &Physics) -> Result<Prepared, Error> {
        let (mut rotor, offsets) = self.deviations.apply(self.rotor, deviation);
        rotor.physics = *physics;
        let structure = Structure::with_disks_beside(&rotor, physics, ELEMENTS_PER_SEGMENT, &offsets.disk_m);
        let model = Model::on(structure, &rotor);
        let size = SHAPES.min(model.structure.size());
        let basis = basis::supported(&model, size);
        let plant = Plant::new(&rotor, &model.structure, &basis, &offsets, self.scales(None).stiffness_n_m)?;
        let tables = self.data.rows.iter().map(|r| plant.tables(r.speed_rad_s, 0.0)).collect();
        Ok(Prepared { plant, tables })
    }

    /// Fits a hypothesis from several starting points (search coordinates).
    ///
    /// # Errors
    /// If the machine is singular from every start, or the hypothesis holds the shaft at too many places.
    pub fn fit(
        &self,
        hypothesis: &Hypothesis,
        starts: &[Vec<f64>],
        drawing: &Drawing,
        effort: Effort,
        amplitudes: Option<&Amplitudes>,
    ) -> Result<Fit, Error> {
        let at_start = hypothesis.terms(&starts[0]);
        let mut held: Vec<Place> = (0..self.rotor.bearing.len()).map(Place::Bearing).collect();
        for (place, _) in &at_start.supports {
            if !held.contains(place) {
                held.push(*place);
            }
        }
        let prepared = self.prepared(drawing, &at_start.physics)?;
        let job = Job { fitter: self, hypothesis, starts, drawing, prepared, effort };
        let nonlinear = at_start.supports.iter().any(|(_, law)| law.hardening_per_m2 != 0.0);
        let amplitudes = amplitudes.filter(|_| nonlinear);
        match held.len() {
            2 => job.run::<4>(held, amplitudes),
            3 => job.run::<6>(held, amplitudes),
            4 => job.run::<8>(held, amplitudes),
            5 => job.run::<10>(held, amplitudes),
            6 => job.run::<12>(held, amplitudes),
            more => Err(Error::Unsuitable(format!("{more} held places are more than {MOST_HELD}"))),
        }
    }

    /// The drawing around what a fit says of its errors; `self` unchanged where the drawing is exact.
    ///
    /// # Errors
    /// If the shaft of a deviating drawing cannot be solved.
    pub fn relinearised(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
    ) -> Result<Drawing, Error> {
        if self.deviations.is_empty() {
            return Ok(self.exact_drawing());
        }
        let centre = match &drawing.whitening {
            Some(w) => w.estimate(&fit.weighted),
            None => drawing.deviation.clone(),
        };
        let jacobian = self.deviation_jacobian(hypothesis, fit, &centre)?;
        Ok(Drawing::new(centre.clone(), Some(Whitening::new(jacobian, centre))))
    }

    /// Weighted response per standard deviation of each drawing error, by differences.
    fn deviation_jacobian(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        centre: &DVector<f64>,
    ) -> Result<DMatrix<f64>, Error> {
        use rayon::prelude::*;
        let step = 0.1;
        let columns: Result<Vec<DVector<f64>>, Error> = (0..self.deviations.len())
            .into_par_iter()
            .map(|i| {
                let side = |by: f64| {
                    let mut t = centre.clone();
                    t[i] += by;
                    self.weighted_response(hypothesis, fit, Drawing::new(t, None))
                };
                Ok((side(step)? - side(-step)?) / (2.0 * step))
            })
            .collect();
        Ok(DMatrix::from_columns(&columns?))
    }

    /// The model at a fit's unknowns on another drawing, in noise units.
    fn weighted_response(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: Drawing,
    ) -> Result<DVector<f64>, Error> {
        let prepared = self.prepared(&drawing, &hypothesis.terms(&fit.x).physics)?;
        let starts = [fit.x.clone()];
        let job = Job {
            fitter: self,
            hypothesis,
            starts: &starts,
            drawing: &drawing,
            prepared,
            effort: Effort::Search,
        };
        job.response(fit)
    }
}

/// One hypothesis on one drawing.
struct Job<'a> {
    fitter: &'a Fitter<'a>,
    hypothesis: &'a Hypothesis<'a>,
    starts: &'a [Vec<f64>],
    drawing: &'a Drawing,
    prepared: &'a Prepared,
    effort: Effort,
}

impl Job<'_> {
    fn problem<'p, const D: usize>(
        &'p self,
        held: &[Place],
        amplitudes: Option<&'p Amplitudes>,
    ) -> Problem<'p, D> {
        Problem::new(
            self.hypothesis,
            &self.fitter.data,
            &self.prepared.plant,
            &self.prepared.tables,
            held.to_vec(),
            amplitudes,
            self.drawing.whitening.as_ref(),
        )
    }

    fn response(&self, fit: &Fit) -> Result<DVector<f64>, Error> {
        let terms = self.hypothesis.terms(&fit.x);
        let mut held: Vec<Place> = (0..self.fitter.rotor.bearing.len()).map(Place::Bearing).collect();
        for (place, _) in &terms.supports {
            if !held.contains(place) {
                held.push(*place);
            }
        }
        let amplitudes = Some(&fit.amplitudes);
        let response = match held.len() {
            2 => self.problem::<4>(&held, amplitudes).weighted_model(&fit.x, &fit.unknowns),
            3 => self.problem::<6>(&held, amplitudes).weighted_model(&fit.x, &fit.unknowns),
            4 => self.problem::<8>(&held, amplitudes).weighted_model(&fit.x, &fit.unknowns),
            5 => self.problem::<10>(&held, amplitudes).weighted_model(&fit.x, &fit.unknowns),
            _ => self.problem::<12>(&held, amplitudes).weighted_model(&fit.x, &fit.unknowns),
        };
        response.ok_or_else(singular)
    }

    fn run<const D: usize>(&self, held: Vec<Place>, amplitudes: Option<&Amplitudes>) -> Result<Fit, Error> {
        let scout = LevenbergMarquardt::new().with_patience(1).with_ftol(1e-6).with_xtol(1e-6);
        let finish = LevenbergMarquardt::new().with_patience(20).with_ftol(1e-9).with_xtol(1e-9);
        let many = self.starts.len() > 1;
        let mut amplitudes = amplitudes.cloned();
        let mut starts = self.starts.to_vec();
        let mut last_cost = f64::INFINITY;
        for round in 0.. {
            let tried = starts.iter().map(|start| {
                let problem = self.problem::<D>(&held, amplitudes.as_ref()).at(start);
                if many && round == 0 { scout.minimize(problem).0 } else { problem }
            });
            let best = tried.filter(|p| p.cost().is_finite()).min_by(|a, b| a.cost().total_cmp(&b.cost()));
            let best = finish.minimize(best.ok_or_else(singular)?).0;
            let settled = (last_cost - best.cost()).abs() < 1e-3 || round >= AMPLITUDE_ROUNDS;
            let fit = self.result(&best)?;
            let Some(held_amplitudes) = amplitudes.as_mut().filter(|_| !settled) else { return Ok(fit) };
            last_cost = fit.cost;
            starts = vec![fit.x];
            // relaxed: a softening support can otherwise hop between two branches
            for (held, new) in
                held_amplitudes.iter_mut().flatten().flatten().zip(fit.amplitudes.iter().flatten().flatten())
            {
                *held = 0.3 * *held + 0.7 * new;
            }
        }
        unreachable!("the loop returns")
    }

    fn result<const D: usize>(&self, problem: &Problem<D>) -> Result<Fit, Error> {
        let now = problem.evaluated().ok_or_else(singular)?;
        let log_det = self.drawing.whitening.as_ref().map_or(0.0, |w| w.log_det);
        let own = self.hypothesis.unknowns().len();
        Ok(Fit {
            x: problem.x().to_vec(),
            unknowns: now.unknowns.clone(),
            chi2: problem.chi2(),
            cost: problem.cost() + log_det,
            values: 2 * self.fitter.data.count(),
            effect_unknowns: self.hypothesis.size() - COEFFICIENTS + 2 * own,
            predicted_m: now.predicted_m.clone(),
            amplitudes: problem.bearing_amplitudes().ok_or_else(singular)?,
            covariance: if self.effort == Effort::Final { problem.covariance() } else { None },
            weighted: now.left.clone(),
        })
    }
}

fn singular() -> Error {
    Error::Unsuitable("the machine is singular at every start".into())
}

/// Starting points for an effect on top of a fit: from where that fit ended and from the file's bearings.
pub fn starts_for(hypothesis: &Hypothesis, base: &Fit, added: Assumed) -> Vec<Vec<f64>> {
    let parameters = added.effect.parameters(&hypothesis.scales);
    let drawn = hypothesis.drawn_bearings();
    let mut starts = Vec::new();
    for si in added.effect.starts(&hypothesis.scales) {
        let own: Vec<f64> = parameters.iter().zip(&si).map(|(p, v)| from_si(p, *v)).collect();
        let from = |bearings: &[f64]| {
            let earlier = &base.x[COEFFICIENTS..];
            bearings.iter().chain(earlier).chain(&own).copied().collect::<Vec<f64>>()
        };
        starts.push(from(&base.x[..COEFFICIENTS]));
        starts.push(from(&drawn));
    }
    starts
}

//! The least-squares problem of one hypothesis.
//!
//! Unbalance planes and every other linear unknown are solved for exactly inside (variable
//! projection, Golub and Pereyra 1973, with Kaufman's derivative); bearing coefficients and effect
//! parameters are outside, where Levenberg–Marquardt moves them. Derivatives are exact: see
//! `derivative`.

mod force_columns;
mod forward;

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, DVector};

use super::centreline;
use super::data::{Amplitudes, Data, FitRow};
use super::descent::{Objective, Stop, descend};
use super::hypothesis::Hypothesis;
use super::projection::LinearSolution;
use super::row_groups::RowGroups;
use super::transient::Transient;
use crate::decomposition::{pseudo_inverse, transposed_product};
use crate::effects::terms::Terms;
use crate::effects::{Pattern, Place};
use crate::machine::place::SpeedLaw;
use crate::receptance::modal_shaft::{Force, ModalShaft};
use crate::receptance::update::{Receptances, UpdatedResponse};
use crate::statistics::whitening::Whitening;
use force_columns::{ForceColumns, forces_in_use};

type C = Complex<f64>;

/// A hypothesis against data, ready for evaluation.
pub struct Problem<'a> {
    pub(super) hypothesis: &'a Hypothesis<'a>,
    pub(super) data: &'a Data,
    /// Rows that the model is evaluated in: those of the data, or of what some of them are sums over.
    pub(super) rows: &'a [FitRow],
    transient: Option<&'a Transient>,
    pub(super) plant: Arc<ModalShaft>,
    pub(super) held: Vec<Place>,
    /// Complex unknowns: planes, then the effects' own.
    pub(super) unknowns: Vec<Column>,
    /// Numbers of the plant's forces that act in some row, by unknowns or trial weights.
    pub(super) forces: Vec<usize>,
    /// Rows of equal speed, and every row by itself.
    at_speed: Arc<RowGroups>,
    alone: Arc<RowGroups>,
    /// As drawn, of each speed, in the forces.
    receptances: Vec<Receptances>,
    /// As drawn, of each row.
    pub(super) columns: Vec<ForceColumns>,
    pub(super) amplitudes: Option<Amplitudes>,
    whitening: &'a Whitening,
    /// Searches that will not come below this cost end early.
    pub(super) most: f64,
    x: DVector<f64>,
    now: Option<Evaluation>,
}

#[derive(Debug, Clone, Copy)]
pub enum Column {
    /// The size of a force.
    Force {
        force: Force,
        law: SpeedLaw,
        /// Force per unit of the unknown.
        per_unit: f64,
    },
    Runout {
        probe: usize,
        /// Runout per unit of the unknown, m.
        per_unit: f64,
    },
}

/// Everything at one point of the search.
pub struct Evaluation {
    /// The linear unknowns and the residuals.
    pub solved: LinearSolution,
    pub responses: Responses,
    /// Size of each of [`Problem::forces`] in each row.
    pub sizes: Vec<Vec<C>>,
    /// Motion of the held places in each row.
    pub motion: Vec<DVector<C>>,
    pub terms: Terms,
}

/// A point of the search that a problem left, with what was evaluated there.
pub struct Visit {
    pub x: Vec<f64>,
    pub cost: f64,
    pub(super) evaluation: Option<Evaluation>,
}

/// Response to unit forces. Rows with equal speed and equal supports have one together.
pub struct Responses {
    pub groups: Arc<RowGroups>,
    /// Of each group.
    pub all: Vec<UpdatedResponse>,
}

impl Responses {
    pub fn of(&self, row: usize) -> &UpdatedResponse {
        &self.all[self.groups.of_row[row]]
    }
}

impl<'a> Problem<'a> {
    /// Prepares a hypothesis on a plant.
    pub fn new(
        hypothesis: &'a Hypothesis<'a>,
        (data, transient): (&'a Data, Option<&'a Transient>),
        plant: Arc<ModalShaft>,
        held: Vec<Place>,
        amplitudes: Option<&Amplitudes>,
        whitening: &'a Whitening,
    ) -> Self {
        let rotor = hypothesis.rotor;
        let planes = rotor.plane.iter().map(|p| Column::Force {
            force: Force::UnbalanceAt(p.position_m),
            law: SpeedLaw::Squared,
            per_unit: 1.0,
        });
        let own = hypothesis.unknowns().into_iter().map(|u| match u.pattern {
            Pattern::Runout(probe) => Column::Runout { probe, per_unit: u.per_unit },
            pattern => {
                Column::Force { force: Force::Pattern(pattern), law: pattern.law(), per_unit: u.per_unit }
            }
        });
        let unknowns: Vec<Column> = planes.chain(own).collect();
        let rows = transient.map_or(&data.rows[..], |transient| &transient.rows);
        let mut problem = Self {
            forces: forces_in_use(&plant, &unknowns, rows),
            unknowns,
            at_speed: Arc::new(RowGroups::by(rows.iter().map(|row| row.speed_rad_s.to_bits()))),
            alone: Arc::new(RowGroups::by(0..rows.len())),
            columns: Vec::new(),
            x: DVector::zeros(hypothesis.size()),
            receptances: Vec::new(),
            now: None,
            hypothesis,
            data,
            rows,
            transient,
            plant,
            held,
            // those of data with other rows are none
            amplitudes: amplitudes.filter(|all| all.len() == rows.len()).cloned(),
            whitening,
            most: f64::INFINITY,
        };
        let drawn = Terms::drawn(rotor);
        problem.receptances = problem.receptances(&drawn);
        problem.columns = problem.columns(&drawn);
        problem
    }

    /// Number of each held place among the plant's.
    pub(super) fn places(&self) -> Vec<usize> {
        self.held.iter().map(|place| self.number(*place)).collect()
    }

    /// Number of a place among the plant's.
    pub(super) fn number(&self, place: Place) -> usize {
        match place {
            Place::Disk(i) => self.plant.bearings + i,
            Place::Bearing(i) | Place::Probe(i) => i,
            Place::Strain(..) => self.plant.strain(place),
            Place::Machine | Place::LeftEnd | Place::Run(_) | Place::Span(_) => 0,
        }
    }

    /// The true speed in a row.
    pub(super) fn speed_rad_s(&self, terms: &Terms, row: usize) -> f64 {
        self.rows[row].speed_rad_s * terms.speed_factor
    }

    fn receptances(&self, terms: &Terms) -> Vec<Receptances> {
        let (places, unit) = (self.places(), self.unit_forces());
        let new = |row: &usize| {
            let speed_rad_s = self.speed_rad_s(terms, *row);
            Receptances::new(&self.plant, speed_rad_s, terms.internal_damping_s, &places, &unit)
        };
        self.at_speed.first.iter().map(new).collect()
    }

    /// Each of the forces by itself, of unit size.
    fn unit_forces(&self) -> Vec<Vec<(usize, C)>> {
        self.forces.iter().map(|f| vec![(*f, C::from(1.0))]).collect()
    }

    /// The receptances of one row at the terms in force, in unit forces.
    pub(super) fn receptances_of(&self, row: usize, terms: &Terms) -> Receptances {
        let (speed, damping) = (self.speed_rad_s(terms, row), terms.internal_damping_s);
        Receptances::new(&self.plant, speed, damping, &self.places(), &self.unit_forces())
    }

    pub fn x(&self) -> &[f64] {
        self.x.as_slice()
    }

    /// The evaluation there; `None` if the machine is singular.
    pub fn evaluated(&self) -> Option<&Evaluation> {
        self.now.as_ref()
    }

    /// Squared deviation from the prior on the bearings and from what gap voltages say of them, in standard deviations.
    pub fn prior_cost(&self) -> f64 {
        let prior: f64 = self.hypothesis.bearings.prior_residuals(self.x.as_slice()).map(|r| r * r).sum();
        let centreline =
            |now: &Evaluation| centreline::residuals(&self.data.centreline, &now.terms).norm_squared();
        prior + self.now.as_ref().map_or(0.0, centreline)
    }

    /// The response of every row; `None` if the machine is singular.
    pub(super) fn respond(&self, terms: &Terms) -> Option<Responses> {
        // damping inside the shaft and another speed are all that changes the receptances themselves
        let changed = terms.internal_damping_s != 0.0 || terms.speed_factor != 1.0;
        let own = changed.then(|| self.receptances(terms));
        let receptances = own.as_ref().unwrap_or(&self.receptances);
        let nonlinear = terms.supports.iter().any(|(_, law)| law.depends_on_amplitude());
        let groups = if nonlinear { &self.alone } else { &self.at_speed };
        let respond = |row: &usize| {
            receptances[self.at_speed.of_row[*row]]
                .respond(self.supports(terms, *row), self.mounted(terms, *row))
        };
        let all: Option<Vec<UpdatedResponse>> = groups.first.iter().map(respond).collect();
        Some(Responses { groups: groups.clone(), all: all? })
    }

    /// The response as a linear system in the linear unknowns, weighted by the noise: columns and target.
    pub(super) fn linear_system(&self, terms: &Terms, responses: &Responses) -> (DMatrix<f64>, DVector<f64>) {
        let (count, width) = (self.count(), self.unknowns.len());
        let probes = terms.gains.len();
        let mut columns = DMatrix::zeros(2 * count, 2 * width);
        let mut target = DVector::zeros(2 * count);
        let mut at = 0;
        for (r, (row, forces)) in self.rows.iter().zip(&*self.columns_at(terms)).enumerate() {
            let response = &responses.of(r).probes;
            for v in &row.values {
                let weight = v.sigma_m.recip();
                let gain = terms.gains[v.probe] * weight;
                let shown = terms.shows[v.probe];
                let under = |column: &[(usize, C)]| -> C {
                    column.iter().map(|(force, factor)| factor * response[force * probes + shown]).sum()
                };
                let known = under(&forces[width]) * gain + terms.runout_m[v.probe] * weight;
                let left = v.measured_m * weight - known;
                (target[at], target[at + 1]) = (left.re, left.im);
                for (j, column) in self.unknowns.iter().enumerate() {
                    let value = match column {
                        Column::Force { force, .. } => under(&forces[j]) * gain * v.share_of_row(*force),
                        Column::Runout { probe, per_unit } if *probe == v.probe => C::from(per_unit * weight),
                        Column::Runout { .. } => continue,
                    };
                    (columns[(at, 2 * j)], columns[(at, 2 * j + 1)]) = (value.re, -value.im);
                    (columns[(at + 1, 2 * j)], columns[(at + 1, 2 * j + 1)]) = (value.im, value.re);
                }
                at += 2;
            }
        }
        match self.transient {
            Some(transient) => {
                let known = transient.observed(&DMatrix::from_columns(&[target]));
                (transient.observed(&columns), known.column(0) + self.measured())
            }
            None => (columns, target),
        }
    }

    fn evaluate(&self, x: &[f64]) -> Option<Evaluation> {
        let terms = self.hypothesis.terms(x);
        let responses = self.respond(&terms)?;
        let (columns, target) = self.linear_system(&terms, &responses);
        let solved = LinearSolution::new(columns, target, self.whitening)?;
        let sizes = self.sizes(&terms, &solved.unknowns);
        let motion = Self::motion(&responses, &sizes);
        Some(Evaluation { motion, sizes, solved, responses, terms })
    }
}

impl Problem<'_> {
    /// Moves to `x` and evaluates there.
    pub(super) fn go_to(&mut self, x: &[f64]) {
        self.move_to(&DVector::from_column_slice(x));
    }

    /// Leaves the present point with what was evaluated there.
    pub(super) fn leave(&mut self) -> Visit {
        Visit { x: self.x().to_vec(), cost: self.cost(), evaluation: self.now.take() }
    }

    /// Moves to a point that was left before, with nothing evaluated anew.
    pub(super) fn return_to(&mut self, visit: Visit) {
        self.x.copy_from_slice(&visit.x);
        self.now = visit.evaluation;
    }

    /// Takes supports that depend on amplitudes at these, and evaluates anew.
    pub(super) fn hold(&mut self, amplitudes: &Amplitudes) {
        self.amplitudes = Some(amplitudes.clone());
        self.now = self.evaluate(self.x.as_slice());
    }

    pub(super) fn descend(&mut self, stop: Stop) {
        descend(self, stop.below(self.most));
    }

    /// The linear unknowns there; `None` if the machine is singular.
    pub(super) fn solved(&self) -> Option<&LinearSolution> {
        self.now.as_ref().map(|n| &n.solved)
    }

    /// Squared misfit in standard deviations, without the prior.
    pub(super) fn chi2(&self) -> f64 {
        self.now.as_ref().map_or(f64::INFINITY, |n| n.solved.weighted.norm_squared())
    }

    /// Squared misfit with the prior on the bearings.
    pub(super) fn cost(&self) -> f64 {
        self.chi2() + self.prior_cost()
    }

    /// Squared amplitude of the shaft at its places in every row.
    pub(super) fn amplitudes(&self) -> Option<Amplitudes> {
        Some(self.squared(&self.now.as_ref()?.motion))
    }

    /// The model at `x` and these linear unknowns, in noise units.
    pub(super) fn weighted_model(&self, x: &[f64], unknowns: &[C]) -> Option<DVector<f64>> {
        let terms = self.hypothesis.terms(x);
        let (columns, target) = self.linear_system(&terms, &self.respond(&terms)?);
        let flat = DVector::from_iterator(2 * unknowns.len(), unknowns.iter().flat_map(|u| [u.re, u.im]));
        Some(self.measured() - target + columns * flat)
    }

    /// `JᵀJ` and `Jᵀr` of the weighted residuals and the prior on the bearings, for the search coordinates and
    /// further unknowns with this derivative of the model; what the linear unknowns can follow is out.
    pub(super) fn joint_normal_equations(
        &self,
        further: &DMatrix<f64>,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let own = self.derivative()?;
        let (n, count) = (own.ncols(), further.ncols());
        let mut model = own.resize_horizontally(n + count, 0.0);
        model.columns_mut(n, count).copy_from(further);
        self.equations(model)
    }

    /// Covariance of everything: search coordinates first, then real and imaginary parts of the linear
    /// unknowns. From the information in the data and in the prior.
    pub(super) fn covariance(&self) -> Option<DMatrix<f64>> {
        let whole = self.tangent()?;
        let n = self.x.len();
        let width = whole.ncols() - n;
        let mut information = transposed_product(&whole, &whole);
        for (i, u) in self.hypothesis.bearings.unknowns().iter().enumerate() {
            information[(i, i)] += u.law.prior_sd.powi(-2);
        }
        let centreline = self.centreline_derivative();
        let mut outer = information.view_mut((0, 0), (n, n));
        outer += centreline.tr_mul(&centreline);
        // in units of each parameter's own information, so that rounding is judged fairly
        let scale = information.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 1.0 });
        let scaled = DMatrix::from_fn(n + width, n + width, |i, j| information[(i, j)] * scale[i] * scale[j]);
        let inverse = pseudo_inverse(scaled, 1e-12)?;
        Some(DMatrix::from_fn(n + width, n + width, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }
}

impl Objective for Problem<'_> {
    fn position(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn move_to(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
        self.now = self.evaluate(x.as_slice());
    }

    fn value(&self) -> f64 {
        self.cost()
    }

    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        self.equations(self.derivative()?)
    }
}

impl Problem<'_> {
    /// Normal equations for a derivative of the model by search coordinates and, after them, whatever else.
    fn equations(&self, mut model: DMatrix<f64>) -> Option<(DMatrix<f64>, DVector<f64>)> {
        self.whitening.apply(&mut model);
        let now = self.now.as_ref()?;
        let solved = &now.solved;
        solved.project(&mut model);
        let (mut gram, mut slope) = (transposed_product(&model, &model), -model.tr_mul(&solved.weighted));
        let bearings = &self.hypothesis.bearings;
        let residuals = bearings.prior_residuals(self.x.as_slice());
        for (i, (u, residual)) in bearings.unknowns().iter().zip(residuals).enumerate() {
            gram[(i, i)] += u.law.prior_sd.powi(-2);
            slope[i] += residual / u.law.prior_sd;
        }
        let (centreline, off) =
            (self.centreline_derivative(), centreline::residuals(&self.data.centreline, &now.terms));
        let n = centreline.ncols();
        let mut outer = gram.view_mut((0, 0), (n, n));
        outer += centreline.tr_mul(&centreline);
        let mut outer = slope.rows_mut(0, n);
        outer += centreline.tr_mul(&off);
        Some((gram, slope))
    }
}

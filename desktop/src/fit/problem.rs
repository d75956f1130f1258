//! The least-squares problem of one hypothesis.
//!
//! Unbalance planes and every other linear unknown are solved for exactly inside (variable
//! projection, Golub and Pereyra 1973, with Kaufman's derivative); bearing coefficients and effect
//! parameters are outside, where Levenberg–Marquardt moves them. Derivatives are exact: a term says
//! how a parameter changes its dynamic stiffness, the adjoint response says what that does at every
//! probe.

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::{Complex, DMatrix, DVector, Dyn, Matrix2, Owned, SVector};

use super::data::{Data, Row};
use super::hypothesis::{COEFFICIENTS, Hypothesis, PRIOR_LOG_SD};
use super::plant::{Force, Plant, Tables};
use super::tolerance::Whitening;
use super::update::{Response, Selected};
use crate::effects::{Pattern, Place};
use crate::machine::Terms;
use crate::terms::SpeedLaw;

type C = Complex<f64>;

/// Step in a search coordinate for the slope of a term: second-order differences of smooth, small
/// matrices, good to ten digits.
const SLOPE_STEP: f64 = 1e-5;

/// Squared amplitudes at the bearings, x and y, m², for each row.
pub type Amplitudes = Vec<[[f64; 2]; 2]>;

/// A hypothesis against data, ready for evaluation.
pub struct Problem<'a, const D: usize> {
    hypothesis: &'a Hypothesis<'a>,
    data: &'a Data,
    plant: &'a Plant,
    held: Vec<Place>,
    /// Complex unknowns: planes, then the effects' own.
    unknowns: Vec<Column>,
    selected: Vec<Selected<D>>,
    amplitudes: Option<&'a Amplitudes>,
    whitening: Option<&'a Whitening>,
    prior: [f64; COEFFICIENTS],
    x: DVector<f64>,
    now: Option<Evaluated<D>>,
}

#[derive(Debug, Clone, Copy)]
enum Column {
    Force { force: Force, law: SpeedLaw, per_unit: f64 },
    Runout { probe: usize, per_unit: f64 },
}

/// Everything at one point of the search.
pub struct Evaluated<const D: usize> {
    /// Linear unknowns: planes (kg·m), then the effects' in their own units.
    pub unknowns: Vec<C>,
    /// Weighted (and whitened) residuals, real and imaginary parts in turn.
    pub weighted: DVector<f64>,
    /// Weighted residuals before whitening.
    pub left: DVector<f64>,
    /// Model at every value, m.
    pub predicted_m: Vec<C>,
    solution: DVector<f64>,
    columns: DMatrix<f64>,
    normal: nalgebra::Cholesky<f64, Dyn>,
    responses: Vec<Response<D>>,
    motion: Vec<SVector<C, D>>,
    gains: Vec<C>,
}

struct LinearSystem<const D: usize> {
    columns: DMatrix<f64>,
    target: DVector<f64>,
    responses: Vec<Response<D>>,
    gains: Vec<C>,
}

impl<'a, const D: usize> Problem<'a, D> {
    /// Prepares a hypothesis; `tables` are the plant's, one a row.
    pub fn new(
        hypothesis: &'a Hypothesis<'a>,
        data: &'a Data,
        plant: &'a Plant,
        tables: &[Tables],
        held: Vec<Place>,
        amplitudes: Option<&'a Amplitudes>,
        whitening: Option<&'a Whitening>,
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
        let mut problem = Self {
            hypothesis,
            data,
            plant,
            held,
            unknowns,
            selected: Vec::new(),
            amplitudes,
            whitening,
            prior: hypothesis.drawn_bearings(),
            x: DVector::zeros(hypothesis.size()),
            now: None,
        };
        problem.selected = problem.select(tables);
        problem
    }

    fn select(&self, tables: &[Tables]) -> Vec<Selected<D>> {
        let disks_after = self.hypothesis.rotor.bearing.len();
        let held: Vec<usize> = self
            .held
            .iter()
            .map(|place| match place {
                Place::Disk(i) => disks_after + i,
                Place::Bearing(i) | Place::Probe(i) => *i,
                Place::Machine => 0,
            })
            .collect();
        let rows = self.data.rows.iter().zip(tables);
        rows.map(|(row, tables)| {
            let w2 = row.speed_rad_s * row.speed_rad_s;
            let mut columns: Vec<Vec<(usize, C)>> = self
                .unknowns
                .iter()
                .map(|column| match column {
                    Column::Force { force, law, per_unit } => {
                        vec![(self.plant.column(*force), C::from(per_unit * law.factor(row.speed_rad_s)))]
                    }
                    Column::Runout { .. } => Vec::new(),
                })
                .collect();
            let weight = |(z, u): &(f64, C)| (self.plant.column(Force::UnbalanceAt(*z)), u * w2);
            columns.push(row.added.iter().map(weight).collect());
            Selected::new(tables, &held, &columns)
        })
        .collect()
    }

    /// Moves to `x` and evaluates there.
    pub fn at(mut self, x: &[f64]) -> Self {
        self.set_params(&DVector::from_column_slice(x));
        self
    }

    /// Where the search is.
    pub fn x(&self) -> &[f64] {
        self.x.as_slice()
    }

    /// The evaluation there; `None` if the machine is singular.
    pub fn evaluated(&self) -> Option<&Evaluated<D>> {
        self.now.as_ref()
    }

    /// Squared misfit in standard deviations, without the prior.
    pub fn chi2(&self) -> f64 {
        self.now.as_ref().map_or(f64::INFINITY, |n| n.weighted.norm_squared())
    }

    /// Squared misfit with the prior on the bearings.
    pub fn cost(&self) -> f64 {
        let prior: f64 = (0..COEFFICIENTS).map(|i| self.prior_residual(i).powi(2)).sum();
        self.chi2() + prior
    }

    fn prior_residual(&self, i: usize) -> f64 {
        (self.x[i] - self.prior[i]) / PRIOR_LOG_SD
    }

    /// Dynamic stiffness at each held place of a row.
    fn supports(&self, terms: &Terms, row: usize) -> Vec<Matrix2<C>> {
        let speed = self.data.rows[row].speed_rad_s;
        let mut held = vec![Matrix2::zeros(); self.held.len()];
        for (place, law) in &terms.supports {
            let amplitude_m = match (self.amplitudes, place) {
                (Some(a), Place::Bearing(b)) => a[row][*b].map(f64::sqrt),
                _ => [0.0; 2],
            };
            if let Some(i) = self.held.iter().position(|h| h == place) {
                held[i] += law.dynamic_stiffness(speed, amplitude_m);
            }
        }
        held
    }

    /// The response at `x` as a linear system in the linear unknowns, weighted by the noise.
    fn linear_system(&self, x: &[f64]) -> Option<LinearSystem<D>> {
        let terms = self.hypothesis.terms(x);
        // damping inside the shaft is the one parameter that changes the receptances themselves
        let damped = (terms.internal_damping_s != 0.0).then(|| {
            let table = |r: &Row| self.plant.tables(r.speed_rad_s, terms.internal_damping_s);
            self.select(&self.data.rows.iter().map(table).collect::<Vec<_>>())
        });
        let selected = damped.as_ref().unwrap_or(&self.selected);
        let (count, width) = (self.data.count(), self.unknowns.len());
        let mut columns = DMatrix::zeros(2 * count, 2 * width);
        let mut target = DVector::zeros(2 * count);
        let mut responses = Vec::with_capacity(self.data.rows.len());
        let mut at = 0;
        for (r, row) in self.data.rows.iter().enumerate() {
            let response = selected[r].respond(&self.supports(&terms, r))?;
            for v in &row.values {
                let gain = terms.gains[v.probe] / v.sigma_m;
                let known = response.probes[width][v.probe] * gain + terms.runout_m[v.probe] / v.sigma_m;
                let left = v.measured_m / v.sigma_m - known;
                (target[at], target[at + 1]) = (left.re, left.im);
                for (j, column) in self.unknowns.iter().enumerate() {
                    let value = match column {
                        Column::Force { .. } => response.probes[j][v.probe] * gain,
                        Column::Runout { probe, per_unit } if *probe == v.probe => {
                            C::from(per_unit / v.sigma_m)
                        }
                        Column::Runout { .. } => continue,
                    };
                    (columns[(at, 2 * j)], columns[(at, 2 * j + 1)]) = (value.re, -value.im);
                    (columns[(at + 1, 2 * j)], columns[(at + 1, 2 * j + 1)]) = (value.im, value.re);
                }
                at += 2;
            }
            responses.push(response);
        }
        Some(LinearSystem { columns, target, responses, gains: terms.gains })
    }

    fn evaluate(&self, x: &[f64]) -> Option<Evaluated<D>> {
        let system = self.linear_system(x)?;
        let whitened = self.whitening.map(|w| {
            let (mut columns, mut target) = (system.columns.clone(), system.target.clone());
            w.apply(&mut columns);
            w.apply_centred(&mut target);
            (columns, target)
        });
        let (columns, target) = whitened.as_ref().map_or((&system.columns, &system.target), |(c, t)| (c, t));
        let normal = ridged_normal(columns)?;
        let solution = normal.solve(&columns.tr_mul(target));
        let weighted = target - columns * &solution;
        let left = &system.target - &system.columns * &solution;
        let predicted_m = self
            .data
            .values()
            .enumerate()
            .map(|(i, v)| v.measured_m - C::new(left[2 * i], left[2 * i + 1]) * v.sigma_m)
            .collect();
        let width = self.unknowns.len();
        let unknowns: Vec<C> = (0..width).map(|j| C::new(solution[2 * j], solution[2 * j + 1])).collect();
        let total = |response: &Response<D>| {
            let forced = unknowns.iter().zip(&response.held).map(|(u, h)| h * *u);
            forced.fold(response.held[width], |sum, h| sum + h)
        };
        Some(Evaluated {
            predicted_m,
            weighted,
            left,
            motion: system.responses.iter().map(total).collect(),
            columns: whitened.map_or(system.columns, |(c, _)| c),
            unknowns,
            solution,
            normal,
            responses: system.responses,
            gains: system.gains,
        })
    }

    /// The model at `x` and these linear unknowns, in noise units.
    pub fn weighted_model(&self, x: &[f64], unknowns: &[C]) -> Option<DVector<f64>> {
        let system = self.linear_system(x)?;
        let flat = DVector::from_iterator(2 * unknowns.len(), unknowns.iter().flat_map(|u| [u.re, u.im]));
        let measured = self.data.values().flat_map(|v| {
            let y = v.measured_m / v.sigma_m;
            [y.re, y.im]
        });
        let measured = DVector::from_iterator(system.target.len(), measured);
        Some(measured - system.target + system.columns * flat)
    }

    /// Squared amplitude of the shaft at both bearings in every row, m².
    pub fn bearing_amplitudes(&self) -> Option<Amplitudes> {
        let m = D / 2;
        let now = self.now.as_ref()?;
        let at = |held: &SVector<C, D>, b: usize| {
            let (f, b) = (held[b], held[m + b]);
            [(f + b).norm_sqr(), (f - b).norm_sqr()]
        };
        Some(now.motion.iter().map(|held| [at(held, 0), at(held, 1)]).collect())
    }

    /// Change of the model at every value per search coordinate, weighted but not whitened or projected.
    pub fn raw_derivative(&self) -> Option<DMatrix<f64>> {
        let now = self.now.as_ref()?;
        let width = self.unknowns.len();
        let mut d = DMatrix::zeros(2 * self.data.count(), self.x.len());
        for i in 0..self.x.len() {
            let moved = |by: f64| {
                let mut x = self.x.clone();
                x[i] += by;
                self.hypothesis.terms(x.as_slice())
            };
            let (up, down) = (moved(SLOPE_STEP), moved(-SLOPE_STEP));
            if up.internal_damping_s != down.internal_damping_s {
                d.set_column(i, &self.difference_quotient(i, &now.solution)?);
                continue;
            }
            let changes = up.supports != down.supports;
            let mut at = 0;
            for (r, row) in self.data.rows.iter().enumerate() {
                let slopes: Vec<(usize, Matrix2<C>)> = if changes {
                    let (a, b) = (self.supports(&up, r), self.supports(&down, r));
                    let slope = |(k, (a, b)): (usize, (Matrix2<C>, Matrix2<C>))| {
                        (k, (a - b) / C::from(2.0 * SLOPE_STEP))
                    };
                    a.into_iter().zip(b).enumerate().map(slope).filter(|(_, s)| s.norm() != 0.0).collect()
                } else {
                    Vec::new()
                };
                let (response, motion) = (&now.responses[r], &now.motion[r]);
                for v in &row.values {
                    let mut slope: C =
                        slopes.iter().map(|(k, s)| response.sensitivity(v.probe, *k, s, motion)).sum();
                    slope *= now.gains[v.probe];
                    let gain = (up.gains[v.probe] - down.gains[v.probe]) / (2.0 * SLOPE_STEP);
                    if gain != C::from(0.0) {
                        let seen = |(u, y): (&C, &Vec<C>)| u * y[v.probe];
                        let forced: C = now.unknowns.iter().zip(&response.probes).map(seen).sum();
                        slope += gain * (forced + response.probes[width][v.probe]);
                    }
                    slope /= v.sigma_m;
                    (d[(at, i)], d[(at + 1, i)]) = (slope.re, slope.im);
                    at += 2;
                }
            }
        }
        Some(d)
    }

    /// Derivative of the model along one coordinate with the linear unknowns held, by evaluating on
    /// either side.
    fn difference_quotient(&self, i: usize, solution: &DVector<f64>) -> Option<DVector<f64>> {
        // far enough apart for the rounding of the modal sums
        let step = 1e-3;
        let left = |by: f64| -> Option<DVector<f64>> {
            let mut x = self.x.clone();
            x[i] += by;
            let system = self.linear_system(x.as_slice())?;
            Some(system.target - system.columns * solution)
        };
        Some((left(-step)? - left(step)?) / (2.0 * step))
    }

    /// Covariance of everything: search coordinates first, then real and imaginary parts of the linear
    /// unknowns. From the information in the data and in the prior.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let now = self.now.as_ref()?;
        let mut outer = self.raw_derivative()?;
        if let Some(w) = self.whitening {
            w.apply(&mut outer);
        }
        let (n, width) = (outer.ncols(), now.columns.ncols());
        let mut whole = DMatrix::zeros(outer.nrows(), n + width);
        whole.columns_mut(0, n).copy_from(&outer);
        whole.columns_mut(n, width).copy_from(&now.columns);
        let mut information = whole.tr_mul(&whole);
        for i in 0..COEFFICIENTS {
            information[(i, i)] += PRIOR_LOG_SD.powi(-2);
        }
        // in units of each parameter's own information, so that rounding is judged fairly
        let scale = information.diagonal().map(|d| if d > 0.0 { d.sqrt().recip() } else { 1.0 });
        let scaled = DMatrix::from_fn(n + width, n + width, |i, j| information[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.pseudo_inverse(1e-12).ok()?;
        Some(DMatrix::from_fn(n + width, n + width, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }
}

/// Cholesky factor of the normal matrix with a whiff of ridge, so that two columns that the data cannot
/// tell apart share what there is.
fn ridged_normal(columns: &DMatrix<f64>) -> Option<nalgebra::Cholesky<f64, Dyn>> {
    let mut normal = columns.tr_mul(columns);
    for i in 0..normal.nrows() {
        normal[(i, i)] *= 1.0 + 1e-12;
        if normal[(i, i)] == 0.0 {
            normal[(i, i)] = 1.0;
        }
    }
    normal.cholesky()
}

impl<const D: usize> LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_, D> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x = x.clone();
        self.now = self.evaluate(x.as_slice());
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let weighted = &self.now.as_ref()?.weighted;
        let prior = (0..COEFFICIENTS).map(|i| self.prior_residual(i));
        let all = weighted.iter().copied().chain(prior);
        Some(DVector::from_iterator(weighted.len() + COEFFICIENTS, all))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let now = self.now.as_ref()?;
        let mut model = self.raw_derivative()?;
        if let Some(w) = self.whitening {
            w.apply(&mut model);
        }
        model -= &now.columns * now.normal.solve(&now.columns.tr_mul(&model));
        let rows = model.nrows();
        let mut jacobian = DMatrix::zeros(rows + COEFFICIENTS, model.ncols());
        jacobian.rows_mut(0, rows).copy_from(&-model);
        for i in 0..COEFFICIENTS {
            jacobian[(rows + i, i)] = 1.0 / PRIOR_LOG_SD;
        }
        Some(jacobian)
    }
}

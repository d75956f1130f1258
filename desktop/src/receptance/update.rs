//! The response on actual supports, as a low-rank update of the receptances on nominal ones.
//!
//! Coordinates are x and y of every held place in turn, D = 2 × held places. With receptances `H` on the
//! nominal supports and `Δ` the actual minus the nominal dynamic stiffness, the machine's response is
//! `Y = Y₀ − Q (1 + ΔH)⁻¹ Δ H₀` (Sherman–Morrison–Woodbury).

use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::allocator::Allocator;
use nalgebra::{
    Complex, DMatrix, DVector, DVectorView, DefaultAllocator, Dim, Dyn, Matrix, Matrix2, OMatrix, Storage,
};

use crate::decomposition::small::{solve, solve_both};
use crate::error::Error;
use crate::model::terms::Support;
use crate::model::{self, Model};
use crate::receptance::modal_shaft::{ModalShaft, loss};

type C = Complex<f64>;
const I: C = C::new(0.0, 1.0);

static SOLVED: AtomicU64 = AtomicU64::new(0);

/// Responses at one speed that this process has solved so far, in fits and in tracking: a measure of work that does not depend on the
/// computer.
pub fn solved_responses() -> u64 {
    SOLVED.load(Ordering::Relaxed)
}

/// Dynamic stiffness of all held places.
#[derive(Debug, Clone)]
pub struct Supports {
    /// Of each by itself, in x and y.
    own: Vec<Matrix2<C>>,
    /// From one to another through a common foundation, D × D; hardly any machine has one.
    between: Option<DMatrix<C>>,
}

impl Supports {
    pub fn apart(own: Vec<Matrix2<C>>) -> Self {
        Self { own, between: None }
    }

    /// All of them together, D × D.
    pub fn joined(whole: DMatrix<C>) -> Self {
        let mut between = whole;
        let own = (0..between.nrows()).step_by(2).map(|at| {
            let mut block = between.fixed_view_mut::<2, 2>(at, at);
            let own = block.clone_owned();
            block.fill(C::from(0.0));
            own
        });
        Self { own: own.collect(), between: Some(between) }
    }

    /// Actual minus nominal dynamic stiffness; places beyond the nominal ones have none.
    pub fn excess(mut self, nominal: &[Matrix2<C>]) -> Self {
        self.own.iter_mut().zip(nominal).for_each(|(own, nominal)| *own -= nominal);
        self
    }

    /// Force of each support for motions of the held places, one a column.
    pub fn forces<K: Dim, S: Storage<C, Dyn, K>>(&self, motions: &Matrix<C, Dyn, K, S>) -> OMatrix<C, Dyn, K>
    where
        DefaultAllocator: Allocator<Dyn, K>,
    {
        let mut forces = motions.clone_owned();
        for mut motion in forces.column_iter_mut() {
            for (place, own) in self.own.iter().enumerate() {
                let (x, y) = (motion[2 * place], motion[2 * place + 1]);
                motion[2 * place] = own[(0, 0)] * x + own[(0, 1)] * y;
                motion[2 * place + 1] = own[(1, 0)] * x + own[(1, 1)] * y;
            }
        }
        match &self.between {
            Some(between) => forces + between * motions,
            None => forces,
        }
    }

    /// Force of each support for adjoint motions: the dynamic stiffness transposed.
    pub fn adjoint_forces<K: Dim, S: Storage<C, Dyn, K>>(
        &self,
        adjoints: &Matrix<C, Dyn, K, S>,
    ) -> OMatrix<C, Dyn, K>
    where
        DefaultAllocator: Allocator<Dyn, K>,
    {
        let transposed = Self {
            own: self.own.iter().map(Matrix2::transpose).collect(),
            between: self.between.as_ref().map(DMatrix::transpose),
        };
        transposed.forces(adjoints)
    }
}

/// Reading of a probe from its moving housing, per motion of the held places; it is subtracted from the shaft's motion.
#[derive(Debug, Clone)]
pub struct Mounted {
    pub probe: usize,
    /// Per motion of each held place in x and in y.
    pub reading: DVector<C>,
}

/// Receptances at one speed, for the held places and force columns of one hypothesis.
#[derive(Debug, Clone)]
pub struct Receptances {
    /// Nominal dynamic stiffness at each bearing, N/m; the bearings are the first of the held places.
    nominal: Vec<Matrix2<C>>,
    held: DMatrix<C>,
    /// D × probes.
    probe_held: DMatrix<C>,
    /// D × columns.
    held_force: DMatrix<C>,
    /// Columns in turn, probes within.
    probe_force: Vec<C>,
}

/// Forward or backward part of receptances between held places, and from them to probes.
struct WhirlReceptances {
    held: DMatrix<C>,
    /// D × probes.
    probe_held: DMatrix<C>,
}

/// `1 + ΔH`, and `Δ H₀`.
struct UpdateSystem {
    matrix: DMatrix<C>,
    forces: DMatrix<C>,
}

/// The machine on its actual supports at one speed.
#[derive(Debug, Clone)]
pub struct UpdatedResponse {
    /// Motion at each probe under each column: columns in turn, probes within.
    pub probes: Vec<C>,
    /// Motion of the held places under each column, D × columns.
    pub held: DMatrix<C>,
    /// Motion at each probe per unit of force at a held place, D × probes; derivatives need it.
    pub adjoint: DMatrix<C>,
    mounted: Vec<Mounted>,
}

impl UpdatedResponse {
    /// Motion at each probe, m, for these amounts of the columns but the last, which holds everything known.
    pub fn at(&self, amounts: &[C]) -> Vec<C> {
        let probes = self.adjoint.ncols();
        let mut shown = self.probes[amounts.len() * probes..].to_vec();
        for (column, amount) in self.probes.chunks(probes).zip(amounts) {
            shown.iter_mut().zip(column).for_each(|(y, h)| *y += h * amount);
        }
        shown
    }

    /// Motion of the held places, m, for these amounts of the columns but the last, which holds everything known.
    pub fn held_at(&self, amounts: &[C]) -> DVector<C> {
        let sizes = amounts.iter().copied().chain([C::from(1.0)]);
        &self.held * DVector::from_iterator(amounts.len() + 1, sizes)
    }

    /// Influence coefficients of all columns but the last, which is the fixed part.
    pub fn influence(&self) -> model::Response {
        let (probes, unknown) = (self.adjoint.ncols(), self.held.ncols() - 1);
        let (columns, fixed) = self.probes.split_at(unknown * probes);
        model::Response::of_probes(
            DMatrix::from_column_slice(probes, unknown, columns),
            DVector::from_column_slice(fixed),
        )
    }
}

/// A 2 × 2 matrix in x and y that is `value` for one sense of whirl and nothing for the other; `turn` is
/// −i forward and i backward: y is that times x.
fn of_whirl(value: C, turn: C) -> Matrix2<C> {
    Matrix2::new(value, -turn * value, turn * value, value) * C::from(0.5)
}

/// Σ weights · a · b over modes.
fn over_modes(weights: &[C], a: &[f64], b: &[f64]) -> C {
    weights.iter().zip(a.iter().zip(b)).map(|(w, (a, b))| w * (a * b)).sum()
}

fn column(m: &DMatrix<f64>, j: usize) -> &[f64] {
    &m.as_slice()[j * m.nrows()..(j + 1) * m.nrows()]
}

impl WhirlReceptances {
    /// From modal gains of one sense.
    fn new(
        gains: &[C],
        held: &DMatrix<f64>,
        probes: &DMatrix<f64>,
        places: &[usize],
        angles_rad: &[f64],
        turn: C,
    ) -> Self {
        let d = 2 * places.len();
        let mut whirl = Self { held: DMatrix::zeros(d, d), probe_held: DMatrix::zeros(d, angles_rad.len()) };
        for (i, a) in places.iter().enumerate() {
            for (j, b) in places.iter().enumerate().skip(i) {
                let block = of_whirl(over_modes(gains, column(held, *a), column(held, *b)), turn);
                whirl.held.fixed_view_mut::<2, 2>(2 * i, 2 * j).copy_from(&block);
                whirl.held.fixed_view_mut::<2, 2>(2 * j, 2 * i).copy_from(&block);
            }
        }
        for (p, angle) in angles_rad.iter().enumerate() {
            // x cos + y sin of a motion with y = turn · x
            let reading = C::from(angle.cos()) + turn * angle.sin();
            let mut row = whirl.probe_held.column_mut(p);
            for (i, place) in places.iter().enumerate() {
                let seen = over_modes(gains, column(probes, p), column(held, *place)) * reading * 0.5;
                (row[2 * i], row[2 * i + 1]) = (seen, -turn * seen);
            }
        }
        whirl
    }

    fn forward(plant: &ModalShaft, gains: &[C], places: &[usize]) -> Self {
        let s = &plant.forward;
        Self::new(gains, &s.held, &s.probes, places, &plant.probe_angles_rad, -I)
    }

    fn backward(plant: &ModalShaft, gains: &[C], places: &[usize]) -> Self {
        let s = &plant.backward;
        Self::new(gains, &s.held, &s.probes, places, &plant.probe_angles_rad, I)
    }
}

impl Receptances {
    /// At one speed, with viscous damping inside the shaft; `places` are the held ones by number (bearings,
    /// then disks), and a column is a sum of forces with complex factors.
    pub fn new(
        plant: &ModalShaft,
        speed_rad_s: f64,
        internal_damping_s: f64,
        places: &[usize],
        columns: &[Vec<(usize, C)>],
    ) -> Self {
        let gains = plant.forward_gains(speed_rad_s);
        let mut both = WhirlReceptances::forward(plant, &gains, places);
        let backward =
            WhirlReceptances::backward(plant, &plant.backward_gains(speed_rad_s, internal_damping_s), places);
        both.held += backward.held;
        both.probe_held += backward.probe_held;
        let s = &plant.forward;
        let mut held_force = DMatrix::zeros(2 * places.len(), columns.len());
        let mut probe_force = Vec::with_capacity(columns.len() * plant.probe_angles_rad.len());
        let total = |forces: &[(usize, C)], place: &[f64]| -> C {
            forces.iter().map(|(f, factor)| over_modes(&gains, place, column(&s.forces, *f)) * factor).sum()
        };
        let turns: Vec<C> = plant.probe_angles_rad.iter().map(|a| C::from_polar(1.0, -a)).collect();
        for (forces, mut motion) in columns.iter().zip(held_force.column_iter_mut()) {
            for (i, place) in places.iter().enumerate() {
                let x = total(forces, column(&s.held, *place));
                (motion[2 * i], motion[2 * i + 1]) = (x, -I * x);
            }
            let seen = |(p, turn): (usize, &C)| total(forces, column(&s.probes, p)) * turn;
            probe_force.extend(turns.iter().enumerate().map(seen));
        }
        Self {
            nominal: nominal(plant, speed_rad_s, internal_damping_s),
            held: both.held,
            probe_held: both.probe_held,
            held_force,
            probe_force,
        }
    }

    /// Of a model with whatever effects it has, at its true speed. The held places are the first `bearings` of its
    /// supports, which stand on the ground or on pedestals of their own, and the nominal dynamic stiffness is that of
    /// the model. Columns are the planes' unbalance, then everything known, runout included.
    ///
    /// # Errors
    /// If the model is singular at this speed.
    pub fn of_model(model: &Model, speed_rad_s: f64, bearings: usize) -> Result<Self, Error> {
        let n = model.structure.size();
        let at_rest = vec![[0.0; 2]; model.supports.len()];
        let held = &model.supports[..bearings];
        let mut forces = DMatrix::<C>::zeros(2 * n, 2 * bearings);
        for (i, support) in held.iter().enumerate() {
            let shape = support.shape.map(C::from);
            forces.view_mut((0, 2 * i), (n, 1)).copy_from(&shape);
            forces.view_mut((n, 2 * i + 1), (n, 1)).copy_from(&shape);
        }
        let unit = model.dynamic_stiffness(speed_rad_s, &at_rest).lu().solve(&forces);
        let unit = unit.ok_or(Error::SingularModel { speed_rad_s })?;
        let driven = model.motion(speed_rad_s, &at_rest)?;
        let at_held = |motion: &DMatrix<C>, i: usize, j: usize| -> C {
            let shape = &held[i / 2].shape;
            (0..n).map(|k| motion[(i % 2 * n + k, j)] * shape[k]).sum()
        };
        let at_probe = |motion: &DMatrix<C>, p: usize, j: usize| -> C {
            let probe = &model.probes[p];
            let (sin, cos) = probe.angle_rad.sin_cos();
            let seen = |k: usize| (motion[(k, j)] * cos + motion[(n + k, j)] * sin) * probe.shape[k];
            probe.gain * (0..n).map(seen).sum::<C>()
        };
        let (places, probes, columns) = (2 * bearings, model.probes.len(), driven.ncols());
        let mut probe_force = DMatrix::from_fn(probes, columns, |p, j| at_probe(&driven, p, j));
        for (shown, probe) in probe_force.column_mut(columns - 1).iter_mut().zip(&model.probes) {
            *shown += probe.runout_m;
        }
        let stiffness = |support: &Support| support.law.dynamic_stiffness(speed_rad_s, [0.0; 2]);
        Ok(Self {
            nominal: held.iter().map(stiffness).collect(),
            held: DMatrix::from_fn(places, places, |i, j| at_held(&unit, i, j)),
            probe_held: DMatrix::from_fn(places, probes, |i, p| at_probe(&unit, p, i)),
            held_force: DMatrix::from_fn(places, columns, |i, j| at_held(&driven, i, j)),
            probe_force: probe_force.as_slice().to_vec(),
        })
    }

    /// The same with these amounts of the first columns as part of the last.
    pub fn with_known(mut self, amounts: &[C]) -> Self {
        let (last, probes) = (self.held_force.ncols() - 1, self.probe_held.ncols());
        for (j, amount) in amounts.iter().enumerate() {
            let force = self.held_force.column(j) * *amount;
            let mut known = self.held_force.column_mut(last);
            known += force;
            for p in 0..probes {
                let shown = self.probe_force[j * probes + p] * amount;
                self.probe_force[last * probes + p] += shown;
            }
        }
        self
    }

    /// The response with these dynamic stiffnesses at the held places, with some probes on housings; `None` if the
    /// machine is singular on them.
    pub fn respond(&self, supports: Supports, mounted: Vec<Mounted>) -> Option<UpdatedResponse> {
        SOLVED.fetch_add(1, Ordering::Relaxed);
        let UpdateSystem { matrix, mut forces } = self.system(supports);
        let mut adjoint = self.probe_held.clone();
        less_housings(&mut adjoint, &self.held, &mounted);
        let from_housings = (!mounted.is_empty()).then(|| adjoint.clone());
        solve_both(matrix, &mut forces, &mut adjoint)?;
        let mut held = self.held_force.clone();
        held.gemm(C::from(-1.0), &self.held, &forces, C::from(1.0));
        let mut shown = self.shown(from_housings.as_ref().unwrap_or(&self.probe_held), &forces);
        let probes = adjoint.ncols();
        for (column, motion) in self.held_force.column_iter().enumerate() {
            for m in &mounted {
                shown[column * probes + m.probe] -= m.reading.dot(&motion);
            }
        }
        Some(UpdatedResponse { probes: shown, held, adjoint, mounted })
    }

    /// Motion at each probe under each column, for probes on the ground: columns in turn, probes within. `None` if the machine is
    /// singular on these supports.
    pub fn motions(&self, supports: Supports) -> Option<Vec<C>> {
        SOLVED.fetch_add(1, Ordering::Relaxed);
        let UpdateSystem { matrix, mut forces } = self.system(supports);
        solve(matrix, &mut forces)?;
        Some(self.shown(&self.probe_held, &forces))
    }

    fn system(&self, supports: Supports) -> UpdateSystem {
        let excess = supports.excess(&self.nominal);
        let mut matrix = excess.forces(&self.held);
        (0..matrix.nrows()).for_each(|i| matrix[(i, i)] += 1.0);
        UpdateSystem { matrix, forces: excess.forces(&self.held_force) }
    }

    /// Motion at each probe under each column with these forces of the supports' excess.
    fn shown(&self, seen_from: &DMatrix<C>, forces: &DMatrix<C>) -> Vec<C> {
        let mut shown = self.probe_force.clone();
        let columns = shown.chunks_exact_mut(seen_from.ncols().max(1));
        for (shown, forces) in columns.zip(forces.column_iter()) {
            for (shown, seen_from) in shown.iter_mut().zip(seen_from.column_iter()) {
                *shown -= seen_from.dot(&forces);
            }
        }
        shown
    }

    /// Change at every probe per unit of damping inside the shaft, for a motion of the held places.
    pub fn damping_slope(
        &self,
        plant: &ModalShaft,
        [speed_rad_s, internal_damping_s]: [f64; 2],
        places: &[usize],
        supports: &Supports,
        response: &UpdatedResponse,
        motion: &DVector<C>,
    ) -> Vec<C> {
        let slope = I * (2.0 * speed_rad_s);
        let gains = plant.backward_gains(speed_rad_s, internal_damping_s);
        let gain_slopes: Vec<C> = gains.iter().map(|g| -slope * g * g).collect();
        let mut change = WhirlReceptances::backward(plant, &gain_slopes, places);
        less_housings(&mut change.probe_held, &change.held, &response.mounted);
        let nominal_slope = of_whirl(slope * plant.nominal_n_m, I);
        let excess = supports.clone().excess(&self.nominal);
        let force = excess.forces(motion);
        let moved = change.held * &force;
        let nominal_at = |adjoint: &DVectorView<C>, bearing: usize| -> C {
            let at = 2 * bearing;
            adjoint.fixed_rows::<2>(at).dot(&(nominal_slope * motion.fixed_rows::<2>(at)))
        };
        let per_probe = |(adjoint, q): (DVectorView<C>, DVectorView<C>)| {
            let nominal: C = (0..self.nominal.len()).map(|bearing| nominal_at(&adjoint, bearing)).sum();
            excess.adjoint_forces(&adjoint).dot(&moved) - q.dot(&force) + nominal
        };
        response.adjoint.column_iter().zip(change.probe_held.column_iter()).map(per_probe).collect()
    }
}

/// Subtracts the motion of the housings from the receptances of the probes.
fn less_housings(seen: &mut DMatrix<C>, held: &DMatrix<C>, mounted: &[Mounted]) {
    for m in mounted {
        let mut seen = seen.column_mut(m.probe);
        seen -= held.tr_mul(&m.reading);
    }
}

/// Nominal dynamic stiffness at each bearing in x and y, N/m.
pub fn nominal(plant: &ModalShaft, speed_rad_s: f64, internal_damping_s: f64) -> Vec<Matrix2<C>> {
    let loss = loss(speed_rad_s, internal_damping_s);
    let own = (of_whirl(C::from(1.0), -I) + of_whirl(loss, I)) * C::from(plant.nominal_n_m);
    vec![own; plant.bearings]
}

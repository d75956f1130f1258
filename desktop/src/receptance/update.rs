//! What the supports do to the response of the shaft on nominal springs: a small update of its
//! receptances.
//!
//! Coordinates are x and y of every held place in turn, D = 2 × held places. With receptances `H` on the
//! nominal springs and `Δ` the actual minus the nominal dynamic stiffness, the machine's response is
//! `Y = Y₀ − Q (1 + ΔH)⁻¹ Δ H₀` (Sherman–Morrison–Woodbury).

use nalgebra::{Complex, DMatrix, Matrix2, SMatrix, SVector};

use crate::receptance::plant::{Plant, loss};

type C = Complex<f64>;
const I: C = C::new(0.0, 1.0);

/// Dynamic stiffness of all held places.
#[derive(Debug, Clone)]
pub struct Supports<const D: usize> {
    /// Of each by itself: 2 × 2 in x and y, one below the other.
    own: SMatrix<C, D, 2>,
    /// What a common foundation carries from one to another; hardly any machine has one.
    between: Option<Box<SMatrix<C, D, D>>>,
}

impl<const D: usize> Supports<D> {
    pub fn apart(own: SMatrix<C, D, 2>) -> Self {
        Self { own, between: None }
    }

    pub fn joined(whole: &SMatrix<C, D, D>) -> Self {
        let (mut own, mut between) = (SMatrix::<C, D, 2>::zeros(), *whole);
        for at in (0..D).step_by(2) {
            own.fixed_view_mut::<2, 2>(at, 0).copy_from(&whole.fixed_view::<2, 2>(at, at));
            between.fixed_view_mut::<2, 2>(at, at).fill(C::from(0.0));
        }
        Self { own, between: Some(Box::new(between)) }
    }

    /// Force of each support for a motion of the held places.
    pub fn forces(&self, motion: &SVector<C, D>) -> SVector<C, D> {
        let own = SVector::from_fn(|i, _| {
            let place = i / 2 * 2;
            self.own[(i, 0)] * motion[place] + self.own[(i, 1)] * motion[place + 1]
        });
        self.between.as_ref().map_or(own, |between| own + **between * motion)
    }

    /// Force of each support for an adjoint motion: the dynamic stiffness transposed.
    pub fn adjoint_forces(&self, adjoint: &SVector<C, D>) -> SVector<C, D> {
        let own = SVector::from_fn(|i, _| {
            let (place, axis) = (i / 2 * 2, i % 2);
            self.own[(place, axis)] * adjoint[place] + self.own[(place + 1, axis)] * adjoint[place + 1]
        });
        self.between.as_ref().map_or(own, |between| own + between.tr_mul(adjoint))
    }

    /// Times receptances between the held places.
    fn times(&self, held: &SMatrix<C, D, D>) -> SMatrix<C, D, D> {
        let mut product = self.between.as_ref().map_or_else(SMatrix::zeros, |between| **between * held);
        for at in (0..D).step_by(2) {
            let block = self.own.fixed_view::<2, 2>(at, 0) * held.fixed_view::<2, D>(at, 0);
            let mut rows = product.fixed_view_mut::<2, D>(at, 0);
            rows += block;
        }
        product
    }
}

/// What a probe on a housing reads of that housing, per motion of the held places; it shows the shaft's motion less this.
#[derive(Debug, Clone, Copy)]
pub struct Mounted<const D: usize> {
    pub probe: usize,
    /// Per motion of each held place in x and in y.
    pub reading: SVector<C, D>,
}

/// Receptances at one speed, for the held places and force columns of one hypothesis.
pub struct Receptances<const D: usize> {
    /// Nominal spring at a bearing.
    nominal: Matrix2<C>,
    /// How many of the held places are bearings.
    bearings: usize,
    held: SMatrix<C, D, D>,
    probe_held: Vec<SVector<C, D>>,
    /// Columns in turn.
    held_force: Vec<SVector<C, D>>,
    /// Columns in turn, probes within.
    probe_force: Vec<C>,
}

/// Forward or backward part of receptances between held places, and from them to probes.
struct Whirl<const D: usize> {
    held: SMatrix<C, D, D>,
    probe_held: Vec<SVector<C, D>>,
}

/// The machine on its actual supports at one speed.
pub struct Response<const D: usize> {
    /// Motion at each probe under each column: columns in turn, probes within.
    pub probes: Vec<C>,
    /// Motion of the held places under each column.
    pub held: Vec<SVector<C, D>>,
    /// Motion at each probe per unit of force at a held place; what derivatives need.
    pub adjoint: Vec<SVector<C, D>>,
    /// Probes on housings.
    mounted: Vec<Mounted<D>>,
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

impl<const D: usize> Whirl<D> {
    /// From modal gains of one sense.
    fn new(
        gains: &[C],
        held: &DMatrix<f64>,
        probes: &DMatrix<f64>,
        places: &[usize],
        angles_rad: &[f64],
        turn: C,
    ) -> Self {
        let mut whirl = Self { held: SMatrix::zeros(), probe_held: Vec::with_capacity(angles_rad.len()) };
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
            let mut row = SVector::zeros();
            for (i, place) in places.iter().enumerate() {
                let seen = over_modes(gains, column(probes, p), column(held, *place)) * reading * 0.5;
                (row[2 * i], row[2 * i + 1]) = (seen, -turn * seen);
            }
            whirl.probe_held.push(row);
        }
        whirl
    }

    fn forward(plant: &Plant, gains: &[C], places: &[usize]) -> Self {
        let s = &plant.forward;
        Self::new(gains, &s.held, &s.probes, places, &plant.probe_angles_rad, -I)
    }

    fn backward(plant: &Plant, gains: &[C], places: &[usize]) -> Self {
        let s = &plant.backward;
        Self::new(gains, &s.held, &s.probes, places, &plant.probe_angles_rad, I)
    }
}

impl<const D: usize> Receptances<D> {
    /// At one speed, with viscous damping inside the shaft; `places` are the held ones by number (bearings,
    /// then disks), and a column is a sum of forces with complex factors.
    pub fn new(
        plant: &Plant,
        speed_rad_s: f64,
        internal_damping_s: f64,
        places: &[usize],
        columns: &[Vec<(usize, C)>],
    ) -> Self {
        let gains = plant.forward_gains(speed_rad_s);
        let mut both = Whirl::<D>::forward(plant, &gains, places);
        let backward = Whirl::backward(plant, &plant.backward_gains(speed_rad_s, internal_damping_s), places);
        both.held += backward.held;
        both.probe_held.iter_mut().zip(backward.probe_held).for_each(|(a, b)| *a += b);
        let s = &plant.forward;
        let mut held_force = Vec::with_capacity(columns.len());
        let mut probe_force = Vec::with_capacity(columns.len() * plant.probe_angles_rad.len());
        let total = |forces: &[(usize, C)], place: &[f64]| -> C {
            forces.iter().map(|(f, factor)| over_modes(&gains, place, column(&s.forces, *f)) * factor).sum()
        };
        for forces in columns {
            let mut motion = SVector::zeros();
            for (i, place) in places.iter().enumerate() {
                let x = total(forces, column(&s.held, *place));
                (motion[2 * i], motion[2 * i + 1]) = (x, -I * x);
            }
            held_force.push(motion);
            let angles = plant.probe_angles_rad.iter().enumerate();
            probe_force
                .extend(angles.map(|(p, a)| total(forces, column(&s.probes, p)) * C::from_polar(1.0, -a)));
        }
        Self {
            nominal: nominal(plant, speed_rad_s, internal_damping_s),
            bearings: plant.bearings,
            held: both.held,
            probe_held: both.probe_held,
            held_force,
            probe_force,
        }
    }

    /// Actual minus nominal dynamic stiffness.
    fn excess(&self, supports: &Supports<D>) -> Supports<D> {
        let mut excess = supports.clone();
        for place in 0..self.bearings {
            let mut block = excess.own.fixed_view_mut::<2, 2>(2 * place, 0);
            block -= self.nominal;
        }
        excess
    }

    /// The response with these dynamic stiffnesses at the held places, with some probes on housings; `None` if the
    /// machine is singular on them.
    pub fn respond(&self, supports: &Supports<D>, mounted: &[Mounted<D>]) -> Option<Response<D>> {
        let excess = self.excess(supports);
        let inverse = (SMatrix::<C, D, D>::identity() + excess.times(&self.held)).try_inverse()?;
        let mut seen_from = self.probe_held.clone();
        less_housings(&mut seen_from, &self.held, mounted);
        let probes = seen_from.len();
        let mut response = Response {
            probes: Vec::with_capacity(self.probe_force.len()),
            held: Vec::with_capacity(self.held_force.len()),
            adjoint: Vec::with_capacity(probes),
            mounted: mounted.to_vec(),
        };
        for (motion, seen) in self.held_force.iter().zip(self.probe_force.chunks(probes)) {
            let force = inverse * excess.forces(motion);
            let column = response.probes.len();
            response.probes.extend(seen.iter().zip(&seen_from).map(|(y, q)| y - q.dot(&force)));
            for m in mounted {
                response.probes[column + m.probe] -= m.reading.dot(motion);
            }
            response.held.push(motion - self.held * force);
        }
        response.adjoint.extend(seen_from.iter().map(|q| inverse.tr_mul(q)));
        Some(response)
    }

    /// Forces of the actual supports beyond those of the nominal springs, for a motion of the held places.
    pub fn excess_forces(&self, supports: &Supports<D>, motion: &SVector<C, D>) -> SVector<C, D> {
        self.excess(supports).forces(motion)
    }

    /// The same for an adjoint motion.
    pub fn excess_adjoint_forces(&self, supports: &Supports<D>, adjoint: &SVector<C, D>) -> SVector<C, D> {
        self.excess(supports).adjoint_forces(adjoint)
    }

    /// Change at every probe per unit of damping inside the shaft, for a motion of the held places.
    pub fn damping_slope(
        &self,
        plant: &Plant,
        [speed_rad_s, internal_damping_s]: [f64; 2],
        places: &[usize],
        supports: &Supports<D>,
        response: &Response<D>,
        motion: &SVector<C, D>,
    ) -> Vec<C> {
        let slope = I * (2.0 * speed_rad_s);
        let gains = plant.backward_gains(speed_rad_s, internal_damping_s);
        let gain_slopes: Vec<C> = gains.iter().map(|g| -slope * g * g).collect();
        let mut change = Whirl::<D>::backward(plant, &gain_slopes, places);
        less_housings(&mut change.probe_held, &change.held, &response.mounted);
        let nominal_slope = of_whirl(slope * plant.nominal_n_m, I);
        let force = self.excess_forces(supports, motion);
        let moved = change.held * force;
        let per_probe = |(adjoint, q): (&SVector<C, D>, &SVector<C, D>)| {
            let nominal: C = (0..self.bearings)
                .map(|b| {
                    let (a, m) = (adjoint.fixed_rows::<2>(2 * b), motion.fixed_rows::<2>(2 * b));
                    a.dot(&(nominal_slope * m))
                })
                .sum();
            self.excess_adjoint_forces(supports, adjoint).dot(&moved) - q.dot(&force) + nominal
        };
        response.adjoint.iter().zip(&change.probe_held).map(per_probe).collect()
    }
}

/// Takes from what each probe sees of forces at the held places what the housings under them move.
fn less_housings<const D: usize>(
    seen: &mut [SVector<C, D>],
    held: &SMatrix<C, D, D>,
    mounted: &[Mounted<D>],
) {
    for m in mounted {
        seen[m.probe] -= held.tr_mul(&m.reading);
    }
}

/// Nominal spring at a bearing in x and y.
pub fn nominal(plant: &Plant, speed_rad_s: f64, internal_damping_s: f64) -> Matrix2<C> {
    let loss = loss(speed_rad_s, internal_damping_s);
    (of_whirl(C::from(1.0), -I) + of_whirl(loss, I)) * C::from(plant.nominal_n_m)
}

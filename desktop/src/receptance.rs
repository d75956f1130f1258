//! Receptances of the shaft on nominal springs, and the cheap change of what holds it.
//!
//! Shaft and disks are isotropic, so forward (x + iy) and backward whirl decouple: two real
//! n × n problems a speed instead of one complex 2n × 2n. The actual supports then differ from the
//! nominal springs only at a few places, and every trial of their coefficients is a D × D update
//! (Sherman–Morrison–Woodbury), D = 2 × number of supports, on full finite elements.

use nalgebra::{Complex, DMatrix, DVector, SMatrix, SVector};

use crate::model::Model;
use crate::structure::Structure;

type C = Complex<f64>;
const I: C = C::new(0.0, 1.0);

/// Loss factor of the nominal springs: keeps them off the undamped critical speeds.
const NOMINAL_LOSS: f64 = 0.3;

/// What the shaft on nominal springs does at one speed; coordinates of the held places run
/// x₁ y₁ x₂ y₂ ….
#[derive(Debug, Clone)]
pub struct Receptance<const D: usize> {
    /// Speed of rotation, rad/s.
    pub speed_rad_s: f64,
    /// Dynamic stiffness of each nominal spring, N/m.
    pub nominal: C,
    held_from_held: SMatrix<C, D, D>,
    held_from_force: Vec<SVector<C, D>>,
    probe_from_held: Vec<SVector<C, D>>,
    probe_from_force: DMatrix<C>,
}

/// The response after an update, and what its derivatives need.
#[derive(Debug, Clone)]
pub struct Updated<const D: usize> {
    /// Probes × forces, m per unit force.
    pub response: DMatrix<C>,
    /// Motion of the held places per force.
    pub held_motion: Vec<SVector<C, D>>,
    probe_from_held: Vec<SVector<C, D>>,
}

impl<const D: usize> Updated<D> {
    /// Change of the response of probe `p` to force `f` per unit of dynamic stiffness added in
    /// coordinate `row` by motion in coordinate `column`.
    pub fn sensitivity(&self, p: usize, f: usize, row: usize, column: usize) -> C {
        -self.probe_from_held[p][row] * self.held_motion[f][column]
    }
}

/// Nominal spring for a model: isotropic, of the bearings' mean stiffness, N/m.
pub fn nominal_spring(model: &Model) -> C {
    let total: f64 = model.supports.iter().map(|s| 0.5 * s.stiffness_n_m.trace()).sum();
    C::new(1.0, NOMINAL_LOSS) * (total / model.supports.len() as f64)
}

/// Forward and backward responses of the shaft on nominal springs to the given force patterns.
fn whirl_responses(
    structure: &Structure,
    held: &[&DVector<f64>],
    nominal: C,
    speed_rad_s: f64,
    forces: &DMatrix<C>,
) -> Option<[DMatrix<C>; 2]> {
    let w2 = speed_rad_s * speed_rad_s;
    let whirl = |sense: f64| {
        let inertia = (&structure.mass - &structure.polar_inertia * sense) * w2;
        let mut z = (&structure.stiffness - inertia).map(C::from);
        for shape in held {
            z += (*shape * shape.transpose()).map(|v| nominal * v);
        }
        z.lu().solve(forces)
    };
    Some([whirl(1.0)?, whirl(-1.0)?])
}

impl<const D: usize> Receptance<D> {
    /// Receptances between the first D/2 supports of `model`, its probes and the given rotating force
    /// patterns (columns n × F; the phasor in x, forward).
    ///
    /// `None` if the shaft on nominal springs is singular at this speed.
    pub fn new(model: &Model, nominal: C, speed_rad_s: f64, forces: &DMatrix<C>) -> Option<Self> {
        let held: Vec<&DVector<f64>> = model.supports.iter().take(D / 2).map(|s| &s.shape).collect();
        let n = model.structure.size();
        let mut columns = DMatrix::zeros(n, held.len() + forces.ncols());
        for (j, shape) in held.iter().enumerate() {
            columns.set_column(j, &shape.map(C::from));
        }
        columns.columns_mut(held.len(), forces.ncols()).copy_from(forces);
        let [forward, backward] = whirl_responses(&model.structure, &held, nominal, speed_rad_s, &columns)?;

        let dot = |shape: &DVector<f64>, from: &DMatrix<C>, j: usize| -> C {
            shape.iter().zip(from.column(j).iter()).map(|(s, v)| v * *s).sum()
        };
        // motion (x, y) at a place from a unit force in x, or in y, at held place j
        let held_motion = |shape: &DVector<f64>, j: usize, force_axis: usize| -> [C; 2] {
            let (f, b) = (dot(shape, &forward, j), dot(shape, &backward, j));
            let (direct, cross) = (0.5 * (f + b), 0.5 * I * (f - b));
            if force_axis == 0 { [direct, -cross] } else { [cross, direct] }
        };
        let forced = |shape: &DVector<f64>, j: usize| -> [C; 2] {
            let x = dot(shape, &forward, held.len() + j);
            [x, -I * x]
        };
        let probe = |p: usize, motion: [C; 2]| {
            let angle = model.probes[p].angle_rad;
            model.probes[p].gain * (motion[0] * angle.cos() + motion[1] * angle.sin())
        };
        Some(Self {
            speed_rad_s,
            nominal,
            held_from_held: SMatrix::from_fn(|i, j| held_motion(held[i / 2], j / 2, j % 2)[i % 2]),
            held_from_force: (0..forces.ncols())
                .map(|j| SVector::from_fn(|i, _| forced(held[i / 2], j)[i % 2]))
                .collect(),
            probe_from_held: (0..model.probes.len())
                .map(|p| SVector::from_fn(|j, _| probe(p, held_motion(&model.probes[p].shape, j / 2, j % 2))))
                .collect(),
            probe_from_force: DMatrix::from_fn(model.probes.len(), forces.ncols(), |p, j| {
                probe(p, forced(&model.probes[p].shape, j))
            }),
        })
    }

    /// Response when the supports have the dynamic stiffness `supports` (D × D) instead of the nominal.
    ///
    /// `None` if the machine is singular on them.
    pub fn updated(&self, supports: &SMatrix<C, D, D>) -> Option<Updated<D>> {
        let mut delta = *supports;
        for i in 0..D {
            delta[(i, i)] -= self.nominal;
        }
        let inverse = (SMatrix::identity() + delta * self.held_from_held).try_inverse()?;
        let update = inverse * delta;
        let held_motion: Vec<_> =
            self.held_from_force.iter().map(|h| h - self.held_from_held * (update * h)).collect();
        let transposed = inverse.transpose();
        let probe_from_held: Vec<_> = self.probe_from_held.iter().map(|q| transposed * q).collect();
        let response = DMatrix::from_fn(self.probe_from_force.nrows(), self.held_from_force.len(), |p, j| {
            self.probe_from_force[(p, j)] - self.probe_from_held[p].dot(&(update * self.held_from_force[j]))
        });
        Some(Updated { response, held_motion, probe_from_held })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    fn bearings(model: &Model, speed: f64) -> SMatrix<C, 4, 4> {
        let mut z = SMatrix::<C, 4, 4>::zeros();
        for (i, s) in model.supports.iter().enumerate() {
            z.fixed_view_mut::<2, 2>(2 * i, 2 * i).copy_from(&s.dynamic_stiffness(speed, [0.0; 2]));
        }
        z
    }

    #[test]
    fn updated_receptances_equal_the_full_dynamic_stiffness_solution() {
        let mut rotor = sample_rotor();
        rotor.bearing[0].stiffness_n_m.xy = 3e7;
        rotor.bearing[1].stiffness_n_m.yx = -5e7;
        rotor.probe[1].angle_deg = 127.0;
        let model = Model::finite_elements(&rotor);
        for speed in [150.0, 600.0, 1150.0] {
            let n = model.structure.size();
            let forces = DMatrix::from_fn(n, 2, |k, j| C::from(model.planes[j][k] * speed * speed));
            let receptance = Receptance::<4>::new(&model, nominal_spring(&model), speed, &forces).unwrap();
            let fast = receptance.updated(&bearings(&model, speed)).unwrap().response;
            let full = model.response(speed).unwrap().per_unbalance;
            assert!((&fast - &full).norm() < 1e-10 * full.norm(), "{speed} rad/s");
        }
    }

    #[test]
    fn sensitivity_equals_finite_differences() {
        let model = Model::finite_elements(&sample_rotor());
        let speed = 900.0;
        let n = model.structure.size();
        let forces = DMatrix::from_fn(n, 2, |k, j| C::from(model.planes[j][k] * speed * speed));
        let receptance = Receptance::<4>::new(&model, nominal_spring(&model), speed, &forces).unwrap();
        let at = bearings(&model, speed);
        let updated = receptance.updated(&at).unwrap();
        for (row, column) in [(0, 0), (1, 1), (2, 3), (3, 2)] {
            let step = C::from(1e3);
            let moved = |by: C| {
                let mut z = at;
                z[(row, column)] += by;
                receptance.updated(&z).unwrap().response
            };
            let slope = (moved(step) - moved(-step)) / (step * 2.0);
            for p in 0..4 {
                for f in 0..2 {
                    let exact = updated.sensitivity(p, f, row, column);
                    assert!((exact - slope[(p, f)]).norm() < 1e-6 * slope.norm());
                }
            }
        }
    }
}

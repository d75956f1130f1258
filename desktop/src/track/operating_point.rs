//! The machine at one reading's speed, solved once, for bearings that change.
//!
//! The shaft on the bearings that the file states is solved for unit forces at the bearings and in the
//! planes; other bearings are then an update of rank four (as in [`crate::receptance::update`], but on top of a
//! model with whatever effects its file has): with `H` the receptances at the bearings and `Δ` the change
//! of their dynamic stiffness, the motion there is `h = (1 + HΔ)⁻¹ h₀` and a probe shows `y₀ − qᵀ Δ h`.

use nalgebra::{Complex, DMatrix, DVector, Matrix2, SMatrix, SVector};

use crate::bearing::support::SupportLaw;
use crate::error::Error;
use crate::machine::drawing::{BasisKind, Coefficients, Rotor};
use crate::model::{Model, Response};
use crate::reduction::basis;
use crate::reduction::sizes::{CONTROLLER, TRACKING};
use crate::track::coefficients::{COEFFICIENTS, coefficient};

type C = Complex<f64>;
type Held = SVector<C, 4>;

/// Logarithms of the eight direct bearing coefficients, in the order of phase I.
pub type Logs = [f64; COEFFICIENTS];

/// Step of a logarithm for the derivative of a bearing's law.
const STEP: f64 = 1e-5;

/// The model that readings are solved on.
pub fn model(rotor: &Rotor) -> Model {
    let size = match rotor.physics.basis {
        BasisKind::Supported => TRACKING,
        BasisKind::FreeFree => CONTROLLER,
    };
    basis::reduced(rotor, size)
}

/// A machine at one speed.
#[derive(Debug, Clone)]
pub struct OperatingPoint {
    speed_rad_s: f64,
    /// Laws of the two bearings as the model states them, and their dynamic stiffness.
    laws: [SupportLaw; 2],
    nominal: [Matrix2<C>; 2],
    held: SMatrix<C, 4, 4>,
    probe_held: Vec<Held>,
    /// One a plane, then everything known.
    held_force: Vec<Held>,
    /// Columns in turn, probes within.
    probe_force: Vec<C>,
}

/// The response on certain bearings.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Probes × planes, in columns, then the known part.
    pub probes: Vec<C>,
    held: Vec<Held>,
    update: SMatrix<C, 4, 4>,
}

impl Motion {
    /// What the probes show for these unbalances (kg·m), m.
    pub fn at(&self, unbalance_kg_m: &[C]) -> Vec<C> {
        let count = self.probes.len() / (unbalance_kg_m.len() + 1);
        let mut shown = self.probes[unbalance_kg_m.len() * count..].to_vec();
        for (column, u) in self.probes.chunks(count).zip(unbalance_kg_m) {
            shown.iter_mut().zip(column).for_each(|(y, h)| *y += h * u);
        }
        shown
    }

    /// The same as a response in the planes' unbalance.
    pub fn response(&self, planes: usize) -> Response {
        let count = self.probes.len() / (planes + 1);
        Response::of_probes(
            DMatrix::from_column_slice(count, planes, &self.probes[..planes * count]),
            DVector::from_column_slice(&self.probes[planes * count..]),
        )
    }
}

impl OperatingPoint {
    /// The model at one speed.
    ///
    /// # Errors
    /// If it is singular there.
    pub fn new(model: &Model, speed_rad_s: f64) -> Result<Self, Error> {
        let speed_rad_s = model.true_rad_s(speed_rad_s);
        let n = model.structure.size();
        let at_rest = vec![[0.0; 2]; model.supports.len()];
        let mut forces = DMatrix::<C>::zeros(2 * n, 4);
        for (i, s) in model.supports.iter().take(2).enumerate() {
            forces.view_mut((0, 2 * i), (n, 1)).copy_from(&s.shape.map(C::from));
            forces.view_mut((n, 2 * i + 1), (n, 1)).copy_from(&s.shape.map(C::from));
        }
        let unit = model.dynamic_stiffness(speed_rad_s, &at_rest).lu().solve(&forces);
        let unit = unit
            .ok_or_else(|| Error::Unsuitable(format!("the model is singular at {speed_rad_s:.1} rad/s")))?;
        let driven = model.motion(speed_rad_s, &at_rest)?;
        let at_bearing = |column: &DVector<C>| {
            Held::from_fn(|i, _| {
                let shape = &model.supports[i / 2].shape;
                (0..n).map(|k| column[i % 2 * n + k] * shape[k]).sum()
            })
        };
        let at_probe = |column: &DVector<C>, p: usize| {
            let probe = &model.probes[p];
            let (sin, cos) = probe.angle_rad.sin_cos();
            let seen = |k: usize| (column[k] * cos + column[n + k] * sin) * probe.shape[k];
            probe.gain * (0..n).map(seen).sum::<C>()
        };
        let column = |m: &DMatrix<C>, j: usize| m.column(j).into_owned();
        let units: Vec<DVector<C>> = (0..4).map(|j| column(&unit, j)).collect();
        let drivens: Vec<DVector<C>> = (0..driven.ncols()).map(|j| column(&driven, j)).collect();
        let mut held = SMatrix::<C, 4, 4>::zeros();
        for (j, u) in units.iter().enumerate() {
            held.set_column(j, &at_bearing(u));
        }
        let planes = model.planes.len();
        let probes = 0..model.probes.len();
        let known = |j: usize, p: usize| if j == planes { model.probes[p].runout_m } else { C::from(0.0) };
        Ok(Self {
            speed_rad_s,
            laws: [0, 1].map(|b| model.supports[b].law.clone()),
            nominal: [0, 1].map(|b| model.supports[b].law.dynamic_stiffness(speed_rad_s, [0.0; 2])),
            held,
            probe_held: probes.clone().map(|p| Held::from_fn(|i, _| at_probe(&units[i], p))).collect(),
            held_force: drivens.iter().map(at_bearing).collect(),
            probe_force: drivens
                .iter()
                .enumerate()
                .flat_map(|(j, d)| probes.clone().map(move |p| (j, d, p)))
                .map(|(j, d, p)| at_probe(d, p) + known(j, p))
                .collect(),
        })
    }

    /// The same with weights in the planes (kg·m) that are known: what is asked for in them is then beside these.
    pub fn with_weights(mut self, weights_kg_m: &[C]) -> Self {
        let (planes, probes) = (weights_kg_m.len(), self.probe_held.len());
        for (j, weight) in weights_kg_m.iter().enumerate() {
            let force = self.held_force[j] * *weight;
            self.held_force[planes] += force;
            for p in 0..probes {
                let shown = self.probe_force[j * probes + p] * weight;
                self.probe_force[planes * probes + p] += shown;
            }
        }
        self
    }

    /// Dynamic stiffness of a bearing with these coefficients.
    fn stiffness(&self, bearing: usize, logs: &Logs) -> Matrix2<C> {
        let mut law = self.laws[bearing].clone();
        for (i, log) in logs.iter().enumerate() {
            let (of, axis, damping) = coefficient(i);
            if of == bearing {
                let matrix = if damping { &mut law.damping_n_s_m } else { &mut law.stiffness_n_m };
                matrix[(axis, axis)] = log.exp();
            }
        }
        law.dynamic_stiffness(self.speed_rad_s, [0.0; 2])
    }

    /// The response on these bearings; `None` if the machine is singular on them.
    pub fn on(&self, logs: &Logs) -> Option<Motion> {
        let excess = [0, 1].map(|b| self.stiffness(b, logs) - self.nominal[b]);
        let mut sum = SMatrix::<C, 4, 4>::identity();
        for (b, change) in excess.iter().enumerate() {
            let block = self.held.fixed_view::<4, 2>(0, 2 * b) * change;
            let mut columns = sum.fixed_view_mut::<4, 2>(0, 2 * b);
            columns += block;
        }
        let update = sum.try_inverse()?;
        let mut motion = Motion { probes: self.probe_force.clone(), held: Vec::new(), update };
        let count = self.probe_held.len();
        for (rest, probes) in self.held_force.iter().zip(motion.probes.chunks_mut(count)) {
            let held = update * rest;
            let force = forces(&excess, &held);
            probes.iter_mut().zip(&self.probe_held).for_each(|(y, q)| *y -= q.dot(&force));
            motion.held.push(held);
        }
        Some(motion)
    }

    /// Change of every probe (m) per unit of each logarithm, at these unbalances: one row a probe.
    pub fn slopes(&self, logs: &Logs, motion: &Motion, unbalance_kg_m: &[C]) -> Vec<[C; COEFFICIENTS]> {
        let planes = unbalance_kg_m.len();
        let mut held = motion.held[planes];
        for (h, u) in motion.held.iter().zip(unbalance_kg_m) {
            held += h * *u;
        }
        let excess = [0, 1].map(|b| self.stiffness(b, logs) - self.nominal[b]);
        let mut per_log = [Held::zeros(); COEFFICIENTS];
        for (i, force) in per_log.iter_mut().enumerate() {
            let b = coefficient(i).0;
            let beside = |step: f64| {
                let mut moved = *logs;
                moved[i] += step;
                self.stiffness(b, &moved)
            };
            let slope = (beside(STEP) - beside(-STEP)) / C::from(2.0 * STEP);
            let at = slope * held.fixed_rows::<2>(2 * b);
            force.fixed_rows_mut::<2>(2 * b).copy_from(&at);
        }
        // dy = −qᵀ (1 + ΔH)⁻¹ dΔ h, and (1 + ΔH)⁻¹ = 1 − Δ (1 + HΔ)⁻¹ H
        let row = |q: &Held| {
            per_log.map(|force| {
                let back = motion.update * (self.held * force);
                -(q.dot(&force) - q.dot(&forces(&excess, &back)))
            })
        };
        self.probe_held.iter().map(row).collect()
    }
}

/// Force of both bearings' change for a motion there.
fn forces(excess: &[Matrix2<C>; 2], motion: &Held) -> Held {
    let mut force = Held::zeros();
    for (b, change) in excess.iter().enumerate() {
        force.fixed_rows_mut::<2>(2 * b).copy_from(&(change * motion.fixed_rows::<2>(2 * b)));
    }
    force
}

/// Logarithms of the direct coefficients of a rotor's two constant bearings.
pub fn logs_of(rotor: &Rotor) -> Logs {
    std::array::from_fn(|i| {
        let (bearing, axis, damping) = coefficient(i);
        let Some(b) = rotor.bearing.get(bearing).and_then(|b| b.constants()) else { return f64::NAN };
        let of = |c: &Coefficients| if axis == 0 { c.xx } else { c.yy };
        let value = if damping { of(&b.damping_n_s_m) } else { of(&b.stiffness_n_m) };
        // as phase I: a logarithm needs a number
        value.max(1e-6 * of(&b.stiffness_n_m)).ln()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sample_rotor;

    const SPEED: f64 = 1100.0;

    fn changed() -> (Rotor, Logs) {
        let mut rotor = sample_rotor();
        rotor.bearing[0].constants_mut().unwrap().stiffness_n_m.xx *= 0.6;
        rotor.bearing[1].constants_mut().unwrap().stiffness_n_m.yy *= 1.7;
        rotor.bearing[1].constants_mut().unwrap().damping_n_s_m.xx *= 0.5;
        let logs = logs_of(&rotor);
        (rotor, logs)
    }

    fn unbalance() -> Vec<C> {
        vec![C::new(3e-4, -1e-4), C::new(-2e-4, 2.5e-4)]
    }

    #[test]
    fn other_bearings_by_update_equal_the_model_made_with_them() {
        let (rotor, logs) = changed();
        let basis = basis::supported(&Model::finite_elements(&sample_rotor()), TRACKING);
        let whole = Model::finite_elements(&rotor).projected(&basis).response(SPEED).unwrap();
        let motion = OperatingPoint::new(&model(&sample_rotor()), SPEED).unwrap().on(&logs).unwrap();
        let expected = whole.at(&DVector::from_vec(unbalance()));
        for (y, expected) in motion.at(&unbalance()).iter().zip(expected.iter()) {
            assert!((y - expected).norm() < 1e-9 * expected.norm());
        }
    }

    #[test]
    fn twelve_shapes_equal_full_finite_elements_on_changed_bearings() {
        let (rotor, logs) = changed();
        let expected =
            Model::finite_elements(&rotor).response(SPEED).unwrap().at(&DVector::from_vec(unbalance()));
        let shown =
            OperatingPoint::new(&model(&sample_rotor()), SPEED).unwrap().on(&logs).unwrap().at(&unbalance());
        for (y, expected) in shown.iter().zip(expected.iter()) {
            assert!((y - expected).norm() < 1e-4 * expected.norm(), "{y} {expected}");
        }
    }

    #[test]
    fn known_weights_add_to_unbalance_on_any_bearings() {
        let (_, logs) = changed();
        let weights = [C::new(5e-5, 2e-5), C::new(-3e-5, 1e-5)];
        let without = OperatingPoint::new(&model(&sample_rotor()), SPEED).unwrap();
        let together: Vec<C> = unbalance().iter().zip(&weights).map(|(u, w)| u + w).collect();
        let expected = without.on(&logs).unwrap().at(&together);
        let shown = without.with_weights(&weights).on(&logs).unwrap().at(&unbalance());
        for (y, expected) in shown.iter().zip(&expected) {
            assert!((y - expected).norm() < 1e-12 * expected.norm());
        }
    }

    #[test]
    fn slopes_equal_differences() {
        let (_, logs) = changed();
        let weights = [C::new(5e-5, 2e-5), C::new(-3e-5, 1e-5)];
        let point = OperatingPoint::new(&model(&sample_rotor()), SPEED).unwrap().with_weights(&weights);
        let slopes = point.slopes(&logs, &point.on(&logs).unwrap(), &unbalance());
        for i in 0..COEFFICIENTS {
            let beside = |step: f64| {
                let mut moved = logs;
                moved[i] += step;
                point.on(&moved).unwrap().at(&unbalance())
            };
            let (up, down) = (beside(1e-4), beside(-1e-4));
            for p in 0..4 {
                let difference = (up[p] - down[p]) / 2e-4;
                assert!((difference - slopes[p][i]).norm() < 1e-5 * slopes[p][i].norm().max(1e-9), "{i} {p}");
            }
        }
    }
}

//! The machine at one reading's speed, solved once, for bearings that change.
//!
//! The model of the file is solved once a speed; every other set of bearings is an update of its receptances
//! ([`crate::receptance::update`]), for any number of bearings and planes.

use nalgebra::{Complex, DMatrix, Matrix2};

use crate::bearing::law::Role;
use crate::bearing::support::SupportLaw;
use crate::error::Error;
use crate::machine::bearings::Bearings;
use crate::machine::drawing::{BasisKind, Rotor};
use crate::model::Model;
use crate::receptance::update::{Receptances, Supports, UpdatedResponse};
use crate::reduction::basis;
use crate::reduction::sizes::{CONTROLLER, TRACKING};
use crate::track::coefficients::{coefficient, index};

type C = Complex<f64>;

/// Logarithms of the direct coefficients of all bearings, in the order of phase I.
pub type Logs = Vec<f64>;

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
    /// Laws of the bearings as the model states them.
    laws: Vec<SupportLaw>,
    /// Columns are the planes, then everything known.
    receptances: Receptances,
}

impl OperatingPoint {
    /// The model, whose first supports are so many bearings, at one speed as the data state it.
    ///
    /// # Errors
    /// If it is singular there.
    pub fn new(model: &Model, bearings: usize, speed_rad_s: f64) -> Result<Self, Error> {
        let speed_rad_s = model.true_rad_s(speed_rad_s);
        Ok(Self {
            speed_rad_s,
            laws: model.supports[..bearings].iter().map(|s| s.law.clone()).collect(),
            receptances: Receptances::of_model(model, speed_rad_s, bearings)?,
        })
    }

    /// The same with weights in the planes (kg·m) that are known: what is asked for in them is then beside these.
    pub fn with_weights(self, weights_kg_m: &[C]) -> Self {
        Self { receptances: self.receptances.with_known(weights_kg_m), ..self }
    }

    /// Dynamic stiffness of a bearing with these coefficients, N/m.
    fn stiffness(&self, bearing: usize, logs: &[f64]) -> Matrix2<C> {
        let mut law = self.laws[bearing].clone();
        for axis in 0..2 {
            let of = |damping: bool| logs[index(bearing, axis, damping, logs.len())].exp();
            law.stiffness_n_m[(axis, axis)] = of(false);
            law.damping_n_s_m[(axis, axis)] = of(true);
        }
        law.dynamic_stiffness(self.speed_rad_s, [0.0; 2])
    }

    /// The response on these bearings, in the planes' unbalance and everything known; `None` if the machine is
    /// singular on them.
    pub fn on(&self, logs: &[f64]) -> Option<UpdatedResponse> {
        let own = (0..self.laws.len()).map(|bearing| self.stiffness(bearing, logs)).collect();
        self.receptances.respond(&Supports::apart(own), &[])
    }

    /// Change of every probe (m) per unit of each logarithm, at these unbalances (kg·m): probes × coefficients.
    pub fn slopes(&self, logs: &[f64], response: &UpdatedResponse, unbalance_kg_m: &[C]) -> DMatrix<C> {
        let held = response.held_at(unbalance_kg_m);
        let mut slopes = DMatrix::zeros(response.adjoint.ncols(), logs.len());
        let mut moved = logs.to_vec();
        for (i, mut column) in slopes.column_iter_mut().enumerate() {
            let (bearing, ..) = coefficient(i, logs.len());
            let mut beside = |step: f64| {
                moved[i] = logs[i] + step;
                self.stiffness(bearing, &moved)
            };
            let slope = (beside(STEP) - beside(-STEP)) / C::from(2.0 * STEP);
            moved[i] = logs[i];
            let force = slope * held.fixed_rows::<2>(2 * bearing);
            for (change, adjoint) in column.iter_mut().zip(response.adjoint.column_iter()) {
                *change = -adjoint.fixed_rows::<2>(2 * bearing).dot(&force);
            }
        }
        slopes
    }
}

/// Those of a rotor's bearings as its file states them.
pub fn logs_of(rotor: &Rotor) -> Logs {
    let bearings = Bearings::of(rotor);
    let direct = bearings.unknowns().iter().filter(|u| u.law.role != Role::Other);
    direct.map(|u| u.law.stated).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bearing::support::Pedestal;
    use crate::machine::drawing::{Bearing, Plane};
    use crate::testing::sample_rotor;
    use nalgebra::DVector;

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
    fn two_bearings_updated_equal_model_made_with_them() {
        let (rotor, logs) = changed();
        let basis = basis::supported(&Model::finite_elements(&sample_rotor()), TRACKING);
        let whole = Model::finite_elements(&rotor).projected(&basis).response(SPEED).unwrap();
        let motion = OperatingPoint::new(&model(&sample_rotor()), 2, SPEED).unwrap().on(&logs).unwrap();
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
        let shown = OperatingPoint::new(&model(&sample_rotor()), 2, SPEED)
            .unwrap()
            .on(&logs)
            .unwrap()
            .at(&unbalance());
        for (y, expected) in shown.iter().zip(expected.iter()) {
            assert!((y - expected).norm() < 1e-4 * expected.norm(), "{y} {expected}");
        }
    }

    #[test]
    fn three_bearings_updated_equal_model_made_with_them() {
        let mut rotor = sample_rotor();
        let middle = Bearing { name: "C".into(), position_m: 0.5, ..rotor.bearing[0].clone() };
        rotor.bearing.insert(1, middle);
        rotor.bearing[2].pedestal = Some(Pedestal::isotropic(9e8, 2e4, 60.0));
        rotor.plane.push(Plane { name: "3".into(), position_m: 0.5, ..rotor.plane[0].clone() });
        let model = model(&rotor);
        let basis = basis::supported(&Model::finite_elements(&rotor), TRACKING);
        let mut changed = rotor.clone();
        for (k, bearing) in changed.bearing.iter_mut().enumerate() {
            let constants = bearing.constants_mut().unwrap();
            constants.stiffness_n_m.xx *= 0.5 + 0.4 * k as f64;
            constants.damping_n_s_m.yy *= 2.0 - 0.6 * k as f64;
        }
        let unbalance = [unbalance(), vec![C::new(1e-4, 1e-4)]].concat();
        let whole = Model::finite_elements(&changed).projected(&basis).response(SPEED).unwrap();
        let expected = whole.at(&DVector::from_vec(unbalance.clone()));
        let point = OperatingPoint::new(&model, 3, SPEED).unwrap();
        let logs = logs_of(&changed);
        assert_eq!(logs.len(), 12);
        let response = point.on(&logs).unwrap();
        for (y, expected) in response.at(&unbalance).iter().zip(expected.iter()) {
            assert!((y - expected).norm() < 1e-9 * expected.norm(), "{y} {expected}");
        }
        let influence = response.influence().per_unbalance;
        assert!((influence - &whole.per_unbalance).camax() < 1e-9 * whole.per_unbalance.camax());
    }

    #[test]
    fn known_weights_add_to_unbalance_on_any_bearings() {
        let (_, logs) = changed();
        let weights = [C::new(5e-5, 2e-5), C::new(-3e-5, 1e-5)];
        let without = OperatingPoint::new(&model(&sample_rotor()), 2, SPEED).unwrap();
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
        let point = OperatingPoint::new(&model(&sample_rotor()), 2, SPEED).unwrap().with_weights(&weights);
        let slopes = point.slopes(&logs, &point.on(&logs).unwrap(), &unbalance());
        for i in 0..logs.len() {
            let beside = |step: f64| {
                let mut moved = logs.clone();
                moved[i] += step;
                point.on(&moved).unwrap().at(&unbalance())
            };
            let (up, down) = (beside(1e-4), beside(-1e-4));
            for p in 0..4 {
                let difference = (up[p] - down[p]) / 2e-4;
                assert!(
                    (difference - slopes[(p, i)]).norm() < 1e-5 * slopes[(p, i)].norm().max(1e-9),
                    "{i} {p}"
                );
            }
        }
    }
}

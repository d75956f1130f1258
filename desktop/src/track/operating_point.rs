//! The machine at one reading's speed, solved once, for bearings that change.
//!
//! The model of the file is solved once a speed; every other set of bearings is an update of its receptances
//! ([`crate::receptance::update`]), for any number of bearings and planes.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, Matrix2};

use crate::bearing::Law;
use crate::bearing::law::Role;
use crate::bearing::support::SupportLaw;
use crate::error::Error;
use crate::machine::drawing::{BasisKind, Rotor};
use crate::model::Model;
use crate::receptance::update::{Receptances, Supports, UpdatedResponse};
use crate::reduction::basis;
use crate::reduction::sizes::{CONTROLLER, tracking};
use crate::track::coefficients::{FollowedNumber, followed};

type C = Complex<f64>;

/// Step of a logarithm for the derivative of a bearing's law.
const STEP: f64 = 1e-5;

/// The model that readings are solved on, and its bearings as they are followed.
#[derive(Debug, Clone)]
pub struct FollowedMachine {
    model: Model,
    bearings: Arc<[FollowedBearing]>,
}

impl FollowedMachine {
    pub fn of(rotor: &Rotor) -> Self {
        let size = match rotor.physics.basis {
            BasisKind::Supported => tracking(rotor.bearing.len()),
            BasisKind::FreeFree => CONTROLLER,
        };
        let (model, numbers) = (basis::reduced(rotor, size), followed(rotor));
        let laws = rotor.bearing.iter().map(|b| &b.law).zip(&model.supports).enumerate();
        let bearings = laws.map(|(bearing, (law, support))| {
            FollowedBearing::new(bearing, law, support.law.clone(), &numbers)
        });
        Self { bearings: bearings.collect(), model }
    }

    /// The machine at one speed as the data state it.
    ///
    /// # Errors
    /// If it is singular there.
    pub fn at(&self, speed_rad_s: f64) -> Result<OperatingPoint, Error> {
        let speed_rad_s = self.model.true_rad_s(speed_rad_s);
        Ok(OperatingPoint {
            speed_rad_s,
            bearings: self.bearings.clone(),
            receptances: Receptances::of_model(&self.model, speed_rad_s, self.bearings.len())?,
        })
    }
}

/// A bearing, and which of the followed logarithms are numbers of its law.
#[derive(Debug, Clone)]
struct FollowedBearing {
    law: Law,
    /// Its support as the model states it, with what effects add to it.
    drawn: SupportLaw,
    /// Search coordinates of all its law's unknowns, as stated.
    stated: Vec<f64>,
    /// Place among the law's unknowns, and among the followed logarithms.
    places: Vec<[usize; 2]>,
    /// Whether the followed numbers are the direct coefficients themselves, the same at every speed: k_xx, k_yy, c_xx, c_yy.
    is_constant: bool,
}

impl FollowedBearing {
    fn new(bearing: usize, law: &Law, drawn: SupportLaw, numbers: &[FollowedNumber]) -> Self {
        let own = numbers.iter().enumerate().filter(|(_, n)| n.bearing == bearing);
        Self {
            stated: law.as_law().unknowns().iter().map(|u| u.stated).collect(),
            places: own.map(|(at, n)| [n.place, at]).collect(),
            is_constant: matches!(law, Law::Constant(constant) if constant.learned.is_none()),
            law: law.clone(),
            drawn,
        }
    }

    /// Its support with the followed numbers at these logarithms.
    fn support(&self, logs: &[f64]) -> SupportLaw {
        let mut support = self.drawn.clone();
        if let (true, &[[_, kx], [_, ky], [_, cx], [_, cy]]) = (self.is_constant, &self.places[..]) {
            for (axis, [k, c]) in [[kx, cx], [ky, cy]].into_iter().enumerate() {
                support.stiffness_n_m[(axis, axis)] = logs[k].exp();
                support.damping_n_s_m[(axis, axis)] = logs[c].exp();
            }
            return support;
        }
        let mut x = self.stated.clone();
        self.places.iter().for_each(|[place, at]| x[*place] = logs[*at]);
        let own = self.law.as_law().support(&x);
        (support.stiffness_n_m, support.damping_n_s_m) = (own.stiffness_n_m, own.damping_n_s_m);
        support.curve = own.curve;
        if own.reference_rad_s > 0.0 {
            // a law whose stiffness grows with speed by itself
            (support.stiffness_slope, support.reference_rad_s) = (own.stiffness_slope, own.reference_rad_s);
        }
        support
    }
}

/// A machine at one speed.
#[derive(Debug, Clone)]
pub struct OperatingPoint {
    speed_rad_s: f64,
    bearings: Arc<[FollowedBearing]>,
    /// Columns are the planes, then everything known.
    receptances: Receptances,
}

impl OperatingPoint {
    /// The same with weights in the planes (kg·m) that are known: what is asked for in them is then beside these.
    pub fn with_weights(self, weights_kg_m: &[C]) -> Self {
        Self { receptances: self.receptances.with_known(weights_kg_m), ..self }
    }

    /// Dynamic stiffness of a bearing with these numbers, N/m.
    fn stiffness(&self, bearing: usize, logs: &[f64]) -> Matrix2<C> {
        self.bearings[bearing].support(logs).dynamic_stiffness(self.speed_rad_s, [0.0; 2])
    }

    /// The response on these bearings, in the planes' unbalance and everything known; `None` if the machine is
    /// singular on them.
    pub fn on(&self, logs: &[f64]) -> Option<UpdatedResponse> {
        self.receptances.respond(self.supports(logs), Vec::new())
    }

    /// The motion of the probes on these bearings alone, m per unit of each plane's unbalance (kg·m) and of everything known: columns
    /// in turn, probes within. `None` if the machine is singular on them.
    pub fn motions_on(&self, logs: &[f64]) -> Option<Vec<C>> {
        self.receptances.motions(self.supports(logs))
    }

    fn supports(&self, logs: &[f64]) -> Supports {
        Supports::apart((0..self.bearings.len()).map(|bearing| self.stiffness(bearing, logs)).collect())
    }

    /// Change of every probe (m) per unit of each logarithm, at these unbalances (kg·m): probes × logarithms.
    pub fn slopes(&self, logs: &[f64], response: &UpdatedResponse, unbalance_kg_m: &[C]) -> DMatrix<C> {
        let held = response.held_at(unbalance_kg_m);
        let mut slopes = DMatrix::zeros(response.adjoint.ncols(), logs.len());
        let mut moved = logs.to_vec();
        for (bearing, own) in self.bearings.iter().enumerate() {
            for [_, i] in &own.places {
                let mut beside = |step: f64| {
                    moved[*i] = logs[*i] + step;
                    self.stiffness(bearing, &moved)
                };
                let slope = (beside(STEP) - beside(-STEP)) / C::from(2.0 * STEP);
                moved[*i] = logs[*i];
                let force = slope * held.fixed_rows::<2>(2 * bearing);
                for (change, adjoint) in slopes.column_mut(*i).iter_mut().zip(response.adjoint.column_iter())
                {
                    *change = -adjoint.fixed_rows::<2>(2 * bearing).dot(&force);
                }
            }
        }
        slopes
    }

    /// Change of the logarithm of a bearing's mean direct stiffness, or of its mean direct damping, per unit of each of these
    /// logarithms.
    pub fn direct_slopes(&self, bearing: usize, role: Role, logs: &[f64], of: &[usize]) -> Vec<f64> {
        let log = |logs: &[f64]| {
            let pair = self.bearings[bearing].support(logs).coefficients(self.speed_rad_s);
            let m = if role == Role::Damping { pair.damping } else { pair.stiffness };
            0.5 * (m.m11.abs().ln() + m.m22.abs().ln())
        };
        let mut moved = logs.to_vec();
        let slope = |i: &usize| {
            let mut beside = |step: f64| {
                moved[*i] = logs[*i] + step;
                log(&moved)
            };
            let slope = (beside(STEP) - beside(-STEP)) / (2.0 * STEP);
            moved[*i] = logs[*i];
            slope
        };
        of.iter().map(slope).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bearing::magnetic::Magnetic;
    use crate::bearing::support::Pedestal;
    use crate::machine::drawing::{Bearing, Plane};
    use crate::testing::{film, sample_rotor, table, train};
    use crate::track::coefficients::{Logs, logs_of};
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
        let basis = basis::supported(&Model::finite_elements(&sample_rotor()), tracking(2));
        let whole = Model::finite_elements(&rotor).projected(&basis).response(SPEED).unwrap();
        let point = FollowedMachine::of(&sample_rotor()).at(SPEED).unwrap();
        let motion = point.on(&logs).unwrap();
        for (alone, whole) in point.motions_on(&logs).unwrap().iter().zip(&motion.probes) {
            assert!((alone - whole).norm() <= 1e-12 * whole.norm(), "{alone} {whole}");
        }
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
            FollowedMachine::of(&sample_rotor()).at(SPEED).unwrap().on(&logs).unwrap().at(&unbalance());
        for (y, expected) in shown.iter().zip(expected.iter()) {
            assert!((y - expected).norm() < 1e-4 * expected.norm(), "{y} {expected}");
        }
    }

    #[test]
    fn shapes_of_four_bearings_equal_full_finite_elements() {
        let rotor = train();
        let mut changed = rotor.clone();
        for (k, bearing) in changed.bearing.iter_mut().enumerate() {
            let constants = bearing.constants_mut().unwrap();
            constants.stiffness_n_m.xx *= 0.6 + 0.3 * k as f64;
            constants.damping_n_s_m.yy *= 2.0 - 0.4 * k as f64;
        }
        let machine = FollowedMachine::of(&rotor);
        for speed_rad_s in [200.0, 400.0, 600.0] {
            let whole = Model::finite_elements(&changed).response(speed_rad_s).unwrap();
            let expected = whole.at(&DVector::from_vec(unbalance()));
            let shown = machine.at(speed_rad_s).unwrap().on(&logs_of(&changed)).unwrap().at(&unbalance());
            let largest = expected.camax();
            for (y, expected) in shown.iter().zip(expected.iter()) {
                assert!((y - expected).norm() < 1e-3 * largest, "{speed_rad_s}: {y} {expected}");
            }
        }
    }

    #[test]
    fn three_bearings_updated_equal_model_made_with_them() {
        let mut rotor = sample_rotor();
        let middle = Bearing { name: "C".into(), position_m: 0.5, ..rotor.bearing[0].clone() };
        rotor.bearing.insert(1, middle);
        rotor.bearing[2].pedestal = Some(Pedestal::isotropic(9e8, 2e4, 60.0));
        rotor.plane.push(Plane { name: "3".into(), position_m: 0.5, ..rotor.plane[0].clone() });
        let basis = basis::supported(&Model::finite_elements(&rotor), tracking(rotor.bearing.len()));
        let mut changed = rotor.clone();
        for (k, bearing) in changed.bearing.iter_mut().enumerate() {
            let constants = bearing.constants_mut().unwrap();
            constants.stiffness_n_m.xx *= 0.5 + 0.4 * k as f64;
            constants.damping_n_s_m.yy *= 2.0 - 0.6 * k as f64;
        }
        let unbalance = [unbalance(), vec![C::new(1e-4, 1e-4)]].concat();
        let whole = Model::finite_elements(&changed).projected(&basis).response(SPEED).unwrap();
        let expected = whole.at(&DVector::from_vec(unbalance.clone()));
        let point = FollowedMachine::of(&rotor).at(SPEED).unwrap();
        let logs = logs_of(&changed);
        assert_eq!(logs.len(), 12);
        let response = point.on(&logs).unwrap();
        for (y, expected) in response.at(&unbalance).iter().zip(expected.iter()) {
            assert!((y - expected).norm() < 1e-9 * expected.norm(), "{y} {expected}");
        }
        let influence = response.influence().per_unbalance;
        assert!((influence - &whole.per_unbalance).camax() < 1e-9 * whole.per_unbalance.camax());
    }

    /// Bearings of every law that is followed in numbers of its own, and one of magnets.
    fn any_law() -> Rotor {
        let mut rotor = train();
        rotor.bearing[0].law = table(15_000.0);
        rotor.bearing[1].law = film(3000.0);
        rotor.bearing[1].pedestal = Some(Pedestal::isotropic(9e8, 2e4, 60.0));
        rotor.bearing[2].law = Law::Magnetic(Magnetic { stiffness_n_m: -1e6, damping_n_s_m: 0.0 });
        rotor
    }

    #[test]
    fn bearings_of_any_law_updated_equal_model_made_with_them() {
        let rotor = any_law();
        let logs: Logs =
            logs_of(&rotor).iter().enumerate().map(|(i, log)| log + 0.05 * (i as f64 - 4.0)).collect();
        let mut changed = rotor.clone();
        for (bearing, b) in changed.bearing.iter_mut().enumerate() {
            let law = b.law.as_law_mut();
            let mut x: Vec<f64> = law.unknowns().iter().map(|u| u.stated).collect();
            for (n, log) in followed(&rotor).iter().zip(&logs).filter(|(n, _)| n.bearing == bearing) {
                x[n.place] = *log;
            }
            law.assign(&x);
        }
        let basis = basis::supported(&Model::finite_elements(&rotor), tracking(rotor.bearing.len()));
        let whole = Model::finite_elements(&changed).projected(&basis).response(SPEED).unwrap();
        let expected = whole.at(&DVector::from_vec(unbalance()));
        let shown = FollowedMachine::of(&rotor).at(SPEED).unwrap().on(&logs).unwrap().at(&unbalance());
        for (y, expected) in shown.iter().zip(expected.iter()) {
            assert!((y - expected).norm() < 1e-9 * expected.norm(), "{y} {expected}");
        }
    }

    #[test]
    fn slopes_are_half_of_constants_and_all_of_a_film() {
        let sample = FollowedMachine::of(&sample_rotor()).at(SPEED).unwrap();
        let logs = logs_of(&sample_rotor());
        let of_stiffness = sample.direct_slopes(0, Role::Stiffness, &logs, &[0, 1, 4, 5]);
        for (slope, expected) in of_stiffness.iter().zip([0.5, 0.5, 0.0, 0.0]) {
            assert!((slope - expected).abs() < 1e-9, "{of_stiffness:?}");
        }
        let point = FollowedMachine::of(&any_law()).at(SPEED).unwrap();
        let [_, viscosity, load] =
            point.direct_slopes(1, Role::Damping, &logs_of(&any_law()), &[8, 9, 10])[..]
        else {
            panic!("three numbers of a film");
        };
        // at one Sommerfeld number damping goes with viscosity, and the load changes that number alone
        assert!((viscosity + load - 1.0).abs() < 1e-3, "{viscosity} {load}");
    }

    #[test]
    fn known_weights_add_to_unbalance_on_any_bearings() {
        let (_, logs) = changed();
        let weights = [C::new(5e-5, 2e-5), C::new(-3e-5, 1e-5)];
        let without = FollowedMachine::of(&sample_rotor()).at(SPEED).unwrap();
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
        let point = FollowedMachine::of(&sample_rotor()).at(SPEED).unwrap().with_weights(&weights);
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

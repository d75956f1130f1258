//! The fitting engine's small update against the full dynamic stiffness, on the reference rotors.

use crate::machine::drawing::Rotor;
use crate::machine::tolerance::Offsets;
use crate::model::Model;
use crate::receptance::modal_shaft::{Force, ModalShaft};
use crate::receptance::update::{Receptances, Supports, UpdatedResponse};
use crate::reduction::nodal::Shaft;
use crate::rotor_file;
use nalgebra::{Complex, DMatrix};

type C = Complex<f64>;

/// Nominal spring at the bearings, N/m; it differs from their own stiffness, so the update is not trivial.
const NOMINAL_N_M: f64 = 4e7;

/// A reference rotor with cross-coupled bearings and a probe at an odd angle.
fn rotor(name: &str) -> Rotor {
    let path = format!("{}/../tests/reference/rotors/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let mut rotor = rotor_file::read(path.as_ref()).unwrap();
    let [left, right] = [0, 1].map(|b| rotor.bearing[b].constants().unwrap().stiffness_n_m);
    rotor.bearing[0].constants_mut().unwrap().stiffness_n_m.xy = 0.2 * left.xx;
    rotor.bearing[1].constants_mut().unwrap().stiffness_n_m.yx = -0.3 * right.yy;
    rotor.probe[1].angle_deg = 127.0;
    rotor
}

/// The engine's receptances for unbalance in the rotor's planes, on all its finite elements.
fn receptances(rotor: &Rotor, speed_rad_s: f64) -> Receptances {
    let plant =
        ModalShaft::new(rotor, &Shaft::unreduced(rotor), &Offsets::default(), NOMINAL_N_M, &[speed_rad_s])
            .unwrap();
    let unbalance =
        |position_m| vec![(plant.column(Force::UnbalanceAt(position_m)), C::from(speed_rad_s.powi(2)))];
    let columns: Vec<_> = rotor.plane.iter().map(|p| unbalance(p.position_m)).collect();
    Receptances::new(&plant, speed_rad_s, 0.0, &[0, 1], &columns)
}

fn bearings(model: &Model, speed_rad_s: f64) -> DMatrix<C> {
    let mut all = DMatrix::zeros(4, 4);
    for (i, s) in model.supports.iter().enumerate() {
        all.fixed_view_mut::<2, 2>(2 * i, 2 * i).copy_from(&s.law.dynamic_stiffness(speed_rad_s, [0.0; 2]));
    }
    all
}

/// Probes × planes.
fn table(response: &UpdatedResponse) -> DMatrix<C> {
    let planes = response.held.ncols();
    DMatrix::from_column_slice(response.probes.len() / planes, planes, &response.probes)
}

#[test]
fn updated_receptances_equal_full_dynamic_stiffness_solution() {
    for name in ["compressor", "kit", "overhung", "turbine"] {
        let rotor = rotor(name);
        let model = Model::finite_elements(&rotor);
        for speed in [150.0, 600.0, 1150.0] {
            let fast = table(
                &receptances(&rotor, speed)
                    .respond(Supports::joined(bearings(&model, speed)), Vec::new())
                    .unwrap(),
            );
            let full = model.response(speed).unwrap().per_unbalance;
            let error = (&fast - &full).norm() / full.norm();
            assert!(error < 1e-8, "{name} at {speed} rad/s: {error:e}");
        }
    }
}

#[test]
fn response_next_to_a_nominal_critical_keeps_its_digits() {
    let rotor = rotor("turbine");
    let model = Model::finite_elements(&rotor);
    let shaft = Shaft::unreduced(&rotor);
    let on_nominal_springs = ModalShaft::new(&rotor, &shaft, &Offsets::default(), NOMINAL_N_M, &[]).unwrap();
    for modes in [&on_nominal_springs.forward, &on_nominal_springs.backward] {
        let slowest = modes.mu.iter().copied().fold(0.0, f64::max).sqrt().recip();
        let speed = slowest * (1.0 + 1e-7);
        let updated = receptances(&rotor, speed);
        let fast = table(&updated.respond(Supports::joined(bearings(&model, speed)), Vec::new()).unwrap());
        let full = model.response(speed).unwrap().per_unbalance;
        let error = (&fast - &full).norm() / full.norm();
        assert!(error < 1e-8, "{speed} rad/s: {error:e}");
    }
}

#[test]
fn receptance_sensitivity_equals_finite_differences() {
    let rotor = rotor("turbine");
    let model = Model::finite_elements(&rotor);
    let speed = 900.0;
    let receptances = receptances(&rotor, speed);
    let at = bearings(&model, speed);
    let now = receptances.respond(Supports::joined(at.clone()), Vec::new()).unwrap();
    for row in 0..4 {
        for column in 0..4 {
            let mut unit = DMatrix::<C>::zeros(4, 4);
            unit[(row, column)] = C::from(1.0);
            let moved = |by: f64| {
                table(&receptances.respond(Supports::joined(&at + &unit * C::from(by)), Vec::new()).unwrap())
            };
            let step = 1e4;
            let slope = (moved(step) - moved(-step)) / C::from(2.0 * step);
            for p in 0..rotor.probe.len() {
                for j in 0..rotor.plane.len() {
                    let exact = -now.adjoint.column(p).dot(&(&unit * now.held.column(j)));
                    let error = (exact - slope[(p, j)]).norm() / slope.norm();
                    assert!(error < 1e-5, "{row}{column}, probe {p}, plane {j}: {error:e}");
                }
            }
        }
    }
}

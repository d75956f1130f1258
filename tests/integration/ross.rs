//! Finite elements of the desktop crate against ROSS 2.3.0 on the same mesh, and the reduced basis
//! against those finite elements.

use nalgebra::{Complex, DVector};
use rotor_edge_desktop::machine::drawing::{Formulation, Rotor};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::reduction::basis;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::shaft::assumed_modes;
use rotor_edge_desktop::shaft::mesh::Mesh;
use rotor_edge_desktop::shaft::structure::ELEMENTS_PER_SEGMENT;
use rotor_edge_desktop::unbalance::phasor_kg_m;
use rotor_edge_desktop::units::rad_s;
use rotor_edge_tests::repository;
use serde_json::Value;

const ROTORS: [&str; 4] = ["turbine", "kit", "compressor", "overhung"];
/// Design: desktop elements against ROSS on the same mesh.
const ROSS_TOLERANCE: f64 = 1e-6;
/// Design: six shape functions a plane against full finite elements, 0 to 12,000 rpm.
const BASIS_TOLERANCE: f64 = 2e-3;

fn load(name: &str) -> (Rotor, Value) {
    let rotor = rotor_file::read(&repository(&format!("tests/reference/rotors/{name}.toml"))).unwrap();
    let text = std::fs::read_to_string(repository(&format!("tests/reference/ross/{name}.json"))).unwrap();
    (rotor, serde_json::from_str(&text).unwrap())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn unbalance(response: &Value) -> DVector<Complex<f64>> {
    let planes = response["unbalance"].as_array().unwrap();
    DVector::from_iterator(
        planes.len(),
        planes.iter().map(|u| {
            phasor_kg_m(u["magnitude_kg_m"].as_f64().unwrap() * 1e6, u["angle_deg"].as_f64().unwrap())
        }),
    )
}

/// Largest difference at any speed, relative to the largest probe at that speed.
fn worst_response(model: &Model, reference: &Value) -> f64 {
    let u = unbalance(reference);
    let probes = reference["probes"].as_array().unwrap();
    let mut worst = 0.0_f64;
    for (k, speed_rpm) in numbers(&reference["speed_rpm"]).into_iter().enumerate() {
        let ours = model.response(rad_s(speed_rpm)).unwrap().at(&u);
        let ross = DVector::from_iterator(
            probes.len(),
            probes.iter().map(|p| Complex::new(numbers(&p["cos_m"])[k], -numbers(&p["sin_m"])[k])),
        );
        worst = worst.max((ours - &ross).camax() / ross.camax());
    }
    worst
}

#[test]
fn mesh_is_the_one_ross_was_given() {
    for name in ROTORS {
        let (rotor, ross) = load(name);
        let nodes = Mesh::new(&rotor, ELEMENTS_PER_SEGMENT).nodes_m;
        let reference = numbers(&ross["mesh_m"]);
        assert_eq!(nodes.len(), reference.len(), "{name}");
        assert!(nodes.iter().zip(&reference).all(|(a, b)| (a - b).abs() < 1e-9), "{name}");
    }
}

#[test]
fn unbalance_response_equals_ross_on_four_rotors() {
    for name in ROTORS {
        let (rotor, ross) = load(name);
        let worst = worst_response(&Model::finite_elements(&rotor), &ross["response"]);
        println!("{name}: unbalance response within {worst:.1e} of ROSS");
        assert!(worst < ROSS_TOLERANCE, "{name}: {worst:e}");
    }
}

#[test]
fn each_physics_switch_equals_ross_with_the_same_flag_off() {
    let (rotor, ross) = load("turbine");
    for variation in ross["variations"].as_array().unwrap() {
        let mut changed = rotor.clone();
        match variation["off"].as_str().unwrap() {
            "gyroscopic" => changed.physics.gyroscopic = false,
            "shear_deformation" => changed.physics.shear_deformation = false,
            "rotary_inertia" => changed.physics.rotary_inertia = false,
            other => panic!("unknown flag {other}"),
        }
        let worst = worst_response(&Model::finite_elements(&changed), &variation["response"]);
        assert!(worst < ROSS_TOLERANCE, "{}: {worst:e}", variation["off"]);
        let unchanged = worst_response(&Model::finite_elements(&rotor), &variation["response"]);
        assert!(unchanged > 1e-4, "{} must matter, or this test tests nothing", variation["off"]);
    }
}

#[test]
fn natural_frequencies_equal_ross_at_rest_and_at_speed() {
    for name in ROTORS {
        let (rotor, ross) = load(name);
        let mut undamped = rotor.clone();
        for b in &mut undamped.bearing {
            b.constants_mut().unwrap().damping_n_s_m =
                rotor_edge_desktop::machine::drawing::Coefficients { xx: 0.0, yy: 0.0, xy: 0.0, yx: 0.0 };
        }
        for set in ross["eigenvalues"].as_array().unwrap() {
            let machine = if set["damped"].as_bool().unwrap() { &rotor } else { &undamped };
            let ours = Model::finite_elements(machine)
                .eigenvalues(rad_s(set["speed_rpm"].as_f64().unwrap()))
                .unwrap();
            for mode in set["modes"].as_array().unwrap() {
                let reference = Complex::new(mode["re"].as_f64().unwrap(), mode["im"].as_f64().unwrap());
                let nearest = ours.iter().map(|v| (v - reference).norm()).fold(f64::INFINITY, f64::min);
                assert!(
                    nearest < ROSS_TOLERANCE * reference.norm(),
                    "{name} {set}: {reference} is off by {nearest}"
                );
            }
        }
    }
}

/// Worst difference of a reduced model from full finite elements, 500 to 12,000 rpm.
fn worst_reduction(rotor: &Rotor, reduced: &Model) -> f64 {
    let full = Model::finite_elements(rotor);
    let mut worst = 0.0_f64;
    for speed_rpm in (1..=24).map(|k| 500.0 * f64::from(k)) {
        let reference = full.response(rad_s(speed_rpm)).unwrap().per_unbalance;
        let ours = reduced.response(rad_s(speed_rpm)).unwrap().per_unbalance;
        worst = worst.max((ours - &reference).camax() / reference.camax());
    }
    worst
}

#[test]
fn six_supported_shapes_equal_full_fem_to_0_2_percent() {
    let (rotor, _) = load("turbine");
    let worst = worst_reduction(&rotor, &basis::reduced(&rotor, 6));
    println!("supported basis of six: within {:.3} % of full finite elements", worst * 100.0);
    assert!(worst < BASIS_TOLERANCE, "{worst}");
}

#[test]
fn supported_basis_converges_also_with_changed_bearing() {
    let (rotor, _) = load("turbine");
    let errors: Vec<f64> =
        [4, 6, 8, 12].map(|n| worst_reduction(&rotor, &basis::reduced(&rotor, n))).to_vec();
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
    // made on the old bearings, used with new ones: the static shapes are there for this
    let mut changed = rotor.clone();
    changed.bearing[1].constants_mut().unwrap().stiffness_n_m.xx *= 0.5;
    changed.bearing[1].constants_mut().unwrap().stiffness_n_m.yy *= 1.3;
    let basis = basis::supported(&Model::finite_elements(&rotor), 6);
    let worst = worst_reduction(&changed, &Model::finite_elements(&changed).projected(&basis));
    assert!(worst < 5e-3, "{worst}");
}

#[test]
fn free_free_modes_converge_slowly_to_elements_without_shear() {
    let (mut rotor, _) = load("turbine");
    rotor.physics.shear_deformation = false;
    let on = |size| worst_reduction(&rotor, &Model::on(assumed_modes::structure(&rotor, size), &rotor));
    let (six, sixteen) = (on(6), on(16));
    assert!(sixteen < 0.02, "the same theory in the limit: {sixteen}");
    assert!(six > 10.0 * BASIS_TOLERANCE, "why it is not the default: {six}");
}

#[test]
fn standard_formulation_equals_ross_and_printed_2023_differs() {
    let (rotor, ross) = load("turbine");
    let mut printed = rotor.clone();
    printed.physics.formulation = Formulation::Printed2023;
    let worst = worst_response(&Model::finite_elements(&printed), &ross["response"]);
    assert!(worst > 1e-3, "the −Ω²N term must show: {worst}");
    assert!(worst_response(&Model::finite_elements(&rotor), &ross["response"]) < ROSS_TOLERANCE);
}

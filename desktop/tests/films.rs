//! Machines on oil films whose geometry is known: what wears is found, what is as usual is not called a fault.

use nalgebra::DVector;
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, StandardNormal};
use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::diagnose::{Verdict, diagnose};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::machine::rotor_file;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::unbalance::phasor_kg_m;

type C = nalgebra::Complex<f64>;

/// A flexible shaft with two wheels on plain journal bearings, X/Y probes at both.
const MACHINE: &str = r#"
schema = 2
name = "two films"
noise = { relative = 0.01, floor_um = 0.05 }
[[shaft]]
length_m = 1.2
outer_diameter_m = 0.09
[[disk]]
name = "wheel 1"
position_m = 0.45
mass_kg = 40.0
diametral_inertia_kg_m2 = 0.4
polar_inertia_kg_m2 = 0.75
[[disk]]
name = "wheel 2"
position_m = 0.75
mass_kg = 35.0
diametral_inertia_kg_m2 = 0.35
polar_inertia_kg_m2 = 0.65
[[bearing]]
name = "A"
position_m = 0.1
film = { kind = "plain", diameter_m = 0.08, length_m = 0.04, radial_clearance_m = 8e-5, viscosity_pa_s = 0.018 }
[[bearing]]
name = "B"
position_m = 1.1
film = { kind = "plain", diameter_m = 0.08, length_m = 0.04, radial_clearance_m = 8e-5, viscosity_pa_s = 0.018 }
[[probe]]
name = "AX"
bearing = "A"
position_m = 0.16
angle_deg = 45.0
[[probe]]
name = "AY"
bearing = "A"
position_m = 0.16
angle_deg = 135.0
[[probe]]
name = "BX"
bearing = "B"
position_m = 1.04
angle_deg = 45.0
[[probe]]
name = "BY"
bearing = "B"
position_m = 1.04
angle_deg = 135.0
[[plane]]
name = "left"
position_m = 0.45
[[plane]]
name = "right"
position_m = 0.75
"#;

fn drawn() -> Rotor {
    rotor_file::parse("rotor.toml", MACHINE).unwrap()
}

/// A run-up of the machine with the film at B changed: clearance and viscosity times factors.
fn measured(clearance: f64, viscosity: f64, seed: u64) -> Vec<Reading> {
    let text = MACHINE.replacen("8e-5", "CLEARANCE", 1).replacen(
        "radial_clearance_m = 8e-5, viscosity_pa_s = 0.018",
        &format!("radial_clearance_m = {}, viscosity_pa_s = {}", 8e-5 * clearance, 0.018 * viscosity),
        1,
    );
    let truth = rotor_file::parse("truth.toml", &text.replace("CLEARANCE", "8e-5")).unwrap();
    let model = Model::finite_elements(&truth);
    let unbalance = DVector::from_vec(vec![phasor_kg_m(600.0, 30.0), phasor_kg_m(500.0, -80.0)]);
    let mut random = StdRng::seed_from_u64(seed);
    (0..45)
        .map(|k| {
            let speed_rpm = 1500.0 + 150.0 * f64::from(k);
            let mut reading = Reading { run: None, time_d: None, speed_rpm, probes: vec![] };
            let y = model.response(reading.speed_rad_s()).unwrap().at(&unbalance);
            let mut noisy = |y: &C| {
                let sigma = 0.01 * y.norm() + 0.05e-6;
                let mut part = || sigma * Distribution::<f64>::sample(&StandardNormal, &mut random);
                Some(y + C::new(part(), part()))
            };
            reading.probes = y.iter().map(&mut noisy).collect();
            reading
        })
        .collect()
}

#[test]
fn a_worn_film_is_found_at_its_bearing_and_its_clearance_is_within_its_interval() {
    let found = diagnose(&drawn(), &measured(1.7, 1.0, 3)).unwrap();
    let first = &found.candidates[0];
    let group = found.indistinguishable.first().cloned().unwrap_or_default();
    let named = first.effect == "worn_clearance" && first.at.as_deref() == Some("B");
    assert!(named || group.contains(&"worn_clearance@B".to_string()), "{} {group:?}", found.summary);
    assert_ne!(found.verdict, Verdict::Adequate, "{}", found.summary);
}

#[test]
fn hot_oil_is_found_at_its_bearing_or_in_its_group() {
    let found = diagnose(&drawn(), &measured(1.0, 0.4, 4)).unwrap();
    let first = &found.candidates[0];
    let group = found.indistinguishable.first().cloned().unwrap_or_default();
    let named = first.effect == "hot_oil" && first.at.as_deref() == Some("B");
    assert!(named || group.contains(&"hot_oil@B".to_string()), "{} {group:?}", found.summary);
}

#[test]
fn films_as_made_and_oil_a_few_kelvin_off_are_no_findings() {
    for (seed, clearance, viscosity) in [(5, 1.0, 1.0), (6, 1.08, 0.9), (7, 0.94, 1.15)] {
        let found = diagnose(&drawn(), &measured(clearance, viscosity, seed)).unwrap();
        assert_eq!(found.verdict, Verdict::Adequate, "{clearance} {viscosity}: {}", found.summary);
    }
}

#[test]
fn the_films_carry_the_rotor_s_whole_weight() {
    let loads: f64 = drawn()
        .bearing
        .iter()
        .map(|b| match &b.law {
            Law::Film(film) => film.load_n(),
            _ => panic!("films only"),
        })
        .sum();
    let shaft_kg = std::f64::consts::PI * 0.09_f64.powi(2) / 4.0 * 1.2 * 7850.0;
    assert!((loads / ((shaft_kg + 75.0) * 9.806_65) - 1.0).abs() < 1e-9, "{loads}");
}

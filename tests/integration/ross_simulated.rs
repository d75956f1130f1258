//! Simulated readings of machines with an effect against ROSS 2.3.0 on a mesh of its own.

use nalgebra::Complex;
use rotor_edge_desktop::machine::drawing::{AddedUnbalance, Noise, ParameterValue, Run};
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::simulate::{SimulationRequest, StatedEffect, simulate};
use rotor_edge_desktop::unbalance::phasor_kg_m;
use rotor_edge_tests::repository;
use serde_json::Value;

const MACHINES: [&str; 5] = ["turbine", "kit", "compressor", "overhung", "coupled_train"];
/// Of the largest probe at each speed; what is left are the two meshes.
const TOLERANCE: f64 = 1e-3;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Of a plane or trial weight, kg·m.
fn unbalance(value: &Value) -> Complex<f64> {
    phasor_kg_m(1e6 * number(&value["kg_m"]), number(&value["angle_deg"]))
}

fn effect(reference: &Value) -> StatedEffect {
    let mut effect = StatedEffect::of_label(reference["with"].as_str().unwrap());
    for (name, value) in reference["set"].as_object().unwrap() {
        let value = match value.as_array().map(Vec::as_slice) {
            Some([size, angle_deg]) => {
                let phasor = Complex::from_polar(number(size), number(angle_deg).to_radians());
                ParameterValue::Phasor([phasor.re, phasor.im])
            }
            _ => ParameterValue::Real(number(value)),
        };
        effect.parameters.push((name.clone(), value));
    }
    effect
}

/// Largest difference at any speed of both runs, relative to the largest probe there.
fn worst(name: &str, with_effect: bool) -> f64 {
    let text = std::fs::read_to_string(repository(&format!("tests/reference/simulate/{name}.json"))).unwrap();
    let reference: Value = serde_json::from_str(&text).unwrap();
    let drawing = format!("tests/reference/{}", reference["rotor"].as_str().unwrap());
    let mut rotor = rotor_file::read(&repository(&drawing)).unwrap();
    let run = |name: &str| Run { name: name.into(), added_unbalance: Vec::new(), slow_roll: false };
    let weight = &reference["weight"];
    let at = rotor.plane.iter().find(|p| p.name == weight["plane"].as_str().unwrap()).unwrap();
    let mut trial = run("trial");
    trial.added_unbalance.push(AddedUnbalance {
        position_m: at.position_m,
        magnitude_g_mm: 1e6 * number(&weight["kg_m"]),
        angle_deg: number(&weight["angle_deg"]),
    });
    rotor.run = vec![run("base"), trial];
    let planes = reference["unbalance"].as_array().unwrap().iter();
    let request = SimulationRequest {
        effects: if with_effect { vec![effect(&reference)] } else { Vec::new() },
        speeds_rpm: reference["speed_rpm"].as_array().unwrap().iter().map(number).collect(),
        unbalance_kg_m: planes.map(|u| (u["plane"].as_str().unwrap().into(), unbalance(u))).collect(),
        noise: Some(Noise::default()),
        ..SimulationRequest::default()
    };
    let found = simulate(&rotor, &request).unwrap();
    assert_eq!(found.readings, found.noise_free);
    let mut worst = 0.0_f64;
    for (k, reading) in found.readings.iter().enumerate() {
        let of_run = reference["runs"][reading.run.as_ref().unwrap()].as_array().unwrap();
        let at = k % request.speeds_rpm.len();
        let ross = of_run.iter().map(|p| Complex::new(number(&p["cos_m"][at]), -number(&p["sin_m"][at])));
        let ross: Vec<Complex<f64>> = ross.collect();
        let largest = ross.iter().map(|y| y.norm()).fold(0.0, f64::max);
        let off = ross.iter().zip(&reading.probes).map(|(ross, ours)| (ours.unwrap() - ross).norm());
        worst = worst.max(off.fold(0.0, f64::max) / largest);
    }
    worst
}

#[test]
fn simulated_machines_with_effects_equal_ross_to_0_1_percent() {
    for name in MACHINES {
        let worst = worst(name, true);
        println!("{name}: simulated readings within {:.4} % of ROSS", 100.0 * worst);
        assert!(worst < TOLERANCE, "{name}: {worst:e}");
    }
}

#[test]
fn each_simulated_effect_matters_in_the_comparison_with_ross() {
    for name in MACHINES {
        let without = worst(name, false);
        assert!(without > 20.0 * TOLERANCE, "{name}: {without:e}");
    }
}

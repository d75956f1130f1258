//! An effect and what it is a special case of: which of the two a diagnosis names.

use std::path::Path;

use nalgebra::Complex;
use rotor_edge_desktop::diagnose::{DiagnosisVerdict, RIVAL, diagnose, improve};
use rotor_edge_desktop::machine::drawing::{EffectEntry, Noise, ParameterValue, Rotor};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::simulate::{SimulationRequest, simulate};
use rotor_edge_desktop::{measurement, rotor_file};

/// A rotor kit, and readings of one whose inboard bearing stands on a pedestal.
fn on_pedestal(kind: &str, parameters: &[(&str, f64)]) -> (Rotor, Vec<Reading>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("machines/single/case-004");
    let mut rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
    let speeds = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
    let noise = Noise { relative: 0.01, floor_um: 0.05, ..Noise::of(&rotor, &speeds) };
    rotor.noise = Some(noise);
    let mut machine = rotor.clone();
    let value = |(name, value): &(&str, f64)| ((*name).to_string(), ParameterValue::Real(*value));
    let parameters = parameters.iter().map(value).collect();
    machine.effect.push(EffectEntry { kind: kind.into(), at: Some("IB".into()), parameters });
    let mut speeds_rpm: Vec<f64> = speeds.iter().map(|r| r.speed_rpm).collect();
    speeds_rpm.sort_by(f64::total_cmp);
    speeds_rpm.dedup();
    let angles_rad = (0..).map(|k| 2.0 * f64::from(k));
    let sizes =
        machine.plane.iter().zip(angles_rad).map(|(p, a)| (p.name.clone(), Complex::from_polar(7e-6, a)));
    let unbalance_kg_m = sizes.collect();
    let request = SimulationRequest {
        speeds_rpm,
        unbalance_kg_m,
        noise: Some(noise),
        seed: 5,
        ..SimulationRequest::default()
    };
    let readings = simulate(&machine, &request).unwrap().readings;
    (rotor, readings)
}

#[test]
fn pedestal_equal_in_both_directions_is_named_as_such() {
    let (rotor, readings) = on_pedestal("pedestal", &[("k", 2.01e6), ("m", 27.4), ("c", 185.0)]);
    let found = diagnose(&rotor, &readings).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Missing, "{}", found.summary);
    let [named, general] = &found.candidates[..2] else { panic!("two candidates") };
    assert_eq!((named.effect, general.effect), ("pedestal", "pedestal_by_direction"));
    assert!(general.probability > RIVAL * named.probability, "{}", general.probability);
    assert!(found.indistinguishable.is_empty(), "{:?}", found.indistinguishable);
    let improved = improve(&rotor, &readings, |_| ()).unwrap();
    let [step] = &improved.steps[..] else { panic!("one effect") };
    assert_eq!(step.added.effect, "pedestal");
    assert!(step.group.is_empty(), "{:?}", step.group);
}

#[test]
fn pedestal_softer_in_one_direction_is_named_as_such() {
    let softer = [("kx", 2.01e6), ("ky", 2.6e6), ("m", 27.4), ("c", 185.0)];
    let (rotor, readings) = on_pedestal("pedestal_by_direction", &softer);
    let found = diagnose(&rotor, &readings).unwrap();
    assert_eq!(found.verdict, DiagnosisVerdict::Missing, "{}", found.summary);
    assert_eq!(found.candidates[0].effect, "pedestal_by_direction");
    assert!(found.indistinguishable.is_empty(), "{:?}", found.indistinguishable);
}

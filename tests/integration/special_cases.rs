//! An effect and what it is a special case of: which of the two a diagnosis names.

use rotor_edge_desktop::diagnose::{DiagnosisVerdict, RIVAL, diagnose, improve};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;

use super::with_effect::HiddenEffect;

/// A rotor kit, and readings of one whose inboard bearing stands on a pedestal.
fn on_pedestal(kind: &str, parameters: &[(&str, f64)]) -> (Rotor, Vec<Reading>) {
    let effect = HiddenEffect {
        machine: "single/case-004",
        kind,
        at: "IB",
        parameters,
        unbalance_kg_m: 7e-6,
        noise: [0.01, 0.05],
        seed: 5,
    };
    effect.simulated()
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

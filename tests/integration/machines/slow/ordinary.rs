//! Machines whose drawing is off by ordinary scatter and states no tolerance.

use crate::machines::machine::{Machine, diagnosed};
use rotor_edge_desktop::diagnose::{Diagnosis, DiagnosisVerdict, PlaneUnbalance};
use rotor_edge_tests::repository;
use serde_json::Value;

/// Magnitude of each plane's true unbalance, g·mm.
fn true_unbalance_g_mm(machine: &Machine) -> Vec<f64> {
    let file = repository("tests/machines").join(&machine.name).join("truth.json");
    let truth: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let planes = truth["unbalance_g_mm_deg"].as_array().unwrap();
    planes.iter().map(|plane| plane[0].as_f64().unwrap()).collect()
}

/// Whether the stated 95 % interval of each plane holds its true unbalance.
fn intervals_that_hold(machine: &Machine, answer: &Diagnosis) -> Vec<bool> {
    let planes = &answer.determined.planes;
    assert_eq!(planes.len(), 2, "{}", machine.name);
    let holds = |(plane, truth): (&PlaneUnbalance, f64)| {
        let [low, high] = plane.interval_95_g_mm;
        (low..=high).contains(&truth)
    };
    planes.iter().zip(true_unbalance_g_mm(machine)).map(holds).collect()
}

#[test]
fn sound_machine_off_its_drawing_is_adequate() {
    let sound: Vec<_> = diagnosed("ordinary").into_iter().filter(|(m, _)| m.truth.is_empty()).collect();
    assert_eq!(sound.len(), 9);
    for (m, answer) in &sound {
        assert_eq!(answer.verdict, DiagnosisVerdict::Adequate, "{}: {}", m.name, answer.summary);
    }
    let held: Vec<bool> = sound.iter().flat_map(|(m, answer)| intervals_that_hold(m, answer)).collect();
    // of 18 intervals that hold with 95 % fewer than 15 do once in a hundred times
    let count = held.iter().filter(|held| **held).count();
    assert!(count >= 15, "{count} of {}", held.len());
}

#[test]
fn hidden_effect_off_an_ordinary_drawing_is_named() {
    let hiding = diagnosed("ordinary").into_iter().filter(|(m, _)| !m.truth.is_empty());
    for (m, answer) in hiding {
        assert!(m.is_named_by(&answer), "{} hides {}: {}", m.name, m.truth_label(), answer.summary);
        if m.truth_label() == "probe_calibration@BX" {
            let said = "Probe BX does not show what the others do: gain ";
            assert!(answer.summary.starts_with(said), "{}", answer.summary);
            assert_eq!(answer.bad_probe.as_deref(), Some("BX"));
        }
    }
}

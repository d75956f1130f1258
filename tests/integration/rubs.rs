//! A disk that touches: at every speed, and at a resonance alone.

use rotor_edge_desktop::diagnose::{DiagnosisVerdict, diagnose};

use super::with_effect::HiddenEffect;

/// So light a contact holds nothing back; its friction takes part of the damping away.
#[test]
fn light_rub_at_every_speed_is_found_by_its_friction() {
    let parameters = [("k", 408.0), ("clearance", 4.4e-6), ("mu", 0.15)];
    for seed in 1..=4 {
        let effect = HiddenEffect {
            machine: "single/case-004",
            kind: "rub",
            at: "disk 1",
            parameters: &parameters,
            unbalance_kg_m: 7e-6,
            noise: [0.01, 0.05],
            seed,
        };
        let (rotor, readings) = effect.simulated();
        let found = diagnose(&rotor, &readings).unwrap();
        let is_rub = |label: &String| label == "rub@disk 1";
        let group = found.indistinguishable.first();
        let is_named = found.candidates[0].effect == "rub" || group.is_some_and(|g| g.iter().any(is_rub));
        assert!(found.nothing_missing < 0.05 && is_named, "{seed}: {} {group:?}", found.summary);
    }
}

/// Without the speeds at which the disk touches, nothing tells how hard, so that the prediction there cannot be held against the rub.
#[test]
fn rub_at_resonance_is_not_doubted_for_speeds_left_out() {
    let effect = HiddenEffect {
        machine: "ordinary/001-pedestal",
        kind: "rub",
        at: "left",
        parameters: &[("k", 20_000.0), ("clearance", 1.8e-5), ("mu", 0.15)],
        unbalance_kg_m: 3e-4,
        noise: [0.004, 0.02],
        seed: 3,
    };
    let (rotor, readings) = effect.simulated();
    let found = diagnose(&rotor, &readings).unwrap();
    let held_out = found.held_out.unwrap();
    assert_eq!(found.candidates[0].label(), "rub@left", "{}", found.summary);
    assert_ne!(found.verdict, DiagnosisVerdict::Unknown, "{}", found.summary);
    assert!(!held_out.worse && held_out.after < held_out.before, "{held_out:?}");
}

//! What is checked in for the boards is what the desktop makes today.

use std::fs;

use rotor_edge::edge::EdgeModel;
use rotor_edge_core::reading::rad_s;
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_tests::firmware::{BoardSample, model_bytes};
use rotor_edge_tests::repository;

const AGAIN: &str = "make it again: cargo run --release -p rotor-edge-tests --example make_board_sample";

fn checked_in(name: &str) -> Vec<u8> {
    fs::read(repository("boards/sample").join(name)).unwrap()
}

/// Largest difference of the features over the speed range, of the largest feature.
///
/// Not the bytes: the desktop's fits use the platform's sine and logarithm, whose last bit may differ.
fn difference(left: &EdgeModel, right: &EdgeModel) -> f32 {
    let mut worst = 0.0_f32;
    for speed_rpm in [1_500.0, 4_000.0, 8_000.0, 11_000.0] {
        let features = |model: &EdgeModel| -> Vec<f32> {
            let at_speed = response(model, rad_s(speed_rpm), &SupportAmplitudes::default()).unwrap();
            let shown = at_speed.probes()[..model.description().probes.len()].iter();
            shown
                .map(|probe| probe.phasor(left.description().initial_unbalance_g_mm))
                .flat_map(|y| [y.re, y.im])
                .collect()
        };
        let (left, right) = (features(left), features(right));
        let largest = left.iter().fold(0.0_f32, |largest, x| largest.max(x.abs()));
        for (l, r) in left.iter().zip(right) {
            worst = worst.max((l - r).abs() / largest);
        }
    }
    worst
}

#[test]
fn board_models_equal_present_ones_and_fit_two_kibibytes() {
    let today = BoardSample::make().unwrap();
    for (name, today) in [("model.bin", &today.model), ("better.bin", &today.better)] {
        let bytes = checked_in(name);
        assert!(bytes.len() < 2048, "{name}: {} bytes", bytes.len());
        assert_eq!(bytes.len(), model_bytes(today).len(), "{name}: {AGAIN}");
        let stored = EdgeModel::decode(&bytes).unwrap();
        let difference = difference(&stored, today);
        assert!(difference < 1e-5, "{name} differs by {difference:e}; {AGAIN}");
    }
    assert!(checked_in("readings.bin") == today.reading_bytes(), "readings.bin; {AGAIN}");
}

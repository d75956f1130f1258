use super::*;
use crate::model::tests::rigid_rotor;
use crate::model::{Model, Support};

const SPEED_RPM: f32 = 9000.0;

/// What the model itself would show, with the amplitudes at hardening supports iterated to rest.
fn shown<const N: usize>(model: &Model<N>, unbalance: [Pair; 2]) -> Reading {
    let speed = crate::reading::rad_s(SPEED_RPM);
    let mut amplitudes = SupportAmplitudes::default();
    for _ in 0..200 {
        let aim = response(model, speed, &amplitudes).unwrap().support_amplitudes(&unbalance);
        approach(&mut amplitudes, &aim, 0.5);
    }
    let [[a, b], [c, d]] = unbalance;
    let features = response(model, speed, &amplitudes).unwrap().features(&[a, b, c, d]);
    Reading { speed_rpm: SPEED_RPM, probes: probe_vectors(&features) }
}

fn differs_by(found: [Pair; 2], want: [Pair; 2]) -> f32 {
    let pairs = found.as_flattened().iter().zip(want.as_flattened());
    pairs.fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

#[test]
fn a_known_unbalance_comes_back_from_the_models_own_response() {
    let model = rigid_rotor();
    let truth = [[3300.0, 3900.0], [-1100.0, 1900.0]];
    let estimate =
        Tracker::new(&model).update(&TrackConfig::default(), &model, &shown(&model, truth)).unwrap();
    assert!(differs_by(estimate.unbalance_g_mm, truth) < 0.1, "{:?}", estimate.unbalance_g_mm);
    assert!(estimate.residual.ratio < 1e-5);
    assert_eq!(estimate.at_bound, [false; 2]);
}

#[test]
fn static_and_dynamic_put_together_are_the_planes() {
    let model = rigid_rotor();
    let reading = shown(&model, model.initial_unbalance_g_mm);
    let estimate = Tracker::new(&model).update(&TrackConfig::default(), &model, &reading).unwrap();
    for i in 0..2 {
        let [half, dynamic] = [0.5 * estimate.static_g_mm[i], estimate.dynamic_g_mm[i]];
        assert!((half + dynamic - estimate.unbalance_g_mm[0][i]).abs() < 1e-2);
        assert!((half - dynamic - estimate.unbalance_g_mm[1][i]).abs() < 1e-2);
    }
}

#[test]
fn a_jump_by_three_is_followed_at_the_bound_and_caught_up_after_seven_readings() {
    let model = rigid_rotor();
    let truth = model.initial_unbalance_g_mm.map(|u| u.map(|x| 3.0 * x));
    let reading = shown(&model, truth);
    let mut tracker = Tracker::new(&model);
    let mut residuals = std::vec::Vec::new();
    for number in 1..=9 {
        let estimate = tracker.update(&TrackConfig::default(), &model, &reading).unwrap();
        // 1.2⁶ = 2.99 < 3 < 1.2⁷.
        assert_eq!(estimate.at_bound, [number < 7; 2], "reading {number}");
        residuals.push(estimate.residual.e_um);
    }
    assert!(residuals[..7].windows(2).all(|pair| pair[1] < pair[0]), "{residuals:?}");
    assert!(differs_by(tracker.last_g_mm(), truth) < 0.5);
}

#[test]
fn a_balanced_plane_can_grow_again_from_the_floor() {
    let mut model = rigid_rotor();
    let truth = [[80.0, 0.0], [0.0, -90.0]];
    let reading = shown(&model, truth);
    model.initial_unbalance_g_mm = [[0.0; 2]; 2];
    let estimate = Tracker::new(&model).update(&TrackConfig::default(), &model, &reading).unwrap();
    assert!(differs_by(estimate.unbalance_g_mm, truth) < 0.01);
}

#[test]
fn one_plane_has_no_dynamic_unbalance_and_keeps_the_second_at_zero() {
    let mut model = rigid_rotor();
    model.planes.truncate(1);
    model.initial_unbalance_g_mm[1] = [0.0; 2];
    let reading = shown(&model, [[2000.0, 100.0], [0.0; 2]]);
    let estimate = Tracker::new(&model).update(&TrackConfig::default(), &model, &reading).unwrap();
    assert!(differs_by(estimate.unbalance_g_mm, [[2000.0, 100.0], [0.0; 2]]) < 0.05);
    assert_eq!(estimate.dynamic_g_mm, [0.0; 2]);
    assert_eq!(estimate.static_g_mm, estimate.unbalance_g_mm[0]);
}

#[test]
fn hardening_supports_are_followed_to_their_amplitude() {
    let mut model = rigid_rotor();
    for support in &mut model.supports {
        *support = Support { hardening_per_um2: 2e-6, ..support.clone() };
    }
    let truth = [[3100.0, 4100.0], [-900.0, 2100.0]];
    let reading = shown(&model, truth);
    let mut tracker = Tracker::new(&model);
    let estimate = tracker.update(&TrackConfig::default(), &model, &reading).unwrap();
    let rounds = estimate.amplitude_rounds;
    assert!((1..=8).contains(&rounds));
    assert!(differs_by(estimate.unbalance_g_mm, truth) < 20.0, "{rounds}: {:?}", estimate.unbalance_g_mm);
    assert!(estimate.residual.ratio < 5e-3);
    for _ in 0..3 {
        tracker.update(&TrackConfig::default(), &model, &reading).unwrap();
    }
    assert!(differs_by(tracker.last_g_mm(), truth) < 2.0, "{:?}", tracker.last_g_mm());
    // Without the hardening the same reading does not fit.
    let linear = TrackConfig { amplitude_rounds: 0, ..TrackConfig::default() };
    let without = Tracker::new(&model).update(&linear, &model, &reading).unwrap();
    assert!(differs_by(without.unbalance_g_mm, truth) > 5.0 * differs_by(estimate.unbalance_g_mm, truth));
}

#[test]
fn a_reading_that_cannot_be_used_leaves_the_tracker_as_it_was() {
    let model = rigid_rotor();
    let good = shown(&model, model.initial_unbalance_g_mm);
    let mut tracker = Tracker::new(&model);
    let before = tracker;
    let mut lost = good;
    lost.probes[2] = ProbeVector::LOST;
    assert_eq!(tracker.update(&TrackConfig::default(), &model, &lost), Err(TrackError::Incomplete));
    let fast = Reading { speed_rpm: 13_000.0, ..good };
    assert_eq!(tracker.update(&TrackConfig::default(), &model, &fast), Err(TrackError::Speed));
    assert_eq!(tracker, before);
}

#[test]
fn equal_readings_give_equal_bits() {
    let model = rigid_rotor();
    let reading = shown(&model, [[2500.0, 4100.0], [-1100.0, 1800.0]]);
    let run = || Tracker::new(&model).update(&TrackConfig::default(), &model, &reading).unwrap();
    assert_eq!(run(), run());
}

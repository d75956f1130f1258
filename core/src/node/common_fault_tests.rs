//! Faults common to all probes, or of one place: the model may fit, and yet nothing can be trusted.

use std::vec::Vec;

use nalgebra::Complex;

use super::testing::*;
use super::*;
use crate::can::FLAG_SUSPICIOUS;
use crate::command::{Command, Outcome};
use crate::model::tests::rigid_rotor;
use crate::reading::{ProbeVector, Reading};
use crate::state::NodeState;
use crate::testing::Random;

type C = Complex<f32>;

/// A reading with each probe's phasor times a factor.
fn altered(reading: Reading, factor: impl Fn(usize) -> C) -> Reading {
    let probes = reading.probes().iter().enumerate();
    let vectors: Vec<_> =
        probes.map(|(place, probe)| ProbeVector::from_phasor(factor(place) * probe.phasor())).collect();
    Reading::new(reading.speed_rpm, &vectors).unwrap()
}

fn turn(degrees: f32) -> C {
    let (sin, cos) = degrees.to_radians().sin_cos();
    C::new(cos, sin)
}

fn gain(factor: f32) -> C {
    C::new(factor, 0.0)
}

/// What becomes of a node that tracks and then gets readings altered like this for 20 s.
fn after(factor: impl Fn(usize) -> C) -> (TestNode, Store, u64) {
    let (mut node, mut store, time_us) = tracking();
    let time_us = run(&mut node, &mut store, time_us, 20.0, |_| altered(reading(1.0), &factor));
    (node, store, time_us)
}

#[test]
fn turned_phase_reference_is_flagged_as_the_keyphasor() {
    for degrees in [15.0, 30.0, 45.0, 90.0, 180.0, -60.0] {
        let (mut node, mut store, time_us) = after(|_| turn(degrees));
        let status = node.status(time_us);
        let expected = (NodeState::Flagged, Reason::Keyphasor, Reason::Keyphasor, None);
        assert_eq!((status.state, status.reason, status.cause, status.suspect), expected, "{degrees}");
        let time_us = run(&mut node, &mut store, time_us, 5.0, |_| reading(1.0));
        assert_eq!(now(&node, time_us), (NodeState::Flagged, Reason::None, 0), "{degrees} undone");
    }
}

#[test]
fn phase_reference_that_walks_or_slips_is_never_healthy() {
    // 720° in an hour, and at daily pace another angle each time.
    let (mut node, mut store, start_us) = tracking();
    let walking = |time_us: u64| altered(reading(1.0), |_| turn(0.2e-6 * (time_us - start_us) as f32));
    let time_us = run(&mut node, &mut store, start_us, 90.0, walking);
    let status = node.status(time_us);
    assert_eq!((status.state, status.cause), (NodeState::Flagged, Reason::Keyphasor));
    let (mut node, mut states) = (TestNode::new(config()).unwrap(), Vec::new());
    node.load(Ok(&encoded(&rigid_rotor()))).unwrap();
    for day in 0..40_u16 {
        let slipped = altered(reading(1.0), |_| turn(if day < 20 { 0.0 } else { 137.5 * f32::from(day) }));
        send(&mut node, u64::from(day) * DAY_US, day, &slipped);
        states.push(node.status(u64::from(day) * DAY_US).state);
    }
    // By chance the second angle is 7.5°.
    assert!(states[20..24].iter().all(|&state| state == NodeState::Suspicious), "{states:?}");
    assert!(states[24..].iter().all(|&state| state == NodeState::Flagged), "{states:?}");
}

#[test]
fn gain_of_all_probes_is_flagged_as_scale_in_either_direction() {
    for factor in [0.1, 0.5, 0.7, 1.4, 3.0] {
        let (node, _, time_us) = after(|_| gain(factor));
        let status = node.status(time_us);
        assert_eq!(status.cause, Reason::Scale, "{factor}: {status:?}");
    }
    // Zeros say nothing once the mean has become nothing as well.
    let (mut node, mut store, start_us) = tracking();
    let mut time_us = start_us;
    for _ in 0..200 {
        time_us = run(&mut node, &mut store, time_us, 0.08, |_| altered(reading(1.0), |_| gain(0.0)));
        let status = node.status(time_us);
        let may_track = time_us - start_us < SECOND_US / 2;
        assert!(may_track || status.state != NodeState::Tracking, "{} us: {status:?}", time_us - start_us);
    }
}

#[test]
fn small_changes_of_all_vectors_are_tracked() {
    for factor in [turn(8.0), turn(-8.0), gain(1.15), gain(0.85)] {
        let (node, _, time_us) = after(|_| factor);
        assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::None, 0), "{factor}");
    }
}

#[test]
fn probe_or_bearing_that_changes_alone_is_named() {
    for probe in 0..4 {
        let (node, _, time_us) = after(|place| gain(if place == probe { -0.5 } else { 1.0 }));
        let status = node.status(time_us);
        assert_eq!((status.reason, status.missing_mask), (Reason::Probe, 1 << probe));
        assert_eq!((status.cause, status.suspect), (Reason::Probe, Some(probe as u8 / 2)));
    }
    for bearing in 0..2 {
        // Both turned alike, a changed unbalance would explain it.
        let unlike = [gain(-1.0), turn(100.0)];
        let (node, _, time_us) =
            after(|place| if place / 2 == bearing { unlike[place % 2] } else { gain(1.0) });
        let status = node.status(time_us);
        assert!(matches!(status.reason, Reason::Rise | Reason::Ratio), "{status:?}");
        assert_eq!((status.missing_mask, status.suspect), (0, Some(bearing as u8)));
    }
}

/// A machine with another unbalance.
fn weighted(unbalance: [[f32; 2]; 2]) -> Reading {
    let mut machine = rigid_rotor();
    machine.initial_unbalance_g_mm = unbalance.into_iter().collect();
    shown(&machine, SPEED_RPM, 1.0)
}

#[test]
fn balancing_weight_is_a_jump_until_it_is_acknowledged() {
    let balanced = weighted([[-900.0, 400.0], [-1000.0, 2000.0]]);
    for power_cut in [false, true] {
        let (mut node, mut store, time_us) = tracking();
        let mut time_us = run(&mut node, &mut store, time_us, 20.0, |_| balanced);
        assert_eq!(now(&node, time_us), (NodeState::Flagged, Reason::Jump, 0));
        let acknowledge = request(Command::Acknowledge, 1, &[]);
        assert_eq!(answer(&mut node, &mut store, time_us, &acknowledge).outcome, Outcome::Accepted);
        if power_cut {
            (node, time_us) = (store.start(), 0);
        }
        let time_us = run(&mut node, &mut store, time_us, 20.0, |_| balanced);
        assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::None, 0), "cut: {power_cut}");
        let [x, y] = node.estimate().unwrap().unbalance_g_mm[0];
        assert!((x + 900.0).abs() < 1.0 && (y - 400.0).abs() < 1.0, "{x} {y}");
        // The weight has come off again.
        let time_us = run(&mut node, &mut store, time_us, 20.0, |_| reading(1.0));
        assert_eq!(now(&node, time_us), (NodeState::Flagged, Reason::Jump, 0), "cut: {power_cut}");
    }
}

#[test]
fn acknowledgement_before_a_heavy_weight_is_enough() {
    let heavy = weighted([[30_000.0, 0.0], [-1000.0, 20_000.0]]);
    let (mut node, mut store, time_us) = tracking();
    let acknowledge = request(Command::Acknowledge, 1, &[]);
    assert_eq!(answer(&mut node, &mut store, time_us, &acknowledge).outcome, Outcome::Accepted);
    let later_us = run(&mut node, &mut store, time_us + 3600 * SECOND_US, 20.0, |_| heavy);
    assert_eq!(now(&node, later_us), (NodeState::Tracking, Reason::None, 0));
    let estimate = node.estimate().unwrap();
    assert!(!estimate.searched && estimate.at_bound == [false; 4]);
}

#[test]
fn after_power_cut_a_turned_reference_is_still_seen() {
    let (_, mut store, _) = tracking();
    let mut node = store.start();
    let time_us = run(&mut node, &mut store, 0, 15.0, |_| altered(reading(1.0), |_| turn(40.0)));
    // The vectors before are lost with the power, so the change has no name.
    assert_eq!(now(&node, time_us), (NodeState::Flagged, Reason::Jump, 0));
}

#[test]
fn misfit_that_comes_and_goes_is_flagged_as_intermittent() {
    // Probe 1 reversed for four seconds of ten, for two readings of three, and every other day.
    for (period_us, bad, length) in [(PERIOD_US, 46, 115), (12 * SECOND_US, 2, 3), (DAY_US, 1, 2)] {
        let mut node = node();
        let mut states = [0; 10];
        let mut time_us = 0;
        for step in 0..2000_u64 {
            let is_bad = step >= 805 && step % length < bad;
            let measured = altered(reading(1.0), |place| gain(if place == 0 && is_bad { -1.0 } else { 1.0 }));
            send(&mut node, time_us, step as u16, &measured);
            sent(&mut node);
            if step > 820 {
                states[usize::from(node.status(time_us).state as u8)] += 1;
            }
            time_us += period_us;
        }
        assert_eq!(node.status(time_us).cause, Reason::Intermittent, "{bad} of {length}");
        assert_eq!(states[NodeState::Tracking as usize], 0, "{bad} of {length}: no flapping");
    }
}

#[test]
fn single_outlier_is_forgotten_after_a_few_seconds() {
    let (mut node, mut store, time_us) = tracking();
    let odd = altered(reading(1.0), |place| gain(if place == 0 { -9.0 } else { 1.0 }));
    let time_us = run(&mut node, &mut store, time_us, 0.08, |_| odd);
    assert_eq!(node.status(time_us).state, NodeState::Suspicious);
    let time_us = run(&mut node, &mut store, time_us, 15.0, |_| reading(1.0));
    assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::None, 0));
}

#[test]
fn gain_repaired_after_days_is_trusted_at_once() {
    let mut node = node();
    let faulty = altered(reading(1.0), |_| gain(0.3));
    for day in 0..30_u16 {
        let is_faulty = (10..20).contains(&day);
        let measured = if is_faulty { faulty } else { reading(1.0) };
        send(&mut node, u64::from(day) * DAY_US, day, &measured);
        let result = results(&mut node)[0];
        assert_eq!(result.flags & FLAG_SUSPICIOUS != 0, is_faulty, "day {day}: {result:?}");
    }
}

#[test]
fn healthy_readings_of_a_model_ten_per_cent_off_are_trusted() {
    const NOISE_UM: f32 = 0.25;
    let mut machine = rigid_rotor();
    machine.noise.floor_um = NOISE_UM;
    let mut real = machine.clone();
    real.supports[0].stiffness_n_m[0][0] *= 0.9;
    real.supports[1].stiffness_n_m[1][1] *= 1.1;
    let mut random = Random::new(78);
    for period_us in [DAY_US, 3600 * SECOND_US, 60 * SECOND_US, PERIOD_US] {
        let mut node = node_with(&machine);
        for step in 0..10_000_u64 {
            // one speed for long, four in turn, and a different one each time
            let speed_rpm = match step / 2000 % 3 {
                0 => 9000.0 * (1.0 + 0.002 * random.signed()),
                1 => 3000.0 * (1 + step / 50 % 4) as f32,
                _ => 7000.0 + 4900.0 * random.signed(),
            };
            let measured = noisy(&shown(&real, speed_rpm, 1.0), NOISE_UM, &mut random);
            send(&mut node, step * period_us, step as u16, &measured);
            for result in results(&mut node) {
                assert_eq!(result.flags & FLAG_SUSPICIOUS, 0, "{speed_rpm} rpm, step {step}: {result:?}");
            }
        }
        assert!(node.counters().readings == 10_000 && node.status(0).cause == Reason::None);
    }
}

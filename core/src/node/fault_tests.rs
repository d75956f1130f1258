//! "Healthy" only when it is known: faults of probes, time and memory.

use std::vec::Vec;

use super::testing::*;
use super::*;
use crate::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS};
use crate::command::Outcome;
use crate::model::tests::rigid_rotor;
use crate::reading::Reading;
use crate::state::NodeState;
use crate::testing::Random;

// Lost probes, keyphasor, speed: no verdict outlives its evidence.

#[test]
fn one_lost_probe_of_four_is_reported_and_fault_still_seen() {
    let (mut node, mut store, time_us) = tracking();
    let time_us = run(&mut node, &mut store, time_us, 20.0, |_| lacking(reading(1.0), 0b0100));
    assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::Probes, 0b0100));
    assert!(node.status(time_us).age_s < 0.1 && node.counters().partial > 200);
    send(&mut node, time_us, 0xf000, &lacking(reading(1.0), 0b0100));
    let result = results(&mut node).pop();
    assert!(result.is_none_or(|r| (r.redundancy, r.used_mask) == (2, 0b1011)));
    let worn = shown(&worn(0.5), SPEED_RPM, 1.0);
    let time_us = run(&mut node, &mut store, time_us, 20.0, |_| lacking(worn, 0b0100));
    assert_eq!(node.status(time_us).state, NodeState::Flagged);
}

#[test]
fn as_many_rows_as_unknowns_is_blind_despite_an_estimate() {
    let (mut node, mut store, time_us) = tracking();
    let time_us = run(&mut node, &mut store, time_us, 5.0, |_| lacking(reading(1.0), 0b0101));
    assert_eq!(now(&node, time_us), (NodeState::Blind, Reason::NoRedundancy, 0b0101));
    // A hundred times the vibration, to which four rows fit anything: it never looks healthy again.
    let huge = lacking(shown(&rigid_rotor(), SPEED_RPM, 0.9), 0b0101);
    let mut time_us = time_us;
    for _ in 0..1000 {
        time_us = run(&mut node, &mut store, time_us, 0.08, |_| huge);
        assert!(matches!(node.status(time_us).state, NodeState::Blind | NodeState::Stale));
    }
    assert_eq!(now(&node, time_us), (NodeState::Stale, Reason::NoRedundancy, 0b0101));
}

#[test]
fn with_fewer_rows_than_unknowns_it_is_blind_and_then_stale() {
    let (mut node, mut store, time_us) = tracking();
    let time_us = run(&mut node, &mut store, time_us, 9.5, |_| lacking(reading(1.0), 0b1110));
    assert_eq!(now(&node, time_us), (NodeState::Blind, Reason::Undetermined, 0b1110));
    let time_us = run(&mut node, &mut store, time_us, 1.0, |_| lacking(reading(1.0), 0b1111));
    assert_eq!(now(&node, time_us), (NodeState::Stale, Reason::Probes, 0b1111));
    let time_us = run(&mut node, &mut store, time_us, 0.2, |_| reading(1.0));
    assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::None, 0));
}

#[test]
fn silence_then_maximum_vibration_is_never_healthy() {
    let (mut node, mut store, time_us) = tracking();
    for time_us in (time_us..time_us + 3600 * SECOND_US).step_by(SECOND_US as usize) {
        node.poll(time_us);
        let age_s = (time_us - 62 * SECOND_US) / SECOND_US;
        assert!(age_s <= 10 || node.status(time_us).state == NodeState::Stale, "{age_s} s");
        sent(&mut node);
    }
    let mut vectors = reading(1.0).probes().to_vec();
    for vector in &mut vectors {
        (vector.cos_um, vector.sin_um) = (90.0 * vector.cos_um, 90.0 * vector.sin_um);
        assert!(vector.cos_um.abs().max(vector.sin_um.abs()) < MAX_PLAUSIBLE_UM);
    }
    vectors[0] = crate::reading::ProbeVector::LOST;
    let shaken = Reading::new(SPEED_RPM, &vectors).unwrap();
    // So many readings were missed that the sender seems to have begun anew, which takes three.
    let mut time_us = run(&mut node, &mut store, time_us + 3600 * SECOND_US, 0.3, |_| shaken);
    for _ in 0..1000 {
        time_us = run(&mut node, &mut store, time_us, 0.08, |_| shaken);
        let state = node.status(time_us).state;
        assert!(matches!(state, NodeState::Suspicious | NodeState::Flagged), "{state:?}");
    }
    assert_eq!(node.status(time_us).state, NodeState::Flagged);
}

#[test]
fn missing_keyphasor_or_speed_is_blind_then_stale() {
    for fault in 0..3 {
        let (mut node, _, mut time_us) = tracking();
        let began_us = time_us;
        let reason = [Reason::Keyphasor, Reason::Speed, Reason::Speed][fault];
        for step in 0..200 {
            let sequence = 0x7000 + step;
            match fault {
                0 => send_numbered(&mut node, time_us, &without_keyphasor(sequence)),
                1 => send(&mut node, time_us, sequence, &Reading::new(599.0, reading(1.0).probes()).unwrap()),
                _ => send(&mut node, time_us, sequence, &Reading::new(1e9, reading(1.0).probes()).unwrap()),
            }
            node.poll(time_us);
            sent(&mut node);
            // The evidence was one period old when the fault began.
            let expected = if time_us - began_us + PERIOD_US > 10 * SECOND_US {
                NodeState::Stale
            } else {
                NodeState::Blind
            };
            assert_eq!(now(&node, time_us), (expected, reason, 0), "fault {fault}, step {step}");
            time_us += PERIOD_US;
        }
    }
}

#[test]
fn silence_is_stale_and_told_within_the_age_limit() {
    let (mut node, _, time_us) = tracking();
    sent(&mut node);
    let mut told_us = None;
    let mut now_us = time_us;
    while told_us.is_none() {
        now_us = node.poll_at().max(now_us + 1);
        node.poll(now_us);
        if states(&sent(&mut node)).iter().any(|status| status.state == NodeState::Stale) {
            told_us = Some(now_us);
        }
    }
    assert_eq!(told_us, Some(time_us - PERIOD_US + 10 * SECOND_US + 1));
    assert_eq!(now(&node, now_us), (NodeState::Stale, Reason::Age, 0));
}

#[test]
fn a_probe_out_of_its_gap_range_is_not_used_and_named() {
    let (mut node, mut store, mut time_us) = tracking();
    let gaps = |gap_v| move |_| reading(1.0).with_gaps_v(&[-9.0, f32::NAN, gap_v, -10.0]);
    time_us = run(&mut node, &mut store, time_us, 2.0, gaps(-17.9));
    assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::None, 0));
    for gap_v in [-18.1, -1.9, 0.0, 20.0] {
        time_us = run(&mut node, &mut store, time_us + 10 * PERIOD_US, 2.0, gaps(gap_v));
        assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::Gap, 0b0100), "{gap_v} V");
    }
}

// Slow faults, over a whole node.

#[test]
fn wear_is_flagged_from_three_seconds_to_thirty_days() {
    // The unbalance may explain part of it, at the pace of its growth.
    for (growth_s, period_us) in [
        (3.0, PERIOD_US),
        (36.0, PERIOD_US),
        (360.0, PERIOD_US),
        (3600.0, SECOND_US),
        (86_400.0, 60 * SECOND_US),
        (30.0 * 86_400.0, 600 * SECOND_US),
        (30.0 * 86_400.0, DAY_US),
    ] {
        let healthy_us = (70 * SECOND_US).max(12 * period_us);
        let end_us = healthy_us + (growth_s * 1e6) as u64 + (30 * SECOND_US).max(4 * period_us);
        let mut node = node();
        let mut flagged_us = None;
        let mut time_us = 0;
        while time_us < end_us && flagged_us.is_none() {
            let grown = (time_us.saturating_sub(healthy_us) as f32 * 1e-6 / growth_s).min(1.0);
            send(
                &mut node,
                time_us,
                (time_us / period_us) as u16,
                &shown(&worn(0.6 * grown), SPEED_RPM, 1.0),
            );
            for result in results(&mut node) {
                if result.flags & FLAG_FLAGGED != 0 {
                    flagged_us = Some(time_us);
                }
            }
            time_us += period_us;
        }
        assert!(
            flagged_us.is_some_and(|us| us > healthy_us),
            "{growth_s} s at {period_us} us: {flagged_us:?}"
        );
    }
}

// Loss of power.

#[test]
fn after_a_power_cut_the_event_is_flagged_as_without_one() {
    let (_, store, _) = tracking();
    for part in [0.35, 0.5] {
        let worn = shown(&worn(part), SPEED_RPM, 1.0);
        let mut node = store.start();
        assert_eq!(node.status(0).state, NodeState::Waiting);
        let time_us = run(&mut node, &mut store.clone(), 0, 15.0, |_| worn);
        assert_eq!(node.status(time_us).state, NodeState::Flagged, "{part}");
    }
}

#[test]
fn daily_readings_with_power_cuts_are_flagged_at_the_third() {
    let worn = shown(&worn(0.5), SPEED_RPM, 1.0);
    for cut in [false, true] {
        let mut store = Store::with(&rigid_rotor());
        let mut node = store.start();
        let mut flags = Vec::new();
        for day in 0..30_u16 {
            let time_us = if cut { 1000 } else { u64::from(day) * DAY_US };
            send(&mut node, time_us, day, &if day < 20 { reading(1.0) } else { worn });
            store.serve(&mut node, time_us);
            flags.push(results(&mut node)[0].flags & (FLAG_FLAGGED | FLAG_SUSPICIOUS));
            if cut {
                node = store.start();
            }
        }
        assert_eq!(flags[..20], [0; 20]);
        assert_eq!(flags[20..22], [FLAG_SUSPICIOUS; 2], "cut: {cut}");
        assert!(flags[22] & FLAG_FLAGGED != 0, "cut: {cut}");
    }
}

#[test]
fn stored_flag_survives_power_cut_after_any_step() {
    let (mut node, mut store, mut time_us) = tracking();
    let worn = shown(&worn(0.5), SPEED_RPM, 1.0);
    for step in 0..400 {
        let reading = if step < 200 { worn } else { reading(1.0) };
        send(&mut node, time_us, (time_us / PERIOD_US) as u16, &reading);
        store.serve(&mut node, time_us);
        sent(&mut node);
        let (kept, held) = (store.start().status(0), node.status(time_us));
        assert_eq!((kept.cause, kept.suspect), (held.cause, held.suspect), "step {step}");
        time_us += PERIOD_US;
    }
    assert_eq!(node.status(time_us).state, NodeState::Flagged, "healthy readings do not lower it");
}

#[test]
fn restored_flag_states_its_present_cause() {
    let (mut node, mut store, time_us) = tracking();
    run(&mut node, &mut store, time_us, 15.0, |_| shown(&worn(0.5), SPEED_RPM, 1.0));
    let mut node = store.start();
    let cause = node.status(0).cause;
    assert_ne!(cause, Reason::None);
    assert_eq!(now(&node, 0), (NodeState::Flagged, Reason::NoReading, 0));
    let time_us = run(&mut node, &mut store, 0, 2.0, |_| reading(1.0));
    assert_eq!(now(&node, time_us), (NodeState::Flagged, Reason::None, 0));
    assert_eq!(now(&node, time_us + 20 * SECOND_US), (NodeState::Flagged, Reason::Age, 0));
}

#[test]
fn damaged_memory_begins_anew_and_does_not_stop_the_node() {
    let (_, mut store, _) = tracking();
    for byte in 0..store.memory.as_ref().unwrap().len() {
        let mut damaged = store.clone();
        damaged.memory.as_mut().unwrap()[byte] ^= 0x10;
        let node = damaged.start();
        assert_eq!((node.status(0).state, node.monitor.detector().is_learning()), (NodeState::Waiting, true));
    }
    store.memory = Some(Vec::new());
    assert_eq!(store.start().status(0).state, NodeState::Waiting);
}

// No model, or none that can be used.

#[test]
fn missing_model_is_explained_and_deployment_accepted() {
    let good = encoded(&rigid_rotor());
    let mut old = good.clone();
    old[0] = 1;
    let mut larger = good.clone();
    larger[5] = 8;
    let mut other_shapes = good.clone();
    other_shapes[4] = 6;
    let mut damaged = good.clone();
    damaged[40] ^= 1;
    for (stored, reason) in [
        (None, Reason::NothingStored),
        (Some(old), Reason::Schema),
        (Some(larger), Reason::Size),
        (Some(other_shapes), Reason::Size),
        (Some(damaged), Reason::Damaged),
        (Some(Vec::new()), Reason::Damaged),
        (Some(good[..20].to_vec()), Reason::Damaged),
    ] {
        let mut store = Store { counter: 41, model: stored, ..Store::default() };
        let mut node = store.start();
        node.poll(0);
        let told = states(&sent(&mut node));
        assert_eq!((told[0].state, told[0].reason), (NodeState::NoModel, reason));
        send(&mut node, 10, 1, &reading(1.0));
        assert_eq!((sent(&mut node).len(), node.counters().unmodelled, node.to_save()), (0, 1, None));
        let replayed = answer(&mut node, &mut store, 20, &deploy(&rigid_rotor(), 41));
        assert_eq!((replayed.outcome, replayed.model_checksum), (Outcome::Replayed, 0));
        let accepted = answer(&mut node, &mut store, 20, &deploy(&rigid_rotor(), 42));
        assert_eq!((accepted.outcome, store.counter), (Outcome::Accepted, 42));
        send(&mut node, 30, 2, &reading(1.0));
        assert_eq!(results(&mut node).len(), 1);
    }
}

// Noise.

#[test]
fn ten_thousand_healthy_readings_raise_no_suspicion() {
    const NOISE_UM: f32 = 0.25;
    let mut machine = rigid_rotor();
    machine.noise.floor_um = NOISE_UM;
    machine.speed_range_rpm = [500.0, 12_000.0];
    let mut random = Random::new(77);
    // one reading a day each: no averaging helps
    for period_us in [DAY_US, PERIOD_US] {
        let mut node = node_with(&machine);
        let (mut suspicious, mut judged) = (0, 0);
        for step in 0..10_000_u64 {
            let speed_rpm = 500.0 + 11_500.0 * (0.5 + 0.5 * random.signed());
            // at full rate the speed stays for a while, as a machine's does
            let speed_rpm = if period_us == DAY_US { speed_rpm } else { 500.0 + 39.0 * (step / 34) as f32 };
            let measured = noisy(&shown(&machine, speed_rpm, 1.0), NOISE_UM, &mut random);
            send(&mut node, step * period_us, step as u16, &measured);
            for result in results(&mut node) {
                suspicious += u32::from(result.flags & FLAG_SUSPICIOUS != 0);
                judged += u32::from(result.reason == Reason::None);
            }
        }
        assert_eq!(suspicious, 0, "one in 1e9 is stated");
        assert!(judged > 6_000, "{judged} of 10,000 were above the noise");
        assert_eq!(node.status(0).cause, Reason::None);
    }
}

#[test]
fn a_vibration_below_the_noise_says_nothing_of_the_model() {
    let mut machine = rigid_rotor();
    machine.noise.floor_um = 0.25;
    let mut node = node_with(&machine);
    let still = Reading::new(600.0, &[crate::reading::ProbeVector { cos_um: 0.01, sin_um: 0.0 }; 4]).unwrap();
    send(&mut node, 0, 1, &still);
    let (state, reason, _) = now(&node, 0);
    assert_eq!(state, NodeState::Blind);
    assert!(matches!(reason, Reason::BelowNoise | Reason::Undetermined), "{reason:?}");
}

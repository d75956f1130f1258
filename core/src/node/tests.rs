//! A node among readings, as it should be.

use super::testing::*;
use super::*;
use crate::can::{FLAG_FLAGGED, FLAG_SUSPICIOUS, Keyphasor, frame_id};
use crate::model::ModelError;
use crate::model::tests::rigid_rotor;
use crate::reading::{ProbeVector, Reading};
use crate::state::NodeState;
use crate::testing::Random;
use crate::track::TrackConfig;

#[test]
fn a_reading_in_gives_the_unbalance_out() {
    let mut node = node();
    send(&mut node, 0, 17, &reading(1.1));
    let results = results(&mut node);
    assert_eq!((results.len(), results[0].sequence, results[0].flags), (1, 17, 0));
    assert!((results[0].unbalance_g_mm[0][0] - 3300.0).abs() < 0.1);
    assert_eq!((results[0].planes, results[0].redundancy, results[0].used_mask), (2, 4, 0b1111));
    assert_eq!(node.estimate().unwrap().unbalance_g_mm, results[0].unbalance_g_mm);
    assert_eq!((node.counters().readings, node.status(0).state), (1, NodeState::Learning));
}

#[test]
fn after_learning_the_model_describes_the_machine() {
    let (mut node, mut store) = (node(), Store::default());
    let time_us = run(&mut node, &mut store, 0, 62.0, |_| reading(1.0));
    let status = node.status(time_us);
    assert_eq!((status.state, status.reason, status.missing_mask), (NodeState::Tracking, Reason::None, 0));
    assert!((status.age_s - 0.087).abs() < 1e-6);
}

#[test]
fn frames_for_other_nodes_are_ignored() {
    let mut node = node();
    let numbered = NumberedReading::new(1, reading(1.0));
    for frame in crate::can::reading_frames(NODE + 1, &numbered) {
        node.receive(0, &frame);
    }
    assert_eq!((node.counters().readings, results(&mut node).len()), (0, 0));
}

#[test]
fn what_cannot_be_is_rejected_and_leaves_no_estimate() {
    let good = reading(1.0);
    let mut vectors = [ProbeVector::LOST; 4];
    vectors.copy_from_slice(good.probes());
    vectors[1].sin_um = 10_001.0;
    let absurd = Reading::new(9000.0, &vectors).unwrap();
    let three = Reading::new(9000.0, &vectors[..3]).unwrap();
    let mut spoilt = std::vec![(absurd, Reason::Absurd), (three, Reason::ProbeCount)];
    for speed_rpm in [0.0, -9000.0, f32::NAN, f32::INFINITY, 599.0, 12_001.0] {
        spoilt.push((Reading::new(speed_rpm, good.probes()).unwrap(), Reason::Speed));
    }
    let mut node = node();
    for (sequence, (reading, reason)) in (1..).zip(spoilt) {
        send(&mut node, 0, sequence, &reading);
        let status = node.status(0);
        assert_eq!((status.state, status.reason), (NodeState::Blind, reason), "{reading:?}");
        assert_eq!(node.counters().rejected, u32::from(sequence));
    }
    assert_eq!(results(&mut node).len(), 0);
    assert_eq!(node.estimate(), None);
}

#[test]
fn heartbeat_comes_with_the_first_poll_and_then_by_its_period() {
    let mut node = node();
    let mut at = |time_us| {
        node.poll(time_us);
        sent(&mut node).len()
    };
    assert_eq!([at(0), at(10), at(999_999), at(1_000_000), at(1_500_000)], [13, 0, 0, 13, 0]);
}

#[test]
fn node_polled_only_on_request_misses_nothing() {
    let (mut often, mut seldom) = (node(), node());
    let mut told = [std::vec::Vec::new(), std::vec::Vec::new()];
    let mut polls = 0;
    for time_us in (0..30 * SECOND_US).step_by(1000) {
        for (node, told) in [&mut often, &mut seldom].into_iter().zip(&mut told) {
            if time_us % PERIOD_US == 0 && time_us < 5 * SECOND_US {
                send(node, time_us, (time_us / PERIOD_US) as u16, &reading(1.0));
            }
            told.extend(states(&sent(node)).iter().map(|status| (time_us, status.state)));
        }
        often.poll(time_us);
        if seldom.poll_at() <= time_us {
            seldom.poll(time_us);
            polls += 1;
        }
        for node in [&mut often, &mut seldom] {
            Store::default().serve(node, time_us);
        }
    }
    assert_eq!(told[0], told[1]);
    assert!(told[1].iter().any(|(_, state)| *state == NodeState::Stale));
    assert!(polls < 120, "{polls} polls in 30 s");
}

#[test]
fn a_change_of_state_is_told_at_once_and_once() {
    let mut node = node();
    node.poll(0);
    assert_eq!(states(&sent(&mut node))[0].state, NodeState::Waiting);
    send(&mut node, 10, 1, &reading(1.0));
    assert_eq!(states(&sent(&mut node)).len(), 1);
    send(&mut node, 20, 2, &reading(1.0));
    assert_eq!(states(&sent(&mut node)).len(), 0);
    send_numbered(&mut node, 30, &without_keyphasor(3));
    let told = states(&sent(&mut node));
    assert_eq!((told[0].state, told[0].reason), (NodeState::Blind, Reason::Keyphasor));
    assert_eq!(node.counters().changes, 2);
}

#[test]
fn a_full_queue_drops_whole_results_and_counts_their_frames() {
    let mut node = node();
    for sequence in 1..=6 {
        send(&mut node, u64::from(sequence) * PERIOD_US, sequence, &reading(1.0));
    }
    // a state, three results of eight frames, and no room for three more of up to ten
    assert_eq!((node.counters().readings, node.counters().overflowed), (6, 30));
    assert_eq!(results(&mut node).len(), 3);
}

#[test]
fn replaced_model_keeps_unbalance_and_forgets_verdict() {
    let mut node = node();
    send(&mut node, 0, 1, &reading(1.15));
    let mut better = rigid_rotor();
    better.initial_unbalance_g_mm = [[1.0, 0.0], [0.0, 1.0]].into_iter().collect();
    assert_eq!(node.replace_model(10, better.clone()), Ok(()));
    assert_eq!((node.status(10).state, node.estimate()), (NodeState::Waiting, None));
    assert!((node.monitor.last_g_mm()[0][0] - 3450.0).abs() < 0.1);
    node.restart(20);
    assert_eq!(node.monitor.last_g_mm(), better.initial_unbalance_g_mm.as_slice());
    send(&mut node, 30, 0, &reading(1.0));
    assert_eq!((results(&mut node).last().unwrap().sequence, node.counters().lost), (0, 0));
    better.supports.clear();
    assert_eq!(node.replace_model(40, better), Err(NodeError::Model(ModelError::Supports)));
    assert_eq!(node.model().unwrap().supports.len(), 2);
}

#[test]
fn node_number_above_thirty_and_bad_thresholds_are_refused() {
    assert_eq!(TestNode::new(NodeConfig::new(MAX_NODE + 1)).err(), Some(NodeError::Node));
    let thresholds = Thresholds { growth: 0.5, ..Thresholds::DEFAULT };
    let refused = TestNode::new(NodeConfig { thresholds, ..config() }).err();
    assert_eq!(refused, Some(NodeError::Thresholds(ThresholdError::Growth)));
}

#[test]
fn misfit_is_suspicious_then_flagged_with_its_bearing() {
    let (mut node, mut store) = (node(), Store::default());
    let mut time_us = run(&mut node, &mut store, 0, 62.0, |_| reading(1.0));
    let worn = shown(&worn(0.5), SPEED_RPM, 1.0);
    let (mut suspicious_us, mut flagged_us) = (None, None);
    for _ in 0..200 {
        send(&mut node, time_us, (time_us / PERIOD_US) as u16, &worn);
        let result = results(&mut node)[0];
        if result.flags & FLAG_SUSPICIOUS != 0 {
            suspicious_us = suspicious_us.or(Some(time_us));
            assert_ne!(result.reason, Reason::None);
        }
        if result.flags & FLAG_FLAGGED != 0 {
            flagged_us = flagged_us.or(Some(time_us));
            assert!(result.suspect.is_some());
            assert_eq!(node.status(time_us).state, NodeState::Flagged);
        } else {
            assert_ne!(node.status(time_us).state, NodeState::Flagged);
        }
        time_us += PERIOD_US;
    }
    let lasted_us = flagged_us.unwrap() - suspicious_us.unwrap();
    assert!((10 * SECOND_US..10 * SECOND_US + 2 * PERIOD_US).contains(&lasted_us), "{lasted_us}");
    let status = node.status(time_us);
    assert!(status.cause != Reason::None && status.reason != Reason::None);
}

#[test]
fn version_is_told_to_who_asks_this_node_or_everybody() {
    let mut node = node();
    node.poll(0);
    sent(&mut node);
    for (to, told) in [(NODE, true), (BROADCAST_NODE, true), (NODE + 1, false)] {
        node.receive(0, &Message::VersionQuery.encode(to));
        let answer = node.transmit().map(|frame| Message::decode(&frame).unwrap());
        let version =
            Message::Version { protocol: 3, oldest: 3, model_schema: 4, shapes: 2, probes: 4, planes: 2 };
        assert_eq!(answer, told.then_some((NODE, version)));
    }
}

#[test]
fn a_million_arbitrary_bits_of_frames_leave_only_finite_state() {
    let mut node = node();
    let mut random = Random::new(31);
    let mut byte = move || ((random.signed() + 1.0) * 128.0) as u8;
    for time_us in 0..20_000 {
        let bytes = core::array::from_fn::<u8, 8, _>(|_| byte());
        let message_type = 8 + byte() % 24;
        let frame = Frame::standard(frame_id(message_type, NODE), &bytes).unwrap();
        node.receive(time_us, &frame);
        node.poll(time_us);
        node.transmit();
    }
    assert_eq!(node.estimate(), None);
    assert_eq!(node.status(20_000).state, NodeState::Conflict, "some of them looked like this node's");
    node.poll(4_000_000);
    send(&mut node, 4_000_000, 1, &reading(1.0));
    assert!(node.estimate().unwrap().residual.e_um.is_finite());
}

#[test]
fn a_reading_without_a_keyphasor_is_skipped() {
    let mut node = node();
    for (sequence, keyphasor) in (1..).zip([Keyphasor::Missing, Keyphasor::Unsteady, Keyphasor::Locked]) {
        let numbered = NumberedReading { keyphasor, ..NumberedReading::new(sequence, reading(1.0)) };
        send_numbered(&mut node, 0, &numbered);
    }
    assert_eq!((node.counters().skipped, results(&mut node).len()), (2, 1));
}

#[test]
fn node_and_monitor_say_the_same_of_the_same_readings() {
    let mut machine = rigid_rotor();
    machine.noise.floor_um = 0.2;
    let mut random = Random::new(12);
    let mut node = node_with(&machine);
    let mut monitor = Monitor::<2, 4, 2>::new(TrackConfig::default(), Thresholds::DEFAULT).unwrap();
    assert_eq!(monitor.status(0).reason, Reason::NothingStored);
    assert_eq!(monitor.load(Ok(&encoded(&machine))), Ok(()));
    let (mut time_us, mut seen) = (0, [0; 10]);
    for step in 0..6000_u16 {
        // what happens changes every thirteen seconds: lost probes and keyphasor, wear, another speed, silence
        let episode = step / 150 % 10;
        time_us += if episode == 9 && step % 150 == 0 { 12 * SECOND_US } else { PERIOD_US };
        let source = match episode {
            7 => shown(&worn(0.8), SPEED_RPM, 1.0),
            8 => shown(&machine, 6000.0, 1.0),
            5 => shown(&machine, 900.0, 0.1),
            _ => shown(&machine, SPEED_RPM, 1.0),
        };
        let mut measured = noisy(&source, 0.2, &mut random);
        measured.lose([0, 0, 0b0010, 0b0101, 0b1111].get(usize::from(episode)).copied().unwrap_or(0));
        let keyphasor = if episode == 6 { Keyphasor::Missing } else { Keyphasor::Locked };
        assert_eq!(node.status(time_us), monitor.status(time_us), "step {step}, before");
        let numbered = NumberedReading { keyphasor, ..NumberedReading::new(step, measured) };
        send_numbered(&mut node, time_us, &numbered);
        sent(&mut node);
        monitor.take(time_us, &measured, keyphasor);
        let status = monitor.status(time_us);
        assert_eq!(node.status(time_us), status, "step {step}");
        let found = |estimate: Option<&Estimate>| estimate.map(|e| (e.unbalance_g_mm, e.residual));
        assert_eq!(found(node.estimate()), found(monitor.estimate()), "step {step}");
        seen[status.state as usize] += 1;
        if step % 1500 == 0 {
            node.monitor.acknowledge();
            monitor.acknowledge();
        }
        if step == 4000 {
            // a loss of power, and what both have stored
            let memory = monitor.memory();
            assert_eq!(memory, node.monitor.memory());
            assert!(node.restore(&memory.encode()) && monitor.restore(&memory));
        }
    }
    for state in [NodeState::Tracking, NodeState::Flagged, NodeState::Learning, NodeState::Blind] {
        assert!(seen[state as usize] > 20, "{state:?}: {seen:?}");
    }
}

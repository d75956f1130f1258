use std::vec::Vec;

use super::*;
use crate::can::{ResultAssembler, reading_frames};
use crate::model::tests::rigid_rotor;
use crate::reading::{ProbeVector, probe_vectors, rad_s};
use crate::response::{SupportAmplitudes, response};
use crate::testing::Random;

const NODE: u8 = 4;

/// Answers from the first reading on.
pub(super) fn config() -> NodeConfig {
    NodeConfig { listen_us: 0, ..NodeConfig::new(NODE) }
}

fn node() -> Node<2> {
    Node::new(config(), rigid_rotor()).unwrap()
}

/// What the model shows for its initial unbalance times a factor.
pub(super) fn reading(factor: f32) -> Reading {
    let model = rigid_rotor();
    let [[a, b], [c, d]] = model.initial_unbalance_g_mm;
    let at_speed = response(&model, rad_s(9000.0), &SupportAmplitudes::default()).unwrap();
    let features = at_speed.features(&[a, b, c, d].map(|u| u * factor));
    Reading { speed_rpm: 9000.0, probes: probe_vectors(&features) }
}

pub(super) fn send(node: &mut Node<2>, to: u8, sequence: u16, reading: &Reading) {
    for frame in reading_frames(to, &NumberedReading::new(sequence, *reading)) {
        node.receive(0, &frame);
    }
}

pub(super) fn results(node: &mut Node<2>) -> Vec<MonitorResult> {
    let mut assembler = ResultAssembler::new();
    let mut results = Vec::new();
    while let Some(frame) = node.transmit() {
        assert_eq!(frame.node(), NODE);
        results.extend(assembler.receive(&frame));
    }
    results
}

#[test]
fn a_reading_in_gives_the_unbalance_out() {
    let mut node = node();
    send(&mut node, NODE, 17, &reading(1.1));
    let results = results(&mut node);
    assert_eq!((results.len(), results[0].sequence, results[0].flags), (1, 17, 0));
    assert!((results[0].unbalance_g_mm[0][0] - 3300.0).abs() < 0.1);
    assert_eq!(node.estimate().unwrap().unbalance_g_mm, results[0].unbalance_g_mm);
    assert_eq!((node.counters().readings, node.state()), (1, NodeState::Tracking));
}

#[test]
fn frames_for_other_nodes_are_ignored() {
    let mut node = node();
    send(&mut node, NODE + 1, 1, &reading(1.0));
    assert_eq!((node.counters(), node.transmit()), (Counters::default(), None));
}

#[test]
fn a_lost_probe_is_skipped_and_changes_neither_streak_nor_estimate() {
    let mut node = node();
    let mut changed = reading(1.0);
    for (sequence, step) in (1..).zip([0.0, 0.0, 60.0, 60.0]) {
        changed.probes[3].cos_um = reading(1.0).probes[3].cos_um + step;
        send(&mut node, NODE, sequence, &changed);
    }
    assert_eq!(results(&mut node).last().unwrap().streak, 2);
    let before = *node.estimate().unwrap();
    let mut lost = changed;
    lost.probes[0] = ProbeVector::LOST;
    send(&mut node, NODE, 5, &lost);
    assert_eq!((node.counters().skipped, results(&mut node).len()), (1, 0));
    assert_eq!(*node.estimate().unwrap(), before);
    send(&mut node, NODE, 6, &changed);
    let after = results(&mut node);
    assert_eq!((after[0].streak, after[0].flags & FLAG_FLAGGED), (3, FLAG_FLAGGED));
    assert_eq!((node.state(), node.counters().lost), (NodeState::Flagged, 0));
}

#[test]
fn what_cannot_be_is_rejected_and_leaves_no_trace() {
    let good = reading(1.0);
    let mut absurd = good;
    absurd.probes[1].sin_um = 10_001.0;
    let mut infinite = good;
    infinite.probes[1].sin_um = f32::INFINITY;
    let probes = good.probes;
    let spoilt = [0.0, -9000.0, f32::NAN, f32::INFINITY, 599.0, 12_001.0]
        .map(|speed_rpm| Reading { speed_rpm, probes });
    let mut node = node();
    for (sequence, reading) in (1..).zip(spoilt.iter().chain([&absurd])) {
        send(&mut node, NODE, sequence, reading);
        assert_eq!(node.counters().rejected, sequence, "{reading:?}");
    }
    // Infinity cannot be sent as such: its probe is marked as lost.
    send(&mut node, NODE, 8, &infinite);
    assert_eq!((node.counters().skipped, node.counters().rejected), (1, 7));
    assert_eq!((node.estimate(), node.state()), (None, NodeState::Waiting));
}

#[test]
fn heartbeat_comes_with_the_first_poll_and_then_by_its_period() {
    let mut node = node();
    let mut at = |time_us| {
        node.poll(time_us);
        core::iter::from_fn(|| node.transmit()).count()
    };
    assert_eq!([at(0), at(10), at(999_999), at(1_000_000), at(1_500_000)], [5, 0, 0, 5, 0]);
}

#[test]
fn a_full_queue_drops_whole_results_and_counts_their_frames() {
    let mut node = node();
    for sequence in 1..=6 {
        send(&mut node, NODE, sequence, &reading(1.0));
    }
    assert_eq!((node.counters().readings, node.counters().overflowed), (6, 14));
    assert_eq!(results(&mut node).len(), 4);
}

#[test]
fn a_replaced_model_keeps_the_unbalance_until_restarted_and_forgets_the_verdict() {
    let mut node = node();
    send(&mut node, NODE, 1, &reading(1.15));
    let mut better = rigid_rotor();
    better.initial_unbalance_g_mm = [[1.0, 0.0], [0.0, 1.0]];
    assert_eq!(node.replace_model(better.clone()), Ok(()));
    assert_eq!((node.state(), node.estimate()), (NodeState::Waiting, None));
    assert!((node.tracker.last_g_mm()[0][0] - 3450.0).abs() < 0.1);
    node.restart();
    assert_eq!(node.tracker.last_g_mm(), better.initial_unbalance_g_mm);
    send(&mut node, NODE, 0, &reading(1.0));
    assert_eq!((results(&mut node).last().unwrap().sequence, node.counters().lost), (0, 0));
    better.supports.clear();
    assert_eq!(node.replace_model(better), Err(NodeError::Model));
    assert_eq!(node.model().supports.len(), 2);
}

#[test]
fn a_node_number_above_thirty_is_refused() {
    let refused = Node::new(NodeConfig::new(MAX_NODE + 1), rigid_rotor());
    assert_eq!(refused.err(), Some(NodeError::Node));
}

#[test]
fn a_million_arbitrary_bits_of_frames_leave_only_finite_state() {
    let mut node = node();
    let mut random = Random::new(31);
    let mut byte = move || ((random.signed() + 1.0) * 128.0) as u8;
    for time_us in 0..20_000 {
        let bytes = core::array::from_fn::<u8, 8, _>(|_| byte());
        let message_type = 8 + byte() % 16;
        let frame = Frame::standard(crate::can::frame_id(message_type, NODE), &bytes).unwrap();
        node.receive(time_us, &frame);
        node.poll(time_us);
        node.transmit();
    }
    assert_eq!(node.estimate(), None);
    assert_eq!(node.state(), NodeState::Conflict, "some of them looked like results of this node");
    node.poll(4_000_000);
    send(&mut node, NODE, 1, &reading(1.0));
    assert!(node.estimate().unwrap().residual.e_um.is_finite());
}

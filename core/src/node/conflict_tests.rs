//! Two monitors with one number.

use std::vec::Vec;

use super::testing::*;
use super::*;
use crate::can::{TYPE_STATE, TYPE_STATUS, frame_id};
use crate::model::tests::rigid_rotor;
use crate::state::NodeState;

/// Two nodes on a wire that takes a millisecond a frame. Two frames of one identifier that begin in the same millisecond with
/// other data destroy each other; returns how often that happened after both had noticed, and whether both had.
fn on_one_wire(nodes: &mut [TestNode; 2], until_us: u64) -> (usize, bool) {
    let mut destroyed = 0;
    let (mut noticed, mut both) = ([false; 2], false);
    let mut sequence = 0;
    for time_us in (0..until_us).step_by(1000) {
        // Each board measures its own machine and sends what it read.
        if time_us % 87_000 == 0 {
            sequence += 1;
            for node in nodes.iter_mut().filter(|node| node.may_send()) {
                send(node, time_us, sequence, &reading(1.0));
            }
        }
        for node in nodes.iter_mut() {
            node.poll(time_us);
        }
        let frames = nodes.each_mut().map(|node| node.transmit());
        match frames {
            [Some(a), Some(b)] if a.raw_id() == b.raw_id() && a != b => destroyed += usize::from(both),
            [a, b] => {
                if let Some(frame) = a {
                    nodes[1].receive(time_us, &frame);
                }
                if let Some(frame) = b {
                    nodes[0].receive(time_us, &frame);
                }
            }
        }
        for (noticed, node) in noticed.iter_mut().zip(nodes.iter()) {
            *noticed |= node.status(time_us).state == NodeState::Conflict;
        }
        both = noticed == [true; 2];
    }
    (destroyed, both)
}

#[test]
fn monitors_sharing_a_number_send_only_states_that_never_meet() {
    for seed in 0..20 {
        let node = |seed| {
            let mut node = TestNode::new(NodeConfig { seed, ..NodeConfig::new(NODE) }).unwrap();
            node.load(Ok(&encoded(&rigid_rotor()))).unwrap();
            node
        };
        // The second one is switched on while the first one is at work.
        let mut nodes = [node(2 * seed), node(2 * seed + 1)];
        for time_us in (0..1_000_000).step_by(1000) {
            nodes[0].poll(time_us);
            sent(&mut nodes[0]);
        }
        let (destroyed, both) = on_one_wire(&mut nodes, 60 * SECOND_US);
        assert!(both, "seed {seed}");
        assert!(destroyed <= 1, "seed {seed}: {destroyed} times in a minute");
        assert!(nodes.iter().all(|node| !node.may_send()));
    }
}

#[test]
fn conflict_allows_only_states_and_ends_cleanly() {
    let (mut node, mut store, time_us) = tracking();
    let foreign = Frame::standard(frame_id(TYPE_STATUS, NODE), &[0; 8]).unwrap();
    send(&mut node, time_us, 0x7000, &reading(1.0));
    node.receive(time_us, &foreign);
    assert_eq!((now(&node, time_us).0, node.counters().conflicts), (NodeState::Conflict, 1));
    let mut kinds = Vec::new();
    let mut now_us = time_us;
    while now_us < time_us + 20 * SECOND_US {
        node.poll(now_us);
        send(&mut node, now_us, (now_us / PERIOD_US) as u16, &reading(1.0));
        node.receive(now_us, &Message::VersionQuery.encode(NODE));
        if now_us % (2 * SECOND_US) < PERIOD_US {
            node.receive(now_us, &foreign);
        }
        kinds.extend(sent(&mut node).iter().map(Frame::message_type));
        assert!(!node.may_send());
        now_us += PERIOD_US;
    }
    assert!(kinds.iter().all(|kind| *kind == TYPE_STATE), "{kinds:?}");
    assert!((10..45).contains(&kinds.len()), "{} in 20 s", kinds.len());
    // Three heartbeat periods of quiet, and the evidence is older than its limit by then.
    node.poll(now_us + 4 * SECOND_US);
    assert_eq!(now(&node, now_us + 4 * SECOND_US), (NodeState::Stale, Reason::Age, 0));
    let time_us = run(&mut node, &mut store, now_us + 4 * SECOND_US, 1.0, |_| reading(1.0));
    assert_eq!(now(&node, time_us).0, NodeState::Tracking);
}

#[test]
fn a_node_listens_before_it_sends_anything() {
    let mut node = TestNode::new(NodeConfig::new(NODE)).unwrap();
    node.load(Ok(&encoded(&rigid_rotor()))).unwrap();
    let mut frames = |time_us, sequence| {
        node.poll(time_us);
        send(&mut node, time_us, sequence, &reading(1.0));
        sent(&mut node).len()
    };
    assert_eq!([frames(5_000, 1), frames(104_999, 2)], [0, 0]);
    assert!(frames(105_000, 3) > HEARTBEAT_FRAMES);
}

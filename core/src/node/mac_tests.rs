//! A node that takes authenticated readings alone, among forgers.

use std::format;
use std::vec::Vec;

use super::testing::*;
use super::*;
use crate::can::mac::{Direction, Gate, mac_frames};
use crate::can::{ResultAssembler, TYPE_RESULT_END, TYPE_STATE, TYPE_STATUS, reading_frames};
use crate::command::Key;
use crate::model::tests::rigid_rotor;
use crate::reading::Reading;
use crate::testing::Random;

/// A sender's clock, µs since 1970.
const EPOCH_US: u64 = 1_700_000_000_000_000;
const RESERVE: u64 = 60_000_000;

fn authenticating_config() -> NodeConfig {
    NodeConfig { authenticated: true, ..config() }
}

/// After a loss of power; what is not stored is as in a new one.
fn start(store: &Store) -> TestNode {
    let mut node = TestNode::new(authenticating_config()).unwrap();
    node.restore_nonce(store.nonce);
    node.load(Ok(&encoded(&rigid_rotor()))).unwrap();
    node
}

fn fresh() -> (TestNode, Store) {
    let store = Store::default();
    (start(&store), store)
}

/// A reading that differs from those with other numbers by a little noise.
fn varied(sequence: u16, factor: f32) -> Reading {
    noisy(&reading(factor), 1e-3, &mut Random::new(u64::from(sequence)))
}

fn group(sequence: u16, factor: f32) -> Vec<Frame> {
    reading_frames(NODE, &NumberedReading::new(sequence, varied(sequence, factor))).into_iter().collect()
}

fn authenticated_by(key: Key, nonce: u64, mut group: Vec<Frame>) -> Vec<Frame> {
    group.extend(mac_frames(&key, Direction::ToNode, NODE, nonce, &group));
    group
}

/// The sender's reading number `sequence`, which it also tells the time by.
fn genuine(sequence: u16) -> Vec<Frame> {
    authenticated_by(KEY, EPOCH_US + u64::from(sequence) * PERIOD_US, group(sequence, 1.0))
}

/// What the node tells when it hears these frames.
fn told(node: &mut TestNode, store: &mut Store, time_us: u64, frames: &[Frame]) -> Vec<Frame> {
    for frame in frames {
        node.receive(time_us, frame);
        store.serve(node, time_us);
    }
    sent(node)
}

fn is_answered(frames: &[Frame]) -> bool {
    frames.iter().any(|frame| frame.message_type() == TYPE_RESULT_END)
}

#[test]
fn right_mac_makes_a_reading_count_and_its_answer_has_one() {
    let (mut node, mut store) = fresh();
    let answer = told(&mut node, &mut store, 0, &genuine(1));
    let mut open = testing::node();
    send_exactly(&mut open, 0, 1, &varied(1, 1.0));
    let expected = results(&mut open);
    let mut gate = Gate::new(Direction::ToHost, 0);
    let mut assembler = ResultAssembler::new();
    let groups: Vec<_> = answer.iter().filter_map(|frame| gate.receive(&KEY, 0, 0, frame).unwrap()).collect();
    let mut found: Vec<_> = groups.iter().flatten().filter_map(|frame| assembler.receive(frame)).collect();
    assert_eq!(found.pop().unwrap(), expected[0]);
    // everything that was told was authenticated: result and state
    assert_eq!(groups.iter().map(|group| group.len() + 2).sum::<usize>(), answer.len());
    assert!(gate.last() > EPOCH_US + PERIOD_US);
    assert_eq!(node.counters().readings, 1);
}

#[test]
fn readings_without_a_right_mac_change_only_counters() {
    let (mut node, mut store) = fresh();
    for sequence in 1..=20 {
        assert!(is_answered(&told(&mut node, &mut store, 0, &genuine(sequence))));
    }
    let (before, counted) = (node.clone(), node.counters());
    let no_mac = group(22, 5.0);
    let wrong = authenticated_by(Key([8; 32]), EPOCH_US + 21 * PERIOD_US, group(21, 5.0));
    let far_ahead = authenticated_by(Key([8; 32]), EPOCH_US * 2, group(0x7000, 5.0));
    for forged in [&no_mac, &wrong, &far_ahead, &genuine(20), &genuine(1)] {
        assert!(!is_answered(&told(&mut node, &mut store, 0, forged)));
    }
    let (counters, was) = (node.counters(), counted);
    assert_eq!(
        (
            counters.incomplete - was.incomplete,
            counters.forged - was.forged,
            counters.replayed - was.replayed
        ),
        (1, 2, 2)
    );
    assert_eq!((counters.readings, counters.lost, counters.late), (was.readings, was.lost, was.late));
    assert_eq!(format!("{:?}", node.estimate()), format!("{:?}", before.estimate()));
    assert_eq!(node.status(0), before.status(0));
    // and the sender's next one is judged as if nothing had been: a number far ahead has not made it late
    let mut undisturbed = before;
    let next = told(&mut node, &mut store, 0, &genuine(21));
    assert!(is_answered(&next));
    told(&mut undisturbed, &mut Store::default(), 0, &genuine(21));
    assert_eq!(format!("{:?}", node.estimate()), format!("{:?}", undisturbed.estimate()));
}

#[test]
fn frames_in_the_nodes_name_are_counted_and_do_not_silence_it() {
    let (mut node, mut store) = fresh();
    for sequence in 1..=20 {
        let forged = [TYPE_STATUS, TYPE_STATE].map(|kind| Frame::full(kind, NODE, [0; 8]));
        told(&mut node, &mut store, 0, &forged);
        assert!(node.may_send());
        assert!(is_answered(&told(&mut node, &mut store, 0, &genuine(sequence))));
    }
    assert_eq!(node.counters().conflicts, 40);
    // one without MACs is silenced by the first of them
    let mut open = testing::node();
    open.receive(0, &Frame::full(TYPE_STATUS, NODE, [0; 8]));
    assert!(!open.may_send());
}

#[test]
fn one_forged_frame_costs_one_reading_at_most() {
    for place in 0..genuine(1).len() {
        let (mut node, mut store) = fresh();
        for sequence in 1..=10 {
            let mut frames = genuine(sequence);
            let mut payload = *frames[place].full_payload().unwrap();
            payload[3] ^= 1;
            let forged = Frame::standard(frames[place].raw_id(), &payload).unwrap();
            if sequence == 5 {
                frames.insert(place + 1, forged);
            }
            told(&mut node, &mut store, 0, &frames);
        }
        assert!(node.counters().readings >= 9, "after frame {place}");
    }
}

#[test]
fn replayed_reading_after_power_loss_is_refused() {
    let (mut node, mut store) = fresh();
    let recorded: Vec<Vec<Frame>> = (1..=2000).map(genuine).collect();
    for frames in &recorded {
        assert!(is_answered(&told(&mut node, &mut store, 0, frames)));
    }
    let last = EPOCH_US + 2000 * PERIOD_US;
    assert!((last..=last + RESERVE).contains(&store.nonce));
    assert!(store.savings < 10, "flash wears out: {}", store.savings);
    let mut again = start(&store);
    for frames in &recorded {
        assert!(!is_answered(&told(&mut again, &mut store, 0, frames)));
    }
    assert_eq!((again.counters().replayed, again.counters().readings), (2000, 0));
    let later = authenticated_by(KEY, last + RESERVE + 1, group(3000, 1.0));
    assert!(is_answered(&told(&mut again, &mut store, 0, &later)));
}

#[test]
fn what_is_told_grows_over_restarts_without_a_reading_too() {
    let (mut store, mut gate) = (Store::default(), Gate::new(Direction::ToHost, 0));
    for _ in 0..3 {
        let mut node = start(&store);
        let mut words = 0;
        for second in 0..50 {
            node.poll(second * SECOND_US);
            store.serve(&mut node, second * SECOND_US);
            for frame in sent(&mut node) {
                words += usize::from(gate.receive(&KEY, SECOND_US, 0, &frame).unwrap().is_some());
            }
        }
        assert_eq!(words, 50, "a heartbeat a second");
    }
    assert!(store.nonce < 10 * SECOND_US, "readings wait no longer for it than an instant each");
}

#[test]
fn failing_store_is_counted_and_retried_while_readings_go_on() {
    let (mut node, mut store) = fresh();
    store.fails = true;
    for sequence in 1..=3 {
        assert!(is_answered(&told(&mut node, &mut store, 0, &genuine(sequence))));
    }
    assert!(node.counters().unsaved >= 3);
    assert_eq!(node.status(0).reason, Reason::Storage);
    store.fails = false;
    told(&mut node, &mut store, SECOND_US, &genuine(4));
    assert!(store.nonce > EPOCH_US);
    assert_eq!(node.status(SECOND_US).reason, Reason::Learning, "nonce and memory are stored");
}

#[test]
fn without_a_key_no_reading_is_taken() {
    let mut node = TestNode::new(NodeConfig { key: None, ..authenticating_config() }).unwrap();
    node.load(Ok(&encoded(&rigid_rotor()))).unwrap();
    assert!(!is_answered(&told(&mut node, &mut Store::default(), 0, &genuine(1))));
}

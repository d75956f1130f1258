//! Commands in numbered parts as a node sees them.

use std::vec::Vec;

use super::testing::*;
use super::*;
use crate::can::parts::{Ack, Offer, answer_part, parts_of, request_part};
use crate::can::{TYPE_ACK, TYPE_ANSWER_PART};
use crate::command::{Answer, Command, Outcome};
use crate::model::tests::rigid_rotor;

fn offer(node: &mut TestNode, request: &[u8], wanted: u8, round: u8) -> Vec<Frame> {
    let offer = Offer { wanted, round, ..Offer::new(request).unwrap() };
    node.receive(0, &Frame::full(TYPE_OFFER, NODE, offer.encode()));
    sent(node)
}

/// What the node says that it holds.
fn held(node: &mut TestNode, request: &[u8], round: u8) -> Ack {
    let frames = offer(node, request, 0, round);
    assert_eq!(frames[0].message_type(), TYPE_ACK);
    Ack::decode(frames[0].bytes()).unwrap()
}

fn send_parts(node: &mut TestNode, request: &[u8], numbers: impl IntoIterator<Item = usize>) {
    for number in numbers {
        let part = request_part(request, number as u16).unwrap();
        node.receive(0, &Frame::full(TYPE_PART, NODE, part));
    }
}

/// The whole answer, asked for part after part.
fn answer(node: &mut TestNode, request: &[u8]) -> Answer {
    let bytes = usize::from(held(node, request, 1).answer_bytes);
    let (mut whole, mut wanted) = (Vec::new(), 0);
    while whole.len() < bytes {
        for frame in offer(node, request, wanted, 2).iter().skip(1) {
            assert_eq!((frame.message_type(), frame.bytes()[..2] == [wanted, 2]), (TYPE_ANSWER_PART, true));
            whole.extend(&frame.bytes()[2..]);
            wanted += 1;
        }
    }
    whole.truncate(bytes);
    let (answer, confirmed) = Answer::decode(&whole, request, &KEY).unwrap();
    assert!(confirmed);
    answer
}

#[test]
fn request_in_parts_is_executed_once_and_answered_each_time() {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    let request = deploy(&rigid_rotor(), 5);
    let parts = parts_of(request.len());
    assert_eq!(held(&mut node, &request, 7).parts, 0);
    send_parts(&mut node, &request, (0..3).chain(4..parts).chain(2..3));
    let held = held(&mut node, &request, 8);
    assert_eq!((held.parts, held.round, held.answer_bytes), (3, 8, 0), "up to the first that is missing");
    send_parts(&mut node, &request, 3..parts);
    store.serve(&mut node, 0);
    for _ in 0..2 {
        let answer = answer(&mut node, &request);
        assert_eq!((answer.outcome, answer.counter), (Outcome::Accepted, 5));
        send_parts(&mut node, &request, 0..parts);
    }
    assert_eq!((node.counters().accepted, store.counter), (1, 5));
    assert_eq!(store.model, Some(encoded(&rigid_rotor())));
}

#[test]
fn a_long_answer_comes_in_bursts() {
    let (mut node, request) = (node(), request(Command::GetThresholds, 1, &[]));
    offer(&mut node, &request, 0, 0);
    send_parts(&mut node, &request, 0..parts_of(request.len()));
    assert_eq!(offer(&mut node, &request, 0, 1).len(), 9, "held and eight parts");
    assert_eq!(answer(&mut node, &request).thresholds, Some(Thresholds::DEFAULT));
    assert_eq!(offer(&mut node, &request, 255, 1).len(), 1);
}

#[test]
fn until_it_is_stored_a_request_stays_whole_and_unanswered() {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    let (first, other) = (deploy(&rigid_rotor(), 5), deploy(&rigid_rotor(), 6));
    offer(&mut node, &first, 0, 0);
    send_parts(&mut node, &first, 0..parts_of(first.len()));
    assert_eq!(offer(&mut node, &other, 0, 1), []);
    store.serve(&mut node, 0);
    assert_eq!(answer(&mut node, &first).counter, 5);
    assert_eq!(held(&mut node, &other, 1).parts, 0);
}

#[test]
fn iso_tp_message_discards_offer_and_vice_versa() {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    let [first, second] = [5, 6].map(|counter| request(Command::Restart, counter, &[]));
    offer(&mut node, &first, 0, 0);
    send_parts(&mut node, &first, 0..2);
    let whole = testing::answer(&mut node, &mut store, 0, &second);
    assert_eq!((whole.outcome, held(&mut node, &first, 1).parts), (Outcome::Accepted, 0));
    send_parts(&mut node, &first, 0..parts_of(first.len()));
    assert_eq!(answer(&mut node, &first).outcome, Outcome::Replayed);
    let third = request(Command::Restart, 7, &[]);
    assert_eq!(testing::answer(&mut node, &mut store, 0, &third).outcome, Outcome::Accepted);
}

#[test]
fn impossible_offers_and_unrequested_answers_are_ignored() {
    let mut node = node();
    for length in [0, MAX_REQUEST_BYTES as u16 + 1, u16::MAX] {
        let offer = Offer { length, wanted: 0, round: 0, crc32: 0 };
        node.receive(0, &Frame::full(TYPE_OFFER, NODE, offer.encode()));
    }
    send_parts(&mut node, &[1; 20], 0..4);
    assert!(!sent(&mut node).iter().any(Frame::is_transfer));
    assert_eq!(answer_part(&[], 0, 0), None);
    let c = node.counters();
    assert_eq!((c.broken, c.refused, c.forged, c.accepted), (0, 0, 0, 0));
}

//! Deployment as a node sees it.

use std::vec::Vec;

use super::tests::{config, reading, results, send};
use super::*;
use crate::can::frame_id;
use crate::can::isotp::{IsoTp, Progress, TIMEOUT_US};
use crate::can::{TYPE_STATUS, TYPE_TO_HOST};
use crate::command::{ANSWER_BYTES, Answer, Command, KEY_BYTES, Outcome, write_request};
use crate::model::tests::rigid_rotor;

const NODE: u8 = 4;
const KEY: Key = Key([9; KEY_BYTES]);

type Host = IsoTp<ANSWER_BYTES, MAX_REQUEST_BYTES>;

fn node() -> Node<2> {
    Node::new(NodeConfig { key: Some(KEY), ..config() }, rigid_rotor()).unwrap()
}

fn better() -> Model<2> {
    let mut better = rigid_rotor();
    better.supports[0].mass_kg = 2.0;
    better
}

fn deploy(model: &Model<2>, key: Key, counter: u64) -> Vec<u8> {
    let (mut body, mut request) = ([0; 1024], [0; MAX_REQUEST_BYTES]);
    let length = model.encode(&mut body).unwrap();
    let length = write_request(&mut request, &key, NODE, Command::Deploy, counter, &body[..length]).unwrap();
    request[..length].to_vec()
}

/// Sends a request, stores what the node wants stored; `lost` decides which frame towards or from the node is dropped.
fn transfer(
    node: &mut Node<2>,
    time_us: u64,
    request: &[u8],
    store: impl Fn(Save<'_>) -> bool,
    lost: impl Fn(usize) -> bool,
) -> (usize, Option<(Answer, bool)>) {
    let mut host = Host::new();
    host.send(time_us, request).unwrap();
    let (mut frames, mut answer) = (0, None);
    let mut arrives = || {
        frames += 1;
        !lost(frames - 1)
    };
    loop {
        let mut quiet = true;
        while let Some(payload) = host.poll(time_us) {
            quiet = false;
            if arrives() {
                let id = frame_id(TYPE_TO_NODE, NODE);
                node.receive(time_us, &Frame::standard(id, &payload).unwrap());
            }
        }
        if let Some(save) = node.to_save() {
            let stored = store(save);
            node.saved(time_us, stored);
        }
        while let Some(frame) = node.transmit() {
            quiet = false;
            if frame.message_type() == TYPE_TO_HOST
                && arrives()
                && host.receive(time_us, frame.bytes()) == Progress::Complete
            {
                answer = Answer::decode(host.message(), request, &KEY);
            }
        }
        if quiet {
            return (frames, answer);
        }
    }
}

fn outcome(node: &mut Node<2>, request: &[u8]) -> (Outcome, bool) {
    let (_, answer) = transfer(node, 0, request, |_| true, |_| false);
    answer.map(|(answer, confirmed)| (answer.outcome, confirmed)).unwrap()
}

#[test]
fn a_deployed_model_is_stored_then_used_then_confirmed() {
    let mut node = node();
    let request = deploy(&better(), KEY, 5);
    let store = |save: Save<'_>| {
        assert_eq!(save.counter, 5);
        assert_eq!(Model::<2>::decode(save.model.unwrap()).unwrap(), better());
        true
    };
    let (_, answer) = transfer(&mut node, 0, &request, store, |_| false);
    let (answer, confirmed) = answer.unwrap();
    assert!(confirmed);
    assert_eq!((answer.outcome, answer.counter), (Outcome::Accepted, 5));
    assert_eq!(answer.model_checksum, better().checksum());
    assert_eq!((node.model(), node.command_counter(), node.counters().accepted), (&better(), 5, 1));
}

#[test]
fn checksum_is_the_one_at_the_end_of_the_encoded_model() {
    let mut bytes = [0; 1024];
    let length = better().encode(&mut bytes).unwrap();
    assert_eq!(better().checksum().to_le_bytes(), bytes[length - 4..length]);
}

#[test]
fn until_it_is_stored_the_old_model_stays_and_readings_go_on() {
    let mut node = node();
    let before = node.clone();
    let request = deploy(&better(), KEY, 5);
    let (_, answer) = transfer(&mut node, 0, &request, |_| false, |_| false);
    assert_eq!(answer.unwrap().0.outcome, Outcome::Storage);
    assert_eq!((node.model(), node.command_counter()), (before.model(), 0));
    send(&mut node, NODE, 1, &reading(1.0));
    assert_eq!(results(&mut node).len(), 1);
}

#[test]
fn forged_replayed_and_keyless_commands_are_refused_and_counted() {
    let mut node = node();
    let good = deploy(&better(), KEY, 5);
    assert_eq!(outcome(&mut node, &deploy(&better(), Key([8; 32]), 6)), (Outcome::Forged, true));
    assert_eq!(node.model(), &rigid_rotor());
    assert_eq!(outcome(&mut node, &good), (Outcome::Accepted, true));
    assert_eq!(outcome(&mut node, &good), (Outcome::Replayed, true));
    let mut restarted = self::node();
    restarted.restore_counter(5);
    assert_eq!(outcome(&mut restarted, &good), (Outcome::Replayed, true), "a restart changes nothing");
    let mut keyless = Node::new(config(), rigid_rotor()).unwrap();
    assert_eq!(outcome(&mut keyless, &good), (Outcome::NoKey, false));
    let c = node.counters();
    assert_eq!((c.accepted, c.forged, c.replayed, keyless.counters().refused), (1, 1, 1, 1));
}

#[test]
fn a_model_that_cannot_run_is_refused_with_its_reason() {
    let mut node = node();
    let mut bad = better();
    bad.supports.truncate(1);
    let (_, answer) =
        transfer(&mut node, 0, &deploy(&bad, KEY, 5), |_| panic!("not to be stored"), |_| false);
    let answer = answer.unwrap().0;
    assert_eq!((answer.outcome, answer.model_error), (Outcome::Model, Some(ModelError::Supports)));
    assert_eq!((node.model(), node.command_counter()), (&rigid_rotor(), 0));
}

#[test]
fn a_deployment_cut_at_any_frame_leaves_the_old_model_or_the_new_one_and_the_next_succeeds() {
    let request = deploy(&better(), KEY, 5);
    let whole = transfer(&mut node(), 0, &request, |_| true, |_| false).0;
    let request_frames = 2 + (request.len() - 6).div_ceil(7);
    let mut cut = 0;
    for lost in 0..whole {
        let mut node = node();
        // everything from that frame on is lost
        let (_, answer) = transfer(&mut node, 0, &request, |_| true, |frame| frame >= lost);
        assert_eq!(answer, None, "cut at frame {lost}");
        let arrived = node.counters().accepted == 1;
        assert_eq!(*node.model(), if arrived { better() } else { rigid_rotor() });
        let later = 2 * TIMEOUT_US;
        node.poll(later);
        assert!(arrived || lost == 0 || node.counters().broken == 1, "cut at frame {lost} is reported");
        cut += usize::from(!arrived);
        while node.transmit().is_some() {}
        let again = deploy(&better(), KEY, 6);
        let (_, answer) = transfer(&mut node, later, &again, |_| true, |_| false);
        assert_eq!(answer.unwrap().0.outcome, Outcome::Accepted);
    }
    assert!(cut >= request_frames - 1, "{cut} cuts before the end of {request_frames} frames");
}

#[test]
fn beginning_a_new_record_is_a_command_too() {
    let mut node = node();
    send(&mut node, NODE, 1, &reading(1.15));
    results(&mut node);
    let mut request = [0; 64];
    let length = write_request(&mut request, &KEY, NODE, Command::Restart, 1, &[]).unwrap();
    let store = |save: Save<'_>| save.model.is_none() && save.counter == 1;
    let (_, answer) = transfer(&mut node, 0, &request[..length], store, |_| false);
    assert_eq!(answer.unwrap().0.outcome, Outcome::Accepted);
    assert_eq!(node.tracker.last_g_mm(), rigid_rotor().initial_unbalance_g_mm);
}

#[test]
fn a_node_that_hears_its_own_number_falls_silent_says_so_and_recovers() {
    let mut node = node();
    node.poll(0);
    while node.transmit().is_some() {}
    let foreign = Frame::standard(frame_id(TYPE_STATUS, NODE), &[0; 8]).unwrap();
    node.receive(10, &foreign);
    assert_eq!((node.state(), node.counters().conflicts), (NodeState::Conflict, 1));
    let warned = core::iter::from_fn(|| node.transmit()).filter_map(|frame| Message::decode(&frame).ok());
    assert!(
        warned.into_iter().any(|(_, m)| matches!(m, Message::Heartbeat { state: NodeState::Conflict, .. }))
    );
    send(&mut node, NODE, 1, &reading(1.0));
    assert_eq!((results(&mut node).len(), node.counters().skipped), (0, 1));
    node.poll(3_000_011);
    send(&mut node, NODE, 2, &reading(1.0));
    assert_eq!((results(&mut node).len(), node.state()), (1, NodeState::Tracking));
}

#[test]
fn a_node_listens_before_it_answers() {
    let mut node = Node::new(NodeConfig::new(NODE), rigid_rotor()).unwrap();
    let numbered = NumberedReading::new(1, reading(1.0));
    let mut answers = |time_us, sequence| {
        node.poll(time_us);
        for frame in crate::can::reading_frames(NODE, &NumberedReading { sequence, ..numbered }) {
            node.receive(time_us, &frame);
        }
        results(&mut node).len()
    };
    assert_eq!([answers(5_000, 1), answers(104_999, 2), answers(105_000, 3)], [0, 0, 1]);
}

#[test]
fn version_is_told_to_who_asks_this_node_or_everybody() {
    let mut node = node();
    for (to, told) in [(NODE, true), (BROADCAST_NODE, true), (NODE + 1, false)] {
        node.receive(0, &Message::VersionQuery.encode(to));
        let answer = node.transmit().map(|frame| Message::decode(&frame).unwrap());
        let version = Message::Version { protocol: 2, oldest: 1, model_schema: 1, shapes: 2 };
        assert_eq!(answer, told.then_some((NODE, version)));
    }
}

#[test]
fn a_reading_without_a_keyphasor_is_skipped() {
    use crate::can::Keyphasor;
    let mut node = node();
    for (sequence, keyphasor) in (1..).zip([Keyphasor::Missing, Keyphasor::Unsteady, Keyphasor::Locked]) {
        let numbered = NumberedReading { keyphasor, ..NumberedReading::new(sequence, reading(1.0)) };
        for frame in crate::can::reading_frames(NODE, &numbered) {
            node.receive(0, &frame);
        }
    }
    assert_eq!((node.counters().skipped, results(&mut node).len()), (2, 1));
}

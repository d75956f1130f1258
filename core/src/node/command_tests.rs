//! Commands as a node sees them.

use super::testing::*;
use super::*;
use crate::can::isotp::TIMEOUT_US;
use crate::command::{Command, Detail, Key, MAX_COUNTER_STEP, Outcome};
use crate::detector::LatchedFlag;
use crate::model::ModelError;
use crate::model::tests::rigid_rotor;
use crate::state::NodeState;

fn better() -> TestModel {
    let mut better = rigid_rotor();
    better.supports[0].mass_kg = 2.0;
    better
}

fn outcome(node: &mut TestNode, request: &[u8]) -> Outcome {
    answer(node, &mut Store::default(), 0, request).outcome
}

/// A node whose flag is up, and what it stored.
fn flagged() -> (TestNode, Store, u64) {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    let time_us = run(&mut node, &mut store, 0, 62.0, |_| reading(1.0));
    let time_us = run(&mut node, &mut store, time_us, 15.0, |_| shown(&worn(0.5), SPEED_RPM, 1.0));
    assert_eq!(node.status(time_us).state, NodeState::Flagged);
    (node, store, time_us)
}

#[test]
fn a_deployed_model_is_stored_then_used_then_confirmed() {
    let (mut node, mut store) = (node(), Store::default());
    let answer = answer(&mut node, &mut store, 0, &deploy(&better(), 5));
    assert_eq!((answer.outcome, answer.counter), (Outcome::Accepted, 5));
    assert_eq!(answer.model_checksum, better().checksum());
    assert_eq!((node.model(), node.command_counter()), (Some(&better()), 5));
    assert_eq!((store.counter, store.model), (5, Some(encoded(&better()))));
    assert_eq!(node.counters().accepted, 1);
}

#[test]
fn model_of_other_machine_is_refused_unless_commanded() {
    let others = TestModel { machine: *b"next", ..better() };
    let (mut node, mut store) = (node(), Store::default());
    let refused = answer(&mut node, &mut store, 0, &deploy(&others, 5));
    assert_eq!((refused.outcome, refused.model_checksum), (Outcome::Machine, rigid_rotor().checksum()));
    assert_eq!((node.model(), node.command_counter(), store.savings), (Some(&rigid_rotor()), 0, 0));
    assert_eq!(node.counters().refused, 1);
    let told = request(Command::DeployAnother, 5, &encoded(&others));
    assert_eq!(answer(&mut node, &mut store, 0, &told).outcome, Outcome::Accepted);
    assert_eq!((node.model(), store.model), (Some(&others), Some(encoded(&others))));
    assert_eq!(outcome(&mut node, &deploy(&better(), 6)), Outcome::Machine, "the new one is held now");

    let mut bare = TestNode::new(config()).unwrap();
    assert_eq!(outcome(&mut bare, &deploy(&others, 1)), Outcome::Accepted);
}

#[test]
fn until_it_is_stored_the_old_model_stays_and_readings_go_on() {
    let mut node = node();
    let mut broken = Store { fails: true, ..Store::default() };
    let answer = answer(&mut node, &mut broken, 0, &deploy(&better(), 5));
    assert_eq!((answer.outcome, answer.counter), (Outcome::Storage, 0));
    assert_eq!((node.model(), node.command_counter()), (Some(&rigid_rotor()), 0));
    send(&mut node, 0, 1, &reading(1.0));
    assert_eq!(results(&mut node).len(), 1);
}

#[test]
fn forged_replayed_and_keyless_commands_are_refused_and_counted() {
    let mut node = node();
    let good = deploy(&better(), 5);
    let forged = signed(Key([8; 32]), Command::Deploy, 6, &encoded(&better()));
    assert_eq!(outcome(&mut node, &forged), Outcome::Forged);
    assert_eq!(node.model(), Some(&rigid_rotor()));
    assert_eq!(outcome(&mut node, &good), Outcome::Accepted);
    assert_eq!(outcome(&mut node, &good), Outcome::Replayed);
    let mut restarted = self::node();
    restarted.restore_counter(5);
    assert_eq!(outcome(&mut restarted, &good), Outcome::Replayed, "a restart changes nothing");
    let mut keyless = TestNode::new(NodeConfig { key: None, ..config() }).unwrap();
    let (answer, confirmed) = transfer(&mut keyless, &mut Store::default(), 0, &good, |_| false).1.unwrap();
    assert_eq!((answer.outcome, confirmed), (Outcome::NoKey, false));
    let c = node.counters();
    assert_eq!((c.accepted, c.forged, c.replayed, keyless.counters().refused), (1, 1, 1, 1));
}

#[test]
fn counter_at_end_of_range_is_refused_and_locks_nothing() {
    let mut node = node();
    assert_eq!(outcome(&mut node, &deploy(&better(), u64::MAX)), Outcome::Counter);
    assert_eq!(outcome(&mut node, &deploy(&better(), MAX_COUNTER_STEP + 1)), Outcome::Counter);
    assert_eq!((node.command_counter(), node.counters().replayed), (0, 2));
    assert_eq!(outcome(&mut node, &deploy(&better(), 1)), Outcome::Accepted);
}

#[test]
fn the_answer_to_a_forged_request_does_not_tell_the_counter() {
    let mut node = node();
    node.restore_counter(77);
    let forged = signed(Key([8; 32]), Command::Restart, 78, &[]);
    let answer = answer(&mut node, &mut Store::default(), 0, &forged);
    assert_eq!((answer.outcome, answer.counter), (Outcome::Forged, 0));
}

#[test]
fn a_model_that_cannot_run_is_refused_with_its_reason() {
    let mut node = node();
    let mut bad = better();
    bad.supports.truncate(1);
    let mut store = Store::default();
    let answer = answer(&mut node, &mut store, 0, &deploy(&bad, 5));
    let detail = Detail::Model { error: ModelError::Supports, asked: 0, held: 0 };
    assert_eq!((answer.outcome, answer.detail), (Outcome::Model, detail));
    assert_eq!((node.model(), node.command_counter(), store.savings), (Some(&rigid_rotor()), 0, 0));
}

#[test]
fn model_larger_than_firmware_is_refused_with_both_numbers() {
    let (mut node, mut store) = (node(), Store::default());
    let small = rigid_rotor();
    let mut large = Model::<2, 8, 4> {
        machine: small.machine,
        shaft: small.shaft.clone(),
        internal_damping_s: small.internal_damping_s,
        planes: small.planes.iter().copied().collect(),
        supports: small.supports.clone(),
        knots: small.knots.clone(),
        forcings: small.forcings.clone(),
        probes: small.probes.iter().chain(&small.probes[..1]).cloned().collect(),
        masked: small.masked,
        initial_unbalance_g_mm: small.initial_unbalance_g_mm.iter().copied().collect(),
        unbalance_floor_g_mm: small.unbalance_floor_g_mm,
        noise: small.noise,
        speed_range_rpm: small.speed_range_rpm,
    };
    let probes = answer(&mut node, &mut store, 0, &request(Command::Deploy, 1, &encoded(&large)));
    assert_eq!(probes.detail, Detail::Model { error: ModelError::Probes, asked: 5, held: 4 });
    large.probes.truncate(4);
    large.planes.push(small.planes[0]).unwrap();
    large.initial_unbalance_g_mm.push([1.0, 2.0]).unwrap();
    let planes = answer(&mut node, &mut store, 0, &request(Command::Deploy, 1, &encoded(&large)));
    assert_eq!(planes.detail, Detail::Model { error: ModelError::Planes, asked: 3, held: 2 });
    assert_eq!((node.model(), node.counters().refused, store.savings), (Some(&rigid_rotor()), 2, 0));
}

#[test]
fn deployment_cut_at_any_frame_leaves_old_or_new_model() {
    let request = deploy(&better(), 5);
    let whole = transfer(&mut node(), &mut Store::default(), 0, &request, |_| false).0;
    let request_frames = 2 + (request.len() - 6).div_ceil(7);
    let mut cut = 0;
    for lost in 0..whole {
        let mut node = node();
        // everything from that frame on is lost
        let (_, answered) = transfer(&mut node, &mut Store::default(), 0, &request, |frame| frame >= lost);
        assert_eq!(answered, None, "cut at frame {lost}");
        let arrived = node.counters().accepted == 1;
        assert_eq!(node.model(), Some(&if arrived { better() } else { rigid_rotor() }));
        let later = 2 * TIMEOUT_US;
        node.poll(later);
        assert!(arrived || lost == 0 || node.counters().broken == 1, "cut at frame {lost} is reported");
        cut += usize::from(!arrived);
        sent(&mut node);
        assert_eq!(outcome_at(&mut node, later, &deploy(&better(), 6)), Outcome::Accepted);
    }
    assert!(cut >= request_frames - 1, "{cut} cuts before the end of {request_frames} frames");
}

fn outcome_at(node: &mut TestNode, time_us: u64, request: &[u8]) -> Outcome {
    answer(node, &mut Store::default(), time_us, request).outcome
}

#[test]
fn new_record_command_does_not_lower_the_flag() {
    let (mut node, mut store, time_us) = flagged();
    let answer = answer(&mut node, &mut store, time_us, &request(Command::Restart, 1, &[]));
    assert_eq!(answer.outcome, Outcome::Accepted);
    assert_eq!(node.monitor.last_g_mm(), rigid_rotor().initial_unbalance_g_mm.as_slice());
    assert_eq!(node.status(time_us).state, NodeState::Flagged);
    assert_eq!(store.start().status(0).state, NodeState::Flagged);
}

#[test]
fn acknowledgement_lowers_stored_flag_before_its_answer() {
    let (mut node, mut store, time_us) = flagged();
    let good = answer(&mut node, &mut store, time_us, &request(Command::Acknowledge, 7, &[]));
    assert_eq!((good.outcome, good.counter, store.counter), (Outcome::Accepted, 7, 7));
    assert_eq!(node.status(time_us).cause, Reason::None);
    assert_eq!(store.start().status(0).cause, Reason::None);
    // The fault is still there: it is flagged anew.
    let later = run(&mut node, &mut store, time_us, 15.0, |_| shown(&worn(0.5), SPEED_RPM, 1.0));
    assert_eq!(node.status(later).state, NodeState::Flagged);
}

#[test]
fn forged_or_unstorable_acknowledgement_leaves_flag_up() {
    let (mut node, mut store, time_us) = flagged();
    let forged = signed(Key([8; 32]), Command::Acknowledge, 7, &[]);
    assert_eq!(answer(&mut node, &mut store, time_us, &forged).outcome, Outcome::Forged);
    let cause = node.status(time_us).cause;
    assert_ne!(cause, Reason::None);
    store.fails = true;
    let failed = answer(&mut node, &mut store, time_us, &request(Command::Acknowledge, 7, &[]));
    assert_eq!((failed.outcome, failed.counter), (Outcome::Storage, 0));
    assert_eq!(node.status(time_us).cause, cause);
    // The counter is stored and the memory is not: the flag stays up as well.
    let request = request(Command::Acknowledge, 8, &[]);
    let mut fails_later = store.clone();
    fails_later.fails = false;
    deliver(&mut node, time_us, &request);
    fails_later.keep(&node.to_save().unwrap());
    node.saved(time_us, true);
    assert!(matches!(node.to_save(), Some(Save::Memory(_))));
    node.saved(time_us, false);
    assert_eq!((node.status(time_us).cause, node.command_counter()), (cause, 8));
    assert_eq!(fails_later.start().status(0).cause, cause);
}

/// Hands a request to the node and stores nothing.
fn deliver(node: &mut TestNode, time_us: u64, request: &[u8]) {
    use crate::can::isotp::IsoTp;
    use crate::can::{TYPE_TO_HOST, frame_id};
    let mut host = IsoTp::<128, MAX_REQUEST_BYTES>::new();
    host.send(time_us, request).unwrap();
    while node.to_save().is_none_or(|save| matches!(save, Save::Memory(_))) {
        while let Some(payload) = host.poll(time_us) {
            node.receive(time_us, &Frame::standard(frame_id(TYPE_TO_NODE, NODE), &payload).unwrap());
        }
        while let Some(frame) = node.transmit() {
            if frame.message_type() == TYPE_TO_HOST {
                host.receive(time_us, frame.bytes());
            }
        }
    }
}

#[test]
fn new_model_lowers_flag_and_old_memory_does_not_raise_it() {
    let (mut node, mut store, time_us) = flagged();
    assert_eq!(answer(&mut node, &mut store, time_us, &deploy(&better(), 1)).outcome, Outcome::Accepted);
    assert_eq!((node.status(time_us).state, node.status(time_us).cause), (NodeState::Waiting, Reason::None));
    assert_eq!(store.start().status(0).cause, Reason::None);
    // The power went between model and memory: the memory belongs to another model.
    let (mut node, mut cut, time_us) = flagged();
    deliver(&mut node, time_us, &deploy(&better(), 1));
    cut.keep(&node.to_save().unwrap());
    let started = cut.start();
    assert_eq!((started.model(), started.status(0).cause), (Some(&better()), Reason::None));
}

#[test]
fn same_model_deployed_again_changes_nothing_and_says_so() {
    let (mut node, mut store, time_us) = flagged();
    let (status, memory) = (node.status(time_us), store.memory.clone());
    let detector = *node.monitor.detector();
    for (command, counter) in [(Command::Deploy, 1), (Command::DeployAnother, 2)] {
        let told = request(command, counter, &encoded(&rigid_rotor()));
        let answer = answer(&mut node, &mut store, time_us, &told);
        assert_eq!((answer.outcome, answer.detail), (Outcome::Accepted, Detail::Unchanged));
        assert_eq!((answer.counter, answer.model_checksum), (counter, rigid_rotor().checksum()));
        assert_eq!((node.status(time_us), *node.monitor.detector()), (status, detector));
    }
    assert_eq!((store.counter, &store.memory), (2, &memory), "the requests cannot be sent again");
    let started = store.start().status(0);
    assert_eq!((started.cause, started.suspect), (status.cause, status.suspect));
}

#[test]
fn answer_to_new_model_names_lowered_flag() {
    let (mut node, mut store, time_us) = flagged();
    let Status { cause: lowered, suspect, .. } = node.status(time_us);
    assert!(lowered != Reason::None && suspect.is_some());
    let told = answer(&mut node, &mut store, time_us, &deploy(&better(), 1));
    assert_eq!(told.detail, Detail::Replaced { lowered, suspect });
    let told = answer(&mut node, &mut store, time_us, &deploy(&rigid_rotor(), 2));
    assert_eq!(told.detail, Detail::Replaced { lowered: Reason::None, suspect: None });
    let mut bare = TestNode::new(config()).unwrap();
    let told = answer(&mut bare, &mut Store::default(), 0, &deploy(&better(), 1));
    assert_eq!(told.detail, Detail::None, "there was none to replace");
}

#[test]
fn thresholds_are_set_stored_and_told() {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    let told = answer(&mut node, &mut store, 0, &request(Command::GetThresholds, 1, &[]));
    assert_eq!((told.outcome, told.thresholds), (Outcome::Accepted, Some(Thresholds::DEFAULT)));
    assert_eq!((store.savings, node.command_counter()), (0, 0), "asking changes nothing");
    let other = Thresholds { age_limit_s: 33.0, persistence_readings: 5, ..Thresholds::DEFAULT };
    let set = answer(&mut node, &mut store, 0, &request(Command::SetThresholds, 2, &other.encode()));
    assert_eq!((set.outcome, set.thresholds), (Outcome::Accepted, None));
    assert_eq!((node.thresholds(), store.start().thresholds(), store.counter), (&other, &other, 2));
    assert_eq!(store.start().model(), Some(&rigid_rotor()));
    let wrong = Thresholds { growth: 0.5, ..other };
    let refused = answer(&mut node, &mut store, 0, &request(Command::SetThresholds, 3, &wrong.encode()));
    let detail = Detail::Thresholds(ThresholdError::Growth);
    assert_eq!((refused.outcome, refused.detail), (Outcome::Thresholds, detail));
    assert_eq!((node.thresholds(), store.counter, node.counters().refused), (&other, 2, 1));
}

#[test]
fn unstorable_flag_is_shown_counted_and_retried() {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    let time_us = run(&mut node, &mut store, 0, 62.0, |_| reading(1.0));
    store.fails = true;
    let time_us = run(&mut node, &mut store, time_us, 15.0, |_| shown(&worn(0.5), SPEED_RPM, 1.0));
    // beside a suspicion that the flag tells of
    assert_eq!(now(&node, time_us), (NodeState::Flagged, Reason::Storage, 0));
    assert!((2..9).contains(&node.counters().unsaved), "{}", node.counters().unsaved);
    store.fails = false;
    let time_us = run(&mut node, &mut store, time_us, 8.0, |_| reading(1.0));
    assert_ne!(store.start().status(0).cause, Reason::None);
    assert_eq!(now(&node, time_us), (NodeState::Flagged, Reason::None, 0));
}

#[test]
fn unstorable_memory_is_told_and_retried_within_a_minute() {
    let (mut node, mut store, mut time_us) = tracking();
    store.fails = true;
    node.save_scheduler.changed_much(time_us);
    time_us = run(&mut node, &mut store, time_us, 1.0, |_| reading(1.0));
    assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::Storage, 0));
    // 1 s doubled to 64 s, then every 64 s: 7 + 8 h / 64 s; readings, an hour after the last saving too, try no earlier
    time_us = run(&mut node, &mut store, time_us, 8.0 * 3600.0, |_| reading(1.0));
    assert!((440..460).contains(&node.counters().unsaved), "{}", node.counters().unsaved);
    node.poll(time_us + SECOND_US);
    let told = sent(&mut node);
    let heartbeat = told.iter().find_map(|frame| match Message::decode(frame) {
        Ok((_, Message::Heartbeat { state, reason, .. })) => Some((state, reason)),
        _ => None,
    });
    assert_eq!(heartbeat, Some((NodeState::Tracking, Reason::Storage)));
    // what is worse stands before it
    let lacking = run(&mut node, &mut store, time_us + 2 * SECOND_US, 2.0, |_| lacking(reading(1.0), 0b0100));
    assert_eq!(now(&node, lacking), (NodeState::Tracking, Reason::Probes, 0b0100));
    assert_eq!(now(&node, lacking + 20 * SECOND_US), (NodeState::Stale, Reason::Age, 0b0100));
    let savings = store.savings;
    store.fails = false;
    let time_us = run(&mut node, &mut store, lacking, 64.0, |_| reading(1.0));
    assert_eq!(now(&node, time_us), (NodeState::Tracking, Reason::None, 0));
    assert!(store.savings > savings, "it is written within 64 s");
}

#[test]
fn node_that_never_could_store_says_so_while_it_learns() {
    let (mut node, mut store) = (node(), Store { fails: true, ..Store::with(&rigid_rotor()) });
    let time_us = run(&mut node, &mut store, 0, 5.0, |_| reading(1.0));
    assert_eq!(now(&node, time_us), (NodeState::Learning, Reason::Storage, 0));
    let told = answer(&mut node, &mut store, time_us, &deploy(&better(), 1));
    assert_eq!(told.outcome, Outcome::Storage);
    assert_eq!(node.model(), Some(&rigid_rotor()));
}

#[test]
fn memory_is_stored_seldom() {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    run(&mut node, &mut store, 0, 3.0 * 3600.0, |_| reading(1.0));
    // the first reading, learning that doubles from a second to a minute and ends, and the hours
    assert!((4..12).contains(&store.savings), "{}", store.savings);
    let started = store.start();
    assert!(!started.monitor.detector().is_learning());
    assert_eq!(started.monitor.detector().latched(), None::<LatchedFlag>);
}

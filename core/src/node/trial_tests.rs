//! A model on trial: used and not stored, until it is confirmed or its time is over.

use std::vec::Vec;

use super::testing::*;
use super::*;
use crate::command::{Command, Detail, Key, Outcome};
use crate::model::tests::rigid_rotor;
use crate::state::NodeState;

const TRIAL_S: u32 = 60;
const TRIAL_US: u64 = 60 * SECOND_US;

fn better() -> TestModel {
    let mut better = rigid_rotor();
    better.supports[0].mass_kg = 2.0;
    better
}

fn body(model: &TestModel) -> Vec<u8> {
    [&TRIAL_S.to_le_bytes()[..], &encoded(model)].concat()
}

fn trial(model: &TestModel, counter: u64) -> Vec<u8> {
    request(Command::Trial, counter, &body(model))
}

fn outcome(node: &mut TestNode, store: &mut Store, time_us: u64, request: &[u8]) -> Outcome {
    answer(node, store, time_us, request).outcome
}

/// A node that has tracked for a minute and then tries a better model, what it stored, and the time.
fn trying() -> (TestNode, Store, u64) {
    let (mut node, mut store, time_us) = tracking();
    assert_eq!(outcome(&mut node, &mut store, time_us, &trial(&better(), 5)), Outcome::Accepted);
    assert_eq!(node.model(), Some(&better()));
    (node, store, time_us)
}

/// Whether the node's heartbeat says that its model is on trial.
fn tells_trial(node: &mut TestNode, time_us: u64) -> bool {
    node.poll(time_us);
    let told = sent(node).iter().find_map(|frame| match Message::decode(frame) {
        Ok((_, Message::Model { on_trial, checksum, .. })) => Some((on_trial, checksum)),
        _ => None,
    });
    let (on_trial, checksum) = told.expect("a heartbeat was due");
    assert_eq!(checksum, node.model().map_or(0, Model::checksum));
    on_trial
}

#[test]
fn trial_model_is_used_and_power_loss_restores_the_old_one() {
    let (mut node, mut store, time_us) = trying();
    let memory = store.memory.clone();
    for second in 0..u64::from(TRIAL_S) - 1 {
        let now_us = time_us + second * SECOND_US;
        run(&mut node, &mut store, now_us, 1.0, |_| shown(&better(), SPEED_RPM, 1.0));
        assert!(!node.is_trial_over(now_us));
        let mut started = store.start();
        assert_eq!((started.model(), started.command_counter()), (Some(&rigid_rotor()), 5));
        assert!(!started.monitor.detector().is_learning(), "what was learned with it is known again");
        let again = trial(&better(), 5);
        assert_eq!(outcome(&mut started, &mut store.clone(), 0, &again), Outcome::Replayed);
    }
    assert_eq!((store.counter, &store.model), (5, &Some(encoded(&rigid_rotor()))));
    assert_eq!(store.memory, memory, "what is learned of the one belongs to the one");
}

#[test]
fn trial_ends_on_time_and_node_asks_to_be_polled_then() {
    let (mut node, mut store, time_us) = trying();
    let end_us = time_us + TRIAL_US;
    assert!(!node.is_trial_over(end_us - 1) && node.is_trial_over(end_us) && node.is_trial_over(u64::MAX));
    let mut now_us = time_us;
    while now_us < end_us {
        node.poll(now_us);
        store.serve(&mut node, now_us);
        sent(&mut node);
        assert!(node.poll_at() <= end_us, "{now_us}");
        now_us = node.poll_at().max(now_us + 1);
    }
    assert_eq!(store.start().model(), Some(&rigid_rotor()));

    let mut bare = TestNode::new(config()).unwrap();
    let mut store = Store::default();
    let longest = [&u32::MAX.to_le_bytes()[..], &encoded(&better())].concat();
    let longest = request(Command::Trial, 1, &longest);
    assert_eq!(outcome(&mut bare, &mut store, u64::MAX - 1, &longest), Outcome::Accepted);
    assert!(!bare.is_trial_over(u64::MAX - 1), "a time beyond all time is the end of it");
    assert_eq!(store.start().model(), None, "where there was none, none comes back");
}

#[test]
fn redeployed_trial_model_is_confirmed_with_its_baseline() {
    let (mut node, mut store, time_us) = trying();
    assert!(tells_trial(&mut node, time_us + SECOND_US));
    let time_us = run(&mut node, &mut store, time_us, 30.0, |_| shown(&better(), SPEED_RPM, 1.0));
    let detector = *node.monitor.detector();
    assert!(detector.is_learning() && detector.judged_us().is_some());
    assert_eq!(outcome(&mut node, &mut store, time_us, &deploy(&better(), 6)), Outcome::Accepted);
    assert_eq!((&store.model, store.counter), (&Some(encoded(&better())), 6));
    assert_eq!(*node.monitor.detector(), detector);
    assert!(!node.is_trial_over(u64::MAX) && !tells_trial(&mut node, time_us + SECOND_US));
    let started = store.start();
    assert_eq!(started.model(), Some(&better()));
    let memory = node.monitor.memory().encode();
    assert_eq!(store.memory.as_deref(), Some(&memory[..]), "and is stored at once");

    // outside of a trial the same model changes nothing, and is not tried
    for (request, counter) in [(deploy(&better(), 7), 7), (trial(&better(), 8), 8)] {
        let answer = answer(&mut node, &mut store, time_us, &request);
        assert_eq!((answer.outcome, answer.detail), (Outcome::Accepted, Detail::Unchanged));
        assert_eq!((*node.monitor.detector(), node.command_counter()), (detector, counter));
        assert!(!node.is_trial_over(u64::MAX), "no trial began");
    }
}

#[test]
fn deployment_ends_a_trial_and_a_new_trial_replaces_it() {
    let (mut node, mut store, time_us) = trying();
    let mut third = better();
    third.supports[1].mass_kg = 3.0;
    let later_us = time_us + TRIAL_US / 2;
    assert_eq!(outcome(&mut node, &mut store, later_us, &trial(&third, 6)), Outcome::Accepted);
    assert_eq!((node.model(), &store.model), (Some(&third), &Some(encoded(&rigid_rotor()))));
    assert!(!node.is_trial_over(time_us + TRIAL_US) && node.is_trial_over(later_us + TRIAL_US));
    assert_eq!(outcome(&mut node, &mut store, later_us, &deploy(&better(), 7)), Outcome::Accepted);
    assert_eq!((node.model(), &store.model), (Some(&better()), &Some(encoded(&better()))));
    assert!(!node.is_trial_over(u64::MAX));
}

#[test]
fn a_confirmation_that_cannot_be_stored_is_none() {
    let (mut node, mut store, time_us) = trying();
    store.fails = true;
    assert_eq!(outcome(&mut node, &mut store, time_us, &deploy(&better(), 6)), Outcome::Storage);
    assert!(node.is_trial_over(time_us + TRIAL_US));
    assert_eq!((node.command_counter(), store.start().model()), (5, Some(&rigid_rotor())));
}

#[test]
fn a_trial_is_refused_as_a_deployment_is_and_changes_nothing() {
    let (mut node, mut store, time_us) = tracking();
    let savings = store.savings;
    let mut bad = better();
    bad.supports.truncate(1);
    let others = TestModel { machine: *b"next", ..better() };
    let refused = [
        (trial(&bad, 5), Outcome::Model),
        (trial(&others, 5), Outcome::Machine),
        (signed(Key([8; 32]), Command::Trial, 5, &body(&better())), Outcome::Forged),
        (trial(&better(), u64::MAX), Outcome::Counter),
        // without the seconds
        (request(Command::Trial, 5, &encoded(&better())), Outcome::Model),
    ];
    for (request, expected) in &refused {
        assert_eq!(outcome(&mut node, &mut store, time_us, request), *expected);
    }
    let whole = body(&better());
    for length in 0..whole.len() {
        let cut = request(Command::Trial, 5, &whole[..length]);
        assert_eq!(outcome(&mut node, &mut store, time_us, &cut), Outcome::Model, "{length} bytes");
    }
    store.fails = true;
    assert_eq!(outcome(&mut node, &mut store, time_us, &trial(&better(), 5)), Outcome::Storage);
    assert_eq!((node.model(), node.command_counter(), store.savings), (Some(&rigid_rotor()), 0, savings));
    assert!(!node.is_trial_over(u64::MAX) && !node.monitor.detector().is_learning());
}

#[test]
fn earlier_flag_stays_stored_through_a_trial() {
    let (mut node, mut store, time_us) = tracking();
    let time_us = run(&mut node, &mut store, time_us, 15.0, |_| shown(&worn(0.5), SPEED_RPM, 1.0));
    assert_eq!(node.status(time_us).state, NodeState::Flagged);
    assert_eq!(outcome(&mut node, &mut store, time_us, &trial(&better(), 5)), Outcome::Accepted);
    assert_eq!(node.status(time_us).cause, Reason::None);
    let time_us = run(&mut node, &mut store, time_us, 15.0, |_| shown(&worn(0.9), SPEED_RPM, 1.0));
    assert_eq!(node.status(time_us).state, NodeState::Flagged, "the one on trial misfits as well");
    let acknowledge = request(Command::Acknowledge, 6, &[]);
    assert_eq!(outcome(&mut node, &mut store, time_us, &acknowledge), Outcome::Accepted);
    assert_eq!((node.status(time_us).cause, store.counter), (Reason::None, 6));
    let started = store.start();
    assert_eq!((started.status(0).state, started.model()), (NodeState::Flagged, Some(&rigid_rotor())));
    assert_eq!(started.command_counter(), 6);
}

//! Models deployed to monitors that lose their power, hold other machines, or are not there.

use std::time::Duration;

use rotor_edge::bus::CanBus;
use rotor_edge::bus::mac::AuthenticatedBus;
use rotor_edge::deploy::{Authority, HEARTBEAT_TIME};
use rotor_edge::edge::encoded;
use rotor_edge::replay::live::run_with_foreign_monitor;
use rotor_edge::replay::{self, AnsweredReading, ReplayConfig};
use rotor_edge::sample;
use rotor_edge_core::command::{Command, Detail};
use rotor_edge_core::state::{NodeState, Reason};
use rotor_edge_desktop::machine::drawing::Rotor;

use super::lab::{
    KEY, Lab, NODE, checksum, deployment, flagging_config, guess, identified, initial, model, worse,
};
use crate::program::assert_says;

/// As `replay --external` plays the sample's record.
pub fn play(lab: &mut Lab) -> Vec<AnsweredReading> {
    let (_, record, _) = sample::load().unwrap();
    let (mut authority, mut port) = (lab.authority(), lab.bus.join());
    let mut host = AuthenticatedBus::listen(&mut port, authority.checker(), HEARTBEAT_TIME).unwrap();
    let (deployment, config) = (deployment(&identified()), ReplayConfig::default());
    let played = run_with_foreign_monitor(&mut host, &mut authority, &deployment, &record, &config, |_| ());
    played.unwrap().answers
}

#[track_caller]
fn assert_same(answers: &[AnsweredReading], expected: &[AnsweredReading]) {
    assert_eq!(answers.len(), expected.len());
    for (a, b) in answers.iter().zip(expected) {
        assert_eq!((a.row, a.result), (b.row, b.result));
    }
}

#[test]
fn deployed_model_gives_its_numbers_and_survives_power_loss() {
    let mut lab = Lab::new();
    let (_, record, _) = sample::load().unwrap();
    let config = ReplayConfig::default();
    let expected = replay::run(&deployment(&identified()), &record, &config, |_| ()).unwrap().answers;
    assert_eq!(expected.len(), 451);
    let node = lab.node(Some(&guess()));
    let better = model(&identified());
    assert_eq!(lab.deploy(KEY, 5, &better), Ok(better.checksum()));
    assert_same(&play(&mut lab), &expected);
    assert_says(&node.kill().join("\n"), &[&format!("Model {:08x} was deployed", better.checksum())]);

    let _node = lab.node(Some(&guess()));
    assert_says(&lab.deploy(KEY, 5, &better).unwrap_err(), &["has accepted command", "--counter"]);
    assert_same(&play(&mut lab), &expected);
}

#[test]
fn deployment_of_another_machine_is_refused_unless_forced() {
    let lab = Lab::new();
    let _node = lab.node(None);
    lab.deploy(KEY, 1, &model(&identified())).expect("nothing is held yet");
    lab.deploy(KEY, 2, &model(&worse())).expect("the same machine with other bearings");
    let held = checksum(&lab.seen());

    let mut rotor = identified();
    rotor.serial = Some("2".into());
    let other = model(&rotor);
    let refused = lab.deploy(KEY, 3, &other).unwrap_err();
    assert_says(&refused, &["the model of another machine", "--another-machine"]);
    assert_eq!(checksum(&lab.seen()), held, "the old one stays");
    assert_eq!(lab.command(KEY, 4, Command::DeployAnother, &other), Ok(other.checksum()));
    assert_says(&lab.deploy(KEY, 5, &model(&identified())).unwrap_err(), &["--another-machine"]);
}

#[test]
fn monitor_without_model_judges_nothing_until_one_is_deployed() {
    let lab = Lab::new();
    let _node = lab.node(None);
    let seen = lab.seen();
    let status = seen.status().unwrap();
    assert_eq!((status.state, status.reason), (NodeState::NoModel, Reason::NothingStored));
    assert_eq!(seen.model(), None);
    lab.deploy(KEY, 1, &model(&identified())).unwrap();
    let seen = lab.seen();
    let status = seen.status().unwrap();
    assert_eq!((status.state, status.reason), (NodeState::Waiting, Reason::NoReading));
    let model = seen.model().unwrap();
    assert_eq!((model.probes, model.planes), (4, 2));
}

#[test]
fn monitor_with_damaged_state_says_so_until_deployed_to() {
    let lab = Lab::new();
    // the last one is whole but for its code
    for text in [
        "not a state at all",
        "rotor-edge monitor 2\ncounter 41",
        "rotor-edge monitor 1\ncounter 41\nmodel 03\n",
    ] {
        std::fs::write(lab.path("monitor.state"), text).unwrap();
        let counter = lab.store("monitor.state").counter();
        let node = lab.node(None);
        let seen = lab.seen();
        let status = seen.status().unwrap();
        assert_eq!((status.state, status.reason), (NodeState::NoModel, Reason::Damaged), "{text}");
        assert_says(&lab.deploy(KEY, 1_000, &model(&identified())).unwrap_err(), &["has accepted command"]);
        // its counter is the present time in milliseconds
        lab.deploy(KEY, counter + 60_000, &model(&identified())).unwrap();
        assert_eq!(checksum(&lab.seen()), model(&identified()).checksum());
        node.kill();
    }
}

#[test]
fn command_to_absent_monitor_is_given_up_in_ten_seconds() {
    let lab = Lab::new();
    let _node = lab.node(None);
    let (mut bus, begun) = (lab.bus.join(), lab.bus.now());
    let mut authority = Authority::new(KEY, 3, Some(1)).unwrap();
    let bytes = encoded(&model(&identified())).unwrap();
    let refused = authority.command(&mut bus, Command::Deploy, &bytes, |_| ()).unwrap_err();
    assert_says(&refused.to_string(), &["monitor 3 does not answer", "rotor-edge watch"]);
    assert!(bus.now() - begun < Duration::from_secs(10), "{:?}", bus.now() - begun);
}

#[test]
fn model_in_use_deployed_again_keeps_flag_and_says_so() {
    let lab = Lab::new();
    let config = flagging_config();
    let store = initial(lab.store("monitor.state"), Some(&worse()));
    let _node = lab.node_with(config, store, |port| Box::new(port));
    let traffic = lab.traffic();
    lab.await_seen(Duration::from_secs(20), |monitor| monitor.state() == Some(NodeState::Flagged));
    traffic.kill();
    let before = *lab.seen().status().unwrap();
    let mut authority = Authority::new(KEY, NODE, Some(7)).unwrap();
    let mut deploy = |rotor: &Rotor| {
        let bytes = encoded(&model(rotor)).unwrap();
        authority.command(&mut lab.bus.join(), Command::Deploy, &bytes, |_| ()).unwrap().detail
    };
    assert_eq!(deploy(&worse()), Detail::Unchanged);
    let after = *lab.seen().status().unwrap();
    assert_eq!((after.state, after.cause, after.suspect), (before.state, before.cause, before.suspect));
    assert_eq!(deploy(&identified()), Detail::Replaced { lowered: before.cause, suspect: before.suspect });
    assert_eq!(lab.seen().status().unwrap().cause, Reason::None);
}

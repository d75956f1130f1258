//! A flag that stays up until it is acknowledged.

use std::time::Duration;

use rotor_edge::deploy::{Authority, acknowledge};
use rotor_edge::watch::monitor::Monitor;
use rotor_edge::watch::words::Words;
use rotor_edge_core::state::{NodeState, Reason};
use rotor_edge_core::thresholds::Thresholds;

use super::deployment::play;
use super::lab::{Lab, NODE, Node, WRONG_KEY, flagging_config, identified, initial, worse};
use crate::program::assert_says;

/// A monitor for which each reading of the record counts by itself, however fast it is sent.
fn fast_node(lab: &Lab) -> Node {
    let fast = Thresholds {
        average_s: 0.0,
        persistence_s: 0.0,
        growth_s: 1.25e-6,
        level_s: 1.25e-5,
        learning_s: 0.0,
        ..Thresholds::DEFAULT
    };
    let store = initial(lab.store("monitor.state"), Some(&identified()));
    lab.node_with(
        {
            let mut config = Lab::config();
            config.thresholds = fast;
            config
        },
        store,
        |port| Box::new(port),
    )
}

#[track_caller]
fn assert_flagged(lab: &Lab) {
    let watch = lab.watch();
    let monitor = watch.monitor(NODE).unwrap();
    let status = monitor.status().unwrap();
    assert_eq!(
        (status.state, status.cause, status.suspect),
        (NodeState::Flagged, Reason::Rise, Some(1)),
        "bearing 2 counts from 0"
    );
    assert_says(&Words::of(NODE, monitor, watch.now_us()).next, &["rotor-edge acknowledge"]);
}

#[test]
fn flag_survives_power_loss_until_acknowledged_with_the_key() {
    let mut lab = Lab::new();
    let node = fast_node(&lab);
    let nothing = acknowledge(&mut lab.authority(), &mut lab.bus.join(), false).unwrap_err().to_string();
    assert_says(&nothing, &["monitor 1 holds no flag", "--announce"]);
    let [before, _] = acknowledge(&mut lab.authority(), &mut lab.bus.join(), true).unwrap();
    assert_eq!(before.cause, Reason::None, "a change is announced before it is made");
    play(&mut lab);
    assert_flagged(&lab);
    node.kill();
    let node = fast_node(&lab);
    assert_flagged(&lab);
    let mut stranger = Authority::new(WRONG_KEY, NODE, None).unwrap();
    let refused = acknowledge(&mut stranger, &mut lab.bus.join(), false).unwrap_err().to_string();
    assert_says(&refused, &["another key"]);
    assert_flagged(&lab);
    let [before, now] = acknowledge(&mut lab.authority(), &mut lab.bus.join(), false).unwrap();
    assert_eq!((before.cause, before.suspect, now.state), (Reason::Rise, Some(1), NodeState::Waiting));
    assert_eq!(lab.seen().status().unwrap().cause, Reason::None);
    node.kill();
    let _node = fast_node(&lab);
    assert_eq!(lab.seen().status().unwrap().cause, Reason::None, "acknowledged for good");
}

#[test]
fn flag_without_room_is_told_and_stored_once_there_is_room() {
    let lab = Lab::new();
    let config = flagging_config();
    // no folder stands for a disk without room
    let start = || {
        let store = initial(lab.store("room/monitor.state"), Some(&worse()));
        lab.node_with(config, store, |port| Box::new(port))
    };
    let is_unsaved = |monitor: &Monitor| {
        let flagged = (Some(NodeState::Flagged), Some(Reason::Storage));
        (monitor.state(), monitor.status().map(|status| status.reason)) == flagged
    };
    let node = start();
    let traffic = lab.traffic();
    lab.await_seen(Duration::from_secs(20), is_unsaved);
    let watch = lab.watch();
    let monitor = watch.monitor(NODE).unwrap();
    assert_says(
        &Words::of(NODE, monitor, watch.now_us()).state,
        &["at present: what it learned could not be stored"],
    );
    let cause = monitor.status().unwrap().cause;
    std::fs::create_dir(lab.path("room")).unwrap();
    lab.await_seen(Duration::from_secs(70), |monitor| !is_unsaved(monitor));
    assert_says(&node.kill().join("\n"), &["cannot be stored", "room", "is stored again"]);
    traffic.kill();
    let _node = start();
    let status = *lab.seen().status().unwrap();
    assert_eq!((status.state, status.cause), (NodeState::Flagged, cause));
}

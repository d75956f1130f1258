//! Two monitors with one number.

use std::time::Duration;

use rotor_edge::bus::CanBus;
use rotor_edge::deploy::await_heartbeat;
use rotor_edge::node::Store;
use rotor_edge::watch::Watch;
use rotor_edge::watch::terminal::listen;
use rotor_edge::watch::words::Words;
use rotor_edge_core::node::NodeConfig;

use super::lab::{Lab, NODE, Node, identified, initial};
use crate::program::assert_says;

fn node(lab: &Lab, seed: u64) -> Node {
    let mut config = NodeConfig::new(NODE);
    config.seed = seed;
    lab.node_with(config, initial(Store::in_memory(), Some(&identified())), |port| Box::new(port))
}

#[test]
fn two_monitors_with_one_number_are_told_until_one_leaves() {
    let lab = Lab::new();
    let first = node(&lab, 1);
    // in a conflict, a monitor says too little to be known to a watcher that has just begun
    let (mut bus, mut watch) = (lab.bus.join(), Watch::new(None));
    let started = bus.now();
    listen(&mut bus, &mut watch, started, Duration::from_secs(2)).unwrap();
    await_heartbeat(&mut lab.bus.join(), NODE).unwrap();
    let second = node(&lab, 2);
    listen(&mut bus, &mut watch, started, Duration::from_secs(3)).unwrap();
    let monitor = watch.monitor(NODE).unwrap();
    assert!(monitor.is_in_conflict(watch.now_us()));
    let words = Words::of(NODE, monitor, watch.now_us());
    assert_says(&words.state, &["two devices call themselves monitor 1", "neither answers readings"]);
    let refused = await_heartbeat(&mut lab.bus.join(), NODE).unwrap_err().to_string();
    assert_says(&refused, &["two devices on simulated bus call themselves monitor 1", "another number"]);

    second.kill();
    listen(&mut bus, &mut watch, started, Duration::from_secs(8)).unwrap();
    assert!(!watch.monitor(NODE).unwrap().is_in_conflict(watch.now_us()));
    await_heartbeat(&mut lab.bus.join(), NODE).unwrap();
    assert!(first.end().counters.conflicts > 0);
}

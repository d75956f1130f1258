//! A bus whose server goes away and comes back under a monitor and a watcher.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rotor_edge::bus::CanBus;
use rotor_edge::bus::reconnecting::Reconnecting;
use rotor_edge::bus::simulated::{Running, SimulatedBus, SimulatedPort};
use rotor_edge::watch::Watch;
use rotor_edge::watch::terminal::listen;

use super::lab::{KEY, Lab, NODE, checksum, identified, model};
use crate::program::assert_says;

type Said = Arc<Mutex<Vec<String>>>;
const GONE: &str = "the bus simulated bus is gone; trying again";
const BACK: &str = "the bus simulated bus is back";

fn lasting(port: SimulatedPort, said: &Said) -> Box<dyn CanBus> {
    let (again, said) = (port.rejoining(), said.clone());
    let tell = move |words: &str| said.lock().unwrap().push(words.to_string());
    Box::new(Reconnecting::new(Box::new(port), again, tell))
}

/// A watcher on a lasting bus; what it heard until it was stopped.
fn watcher(bus: &SimulatedBus, said: &Said, stop: &Arc<AtomicBool>) -> Running<Watch> {
    let (said, stop) = (said.clone(), stop.clone());
    bus.start(move |port| {
        let (mut bus, mut watch) = (lasting(port, &said), Watch::new(None));
        let started = bus.now();
        while !stop.load(Ordering::Relaxed) {
            listen(&mut *bus, &mut watch, started, Duration::from_millis(100)).unwrap();
        }
        watch
    })
}

#[track_caller]
fn await_said(lab: &Lab, all: [&Said; 2], last: &str) {
    let end = lab.bus.now() + Duration::from_secs(10);
    while !all.iter().all(|said| said.lock().unwrap().last().is_some_and(|words| words == last)) {
        assert!(lab.bus.now() < end, "{all:?}");
        lab.bus.pass(Duration::from_millis(50));
    }
}

#[test]
fn monitor_and_watcher_outlive_the_bus_with_all_they_hold() {
    let lab = Lab::new();
    let [node_said, watcher_said] = [Said::default(), Said::default()];
    let words = node_said.clone();
    let node = lab.node_with(Lab::config(), lab.store("monitor.state"), move |port| lasting(port, &words));
    let stop = Arc::new(AtomicBool::new(false));
    let watcher = watcher(&lab.bus, &watcher_said, &stop);
    let better = model(&identified());
    lab.deploy(KEY, 5, &better).unwrap();
    assert_eq!(checksum(&lab.seen()), better.checksum());
    for outage_s in [1, 30] {
        lab.bus.go_away();
        await_said(&lab, [&node_said, &watcher_said], GONE);
        lab.bus.pass(Duration::from_secs(outage_s));
        lab.bus.come_back();
        await_said(&lab, [&node_said, &watcher_said], BACK);
    }
    assert_eq!(checksum(&lab.seen()), better.checksum(), "the model was kept");
    assert_says(&lab.deploy(KEY, 4, &better).unwrap_err(), &["has accepted command", "--counter"]);
    assert_eq!(lab.deploy(KEY, 6, &better), Ok(better.checksum()));
    assert_eq!(node.end().counters.accepted, 2, "before the outages and after them");
    stop.store(true, Ordering::Relaxed);
    let watch = watcher.end();
    let heard_us = watch.monitor(NODE).unwrap().heard_us().unwrap();
    assert!(watch.now_us() - heard_us < 2_000_000, "the watcher hears it again");
    for said in [&node_said, &watcher_said] {
        assert_eq!(*said.lock().unwrap(), [GONE, BACK, GONE, BACK], "each outage is told once");
    }
}

//! An authenticated monitor and its watcher beside a forger without the key.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rotor_edge::bus::CanBus;
use rotor_edge::bus::decoded::DecodedLog;
use rotor_edge::bus::log::{LogReader, RecordingBus};
use rotor_edge::bus::mac::{Authenticator, Checker, present_us};
use rotor_edge::bus::simulated::{Running, SimulatedPort};
use rotor_edge::watch::Watch;
use rotor_edge::watch::terminal::listen;
use rotor_edge::watch::words::Words;
use rotor_edge_core::can::mac::TYPE_TOLD_CODE;
use rotor_edge_core::can::{
    FLAG_FLAGGED, Frame, Message, MonitorResult, NumberedReading, ResultAssembler, TYPE_HEARTBEAT,
    reading_frames, result_frames,
};
use rotor_edge_core::command::Key;
use rotor_edge_core::reading::Reading;
use rotor_edge_core::state::{NodeState, Status};

use super::lab::{KEY, Lab, NODE, Node, identified, initial, readings};
use crate::program::assert_says;

const READINGS: u16 = 10;
const PATIENCE: Duration = Duration::from_secs(20);
/// So long after a restart no reading is taken, at most.
const RESERVE: Duration = Duration::from_secs(10);

/// A monitor that takes authenticated readings alone, when it has begun to speak.
fn node(lab: &Lab, host: &mut dyn CanBus) -> Node {
    let reserve_us = RESERVE.as_micros() as u64;
    let mut config = Lab::config();
    config.authenticated = true;
    config.nonce_reserve = reserve_us;
    let store = initial(lab.store("monitor.state"), Some(&identified()));
    let node = lab.node_with(config, store, |port| Box::new(port));
    hear(host, PATIENCE, |frame| frame.message_type() == TYPE_HEARTBEAT).expect("a heartbeat");
    node
}

fn hear(host: &mut dyn CanBus, time: Duration, mut is_it: impl FnMut(&Frame) -> bool) -> Option<Frame> {
    let end = host.now() + time;
    while host.now() < end {
        let heard = host.receive(Duration::from_millis(5)).unwrap();
        if let Some(frame) = heard.filter(|frame| frame.node() == NODE && is_it(frame)) {
            return Some(frame);
        }
    }
    None
}

fn answer(host: &mut dyn CanBus, time: Duration) -> Option<MonitorResult> {
    let (mut assembler, mut answer) = (ResultAssembler::new(), None);
    hear(host, time, |frame| {
        answer = assembler.receive(frame);
        answer.is_some()
    });
    answer
}

fn send(host: &mut dyn CanBus, frames: &[Frame]) {
    frames.iter().for_each(|frame| host.send(frame).unwrap());
}

fn frames(sequence: u16, reading: &Reading) -> Vec<Frame> {
    reading_frames(NODE, &NumberedReading::new(sequence, *reading)).into_iter().collect()
}

/// A reading with its MAC by a clock that goes with the bus's and is never behind this machine's.
fn authenticated(
    authenticator: &mut Authenticator,
    bus: &dyn CanBus,
    sequence: u16,
    reading: &Reading,
) -> Vec<Frame> {
    let mut frames = frames(sequence, reading);
    let mac = authenticator.mac_at(present_us() + bus.now().as_micros() as u64, &frames);
    frames.extend(mac);
    frames
}

/// What somebody without the key can make up: a reading far ahead, the same under a key of its own, a flagged result, a state.
fn forged(reading: &Reading, answer: &MonitorResult) -> Vec<Frame> {
    let ahead = frames(0x7000, reading);
    let mac = Authenticator::new(Key([1; 32]), NODE).mac(&ahead);
    let flagged = MonitorResult { flags: FLAG_FLAGGED, sequence: 77, ..*answer };
    let state = Status { state: NodeState::Flagged, age_s: 0.0, ..Status::default() };
    let mut all = [&ahead[..], &frames(0x7001, reading), &mac].concat();
    all.extend([&ahead[..], &mac].concat());
    all.extend(result_frames(NODE, &flagged));
    all.push(Message::State(state).encode(NODE));
    all
}

/// `watch --key --record` until it is stopped; what it heard.
fn watcher(lab: &Lab, stop: &Arc<AtomicBool>) -> Running<Watch> {
    let (log, stop) = (lab.path("heard.log"), stop.clone());
    lab.bus.start(move |port: SimulatedPort| {
        let mut bus = RecordingBus::new(port, &log).unwrap();
        let mut watch = Watch::new(Some(NODE)).checking(Checker::new(KEY, NODE));
        let started = bus.now();
        while !stop.load(Ordering::Relaxed) {
            listen(&mut bus, &mut watch, started, Duration::from_millis(100)).unwrap();
        }
        watch
    })
}

fn decoded(lab: &Lab, checker: Option<Checker>) -> DecodedLog {
    let log = LogReader::open(&lab.path("heard.log")).unwrap();
    DecodedLog::checked(log, "heard.log", checker).unwrap()
}

/// Sends readings, each followed by forgeries; the frames that a forger can record.
fn exchange(
    host: &mut dyn CanBus,
    forger: &mut dyn CanBus,
    authenticator: &mut Authenticator,
) -> Vec<Vec<Frame>> {
    let mut recorded = Vec::new();
    for (sequence, reading) in (0..).zip(&readings(READINGS.into())) {
        let genuine = authenticated(authenticator, host, sequence, reading);
        send(host, &genuine);
        let answer = answer(host, PATIENCE).expect("an answer to each sealed reading");
        assert_eq!(answer.sequence, sequence);
        // between a result and its MAC, a forged frame would cost it
        hear(host, PATIENCE, |frame| frame.message_type() == TYPE_TOLD_CODE).expect("its seal");
        send(forger, &forged(reading, &answer));
        send(forger, &genuine);
        recorded.push(genuine);
        // the forger's own result is heard here as well, and a heartbeat tells that all of it is through
        hear(host, PATIENCE, |frame| frame.message_type() == TYPE_HEARTBEAT).expect("it speaks on");
    }
    hear(host, PATIENCE, |frame| frame.message_type() == TYPE_HEARTBEAT).expect("it speaks on");
    recorded
}

#[test]
fn forger_neither_silences_nor_misleads_a_monitor_with_macs() {
    let lab = Lab::new();
    let (mut host, mut forger) = (lab.bus.join(), lab.bus.join());
    let _node = node(&lab, &mut host);
    let stop = Arc::new(AtomicBool::new(false));
    let watcher = watcher(&lab, &stop);
    exchange(&mut host, &mut forger, &mut Authenticator::new(KEY, NODE));
    stop.store(true, Ordering::Relaxed);
    let watch = watcher.end();
    let all: Vec<_> = watch.monitors().collect();
    let [(_, heard)] = &all[..] else { panic!("one monitor: {all:?}") };
    let results: Vec<u16> = heard.history().iter().map(|result| result.what.sequence).collect();
    assert_eq!(results, (0..READINGS).collect::<Vec<_>>());
    assert_ne!(heard.state(), Some(NodeState::Flagged));
    assert!(!heard.is_in_conflict(watch.now_us()));
    assert_says(&Words::of(NODE, heard, watch.now_us()).state, &["refused: ", "with a wrong MAC"]);
    let (refused, times) = (heard.refused().unwrap(), u64::from(READINGS));
    assert!(
        refused.replayed >= times && refused.forged >= times && refused.without_mac >= times,
        "{refused}"
    );
    let counted = heard.counters().unwrap();
    let times = u32::from(READINGS);
    assert_eq!((counted.readings, counted.replayed), (times, times));
    assert!(counted.forged >= times && counted.conflicts >= times, "{counted:?}");
    assert_eq!((counted.lost, counted.late), (0, 0), "numbers that are forged make none late");

    let believed = decoded(&lab, Some(Checker::new(KEY, NODE)));
    assert_eq!(believed.nodes[&NODE].results.len(), usize::from(READINGS));
    assert!(believed.refused().unwrap().forged >= u64::from(READINGS));
    assert_eq!(decoded(&lab, None).nodes[&NODE].results.len(), usize::from(2 * READINGS));
}

#[test]
fn recorded_readings_are_refused_after_power_loss() {
    let lab = Lab::new();
    let (mut host, mut forger) = (lab.bus.join(), lab.bus.join());
    let running = node(&lab, &mut host);
    let mut authenticator = Authenticator::new(KEY, NODE);
    let recorded = exchange(&mut host, &mut forger, &mut authenticator);
    running.kill();
    let _node = node(&lab, &mut host);
    for frames in &recorded {
        send(&mut forger, frames);
        assert_eq!(answer(&mut host, Duration::from_millis(50)), None);
    }
    let (begun, reading) = (host.now(), readings(1)[0]);
    let mut is_answered = false;
    while !is_answered && host.now() - begun < PATIENCE {
        let frames = authenticated(&mut authenticator, &host, READINGS, &reading);
        send(&mut host, &frames);
        is_answered = answer(&mut host, Duration::from_millis(200)).is_some();
    }
    assert!(is_answered, "the sender is heard again after the reserve");
    assert!(host.now() - begun <= RESERVE, "{:?}", host.now() - begun);
}

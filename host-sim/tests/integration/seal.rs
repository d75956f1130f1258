//! `rotor-edge node --sealed` and `watch --key` beside a forger: real programs on a real bus.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::bench::Bench;
use crate::program::{assert_says, json, refusal, rotor_edge};
use crate::shared::{PATIENCE, Shared, signal};
use nix::sys::signal::Signal;
use rotor_edge::bus::seals::Sealer;
use rotor_edge::bus::{CanBus, open};
use rotor_edge::deploy::{read_key, write_new_key};
use rotor_edge::edge::Deployment;
use rotor_edge::sample;
use rotor_edge_core::can::seal::TYPE_TOLD_CODE;
use rotor_edge_core::can::{
    FLAG_FLAGGED, Frame, Message, MonitorResult, NumberedReading, ResultAssembler, TYPE_HEARTBEAT,
    reading_frames, result_frames,
};
use rotor_edge_core::command::Key;
use rotor_edge_core::reading::Reading;
use rotor_edge_core::state::{NodeState, Status};

const NODE: u8 = 4;
const READINGS: u16 = 10;

fn program(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// A monitor that takes sealed readings alone, when it has begun to speak.
fn monitor(bus: &Shared, host: &mut dyn CanBus, folder: &Path) -> Child {
    let [key, state] = ["monitor.key", "monitor.state"].map(|name| folder.join(name).display().to_string());
    let node = NODE.to_string();
    let words = ["node", "--sealed", "--sample", "--json", "--bus", bus.spec("slcan"), "--node", &node];
    let child = program(&[&words[..], &["--key", &key, "--state", &state]].concat());
    hear(host, Duration::from_secs(60), |frame| frame.message_type() == TYPE_HEARTBEAT).expect("a heartbeat");
    child
}

fn hear(host: &mut dyn CanBus, time: Duration, mut is_it: impl FnMut(&Frame) -> bool) -> Option<Frame> {
    let begun = Instant::now();
    while begun.elapsed() < time {
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

fn readings() -> Vec<Reading> {
    let (mut rotor, record, _) = sample::load().unwrap();
    for plane in &mut rotor.plane {
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(900.0), Some(40.0));
    }
    let deployment = Deployment::new(&rotor, 11_500.0).unwrap();
    let all = record.iter().map(|measured| deployment.reading(measured)).filter(Reading::is_complete);
    all.take(usize::from(READINGS)).collect()
}

fn frames(sequence: u16, reading: &Reading) -> Vec<Frame> {
    reading_frames(NODE, &NumberedReading::new(sequence, *reading)).into_iter().collect()
}

/// What somebody without the key can make up: a reading far ahead, the same under his own key, a flagged result, a state.
fn forged(reading: &Reading, answer: &MonitorResult) -> Vec<Frame> {
    let ahead = frames(0x7000, reading);
    let seal = Sealer::new(Key([1; 32]), NODE).seal(&ahead);
    let flagged = MonitorResult { flags: FLAG_FLAGGED, sequence: 77, ..*answer };
    let state = Status { state: NodeState::Flagged, age_s: 0.0, ..Status::default() };
    let mut all = [&ahead[..], &frames(0x7001, reading), &seal].concat();
    all.extend([&ahead[..], &seal].concat());
    all.extend(result_frames(NODE, &flagged));
    all.push(Message::State(state).encode(NODE));
    all
}

#[test]
fn a_forger_neither_silences_a_sealed_monitor_nor_misleads_who_watches_it() {
    let folder = tempfile::tempdir().unwrap();
    let key_file = folder.path().join("monitor.key");
    write_new_key(&key_file).unwrap();
    let (bus, log) = (Shared::start(&[]), folder.path().join("heard.log").display().to_string());
    let (key_words, node) = (key_file.display().to_string(), NODE.to_string());
    let (mut host, mut forger) = (bus.join("slcan"), bus.join("slcan"));
    let mut child = monitor(&bus, &mut *host, folder.path());
    let words = ["watch", "--bus", bus.spec("socketcand"), "--json", "--node", &node, "--key", &key_words];
    let watch = program(&[&words[..], &["--record", &log]].concat());
    let asked = |frame: &Frame| Message::decode(frame).is_ok_and(|(_, m)| m == Message::VersionQuery);
    hear(&mut *host, PATIENCE, asked).expect("watch has joined");

    let mut sealer = Sealer::new(read_key(&key_file).unwrap(), NODE);
    let mut recorded = Vec::new();
    for (sequence, reading) in (0..).zip(&readings()) {
        let mut sealed = frames(sequence, reading);
        sealed.extend(sealer.seal(&sealed));
        send(&mut *host, &sealed);
        let answer = answer(&mut *host, PATIENCE).expect("an answer to each sealed reading");
        assert_eq!(answer.sequence, sequence);
        // between a result and its seal, a forged frame would cost it
        hear(&mut *host, PATIENCE, |frame| frame.message_type() == TYPE_TOLD_CODE).expect("its seal");
        send(&mut *forger, &forged(reading, &answer));
        send(&mut *forger, &sealed);
        recorded.push(sealed);
        // the forger's own result is heard here as well, and a heartbeat tells that all of it is through
        hear(&mut *host, PATIENCE, |frame| frame.message_type() == TYPE_HEARTBEAT).expect("it speaks on");
    }
    hear(&mut *host, PATIENCE, |frame| frame.message_type() == TYPE_HEARTBEAT).expect("it speaks on");
    signal(watch.id(), Signal::SIGTERM);
    let all = json(&watch.wait_with_output().unwrap());
    let [heard] = &all["monitors"].as_array().unwrap()[..] else { panic!("one monitor: {all}") };
    let results: Vec<u64> =
        heard["history"].as_array().unwrap().iter().map(|r| r["sequence"].as_u64().unwrap()).collect();
    assert_eq!(results, (0..u64::from(READINGS)).collect::<Vec<_>>());
    assert_ne!(heard["state"], "flagged");
    assert_eq!(heard["conflict"], false);
    assert_says(heard["says"].as_str().unwrap(), &["refused: ", "with a wrong seal"]);
    let refused = |kind: &str| heard["refused"][kind].as_u64().unwrap();
    let times = u64::from(READINGS);
    assert!(refused("replayed") >= times && refused("forged") >= times, "{}", heard["refused"]);
    assert!(refused("unsealed") >= times, "{}", heard["refused"]);
    let counted = |name: &str| heard["counters"][name].as_u64().unwrap();
    assert_eq!((counted("readings"), counted("replayed")), (times, times));
    assert!(counted("forged") >= times && counted("conflicts") >= times, "{}", heard["counters"]);
    assert_eq!((counted("lost"), counted("late")), (0, 0), "numbers that are forged make none late");

    let decode = |more: &[&str]| json(&rotor_edge(&[&["decode", &log, "--json"], more].concat()));
    let believed = decode(&["--node", &node, "--key", &key_words]);
    assert_eq!(believed["nodes"][0]["results"].as_array().unwrap().len(), usize::from(READINGS));
    assert!(believed["refused"]["forged"].as_u64().unwrap() >= times);
    assert_eq!(decode(&[])["nodes"][0]["results"].as_array().unwrap().len(), usize::from(2 * READINGS));

    // without its power for a moment, it does not fall for what was recorded before
    child.kill().unwrap();
    child.wait().unwrap();
    let mut child = monitor(&bus, &mut *host, folder.path());
    for sealed in &recorded {
        send(&mut *forger, sealed);
        assert_eq!(answer(&mut *host, Duration::from_millis(50)), None);
    }
    let begun = Instant::now();
    let mut is_answered = false;
    while !is_answered && begun.elapsed() < PATIENCE {
        let mut sealed = frames(READINGS, &readings()[0]);
        sealed.extend(sealer.seal(&sealed));
        send(&mut *host, &sealed);
        is_answered = answer(&mut *host, Duration::from_millis(200)).is_some();
    }
    assert!(is_answered, "the sender is heard again after the reserve");
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_replay_to_a_sealed_monitor_takes_no_answer_that_is_made_up() {
    let bench = Bench::new();
    let [rotor, record, key, state] =
        ["identified.toml", "record.csv", "right.key", "sealed.state"].map(|name| bench.text(name));
    let words = ["--rotor", &rotor, "--sealed", "--key", &key, "--state", &state];
    let _monitor = bench.node("slcan", &words);
    let mut forger = open(bench.bus.spec("slcan")).unwrap();
    let is_over = AtomicBool::new(false);
    let played = thread::scope(|scope| {
        scope.spawn(|| {
            let mut results = ResultAssembler::new();
            while !is_over.load(Ordering::Relaxed) {
                let Some(frame) = forger.receive(Duration::from_millis(5)).unwrap() else { continue };
                let answer = results.receive(&frame).filter(|answer| answer.sequence % 10 == 9);
                if let Some(answer) = answer {
                    // before the monitor has had the next reading
                    let flags = FLAG_FLAGGED;
                    let next = MonitorResult { sequence: answer.sequence + 1, flags, ratio: 9.0, ..answer };
                    send(&mut *forger, &result_frames(1, &next));
                }
            }
        });
        let to_it = ["--identified", "--rotor", &rotor, "--record", &record, "--external", "--key", &key];
        let bus = ["replay", "--json", "--answers", "--bus", bench.bus.spec("slcan")];
        let played = rotor_edge(&[&bus[..], &to_it].concat());
        is_over.store(true, Ordering::Relaxed);
        played
    });
    let told = json(&played);
    let ratios: Vec<f64> =
        told["answers"].as_array().unwrap().iter().map(|a| a["ratio"].as_f64().unwrap()).collect();
    assert!(ratios.len() > 300, "{}", ratios.len());
    assert!(ratios.iter().all(|ratio| *ratio < 1.0), "{ratios:?}");
    assert_says(&String::from_utf8_lossy(&played.stderr), &["frames of monitor 1 refused: "]);
}

#[test]
fn a_seal_needs_a_key_and_a_key_its_monitor() {
    let run = |words: &[&str]| rotor_edge(words).status.code();
    assert_eq!(run(&["node", "--bus", "slcan:127.0.0.1:1", "--sealed"]), Some(2));
    assert_eq!(run(&["watch", "--bus", "slcan:127.0.0.1:1", "--key", "x.key", "--json"]), Some(2));
    assert_eq!(run(&["decode", "x.log", "--key", "x.key"]), Some(2));
    let message = refusal(&["decode", "x.log", "--key", "no-such.key", "--node", "4"]);
    assert_says(&message, &["no-such.key", "cannot be read"]);
}

//! `node --sealed`, `replay --external` and `watch --key` beside a forger: real programs in real time. A monitor that loses its
//! power, and more forgeries, are in `simulated/forger.rs`.

use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::bench::Bench;
use crate::program::{assert_says, json, refusal, rotor_edge};
use crate::shared::{PATIENCE, signal};
use nix::sys::signal::Signal;
use rotor_edge::bus::{CanBus, open};
use rotor_edge_core::can::{FLAG_FLAGGED, Frame, Message, MonitorResult, ResultAssembler, result_frames};
use serde_json::Value;

fn send(host: &mut dyn CanBus, frames: &[Frame]) {
    frames.iter().for_each(|frame| host.send(frame).unwrap());
}

#[test]
fn replay_and_watch_with_a_key_take_no_forged_answer() {
    let bench = Bench::new();
    let [rotor, record, key, state] =
        ["identified.toml", "record.csv", "right.key", "sealed.state"].map(|name| bench.text(name));
    let words = ["--rotor", &rotor, "--sealed", "--key", &key, "--state", &state];
    let _monitor = bench.node("slcan", &words);
    let mut forger = open(bench.bus.spec("slcan")).unwrap();
    let log = bench.text("heard.log");
    let watch = crate::program::program()
        .args(["watch", "--bus", bench.bus.spec("socketcand"), "--json", "--node", "1", "--key", &key])
        .args(["--record", &log])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let is_question = |frame: Frame| Message::decode(&frame).is_ok_and(|(_, m)| m == Message::VersionQuery);
    while !forger.receive(PATIENCE).unwrap().is_some_and(is_question) {}
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

    signal(watch.id(), Signal::SIGTERM);
    let heard = json(&watch.wait_with_output().unwrap())["monitors"][0].clone();
    let history = heard["history"].as_array().unwrap();
    assert!(history.iter().all(|result| result["ratio"].as_f64().unwrap() < 1.0), "{history:?}");
    assert_says(heard["says"].as_str().unwrap(), &["refused: "]);
    assert!(heard["refused"]["unsealed"].as_u64().unwrap() > 0, "{}", heard["refused"]);
    let decode = |more: &[&str]| json(&rotor_edge(&[&["decode", &log, "--json"], more].concat()));
    let believed = decode(&["--node", "1", "--key", &key]);
    assert!(believed["refused"]["unsealed"].as_u64().unwrap() > 0);
    let results = |decoded: &Value| decoded["nodes"][0]["results"].as_array().unwrap().len();
    assert!(results(&believed) < results(&decode(&[])));
}

#[test]
fn authentication_needs_a_key_and_a_key_its_monitor() {
    let run = |words: &[&str]| rotor_edge(words).status.code();
    assert_eq!(run(&["node", "--bus", "slcan:127.0.0.1:1", "--sealed"]), Some(2));
    assert_eq!(run(&["watch", "--bus", "slcan:127.0.0.1:1", "--key", "x.key", "--json"]), Some(2));
    assert_eq!(run(&["decode", "x.log", "--key", "x.key"]), Some(2));
    let message = refusal(&["decode", "x.log", "--key", "no-such.key", "--node", "4"]);
    assert_says(&message, &["no-such.key", "cannot be read"]);
}

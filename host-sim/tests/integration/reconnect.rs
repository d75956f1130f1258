//! A bus whose server goes away and comes back on the same ports, under a real monitor and a real watcher. More outages are in
//! `simulated/outage.rs`.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStderr, Stdio};

use crate::bench::Bench;
use crate::program::{assert_says, json, one_sentence, rotor_edge};
use crate::shared::signal;
use nix::sys::signal::Signal;
use rotor_edge::deploy::await_heartbeat;
use serde_json::Value;

/// A command on the bus with its words, killed when the test is over.
struct Running {
    program: Child,
    words: BufReader<ChildStderr>,
}

impl Running {
    fn start(arguments: &[&str]) -> Self {
        let mut program = crate::program::program()
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let words = BufReader::new(program.stderr.take().unwrap());
        Self { program, words }
    }

    fn says(&mut self) -> String {
        let mut line = String::new();
        self.words.read_line(&mut line).unwrap();
        line
    }

    /// Interrupts it; what it printed, and what it said since it was last asked.
    fn end(mut self) -> (String, String) {
        signal(self.program.id(), Signal::SIGINT);
        let (mut printed, mut said) = (String::new(), String::new());
        self.program.stdout.take().unwrap().read_to_string(&mut printed).unwrap();
        self.words.read_to_string(&mut said).unwrap();
        assert!(self.program.wait().unwrap().success(), "{said}");
        (printed, said)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // gone already, unless the test failed
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

#[test]
fn monitor_and_watcher_join_the_bus_again_when_it_comes_back() {
    let mut bench = Bench::new();
    let (model, key, state) =
        (bench.text("identified.toml"), bench.text("right.key"), bench.text("monitor.state"));
    let (slcan, socketcand) = (bench.bus.spec("slcan").to_string(), bench.bus.spec("socketcand").to_string());
    let mut node = Running::start(&["node", "--json", "--bus", &slcan, "--key", &key, "--state", &state]);
    let mut watch = Running::start(&["watch", "--json", "--bus", &socketcand]);
    let deploy =
        |bench: &Bench, counter: &str| bench.to_monitor("deploy", &[&model, "--json", "--counter", counter]);
    assert_eq!(json(&deploy(&bench, "5"))["outcome"], "accepted");
    bench.bus.kill();
    for (program, bus) in [(&mut node, &slcan), (&mut watch, &socketcand)] {
        assert_eq!(program.says(), format!("rotor-edge: the bus {bus} is gone; trying again\n"));
    }
    bench.bus.restart();
    for (program, bus) in [(&mut node, &slcan), (&mut watch, &socketcand)] {
        assert_eq!(program.says(), format!("rotor-edge: the bus {bus} is back\n"));
    }
    assert_says(&one_sentence(&deploy(&bench, "4")), &["has accepted command", "--counter"]);
    let again = json(&deploy(&bench, "6"));
    assert_eq!((&again["outcome"], &again["counter"]), (&"accepted".into(), &6.into()));
    // after the second heartbeat, the watcher has heard the first one
    let mut listener = bench.bus.join("slcan");
    for _ in 0..2 {
        await_heartbeat(&mut *listener, 1).unwrap();
    }

    let (counters, said) = node.end();
    assert_eq!(said, "", "the outage is told once");
    let counters: Value = serde_json::from_str(&counters).unwrap();
    assert_eq!(counters["commands"]["accepted"], 2, "before the outage and after it");
    let (heard, _) = watch.end();
    let heard: Value = serde_json::from_str(&heard).unwrap();
    let ago = heard["monitors"][0]["heard_seconds_ago"].as_f64().unwrap();
    assert!(ago < 2.0, "the watcher hears it again: {ago} s ago");
}

#[test]
fn a_bus_that_was_never_there_is_one_sentence_at_once() {
    let mut bench = crate::shared::Shared::start(&[]);
    bench.kill();
    for command in [&["node"][..], &["watch", "--json"]] {
        let said = one_sentence(&rotor_edge(&[command, &["--bus", bench.spec("slcan")]].concat()));
        assert_says(&said, &["nobody listens", "start `rotor-edge bus`"]);
    }
}

//! Monitors on a shared bus as a user runs them: `node`, `deploy`, `key`, and `replay` over each interface.

#[path = "cli/program.rs"]
mod program;
#[path = "cli/shared.rs"]
mod shared;

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use program::{assert_says, json, refusal, rotor_edge};
use rotor_edge::sample;
use serde_json::Value;
use shared::Shared;
use tempfile::TempDir;

struct Bench {
    folder: TempDir,
    bus: Shared,
}

/// A running monitor; killed without warning when dropped, as by a cut in power.
struct Monitor(Child);

impl Drop for Monitor {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Bench {
    fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap(), bus: Shared::start(&[]) };
        for (name, text) in [
            ("rotor.toml", sample::ROTOR),
            ("record.csv", sample::RECORD),
            ("runup.csv", sample::RUNUP_DAY_0),
        ] {
            std::fs::write(bench.path(name), text).unwrap();
        }
        let [rotor, record, runup, identified] =
            ["rotor.toml", "record.csv", "runup.csv", "identified.toml"].map(|name| bench.text(name));
        let found = ["identify", &rotor, &record, "--runup", &runup, "-o", &identified];
        assert!(rotor_edge(&found).status.success());
        assert!(rotor_edge(&["key", "-o", &bench.text("right.key")]).status.success());
        assert!(rotor_edge(&["key", "-o", &bench.text("wrong.key")]).status.success());
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }

    /// Starts `node` and waits until it has joined the bus.
    fn monitor(&self, kind: &str, more: &[&str]) -> Monitor {
        let mut program = Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
            .args(["node", "--bus", self.bus.spec(kind), "--rotor", &self.text("rotor-of-node.toml")])
            .args(more)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(program.stdout.take().unwrap()).read_line(&mut line).unwrap();
        assert_says(&line, &["Monitor", "listens on"]);
        Monitor(program)
    }

    fn guess(&self) {
        // what the monitor starts with: the same machine, its unbalance guessed wrong
        let identified = std::fs::read_to_string(self.path("identified.toml")).unwrap();
        let changed: Vec<String> = identified
            .lines()
            .map(|line| match line.split_once(" = ") {
                Some((key @ "unbalance_g_mm", _)) => format!("{key} = 1.0"),
                _ => line.to_string(),
            })
            .collect();
        std::fs::write(self.path("rotor-of-node.toml"), changed.join("\n")).unwrap();
    }

    fn play(&self, kind: &str, more: &[&str]) -> Value {
        let mut arguments = vec!["replay", "--bus", self.bus.spec(kind), "--json", "--answers"];
        arguments.extend(more);
        json(&rotor_edge(&arguments))
    }
}

#[test]
fn replay_over_slcan_and_socketcand_gives_the_same_numbers_as_in_process_to_the_bit() {
    let bench = Bench::new();
    let here = json(&rotor_edge(&["replay", "--json", "--answers"]));
    assert_eq!(here["answers"].as_array().unwrap().len(), 450);
    for kind in ["slcan", "socketcand"] {
        let there = bench.play(kind, &[]);
        for key in ["answers", "flags", "equivalence", "counters"] {
            assert_eq!(there[key], here[key], "{key} over {kind}");
        }
        assert_eq!(there["frames"]["lost"], 0, "{kind}");
    }
}

#[test]
fn a_model_deployed_to_a_monitor_gives_its_numbers_and_is_still_there_after_a_cut_in_power() {
    let bench = Bench::new();
    bench.guess();
    let (model, key, state) =
        (bench.text("identified.toml"), bench.text("right.key"), bench.text("monitor.state"));
    let node = |bench: &Bench| bench.monitor("slcan", &["--key", &key, "--state", &state]);
    let deploy = |counter: &str| {
        let bus = bench.bus.spec("socketcand");
        vec!["deploy".to_string(), model.clone(), "--bus".into(), bus.into(), "--key".into(), key.clone()]
            .into_iter()
            .chain(["--counter".into(), counter.into()])
            .collect::<Vec<_>>()
    };
    let run = |arguments: &[String]| rotor_edge(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let external = ["--external", "--key", &key];
    let expected = json(&rotor_edge(&["replay", "--json", "--answers"]))["answers"].clone();
    let from_file = |bench: &Bench| {
        let (rotor, record) = (bench.text("identified.toml"), bench.text("record.csv"));
        let identified = ["--identified", "--rotor", &rotor, "--record", &record];
        bench.play("socketcand", &[&identified[..], &external[..]].concat())["answers"].clone()
    };

    let running = node(&bench);
    let done = run(&[deploy("5"), vec!["--json".into()]].concat());
    let told = json(&done);
    assert_eq!((&told["outcome"], &told["counter"]), (&"accepted".into(), &5.into()));
    let first = from_file(&bench);
    assert_eq!(first.as_array().unwrap().len(), expected.as_array().unwrap().len());
    drop(running);

    let _running = node(&bench);
    let replayed = run(&deploy("5"));
    assert_eq!(replayed.status.code(), Some(1));
    assert_says(&String::from_utf8(replayed.stderr).unwrap(), &["has accepted command", "--counter"]);
    assert_eq!(from_file(&bench), first, "the deployed model is still there");
}

#[test]
fn wrong_keys_missing_keys_and_absent_monitors_are_told_apart() {
    let bench = Bench::new();
    bench.guess();
    let (model, right, wrong) =
        (bench.text("identified.toml"), bench.text("right.key"), bench.text("wrong.key"));
    let bus = bench.bus.spec("slcan").to_string();
    let attempt = |key: &str, node: &str| {
        refusal(&["deploy", &model, "--bus", &bus, "--key", key, "--node", node, "--json"])
    };
    let _keyed = bench.monitor("slcan", &["--key", &right]);
    let _keyless = bench.monitor("slcan", &["--node", "2"]);
    assert_says(&attempt(&wrong, "1"), &["another key"]);
    assert_says(&attempt(&right, "2"), &["was given no key"]);
    assert_says(&attempt(&right, "3"), &["monitor 3 does not answer", "rotor-edge watch"]);
    assert_says(&attempt(&right, "31"), &["0 to 30"]);
    assert_says(&attempt(&bench.text("no.key"), "1"), &["no.key", "rotor-edge key"]);
    assert_says(&attempt(&bench.text("record.csv"), "1"), &["record.csv", "64 hexadecimal digits"]);
    assert_says(&refusal(&["key", "-o", &right]), &["right.key", "cannot be written"]);
    let unidentified = bench.text("rotor.toml");
    let refused = refusal(&["deploy", &unidentified, "--bus", &bus, "--key", &right]);
    assert_says(&refused, &["unbalance_g_mm is missing", "identify"]);
}

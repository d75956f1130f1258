//! Monitors on a shared bus, as tests of several commands run them.

#![allow(dead_code, reason = "each test uses a part")]

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, ChildStdout, Command, Output, Stdio};

use rotor_edge::sample;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::{assert_says, json, rotor_edge};
use crate::shared::Shared;

/// Monitors on a bus, with the files that commands to them want.
pub struct Bench {
    folder: TempDir,
    pub bus: Shared,
}

/// A running monitor; killed without warning when dropped, as by a cut in power.
pub struct Monitor {
    program: Child,
    stdout: BufReader<ChildStdout>,
}

impl Drop for Monitor {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Monitor {
    pub fn id(&self) -> u32 {
        self.program.id()
    }

    /// Everything that it says until a line with this in it; then it is killed.
    pub fn said_until(mut self, last: &str) -> String {
        self.await_line(last)
    }

    /// Everything that it says until a line with this in it.
    pub fn await_line(&mut self, last: &str) -> String {
        let mut text = String::new();
        while !text.contains(last) {
            assert!(self.stdout.read_line(&mut text).unwrap() > 0, "{last:?} is missing in: {text}");
        }
        text
    }
}

impl Bench {
    /// With a rotor, its data, the model identified from them, and two keys.
    pub fn new() -> Self {
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

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }

    /// Starts `node` with a model and waits until it has joined the bus.
    pub fn monitor(&self, kind: &str, more: &[&str]) -> Monitor {
        self.node(kind, &[&["--rotor", &self.text("rotor-of-node.toml")], more].concat()).0
    }

    /// Starts `node` and waits until it has joined the bus; what it says then.
    pub fn node(&self, kind: &str, more: &[&str]) -> (Monitor, String) {
        self.node_by(crate::program::program(), kind, more)
    }

    /// The same by a command that ends in running the program.
    pub fn node_by(&self, mut command: Command, kind: &str, more: &[&str]) -> (Monitor, String) {
        let mut program = command
            .args(["node", "--bus", self.bus.spec(kind)])
            .args(more)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut stdout = BufReader::new(program.stdout.take().unwrap());
        stdout.read_line(&mut line).unwrap();
        assert_says(&line, &["Monitor", "listens on"]);
        (Monitor { program, stdout }, line)
    }

    /// A command to monitor 1.
    pub fn to_monitor(&self, name: &str, more: &[&str]) -> Output {
        let (bus, key) = (self.bus.spec("slcan"), self.text("right.key"));
        let arguments = [&[name, "--bus", bus, "--key", &key], more].concat();
        rotor_edge(&arguments)
    }

    /// A model to start with in `rotor-of-node.toml`.
    pub fn guess(&self) {
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

    /// What `replay` answers.
    pub fn play(&self, kind: &str, more: &[&str]) -> Value {
        let mut arguments = vec!["replay", "--bus", self.bus.spec(kind), "--json", "--answers"];
        arguments.extend(more);
        json(&rotor_edge(&arguments))
    }
}

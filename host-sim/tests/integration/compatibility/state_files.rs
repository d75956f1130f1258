//! State files of monitors: model, thresholds, flag, counter and freshness survive an update of the program.

use std::fs::Permissions;
use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Child, ChildStdout, Output, Stdio};

use nix::sys::signal::Signal;
use serde_json::{Value, json as object};

use super::json_keys::collect;
use super::kept;
use super::names::{Names, assert_all_there};
use crate::program::{assert_says, json, one_sentence, rotor_edge};
use crate::shared::{Shared, signal};

/// The key that the files were written with: the bytes 1 to 32.
const KEY: &str = "0102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f20";
/// Above the counter in the files, ms since 1970.
const COUNTER: u64 = 2_000_000_000_000;

/// A monitor with a copy of a state file, on a bus of its own.
struct Restarted {
    folder: tempfile::TempDir,
    bus: Shared,
    program: Child,
    stdout: BufReader<ChildStdout>,
}

impl Restarted {
    fn new(state: &str, more: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let [key, copy] = ["monitor.key", "monitor.state"].map(|name| folder.path().join(name));
        write_secret(&key, KEY);
        std::fs::copy(kept(state), &copy).unwrap();
        let bus = Shared::start(&[]);
        let mut program = crate::program::program()
            .args(["node", "--bus", bus.spec("slcan"), "--key"])
            .arg(key)
            .arg("--state")
            .arg(copy)
            .args(more)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdout = BufReader::new(program.stdout.take().unwrap());
        Self { folder, bus, program, stdout }
    }

    /// A command to the monitor.
    fn told(&self, command: &[&str]) -> Output {
        let key = self.folder.path().join("monitor.key").display().to_string();
        rotor_edge(&[command, &["--bus", self.bus.spec("socketcand"), "--key", &key]].concat())
    }

    /// Ends it; its answer.
    fn end(mut self) -> Value {
        signal(self.program.id(), Signal::SIGTERM);
        let mut text = String::new();
        self.stdout.read_to_string(&mut text).unwrap();
        serde_json::from_str(&text).unwrap()
    }
}

impl Drop for Restarted {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

fn write_secret(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap();
    std::fs::set_permissions(path, Permissions::from_mode(0o600)).unwrap();
}

#[test]
fn old_state_file_is_refused_by_name_and_keeps_the_rest() {
    let monitor = Restarted::new("state/flagged.state", &["--json"]);
    let mut names = Names::new();

    let bus = monitor.bus.spec("socketcand");
    let watch = json(&rotor_edge(&["watch", "--bus", bus, "--seconds", "3", "--json"]));
    collect(&watch, "watch", &mut names);
    let seen = &watch["monitors"][0];
    // its model is of the schema before, and is refused by that name
    assert_eq!((&seen["state"], &seen["reason"]), (&"no_model".into(), &"schema".into()), "{seen}");

    let thresholds = json(&monitor.told(&["thresholds", "--json"]));
    collect(&thresholds, "thresholds", &mut names);
    let expected = object!({
        "age_limit_s": 10.0, "average_s": 0.0, "floor_um": 0.0, "gap_range_v": [-18.0, -2.0], "growth": 1.2,
        "growth_s": 1.25e-6, "learning_readings": 10, "learning_s": 0.0, "level_s": 1.25e-5,
        "persistence_readings": 3, "persistence_s": 0.0, "ratio_floor": 0.1, "ratio_limit": 0.33333334, "rise": 0.8
    });
    for (name, value) in expected.as_object().unwrap() {
        assert_eq!(&thresholds["thresholds"][name], value, "{name}");
    }

    let rotor = kept("../golden/inputs/identified.toml").display().to_string();
    let deploy =
        |counter: u64| monitor.told(&["deploy", &rotor, "--json", "--counter", &counter.to_string()]);
    assert_says(&one_sentence(&deploy(5)), &["has accepted command"]);
    let deployed = json(&deploy(COUNTER));
    assert_eq!(deployed["outcome"], "accepted", "a model of today takes the place of the refused one");
    collect(&deployed, "deploy", &mut names);

    let counter = (COUNTER + 1).to_string();
    let acknowledge = monitor.told(&["acknowledge", "--announce", "--json", "--counter", &counter]);
    collect(&json(&acknowledge), "acknowledge", &mut names);

    collect(&monitor.bus.opened, "bus", &mut names);
    collect(&monitor.end(), "node", &mut names);
    assert_all_there("json-keys-bus.txt", &names);
}

#[test]
fn old_sealed_state_file_is_refused_by_name() {
    let mut monitor = Restarted::new("state/sealed.state", &["--node", "2", "--sealed"]);
    let mut line = String::new();
    monitor.stdout.read_line(&mut line).unwrap();
    assert_says(&line, &["without a model", "another version of the firmware"]);
}

//! A monitor whose disk is full, by a limit on the size of its files: without the trap the signal would end the program.

use std::process::Command;

use serde_json::Value;

use crate::bench::Bench;
use crate::program::{assert_says, json, rotor_edge};
use crate::trial::while_read_to;

const NO_ROOM: &str = "trap '' XFSZ; ulimit -S -f 0; exec \"$0\" \"$@\"";

#[test]
#[cfg(target_os = "linux")]
fn full_disk_is_told_until_what_was_learned_is_stored() {
    let bench = Bench::new();
    let [rotor, state] = ["identified.toml", "monitor.state"].map(|name| bench.text(name));
    let mut shell = Command::new("sh");
    shell.args(["-c", NO_ROOM, env!("CARGO_BIN_EXE_rotor-edge")]);
    let (mut monitor, _) = bench.node_by(shell, "slcan", &["--rotor", &rotor, "--state", &state]);
    while_read_to(&bench, || {
        assert_says(&monitor.await_line("cannot be stored"), &["monitor.state", "File too large"]);
        let watch = ["watch", "--bus", bench.bus.spec("socketcand"), "--seconds", "2", "--json"];
        let seen: Value = json(&rotor_edge(&watch))["monitors"][0].clone();
        assert_eq!((&seen["state"], &seen["reason"]), (&"learning".into(), &"storage".into()), "{seen}");
        assert!(seen["counters"]["unsaved"].as_u64() > Some(0), "{seen}");
        assert!(!bench.path("monitor.state").exists());
        let raise =
            Command::new("prlimit").args(["--pid", &monitor.id().to_string(), "--fsize=unlimited"]).status();
        assert!(raise.unwrap().success());
        monitor.await_line("is stored again");
    });
    let stored = std::fs::read_to_string(bench.path("monitor.state")).unwrap();
    assert!(
        stored.lines().any(|line| line.strip_prefix("memory ").is_some_and(|memory| !memory.is_empty())),
        "{stored}"
    );
}

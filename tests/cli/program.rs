//! The real program as tests of several commands run it: one run, one refusal.

use std::process::{Command, Output};

use serde_json::Value;

pub fn rotor_edge(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rotor-edge")).args(arguments).output().unwrap()
}

/// The one sentence that it fails with.
pub fn refusal(arguments: &[&str]) -> String {
    let output = rotor_edge(arguments);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty(), "nothing half-done on standard output");
    assert_eq!(message.trim_end().lines().count(), 1, "one sentence: {message}");
    message
}

#[track_caller]
pub fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is missing in: {message}");
    }
}

pub fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object on standard output")
}

//! The real program as tests of several commands run it: one run, one refusal.

#![allow(dead_code, reason = "each test uses a part")]

use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// Columns in which every sentence is one line.
const ONE_LINE: &str = "10000";

/// The program, with every sentence on one line.
pub fn program() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_rotor-edge"));
    program.env("COLUMNS", ONE_LINE);
    program
}

pub fn rotor_edge(arguments: &[&str]) -> Output {
    program().args(arguments).stdin(Stdio::null()).output().unwrap()
}

/// The one sentence that it fails with.
#[track_caller]
pub fn refusal(arguments: &[&str]) -> String {
    one_sentence(&rotor_edge(arguments))
}

/// The one sentence of a run that failed.
#[track_caller]
pub fn one_sentence(output: &Output) -> String {
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let shown = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{message}{shown}");
    assert!(shown.is_empty(), "nothing half-done on standard output: {shown}");
    assert_eq!(message.trim_end().lines().count(), 1, "one sentence: {message}");
    message
}

#[track_caller]
pub fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is missing in: {message}");
    }
}

#[track_caller]
pub fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object on standard output")
}

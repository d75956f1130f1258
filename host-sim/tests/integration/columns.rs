//! Text for people fits 80 columns where there is no terminal: answers, errors and help of every command.

use std::fs;
use std::process::{Command, Output, Stdio};

use clap::CommandFactory as _;
use rotor_edge::command::Cli;
use unicode_width::UnicodeWidthStr;

use crate::golden::manifest;

/// Commands whose output is read by programs.
const FOR_PROGRAMS: [&str; 2] = ["completions", "dbc"];

/// Lines wider than 80 columns that hold more than one word.
fn wide_lines(text: &str) -> Vec<&str> {
    let is_wide = |line: &&str| line.width() > 80 && line.trim().contains(' ');
    text.lines().filter(is_wide).collect()
}

#[test]
fn recorded_text_of_every_command_fits_80_columns() {
    let mut checked = 0;
    for command in manifest::read() {
        let path = manifest::folder().join("answers").join(&command.name).join("terminal.txt");
        let Ok(text) = fs::read_to_string(path) else { continue };
        if FOR_PROGRAMS.iter().any(|name| command.run.starts_with(name)) {
            continue;
        }
        assert!(wide_lines(&text).is_empty(), "{}: {:#?}", command.name, wide_lines(&text));
        checked += 1;
    }
    assert!(checked > 60, "{checked}");
}

#[test]
fn help_of_every_command_fits_80_columns() {
    let cli = Cli::command();
    let names = cli.get_subcommands().map(|command| command.get_name());
    let mut wide = Vec::new();
    for words in std::iter::once(vec![]).chain(names.map(|name| vec![name])) {
        for help in ["-h", "--help"] {
            let arguments: Vec<&str> = words.iter().copied().chain([help]).collect();
            let output = at_80_columns(&arguments);
            let text = String::from_utf8(output.stdout).unwrap();
            assert!(text.contains("Usage: rotor-edge"), "{words:?}: {text}");
            wide.extend(wide_lines(&text).into_iter().map(|line| format!("{words:?} {help}: {line}")));
        }
    }
    assert!(wide.is_empty(), "{wide:#?}");
}

#[test]
fn errors_fit_80_columns() {
    let refused = [
        vec!["check", "--no-such-option-of-this-program-and-of-no-other-program", "a.toml"],
        vec!["compare", "host-sim/sample/turbine/record.csv", "host-sim/sample/turbine/rotor.toml"],
        vec!["explain", "a word that this program does not know, with many more words behind it"],
    ];
    for arguments in refused {
        let output = at_80_columns(&arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && !text.is_empty(), "{arguments:?}");
        assert!(wide_lines(&text).is_empty(), "{arguments:?}: {text}");
    }
}

#[test]
fn stated_columns_are_kept() {
    let width = |columns: &str| {
        let text = stdout_at(&["explain", "residual"], columns);
        text.lines().map(UnicodeWidthStr::width).max().unwrap()
    };
    assert!(width("40") <= 40, "{}", width("40"));
    assert!((81..=200).contains(&width("200")), "{}", width("200"));
}

fn at_80_columns(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
        .args(arguments)
        .current_dir(manifest::repository())
        .env_remove("COLUMNS")
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

fn stdout_at(arguments: &[&str], columns: &str) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_rotor-edge"));
    let output = program.args(arguments).env("COLUMNS", columns).output().unwrap();
    String::from_utf8(output.stdout).unwrap()
}

//! A word that is no command of the program is a program of that name, as with git and cargo.

#![cfg(unix)]

use std::os::unix::fs::PermissionsExt as _;
use std::process::Output;

use crate::program::rotor_edge;

#[test]
fn extension_on_path_gets_arguments_and_returns_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let says = "echo \"said: $*\"\nexit 7\n";
    script(&folder, "rotor-edge-hello", says);
    script(&folder, "rotor-edge-check", says);
    let output = run(&folder, &["hello", "a", "--b c"]);
    assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(7), b"said: a --b c\n".as_slice()));
    for ours in ["check", "help"] {
        let output = run(&folder, &[ours, "--help"]);
        assert!(!String::from_utf8_lossy(&output.stdout).contains("said"), "{ours} is a command of its own");
    }
}

#[test]
fn a_program_that_has_help_on_a_word_is_run_with_that_word() {
    let folder = tempfile::tempdir().unwrap();
    script(&folder, "rotor-edge-a", "[ \"$1\" = help ] && exit 2\necho wrong\n");
    script(
        &folder,
        "rotor-edge-hall",
        "[ \"$1\" = help ] && { [ \"$2\" = gate ]; exit; }\necho \"said: $*\"\n",
    );
    script(&folder, "rotor-edge-b.d", "echo wrong\n");
    let output = run(&folder, &["gate", "a", "--b c"]);
    assert_eq!(
        (output.status.code(), output.stdout.as_slice()),
        (Some(0), b"said: gate a --b c\n".as_slice())
    );
    assert_eq!(run(&folder, &["gates"]).status.code(), Some(2), "nobody has help on it");
}

fn script(folder: &tempfile::TempDir, name: &str, text: &str) {
    let path = folder.path().join(name);
    std::fs::write(&path, format!("#!/bin/sh\n{text}")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
}

/// The program, with a folder at the head of the path.
fn run(folder: &tempfile::TempDir, words: &[&str]) -> Output {
    let path = std::env::var_os("PATH").unwrap();
    let all = [folder.path().to_path_buf()].into_iter().chain(std::env::split_paths(&path));
    crate::program::program().args(words).env("PATH", std::env::join_paths(all).unwrap()).output().unwrap()
}

#[test]
fn a_word_that_is_nothing_is_refused_as_ever() {
    for word in ["hallo", "../hallo"] {
        let output = rotor_edge(&[word]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("unrecognized subcommand"));
    }
}

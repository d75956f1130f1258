//! A word that is no command of the program is a program of that name, as with git and cargo.

#![cfg(unix)]

#[path = "cli/program.rs"]
mod program;

use std::os::unix::fs::PermissionsExt as _;
use std::process::Command;

use program::rotor_edge;

#[test]
fn a_program_on_the_path_is_run_with_the_rest_of_the_words_and_its_exit_code_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let script = |name: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, "#!/bin/sh\necho \"said: $*\"\nexit 7\n").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    };
    script("rotor-edge-hello");
    script("rotor-edge-check");
    let run = |words: &[&str]| {
        let path = std::env::join_paths(
            [folder.path().to_path_buf()]
                .into_iter()
                .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
        );
        Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
            .args(words)
            .env("PATH", path.unwrap())
            .output()
            .unwrap()
    };
    let output = run(&["hello", "a", "--b c"]);
    assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(7), b"said: a --b c\n".as_slice()));
    for ours in ["check", "help"] {
        let output = run(&[ours, "--help"]);
        assert!(!String::from_utf8_lossy(&output.stdout).contains("said"), "{ours} is a command of its own");
    }
}

#[test]
fn a_word_that_is_nothing_is_refused_as_ever() {
    for word in ["hallo", "../hallo"] {
        let output = rotor_edge(&[word]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("unrecognized subcommand"));
    }
}

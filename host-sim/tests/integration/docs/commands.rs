//! Every command line of a page is one that the program takes, and the session on a bus runs as printed.

use std::fs::{self, File};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};

use clap::Parser;
use rotor_edge::command::Cli;

use super::{blocks, pages, repository};
use crate::program::rotor_edge;

/// Command lines of the program in a block: continued lines joined, comments and what the shell does with them left out.
fn commands(block: &str) -> Vec<Vec<String>> {
    let joined = block.replace("\\\n", " ");
    let of_line = |line: &str| {
        let line = line
            .split(" #")
            .next()?
            .split(" & ")
            .next()?
            .trim()
            .trim_end_matches('&')
            .replace("cargo run --release --", "rotor-edge");
        let words: Vec<String> =
            line.split_whitespace().map(|word| word.trim_matches(['"', '\'']).to_string()).collect();
        (words.first()? == "rotor-edge" && words.len() > 1).then_some(words)
    };
    joined.lines().filter_map(of_line).collect()
}

#[test]
fn every_command_line_of_a_page_is_one_that_the_program_takes() {
    let mut checked = 0;
    for path in pages() {
        let page = fs::read_to_string(&path).unwrap();
        for words in blocks(&page).iter().flat_map(|(_, block)| commands(block)) {
            if let Err(error) = Cli::try_parse_from(&words) {
                panic!("{}: {}: {error}", path.display(), words.join(" "));
            }
            checked += 1;
        }
    }
    assert!(checked > 25, "{checked}");
    let wrong = ["rotor-edge", "compare", "rotor.toml", "measured.csv", "--no-such-option"];
    assert!(Cli::try_parse_from(wrong).is_err(), "the check can fail");
}

#[test]
fn the_session_on_a_bus_runs_as_printed() {
    let page = fs::read_to_string(repository().join("README.md")).unwrap();
    let (_, script) =
        blocks(&page).into_iter().find(|(language, _)| language == "sh").expect("a script in README.md");
    let folder = tempfile::tempdir().unwrap();
    let ports = [0; 2].map(|any| TcpListener::bind(("127.0.0.1", any)).unwrap());
    let [slcan, socketcand] = ports.each_ref().map(|port| port.local_addr().unwrap().port().to_string());
    drop(ports);
    let script = script
        .replace("S=host-sim", &format!("S={}/host-sim", repository().display()))
        .replace("rotor-edge bus ", &format!("rotor-edge bus --slcan {slcan} --socketcand {socketcand} "))
        .replace("29537", &slcan)
        .replace("29536", &socketcand);
    fs::write(folder.path().join("session.sh"), &script).unwrap();
    let programs = Path::new(env!("CARGO_BIN_EXE_rotor-edge")).parent().unwrap();
    let path = std::env::join_paths(
        std::iter::once(programs.to_path_buf())
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    )
    .unwrap();
    // into a file: a pipe would stay open as long as what runs in the background
    let said = File::create(folder.path().join("said.txt")).unwrap();
    let status = Command::new("sh")
        .args(["-e", "session.sh"])
        .current_dir(folder.path())
        .env("PATH", path)
        .stdin(Stdio::null())
        .stderr(said.try_clone().unwrap())
        .stdout(said)
        .status()
        .unwrap();
    let said = fs::read_to_string(folder.path().join("said.txt")).unwrap();
    assert!(status.success(), "{said}");
    let readings = fs::read_to_string(folder.path().join("measured.csv")).unwrap();
    let rows = readings.lines().filter(|line| !line.starts_with('#')).count() - 1;
    assert_eq!(rows, 451, "every reading was on the bus: {said}");
    assert!(said.contains("FLAGGED"), "{said}");
    for file in ["identified.toml", "monitor1.state", "monitor1.dbc"] {
        assert!(folder.path().join(file).is_file(), "{file}: {said}");
    }
}

#[test]
fn every_command_has_its_row_on_the_page_of_commands() {
    let page = fs::read_to_string(repository().join("docs/commands.md")).unwrap();
    let help = String::from_utf8(rotor_edge(&["--help"]).stdout).unwrap();
    let listed = help.split("Commands:").nth(1).unwrap().split("\n\n").next().unwrap();
    for line in listed.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   ")) {
        let name = line.split_whitespace().next().unwrap();
        assert!(
            name == "help"
                || page.contains(&format!("`{name}"))
                || page.contains(&format!("rotor-edge {name}")),
            "{name}"
        );
    }
}

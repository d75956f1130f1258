//! What the pages say: every command line is one that the program takes, the session on a bus runs as printed, and every link leads
//! somewhere.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::program::rotor_edge;
use clap::Parser;
use pulldown_cmark::{CodeBlockKind, Event, Parser as Markdown, Tag, TagEnd};
use rotor_edge::command::Cli;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// Every page that is for people.
fn pages() -> Vec<PathBuf> {
    let is_page = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "md");
    let folders = [
        "",
        "docs",
        "boards",
        "boards/nucleo-g474re",
        "boards/emulated-g474",
        "python",
        "tests/kits",
        "tests/machines",
    ];
    let of_folder = |folder: &&str| {
        let entries = fs::read_dir(repository().join(folder)).unwrap();
        entries.map(|entry| entry.unwrap().path()).filter(is_page).collect::<Vec<_>>()
    };
    folders.iter().flat_map(of_folder).collect()
}

/// Blocks of code with their language.
fn blocks(page: &str) -> Vec<(String, String)> {
    let mut all = Vec::new();
    let mut within: Option<(String, String)> = None;
    for event in Markdown::new(page) {
        match event {
            Event::Start(Tag::CodeBlock(kind)) => {
                let language = if let CodeBlockKind::Fenced(language) = kind {
                    language.to_string()
                } else {
                    String::new()
                };
                within = Some((language, String::new()));
            }
            Event::Text(text) => {
                if let Some((_, block)) = &mut within {
                    block.push_str(&text);
                }
            }
            Event::End(TagEnd::CodeBlock) => all.extend(within.take()),
            _ => {}
        }
    }
    all
}

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
fn complete_small_file_of_the_docs_is_checked() {
    let page = fs::read_to_string(repository().join("docs/rotor-file.md")).unwrap();
    let all = blocks(&page);
    let (_, small) = all.iter().find(|(language, _)| language == "toml,complete").unwrap();
    assert!(small.lines().count() <= 14, "{small}");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("fan.toml"), small).unwrap();
    let program = Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
        .args(["check", "fan.toml", "--report", "check.html"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&program.stdout);
    assert!(program.status.success(), "{}", String::from_utf8_lossy(&program.stderr));
    assert!(said.starts_with("Stable from"), "the answer comes first: {said}");
    let page = fs::read_to_string(folder.path().join("check.html")).unwrap();
    assert!(page.contains("class=\"verdict\"") && page.contains("running range"), "no first screen");
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

/// As GitHub and mdBook name a heading.
fn anchor(heading: &str) -> String {
    let kept = heading
        .to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
        .collect::<String>();
    kept.replace(' ', "-")
}

fn anchors(page: &str) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    let mut heading: Option<String> = None;
    for event in Markdown::new(page) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::Text(text) | Event::Code(text) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&text);
                }
            }
            Event::End(TagEnd::Heading(_)) => all.extend(heading.take().map(|heading| anchor(&heading))),
            _ => {}
        }
    }
    all
}

#[test]
fn every_relative_link_leads_to_existing_file_and_heading() {
    let mut checked = 0;
    for path in pages() {
        let page = fs::read_to_string(&path).unwrap();
        for event in Markdown::new(&page) {
            let (Event::Start(Tag::Link { dest_url, .. }) | Event::Start(Tag::Image { dest_url, .. })) =
                event
            else {
                continue;
            };
            if dest_url.contains("://") {
                continue;
            }
            let (file, heading) = dest_url.split_once('#').map_or((&*dest_url, None), |(f, h)| (f, Some(h)));
            let target = if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(target.exists(), "{}: {dest_url} is not there", path.display());
            if let Some(heading) = heading {
                let there = anchors(&fs::read_to_string(&target).unwrap());
                assert!(
                    there.contains(heading),
                    "{}: {dest_url}: no such heading among {there:?}",
                    path.display()
                );
            }
            checked += 1;
        }
    }
    assert!(checked > 40, "{checked}");
}

#[test]
fn the_book_lists_every_page_and_the_readme_is_short() {
    let summary = fs::read_to_string(repository().join("docs/SUMMARY.md")).unwrap();
    for entry in fs::read_dir(repository().join("docs")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let is_chapter = name.ends_with(".md") && name != "SUMMARY.md";
        assert!(!is_chapter || summary.contains(&format!("({name})")), "{name} is not in docs/SUMMARY.md");
    }
    let lines = fs::read_to_string(repository().join("README.md")).unwrap().lines().count();
    assert!(lines < 200, "{lines}");
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

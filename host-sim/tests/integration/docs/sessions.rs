//! The command lines of the pages, executed as printed: page by page, in the order of the page, in a folder of its own.
//!
//! A block of a page may state what it is behind its language: `file=NAME` is written to the folder first, and `said` is output
//! of the commands above it.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};

use super::{blocks, repository};
use crate::docs::recording;

/// Pages whose command lines need a bus, a server or another program, and the test that runs those.
const ELSEWHERE: [(&str, &str); 4] = [
    ("docs/plant.md", "plant/tests/integration"),
    ("docs/plant-at-scale.md", "plant/tests/integration"),
    ("docs/studio.md", "studio/tests/integration/page_of_book.rs"),
    ("docs/boards.md", "boards/test"),
];

/// A line that is executed here: an assignment or a run of the program. Other lines build or start something else.
fn executed(line: &str) -> Option<String> {
    let line = line.split(" #").next()?.trim();
    let program = match line.strip_prefix("cargo run --release") {
        Some("") => "rotor-edge".to_string(),
        Some(arguments) => format!("rotor-edge {}", arguments.strip_prefix(" -- ")?),
        None => line.to_string(),
    };
    let is_assignment = line.split_once('=').is_some_and(|(name, _)| name.len() == 1);
    (is_assignment || program == "rotor-edge" || program.starts_with("rotor-edge ")).then_some(program)
}

fn lines(block: &str) -> Vec<String> {
    block.replace("\\\n", " ").lines().filter_map(executed).collect()
}

/// Whether a block of README stands on a page of the book as well, and runs there.
fn runs_in_book(page: &str, block: &str) -> bool {
    let stands_on = |other: &&str| {
        let text = fs::read_to_string(repository().join(other)).unwrap();
        blocks(&text).iter().any(|(_, there)| lines(there) == lines(block))
    };
    page == "README.md" && here().filter(|other| **other != page).any(stands_on)
}

/// Whether a printed word is that of the program; a number may differ by a unit of its last digit, as between processors.
fn is_same(printed: &str, said: &str) -> bool {
    let is_part = |c: char| c.is_ascii_digit() || c == '.' || c == ',';
    let number = |word: &str| word.trim_matches(|c| !is_part(c)).replace(',', "");
    let (a, b) = (number(printed), number(said));
    let decimals = |text: &str| text.split_once('.').map_or(0, |(_, after)| after.len());
    let words = |word: &str| word.replace(is_part, "");
    printed == said
        || match (a.parse::<f64>(), b.parse::<f64>()) {
            (Ok(x), Ok(y)) => {
                let unit = 10_f64.powi(-(decimals(&a) as i32));
                words(printed) == words(said) && decimals(&a) == decimals(&b) && (x - y).abs() < 1.01 * unit
            }
            _ => false,
        }
}

/// What a page prints of an output: its parts between lines of `…` must be there, in this order.
#[track_caller]
fn assert_said(page: &str, excerpt: &str, said: &str) {
    let words: Vec<&str> = said.split_whitespace().collect();
    let mut from = 0;
    for part in excerpt.split('…').filter(|part| !part.trim().is_empty()) {
        let part: Vec<&str> = part.split_whitespace().collect();
        let is_here = |at: &usize| part.iter().zip(&words[*at..]).all(|(a, b)| is_same(a, b));
        let at = (from..(words.len() + 1).saturating_sub(part.len())).find(is_here);
        let Some(at) = at else { panic!("{page} prints \"{}\", the program says {said}", part.join(" ")) };
        from = at + part.len();
    }
}

#[test]
fn printed_numbers_may_differ_by_a_unit_of_their_last_digit() {
    assert!(is_same("30.8", "30.7") && is_same("(1,805", "(1,806") && is_same("k_xx", "k_xx"));
    assert!(
        !is_same("30.8", "30.6") && !is_same("30.8", "31") && !is_same("30.8%", "30.8") && !is_same("a", "b")
    );
}

/// Runs the blocks of a page; returns the number of command lines.
#[track_caller]
fn run(page: &str) -> usize {
    let text = fs::read_to_string(repository().join(page)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for shared in ["host-sim", "tests"] {
        symlink(repository().join(shared), folder.path().join(shared)).unwrap();
    }
    recording::write(&folder.path().join("runup.wav"));
    let programs = Path::new(env!("CARGO_BIN_EXE_rotor-edge")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let (mut assignments, mut said, mut count) = (String::new(), String::new(), 0);
    for (language, block) in blocks(&text) {
        if let Some(name) = language.split("file=").nth(1) {
            fs::write(folder.path().join(name), &block).unwrap();
        } else if language.ends_with("said") {
            assert_said(page, &block, &said);
        } else if language != "sh" && !lines(&block).is_empty() && !runs_in_book(page, &block) {
            let script = assignments.clone() + &lines(&block).join("\n");
            let output = Command::new("sh")
                .args(["-e", "-c", &script])
                .current_dir(folder.path())
                .env("PATH", &path)
                .env_remove("COLUMNS")
                .stdin(Stdio::null())
                .output()
                .unwrap();
            said = String::from_utf8_lossy(&output.stdout).into_owned();
            let error = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{page}: {script}\n{error}");
            let is_assignment = |line: &&String| !line.starts_with("rotor-edge");
            let here = lines(&block);
            count += here.iter().filter(|line| !is_assignment(line)).count();
            here.iter().filter(is_assignment).for_each(|line| assignments += &format!("{line}\n"));
        }
    }
    count
}

macro_rules! sessions {
    ($($name:ident, $page:literal, $lines:literal;)*) => {
        $(#[test]
        fn $name() {
            assert_eq!(run($page), $lines, "command lines of {}", $page);
        })*
        pub const PAGES: &[&str] = &[$($page),*];
    };
}

mod quick {
    use super::run;

    sessions! {
        readme_session_runs_as_printed, "README.md", 1;
        ten_minutes_session_runs_as_printed, "docs/ten-minutes.md", 6;
        diagnosis_session_runs_as_printed, "docs/diagnosis.md", 4;
        real_rig_session_runs_as_printed, "docs/real-rig.md", 1;
        simulate_session_runs_as_printed, "docs/simulate.md", 4;
        import_session_runs_as_printed, "docs/import.md", 1;
        extraction_session_runs_as_printed, "docs/extraction.md", 1;
    }
}

mod slow {
    use super::run;

    sessions! {
        tracking_session_runs_as_printed, "docs/tracking.md", 2;
        balancing_session_runs_as_printed, "docs/balancing.md", 2;
        plan_session_runs_as_printed, "docs/plan.md", 3;
    }
}

/// Pages whose sessions run here.
fn here() -> impl Iterator<Item = &'static &'static str> {
    quick::PAGES.iter().chain(slow::PAGES)
}

#[test]
fn pages_with_commands_have_a_session_that_runs() {
    for entry in fs::read_dir(repository().join("docs")).unwrap() {
        let page = format!("docs/{}", entry.unwrap().file_name().into_string().unwrap());
        let is_run = here().any(|run| *run == page) || ELSEWHERE.iter().any(|(other, _)| *other == page);
        if !page.ends_with(".md") || is_run {
            continue;
        }
        let text = fs::read_to_string(repository().join(&page)).unwrap();
        let commands: Vec<String> = blocks(&text).iter().flat_map(|(_, block)| lines(block)).collect();
        assert!(commands.is_empty(), "{page} has commands and no session here: {commands:?}");
    }
}

//! Runs a command line in a folder of its own and collects what it answers.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::cut::{cut, cut_table, digest};
use super::manifest::{GoldenCommand, Output, arguments, repository};
use super::mask::{mask, mask_written};
use super::page::visible_text;
use super::token::without_numbers;
use super::tolerance::Class;
use super::value::Node;

/// An answer or a part of it.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    Text(String),
    Json(Node),
}

/// Longest text that is recorded whole, in lines and in bytes, and what stays of longer ones, in lines.
const LONGEST: usize = 700;
const LARGEST: usize = 40_000;
const FIRST: usize = 60;
const LAST: usize = 20;
const PAGE: &str = "page.html";

/// What one run prints.
struct Run {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

/// All that is recorded of a command, by file name.
pub fn answer(command: &GoldenCommand) -> BTreeMap<String, Content> {
    let mut all = BTreeMap::new();
    if command.has(Output::Text) || command.has(Output::Page) || !command.writes.is_empty() {
        let folder = prepare(command);
        let page = command.has(Output::Page).then_some(["--report", PAGE]);
        let run = run(
            folder.path(),
            &[arguments(&command.run), page.iter().flatten().map(|s| s.to_string()).collect()].concat(),
        );
        if command.has(Output::Text) {
            let code = run.code.map_or("none".to_string(), |code| code.to_string());
            let text = format!(
                "exit code {code}\n--- standard output\n{}--- standard error\n{}",
                run.stdout, run.stderr
            );
            all.insert("terminal.txt".to_string(), Content::Text(shortened(&text)));
        }
        if command.has(Output::Page) {
            let html = written(folder.path(), PAGE);
            all.insert("page.txt".to_string(), Content::Text(page_text(command, &html)));
        }
        for file in &command.writes {
            all.insert(recorded_name(file), file_content(command, file, &written(folder.path(), file)));
        }
    }
    if command.has(Output::Json) {
        let folder = prepare(command);
        let run = run(folder.path(), &[arguments(&command.run), vec!["--json".into()]].concat());
        let answer: Value =
            serde_json::from_str(&run.stdout).unwrap_or_else(|_| json!({"no JSON": run.stdout}));
        let whole = json!({"exit_code": run.code, "standard_error": run.stderr, "answer": answer});
        all.insert("answer.json".to_string(), Content::Json(cut(&whole, command.class, &command.rounding)));
    }
    all
}

/// A folder with the input files at their places in the repository.
fn prepare(command: &GoldenCommand) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let lines = command.before.iter().chain([&command.run]);
    let inputs: Vec<PathBuf> = lines
        .flat_map(|line| arguments(line))
        .chain(command.edits.iter().map(|edit| edit.file.clone()))
        .map(PathBuf::from)
        .filter(|path| path.is_relative() && repository().join(path).is_file())
        .collect();
    for input in inputs {
        let copy = folder.path().join(&input);
        std::fs::create_dir_all(copy.parent().unwrap()).unwrap();
        std::fs::copy(repository().join(&input), copy).unwrap();
    }
    for edit in &command.edits {
        let path = folder.path().join(&edit.file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(&edit.from), "{}: {} is not in {}", command.name, edit.from, edit.file);
        std::fs::write(path, text.replacen(&edit.from, &edit.to, 1)).unwrap();
    }
    for line in &command.before {
        let before = run(folder.path(), &arguments(line));
        assert_eq!(before.code, Some(0), "{}: {line}: {}", command.name, before.stderr);
    }
    folder
}

fn run(folder: &Path, arguments: &[String]) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
        .args(arguments)
        .current_dir(folder)
        .env("TZ", "UTC")
        .env_remove("COLUMNS")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = |bytes: &[u8]| mask(&String::from_utf8_lossy(bytes), folder);
    Run { code: output.status.code(), stdout: text(&output.stdout), stderr: text(&output.stderr) }
}

fn written(folder: &Path, file: &str) -> String {
    match std::fs::read(folder.join(file)) {
        Ok(bytes) => mask(&String::from_utf8_lossy(&bytes), folder),
        Err(_) => "not written\n".to_string(),
    }
}

/// Text of a page; files that a search wrote are listed without size and digest.
fn page_text(command: &GoldenCommand, html: &str) -> String {
    let text = visible_text(html);
    match command.class {
        Class::Direct => text,
        Class::Fitted | Class::Sampled => mask_written(&text, |file| repository().join(file).is_file()),
    }
}

/// Tables are recorded as JSON.
fn recorded_name(file: &str) -> String {
    let flat = file.replace('/', "-");
    if flat.ends_with(".csv") { format!("{flat}.json") } else { flat }
}

fn file_content(command: &GoldenCommand, file: &str, text: &str) -> Content {
    match file.ends_with(".csv") && text != "not written\n" {
        true => Content::Json(cut_table(text, command.class)),
        false => Content::Text(shortened(text)),
    }
}

/// A long text without its middle, of which a digest stays.
fn shortened(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    if lines.len() <= LONGEST && text.len() <= LARGEST || lines.len() <= FIRST + LAST {
        return text.to_string();
    }
    let middle = &lines[FIRST..lines.len() - LAST];
    let words = digest(&without_numbers(&middle.join("\n")));
    let note = format!("… {} lines left out, digest of their words x{words:016x} …", middle.len());
    let kept = [&lines[..FIRST], &[note.as_str()], &lines[lines.len() - LAST..]].concat();
    kept.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_keeps_its_ends_and_a_digest() {
        let text = |word: &str| {
            (0..1000).map(|k| format!("{word} {}\n", if k == 500 { word } else { "x" })).collect::<String>()
        };
        let short = shortened(&text("a"));
        assert_eq!(short.lines().count(), FIRST + LAST + 1);
        assert_ne!(short, shortened(&text("a").replace("a a", "a b")));
    }
}

//! Checks or records the answers of a group of command lines.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use serde_json::Value;

use super::answer::{Content, answer};
use super::difference::Difference;
use super::manifest::{GoldenCommand, Group, folder, read};
use super::{compare_json, compare_text};

/// `accept` records the present answers where they differ.
const MODE: &str = "ROTOR_EDGE_GOLDEN";
/// Names of the only commands to run, separated by spaces.
const ONLY: &str = "ROTOR_EDGE_GOLDEN_ONLY";
/// Command lines at a time.
const THREADS: usize = 2;
/// Differences of one output that a diff shows.
const SHOWN: usize = 25;

/// Runs the commands of a group; panics with a diff where an answer is not the recorded one.
pub fn check(group: Group) {
    let only = env::var(ONLY).unwrap_or_default();
    let only: Vec<&str> = only.split_whitespace().collect();
    let all = read();
    for name in &only {
        assert!(all.iter().any(|command| command.name == *name), "commands.toml has no command {name}");
    }
    let is_chosen = |command: &GoldenCommand| {
        command.group() == group && (only.is_empty() || only.contains(&command.name.as_str()))
    };
    let commands: Vec<GoldenCommand> = all.into_iter().filter(is_chosen).collect();
    let is_accepting = env::var(MODE).is_ok_and(|mode| mode == "accept");
    let (next, diffs) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    thread::scope(|scope| {
        for _ in 0..THREADS.min(commands.len()) {
            scope.spawn(|| {
                while let Some(command) = commands.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if let Some(diff) = examine(command, is_accepting) {
                        diffs.lock().unwrap().insert(command.name.clone(), diff);
                    }
                }
            });
        }
    });
    let diffs = diffs.into_inner().unwrap();
    if is_accepting {
        println!("{} of {} answers recorded anew: {:?}", diffs.len(), commands.len(), diffs.keys());
        return;
    }
    println!("{} command lines checked, {} with differences", commands.len(), diffs.len());
    let text: String = diffs.into_values().collect();
    assert!(text.is_empty(), "answers differ from tests/golden/answers:\n{text}\n{}", ADVICE);
}

const ADVICE: &str = "If the new answers are right, record them: tests/golden/accept NAME…";

/// Names of the recorded answers, sorted.
pub fn recorded_names() -> Vec<String> {
    let entries = fs::read_dir(folder().join("answers")).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The diff of one command, recorded anew if accepted; `None` if there is none.
fn examine(command: &GoldenCommand, is_accepting: bool) -> Option<String> {
    let folder = folder().join("answers").join(&command.name);
    let now = answer(command);
    let mut names: Vec<String> = now.keys().cloned().collect();
    let recorded = fs::read_dir(&folder).into_iter().flatten();
    names.extend(recorded.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()));
    names.sort();
    names.dedup();
    let mut diff = String::new();
    for name in &names {
        let found = compare(command, fs::read_to_string(folder.join(name)).ok(), now.get(name));
        if !found.is_empty() {
            diff += &format!("  {name}\n");
        }
        found.iter().take(SHOWN).for_each(|difference| diff += &format!("{difference}\n"));
        if found.len() > SHOWN {
            diff += &format!("    … and {} more differences\n", found.len() - SHOWN);
        }
    }
    if diff.is_empty() {
        return None;
    }
    if is_accepting {
        record(&folder, &now);
    }
    Some(format!("\n{} (rotor-edge {})\n{diff}", command.name, command.run))
}

fn compare(command: &GoldenCommand, recorded: Option<String>, now: Option<&Content>) -> Vec<Difference> {
    match (recorded, now) {
        (Some(recorded), Some(Content::Text(now))) => {
            compare_text::compare(&recorded, now, command.class, &command.rounding)
        }
        (Some(recorded), Some(Content::Json(now))) => match serde_json::from_str::<Value>(&recorded) {
            Ok(recorded) => compare_json::compare(&recorded, now, command.class),
            Err(problem) => vec![Difference::exact("recorded answer", problem, "JSON")],
        },
        (Some(_), None) => vec![Difference::exact("file", "recorded", "missing")],
        (None, _) => vec![Difference::exact("file", "missing", "there")],
    }
}

fn record(folder: &PathBuf, now: &BTreeMap<String, Content>) {
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).unwrap();
    for (name, content) in now {
        let text = match content {
            Content::Text(text) => text.clone(),
            Content::Json(node) => compact(&node.to_value(), 0) + "\n",
        };
        fs::write(folder.join(name), text).unwrap();
    }
}

/// JSON with a key a line, and short arrays and objects on one line.
fn compact(value: &Value, indent: usize) -> String {
    const WIDTH: usize = 110;
    let flat = value.to_string();
    let (pad, inner) = (" ".repeat(indent), " ".repeat(indent + 1));
    let join = |parts: Vec<String>, open: &str, close: &str| {
        format!("{open}\n{inner}{}\n{pad}{close}", parts.join(&format!(",\n{inner}")))
    };
    match value {
        _ if flat.len() + indent <= WIDTH => flat,
        Value::Object(object) => {
            let member = |(key, v): (&String, &Value)| {
                format!("{}: {}", Value::from(key.as_str()), compact(v, indent + 1))
            };
            join(object.iter().map(member).collect(), "{", "}")
        }
        Value::Array(list) => join(list.iter().map(|v| compact(v, indent + 1)).collect(), "[", "]"),
        _ => flat,
    }
}

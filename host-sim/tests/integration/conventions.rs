//! One meaning of `±`, of amplitudes and of intervals in all recorded output.

use std::fs;

use serde_json::Value;

use crate::golden::manifest::{self, GoldenCommand, Group};

/// Commands that print amplitudes or fitted numbers.
const COMMANDS: [&str; 10] = [
    "add", "balance", "compare", "diagnose", "estimate", "identify", "improve", "simulate", "startup",
    "track",
];
/// Verdicts after which no interval holds.
const REJECTED: [&str; 4] = ["missing: ", "undecided: ", "unknown: ", "misses: "];

/// A recorded file of every quick command line of these commands, by name.
fn recorded(file: &str) -> Vec<(String, String)> {
    let is_ours = |c: &GoldenCommand| COMMANDS.iter().any(|word| c.run.starts_with(&format!("{word} ")));
    let quick = manifest::read().into_iter().filter(|c| c.group() == Group::Quick && is_ours(c));
    let text = |c: GoldenCommand| {
        let path = manifest::folder().join("answers").join(&c.name).join(file);
        Some((c.name, fs::read_to_string(path).ok()?))
    };
    quick.filter_map(text).collect()
}

#[test]
fn amplitude_in_um_says_pk_pk_or_0_pk() {
    let texts = recorded("terminal.txt");
    assert!(texts.len() > 20);
    for (name, text) in texts {
        // a clearance is a length
        let lines: Vec<&str> = text.lines().collect();
        for (n, line) in
            lines.iter().enumerate().filter(|(_, line)| !line.to_lowercase().contains("clearance"))
        {
            // a line may wrap behind the unit
            let line = [line, lines.get(n + 1).copied().unwrap_or_default()].join(" ");
            for (at, um) in line.match_indices("µm").filter(|(at, _)| *at < lines[n].len()) {
                let after = line[at + um.len()..].trim_start();
                let is_said = ["pk-pk", "0-pk"].iter().any(|c| after.starts_with(c));
                assert!(is_said, "{name}: {line}");
            }
        }
    }
}

#[test]
fn rejected_model_is_followed_by_no_interval() {
    let texts = recorded("terminal.txt");
    let rejected: Vec<_> = texts
        .iter()
        .filter(|(_, text)| text.lines().any(|l| REJECTED.iter().any(|v| l.starts_with(v))))
        .collect();
    assert!(rejected.len() > 8, "{}", rejected.len());
    for (name, text) in rejected {
        let of_planes = text.lines().filter(|line| line.trim_start().starts_with("Unbalance of "));
        of_planes.for_each(|line| assert!(!line.contains("95 %") && !line.contains('±'), "{name}: {line}"));
        assert!(text.contains("no 95 % interval is stated"), "{name}");
    }
}

/// Every object of a JSON value.
fn objects<'v>(value: &'v Value, found: &mut Vec<&'v serde_json::Map<String, Value>>) {
    match value {
        Value::Object(object) => {
            found.push(object);
            object.values().for_each(|v| objects(v, found));
        }
        Value::Array(list) => list.iter().for_each(|v| objects(v, found)),
        _ => (),
    }
}

#[test]
fn uncertainty_in_json_says_its_kind_and_interval() {
    let mut seen = 0;
    for (name, text) in recorded("answer.json") {
        let Some(start) = text.find('{') else { continue };
        let Ok(answer) = serde_json::from_str::<Value>(&text[start..]) else { continue };
        let mut all = Vec::new();
        objects(&answer, &mut all);
        for object in all.iter().filter(|o| o.contains_key("uncertainty")) {
            seen += 1;
            assert_eq!(object["uncertainty_kind"], "standard deviation", "{name}");
            assert!(object["interval_95"].is_object(), "{name}");
        }
        for object in all.iter().filter(|o| o.contains_key("amplitude_um")) {
            assert_eq!(object["amplitude_convention"], "0-pk", "{name}");
        }
    }
    assert!(seen > 20, "{seen}");
}

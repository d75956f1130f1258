//! The messages of the bus: identifiers, signals and their bits, codes and their names.

use super::names::{Names, assert_all_there};
use crate::program::rotor_edge;

/// Messages, signals and codes of a DBC text.
fn messages(dbc: &str) -> Names {
    let (mut names, mut message) = (Names::new(), String::new());
    for line in dbc.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["BO_", id, name, bytes, ..] => {
                message = id.to_string();
                names.entry("messages".into()).or_default().insert(format!("{id}={name}{bytes}"));
            }
            ["SG_", signal, ":", bits, scale, _, unit, ..] => {
                let layout = format!("{signal}={bits}{scale}{unit}").replace('"', "");
                names.entry(message.clone()).or_default().insert(layout);
            }
            ["SIG_VALTYPE_", id, signal, ":", kind] => {
                let kind = kind.trim_end_matches(';').to_string();
                names.entry(format!("{id}.{signal}.type")).or_default().insert(kind);
            }
            ["VAL_", id, signal, ref codes @ ..] => {
                let pairs = codes.chunks_exact(2).map(|code| code.join("=").replace('"', ""));
                names.entry(format!("{id}.{signal}.codes")).or_default().extend(pairs);
            }
            _ => {}
        }
    }
    names
}

#[test]
fn messages_signals_and_codes_of_dbc_are_all_kept() {
    let output = rotor_edge(&["dbc"]);
    assert!(output.status.success());
    assert_all_there("messages.txt", &messages(&String::from_utf8(output.stdout).unwrap()));
}

#[test]
fn moved_bit_of_signal_is_another_name() {
    let dbc = "BO_ 257 Start: 8 Host\n SG_ Speed : 32|32@1- (1,0) [0|0] \"rpm\" Monitor\n";
    let moved = messages(&dbc.replace("32|", "24|"));
    assert_eq!(messages(dbc)["257"].iter().next().unwrap(), "Speed=32|32@1-(1,0)rpm");
    assert!(messages(dbc)["257"].is_disjoint(&moved["257"]));
}

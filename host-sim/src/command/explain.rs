//! `explain`: what a word of the program means, and what to do when it says it.

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_core::state::Reason;
use rotor_edge_desktop::effects;
use serde_json::json;

use super::glossary::{Kind, explained, not_known, words};
use super::output::{self, Json};
use crate::bus::states::name;
use crate::say;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The word, such as seal, residual or undecided [default: list all words]
    word: Vec<String>,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Prints the explanation, or the list of words.
pub fn run(arguments: &Arguments) -> Result<Json> {
    if arguments.word.is_empty() {
        return Ok(list(arguments.json));
    }
    let asked = arguments.word.join(" ");
    let Some(found) = explained(&asked) else { bail!("{}", not_known(&asked)) };
    if arguments.json {
        return output::as_json(&json!({
            "word": found.name, "kind": found.kind, "means": found.paragraphs, "next": found.next,
        }));
    }
    say!("{} ({})\n\n{}", found.name, found.kind, found.paragraphs.join("\n"));
    if !found.next.is_empty() {
        say!("\nWhat to do: {}", found.next);
    }
    Ok(None)
}

fn list(as_json: bool) -> Json {
    let of =
        |wanted: Kind| words().filter(|w| w.kind == wanted).map(|w| w.name.to_string()).collect::<Vec<_>>();
    let effects: Vec<String> = effects::ALL.into_iter().map(|e| e.name().to_string()).collect();
    let reasons: Vec<String> = Reason::ALL.into_iter().map(name).collect();
    let groups = [
        ("verdicts", of(Kind::Verdict)),
        ("states", of(Kind::State)),
        ("reasons", reasons),
        ("terms", of(Kind::Term)),
        ("effects", effects),
    ];
    if as_json {
        let all: serde_json::Map<_, _> =
            groups.iter().map(|(name, words)| ((*name).to_string(), json!(words))).collect();
        return Some(serde_json::Value::Object(all).to_string());
    }
    for (name, words) in groups {
        say!("{name}: {}\n", words.join(", "));
    }
    say!("Next: rotor-edge explain residual");
    None
}

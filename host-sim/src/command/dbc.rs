//! `dbc`: the protocol of one monitor as a DBC file, for cantools and every CAN tool.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_core::can::{DBC, MAX_NODE};
use serde_json::json;

use super::output;
use crate::say;

/// What its comment says of other monitors.
const SHOWN: &str = "this file shows the identifiers of monitor 0. For monitor n add n, or mask received identifiers with 0x7E0.";

#[derive(Debug, Args)]
pub struct Arguments {
    /// The monitor's number
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(0..=i64::from(MAX_NODE)))]
    node: u8,
    /// Where to write it; to standard output if absent
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let node = arguments.node;
    let text = of_node(node);
    if let Some(path) = &arguments.output {
        output::file(path, text.as_bytes())?;
    }
    match (&arguments.output, arguments.json) {
        (Some(path), true) => output::json(&json!({ "node": node, "output": path })),
        (None, true) => output::json(&json!({ "node": node, "dbc": text })),
        (Some(path), false) => {
            say!("The protocol of monitor {node} is in {}.", path.display());
            Ok(())
        }
        (None, false) => {
            print!("{text}");
            Ok(())
        }
    }
}

/// The file of monitor `node`: every identifier is that of monitor 0 and the number.
fn of_node(node: u8) -> String {
    let of_this =
        format!("this file shows the identifiers of monitor {node}. The low five bits are its number.");
    let lines = DBC.lines().map(|line| moved(line, node));
    let mut text: String = lines.flat_map(|line| [line, "\n".into()]).collect();
    if node > 0 {
        text = text.replace(SHOWN, &of_this);
    }
    text
}

/// A line with its identifier moved; others as they are.
fn moved(line: &str, node: u8) -> String {
    let mut words: Vec<String> = line.split(' ').map(String::from).collect();
    let names_it = |word: &String| ["BO_", "SG_", "VAL_", "SIG_VALTYPE_"].contains(&word.as_str());
    // an identifier stands in the first words, after what it is the identifier of
    let place = (1..words.len().min(4)).find(|place| names_it(&words[place - 1]));
    if let Some(place) = place
        && let Ok(identifier) = words[place].parse::<u16>()
    {
        words[place] = (identifier + u16::from(node)).to_string();
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dbc_of_monitor_0_is_the_file_and_others_are_renumbered() {
        assert_eq!(of_node(0), DBC);
        assert!(DBC.contains(SHOWN));
        let text = of_node(30);
        for (before, after) in DBC.lines().zip(text.lines()) {
            let numbers = |line: &str| -> Vec<u16> {
                line.split(' ').take(4).filter_map(|word| word.parse().ok()).collect()
            };
            let is_definition = before.starts_with("BA_DEF") || before.starts_with(" SG_");
            match (numbers(before).first(), numbers(after).first()) {
                (Some(before), Some(after)) if !is_definition => assert_eq!(after - before, 30),
                (before, after) => assert_eq!(before, after),
            }
        }
    }

    #[test]
    fn each_kind_of_line_moves_its_identifier_and_nothing_else() {
        for (line, expected) in [
            ("BO_ 256 ReadingStart: 8 Host", "BO_ 261 ReadingStart: 8 Host"),
            ("CM_ SG_ 256 Speed \"2 ways\";", "CM_ SG_ 261 Speed \"2 ways\";"),
            ("CM_ BO_ 288 \"8 bytes\";", "CM_ BO_ 293 \"8 bytes\";"),
            ("BA_ \"GenMsgCycleTime\" BO_ 1024 1000;", "BA_ \"GenMsgCycleTime\" BO_ 1029 1000;"),
            ("VAL_ 256 Keyphasor 0 \"NotStated\" ;", "VAL_ 261 Keyphasor 0 \"NotStated\" ;"),
            ("SIG_VALTYPE_ 256 Speed : 1;", "SIG_VALTYPE_ 261 Speed : 1;"),
            (
                " SG_ Sequence : 0|16@1+ (1,0) [0|65535] \"\" Host",
                " SG_ Sequence : 0|16@1+ (1,0) [0|65535] \"\" Host",
            ),
        ] {
            assert_eq!(moved(line, 5), expected);
        }
    }
}

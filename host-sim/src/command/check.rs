//! `check`: what a machine's drawing alone says, before anything is measured on it.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;
use rotor_edge_desktop::check::{CheckUnbalance, check};
use rotor_edge_desktop::rotor_file;

use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::check::CheckAnswer;
use crate::command::shell;
use crate::render;
use crate::terminal;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml
    rotor: PathBuf,
    /// Running speed or range, rpm, as in 3600 or 3000..3600 (0 is at rest); separation margins refer to it
    #[arg(long, value_parser = speeds)]
    rpm: Option<[f64; 2]>,
    /// Use the unbalance stated in the rotor file instead of twice the permissible one
    #[arg(long)]
    own_unbalance: bool,
    #[command(flatten)]
    form: output::Form,
}

/// A speed or a range of speeds on the command line, from rest on.
fn speeds(text: &str) -> Result<[f64; 2], String> {
    let (from, to) = text.split_once("..").unwrap_or((text, text));
    match (from.parse::<f64>(), to.parse::<f64>()) {
        (Ok(from), Ok(to)) if 0.0 <= from && from <= to && to.is_finite() => Ok([from, to]),
        _ => Err(format!(
            "\"{text}\" is neither a speed nor a range of speeds; expected for example 3600 or 3000..3600"
        )),
    }
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let rotor = rotor_file::read(&arguments.rotor)?;
    let working = listener.spinner("modes and responses");
    let unbalance = if arguments.own_unbalance { CheckUnbalance::Own } else { CheckUnbalance::Assumed };
    let found =
        check(&rotor, arguments.rpm, unbalance).with_context(|| arguments.rotor.display().to_string())?;
    working.finish_and_clear();
    let answer = CheckAnswer::from(&found);
    if let Some(path) = &arguments.form.report {
        let story = render::check::story(&answer, &found, next(arguments));
        let sections = render::check::sections(&answer, &found);
        output::story(path, &format!("{}: what its drawing says", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::check::text(&answer));
    output::say_next(&next(arguments));
    Ok(None)
}

/// What to do, and the command for it.
fn next(arguments: &Arguments) -> output::Next {
    let command = format!("rotor-edge compare {} measured.csv", shell::path(&arguments.rotor));
    ("hold the model against measurements".into(), Some(command))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_speed_and_rest_are_ranges_and_reversed_is_not() {
        assert_eq!(speeds("4000"), Ok([4000.0, 4000.0]));
        assert_eq!(speeds("0"), Ok([0.0, 0.0]));
        assert_eq!(speeds("0..3600"), Ok([0.0, 3600.0]));
        for wrong in ["3600..3000", "-5", "fast", "1..inf", ""] {
            assert!(speeds(wrong).is_err(), "{wrong}");
        }
    }
}

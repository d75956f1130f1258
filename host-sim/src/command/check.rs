//! `check`: what a machine's drawing alone says, before anything is measured on it.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::check::check;
use rotor_edge_desktop::rotor_file;

use super::listener::Listener;
use super::output::{self, Json};
use super::startup;
use crate::answers::check::CheckAnswer;
use crate::command::shell;
use crate::render;
use crate::say;
use crate::terminal;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml
    rotor: PathBuf,
    /// Speeds that the machine runs at, rpm, as in 3000..3600; margins are given to them
    #[arg(long, value_parser = startup::range)]
    rpm: Option<[f64; 2]>,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let rotor = rotor_file::read(&arguments.rotor)?;
    let working = listener.spinner("modes and responses");
    let found = check(&rotor, arguments.rpm)?;
    working.finish_and_clear();
    let answer = CheckAnswer::from(&found);
    if let Some(path) = &arguments.form.report {
        let sections = render::check::sections(&answer, &found);
        output::report(path, &format!("{}: what its drawing says", rotor.name), sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::check::text(&answer, arguments.rpm.is_some()));
    say!(
        "\nNext: hold the model against measurements\n  rotor-edge compare {} measured.csv",
        shell::path(&arguments.rotor)
    );
    Ok(None)
}

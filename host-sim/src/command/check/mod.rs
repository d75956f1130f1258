//! `check`: what a machine's drawing alone says, before anything is measured on it.

mod json;
pub mod report;
mod text;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::check::check;
use rotor_edge_desktop::rotor_file;

use super::listener::Listener;
use super::output::{self, Json};
use super::startup;
use crate::command::shell;

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
    if let Some(path) = &arguments.form.report {
        output::report(path, &format!("{}: what its drawing says", rotor.name), report::sections(&found))?;
    }
    if arguments.form.json {
        return output::as_json(&json::of(&found));
    }
    text::print(&found, arguments.rpm.is_some());
    println!(
        "\nNext: hold the model against measurements\n  rotor-edge compare {} measured.csv",
        shell::path(&arguments.rotor)
    );
    Ok(None)
}

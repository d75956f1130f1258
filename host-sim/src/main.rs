//! `rotor-edge`: see `rotor-edge --help`.

use std::process::ExitCode;

use clap::Parser;
use rotor_edge::command::{self, Cli};

fn main() -> ExitCode {
    match command::run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("rotor-edge: {error:#}");
            ExitCode::FAILURE
        }
    }
}

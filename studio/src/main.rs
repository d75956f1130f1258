//! `rotor-edge-studio`: see `rotor-edge-studio --help`.

use std::process::ExitCode;

use clap::Parser as _;
use rotor_edge_studio::command::{self, Cli};

fn main() -> ExitCode {
    match command::run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("rotor-edge-studio: {}", rotor_edge::command::shown(&error));
            ExitCode::FAILURE
        }
    }
}

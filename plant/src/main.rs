//! `rotor-edge-plant`: see `rotor-edge-plant --help`.

use std::process::ExitCode;

use clap::Parser as _;
use rotor_edge_plant::command::{self, Cli};

fn main() -> ExitCode {
    match command::run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("rotor-edge-plant: {}", rotor_edge::command::shown(&error));
            ExitCode::FAILURE
        }
    }
}

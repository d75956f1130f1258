//! The commands, one file each.

mod identify;
mod output;
mod replay;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// Unbalance of a rotor from its 1x vibration, at the machine's edge and on the desk.
///
/// Without a command, the main job runs on the built-in sample: 460 days of a turbine, played over a
/// virtual CAN bus into the controller's core, every result checked against the full-precision model.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Play a record over a virtual CAN bus into the controller's core and check every result
    Replay(Box<replay::Arguments>),
    /// Phase I: bearings and unbalance of a machine's first days
    Identify(identify::Arguments),
}

/// Runs what the command line asks for.
///
/// # Errors
/// One sentence on what is wrong with the input, or which check failed.
pub fn run(cli: Cli) -> Result<()> {
    match cli.command {
        None => replay::run(&replay::Arguments::sample()),
        Some(Command::Replay(arguments)) => replay::run(&arguments),
        Some(Command::Identify(arguments)) => identify::run(&arguments),
    }
}

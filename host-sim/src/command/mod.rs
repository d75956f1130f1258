//! The commands, a file each, or a folder where one file would not do.

mod acknowledge;
mod add;
pub mod balance;
mod bus;
pub mod check;
mod command_target;
mod compare;
mod completions;
mod dbc;
mod decode;
mod deploy;
mod deployable;
mod detector_arguments;
mod diagnose;
mod estimate;
mod explain;
pub mod extension;
mod extract;
mod forecast;
mod glossary;
mod identify;
mod import;
mod import_rotor;
mod improve;
mod key;
mod listener;
mod manual;
mod node;
mod notation;
mod offline;
mod output;
mod plan;
mod provenance;
mod replay;
mod setting;
pub mod shell;
mod simulate;
pub mod startup;
mod stop;
mod targets;
mod thresholds;
mod track;
pub mod tracker;
mod usage;
mod watch;

use std::ffi::OsString;

use anyhow::{Result, anyhow};
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use crate::terminal;

pub use diagnose::fitted;
pub use glossary::other_spellings_in;
pub use listener::Listener;
pub use output::{fitted_model, story as write_report};
pub use simulate::measured as simulated_file;
pub use usage::shown;

/// Unbalance of a rotor from its 1x vibration, at the machine's edge and on the desk.
///
/// Without a command, the main job runs on the built-in sample: 460 days of a turbine, played over a
/// virtual CAN bus into the controller's core, every result checked against the full-precision model.
#[derive(Debug, Parser)]
#[command(version = env!("ROTOR_EDGE_VERSION"))]
pub struct Cli {
    #[command(subcommand)]
    command: Option<CliCommand>,
    /// Overwrite input files as well; with import and extract, any existing file
    #[arg(long, global = true)]
    force: bool,
}

impl Cli {
    /// The grammar of a command line: `-1` is a number, which the command judges, and no option.
    fn grammar() -> clap::Command {
        Self::command().mut_subcommands(|command| command.allow_negative_numbers(true))
    }

    /// The command line of this process, whose files can be written; one that makes no sense ends it with a hint and exit
    /// code 2.
    ///
    /// # Errors
    /// If what it names to be written cannot be.
    pub fn of_this_process() -> Result<Self> {
        let mut command = Self::grammar().term_width(terminal::columns());
        let parsed = command.try_get_matches_from_mut(std::env::args_os());
        let matches = parsed.unwrap_or_else(|error| terminal::exit(&error));
        let cli = Self::from_arg_matches(&matches).unwrap_or_else(|error| terminal::exit(&error));
        if let Some((_, arguments)) = matches.subcommand() {
            targets::check(arguments, cli.force)?;
        }
        Ok(cli)
    }
}

#[derive(Debug, Subcommand)]
enum CliCommand {
    /// Play a record over a virtual CAN bus into the controller's core and check every result
    Replay(Box<replay::Arguments>),
    #[command(flatten)]
    Offline(offline::OfflineCommand),
    /// Run a monitor on a real bus: the controller's core, as firmware runs it
    Node(node::Arguments),
    /// Send a model to a monitor, authenticated and checked before it takes effect
    Deploy(deploy::Arguments),
    /// Read and set the thresholds of a monitor over the bus
    Thresholds(thresholds::Arguments),
    /// Acknowledge the flag of a monitor
    Acknowledge(acknowledge::Arguments),
    /// Make the key of a monitor
    Key(key::Arguments),
    /// Serve a CAN bus without hardware or kernel modules: SLCAN and socketcand for all programs of this machine
    Bus(bus::Arguments),
    /// Watch all monitors of a bus on the terminal: unbalance, residual, flags and counters
    Watch(watch::Arguments),
    /// Write the protocol of one monitor as a DBC file, for cantools and other CAN tools
    Dbc(dbc::Arguments),
    /// Decode readings and results from a recorded candump log
    Decode(decode::Arguments),
    /// Explain a word of this program: a verdict, an effect, a state, a term
    Explain(explain::Arguments),
    /// Print completions of the command line for a shell
    Completions(completions::Arguments),
    /// Write the manual as pages for `man`
    Manual(manual::Arguments),
}

/// The JSON object that a command of the desk prints, for programs that are no shell: `words` are those of the command
/// line behind the program's name, with `--json` among them.
///
/// # Errors
/// The sentence that the command line would say.
pub fn object(words: impl IntoIterator<Item = OsString>, listener: Listener) -> Result<String> {
    let words = std::iter::once("rotor-edge".into()).chain(words);
    let refused = |error: clap::Error| anyhow!(usage::sentence(&error.to_string()));
    let matches = Cli::grammar().try_get_matches_from(words).map_err(refused)?;
    let cli = Cli::from_arg_matches(&matches).map_err(refused)?;
    if let Some((_, arguments)) = matches.subcommand() {
        targets::check(arguments, cli.force)?;
    }
    let printed = match cli.command {
        Some(CliCommand::Offline(command)) => {
            command.run(cli.force, listener).map_err(|error| anyhow!(shown(&error)))?
        }
        _ => None,
    };
    printed.ok_or_else(|| anyhow!("expected --json and a command that reads files alone"))
}

/// Runs what the command line asks for.
///
/// # Errors
/// One sentence on what is wrong with the input, or which check failed.
pub fn run(cli: Cli) -> Result<()> {
    match cli.command {
        None => replay::run(&replay::Arguments::sample()),
        Some(CliCommand::Replay(arguments)) => replay::run(&arguments),
        Some(CliCommand::Offline(command)) => {
            if let Some(object) = command.run(cli.force, Listener::Terminal)? {
                println!("{object}");
            }
            Ok(())
        }
        Some(CliCommand::Node(arguments)) => node::run(&arguments),
        Some(CliCommand::Deploy(arguments)) => deploy::run(&arguments),
        Some(CliCommand::Thresholds(arguments)) => thresholds::run(&arguments),
        Some(CliCommand::Acknowledge(arguments)) => acknowledge::run(&arguments),
        Some(CliCommand::Key(arguments)) => key::run(&arguments),
        Some(CliCommand::Bus(arguments)) => bus::run(&arguments),
        Some(CliCommand::Watch(arguments)) => watch::run(&arguments),
        Some(CliCommand::Dbc(arguments)) => dbc::run(&arguments),
        Some(CliCommand::Decode(arguments)) => decode::run(&arguments),
        Some(CliCommand::Explain(arguments)) => {
            if let Some(object) = explain::run(&arguments)? {
                println!("{object}");
            }
            Ok(())
        }
        Some(CliCommand::Completions(arguments)) => completions::run(&arguments, Cli::command()),
        Some(CliCommand::Manual(arguments)) => manual::run(&arguments, Cli::command()),
    }
}

//! The commands, a file each, or a folder where one file would not do.

mod acknowledge;
mod add;
mod answer;
pub mod balance;
mod bus;
pub mod check;
mod commanding;
mod compare;
mod completions;
mod dbc;
mod decode;
mod deploy;
mod deployable;
mod diagnose;
mod entitled;
mod estimate;
mod extract;
mod forecast;
mod identify;
mod import;
mod import_rotor;
mod improve;
mod judging;
mod key;
mod manual;
mod node;
mod output;
mod provenance;
mod replay;
mod setting;
pub mod startup;
mod stop;
mod targets;
mod thresholds;
mod track;
mod watch;

use anyhow::Result;
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

/// Unbalance of a rotor from its 1x vibration, at the machine's edge and on the desk.
///
/// Without a command, the main job runs on the built-in sample: 460 days of a turbine, played over a
/// virtual CAN bus into the controller's core, every result checked against the full-precision model.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Overwrite a file that is read as well; with import and extract, any that exists
    #[arg(long, global = true)]
    force: bool,
}

impl Cli {
    /// The command line of this process, whose files can be written; one that makes no sense ends it with a hint and exit
    /// code 2.
    ///
    /// # Errors
    /// If what it names to be written cannot be.
    pub fn of_this_process() -> Result<Self> {
        let matches = Self::command().get_matches();
        let cli = Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
        if let Some((_, arguments)) = matches.subcommand() {
            targets::check(arguments, cli.force)?;
        }
        Ok(cli)
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Play a record over a virtual CAN bus into the controller's core and check every result
    Replay(Box<replay::Arguments>),
    /// Look a machine over by its drawing alone: loads, critical speeds, modes, unbalance response, doubtful numbers
    Check(check::Arguments),
    /// Measurements from exports of other systems: CSV, TSV, xlsx, xls, ods; shows what it takes each column for
    Import(Box<import::Arguments>),
    /// 1x readings from raw samples of probes and keyphasor (CSV, WAV, npy, npz), by the controller's own extraction
    Extract(Box<extract::Arguments>),
    /// A drawing from a rotor that ROSS saved, and what could not be carried over
    ImportRotor(import_rotor::Arguments),
    /// Hold a model against measurements: where it misses, and whether that is noise or physics
    Compare(compare::Arguments),
    /// Say which physical effect is missing in a model, or which measurement would tell
    Diagnose(diagnose::Arguments),
    /// Fit one effect together with bearings and planes and write the better model
    Add(add::Arguments),
    /// Diagnose and add until the model is adequate
    Improve(improve::Arguments),
    /// Phase I: bearings and unbalance of a machine's first days
    Identify(identify::Arguments),
    /// The unbalance of each run relative to a base run, from runs with stated weights
    Estimate(estimate::Arguments),
    /// Follow the unbalance of a long record while bearings change
    Track(Box<track::Arguments>),
    /// Where the unbalance of a track is going
    Forecast(forecast::Arguments),
    /// Run a monitor on a real bus: the controller's core, as firmware runs it
    Node(node::Arguments),
    /// Send a model to a monitor, authenticated and checked before it takes effect
    Deploy(deploy::Arguments),
    /// What a monitor judges by: read and set over the bus
    Thresholds(thresholds::Arguments),
    /// Lower the flag that a monitor holds up
    Acknowledge(acknowledge::Arguments),
    /// Make the key of a monitor
    Key(key::Arguments),
    /// A CAN bus that needs neither hardware nor the kernel: SLCAN and socketcand for all programs of this machine
    Bus(bus::Arguments),
    /// Watch all monitors of a bus on the terminal: unbalance, residual, flags and counters
    Watch(watch::Arguments),
    /// The protocol of one monitor as a DBC file, for cantools and other CAN tools
    Dbc(dbc::Arguments),
    /// Readings and results from a recorded candump log
    Decode(decode::Arguments),
    /// A single-disk rotor from its start-up: the simple model, where it fails, and which effects mend it
    Startup(startup::Arguments),
    /// Correction weights, from the identified model and from trial runs alone
    Balance(Box<balance::Arguments>),
    /// Completions of the command line, for a shell
    Completions(completions::Arguments),
    /// The manual as pages for `man`
    Manual(manual::Arguments),
}

/// Runs what the command line asks for.
///
/// # Errors
/// One sentence on what is wrong with the input, or which check failed.
pub fn run(cli: Cli) -> Result<()> {
    match cli.command {
        None => replay::run(&replay::Arguments::sample()),
        Some(Command::Replay(arguments)) => replay::run(&arguments),
        Some(Command::Check(arguments)) => check::run(&arguments),
        Some(Command::Import(arguments)) => import::run(&arguments, cli.force),
        Some(Command::Extract(arguments)) => extract::run(&arguments, cli.force),
        Some(Command::ImportRotor(arguments)) => import_rotor::run(&arguments),
        Some(Command::Compare(arguments)) => compare::run(&arguments),
        Some(Command::Diagnose(arguments)) => diagnose::run(&arguments),
        Some(Command::Add(arguments)) => add::run(&arguments),
        Some(Command::Improve(arguments)) => improve::run(&arguments),
        Some(Command::Identify(arguments)) => identify::run(&arguments),
        Some(Command::Estimate(arguments)) => estimate::run(&arguments),
        Some(Command::Track(arguments)) => track::run(&arguments),
        Some(Command::Forecast(arguments)) => forecast::run(&arguments),
        Some(Command::Node(arguments)) => node::run(&arguments),
        Some(Command::Deploy(arguments)) => deploy::run(&arguments),
        Some(Command::Thresholds(arguments)) => thresholds::run(&arguments),
        Some(Command::Acknowledge(arguments)) => acknowledge::run(&arguments),
        Some(Command::Key(arguments)) => key::run(&arguments),
        Some(Command::Bus(arguments)) => bus::run(&arguments),
        Some(Command::Watch(arguments)) => watch::run(&arguments),
        Some(Command::Dbc(arguments)) => dbc::run(&arguments),
        Some(Command::Decode(arguments)) => decode::run(&arguments),
        Some(Command::Startup(arguments)) => startup::run(&arguments),
        Some(Command::Balance(arguments)) => balance::run(&arguments),
        Some(Command::Completions(arguments)) => completions::run(&arguments, Cli::command()),
        Some(Command::Manual(arguments)) => manual::run(&arguments, Cli::command()),
    }
}

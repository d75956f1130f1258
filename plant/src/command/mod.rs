//! The command line: `gateway`, `collect`, `nkey`, `status`, `export`, `forget`; `machine`, `fleet`, `worker`; `serve`.

mod collect;
mod export;
mod fleet;
mod forget;
mod gateway;
mod nkey;
mod serve;
mod status;
mod worker;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{Parser, Subcommand};
use rotor_edge::bus::BusSpec;

use crate::database::Database;
use crate::gateway::Named;
use crate::sink::Sink;
use crate::store::Store;
use crate::stream::Stream;
use crate::stream::access::Access;

/// Stores the messages of all monitors of a plant, in a file, a database or over NATS JetStream.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Store readings, results, states and heartbeats from CAN buses in a file, a database or a NATS server
    Gateway(gateway::Arguments),
    /// Store the messages of a NATS server in a file or a database
    Collect(collect::Arguments),
    /// Show the last state of every monitor in a file
    Status(status::Arguments),
    /// Write each day of a file as Parquet, for notebooks and data lakes
    Export(export::Arguments),
    /// Delete all data before a given day from a file
    Forget(forget::Arguments),
    /// State which machine a monitor watches
    Machine(fleet::MachineArguments),
    /// Request desktop commands for many machines, and show the answers
    Fleet(fleet::Fleet),
    /// Run the requested jobs; any number of workers may run at once
    Worker(worker::Arguments),
    /// Make the secret key (NKey) with which a program logs in to a NATS server
    Nkey(nkey::Arguments),
    /// Serve live pages of all monitors, machines and jobs, and metrics for Prometheus
    Serve(serve::Arguments),
}

/// Runs what the command line asks for.
///
/// # Errors
pub fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Gateway(arguments) => gateway::run(&arguments),
        Command::Collect(arguments) => collect::run(&arguments),
        Command::Status(arguments) => status::run(&arguments),
        Command::Export(arguments) => export::run(&arguments),
        Command::Forget(arguments) => forget::run(&arguments),
        Command::Machine(arguments) => fleet::machine(&arguments),
        Command::Fleet(arguments) => fleet::fleet(&arguments),
        Command::Worker(arguments) => worker::run(&arguments),
        Command::Nkey(arguments) => nkey::run(&arguments),
        Command::Serve(arguments) => serve::run(&arguments),
    }
}

/// Where items go or come from.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Endpoint {
    File(PathBuf),
    Server(String),
    Database(String),
}

impl Endpoint {
    /// As a command line names it.
    fn of(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("nats" | "tls" | "ws" | "wss", _)) => Ok(Self::Server(text.into())),
            Some(("postgres" | "postgresql", _)) => Ok(Self::Database(text.into())),
            Some(("sqlite", path)) => Ok(Self::File(path.into())),
            Some((scheme, rest)) if rest.starts_with("//") => Err(format!(
                "{scheme} is no place that is known, expected nats://HOST:PORT, postgres://NAME@HOST/DATABASE or a file"
            )),
            _ => Ok(Self::File(text.into())),
        }
    }

    fn open(&self, access: &Access) -> Result<Box<dyn Sink>> {
        Ok(match self {
            Self::File(path) => Box::new(Store::open(path)?),
            Self::Database(address) => Box::new(Database::open(address)?),
            Self::Server(address) => Box::new(Stream::open(address, access, &[])?),
        })
    }
}

/// A bus with its name in the plant.
fn named(text: &str) -> Result<Named, String> {
    let (name, spec) = match text.split_once('=') {
        // a bit rate has an equals sign too
        Some((name, spec)) if !name.contains(':') => (name, spec),
        _ => (text, text),
    };
    let spec: BusSpec = spec.parse().map_err(|error: anyhow::Error| format!("{error:#}"))?;
    Ok(Named { name: name.into(), spec })
}

/// Shortest time that a server may keep what it has: a collection is restarted within it.
const SHORTEST_KEPT: Duration = Duration::from_secs(3_600);

/// Days after which a server forgets.
fn days(text: &str) -> Result<Duration, String> {
    let days = text.parse::<f64>().ok().and_then(|days| Duration::try_from_secs_f64(days * 86_400.0).ok());
    days.filter(|time| *time >= SHORTEST_KEPT).ok_or_else(|| "expected days, at least 0.05".into())
}

/// A store that is there.
fn opened(store: &Path) -> Result<Store> {
    if !store.is_file() {
        bail!("{}: no such file; `gateway` or `collect` creates it", store.display());
    }
    Store::open(store)
}

/// Rises with Ctrl-C or SIGTERM.
fn on_signal() -> Result<Arc<AtomicBool>> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    ctrlc::set_handler(move || raised.store(true, Ordering::Relaxed)).context("Ctrl-C cannot be handled")?;
    Ok(flag)
}

/// To a person, on standard error; nobody may be reading.
fn tell(sentence: &str) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stderr(), "{sentence}");
}

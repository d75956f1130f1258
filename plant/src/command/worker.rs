//! `worker`: does jobs, of a file or of a server.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;

use super::{Endpoint, named, on_signal, opened, tell};
use crate::fleet::task::{Hands, keys_in};
use crate::fleet::{server, worker};
use crate::gateway::Named;
use crate::stream::access::Access;
use crate::stream::server::Server;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file, or nats://HOST:PORT where somebody shares the jobs of one
    #[arg(value_parser = Endpoint::of)]
    from: Endpoint,
    /// End when nothing is left to do
    #[arg(long)]
    once: bool,
    /// A bus that this host is at, NAME=BUS as for gateway: this worker deploys models to its monitors, and does nothing else
    #[arg(long, value_parser = named, requires = "keys")]
    bus: Vec<Named>,
    /// Name of the plant that the buses are in
    #[arg(long, default_value = "plant")]
    plant: String,
    /// Keys of the monitors, a folder with BUS/NODE.key
    #[arg(long, value_name = "FOLDER", requires = "bus")]
    keys: Option<PathBuf>,
    #[command(flatten)]
    access: Access,
}

/// Runs the command until it is told to stop, or until nothing is left.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { from, once, bus, plant, keys, access } = arguments;
    let keys = keys.as_deref().map(keys_in).transpose()?.unwrap_or_default();
    let hands = Hands { plant: plant.clone(), buses: bus.clone(), keys };
    let stop = on_signal()?;
    let ended = match from {
        Endpoint::File(path) => {
            drop(opened(path)?);
            worker::run(path, &hands, *once, &stop, tell)?
        }
        Endpoint::Server(address) => {
            let server = Server::connect(address, access)?;
            server::work(&server, &hands, *once, &stop, tell)?
        }
        Endpoint::Database(_) => bail!("jobs are in a file or at nats://HOST:PORT, not in a database"),
    };
    println!("{ended} jobs ended.");
    if let Endpoint::File(path) = from {
        println!("Next: rotor-edge-plant fleet status {}", path.display());
    }
    Ok(())
}

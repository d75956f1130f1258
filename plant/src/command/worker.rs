//! `worker`: does jobs, of a file or of a server.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;

use super::{Endpoint, named, on_signal, opened, tell};
use crate::fleet::task::{Hands, keys_in};
use crate::fleet::{server, worker};
use crate::gateway::Named;
use crate::names::counted;
use crate::stream::access::Access;
use crate::stream::server::Server;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file with the jobs, or nats://HOST:PORT to which `fleet share` sends them
    #[arg(value_parser = Endpoint::of)]
    from: Endpoint,
    /// Exit when all jobs are done
    #[arg(long)]
    once: bool,
    /// Bus of this host, NAME=BUS as for `gateway`; this worker then only deploys models to its monitors
    #[arg(long, value_parser = named, requires = "keys")]
    bus: Vec<Named>,
    /// Name of the plant of these buses
    #[arg(long, default_value = "plant")]
    plant: String,
    /// Folder with the keys of the monitors, BUS/NODE.key
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
    println!("{} done.", counted(ended as usize, "job"));
    if let Endpoint::File(path) = from {
        println!("Next: rotor-edge-plant fleet status {}", path.display());
    }
    Ok(())
}

//! `node`: a monitor on a real bus.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_core::node::NodeConfig;
use serde_json::json;

use super::thresholds::Thresholds;
use super::{deployable, output, stop};
use crate::bus::BusSpec;
use crate::deploy::read_key;
use crate::node::{Store, serve};

#[derive(Debug, Args)]
pub struct Arguments {
    /// The bus to join, such as slcan:127.0.0.1:29537, socketcand:127.0.0.1:29536 or socketcan:vcan0
    #[arg(long)]
    bus: BusSpec,
    /// An identified rotor, rotor.toml; the built-in sample after phase I if absent
    #[arg(long)]
    rotor: Option<PathBuf>,
    /// Highest speed that the machine reaches; that of the data the rotor was fitted to if absent
    #[arg(long, requires = "rotor")]
    fastest_rpm: Option<f64>,
    /// The monitor's key; without one it takes no commands
    #[arg(long)]
    key: Option<PathBuf>,
    /// Where a deployed model and the counter of commands survive a restart
    #[arg(long, requires = "key")]
    state: Option<PathBuf>,
    #[command(flatten)]
    thresholds: Thresholds,
    /// Print one JSON object when it ends, instead of text
    #[arg(long)]
    json: bool,
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let key = arguments.key.as_deref().map(read_key).transpose()?;
    let config = NodeConfig { key, ..arguments.thresholds.config()? };
    let store = arguments.state.as_deref().map(Store::open).transpose()?;
    let model = match &arguments.rotor {
        Some(path) => deployable::of_file(path, arguments.fastest_rpm)?,
        None => deployable::of_sample(arguments.thresholds.seed)?,
    };
    let mut bus = arguments.bus.open()?;
    let stop = stop::on_signal()?;
    if !arguments.json {
        let deployed = store.as_ref().is_some_and(|s| s.model().is_some());
        println!(
            "Monitor {} listens on {}{}; {}. Ctrl-C ends it.",
            config.node,
            bus.description(),
            if deployed { " with the model deployed last" } else { "" },
            if key.is_some() { "commands need its key" } else { "it has no key and takes no commands" },
        );
    }
    let served = serve(&mut *bus, config, model.edge, store, &stop)?;
    let c = served.counters;
    if arguments.json {
        return output::json(&json!({
            "frames": { "sent": served.sent, "received": served.received },
            "readings": c.readings, "skipped": c.skipped, "lost": c.lost, "rejected": c.rejected,
            "commands": { "accepted": c.accepted, "refused": c.refused, "forged": c.forged, "replayed": c.replayed },
            "broken_transfers": c.broken, "conflicts": c.conflicts,
        }));
    }
    println!(
        "\n{} readings evaluated, {} skipped, {} lost, {} rejected; commands: {} accepted, {} refused, {} forged, {} replayed",
        c.readings, c.skipped, c.lost, c.rejected, c.accepted, c.refused, c.forged, c.replayed
    );
    Ok(())
}

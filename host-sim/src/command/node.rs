//! `node`: a monitor on a real bus.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use rotor_edge_core::can::Counters;
use serde_json::json;

use super::detector_arguments::DetectorArguments;
use super::{deployable, output, stop};
use crate::bus::BusSpec;
use crate::bus::counters::named;
use crate::clock::RealTime;
use crate::deploy::read_key;
use crate::edge::encoded;
use crate::node::{Controller, Event, Store, serve};
use crate::watch::reasons::why;
use crate::{say, terminal};

/// So long after a restart no reading is taken, at most; a disk bears to be written every half of it, which flash does not.
const NONCE_RESERVE_US: u64 = 10_000_000;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The bus to join, such as slcan:127.0.0.1:29537, socketcand:127.0.0.1:29536 or socketcan:vcan0
    #[arg(long)]
    bus: BusSpec,
    /// An identified rotor, rotor.toml, whose model it starts with as long as none was deployed; it starts without a model if
    /// absent
    #[arg(long)]
    rotor: Option<PathBuf>,
    /// Start with the model of the built-in sample, to try things out
    #[arg(long, conflicts_with = "rotor")]
    sample: bool,
    /// Highest speed that the machine reaches; that of the data the rotor was fitted to if absent
    #[arg(long, requires = "rotor")]
    fastest_rpm: Option<f64>,
    /// The monitor's key; without a key it takes no commands, and with a key it stores the counter of the last
    /// command (--state)
    #[arg(long, requires = "state")]
    key: Option<PathBuf>,
    /// File that keeps the deployed model, thresholds, command counter and learned baseline over a restart
    #[arg(long)]
    state: Option<PathBuf>,
    /// Accept only readings with a message authentication code of the key, and send results and states with one (see
    /// SECURITY.md)
    #[arg(long, requires = "key")]
    sealed: bool,
    #[command(flatten)]
    detector: DetectorArguments,
    /// Print one JSON object when it ends, instead of text
    #[arg(long)]
    json: bool,
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let key = arguments.key.as_deref().map(read_key).transpose()?;
    let mut config = arguments.detector.config()?;
    config.key = key;
    config.authenticated = arguments.sealed;
    config.nonce_reserve = NONCE_RESERVE_US;
    config.seed = random()?;
    let mut store = match (&arguments.state, key) {
        (None, _) => Store::in_memory(),
        (Some(path), None) => Store::open(path)?,
        (Some(path), Some(key)) => Store::authenticated(path, key, config.node)?,
    };
    let initial = match &arguments.rotor {
        Some(path) => Some(deployable::of_file(path, arguments.fastest_rpm, None)?),
        None if arguments.sample => Some(deployable::of_sample(arguments.detector.seed)?),
        None => None,
    };
    if let Some(initial) = initial {
        store = store.with_initial_model(encoded(&initial.edge)?);
    }
    let mut bus = arguments.bus.open_lasting(output::tell)?;
    let stop = stop::on_signal()?;
    let is_deployed = store.is_deployed();
    let mut controller = Controller::start(config, store, 0)?;
    if !arguments.json {
        let model = match (controller.lacks_model(), is_deployed) {
            (Some(reason), _) => {
                let why = why(reason, 0);
                format!("without a model and judges nothing ({}: {})", why.what, why.next)
            }
            (None, true) => "with the model deployed last".into(),
            (None, false) => "with the model it was started with".into(),
        };
        let key = match (key, arguments.sealed) {
            (Some(_), true) => "commands and readings need its key",
            (Some(_), false) => "commands need its key",
            (None, _) => "it has no key and takes no commands",
        };
        say!("Monitor {} listens on {} {model}; {key}. Ctrl-C ends it.", config.node, bus.description());
    }
    let tell = |event: Event| {
        let is_failure = matches!(event, Event::Unsaved(_));
        // a monitor does not end because nobody reads what it says any more
        let _ = match arguments.json {
            false => terminal::log(&event.words()),
            true if is_failure => writeln!(std::io::stderr(), "rotor-edge: {}", event.words()),
            true => Ok(()),
        };
    };
    let served = serve(&mut *bus, &mut controller, &RealTime::start(), &stop, tell)?;
    let c = served.counters;
    if arguments.json {
        let mut counters: serde_json::Map<_, _> =
            named(&c).map(|(name, number)| (name.to_string(), number.into())).collect();
        for (name, value) in [
            ("frames", json!({ "sent": served.sent, "received": served.received })),
            (
                "commands",
                json!({ "accepted": c.accepted, "refused": c.refused, "forged": c.forged, "replayed": c.replayed }),
            ),
            ("broken_transfers", c.broken.into()),
        ] {
            counters.insert(name.into(), value);
        }
        return output::json(&counters);
    }
    say!("\n{}", counted(&c));
    Ok(())
}

fn counted(c: &Counters) -> String {
    format!(
        "{} readings evaluated, {} skipped, {} lost, {} rejected; commands: {} accepted, {} refused, {} forged, {} replayed",
        c.readings, c.skipped, c.lost, c.rejected, c.accepted, c.refused, c.forged, c.replayed
    )
}

fn random() -> Result<u64> {
    getrandom::u64().context("the system gives no random numbers")
}

//! `deploy`: a model to a monitor, over the bus, for good or on trial.

mod trial;

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, anyhow};
use clap::Args;
use rotor_edge_core::command::{Command, Detail};
use serde_json::json;

use super::command_target::CommandTarget;
use super::watch::seconds;
use super::{deployable, output};
use crate::bus::mac::AuthenticatedBus;
use crate::deploy::trial::Candidate;
use crate::deploy::{HEARTBEAT_TIME, ended, ended_json};
use crate::edge::{Deployment, encoded};
use crate::say;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The better model, rotor.toml, written by `identify`, `add` or `improve`
    rotor: PathBuf,
    #[command(flatten)]
    monitor: CommandTarget,
    /// Highest speed that the machine reaches; that of the data the rotor was fitted to if absent
    #[arg(long)]
    fastest_rpm: Option<f64>,
    /// A slow roll, measured.csv; the controller subtracts it as the runout of the probes
    #[arg(long, value_name = "FILE")]
    slow_roll: Option<PathBuf>,
    /// Also begin a new record: forget the unbalance last found and start from the model's
    #[arg(long)]
    restart: bool,
    /// Deploy it also if the monitor holds the model of another machine
    #[arg(long)]
    another_machine: bool,
    /// Try the model for so many seconds after listening to the old one for as long, and keep it only if its residual
    /// is no worse. Otherwise, or if this program ends early, the monitor returns to the old model by itself
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with_all = ["restart", "another_machine"])]
    trial: Option<Duration>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut authority = arguments.monitor.authority()?;
    let node = authority.node();
    let Deployment { edge: model, left_out, redundancy, .. } =
        deployable::of_file(&arguments.rotor, arguments.fastest_rpm, arguments.slow_roll.as_deref())?;
    let bytes = encoded(&model)?;
    let mut bus = arguments.monitor.open()?;
    if let Some(time) = arguments.trial {
        let candidate = Candidate { bytes, checksum: model.checksum() };
        let mut bus = AuthenticatedBus::listen(&mut *bus, authority.checker(), HEARTBEAT_TIME)?;
        let told = trial::try_out(arguments, &mut authority, &mut bus, &candidate, &left_out, time);
        let refused = bus.refused();
        if refused.any() {
            output::tell(&format!("frames of monitor {node} {refused}"));
        }
        return told;
    }
    let counter = authority.counter();
    let bar = output::progress("deploy", bytes.len());
    let sent = |bytes| bar.set_position(bytes as u64);
    let command = if arguments.another_machine { Command::DeployAnother } else { Command::Deploy };
    let answer = authority.command(&mut *bus, command, &bytes, sent)?;
    if arguments.restart {
        authority.command(&mut *bus, Command::Restart, &[], |_| ())?;
    }
    bar.finish_and_clear();
    if answer.model_checksum != model.checksum() {
        return Err(anyhow!("monitor {node} confirms another model than was sent; deploy again"));
    }
    if arguments.json {
        let mut told = json!({
            "node": node,
            "outcome": "accepted",
            "bytes": bytes.len(),
            "counter": counter,
            "model_checksum": answer.model_checksum,
            "left_out": left_out,
            "redundancy": redundancy,
        });
        for (key, value) in ended_json(answer.detail) {
            told[key] = value;
        }
        return output::json(&told);
    }
    if answer.detail != Detail::Unchanged {
        say!(
            "Monitor {node} runs the model of {} ({} bytes, checksum {:08x}) from its next reading on.",
            arguments.rotor.display(),
            bytes.len(),
            answer.model_checksum
        );
    }
    say!("Its readings have {}.", redundancy.words());
    if let Some(ended) = ended(node, answer.detail) {
        say!("{ended}");
    }
    if !left_out.is_empty() {
        say!("Left out, as the controller does not know runs: {}", left_out.join(", "));
    }
    say!("Next: watch the residual fall\n  rotor-edge watch --bus {}", arguments.monitor.bus);
    Ok(())
}

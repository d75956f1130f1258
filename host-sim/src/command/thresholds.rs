//! `thresholds`: what a monitor judges by, read and set over the bus.

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_core::command::Command;
use rotor_edge_core::thresholds::Thresholds;
use serde_json::{Value, json};

use super::command_target::CommandTarget;
use super::output;
use super::setting::Setting;
use crate::deploy::out_of_bounds;
use crate::terminal;

#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    monitor: CommandTarget,
    /// Sets a threshold, such as persistence_s=30 or gap_range_v=-16,-4; may be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<Setting>,
    /// Start from the defaults instead of the present thresholds
    #[arg(long)]
    defaults: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut authority = arguments.monitor.authority()?;
    // what cannot be is said before anything is sent
    for setting in &arguments.set {
        setting.apply(&mut Thresholds::DEFAULT.clone())?;
    }
    let mut bus = arguments.monitor.open()?;
    let before = authority.thresholds(&mut *bus)?;
    let mut wanted = if arguments.defaults { Thresholds::DEFAULT } else { before };
    for setting in &arguments.set {
        setting.apply(&mut wanted)?;
    }
    if let Err(error) = wanted.check() {
        bail!("{}; nothing was sent", out_of_bounds(error));
    }
    let is_set = wanted != before;
    if is_set {
        authority.command(&mut *bus, Command::SetThresholds, &wanted.encode(), |_| ())?;
        let now = authority.thresholds(&mut *bus)?;
        if now != wanted {
            bail!("monitor {} tells other thresholds than were set; set them again", authority.node());
        }
    }
    let fields = |thresholds: &Thresholds| serde_json::to_value(thresholds);
    if arguments.json {
        return output::json(&json!({
            "node": authority.node(),
            "set": is_set,
            "thresholds": shortest(fields(&wanted)?),
            "before": shortest(fields(&before)?),
        }));
    }
    let (wanted, before) = (shortest(fields(&wanted)?), shortest(fields(&before)?));
    let mut text = format!("Monitor {} judges by\n", authority.node());
    for (name, value) in wanted.as_object().into_iter().flatten() {
        let was = match &before[name] {
            old if old == value => String::new(),
            old => format!("   (was {old})"),
        };
        text += &format!("  {name:<22} {value}{was}\n");
    }
    terminal::print(&text);
    Ok(())
}

/// Numbers as they were meant: the shortest that is this f32.
fn shortest(value: Value) -> Value {
    match value {
        Value::Object(fields) => fields.into_iter().map(|(name, value)| (name, shortest(value))).collect(),
        Value::Array(values) => values.into_iter().map(shortest).collect(),
        Value::Number(number) if number.is_f64() => {
            let text = number.as_f64().map_or(String::new(), |number| (number as f32).to_string());
            text.parse::<f64>().map_or(Value::Number(number), Value::from)
        }
        other => other,
    }
}

//! `watch`: all monitors of a bus on the terminal, or as JSON.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::{Result, anyhow, bail};
use clap::Args;
use rotor_edge_core::can::MAX_NODE;

use super::{output, stop};
use crate::answers::watch::WatchAnswer;
use crate::bus::log::RecordingBus;
use crate::bus::mac::Checker;
use crate::bus::spec::BIT_RATES;
use crate::bus::{BusConfig, BusSpec, CanBus};
use crate::deploy::read_key;
use crate::watch::Watch;
use crate::watch::terminal::{listen, require_terminal, show};
use crate::watch::view::WatchedBus;

/// Between two looks at the signal, without a terminal.
const LOOK: Duration = Duration::from_millis(100);

#[derive(Debug, Args)]
pub struct Arguments {
    /// The bus to join, such as slcan:127.0.0.1:29537, socketcand:127.0.0.1:29536 or socketcan:vcan0
    #[arg(long)]
    bus: BusSpec,
    /// Watch this monitor alone; all if absent
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=i64::from(MAX_NODE)))]
    node: Option<u8>,
    /// Key of that monitor: ignore frames without its message authentication code (see `node --sealed`)
    #[arg(long, requires = "node")]
    key: Option<PathBuf>,
    /// Bits a second on the bus, for its load; that of the bus's name, else 500000
    #[arg(long)]
    bit_rate: Option<u32>,
    /// Write every frame to a candump log (see `decode`)
    #[arg(long, value_name = "FILE.log")]
    record: Option<PathBuf>,
    /// Print one JSON object with everything received at the end, and no display
    #[arg(long)]
    json: bool,
    /// Listen for so many seconds; until it is told to stop if absent
    #[arg(long, value_parser = seconds)]
    seconds: Option<Duration>,
}

/// A time above zero, of a command line.
pub fn seconds(text: &str) -> Result<Duration> {
    let seconds: Option<f64> = text.parse().ok().filter(|seconds| *seconds > 0.0);
    let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.ok_or_else(|| anyhow!("expected a number of seconds above 0, such as 10 or 0.5"))
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let place = WatchedBus { bus: arguments.bus.to_string(), bit_rate: bit_rate(arguments)? };
    let key = arguments.key.as_deref().map(read_key).transpose()?;
    if !arguments.json {
        require_terminal()?;
    }
    // a line of text would tear the picture, which names the bus and says so itself
    let tell = if arguments.json { output::tell } else { |_: &str| {} };
    let mut bus = arguments.bus.open_lasting(tell)?;
    if let Some(path) = &arguments.record {
        bus = Box::new(RecordingBus::new(bus, path)?);
    }
    let stop = stop::on_signal()?;
    let mut watch = Watch::new(arguments.node);
    if let Some((key, node)) = key.zip(arguments.node) {
        watch = watch.checking(Checker::new(key, node));
    }
    if !arguments.json {
        return show(&mut *bus, &mut watch, &place, arguments.seconds, &stop);
    }
    let started = bus.now();
    let left = |now: Duration| {
        arguments.seconds.map_or(LOOK, |seconds| seconds.saturating_sub(now - started).min(LOOK))
    };
    while !stop.load(Ordering::Relaxed) && !left(bus.now()).is_zero() {
        let time = left(bus.now());
        listen(&mut *bus, &mut watch, started, time)?;
    }
    if let Some(node) = arguments.node.filter(|node| watch.monitor(*node).is_none()) {
        bail!(
            "monitor {node} sent no frame on {} in {:.1} s and received no reading; leave out --node to list all monitors",
            place.bus,
            watch.now_us() as f64 * 1e-6
        );
    }
    output::json(&WatchAnswer::of(&watch, &place, bus.passed_over()))
}

fn bit_rate(arguments: &Arguments) -> Result<u32> {
    let named = match &arguments.bus {
        BusSpec::Slcan { bit_rate, .. } => *bit_rate,
        _ => BusConfig::default().bit_rate,
    };
    let [slowest, .., fastest] = BIT_RATES;
    match arguments.bit_rate {
        None => Ok(named),
        Some(bit_rate) if (slowest..=fastest).contains(&bit_rate) => Ok(bit_rate),
        Some(bit_rate) => bail!("--bit-rate {bit_rate}: expected bits a second from {slowest} to {fastest}"),
    }
}

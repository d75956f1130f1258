//! `collect`: a stream into a file or a database.

use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;

use super::{Endpoint, days, on_signal, tell};
use crate::collection::run as collect;
use crate::names::counted;
use crate::sink::Sink as _;
use crate::stream::Stream;
use crate::stream::access::Access;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The server, nats://HOST:PORT
    #[arg(long, value_parser = Endpoint::of)]
    from: Endpoint,
    /// The file (created if absent), or postgres://NAME@HOST/DATABASE
    #[arg(long, value_parser = Endpoint::of)]
    store: Endpoint,
    /// Name of this collection on the server; each name receives every item once
    #[arg(long, default_value = "store")]
    name: String,
    /// JetStream domain of a leaf node whose items are fetched; may be given several times [default: the items published to the server itself]
    #[arg(long, value_name = "DOMAIN")]
    leaf: Vec<String>,
    #[command(flatten)]
    access: Access,
    /// Days after which the server deletes items, collected or not [default: it keeps everything]
    #[arg(long, value_name = "DAYS", value_parser = days)]
    keep_days: Option<Duration>,
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let Endpoint::Server(address) = &arguments.from else { bail!("--from: expected nats://HOST:PORT") };
    if matches!(arguments.store, Endpoint::Server(_)) {
        bail!("--store: expected a file or postgres://NAME@HOST/DATABASE");
    }
    let stop = on_signal()?;
    let mut store = arguments.store.open(&arguments.access)?;
    let stream = Stream::open(address, &arguments.access, &arguments.leaf)?;
    if let Some(time) = arguments.keep_days {
        stream.keep_for(time)?;
    }
    tell(&format!("From {} to {}; Ctrl-C ends it.", stream.description(), store.description()));
    let totals = collect(&stream, &arguments.name, &mut *store, &stop, tell)?;
    println!(
        "{} stored, {} set aside.",
        counted(totals.stored as usize, "item"),
        counted(totals.strange as usize, "invalid message")
    );
    Ok(())
}

//! `status`: the last word of every monitor.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use jiff::Timestamp;
use serde_json::json;

use crate::store::Store;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file written by `gateway` or `collect`
    store: PathBuf,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let path = &arguments.store;
    if !path.is_file() {
        bail!("{}: no such file; `gateway` creates it", path.display());
    }
    let monitors = Store::open(path)?.newest()?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&json!({ "monitors": monitors }))?);
        return Ok(());
    }
    if monitors.is_empty() {
        println!("No monitor has sent a message yet.");
        return Ok(());
    }
    let time = |us: Option<i64>| {
        let of = us.and_then(|us| Timestamp::from_microsecond(us).ok());
        of.map_or_else(|| "never".into(), |at| at.strftime("%Y-%m-%d %H:%M:%S UTC").to_string())
    };
    println!(
        "{:<16} {:<16} {:>4}  {:<12} {:<16} {:>10}  heard last",
        "plant", "bus", "node", "state", "reason", "residual"
    );
    for m in monitors {
        let residual = m.ratio.map_or("–".into(), |ratio| format!("{:.1} %", 100.0 * ratio));
        let [state, reason] = [&m.state, &m.reason].map(|word| word.as_deref().unwrap_or("–"));
        let heard = time(m.heard_us);
        println!(
            "{:<16} {:<16} {:>4}  {state:<12} {reason:<16} {residual:>10}  {heard}",
            m.plant, m.bus, m.node
        );
    }
    Ok(())
}

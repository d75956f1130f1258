//! `serve`: live pages of all monitors, of each machine and of the jobs.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use clap::Args;

use super::on_signal;
use crate::live::{Admission, serve};

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file written by `gateway` or `collect`
    store: PathBuf,
    /// Address of the server; with any other than 127.0.0.1, all computers of the network can open the pages
    #[arg(long, default_value = "127.0.0.1:8370")]
    listen: SocketAddr,
    /// File with a token in its first line; users who know it can mark alarms as seen [default: read only]
    #[arg(long, value_name = "FILE")]
    token: Option<PathBuf>,
    /// Host name under which browsers open the server, besides localhost and its addresses; may be given several times
    #[arg(long, value_name = "NAME")]
    host: Vec<String>,
}

/// Shortest token, characters.
const SHORTEST_TOKEN: usize = 16;

fn token(path: &Path) -> Result<String> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    let token = text.lines().next().unwrap_or_default().trim();
    if token.chars().count() < SHORTEST_TOKEN {
        bail!("{name}: expected a token of at least {SHORTEST_TOKEN} characters in the first line");
    }
    Ok(token.into())
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let store = &arguments.store;
    if !store.is_file() {
        bail!("{}: no such file; `gateway` or `collect` creates it", store.display());
    }
    let stop = on_signal()?;
    let token = arguments.token.as_deref().map(token).transpose()?;
    let admission = Admission { token: token.as_deref(), hosts: &arguments.host };
    serve(store.clone(), arguments.listen, admission, &stop, |address| {
        println!("http://{address}/ shows all monitors of {}; Ctrl-C ends it.", store.display());
    })
}

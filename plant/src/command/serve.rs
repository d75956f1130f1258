//! `serve`: live pages of all monitors, of each machine and of the jobs.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use clap::Args;

use super::on_signal;
use crate::live::{Admission, serve};

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file that a gateway or a collection writes
    store: PathBuf,
    /// Where to listen; others than this machine reach it only at another address than 127.0.0.1, and then everybody does
    #[arg(long, default_value = "127.0.0.1:8370")]
    listen: SocketAddr,
    /// A file whose first line is a token: who knows it may say on a machine's page that an alarm was seen [default: nobody may]
    #[arg(long, value_name = "FILE")]
    token: Option<PathBuf>,
    /// A name by which the server is opened, beside localhost and its addresses; may be given several times
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
        bail!("{}: is not there; a gateway or a collection makes it", store.display());
    }
    let stop = on_signal()?;
    let token = arguments.token.as_deref().map(token).transpose()?;
    let admission = Admission { token: token.as_deref(), hosts: &arguments.host };
    serve(store.clone(), arguments.listen, admission, &stop, |address| {
        println!("http://{address}/ shows all monitors of {}; Ctrl-C ends it.", store.display());
    })
}

//! `serve`: a live page of all monitors.

use std::net::SocketAddr;
use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;

use super::on_signal;
use crate::live::serve;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file that a gateway or a collection writes
    store: PathBuf,
    /// Where to listen; others than this machine reach it only at another address than 127.0.0.1, and then everybody does
    #[arg(long, default_value = "127.0.0.1:8370")]
    listen: SocketAddr,
}

/// Runs the command until it is told to stop.
pub fn run(arguments: &Arguments) -> Result<()> {
    let store = &arguments.store;
    if !store.is_file() {
        bail!("{}: is not there; a gateway or a collection makes it", store.display());
    }
    let stop = on_signal()?;
    serve(store.clone(), arguments.listen, &stop, |address| {
        println!("http://{address}/ shows all monitors of {}; Ctrl-C ends it.", store.display());
    })
}

//! `key`: a secret for one monitor.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::deploy::write_new_key;
use crate::say;

#[derive(Debug, Args)]
pub struct Arguments {
    /// File for the key; an existing key is never overwritten
    #[arg(short, long)]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    write_new_key(&arguments.output)?;
    say!(
        "The new key is in {}. Give it to one monitor (node --key) and to everyone who may deploy to it (deploy --key).",
        arguments.output.display()
    );
    Ok(())
}

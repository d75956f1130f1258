//! `key`: a secret for one monitor.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::deploy::write_new_key;
use crate::say;

#[derive(Debug, Args)]
pub struct Arguments {
    /// Where to write it; an old key is never overwritten
    #[arg(short, long)]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    write_new_key(&arguments.output)?;
    say!(
        "A new key is in {}: give it to one monitor (node --key) and to who may deploy to it (deploy --key).",
        arguments.output.display()
    );
    Ok(())
}

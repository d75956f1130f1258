//! `nkey`: a secret that a NATS server lets one program in by.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge::deploy::write_secret;

use crate::stream::access::new_seed;

#[derive(Debug, Args)]
pub struct Arguments {
    /// File for the seed; an existing file is never overwritten
    #[arg(short, long)]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (seed, public) = new_seed()?;
    write_secret(&arguments.output, &seed)?;
    println!(
        "A seed is in {}: give it to one program alone (--credentials).\nIts public key, for a user in the server's settings:\n  nkey: {public}",
        arguments.output.display()
    );
    Ok(())
}

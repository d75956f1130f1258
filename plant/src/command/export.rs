//! `export`: a file's days as Parquet.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::{opened, tell};
use crate::export::run as export;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file that a gateway or a collection writes
    store: PathBuf,
    /// Where TABLE/DAY.parquet are to be; days that are there whole are left alone
    folder: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let totals = export(&opened(&arguments.store)?, &arguments.folder, tell)?;
    println!(
        "{} files written with {} rows, {} left as they were.",
        totals.written, totals.rows, totals.left
    );
    Ok(())
}

//! `export`: a file's days as Parquet.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::{opened, tell};
use crate::export::run as export;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file written by `gateway` or `collect`
    store: PathBuf,
    /// Folder for TABLE/DAY.parquet; days that it already has completely are not written again
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

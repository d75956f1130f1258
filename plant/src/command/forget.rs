//! `forget`: old days go from a file.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use jiff::civil::Date;
use jiff::tz::TimeZone;
use rotor_edge::command::Listener;

use super::opened;
use crate::item::Kind;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The file written by `gateway` or `collect`
    store: PathBuf,
    /// First day that is kept, such as 2026-03-01 (UTC)
    #[arg(long, value_name = "DAY")]
    before: Date,
    /// Delete only one kind of data
    #[arg(long, value_parser = clap::builder::PossibleValuesParser::new(Kind::ALL.map(Kind::name)))]
    only: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut store = opened(&arguments.store)?;
    let before_us = arguments.before.to_zoned(TimeZone::UTC)?.timestamp().as_microsecond();
    for kind in Kind::ALL {
        if arguments.only.as_ref().is_none_or(|only| only == kind.name()) {
            let shown = Listener::Terminal.spinner(&format!("looking for old rows of {}", kind.name()));
            let rows = store.forget(kind, before_us)?;
            shown.finish_and_clear();
            println!("{rows:>12} of {}", kind.name());
        }
    }
    println!(
        "are forgotten; the last of each monitor stays. The file is as large as before, and what is free in it is used again."
    );
    Ok(())
}

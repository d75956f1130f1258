//! `manual`: the manual as pages for `man`, one for the program and one for each command.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, Command};
use clap_mangen::Man;

use super::output;
use crate::say;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The folder to write them into, such as ~/.local/share/man/man1
    #[arg(short, long)]
    folder: PathBuf,
}

pub fn run(arguments: &Arguments, mut program: Command) -> Result<()> {
    if !arguments.folder.is_dir() {
        bail!("{}: there is no such folder", arguments.folder.display());
    }
    program.build();
    let name = program.get_name().to_string();
    let pages = program.get_subcommands().filter(|c| c.get_name() != "help").map(|command| {
        let page = format!("{name}-{}", command.get_name());
        (page.clone(), command.clone().name(page.clone()).display_name(page))
    });
    let mut count = 0;
    for (page, command) in std::iter::once((name.clone(), program.clone())).chain(pages) {
        let mut text = Vec::new();
        Man::new(command).render(&mut text)?;
        output::file(&arguments.folder.join(format!("{page}.1")), &text)?;
        count += 1;
    }
    say!("{count} pages are in {}: man {name}", arguments.folder.display());
    Ok(())
}

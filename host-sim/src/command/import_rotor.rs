//! `import-rotor`: a drawing from a rotor that ROSS saved.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::rotor_file::{self, ross};

use super::output::{self, Json};
use crate::answers::imported::ImportedRotorAnswer;
use crate::command::shell;
use crate::render;
use crate::say;
use crate::terminal;

/// Where the drawing goes when nobody says.
const OUTPUT: &str = "rotor.toml";

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// A rotor that ROSS 2.3.0 saved with Rotor.save, .toml or .json
    file: PathBuf,
    /// Where to write the drawing [default: rotor.toml, if there is none yet]
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Json> {
    let path = arguments.output.as_deref().unwrap_or(Path::new(OUTPUT));
    if arguments.output.is_none() && path.exists() {
        bail!("{OUTPUT}: exists already, expected another name with -o");
    }
    let imported = ross::read(&arguments.file)?;
    rotor_file::write(path, &imported.rotor)?;
    let answer = ImportedRotorAnswer::of(&imported, path.into());
    if arguments.json {
        return output::answer(&answer);
    }
    terminal::print(&render::imported::rotor_text(&answer));
    say!("\nNext: look it over\n  rotor-edge check {}", shell::path(path));
    Ok(None)
}

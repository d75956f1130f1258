//! Programs that belong to this one and are not in it: `rotor-edge plant …` is `rotor-edge-plant …`.

use std::ffi::{OsStr, OsString};
use std::io;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use clap::CommandFactory as _;

use super::Cli;

/// Runs the program that the first word names, if it is none of our commands and there is such a program beside this one or on
/// the path; none otherwise.
pub fn run(words: &[OsString]) -> Option<ExitCode> {
    let (word, rest) = words.split_first()?;
    let name = word.to_str().filter(|word| word.starts_with(|c: char| c.is_ascii_lowercase()))?;
    if name.contains(['/', '\\']) || Cli::command().find_subcommand(name).is_some() {
        return None;
    }
    let program = found(&format!("rotor-edge-{name}{}", std::env::consts::EXE_SUFFIX))?;
    let mut command = Command::new(&program);
    command.args(rest);
    Some(given_way_to(&mut command).unwrap_or_else(|error| {
        eprintln!("rotor-edge: {}: cannot be run ({error})", program.display());
        ExitCode::FAILURE
    }))
}

/// This process is the other program from now on, so that signals reach it.
#[cfg(unix)]
fn given_way_to(command: &mut Command) -> io::Result<ExitCode> {
    use std::os::unix::process::CommandExt as _;
    Err(command.exec())
}

#[cfg(not(unix))]
fn given_way_to(command: &mut Command) -> io::Result<ExitCode> {
    let code = command.status()?.code();
    Ok(code.map_or(ExitCode::FAILURE, |code| ExitCode::from(code as u8)))
}

fn found(name: &str) -> Option<PathBuf> {
    let beside = std::env::current_exe().ok().and_then(|own| Some(own.parent()?.join(name)));
    let path = std::env::var_os("PATH");
    let on_path =
        std::env::split_paths(path.as_deref().unwrap_or(OsStr::new(""))).map(|folder| folder.join(name));
    beside.into_iter().chain(on_path).find(|program| program.is_file())
}

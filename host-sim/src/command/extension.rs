//! Programs that belong to this one and are not in it: `rotor-edge plant …` is `rotor-edge-plant …`, and so is
//! `rotor-edge gateway …` where `rotor-edge-plant` has a command of that name.

use std::env::consts::EXE_SUFFIX;
use std::ffi::{OsStr, OsString};
use std::io;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

use clap::CommandFactory as _;

use super::Cli;
use crate::terminal;

const PREFIX: &str = "rotor-edge-";

/// Runs the program that the first word names, or one that has a command of that name, if it is none of our commands and there is
/// such a program beside this one or on the path; none otherwise.
pub fn run(words: &[OsString]) -> Option<ExitCode> {
    let (word, rest) = words.split_first()?;
    let name = word.to_str().filter(|word| word.starts_with(|c: char| c.is_ascii_lowercase()))?;
    if name.contains(['/', '\\']) || Cli::command().find_subcommand(name).is_some() {
        return None;
    }
    let (program, words) = match found(&format!("{PREFIX}{name}{EXE_SUFFIX}")) {
        Some(program) => (program, rest),
        None => (with_command(name)?, words),
    };
    let mut command = Command::new(&program);
    command.args(words);
    Some(given_way_to(&mut command).unwrap_or_else(|error| {
        terminal::tell(&format!("rotor-edge: {}: cannot be run ({error})", program.display()));
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

/// Where programs are looked for: beside this one, and on the path.
fn folders() -> Vec<PathBuf> {
    let beside = std::env::current_exe().ok().and_then(|own| Some(own.parent()?.to_path_buf()));
    let path = std::env::var_os("PATH");
    let on_path = std::env::split_paths(path.as_deref().unwrap_or(OsStr::new("")));
    beside.into_iter().chain(on_path).collect()
}

fn found(name: &str) -> Option<PathBuf> {
    folders().into_iter().map(|folder| folder.join(name)).find(|program| program.is_file())
}

/// The first program of ours that has help on a word: it has a command of that name.
fn with_command(word: &str) -> Option<PathBuf> {
    let is_ours = |program: &PathBuf| {
        let name = program.file_name().and_then(OsStr::to_str).and_then(|name| name.strip_suffix(EXE_SUFFIX));
        name.is_some_and(|name| name.starts_with(PREFIX) && !name.contains('.')) && program.is_file()
    };
    let has_command = |program: &PathBuf| {
        let help = Command::new(program)
            .args(["help", word])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        help.is_ok_and(|status| status.success())
    };
    let mut programs =
        folders().into_iter().filter_map(|folder| folder.read_dir().ok()).flat_map(|entries| {
            let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
            paths.sort();
            paths
        });
    programs.find(|program| is_ours(program) && has_command(program))
}

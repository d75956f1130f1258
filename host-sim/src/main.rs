//! `rotor-edge`: see `rotor-edge --help`.

use std::process::ExitCode;

use rotor_edge::command::{self, Cli, extension};
use rotor_edge::terminal;

fn main() -> ExitCode {
    end_when_nothing_can_be_printed();
    let words: Vec<_> = std::env::args_os().skip(1).collect();
    if let Some(code) = extension::run(&words) {
        return code;
    }
    match Cli::of_this_process().and_then(command::run) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::tell(&format!("rotor-edge: {}", command::shown(&error)));
            ExitCode::FAILURE
        }
    }
}

/// `rotor-edge … | head` closes the pipe early, which is no error of ours; an output that takes nothing any more for
/// another reason, as a full disk, is told.
fn end_when_nothing_can_be_printed() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let said = info.payload().downcast_ref::<String>();
        if let Some(why) = said.and_then(|m| m.strip_prefix("failed printing to stdout: ")) {
            if why.contains("Broken pipe") {
                std::process::exit(0);
            }
            eprintln!("rotor-edge: standard output: cannot be written ({why})");
            std::process::exit(1);
        }
        usual(info);
    }));
}

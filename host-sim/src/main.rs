//! `rotor-edge`: see `rotor-edge --help`.

use std::process::ExitCode;

use clap::Parser;
use rotor_edge::command::{self, Cli};

fn main() -> ExitCode {
    end_quietly_when_nobody_reads();
    match command::run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("rotor-edge: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// `rotor-edge … | head` closes the pipe early; that is no error of ours.
fn end_quietly_when_nobody_reads() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let closed = info.payload().downcast_ref::<String>().is_some_and(|m| m.contains("Broken pipe"));
        if closed {
            std::process::exit(0);
        }
        usual(info);
    }));
}

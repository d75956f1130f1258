//! The command line: `rotor-edge-studio [R.toml DATA.csv]`.

use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, Result, bail};
use clap::Parser;

use crate::recovery::RecoveryFolder;
use crate::server::serve;
use crate::session::Session;
use crate::session::files::{InputFiles, SlowRollInput};
use crate::workbench::Workbench;

/// Try effects on a machine and its measurements, on a page of this computer: see where the model fails, add what is missing, watch
/// the error fall.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Cli {
    /// The rotor, rotor.toml; without files the page offers a sample, and takes files that are dropped on it
    #[arg(requires = "data", conflicts_with = "session")]
    rotor: Option<PathBuf>,
    /// Measurements of this rotor, measured.csv
    data: Option<PathBuf>,
    /// Slow roll to subtract from every reading: a run of the data, or a file [default: the slow rolls of the rotor's file]
    #[arg(long, value_name = "RUN|FILE", requires = "data")]
    slow_roll: Option<String>,
    /// A session that was saved on the page: to go on with it, and to keep it up to date
    #[arg(long, value_name = "FILE")]
    session: Option<PathBuf>,
    /// Port to listen at on this computer [default: one that is free]
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    port: u16,
}

/// Runs until Ctrl-C.
///
/// # Errors
/// One sentence on what is wrong with the files or the port.
pub fn run(cli: &Cli) -> Result<()> {
    let bench = Workbench::default();
    if let Some(folder) = RecoveryFolder::of_user() {
        bench.lock().recover_from(folder);
    }
    if let (Some(rotor), Some(data)) = (&cli.rotor, &cli.data) {
        let slow_roll = SlowRollInput::named(cli.slow_roll.as_deref().unwrap_or_default())?;
        let session = Session::open(InputFiles { slow_roll, ..InputFiles::read(rotor, data)? })?;
        bench.change(|bench| bench.begin(session))?;
    }
    if let Some(path) = &cli.session {
        if !path.exists() {
            bail!(
                "{}: there is no such session; begin one on the page and save it under this name",
                path.display()
            );
        }
        bench.change(|bench| bench.open_session(path))?;
    }
    let stop = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&stop);
    ctrlc::set_handler(move || raised.store(true, Ordering::Relaxed)).context("no handler for Ctrl-C")?;
    serve(&bench, cli.port, &stop, |address| {
        // nobody may be reading
        let _ = writeln!(std::io::stdout(), "{address} is the studio; Ctrl-C ends it.");
        for offer in &bench.lock().offers {
            let _ = writeln!(std::io::stdout(), "{}", offer.sentence);
        }
        let _ = std::io::stdout().flush();
    })?;
    let bench = bench.lock();
    if let Some(session) = bench.session.as_ref().filter(|session| session.is_changed) {
        let next = match bench.is_kept_for_recovery() {
            true => "the next start offers to go on with it",
            false => "save it on the page to go on with it another time",
        };
        let name = &session.files.rotor.name;
        let _ = writeln!(std::io::stderr(), "rotor-edge-studio: the session on {name} ends unsaved; {next}");
    }
    Ok(())
}

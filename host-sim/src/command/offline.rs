//! The commands of the desk: files in, one answer out. No bus, nothing that waits for somebody.

use anyhow::Result;
use clap::Subcommand;

use super::listener::Listener;
use super::output::Json;
use super::{
    add, balance, check, compare, diagnose, estimate, extract, forecast, identify, import, import_rotor,
    improve,
};
use super::{startup, track};

#[derive(Debug, Subcommand)]
pub enum OfflineCommand {
    /// Look a machine over by its drawing alone: loads, critical speeds, modes, unbalance response, doubtful numbers
    Check(check::Arguments),
    /// Measurements from exports of other systems: CSV, TSV, xlsx, xls, ods; shows what it takes each column for
    Import(Box<import::Arguments>),
    /// 1x readings from raw samples of probes and keyphasor (CSV, WAV, npy, npz, mat), by the controller's own extraction
    Extract(Box<extract::Arguments>),
    /// A drawing from a rotor that ROSS saved, and what could not be carried over
    ImportRotor(import_rotor::Arguments),
    /// Hold a model against measurements: where it misses, and whether that is noise or physics
    Compare(compare::Arguments),
    /// Say which physical effect is missing in a model, or which measurement would tell
    Diagnose(diagnose::Arguments),
    /// Fit one effect together with bearings and planes and write the better model
    Add(add::Arguments),
    /// Diagnose and add until the model is adequate
    Improve(improve::Arguments),
    /// Phase I: bearings and unbalance of a machine's first days
    Identify(identify::Arguments),
    /// The unbalance of each run relative to a base run, from runs with stated weights
    Estimate(estimate::Arguments),
    /// Follow the unbalance of a long record while bearings change
    Track(Box<track::Arguments>),
    /// Where the unbalance of a track is going
    Forecast(forecast::Arguments),
    /// A single-disk rotor from its start-up: the simple model, where it fails, and which effects mend it
    Startup(startup::Arguments),
    /// Correction weights, from the identified model and from trial runs alone
    Balance(Box<balance::Arguments>),
}

impl OfflineCommand {
    /// Runs it; `forced` writes over what is read.
    pub fn run(&self, forced: bool, listener: Listener) -> Result<Json> {
        match self {
            Self::Check(arguments) => check::run(arguments, listener),
            Self::Import(arguments) => import::run(arguments, forced),
            Self::Extract(arguments) => extract::run(arguments, forced, listener),
            Self::ImportRotor(arguments) => import_rotor::run(arguments),
            Self::Compare(arguments) => compare::run(arguments, listener),
            Self::Diagnose(arguments) => diagnose::run(arguments, listener),
            Self::Add(arguments) => add::run(arguments),
            Self::Improve(arguments) => improve::run(arguments, listener),
            Self::Identify(arguments) => identify::run(arguments, listener),
            Self::Estimate(arguments) => estimate::run(arguments, listener),
            Self::Track(arguments) => track::run(arguments, listener),
            Self::Forecast(arguments) => forecast::run(arguments, listener),
            Self::Startup(arguments) => startup::run(arguments, listener),
            Self::Balance(arguments) => balance::run(arguments, listener),
        }
    }
}

//! The commands of the desk: files in, one answer out. No bus, nothing that waits for somebody.

use anyhow::Result;
use clap::Subcommand;

use super::listener::Listener;
use super::output::Json;
use super::{
    add, balance, check, compare, diagnose, estimate, extract, forecast, identify, import, import_rotor,
    improve,
};
use super::{plan, simulate, startup, track};

#[derive(Debug, Subcommand)]
pub enum OfflineCommand {
    /// Check a machine from its drawing alone: loads, critical speeds, modes, unbalance response, implausible values
    Check(check::Arguments),
    /// Predict what a measurement could show: detectable effects and sizes, accuracy of the unbalance, and the best further
    /// measurement
    Plan(plan::Arguments),
    /// Convert exports of other systems (CSV, TSV, xlsx, xls, ods) to measurements, and show the meaning of each
    /// column
    Import(Box<import::Arguments>),
    /// Extract 1x readings from raw samples of probes and keyphasor (CSV, WAV, npy, npz, mat), as the controller does
    Extract(Box<extract::Arguments>),
    /// Convert a rotor that ROSS saved to a rotor file, and list everything that is lost
    ImportRotor(import_rotor::Arguments),
    /// Simulate what the probes of a machine would show, with known or hidden effects
    Simulate(Box<simulate::Arguments>),
    /// Compare a model with measurements: where they differ, and whether noise explains it
    Compare(compare::Arguments),
    /// Find the physical effect that a model lacks, or the measurement that would show it
    Diagnose(diagnose::Arguments),
    /// Fit one effect together with bearings and planes and write the better model
    Add(add::Arguments),
    /// Diagnose and add until the model is adequate
    Improve(improve::Arguments),
    /// Identify bearings and unbalance from a machine's first days (phase I)
    Identify(identify::Arguments),
    /// Estimate the unbalance of each run relative to a base run, from runs with stated weights
    Estimate(estimate::Arguments),
    /// Follow the unbalance of a long record while bearings change
    Track(Box<track::Arguments>),
    /// Forecast the unbalance of a track
    Forecast(forecast::Arguments),
    /// Evaluate the start-up of a single-disk rotor: a simple model, its errors, and the effects that remove them
    Startup(startup::Arguments),
    /// Compute correction weights, from the identified model and from trial runs alone
    Balance(Box<balance::Arguments>),
}

impl OfflineCommand {
    /// Runs it; `forced` writes over what is read.
    pub fn run(&self, forced: bool, listener: Listener) -> Result<Json> {
        match self {
            Self::Check(arguments) => check::run(arguments, listener),
            Self::Plan(arguments) => plan::run(arguments, listener),
            Self::Import(arguments) => import::run(arguments, forced),
            Self::Extract(arguments) => extract::run(arguments, forced, listener),
            Self::ImportRotor(arguments) => import_rotor::run(arguments),
            Self::Simulate(arguments) => simulate::run(arguments, listener),
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

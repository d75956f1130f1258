//! `balance --trial-only`: correction weights without a rotor's file.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use rotor_edge_desktop::balance::alone::library::Library;
use rotor_edge_desktop::balance::alone::{CorrectionRequest, MachineInfluence, amplitudes, correct, runs};
use rotor_edge_desktop::measurement;

use super::Arguments;
use crate::answers::balance::{AngleSense, TrialBalance};
use crate::command::output::{self, Json};
use crate::ingest::readings::amplitudes as without_phase;
use crate::ingest::weights;
use crate::render;
use crate::terminal;

/// What the command line asks where there is no rotor's file.
#[derive(Debug, Args)]
pub struct Options {
    /// Without a rotor's file: runs with trial weights, measured.csv, amplitudes in any one unit (<probe>_cos_<unit>); or a
    /// table of amplitudes without phase
    #[arg(long, value_name = "DATA", conflicts_with_all = ["rotor", "data"])]
    trial_only: Option<PathBuf>,
    /// Weights of each run: run,plane,magnitude_g_mm,angle_deg, or magnitude_oz_in, magnitude_g and the like; a run without any
    /// is the base
    #[arg(long, value_name = "FILE", requires = "trial_only", conflicts_with = "coefficients")]
    weights: Option<PathBuf>,
    /// Influence coefficients of the machine from earlier runs: one run is then enough
    #[arg(long, value_name = "FILE", requires = "trial_only")]
    coefficients: Option<PathBuf>,
    /// Write the influence coefficients of these runs for later use
    #[arg(long, value_name = "FILE", requires = "weights")]
    write_coefficients: Option<PathBuf>,
    /// Trim balance: weights to add to those of this run, from its vibration [default: to the machine without trial weights]
    #[arg(long, value_name = "RUN", requires = "weights")]
    onto: Option<String>,
    /// Standard deviation of a reading's components, relative to it [default: from repeats]
    #[arg(long, value_name = "RELATIVE", requires = "trial_only")]
    noise_relative: Option<f64>,
    /// Standard deviation of a reading's components at zero amplitude, in the unit of the data
    #[arg(long, value_name = "X", requires = "trial_only")]
    noise_floor: Option<f64>,
}

pub fn run(arguments: &Arguments) -> Result<Json> {
    let options = &arguments.alone;
    let Some(data) = &options.trial_only else { bail!("expected a rotor and its data, or --trial-only") };
    if !arguments.runout.to_string().is_empty() {
        bail!("--slow-roll needs a rotor's file; without one, take the slow roll off the data before");
    }
    let request = request(arguments)?;
    let machine = machine(data, arguments, &request)?;
    let correction = correct(&machine, &request).with_context(|| data.display().to_string())?;
    let answer = TrialBalance::of(
        &correction,
        request.wanted.criterion,
        options.onto.clone(),
        AngleSense::of(arguments.against_rotation),
        options.coefficients.is_some(),
    );
    if let Some(path) = &arguments.form.report {
        let title = format!("{}: balance", data.file_stem().unwrap_or_default().to_string_lossy());
        let story = render::trial_balance::story(&answer, request.wanted.holes.as_ref());
        output::story(path, &title, &story, vec![render::trial_balance::section(&answer)])?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::trial_balance::text(&answer));
    Ok(None)
}

/// The machine by its trial runs, which are kept if that is wanted, or by what was kept of it.
fn machine(data: &Path, arguments: &Arguments, request: &CorrectionRequest) -> Result<MachineInfluence> {
    let options = &arguments.alone;
    let of_data = || data.display().to_string();
    match (&options.weights, &options.coefficients) {
        (Some(weights), _) => {
            let weights = weights::read(weights, arguments.against_rotation)?;
            let machine = match runs::read(data, &weights) {
                Ok(series) => runs::machine(&series, &weights, request),
                Err(why) => {
                    let Some(series) = without_phase::read(data)? else { return Err(why.into()) };
                    runs::check(&series, data, &weights)?;
                    amplitudes::machine(&series, &weights, request)
                }
            }
            .with_context(of_data)?;
            if let Some(path) = &options.write_coefficients {
                if machine.sets.is_some() {
                    bail!(
                        "{}: the trial weights are in fixed proportions over the planes, expected a run with a weight in each plane for \
                         --write-coefficients",
                        weights.file
                    );
                }
                let library = Library::of(&machine, vec![of_data(), weights.file.clone()]);
                output::file(path, library.text()?.as_bytes())?;
            }
            Ok(machine)
        }
        (None, Some(coefficients)) => {
            let library = Library::read(coefficients)?;
            let series = measurement::read_series(data, |_| Ok(()))?;
            library.machine(&series, request).with_context(of_data)
        }
        (None, None) => bail!(
            "--trial-only needs the trial weights (--weights FILE) or earlier coefficients of the machine (--coefficients FILE)"
        ),
    }
}

fn request(arguments: &Arguments) -> Result<CorrectionRequest> {
    let options = &arguments.alone;
    let noise = [options.noise_relative, options.noise_floor];
    for (name, value) in ["--noise-relative", "--noise-floor"].iter().zip(noise) {
        if value.is_some_and(|v| !(v >= 0.0 && v.is_finite())) {
            bail!("{name} must be a number from 0 on");
        }
    }
    let stated = noise.iter().any(Option::is_some).then(|| noise.map(|v| v.unwrap_or(0.0)));
    if stated.is_some_and(|[relative, floor]| relative + floor == 0.0) {
        bail!("the noise is stated as 0, expected --noise-relative or --noise-floor above 0");
    }
    Ok(CorrectionRequest {
        planes: arguments.planes.clone(),
        wanted: arguments.fitting.wanted(arguments.against_rotation)?,
        range_rpm: arguments.range,
        same_speed: arguments.same_speed,
        interpolate: arguments.interpolate,
        noise: stated,
        onto: options.onto.clone(),
    })
}

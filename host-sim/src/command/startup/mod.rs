//! `startup`: a single-disk rotor from its start-up, where the simple model holds, and where and why it
//! fails.

mod json;
pub mod text;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use nalgebra::Complex;
use rotor_edge_desktop::Error;
use rotor_edge_desktop::machine::rotor_file;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::startup::chain::{Chain, Stage, chain, simple_stages};
use rotor_edge_desktop::startup::series::Run;
use rotor_edge_desktop::startup::{Options, PAPER_CLEARANCE_UM, PAPER_SPEEDS_RPM, Startup, startup};

use super::output;
use crate::report::startup_sections;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor with its one disk, rotor.toml
    rotor: PathBuf,
    /// Its start-ups, startup.csv
    data: PathBuf,
    /// Clearance of the bearings, µm; errors are given in percent of it [default: 127, 5 mil]
    #[arg(long)]
    clearance_um: Option<f64>,
    /// Mass of the two-degree model, kg [default: the disk's, as in the paper]
    #[arg(long)]
    mass_kg: Option<f64>,
    /// Speeds at which orbits and errors are given, rpm
    #[arg(long, value_delimiter = ',', default_values_t = PAPER_SPEEDS_RPM)]
    speeds: Vec<f64>,
    /// Speeds between which errors are summed up, rpm, as in 600..4200
    #[arg(long, default_value = "600..4200", value_parser = range)]
    range: [f64; 2],
    /// Where to write the improved model
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    runout: output::Runout,
    #[command(flatten)]
    form: output::Form,
}

/// A range of speeds on the command line.
pub fn range(text: &str) -> Result<[f64; 2], String> {
    let bounds = text.split_once("..").and_then(|(a, b)| Some([a.parse().ok()?, b.parse().ok()?]));
    match bounds {
        Some([from, to]) if 0.0 < from && from < to => Ok([from, to]),
        _ => Err(format!("\"{text}\" is not a range of speeds, expected for example 600..4200")),
    }
}

/// A start-up, evaluated, and what the answers are measured in.
pub struct Answer {
    /// The readings.
    pub readings: Vec<Reading>,
    /// The simple model.
    pub found: Startup,
    /// The models, from the simple one on.
    pub stages: Vec<Stage>,
    /// The rotor model, where one could be fitted.
    pub chain: Option<Chain>,
    /// Clearance that errors are given in percent of, µm.
    pub clearance_um: f64,
    /// Whether nobody stated it.
    pub clearance_assumed: bool,
    /// Names of the bearings.
    pub bearings: [String; 2],
    /// Speeds of interest, rpm.
    pub speeds_rpm: Vec<f64>,
    /// Range that errors are summed up over, rpm.
    pub range_rpm: [f64; 2],
    /// Runs whose weights are not known.
    pub unknown_weights: Vec<String>,
    /// What could not be done or was assumed, one sentence each.
    pub remarks: Vec<String>,
}

impl Answer {
    /// An error in percent of the clearance.
    pub fn percent(&self, error_m: f64) -> f64 {
        error_m * 1e8 / self.clearance_um
    }

    /// The disk's own unbalance: of the last model in one plane, or of the two-degree model, kg·m.
    pub fn own_kg_m(&self) -> Option<Complex<f64>> {
        match self.chain.as_ref().map(|c| c.unbalance_kg_m.as_slice()) {
            Some([(one, _)]) => Some(*one),
            _ => self.found.own_kg_m.map(|own| own.unbalance_kg_m),
        }
    }

    /// Whether the weights of a run are known.
    pub fn is_known(&self, run: &Run) -> bool {
        !self.unknown_weights.iter().any(|u| u == run.label())
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    for (name, value) in [("--clearance-um", arguments.clearance_um), ("--mass-kg", arguments.mass_kg)] {
        if value.is_some_and(|v| !(v > 0.0 && v.is_finite())) {
            bail!("{name} must be a positive number");
        }
    }
    let (rotor, unknown_weights) = rotor_file::read_allowing_unstated_angles(&arguments.rotor)?;
    let readings = arguments.runout.read(&arguments.data, &rotor)?;
    let options = Options { mass_kg: arguments.mass_kg, unknown_weights };
    let working = output::spinner("start-up");
    let found = startup(&rotor, &readings, &options)
        .map_err(|e| Error::Unsuitable(format!("{}: {e}", arguments.data.display())))?;
    working.set_message("diagnosis");
    let tried = chain(&rotor, &readings, &found, &options, |label| working.set_message(format!("+ {label}")));
    working.finish_and_clear();
    let mut remarks = found.remarks.clone();
    if arguments.clearance_um.is_none() {
        remarks.push(format!(
            "No clearance is given: percentages are of {PAPER_CLEARANCE_UM:.0} µm, the paper's 5 mil; --clearance-um \
             states yours."
        ));
    }
    for speed in &arguments.speeds {
        if !found.runs.iter().any(|r| r.nearest(&readings, *speed).is_some()) {
            remarks.push(format!("No run has a reading at {speed:.0} rpm, so no error is given there."));
        }
    }
    let (stages, chain) = match tried {
        Ok(chain) => (chain.stages.clone(), Some(chain)),
        Err(why) => {
            remarks.push(format!("The rotor model was not fitted: {why}."));
            (simple_stages(&found, &readings, &options), None)
        }
    };
    let answer = Answer {
        readings,
        found,
        stages,
        chain,
        clearance_um: arguments.clearance_um.unwrap_or(PAPER_CLEARANCE_UM),
        clearance_assumed: arguments.clearance_um.is_none(),
        bearings: [rotor.bearing[0].name.clone(), rotor.bearing[1].name.clone()],
        speeds_rpm: arguments.speeds.clone(),
        range_rpm: arguments.range,
        unknown_weights: options.unknown_weights,
        remarks,
    };
    if let Some(path) = &arguments.output {
        let Some(chain) = &answer.chain else {
            bail!("there is no improved model to write: {}", answer.remarks[answer.remarks.len() - 1])
        };
        rotor_file::write(path, &chain.outcome.rotor)?;
    }
    if let Some(path) = &arguments.form.report {
        output::report(path, &format!("{}: start-up", rotor.name), startup_sections(&answer))?;
    }
    if arguments.form.json {
        return output::json(&json::of(&answer));
    }
    text::print(&answer);
    if let Some(path) = &arguments.output {
        println!(
            "\nImproved model written to {}. Next: rotor-edge balance {0} {}{}",
            path.display(),
            arguments.data.display(),
            arguments.runout
        );
    }
    Ok(())
}

//! `startup`: a single-disk rotor from its start-up, where the simple model holds, and where and why it
//! fails.

use std::path::PathBuf;

use anyhow::{Context as _, Result, bail};
use clap::Args;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::startup::refinement::{refine, simple_stages};
use rotor_edge_desktop::startup::{Options, PAPER_CLEARANCE_UM, PAPER_SPEEDS_RPM, startup};

use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::startup::{EvaluatedStartup, StartupAnswer};
use crate::command::shell;
use crate::render;
use crate::say;
use crate::terminal;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor with its one disk, rotor.toml
    rotor: PathBuf,
    /// Start-ups of this rotor, startup.csv
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

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    for (name, value) in [("--clearance-um", arguments.clearance_um), ("--mass-kg", arguments.mass_kg)] {
        if value.is_some_and(|v| !(v > 0.0 && v.is_finite())) {
            bail!("{name} must be a positive number");
        }
    }
    let (rotor, unknown_weights) = rotor_file::read_allowing_unstated_angles(&arguments.rotor)?;
    let readings = arguments.runout.read(&arguments.data, &rotor)?;
    let options = Options { mass_kg: arguments.mass_kg, unknown_weights };
    let working = listener.spinner("start-up");
    let found = startup(&rotor, &readings, &options).with_context(|| arguments.data.display().to_string())?;
    working.finish_and_clear();
    let (working, hear) = listener.search("effects and sets of them tried");
    let mut added = 0;
    let tried = refine(&rotor, &readings, &found, &options, &hear, |label| {
        added += 1;
        listener.step(added, None);
        working.set_message(format!("+ {label}"));
    });
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
    let evaluated = EvaluatedStartup {
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
        let Some(chain) = &evaluated.chain else {
            bail!("there is no improved model to write: {}", evaluated.remarks[evaluated.remarks.len() - 1])
        };
        rotor_file::write(path, &chain.outcome.rotor)?;
    }
    let answer = StartupAnswer::from(&evaluated);
    if let Some(path) = &arguments.form.report {
        let story = render::startup::story(&answer, &evaluated, next(arguments));
        let sections = render::startup::sections(&answer, &evaluated);
        output::story(path, &format!("{}: start-up", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::startup::text(&answer, &evaluated));
    if let Some(path) = &arguments.output {
        say!("\nImproved model written to {}.", path.display());
    }
    output::say_next(&next(arguments));
    Ok(None)
}

/// What to do, and the command for it.
fn next(arguments: &Arguments) -> output::Next {
    let Some(path) = &arguments.output else {
        return (
            "the same with -o better.toml, and then correction weights with rotor-edge balance".into(),
            None,
        );
    };
    let command = format!(
        "rotor-edge balance {} {}{}",
        shell::path(path),
        shell::path(&arguments.data),
        arguments.runout
    );
    ("find the correction weights".into(), Some(command))
}

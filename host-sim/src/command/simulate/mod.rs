//! `simulate`: what the probes of a machine would show.

mod effects;
mod report;
mod runs;

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::Args;
use nalgebra::Complex;
use rotor_edge_desktop::machine::drawing::{Noise, Rotor};
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::simulate::{Simulation, SimulationRequest, simulate};

use super::listener::Listener;
use super::notation::{self, Speeds, TrialWeight};
use super::output::{self, Json};
use super::shell;
use crate::answers;
use crate::answers::simulate::{SimulationAnswer, TruthAnswer};
use crate::render;
use crate::terminal;
use effects::Effects;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml
    rotor: PathBuf,
    /// Where to write the readings
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    effects: Effects,
    /// Speeds of every run, rpm, as in 600..6000:40 or 3000,3600 [default: 40 up to the fastest rated speed, else past
    /// the second critical speed]
    #[arg(long, value_name = "A..B:N", value_parser = notation::speeds)]
    speeds: Option<Speeds>,
    /// A run with a trial weight, g·mm and degrees, beside the runs of the rotor's file; repeat it for more weights and runs
    #[arg(long, value_name = "RUN:PLANE=SIZE@ANGLE", value_parser = notation::weight)]
    weight: Vec<TrialWeight>,
    /// The same as a table: run,plane,magnitude_g_mm,angle_deg
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Unbalance of a plane, g·mm and degrees [default: as the rotor's file states it, else a share of what the balance grade
    /// permits, G 6.3 if none is stated, at an angle by the seed]
    #[arg(long, value_name = "PLANE=SIZE@ANGLE", value_parser = notation::unbalance)]
    unbalance: Vec<(String, Complex<f64>)>,
    /// Standard deviation of each component: a part of the amplitude, and µm 0-pk [default: as the rotor's file states it,
    /// else 2 %, and 2 % of the median amplitude]
    #[arg(long, value_name = "RELATIVE,FLOOR_UM", value_parser = notation::noise)]
    noise: Option<Noise>,
    /// Seed of the noise and of angles that are not stated
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Simulate a machine that differs from its drawing, at random within [tolerance] or the usual tolerances
    #[arg(long, value_name = "SEED")]
    drawing_error: Option<u64>,
    /// Add an effect of random kind, place and size, which only --truth reveals
    #[arg(long, value_name = "SEED")]
    hide: Option<u64>,
    /// Write the true effects and unbalance as JSON
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Write the rotor file with the runs of --weight and --weights, for use with the data
    #[arg(long, value_name = "FILE")]
    write_rotor: Option<PathBuf>,
    #[command(flatten)]
    form: output::Form,
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let file = rotor_file::read(&arguments.rotor)?;
    let rotor = runs::with_runs(&file, &arguments.weight, arguments.weights.as_deref())?;
    rotor.validate()?;
    let working = listener.spinner("simulating readings");
    let found = simulate(&rotor, &arguments.request()).with_context(|| arguments.rotor.display().to_string());
    working.finish_and_clear();
    let found = found?;
    let truth = TruthAnswer::of(&rotor, &found, &arguments.request());
    let remarks = arguments.remarks(&file, &rotor, &found);
    let answer = SimulationAnswer::of(&rotor, &found, arguments.output.clone(), &truth, remarks);
    if let Some(path) = &arguments.write_rotor {
        rotor_file::write(path, &rotor)?;
    }
    if let Some(path) = &arguments.truth {
        let text = serde_json::to_string_pretty(&answers::object(&truth)?)?;
        output::file(path, format!("{text}\n").as_bytes())?;
    }
    output::file(&arguments.output, &measured(&rotor, &found)?)?;
    if let Some(path) = &arguments.form.report {
        let title = format!("{}: simulated readings", rotor.name);
        let (story, sections) = report::report(&answer, &rotor, &found, arguments.next(&found));
        output::story(path, &title, &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::simulate::text(&answer));
    output::say_next(&arguments.next(&found));
    Ok(None)
}

impl Arguments {
    fn request(&self) -> SimulationRequest {
        SimulationRequest {
            effects: self.effects.0.clone(),
            speeds_rpm: self.speeds.as_ref().map_or_else(Vec::new, |speeds| speeds.0.clone()),
            unbalance_kg_m: self.unbalance.clone(),
            noise: self.noise,
            seed: self.seed,
            drawing_seed: self.drawing_error,
            hidden_seed: self.hide,
        }
    }

    /// What a reader must know before the readings are used.
    fn remarks(&self, file: &Rotor, rotor: &Rotor, found: &Simulation) -> Vec<String> {
        let mut remarks = Vec::new();
        if let Some(from) = found.unstable_from_rpm {
            remarks.push(format!(
                "A mode of this machine grows from {from:.0} rpm on: a real one would whirl there and not show these readings."
            ));
        }
        if file.run.len() != rotor.run.len() && self.write_rotor.is_none() {
            remarks.push(
                "The rotor's file does not list the runs of the trial weights; --write-rotor FILE writes one that does.".into(),
            );
        }
        if let (Some(_), None) = (self.hide, &self.truth) {
            remarks.push(
                "The hidden effect is written nowhere; the same command with --truth FILE tells it.".into(),
            );
        }
        remarks
    }

    /// What to do, and the command for it.
    fn next(&self, found: &Simulation) -> output::Next {
        let rotor = self.write_rotor.as_ref().unwrap_or(&self.rotor);
        let files = format!("{} {}", shell::path(rotor), shell::path(&self.output));
        let is_missing = found.hidden.is_some() || !found.effects.is_empty();
        match is_missing {
            true => {
                ("find the effect that the model lacks".into(), Some(format!("rotor-edge diagnose {files}")))
            }
            false => {
                ("hold the model against the readings".into(), Some(format!("rotor-edge compare {files}")))
            }
        }
    }
}

/// The whole file of readings; in its first line, that no machine gave them.
///
/// # Errors
/// If a reading is none that a file can hold.
pub fn measured(rotor: &Rotor, found: &Simulation) -> Result<Vec<u8>> {
    let name: String = rotor.name.chars().filter(|c| !c.is_control()).collect();
    let mut file = format!("# simulated readings of {name}, by rotor-edge simulate\n").into_bytes();
    let names: Vec<&str> = rotor.probe.iter().map(|probe| probe.name.as_str()).collect();
    measurement::write_exactly(&mut file, &names, &found.readings)?;
    Ok(file)
}

//! What commands print: tables for people, one JSON object for programs, progress for the patient.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rotor_edge_desktop::Error;
use rotor_edge_desktop::diagnose::best_fit;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, DayOfDate, Reading, Record, SlowRoll};
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::whole_file;
use serde::Serialize;

use super::{glossary, provenance, shell};
use crate::answers;
use crate::render::{Section, Story, page};
use crate::terminal;

/// The form in which a command answers.
#[derive(Debug, Args)]
pub struct Form {
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
    /// Write a report with figures: one HTML page that works offline
    #[arg(long)]
    pub report: Option<PathBuf>,
}

/// Tells what happens meanwhile on standard error; that nobody may be there to read it stops nothing.
pub fn tell(what: &str) {
    terminal::tell(&format!("rotor-edge: {what}"));
}

/// A rotor and what was measured on it.
pub fn read(rotor: &Path, data: &Path, runout: &Runout) -> Result<(Rotor, Vec<Reading>)> {
    let rotor = rotor_file::read(rotor)?;
    let readings = runout.read(data, &rotor)?;
    Ok((rotor, readings))
}

/// A machine and measurements of it, as most commands take them.
#[derive(Debug, Args)]
pub struct Measured {
    /// The rotor, rotor.toml
    pub rotor: PathBuf,
    /// Measurements of this rotor, measured.csv
    pub data: PathBuf,
    #[command(flatten)]
    pub runout: Runout,
}

impl Measured {
    pub fn read(&self) -> Result<(Rotor, Vec<Reading>)> {
        read(&self.rotor, &self.data, &self.runout)
    }

    /// What came of the readings; the file that holds them is named in the sentence on why nothing did.
    pub fn named<T>(&self, result: Result<T, Error>) -> Result<T> {
        about(&self.data, result)
    }

    /// The same without some probes.
    pub fn read_without(&self, probes: &[String]) -> Result<(Rotor, Vec<Reading>)> {
        let rotor = rotor_file::read(&self.rotor)?.without_probes(probes)?;
        let readings = self.runout.read(&self.data, &rotor)?;
        Ok((rotor, readings))
    }
}

/// What came of a file's contents; a refusal that does not name the file gets its name.
pub fn about<T>(path: &Path, result: Result<T, impl std::error::Error + Send + Sync + 'static>) -> Result<T> {
    let name = path.display().to_string();
    result.map_err(|error| match error.to_string().contains(&name) {
        true => error.into(),
        false => anyhow::Error::new(error).context(name),
    })
}

/// How the runout of the probes is known.
#[derive(Debug, Default, Args)]
pub struct Runout {
    /// Slow roll to subtract from every reading: a run of the data, or a file [default: the slow rolls of the rotor's
    /// file]
    #[arg(long, value_name = "RUN|FILE")]
    slow_roll: Option<String>,
}

impl fmt::Display for Runout {
    /// As it continues a command line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.slow_roll
            .as_ref()
            .map_or(Ok(()), |slow_roll| write!(f, " --slow-roll {}", shell::word(slow_roll)))
    }
}

impl Runout {
    /// Reads a measurement, less the runout.
    pub fn read(&self, data: &Path, rotor: &Rotor) -> Result<Vec<Reading>> {
        Ok(measurement::read_less(data, rotor, &self.taken_off())?)
    }

    /// The same where runs that the rotor's file does not list are blind.
    pub fn read_with_blind_runs(&self, data: &Path, rotor: &Rotor) -> Result<Vec<Reading>> {
        Ok(measurement::read_with_blind_runs(data, rotor, &self.taken_off())?)
    }

    /// Reads a record over days, less the runout.
    pub fn read_record(&self, data: &Path, rotor: &Rotor, days: &DayOfDate) -> Result<Record> {
        Ok(measurement::read_record(data, rotor, &self.taken_off(), days)?)
    }

    /// Reads a measurement whose times may be dates, less the runout.
    pub fn read_dated(&self, data: &Path, rotor: &Rotor, days: &DayOfDate) -> Result<Vec<Reading>> {
        Ok(measurement::read_dated(data, rotor, &self.taken_off(), days)?)
    }

    fn taken_off(&self) -> SlowRoll {
        self.slow_roll.as_deref().map_or(SlowRoll::Stated, SlowRoll::named)
    }
}

/// Writes a model that its own data do not refuse, as [`model`] does.
pub fn model_of_its_data(path: &Path, rotor: &Rotor, readings: &[Reading]) -> Result<()> {
    if let Err(why) = best_fit(rotor, readings) {
        bail!("no model is written, because its own data contradict it: {why}");
    }
    model(path, rotor, readings)
}

/// Writes a model that was fitted to `readings`, whole or not at all.
pub fn model(path: &Path, rotor: &Rotor, readings: &[Reading]) -> Result<()> {
    Ok(rotor_file::write(path, &fitted_model(rotor, readings))?)
}

/// A model that was fitted to `readings`, as it is written.
pub fn fitted_model(rotor: &Rotor, readings: &[Reading]) -> Rotor {
    let fastest_rpm = readings.iter().map(|r| r.speed_rpm).fold(rotor.fastest_rpm.unwrap_or(0.0), f64::max);
    Rotor { fastest_rpm: Some(fastest_rpm), ..rotor.clone() }
}

/// What a command leaves to be printed: one JSON object where that was asked for; text it has printed itself.
pub type Json = Option<String>;

/// An answer as one JSON object with its keys in alphabetical order.
pub fn answer(answer: &impl Serialize) -> Result<Json> {
    as_json(&answers::object(answer)?)
}

/// The same with its keys in the order of the type.
pub fn answer_in_order(answer: &impl Serialize) -> Result<Json> {
    as_json(answer)
}

/// One JSON object, to be printed by whoever ran the command.
pub fn as_json(value: &impl Serialize) -> Result<Json> {
    Ok(Some(serde_json::to_string_pretty(value)?))
}

/// Prints one JSON object on standard output.
pub fn json(value: &impl Serialize) -> Result<()> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}

/// A progress bar on standard error; nothing where that is not a terminal.
pub fn progress(what: &str, steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64);
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta} left");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.set_message(what.to_string());
    bar
}

/// A sign of life for work of unknown length.
pub fn spinner(what: &str) -> ProgressBar {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
        bar.set_style(style);
    }
    bar.set_message(what.to_string());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

/// Whether a command that never writes over a file may write these; `forced` if it may in any case.
pub fn refuse_what_exists<'a>(targets: impl IntoIterator<Item = &'a PathBuf>, forced: bool) -> Result<()> {
    match targets.into_iter().find(|path| !forced && path.exists()) {
        Some(path) => bail!("{}: exists already, expected another name or --force", path.display()),
        None => Ok(()),
    }
}

/// What to do after a command, in words that begin with a small letter, and the command that does it.
pub type Next = (String, Option<String>);

/// Tells on standard output what to do next.
pub fn say_next((words, command): &Next) {
    terminal::print(&format!(
        "\nNext: {words}{}\n",
        command.as_ref().map_or(String::new(), |command| format!("\n  {command}"))
    ));
}

/// Writes a report that begins with a story, whole or not at all.
pub fn story(path: &Path, title: &str, story: &Story, mut sections: Vec<Section>) -> Result<()> {
    sections.push(provenance::section(path));
    file(path, page(title, Some(story), &sections, glossary::said_in).as_bytes())?;
    tell(&format!("{} holds the report; open it in a browser", path.display()));
    Ok(())
}

/// Writes a file, whole or not at all.
pub fn file(path: &Path, contents: &[u8]) -> Result<()> {
    Ok(whole_file::write(path, contents)?)
}

//! `identify`: phase I on the first days of a record.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::Args;
use rotor_edge_desktop::identify::{PhaseOne, PhaseOneConfig, beside_runup, identify};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::rotor_file;

use super::diagnose::fitted::{self, Fitted};
use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::identify::Identification;
use crate::command::shell;
use crate::render;
use crate::say;
use crate::terminal;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml
    rotor: PathBuf,
    /// Record of this rotor, measured.csv
    record: PathBuf,
    /// Days that phase I uses, first and last, as in 0..2; rows where the record has no days
    #[arg(long, default_value = "0..2")]
    days: Days,
    /// A run-up in the same state of the machine, fitted together with the days
    #[arg(long)]
    runup: Option<PathBuf>,
    /// Seed of the particle swarm
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Where to write the identified rotor
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    runout: output::Runout,
    #[command(flatten)]
    form: output::Form,
}

/// First and last day, both included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Days {
    first: f64,
    last: f64,
}

impl Days {
    /// The first three readings that phase I of the paper uses.
    pub const FIRST_THREE: Self = Self { first: 0.0, last: 2.0 };

    /// The complete readings of these days, counted from the record's first day.
    ///
    /// # Errors
    /// If there are none.
    pub fn select<'a>(&self, record: &'a [Reading]) -> Result<Vec<&'a Reading>> {
        let inside = |(row, r): &(usize, &Reading)| {
            let day = r.time_d.unwrap_or(*row as f64);
            (self.first..=self.last).contains(&day)
        };
        let chosen: Vec<&Reading> = record
            .iter()
            .enumerate()
            .filter(inside)
            .map(|(_, r)| r)
            .filter(|r| r.complete().is_some())
            .collect();
        if chosen.is_empty() {
            bail!(
                "there is no complete reading on days {} to {}, expected one at least",
                self.first,
                self.last
            );
        }
        Ok(chosen)
    }
}

impl FromStr for Days {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let bounds = text.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        match bounds {
            Some((first, last)) if first <= last => Ok(Self { first, last }),
            _ => Err(format!("\"{text}\" is not a range of days, expected for example 0..2")),
        }
    }
}

/// Phase I on chosen days and perhaps a run-up.
pub fn phase_one(
    rotor: &Rotor,
    days: &[&Reading],
    runup: Option<&[Reading]>,
    seed: u64,
    listener: Listener,
) -> Result<PhaseOne> {
    let readings = beside_runup(rotor, days.iter().copied(), runup.unwrap_or_default());
    let working = listener.spinner("phase I");
    let found = identify(rotor, &readings, &PhaseOneConfig { seed, ..PhaseOneConfig::default() });
    working.finish_and_clear();
    Ok(found?)
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let rotor = rotor_file::read(&arguments.rotor)?;
    let record = arguments.runout.read(&arguments.record, &rotor)?;
    let runup = arguments.runup.as_deref().map(|path| arguments.runout.read(path, &rotor)).transpose()?;
    let days = arguments.days.select(&record).with_context(|| arguments.record.display().to_string())?;
    let found = phase_one(&rotor, &days, runup.as_deref(), arguments.seed, listener)?;
    let readings = beside_runup(&rotor, days.iter().copied(), runup.as_deref().unwrap_or_default());
    output::model(&arguments.output, &found.rotor, &readings)?;
    let answer = Identification::from(&found);
    let next = arguments.next();
    if let Some(path) = &arguments.form.report {
        let fit = Fitted::new("as identified", &found.rotor, &readings)?;
        let drawn = fitted::curves(std::slice::from_ref(&fit), &readings);
        let story = render::identify::story(&answer, &drawn, next.clone());
        let mut sections = vec![render::identify::section(&answer)];
        sections.extend(render::fitted::compared(&found.rotor, &drawn));
        output::story(path, &format!("{}: identified", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer_in_order(&answer);
    }
    terminal::print(&render::identify::text(&answer));
    say!("\nWritten to {}.", arguments.output.display());
    output::say_next(&next);
    Ok(None)
}

impl Arguments {
    /// What to do with the identified machine, and the command for it.
    fn next(&self) -> output::Next {
        let [rotor, record] = [&self.output, &self.record].map(|path| shell::path(path));
        let command = format!("rotor-edge replay --identified --rotor {rotor} --record {record}");
        ("play the record into the controller".into(), Some(command))
    }
}

//! `extract`: raw samples to 1x readings.

mod pairs;
mod report;
mod spectra;

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;

use super::listener::Listener;
use super::output::{self, Form, Json};
use super::shell;
use crate::answers::extract::ExtractionAnswer;
use crate::ingest::waveform::settings::Settings;
use crate::ingest::waveform::{ExtraOutputs, ExtractedFile, extract};
use crate::render;
use crate::terminal;

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Samples of probes and keyphasor: .csv or .lvm (a header, a row a sample, times or --rate-hz), .wav, .npy, .npz, .mat; of
    /// several files, each is a run, and begins when the one before it ended
    #[arg(required = true)]
    waveforms: Vec<PathBuf>,
    /// Where to write the readings
    #[arg(short, long, default_value = "measured.csv")]
    output: PathBuf,
    /// Write the 2x vectors too, to a file with the same columns
    #[arg(long, value_name = "FILE")]
    two_x: Option<PathBuf>,
    /// Take the probes of this rotor, and their names
    #[arg(long)]
    rotor: Option<PathBuf>,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    form: Form,
}

/// Runs the command; `forced` writes over a file that exists.
pub fn run(arguments: &Arguments, forced: bool, listener: Listener) -> Result<Json> {
    output::refuse_what_exists([&arguments.output].into_iter().chain(&arguments.two_x), forced)?;
    let rotor = arguments.rotor.as_deref().map(rotor_file::read).transpose()?;
    let probes: Option<Vec<String>> =
        rotor.as_ref().map(|r| r.probe.iter().map(|p| p.name.clone()).collect());
    let busy = listener.spinner(&format!("extracting {}", arguments.names()));
    let beside = ExtraOutputs { two_x: arguments.two_x.is_some(), spectra: arguments.form.report.is_some() };
    let extracted = extract(&arguments.waveforms, probes.as_deref(), &arguments.settings, beside);
    busy.finish_and_clear();
    let extracted = extracted?;
    let settings = &arguments.settings;
    let answer =
        ExtractionAnswer::of(&extracted, settings, arguments.output.clone(), arguments.two_x.clone());
    let account = render::extract::account(&answer, settings);
    output::file(&arguments.output, &measured(&extracted, |file| &file.readings, "1x", &account)?)?;
    if let Some(path) = &arguments.two_x {
        let holds = "2x, phase from the same mark";
        output::file(path, &measured(&extracted, |file| &file.two_x, holds, &account)?)?;
    }
    if let Some(path) = &arguments.form.report {
        let title = format!("1x readings of {}", arguments.names());
        let largest = report::largest(&extracted);
        let probe = report::of_probe(&extracted, largest);
        let story = render::extract::story(&answer, settings, probe, arguments.next());
        let sections = report::sections(&extracted, rotor.as_ref(), account, largest);
        output::story(path, &title, &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::extract::text(&answer, settings));
    Ok(None)
}

impl Arguments {
    /// What to do with the readings, and the command for it.
    fn next(&self) -> output::Next {
        let words = match self.rotor {
            Some(_) => "compare the machine's model with them",
            None => "write the machine's rotor.toml, and compare its model with them",
        };
        let rotor = self.rotor.as_deref().map_or("rotor.toml".into(), shell::path);
        (words.into(), Some(format!("rotor-edge compare {rotor} {}", shell::path(&self.output))))
    }

    fn names(&self) -> String {
        self.waveforms.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ")
    }
}

/// The whole file of some readings; in its first lines, what it holds and what made it.
fn measured(
    extracted: &[ExtractedFile],
    readings: impl Fn(&ExtractedFile) -> &Vec<Reading>,
    holds: &str,
    account: &[String],
) -> Result<Vec<u8>> {
    let mut head = format!("# vectors of {holds}\n");
    for line in account {
        writeln!(head, "# {line}")?;
    }
    let mut file = head.into_bytes();
    let names: Vec<&str> = extracted[0].probes.iter().map(|probe| probe.name.as_str()).collect();
    let readings: Vec<Reading> = extracted.iter().flat_map(readings).cloned().collect();
    measurement::write_exactly(&mut file, &names, &readings)?;
    Ok(file)
}

fn readings(extracted: &[ExtractedFile]) -> impl Iterator<Item = &Reading> {
    extracted.iter().flat_map(|file| &file.readings)
}

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
use serde_json::{Value, json};

use super::listener::Listener;
use super::output::{self, Form, Json};
use crate::ingest::waveform::settings::Settings;
use crate::ingest::waveform::sweep::RateCompensation;
use crate::ingest::waveform::vectors::DriftedWindows;
use crate::ingest::waveform::{ExtraOutputs, ExtractedFile, extract};

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Samples of probes and keyphasor: .csv (a header, a row a sample, `time_s` or --rate-hz), .wav, .npy, .npz, .mat; of
    /// several files, each is a run, and begins when the one before it ended
    #[arg(required = true)]
    waveforms: Vec<PathBuf>,
    /// Where to write the readings
    #[arg(short, long, default_value = "measured.csv")]
    output: PathBuf,
    /// Write the vectors at twice the running speed too, in a file of the same columns
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
    let of_1x = extracted.iter().flat_map(|file| &file.readings);
    output::file(&arguments.output, &measured(&extracted, of_1x, "1x", arguments)?)?;
    if let Some(path) = &arguments.two_x {
        let of_2x = extracted.iter().flat_map(|file| &file.two_x);
        output::file(path, &measured(&extracted, of_2x, "2x, phase from the same mark", arguments)?)?;
    }
    if let Some(path) = &arguments.form.report {
        let title = format!("1x readings of {}", arguments.names());
        output::report(
            path,
            &title,
            report::sections(&extracted, rotor.as_ref(), account(&extracted, arguments)),
        )?;
    }
    if arguments.form.json {
        return output::as_json(&answer(&extracted, arguments));
    }
    show(&extracted, arguments);
    Ok(None)
}

impl Arguments {
    fn names(&self) -> String {
        self.waveforms.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ")
    }
}

/// The whole file; in its first lines, what it holds and what made it.
fn measured<'a>(
    extracted: &[ExtractedFile],
    readings: impl Iterator<Item = &'a Reading>,
    holds: &str,
    arguments: &Arguments,
) -> Result<Vec<u8>> {
    let mut head = format!("# vectors of {holds}\n");
    for line in account(extracted, arguments) {
        writeln!(head, "# {line}")?;
    }
    let mut file = head.into_bytes();
    let names: Vec<&str> = extracted[0].probes.iter().map(|probe| probe.name.as_str()).collect();
    measurement::write_exactly(&mut file, &names, &readings.cloned().collect::<Vec<_>>())?;
    Ok(file)
}

fn readings(extracted: &[ExtractedFile]) -> impl Iterator<Item = &Reading> {
    extracted.iter().flat_map(|file| &file.readings)
}

/// What was done, in sentences.
fn account(extracted: &[ExtractedFile], arguments: &Arguments) -> Vec<String> {
    extracted.iter().flat_map(|file| of_file(file, arguments)).collect()
}

fn of_file(extracted: &ExtractedFile, arguments: &Arguments) -> Vec<String> {
    let settings = &arguments.settings;
    let ExtractedFile { file, readings, rate_hz, duration_s, .. } = extracted;
    let speeds = || readings.iter().map(|r| r.speed_rpm);
    let (lowest, highest) = (speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max));
    let (key, threshold) = &extracted.keyphasor;
    let probes: Vec<String> =
        extracted.probes.iter().map(|p| format!("{} is {}", p.name, p.channel)).collect();
    let way = if settings.keyphasor.falling { "falls" } else { "rises" };
    let unit = if settings.unit.is_voltage() { "mV" } else { "of the unit" };
    let run = extracted.run.as_ref().map_or(String::new(), |run| format!(", run {run}"));
    let mut lines = vec![
        format!("extracted from {file}{run}"),
        format!(
            "{} readings from {lowest:.1} to {highest:.1} rpm, {duration_s:.3} s at {rate_hz} Hz",
            readings.len()
        ),
        format!("t = 0 where channel {key} {way} through {threshold:.6}; probe {}", probes.join(", ")),
        format!(
            "windows of {} turns; a count of the core's converter is {:.6} {unit}",
            settings.revolutions,
            extracted.count * settings.unit.mv()
        ),
    ];
    let inverted: Vec<&str> =
        extracted.probes.iter().filter(|p| p.mv_um < 0.0).map(|p| p.name.as_str()).collect();
    if !inverted.is_empty() {
        lines.push(format!(
            "negative sensitivity of {}: right only where the channel is inverted, else its angles are 180° off",
            inverted.join(", ")
        ));
    }
    if settings.keyphasor.pulses > 1 {
        lines.push(format!(
            "{} pulses a turn, the first of the file at t = 0: phases of two files cannot be compared",
            settings.keyphasor.pulses
        ));
    }
    if extracted.missed_pulses > 0 {
        lines.push(format!("{} pulses of the tacho did not come", extracted.missed_pulses));
    }
    if let Some(at_s) = extracted.reference_lost_s {
        lines.push(format!("at {at_s:.3} s the tacho had paused for a turn: phases are unknown from there on, and no reading was taken"));
    }
    if let Some(RateCompensation { bins, left, largest_um, at_rpm }) = extracted.compensated {
        lines.push(format!(
            "{} of {bins} bins are as if their speed had been held; the largest change is {largest_um:.3} µm at {at_rpm:.0} \
             rpm",
            bins - left
        ));
        if left > 0 {
            lines.push(format!("{left} bins stay as measured: too few readings around them; fewer --revolutions or a larger --bin-rpm give more"));
        }
    }
    lines.extend(extracted.losses.iter().map(|loss| format!("lost: {loss}")));
    let advice = |drifted: DriftedWindows| drifted.advice(settings.revolutions, settings.largest_drift);
    lines.extend(extracted.drifted.map(advice));
    lines
}

fn show(extracted: &[ExtractedFile], arguments: &Arguments) {
    for line in account(extracted, arguments) {
        println!("{line}");
    }
    let also = arguments.two_x.as_ref().map_or(String::new(), |path| format!(", 2x to {}", path.display()));
    println!("\nWritten to {}{also}.", arguments.output.display());
}

fn answer(extracted: &[ExtractedFile], arguments: &Arguments) -> Value {
    let lost = |of: &ExtractedFile| of.losses.iter().map(|loss| loss.windows).sum::<usize>();
    json!({
        "measured": arguments.output,
        "two_x": arguments.two_x,
        "readings": readings(extracted).count(),
        "speeds": readings(extracted).map(|r| r.speed_rpm).collect::<Vec<_>>(),
        "lost": extracted.iter().map(lost).sum::<usize>(),
        "files": extracted.iter().map(answer_of_file).collect::<Vec<_>>(),
    })
}

fn answer_of_file(extracted: &ExtractedFile) -> Value {
    let losses: Vec<Value> = (extracted.losses.iter())
        .map(|loss| json!({"why": loss.why, "probe": loss.probe, "windows": loss.windows, "first_s": loss.first_s}))
        .collect();
    let drifted =
        extracted.drifted.map(|d| json!({"windows": d.windows, "in_all": d.in_all, "largest": d.largest}));
    let (key, threshold) = &extracted.keyphasor;
    json!({
        "file": extracted.file,
        "run": extracted.run,
        "rate_hz": extracted.rate_hz,
        "duration_s": extracted.duration_s,
        "keyphasor": {"channel": key, "threshold": threshold, "missed_pulses": extracted.missed_pulses,
            "reference_lost_s": extracted.reference_lost_s},
        "channels": extracted.probes.iter().map(|p| json!({"probe": p.name, "channel": p.channel})).collect::<Vec<_>>(),
        "count": extracted.count,
        "readings": extracted.readings.len(),
        "losses": losses,
        "drifted": drifted,
        "compensated": extracted.compensated.map(|c| json!({"bins": c.bins, "left": c.left,
            "largest_um": c.largest_um, "at_rpm": c.at_rpm})),
    })
}

//! Raw samples of probes and keyphasor, made into 1x readings by the core's own extraction: `rotor-edge extract`.
//!
//! | module | holds |
//! |---|---|
//! | `settings` | what the owner states: channels, units, keyphasor, windows |
//! | `channels` | which channel is which probe |
//! | `counts` | numbers as counts of a 16-bit converter, and where they are clipped |
//! | `reference` | where turns begin: by the keyphasor, or by samples that follow the shaft's angle |
//! | `pulses` | where the keyphasor's channel passes its threshold |
//! | `train`, `bridge`, `wheel` | what is too many and what is missing in once-a-turn marks, and in pulses of a wheel |
//! | `smooth` | marks that are known to one sample |
//! | `mark`, `marks` | the keyphasor's marks, one a turn |
//! | `windows` | the core's [`Extractor`](rotor_edge_core::extraction::Extractor), four probes at a time |
//! | `vectors` | its windows as readings, integrated and binned, and what was lost |
//! | `sweep` | bins of a run-up as if each speed had been held |
//! | `suborder` | a doubt whether there is one mark a turn |
//! | `orders` | spectra by order, and 2x vectors |

mod bridge;
mod channels;
mod counts;
mod mark;
mod marks;
pub(crate) mod orders;
mod pulses;
mod reference;
pub(crate) mod settings;
mod smooth;
mod suborder;
pub(crate) mod sweep;
mod train;
pub(crate) mod vectors;
mod wheel;
mod windows;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use rotor_edge_core::extraction::{Converter, ExtractionConfig};
use rotor_edge_desktop::measurement::Reading;

use super::sampled;
use super::unit::Unit;
use channels::Assignment;
use counts::ConvertedChannels;
use marks::Marks;
use orders::{AngularSamples, FEWEST_TURNS, Spectrum};
use reference::Referenced;
use settings::Settings;
use sweep::RateCompensation;
use vectors::{DriftedWindows, Loss, RecordingContext, losses};

#[derive(Debug)]
pub struct ExtractedFile {
    pub file: String,
    /// Its run, if it has a name.
    pub run: Option<String>,
    /// Samples a second of each channel.
    pub rate_hz: f64,
    /// Length of the recording, s.
    pub duration_s: f64,
    /// Unit of the probes' channels.
    pub unit: Unit,
    /// Turns in a window.
    pub revolutions: u16,
    /// The keyphasor's channel, and where it was passed, in its unit; no name where there is none.
    pub keyphasor: (String, f64),
    /// The probes in the order of the readings.
    pub probes: Vec<Probe>,
    /// A count of the core's converter in the channels' unit: numbers that were none were rounded to it.
    pub count: f64,
    /// One a window, or one a bin.
    pub readings: Vec<Reading>,
    /// The same at twice the running speed, if they were asked for.
    pub two_x: Vec<Reading>,
    /// Spectra by order, if they were asked for.
    pub spectra: Vec<Spectrum>,
    /// What was taken off for the change of speed, if it was asked for.
    pub compensated: Option<RateCompensation>,
    /// Readings that are lost, by reason.
    pub losses: Vec<Loss>,
    /// Those among them that are lost because the speed changed.
    pub drifted: Option<DriftedWindows>,
    /// What was made of the keyphasor's pulses.
    pub marks: MarksAccount,
    /// Why the speed may be another, in sentences.
    pub doubts: Vec<String>,
}

/// What was made of the keyphasor's pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarksAccount {
    /// Samples of a turn, where these follow the shaft's angle and there is no keyphasor.
    pub samples_a_turn: Option<usize>,
    /// Pulses of a tacho that did not come.
    pub missed_pulses: usize,
    /// Teeth of a wheel that are missing in every turn.
    pub missing_teeth: usize,
    /// Whether t = 0 is at the pulse after a wheel's gap.
    pub is_after_gap: bool,
    /// Marks that were left out: they came between two turns, or within the hold-off.
    pub extra: usize,
    /// Marks that did not come and were put in between those beside them.
    pub filled: usize,
    /// Marks in all, those put in included.
    pub in_all: usize,
    /// Whether a curve was laid through marks that are known to one sample only.
    pub is_smoothed: bool,
    /// When it was no longer known which pulse of the turn is which, s.
    pub reference_lost_s: Option<f64>,
}

impl MarksAccount {
    fn of(Referenced { marks, samples_a_turn, rate_hz, .. }: &Referenced) -> Self {
        Self {
            samples_a_turn: *samples_a_turn,
            missed_pulses: marks.missed,
            missing_teeth: marks.missing_teeth,
            is_after_gap: marks.is_after_gap,
            extra: marks.extra,
            filled: marks.filled,
            in_all: marks.all.len(),
            is_smoothed: marks.is_smoothed,
            reference_lost_s: marks.reference_lost.map(|sample| sample as f64 / rate_hz),
        }
    }
}

/// A probe as it was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    pub name: String,
    /// The name of its channel.
    pub channel: String,
    /// Sensitivity, mV/µm; 1 where the channel is no voltage.
    pub mv_um: f64,
}

/// What is wanted beside 1x.
#[derive(Debug, Clone, Copy)]
pub struct ExtraOutputs {
    /// The vectors at twice the running speed.
    pub two_x: bool,
    pub spectra: bool,
}

/// Extracts the 1x vectors of files that were recorded one after another, each a run of its own; `of_rotor` are the probes of
/// a rotor, if one is given.
///
/// # Errors
/// One sentence with the file, the place in it and the option that would help.
pub fn extract(
    paths: &[PathBuf],
    of_rotor: Option<&[String]>,
    settings: &Settings,
    beside: ExtraOutputs,
) -> Result<Vec<ExtractedFile>> {
    settings.check()?;
    if beside.two_x && settings.revolutions < FEWEST_TURNS {
        bail!("--revolutions {}: expected {FEWEST_TURNS} at least for 2x", settings.revolutions);
    }
    let mut all: Vec<ExtractedFile> = Vec::new();
    for (path, run) in paths.iter().zip(settings.runs(paths)?) {
        let begins_s = all.iter().map(|before| before.duration_s).sum();
        let extracted = of_file(path, run, begins_s, of_rotor, settings, beside)?;
        let names =
            |of: &ExtractedFile| of.probes.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
        if let Some(first) = all.first()
            && names(first) != names(&extracted)
        {
            let (file, expected) = (&extracted.file, &first.file);
            bail!("{file}: has the probes {}, expected {} as in {expected}", names(&extracted), names(first));
        }
        all.push(extracted);
    }
    Ok(all)
}

fn of_file(
    path: &Path,
    run: Option<String>,
    begins_s: f64,
    of_rotor: Option<&[String]>,
    settings: &Settings,
    beside: ExtraOutputs,
) -> Result<ExtractedFile> {
    let waveform = sampled::read(path)?;
    let length = waveform.len();
    let found = reference::referenced(waveform, settings)?;
    let Referenced { waveform, settings, rate_hz, marks, .. } = &found;
    let (file, rate_hz) = (&waveform.file, *rate_hz);
    let unit_per_number = found.unit_per_number;
    let assigned = channels::probes(waveform, &found.key, of_rotor, settings)?;
    let converted =
        ConvertedChannels::of_probes(&assigned.iter().map(|a| &a.channel.samples).collect::<Vec<_>>());
    let count = converted.step * unit_per_number;
    let zero_mv = (converted.zero * unit_per_number * settings.unit().mv()) as f32;
    let config = extraction_config(settings, rate_hz, count, zero_mv);
    let mv_um: Vec<f32> = assigned.iter().map(|a| a.mv_um).collect();
    let windows = windows::windows(&config, &mv_um, &converted.channels, &marks.all)
        .map_err(|error| settings.refusal(file, rate_hz, error))?;
    let names: Vec<String> = assigned.iter().map(|a| a.probe.clone()).collect();
    let losses = losses(&windows, &names, rate_hz);
    let uneven = vectors::uneven(&losses, &marks.all).filter(|_| found.key.is_some());
    // of marks that come unevenly no other limit of drift makes a speed
    let drifted = vectors::drifted(&windows).filter(|_| uneven.is_none());
    let begins_s = begins_s - found.lead_s;
    let recorded =
        RecordingContext { run: run.as_deref(), begins_s, rate_hz, zero_v: 1e-3 * f64::from(zero_mv) };
    let each = vectors::readings(&windows, &recorded, settings);
    let (readings, compensated) = held_or_binned(each, settings);
    let turning = AngularSamples { probes: &assigned, marks: &marks.all, rate_hz, unit_per_number, settings };
    let mut doubts = match &found.key {
        Some((_, key)) => doubts(&format!("{file}: channel {key}"), &turning, marks)?,
        None => Vec::new(),
    };
    if readings.is_empty() {
        refuse(
            file,
            marks.all.len(),
            &losses,
            { uneven.clone() }
                .or(drifted.map(|d| d.advice(settings.revolutions, settings.largest_drift)))
                .or_else(|| vectors::slow(&losses, &marks.all, rate_hz, settings.slowest_rpm)),
            settings,
        )?;
    }
    doubts.extend(uneven);
    let two_x = match beside.two_x {
        true => {
            binned(vectors::readings_of(&windows, turning.two_x(&windows), &recorded, settings), settings)
        }
        false => Vec::new(),
    };
    let spectra = if beside.spectra { turning.spectra(&windows) } else { Vec::new() };
    waveform.check_read()?;
    Ok(ExtractedFile {
        file: file.clone(),
        run,
        rate_hz,
        duration_s: length as f64 / rate_hz,
        unit: settings.unit(),
        revolutions: settings.revolutions,
        keyphasor: (found.key.as_ref().map_or(String::new(), |(_, name)| name.clone()), marks.threshold),
        probes: assigned.iter().map(probe).collect(),
        count,
        readings,
        two_x,
        spectra,
        compensated,
        losses,
        drifted,
        doubts,
        marks: MarksAccount::of(&found),
    })
}

/// Why there may be more than one mark a turn, unless the owner states how many there are.
fn doubts(place: &str, turning: &AngularSamples, marks: &Marks) -> Result<Vec<String>> {
    let stated = turning.settings.keyphasor.pulses;
    let (filled, in_all) = (marks.filled, marks.all.len());
    match suborder::strongest(turning, marks.gap_every).filter(|_| stated.is_none()) {
        Some(found) if found.is_rather_1x() && filled > 0 => bail!(
            "{place}: {filled} of {in_all} marks seem to be missing, but {found}, expected --pulses {}, or --pulses 1 if \
             marks are missing",
            found.marks
        ),
        Some(found) if found.is_rather_1x() => {
            bail!("{place}: {found}, expected --pulses {}, or --pulses 1 if there is one", found.marks)
        }
        found => {
            Ok(found.iter().map(|found| format!("{found}: --pulses {} reads it so", found.marks)).collect())
        }
    }
}

/// Settings of the core's extraction for a recording; `count` is one count of the converter in the channels' unit.
fn extraction_config(settings: &Settings, rate_hz: f64, count: f64, zero_mv: f32) -> ExtractionConfig<4> {
    ExtractionConfig {
        sample_rate_hz: rate_hz as f32,
        converter: Converter {
            rails: [i16::MIN.into(), i16::MAX.into()],
            zero_count: 0.0,
            mv_per_count: (count * settings.unit().mv()) as f32,
        },
        gap_range_mv: settings.gap_range_mv().map(|mv| mv - zero_mv),
        revolutions: settings.revolutions,
        largest_drift: settings.largest_drift,
        longest_turn_s: (60.0 / settings.slowest_rpm) as f32,
        ..ExtractionConfig::new()
    }
}

/// The mean of each bin of speed, or every reading where no bins are asked for.
fn binned(each: Vec<Reading>, settings: &Settings) -> Vec<Reading> {
    match settings.bin_rpm {
        Some(bin_rpm) => vectors::bins(&each, bin_rpm).into_iter().map(vectors::mean_of).collect(),
        None => each,
    }
}

/// Readings as they are given out: with the change of speed taken off where that is asked for, else binned.
fn held_or_binned(each: Vec<Reading>, settings: &Settings) -> (Vec<Reading>, Option<RateCompensation>) {
    let Some(bin_rpm) = settings.bin_rpm.filter(|_| settings.compensate_rate) else {
        return (binned(each, settings), None);
    };
    let bins = vectors::bins(&each, bin_rpm);
    let (steady, done) = sweep::steady(&each, &bins, bin_rpm, settings.revolutions);
    (steady, Some(done))
}

fn probe(assigned: &Assignment) -> Probe {
    Probe {
        name: assigned.probe.clone(),
        channel: assigned.channel.header.clone(),
        mv_um: f64::from(assigned.mv_um),
    }
}

/// Says why there is no reading at all.
fn refuse(
    file: &str,
    marks: usize,
    losses: &[Loss],
    advice: Option<String>,
    settings: &Settings,
) -> Result<()> {
    if losses.is_empty() {
        bail!(
            "{file}: {marks} marks make no window of {} turns, expected fewer --revolutions",
            settings.revolutions
        );
    }
    let help = match losses.iter().any(|loss| loss.why == vectors::OPEN) {
        true => "; expected another --gap-v or --mv-um, or --ac for channels without a gap voltage".into(),
        false => advice.map_or(String::new(), |advice| format!("; {advice}")),
    };
    let all: Vec<String> = losses.iter().map(ToString::to_string).collect();
    bail!("{file}: every reading is lost: {}{help}", all.join(", "))
}

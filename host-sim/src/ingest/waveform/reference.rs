//! Where the turns of a recording begin: by its keyphasor, or by its samples where these follow the shaft's angle.

use anyhow::{Context, Result, bail};

use super::channels;
use super::mark::Mark;
use super::marks::{Marks, marks};
use super::settings::Settings;
use crate::ingest::header::{is_keyphasor, meaning};
use crate::ingest::samples::{Channel, Samples, Scale, Waveform};
use crate::ingest::unit::{TimeUnit, Unit};

/// Counts of half a 16-bit converter's range.
const HALF_RANGE: f64 = 32_768.0;
/// Fractions of a full scale are no larger, overshoot included.
const LARGEST_FRACTION: f64 = 1.1;
/// Rates that differ by less are one, relative.
const SAME_RATE: f64 = 0.02;

/// A recording with its phase reference.
pub struct Referenced {
    pub waveform: Waveform,
    pub settings: Settings,
    pub rate_hz: f64,
    /// What a number of the file stands for, in the unit of the settings.
    pub unit_per_number: f64,
    /// Number of the keyphasor's channel, and its name; nothing where the samples themselves follow the angle.
    pub key: Option<(usize, String)>,
    pub samples_a_turn: Option<usize>,
    pub marks: Marks,
    /// What the samples begin before the recording does, s.
    pub lead_s: f64,
}

/// Finds the marks of a recording, and settles what its owner left to the file.
///
/// # Errors
/// If there is no rate or no reference, or they contradict what the file states.
pub fn referenced(waveform: Waveform, settings: &Settings) -> Result<Referenced> {
    let mut settings = settings.clone();
    settings.unit = settings.unit.or_else(|| stated_unit(&waveform, &settings));
    settings.check_sensitivity(&waveform.file)?;
    let has_key =
        settings.keyphasor.keyphasor.is_some() || waveform.channels.iter().any(|c| is_keyphasor(&c.name));
    let of_file = if has_key { None } else { samples_a_turn(&waveform)? };
    match settings.keyphasor.samples_per_turn.map(|n| n as usize).or(of_file) {
        Some(samples) => synchronous(waveform, settings, samples),
        None => {
            let rate_hz = rate_hz(&waveform, &settings, None)?;
            let key = channels::keyphasor(&waveform, &settings)?;
            let unit_per_number = unit_per_number(&waveform, &settings)?;
            let marks = marks(&waveform.file, key, unit_per_number, &settings.keyphasor)?;
            let key = Some((key.number, key.header.clone()));
            Ok(Referenced {
                waveform,
                settings,
                rate_hz,
                unit_per_number,
                key,
                samples_a_turn: None,
                marks,
                lead_s: 0.0,
            })
        }
    }
}

/// The unit that the file states of all channels that may be probes.
fn stated_unit(waveform: &Waveform, settings: &Settings) -> Option<Unit> {
    let stated: Vec<&Channel> = settings
        .channel
        .iter()
        .filter_map(|rule| waveform.channel(&rule.channel, "--channel").ok())
        .collect();
    let key = channels::keyphasor(waveform, settings).map_or(0, |key| key.number);
    let all = waveform.channels.iter().filter(|c| c.may_vibrate() && c.number != key).collect();
    let probes = if stated.is_empty() { all } else { stated };
    let unit = probes.first()?.unit?;
    probes.iter().all(|channel| channel.unit == Some(unit)).then_some(unit)
}

/// Samples of a turn that the lines above the samples state.
fn samples_a_turn(waveform: &Waveform) -> Result<Option<usize>> {
    let stated = &waveform.preamble;
    let turns = stated
        .turns
        .filter(|turns| waveform.len().is_multiple_of(*turns))
        .map(|turns| waveform.len() / turns);
    match (stated.samples_a_turn, turns) {
        (Some(samples), Some(by_turns)) if samples != by_turns => bail!(
            "{}: states {samples} samples a turn, and {} samples of its turns are {by_turns} each, expected \
             --samples-per-turn",
            waveform.file,
            waveform.len()
        ),
        (samples, by_turns) => Ok(samples.or(by_turns).filter(|samples| *samples > 1)),
    }
}

/// Samples that follow the shaft's angle from the mark on. The first turn is repeated before them, by which the core knows the
/// speed, and the first sample behind them, with which the last turn ends.
fn synchronous(mut waveform: Waveform, mut settings: Settings, samples: usize) -> Result<Referenced> {
    let turns = waveform.len() / samples;
    if turns == 0 {
        bail!("{}: has {} samples, expected a turn of {samples} at least", waveform.file, waveform.len());
    }
    let rate_hz = rate_hz(&waveform, &settings, Some(samples))?;
    let unit_per_number = unit_per_number(&waveform, &settings)?;
    for channel in &mut waveform.channels {
        channel.samples = match &channel.samples {
            Samples::Counts(all) => Samples::Counts(extended(all, samples, turns)),
            Samples::Values(all) => Samples::Values(extended(all, samples, turns)),
            all if all.is_counts() => {
                let counts: Vec<i16> = all.iter().map(|value| value as i16).collect();
                Samples::Counts(extended(&counts, samples, turns))
            }
            all => Samples::Values(extended(&all.iter().collect::<Vec<_>>(), samples, turns)),
        };
    }
    settings.revolutions = settings.revolutions.min(u16::try_from(turns).unwrap_or(u16::MAX));
    let all = (0..turns + 2).map(|turn| Mark { sample: turn * samples, age: 0.0 }).collect();
    Ok(Referenced {
        waveform,
        settings,
        rate_hz,
        unit_per_number,
        key: None,
        samples_a_turn: Some(samples),
        marks: Marks { all, ..Marks::default() },
        lead_s: samples as f64 / rate_hz,
    })
}

fn extended<T: Copy>(all: &[T], samples: usize, turns: usize) -> Vec<T> {
    [&all[..samples], &all[..samples * turns], &all[..1]].concat()
}

/// Samples a second: as stated, or else by the file's times, or by its speed.
fn rate_hz(waveform: &Waveform, settings: &Settings, samples_a_turn: Option<usize>) -> Result<f64> {
    let file = &waveform.file;
    let by_speed = samples_a_turn.zip(waveform.preamble.speed_rpm).map(|(n, rpm)| n as f64 * rpm / 60.0);
    let by_channel = || -> Result<Option<f64>> {
        let is_known = |name: &&String| {
            waveform.time_header.as_ref().is_some_and(|own| own.eq_ignore_ascii_case(name.trim()))
        };
        settings
            .time
            .as_ref()
            .filter(|name| !is_known(name))
            .map(|name| of_channel(waveform, waveform.channel(name, "--time")?))
            .transpose()
    };
    let by_file = match settings.rate_hz {
        Some(_) => None,
        None => by_channel()?.or(waveform.rate_hz),
    };
    if let (Some(by_file), Some(by_speed)) = (by_file, by_speed)
        && (by_file / by_speed - 1.0).abs() > SAME_RATE
    {
        bail!(
            "{file}: its times give {by_file:.6} samples a second and its speed {by_speed:.6}, expected --rate-hz with the \
             right one"
        );
    }
    let unknown = || match (
        &waveform.uneven,
        waveform.channels.iter().find(|c| c.ramp.is_some_and(|step| step != 1.0)),
    ) {
        (Some(uneven), _) => uneven.clone(),
        (None, Some(ramp)) => format!(
            "{file}: does not say its rate, expected --rate-hz, or --time {} if that channel is the time",
            ramp.header
        ),
        (None, None) => format!("{file}: does not say its rate, expected --rate-hz"),
    };
    let rate_hz = settings.rate_hz.or(by_file).or(by_speed).with_context(unknown)?;
    if !(rate_hz > 0.0 && rate_hz.is_finite()) {
        bail!("{file}: has a rate of {rate_hz} Hz, expected a positive one or --rate-hz");
    }
    for channel in waveform.channels.iter().filter(|_| settings.channel.is_empty()) {
        check_ramp(file, channel, rate_hz, settings)?;
    }
    Ok(rate_hz)
}

/// The rate by a channel that is stated to be the time.
fn of_channel(waveform: &Waveform, channel: &Channel) -> Result<f64> {
    let unit = meaning(&channel.header, |_| false).stated.time.map_or(1.0, TimeUnit::seconds);
    match channel.ramp {
        Some(step) => Ok(1.0 / (step * unit)),
        None => {
            bail!("{}: --time {}: does not rise evenly, expected --rate-hz", waveform.file, channel.header)
        }
    }
}

/// A channel that rises evenly is no probe; it must be the time of this rate, the number of the sample, or named.
fn check_ramp(file: &str, channel: &Channel, rate_hz: f64, settings: &Settings) -> Result<()> {
    let Some(step) = channel.ramp.filter(|_| !channel.is_speed && settings.time.is_none()) else {
        return Ok(());
    };
    // s, ms, µs
    let is_time = [1.0, 1e3, 1e6].iter().any(|unit| (step * rate_hz / unit - 1.0).abs() < SAME_RATE);
    if is_time || step == 1.0 {
        return Ok(());
    }
    bail!(
        "{file}: channel {} rises evenly by {step:.6e} a sample, as a time does and no vibration, but not at {rate_hz} Hz, \
         expected --channel with the channel of each probe",
        channel.header
    )
}

/// What a number of the file stands for, in the unit.
fn unit_per_number(waveform: &Waveform, settings: &Settings) -> Result<f64> {
    let file = &waveform.file;
    let largest =
        || waveform.channels.iter().flat_map(|c| c.samples.extremes()).map(f64::abs).fold(0.0, f64::max);
    match (waveform.scale, settings.full_scale) {
        (Scale::Counts, Some(full_scale)) => Ok(full_scale / HALF_RANGE),
        (Scale::Counts, None) => {
            bail!("{file}: holds counts, expected --full-scale with the value of 32768 counts")
        }
        (Scale::Fraction, Some(full_scale)) if largest() <= LARGEST_FRACTION => Ok(full_scale),
        (Scale::Fraction, None) if largest() > LARGEST_FRACTION => Ok(1.0),
        (Scale::Fraction, None) => bail!(
            "{file}: holds floats within ±1, expected --full-scale with the value of 1.0, which is 1 if the numbers are in \
             their unit"
        ),
        (Scale::Unit, None) => Ok(1.0),
        (Scale::Unit | Scale::Fraction, Some(_)) => {
            bail!("--full-scale: {file} holds numbers in their unit and no counts")
        }
    }
}

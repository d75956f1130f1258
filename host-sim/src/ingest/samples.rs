//! Sampled channels, whatever file they are from.

use anyhow::{Result, bail};

use super::header::{ChannelRole, channel_role};
use super::unit::{TimeUnit, Unit};

/// A step of time may be this much longer or shorter than the mean, relative; a lost row is a step twice as long.
const LARGEST_JITTER: f64 = 0.5;

/// The channels of one recording, all sampled at the same moments.
#[derive(Debug, Clone)]
pub struct Waveform {
    /// Name of the file, for messages.
    pub file: String,
    /// Samples a second of each channel, where the file says it.
    pub rate_hz: Option<f64>,
    /// Why the times of the file give no rate.
    pub uneven: Option<String>,
    /// Whether its numbers are counts of a 16-bit converter, with fractions where it resolves more.
    pub is_of_counts: bool,
    pub channels: Vec<Channel>,
}

#[derive(Debug, Clone)]
pub struct Channel {
    /// Place in the file, from 1.
    pub number: usize,
    /// As the file writes it.
    pub header: String,
    /// As the file writes it, without the unit of a vibration.
    pub name: String,
    /// Where the header states it.
    pub unit: Option<Unit>,
    /// Whether it holds the speed, which no probe shows.
    pub is_speed: bool,
    pub samples: Samples,
}

/// A column of a file with one number a sample.
#[derive(Debug)]
pub struct SampleColumn {
    /// Place in the file, from 1.
    pub number: usize,
    pub header: String,
    /// Text of the rows of units below the header.
    pub unit: String,
    pub samples: Samples,
}

#[derive(Debug, Clone)]
pub enum Samples {
    /// Counts of a converter; the core takes them as they are.
    Counts(Vec<i16>),
    /// Numbers in the file's unit, or counts with fractions.
    Values(Vec<f64>),
}

impl Samples {
    pub fn len(&self) -> usize {
        match self {
            Self::Counts(counts) => counts.len(),
            Self::Values(values) => values.len(),
        }
    }

    /// The number at a place.
    pub fn at(&self, place: usize) -> f64 {
        match self {
            Self::Counts(counts) => f64::from(counts[place]),
            Self::Values(values) => values[place],
        }
    }

    pub fn extremes(&self) -> [f64; 2] {
        let ends = |all: &mut dyn Iterator<Item = f64>| {
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
        };
        match self {
            Self::Counts(counts) => ends(&mut counts.iter().map(|count| f64::from(*count))),
            Self::Values(values) => ends(&mut values.iter().copied()),
        }
    }
}

impl Waveform {
    /// Channels that are named by their numbers.
    pub fn numbered(file: &str, rate_hz: Option<f64>, columns: impl IntoIterator<Item = Samples>) -> Self {
        let channel = |(i, samples): (usize, Samples)| {
            let name = (i + 1).to_string();
            Channel { number: i + 1, header: name.clone(), name, unit: None, is_speed: false, samples }
        };
        let channels: Vec<Channel> = columns.into_iter().enumerate().map(channel).collect();
        Self { rate_hz, ..Self::of_channels(file, channels) }
    }

    /// Columns by their headers: the time gives the rate unless the file states it, the others are channels.
    pub fn of_columns(file: &str, rate_hz: Option<f64>, columns: Vec<SampleColumn>) -> Self {
        let role = |column: SampleColumn| (channel_role(&column.header, &column.unit), column);
        let mut channels: Vec<Channel> = Vec::new();
        let mut time: Option<(Option<TimeUnit>, SampleColumn)> = None;
        for (role, column) in columns.into_iter().map(role) {
            let (name, unit, is_speed) = match role {
                ChannelRole::Time(unit) => {
                    // of several times, the first that states its unit
                    if time.as_ref().is_none_or(|(known, _)| known.is_none() && unit.is_some()) {
                        time = Some((unit, column));
                    }
                    continue;
                }
                ChannelRole::Speed => (column.header.clone(), None, true),
                ChannelRole::Signal { name, unit } => (name, unit, false),
            };
            let SampleColumn { number, header, samples, .. } = column;
            channels.push(Channel { number, header, name, unit, is_speed, samples });
        }
        let names: Vec<String> = channels.iter().map(|c| c.name.to_lowercase()).collect();
        for (i, channel) in channels.iter_mut().enumerate() {
            // a name without its unit must still be one of its own
            if names.iter().filter(|name| **name == names[i]).count() > 1 {
                channel.name.clone_from(&channel.header);
            }
        }
        let rate = time.filter(|_| rate_hz.is_none()).map(|(unit, times)| {
            let unit_s = unit.map_or(1.0, TimeUnit::seconds);
            let times_s: Vec<f64> = (0..times.samples.len()).map(|n| unit_s * times.samples.at(n)).collect();
            rate(file, &times.header, &times_s)
        });
        let (rate_hz, uneven) = match rate {
            Some(Ok(rate_hz)) => (Some(rate_hz), None),
            Some(Err(uneven)) => (None, Some(uneven)),
            None => (rate_hz, None),
        };
        Self { rate_hz, uneven, ..Self::of_channels(file, channels) }
    }

    fn of_channels(file: &str, channels: Vec<Channel>) -> Self {
        let is_of_counts = channels.iter().any(|c| matches!(c.samples, Samples::Counts(_)));
        Self { file: file.into(), rate_hz: None, uneven: None, is_of_counts, channels }
    }

    /// # Errors
    /// If there is no sample, two channels have one name, not all are as long, or a sample is no finite number.
    pub fn check(&self) -> Result<()> {
        let file = &self.file;
        let Some(first) = self.channels.first().filter(|c| c.samples.len() > 0) else {
            bail!("{file}: there is no sample, expected those of the probes and of the keyphasor");
        };
        for (i, channel) in self.channels.iter().enumerate() {
            let name = &channel.header;
            if self.channels[..i].iter().any(|other| other.header == *name) {
                bail!("{file}: two channels are called {name}, expected a name for each");
            }
            let (len, expected) = (channel.samples.len(), first.samples.len());
            if len != expected {
                bail!(
                    "{file}: channel {name} has {len} samples and {} has {expected}, expected as many of each",
                    first.header
                );
            }
            if let Samples::Values(values) = &channel.samples
                && let Some(at) = values.iter().position(|v| !v.is_finite())
            {
                bail!("{file}: channel {name}: sample {} is not a finite number", at + 1);
            }
        }
        Ok(())
    }

    /// The channel of this name, or else of this number.
    ///
    /// # Errors
    /// If there is none, with the names that there are; `asked` says who asks.
    pub fn channel(&self, name: &str, asked: &str) -> Result<&Channel> {
        let name = name.trim();
        let of_name = |c: &&Channel| [&c.header, &c.name].iter().any(|own| own.eq_ignore_ascii_case(name));
        let named = self.channels.iter().find(of_name);
        let numbered = || self.channels.iter().find(|c| c.number.to_string() == name);
        match named.or_else(numbered) {
            Some(channel) => Ok(channel),
            None => bail!("{}: {asked}: no channel is \"{name}\", there are {}", self.file, self.names()),
        }
    }

    pub fn names(&self) -> String {
        self.channels.iter().map(|c| c.header.as_str()).collect::<Vec<_>>().join(", ")
    }

    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |c| c.samples.len())
    }
}

/// Samples a second of evenly spaced times, or a sentence with the first uneven step.
fn rate(file: &str, column: &str, times_s: &[f64]) -> Result<f64, String> {
    let (Some(first), Some(last)) = (times_s.first(), times_s.last()) else { return Ok(f64::NAN) };
    let mean_s = (last - first) / (times_s.len() - 1) as f64;
    let is_even = |step: f64| ((step / mean_s) - 1.0).abs() <= LARGEST_JITTER;
    match times_s.windows(2).position(|pair| !is_even(pair[1] - pair[0])) {
        Some(i) => Err(format!(
            "{file}: sample {}, column {column}: goes from {} to {}, expected steps of {mean_s:.6e} s",
            i + 2,
            times_s[i],
            times_s[i + 1]
        )),
        None => Ok(1.0 / mean_s),
    }
}

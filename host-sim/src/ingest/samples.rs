//! Sampled channels, whatever file they are from.

use std::collections::{HashMap, HashSet};

use anyhow::{Result, bail};

use super::calendar::epoch_unit;
use super::header::{ChannelRole, channel_role, meaning};
use super::sample_times::rate;
use super::sampling_preamble::SamplingPreamble;
use super::streamed::{Cursor, Streamed};
use super::unit::{TimeUnit, Unit};
use crate::terminal::listed;

/// Fewer samples are no ramp.
const SHORTEST_RAMP: usize = 8;

/// The channels of one recording, all sampled at the same moments.
#[derive(Debug, Clone)]
pub struct Waveform {
    /// Name of the file, for messages.
    pub file: String,
    /// Samples a second of each channel, where the file says it.
    pub rate_hz: Option<f64>,
    /// Header of the column of times that gave this rate; it is no channel.
    pub time_header: Option<String>,
    /// Why the times of the file give no rate.
    pub uneven: Option<String>,
    pub scale: Scale,
    pub channels: Vec<Channel>,
    /// What the file states above its samples.
    pub preamble: SamplingPreamble,
}

/// What the numbers of a file are parts of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Numbers in a unit.
    Unit,
    /// Counts of a 16-bit converter, with fractions where it resolves more.
    Counts,
    /// Numbers in a unit, or fractions of a full scale of 1: floats of a WAV are either.
    Fraction,
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
    /// The step from each sample to the next, where all are alike: a time or the samples' numbers, and no vibration.
    pub ramp: Option<f64>,
    pub samples: Samples,
}

impl Channel {
    /// Whether it may be a probe's: no speed, and no ramp.
    pub fn may_vibrate(&self) -> bool {
        !self.is_speed && self.ramp.is_none()
    }
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
    /// Counts or numbers that stay in their file.
    Streamed(Streamed),
}

impl Samples {
    pub fn len(&self) -> usize {
        match self {
            Self::Counts(counts) => counts.len(),
            Self::Values(values) => values.len(),
            Self::Streamed(streamed) => streamed.len(),
        }
    }

    /// Whether they are counts of a 16-bit converter without fractions.
    pub fn is_counts(&self) -> bool {
        match self {
            Self::Counts(_) => true,
            Self::Values(_) => false,
            Self::Streamed(streamed) => streamed.is_counts(),
        }
    }

    /// The number at a place.
    pub fn at(&self, place: usize) -> f64 {
        match self {
            Self::Counts(counts) => f64::from(counts[place]),
            Self::Values(values) => values[place],
            Self::Streamed(streamed) => streamed.at(place),
        }
    }

    /// All numbers in order.
    pub fn iter(&self) -> SamplesIter<'_> {
        let cursor = if let Self::Streamed(streamed) = self { Some(streamed.cursor()) } else { None };
        SamplesIter { samples: self, cursor, next: 0, end: self.len() }
    }

    /// The first that is not a finite number.
    fn not_finite(&self) -> Option<usize> {
        match self {
            Self::Counts(_) => None,
            Self::Values(values) => values.iter().position(|value| !value.is_finite()),
            Self::Streamed(streamed) => streamed.not_finite(),
        }
    }

    /// The step of numbers that rise evenly from the first to the last.
    fn ramp(&self) -> Option<f64> {
        let last = self.len().checked_sub(1).filter(|last| *last + 1 >= SHORTEST_RAMP)?;
        let step = (self.at(last) - self.at(0)) / last as f64;
        let is_on_line = |n: usize| (self.at(n) - self.at(0) - step * n as f64).abs() <= step;
        (step > 0.0 && (1..last).all(|n| self.at(n) >= self.at(n - 1) && is_on_line(n))).then_some(step)
    }

    pub fn extremes(&self) -> [f64; 2] {
        let ends = |all: &mut dyn Iterator<Item = f64>| {
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
        };
        match self {
            Self::Counts(counts) => ends(&mut counts.iter().map(|count| f64::from(*count))),
            Self::Values(values) => ends(&mut values.iter().copied()),
            Self::Streamed(streamed) => streamed.extremes(),
        }
    }
}

/// The numbers of a channel.
#[derive(Debug)]
pub struct SamplesIter<'a> {
    samples: &'a Samples,
    /// Where they stay in their file.
    cursor: Option<Cursor<'a>>,
    next: usize,
    end: usize,
}

impl Iterator for SamplesIter<'_> {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let place = self.next;
        if place == self.end {
            return None;
        }
        self.next += 1;
        Some(match &mut self.cursor {
            Some(cursor) => cursor.at(place),
            None => self.samples.at(place),
        })
    }
}

impl Waveform {
    /// Channels that are named by their numbers.
    pub fn numbered(file: &str, rate_hz: Option<f64>, columns: impl IntoIterator<Item = Samples>) -> Self {
        let channel = |(i, samples): (usize, Samples)| {
            let name = (i + 1).to_string();
            let ramp = samples.ramp();
            Channel { number: i + 1, header: name.clone(), name, unit: None, is_speed: false, ramp, samples }
        };
        let channels: Vec<Channel> = columns.into_iter().enumerate().map(channel).collect();
        Self { rate_hz, ..Self::of_channels(file, channels) }
    }

    /// Columns by their headers: the time gives the rate unless the file states it, the others are channels.
    pub fn of_columns(file: &str, rate_hz: Option<f64>, columns: Vec<SampleColumn>) -> Self {
        let role = |column: SampleColumn| {
            let role = channel_role(&column.header, &column.unit);
            let ramp = column.samples.ramp();
            match (&role, ramp, time_unit(&column)) {
                (ChannelRole::Signal { .. }, Some(_), Some(unit)) => (ChannelRole::Time(unit), ramp, column),
                _ => (role, ramp, column),
            }
        };
        let mut channels: Vec<Channel> = Vec::new();
        let mut time: Option<((bool, bool), Option<TimeUnit>, SampleColumn)> = None;
        for (role, ramp, column) in columns.into_iter().map(role) {
            let (name, unit, is_speed) = match role {
                ChannelRole::Time(unit) => {
                    // of several times, the first that rises and states its unit
                    let says = (ramp.is_some(), unit.is_some());
                    if time.as_ref().is_none_or(|(known, _, _)| says > *known) {
                        time = Some((says, unit, column));
                    }
                    continue;
                }
                ChannelRole::Speed => (column.header.clone(), None, true),
                ChannelRole::Signal { name, unit } => (name, unit, false),
            };
            let SampleColumn { number, header, samples, .. } = column;
            channels.push(Channel { number, header, name, unit, is_speed, ramp, samples });
        }
        let names: Vec<String> = channels.iter().map(|c| c.name.to_lowercase()).collect();
        let mut times: HashMap<&str, usize> = HashMap::new();
        names.iter().for_each(|name| *times.entry(name).or_default() += 1);
        for (name, channel) in names.iter().zip(&mut channels) {
            // a name without its unit must still be one of its own
            if times[name.as_str()] > 1 {
                channel.name.clone_from(&channel.header);
            }
        }
        let length = channels.first().map_or(0, |c| c.samples.len());
        // times of another length are those of something else
        let time = time.filter(|(_, _, times)| rate_hz.is_none() && times.samples.len() == length);
        let time_header = time.as_ref().map(|(_, _, times)| times.header.clone());
        let rate = time.map(|(_, unit, times)| {
            let first = (times.samples.len() > 0).then(|| times.samples.at(0));
            let by_size = first.filter(|_| unit.is_none_or(TimeUnit::is_epoch)).and_then(epoch_unit);
            let unit_s = by_size.or(unit).map_or(1.0, TimeUnit::seconds);
            // of a time since 1970, a double in seconds has no microseconds left
            let zero = first.filter(|_| by_size.is_some()).unwrap_or(0.0);
            let second = |n: usize| unit_s * (times.samples.at(n) - zero);
            let times_s: Vec<f64> = (0..times.samples.len()).map(second).collect();
            rate(file, &times.header, &times_s)
        });
        let (rate_hz, uneven) = match rate {
            Some(Ok(rate_hz)) => (Some(rate_hz), None),
            Some(Err(uneven)) => (None, Some(uneven)),
            None => (rate_hz, None),
        };
        Self { rate_hz, time_header, uneven, ..Self::of_channels(file, channels) }
    }

    fn of_channels(file: &str, channels: Vec<Channel>) -> Self {
        let of_counts = channels.iter().any(|c| c.samples.is_counts());
        let scale = if of_counts { Scale::Counts } else { Scale::Unit };
        let preamble = SamplingPreamble::default();
        Self { file: file.into(), rate_hz: None, time_header: None, uneven: None, scale, channels, preamble }
    }

    /// # Errors
    /// If there is no sample, two channels have one name, not all are as long, or a sample is no finite number.
    pub fn check(&self) -> Result<()> {
        let file = &self.file;
        let Some(first) = self.channels.first().filter(|c| c.samples.len() > 0) else {
            bail!("{file}: there is no sample, expected those of the probes and of the keyphasor");
        };
        let mut names = HashSet::new();
        for channel in &self.channels {
            let name = &channel.header;
            if !names.insert(name) {
                bail!("{file}: two channels are called {name}, expected a name for each");
            }
            let (len, expected) = (channel.samples.len(), first.samples.len());
            if len != expected {
                bail!(
                    "{file}: channel {name} has {len} samples and {} has {expected}, expected as many of each",
                    first.header
                );
            }
            if let Some(at) = channel.samples.not_finite() {
                bail!("{file}: channel {name}: sample {} is not a finite number", at + 1);
            }
        }
        self.check_read()
    }

    /// # Errors
    /// If samples that stay in their file could not be read.
    pub fn check_read(&self) -> Result<()> {
        let failed = |channel: &Channel| match &channel.samples {
            Samples::Streamed(streamed) => streamed.failed().map(ToString::to_string),
            _ => None,
        };
        match self.channels.iter().find_map(failed) {
            Some(why) => bail!("{}: cannot be read to its end: {why}", self.file),
            None => Ok(()),
        }
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
        listed(self.channels.iter().map(|c| &c.header))
    }

    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |c| c.samples.len())
    }
}

/// What time columns are called where no word of a header says so.
const TIMES: [&str; 9] = ["t", "x", "x-axis", "elapsed", "seconds", "tsec", "tvec", "timevec", "xvalue"];
/// The unit that a column would have as a time, if its header states one or is called as times are.
fn time_unit(column: &SampleColumn) -> Option<Option<TimeUnit>> {
    let stated = meaning(&format!("{} {}", column.header, column.unit), |_| false).stated.time;
    let name = column.header.to_lowercase();
    let words = || name.split(|c: char| !(c.is_alphanumeric() || c == '-')).filter(|word| !word.is_empty());
    let is_called = words().any(|word| word.starts_with("time") || word.ends_with("time"))
        || words().next().is_some_and(|word| TIMES.contains(&word));
    // numbers of samples are called x too
    let is_numbers = stated.is_none() && column.samples.ramp() == Some(1.0);
    // another unit, such as degrees, is none of time
    let is_bare = column.unit.is_empty();
    (stated.is_some() || (is_called && is_bare && !is_numbers)).then_some(stated)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(header: &str, value: impl Fn(f64) -> f64) -> SampleColumn {
        let samples = Samples::Values((0..100).map(|n| value(f64::from(n))).collect());
        SampleColumn { number: 1, header: header.into(), unit: String::new(), samples }
    }

    #[test]
    fn ramp_with_name_or_unit_of_time_is_time() {
        for (header, step, rate_hz) in [
            ("Time since start (s)", 1e-3, 1000.0),
            ("t [ms]", 0.5, 2000.0),
            ("t_s", 1e-3, 1000.0),
            ("elapsed", 1e-3, 1000.0),
            ("timestamps", 1e-3, 1000.0),
            ("X (s)", 1e-3, 1000.0),
        ] {
            let columns = vec![column(header, |n| 5.0 + step * n), column("PX", f64::sin)];
            let waveform = Waveform::of_columns("a.mat", None, columns);
            assert_eq!(waveform.names(), "PX", "{header}");
            assert!((waveform.rate_hz.unwrap() / rate_hz - 1.0).abs() < 1e-9, "{header}");
        }
    }

    #[test]
    fn ramp_without_name_stays_and_may_not_vibrate() {
        let columns = vec![column("A", |n| 1e-3 * n), column("index", |n| n), column("t", f64::sin)];
        let waveform = Waveform::of_columns("a.mat", None, columns);
        let may: Vec<bool> = waveform.channels.iter().map(Channel::may_vibrate).collect();
        assert_eq!((waveform.names().as_str(), &may[..]), ("A, index", &[false, false][..]));
    }

    #[test]
    fn repeated_times_of_few_digits_give_mean_rate() {
        let rounded = |n: f64| (n * 3.90625e-5 * 1e4).floor() / 1e4;
        let waveform =
            Waveform::of_columns("a.csv", None, vec![column("time_s", rounded), column("PX", f64::sin)]);
        assert!((waveform.rate_hz.unwrap() / 25_600.0 - 1.0).abs() < 0.03);
        let lost = |n: f64| rounded(if n > 50.0 { n + 40.0 } else { n });
        let waveform =
            Waveform::of_columns("a.csv", None, vec![column("time_s", lost), column("PX", f64::sin)]);
        assert!(waveform.uneven.unwrap().contains("--rate-hz"));
    }

    #[test]
    fn times_of_another_length_give_no_rate() {
        let ends = SampleColumn { samples: Samples::Values(vec![0.0, 3.0]), ..column("t", |n| n) };
        assert_eq!(Waveform::of_columns("a.mat", None, vec![ends, column("PX", f64::sin)]).rate_hz, None);
    }
}

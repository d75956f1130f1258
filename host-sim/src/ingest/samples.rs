//! Sampled channels, whatever file they are from.

use anyhow::{Result, bail};

/// The channels of one recording, all sampled at the same moments.
#[derive(Debug, Clone)]
pub struct Waveform {
    /// Name of the file, for messages.
    pub file: String,
    /// Samples a second of each channel, where the file says it.
    pub rate_hz: Option<f64>,
    /// Whether its numbers are counts of a 16-bit converter, with fractions where it resolves more.
    pub is_of_counts: bool,
    pub channels: Vec<Channel>,
}

#[derive(Debug, Clone)]
pub struct Channel {
    /// Place in the file, from 1.
    pub number: usize,
    pub name: String,
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
    /// The channel of this name, or else of this number.
    ///
    /// # Errors
    /// If there is none, with the names that there are; `asked` says who asks.
    pub fn channel(&self, name: &str, asked: &str) -> Result<&Channel> {
        let name = name.trim();
        let named = self.channels.iter().find(|c| c.name.eq_ignore_ascii_case(name));
        let numbered = || self.channels.iter().find(|c| c.number.to_string() == name);
        match named.or_else(numbered) {
            Some(channel) => Ok(channel),
            None => bail!("{}: {asked}: no channel is \"{name}\", there are {}", self.file, self.names()),
        }
    }

    pub fn names(&self) -> String {
        self.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// Samples of each channel.
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |c| c.samples.len())
    }
}

//! Numbers as counts of a 16-bit converter, which is what the core takes.

use crate::ingest::samples::{Samples, SamplesIter};

/// Count of the highest number; above it are the rails, where a sample is clipped.
const LARGEST_COUNT: f64 = 32_000.0;
/// A channel that stays at its highest or lowest number for so many samples in a row may be clipped.
const FEWEST_CLIPPED: usize = 4;
/// It is if it came or went by more than so many of its smallest steps; a peak that a coarse converter shows flat is
/// reached in single steps.
const STEEPEST_PEAK: f64 = 2.5;

/// Channels that share one scale.
#[derive(Debug)]
pub struct ConvertedChannels<'a> {
    pub channels: Vec<ChannelCounts<'a>>,
    /// What a count stands for, in the numbers of the channels.
    pub step: f64,
    /// What no count stands for.
    pub zero: f64,
}

/// A channel as counts, which are made one by one: those of a long recording need no memory.
#[derive(Debug)]
pub struct ChannelCounts<'a> {
    samples: &'a Samples,
    step: f64,
    zero: f64,
    /// Numbers that are clipped below and above.
    held: [Option<f64>; 2],
}

impl<'a> ChannelCounts<'a> {
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    pub fn iter(&self) -> CountsIter<'a> {
        let &Self { samples, step, zero, held } = self;
        CountsIter { values: samples.iter(), is_counts: samples.is_counts(), step, zero, held }
    }
}

#[derive(Debug)]
pub struct CountsIter<'a> {
    values: SamplesIter<'a>,
    is_counts: bool,
    step: f64,
    zero: f64,
    held: [Option<f64>; 2],
}

impl Iterator for CountsIter<'_> {
    type Item = i16;

    fn next(&mut self) -> Option<i16> {
        let value = self.values.next()?;
        Some(match value {
            value if self.is_counts => value as i16,
            value if self.held[0] == Some(value) => i16::MIN,
            value if self.held[1] == Some(value) => i16::MAX,
            value => ((value - self.zero) / self.step).round() as i16,
        })
    }
}

impl<'a> ConvertedChannels<'a> {
    /// Counts stay as they are; other numbers are rounded so that the lowest of all is −32000 and the highest 32000.
    pub fn of(channels: &[&'a Samples]) -> Self {
        let each = channels.iter().map(|samples| samples.extremes());
        let widest = |[a, b]: [f64; 2], [low, high]: [f64; 2]| [a.min(low), b.max(high)];
        Self::within(channels, each.fold([f64::INFINITY, f64::NEG_INFINITY], widest))
    }

    /// The same with these as the lowest and the highest of all; numbers beyond them are held near them.
    pub fn within(channels: &[&'a Samples], [lowest, highest]: [f64; 2]) -> Self {
        let is_counts = channels.iter().all(|s| s.is_counts());
        let [step, zero] = match is_counts || lowest == highest {
            true => [1.0, 0.0],
            false => [0.5 * (highest - lowest) / LARGEST_COUNT, 0.5 * (lowest + highest)],
        };
        let channel = |samples: &&'a Samples| ChannelCounts { samples, step, zero, held: [None; 2] };
        Self { channels: channels.iter().map(channel).collect(), step, zero }
    }

    /// The same of probes, where numbers that are clipped are put at the rail, so that the core finds them.
    pub fn of_probes(channels: &[&'a Samples]) -> Self {
        let mut converted = Self::of(channels);
        for channel in converted.channels.iter_mut().filter(|channel| !channel.samples.is_counts()) {
            channel.held = [clipped_at(channel.samples, f64::lt), clipped_at(channel.samples, f64::gt)];
        }
        converted
    }
}

/// The outermost number of a channel if the channel is clipped there.
fn clipped_at(samples: &Samples, is_beyond: fn(&f64, &f64) -> bool) -> Option<f64> {
    let outermost = samples.iter().reduce(|a, b| if is_beyond(&b, &a) { b } else { a })?;
    let steps = || samples.iter().zip(samples.iter().skip(1)).map(|(a, b)| (b - a).abs());
    let smallest = steps().filter(|step| *step > 0.0).reduce(f64::min)?;
    let (mut held, mut came_by) = (0, 0.0);
    for (value, step) in samples.iter().zip(std::iter::once(0.0).chain(steps())) {
        if value == outermost {
            came_by = if held == 0 { step } else { came_by };
            held += 1;
            continue;
        }
        if held >= FEWEST_CLIPPED && came_by.max(step) > STEEPEST_PEAK * smallest {
            return Some(outermost);
        }
        held = 0;
    }
    (held >= FEWEST_CLIPPED && came_by > STEEPEST_PEAK * smallest).then_some(outermost)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(amplitude: f64, limit: f64, resolution: f64) -> Vec<f64> {
        let value = |n: i32| {
            let exact = (amplitude * (f64::from(n) * 0.0157).sin()).clamp(-2.0 * amplitude, limit);
            if resolution > 0.0 { (exact / resolution).round() * resolution } else { exact }
        };
        (0..4000).map(value).collect()
    }

    #[test]
    fn cut_peak_is_clipped_and_coarse_flat_peak_is_not() {
        for (amplitude, limit, resolution, expected) in
            [(1.0, 2.0, 0.0, false), (1.0, 2.0, 0.01, false), (1.0, 0.8, 0.0, true), (1.0, 0.8, 0.001, true)]
        {
            let samples = Samples::Values(sine(amplitude, limit, resolution));
            let found = clipped_at(&samples, f64::gt).is_some();
            assert_eq!(found, expected, "limit {limit}, resolution {resolution}");
            assert_eq!(clipped_at(&samples, f64::lt), None);
            let converted = ConvertedChannels::of_probes(&[&samples]);
            assert_eq!(converted.channels[0].iter().any(|count| count == i16::MAX), expected);
        }
        assert_eq!(
            clipped_at(&Samples::Values(vec![3.0; 50]), f64::gt),
            None,
            "a channel that shows one number is dead and not clipped"
        );
    }

    #[test]
    fn counts_are_passed_on_unchanged_and_numbers_use_the_range() {
        let counts = Samples::Counts(vec![-5, 7, i16::MAX]);
        let same = ConvertedChannels::of_probes(&[&counts]);
        let all = |converted: &ConvertedChannels| converted.channels[0].iter().collect::<Vec<_>>();
        assert_eq!((&all(&same)[..], same.step, same.zero), (&[-5, 7, i16::MAX][..], 1.0, 0.0));
        let values = Samples::Values(vec![-10.0, -9.0, -9.75]);
        let rounded = ConvertedChannels::of(&[&values]);
        assert_eq!((&all(&rounded)[..], rounded.zero), (&[-32_000, 32_000, -16_000][..], -9.5));
    }
}

//! Numbers as counts of a 16-bit converter, which is what the core takes.

use std::borrow::Cow;

use crate::ingest::samples::Samples;

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
    pub counts: Vec<Cow<'a, [i16]>>,
    /// What a count stands for, in the numbers of the channels.
    pub step: f64,
    /// What no count stands for.
    pub zero: f64,
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
        let is_counts = channels.iter().all(|s| matches!(s, Samples::Counts(_)));
        let [step, zero] = match is_counts || lowest == highest {
            true => [1.0, 0.0],
            false => [0.5 * (highest - lowest) / LARGEST_COUNT, 0.5 * (lowest + highest)],
        };
        let counts = channels.iter().map(|samples| match samples {
            Samples::Counts(counts) => Cow::Borrowed(&counts[..]),
            Samples::Values(values) => {
                Cow::Owned(values.iter().map(|value| ((value - zero) / step).round() as i16).collect())
            }
        });
        Self { counts: counts.collect(), step, zero }
    }

    /// The same of probes, where numbers that are clipped are put at the rail, so that the core finds them.
    pub fn of_probes(channels: &[&'a Samples]) -> Self {
        let mut converted = Self::of(channels);
        for (counts, samples) in converted.counts.iter_mut().zip(channels) {
            let Samples::Values(values) = samples else { continue };
            let ends = [(i16::MIN, clipped_at(values, f64::lt)), (i16::MAX, clipped_at(values, f64::gt))];
            for (rail, held) in ends.into_iter().filter_map(|(rail, held)| Some((rail, held?))) {
                let at_rail = counts.to_mut().iter_mut().zip(values).filter(|(_, value)| **value == held);
                at_rail.for_each(|(count, _)| *count = rail);
            }
        }
        converted
    }
}

/// The outermost number of a channel if the channel is clipped there.
fn clipped_at(values: &[f64], is_beyond: fn(&f64, &f64) -> bool) -> Option<f64> {
    let outermost = values.iter().copied().reduce(|a, b| if is_beyond(&b, &a) { b } else { a })?;
    let steps = || values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let smallest = steps().filter(|step| *step > 0.0).reduce(f64::min)?;
    let (mut held, mut came_by) = (0, 0.0);
    for (value, step) in values.iter().zip(std::iter::once(0.0).chain(steps())) {
        if *value == outermost {
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
            let values = sine(amplitude, limit, resolution);
            let found = clipped_at(&values, f64::gt).is_some();
            assert_eq!(found, expected, "limit {limit}, resolution {resolution}");
            assert_eq!(clipped_at(&values, f64::lt), None);
            let samples = Samples::Values(values);
            let converted = ConvertedChannels::of_probes(&[&samples]);
            assert_eq!(converted.counts[0].contains(&i16::MAX), expected);
        }
        assert_eq!(
            clipped_at(&[3.0; 50], f64::gt),
            None,
            "a channel that shows one number is dead and not clipped"
        );
    }

    #[test]
    fn counts_are_passed_on_unchanged_and_numbers_use_the_range() {
        let counts = Samples::Counts(vec![-5, 7, i16::MAX]);
        let same = ConvertedChannels::of_probes(&[&counts]);
        assert_eq!((&same.counts[0][..], same.step, same.zero), (&[-5, 7, i16::MAX][..], 1.0, 0.0));
        let values = Samples::Values(vec![-10.0, -9.0, -9.75]);
        let rounded = ConvertedChannels::of(&[&values]);
        assert_eq!((&rounded.counts[0][..], rounded.zero), (&[-32_000, 32_000, -16_000][..], -9.5));
    }
}

//! Pulses in the keyphasor's channel, by levels that an outlier does not move.

use anyhow::{Result, bail};
use rotor_edge_core::extraction::KeyphasorDetector;

use super::counts::ConvertedChannels;
use super::mark::Mark;
use super::mark::intervals;
use super::settings::KeyphasorSettings;
use super::train::regular_share;
use crate::ingest::samples::{Channel, Samples};

/// Pulses are regular if they are for so large a part of the time; then no other levels are tried.
const REGULAR: f64 = 0.5;
/// Outliers make fewer pulses than this part of those without them.
const RARE: usize = 10;
/// How often the rarer half of the range is taken for outliers.
const MOST_LEVELS: usize = 8;
/// An edge that takes so much of the range between two samples has no moment between them.
const STEEP: f64 = 0.6;
/// Hysteresis, as a part of the range.
const HYSTERESIS: f64 = 0.2;

/// Where a channel passes its threshold.
#[derive(Debug)]
pub struct Pulses {
    pub all: Vec<Mark>,
    /// In the channel's unit.
    pub threshold: f64,
    /// The outermost number that the channel came to after each, in its unit.
    pub heights: Vec<f64>,
    /// Whether most edges lie between two samples, so that the moment is known to one sample.
    pub is_steep: bool,
}

/// Finds them; `unit_per_number` is what a number of the channel stands for.
///
/// # Errors
/// If there is none.
pub fn pulses(
    file: &str,
    channel: &Channel,
    unit_per_number: f64,
    settings: &KeyphasorSettings,
) -> Result<Pulses> {
    let edges = Edges { samples: &channel.samples, unit_per_number, settings };
    let outermost = channel.samples.extremes();
    let mut found = edges.between(outermost);
    let mut levels = outermost;
    for _ in 0..MOST_LEVELS {
        let is_regular = |pulses: &Pulses| regular_share(&intervals(&pulses.all)) >= REGULAR;
        if is_regular(&found) {
            break;
        }
        let Some(inner) = without_outliers(&channel.samples, levels) else { break };
        levels = inner;
        let other = edges.between(levels);
        if is_regular(&other) && RARE * found.all.len() < other.all.len() {
            found = other;
        }
    }
    if found.all.is_empty() {
        let [low, high] = outermost.map(|number| number * unit_per_number);
        if low == high {
            bail!(
                "{file}: there is no keyphasor: channel {} is {low:.6} throughout, expected a mark a turn",
                channel.header
            );
        }
        let (way, side) = if settings.falling { ("falls", "above") } else { ("rises", "below") };
        let rearm = edges.rearm(outermost, found.threshold);
        bail!(
            "{file}: there is no keyphasor: channel {} stays between {low:.6} and {high:.6} and never {way} through \
             {:.6} after it was {side} {rearm:.6}, expected a mark a turn or another --threshold",
            channel.header,
            found.threshold
        );
    }
    Ok(found)
}

/// A channel and what its owner states of its edges.
struct Edges<'a> {
    samples: &'a Samples,
    unit_per_number: f64,
    settings: &'a KeyphasorSettings,
}

impl Edges<'_> {
    /// Threshold and hysteresis in the channel's unit, for the lowest and the highest number.
    fn levels(&self, between: [f64; 2]) -> [f64; 2] {
        let [low, high] = between.map(|number| number * self.unit_per_number);
        let threshold = self.settings.threshold.unwrap_or(0.5 * (low + high));
        [threshold, self.settings.hysteresis.unwrap_or(HYSTERESIS * (high - low))]
    }

    /// Where the channel must have been before it passes the threshold.
    fn rearm(&self, between: [f64; 2], threshold: f64) -> f64 {
        let hysteresis = self.levels(between)[1];
        if self.settings.falling { threshold + hysteresis } else { threshold - hysteresis }
    }

    fn between(&self, between: [f64; 2]) -> Pulses {
        let [threshold, hysteresis] = self.levels(between);
        let converted = ConvertedChannels::within(&[self.samples], between);
        let in_counts = |of_unit: f64| of_unit / self.unit_per_number / converted.step;
        let falling = self.settings.falling;
        let sign = if falling { -1.0 } else { 1.0 };
        let mut detector = KeyphasorDetector::new(
            (sign * (in_counts(threshold) - converted.zero / converted.step)).round() as i32,
            in_counts(hysteresis).round().max(1.0) as i32,
        );
        let turned = |count: i16| if falling { -i32::from(count) } else { count.into() };
        let steep = STEEP * (between[1] - between[0]) / converted.step;
        let (mut all, mut heights, mut steep_edges, mut before) = (Vec::new(), Vec::<i32>::new(), 0, 0);
        for (sample, count) in converted.channels[0].iter().map(turned).enumerate() {
            if let Some(age) = detector.push(count) {
                all.push(Mark { sample, age });
                heights.push(count);
                steep_edges += usize::from(f64::from(count.abs_diff(before)) >= steep);
            }
            if let Some(height) = heights.last_mut() {
                *height = count.max(*height);
            }
            before = count;
        }
        let in_unit =
            |count: i32| (converted.zero + sign * f64::from(count) * converted.step) * self.unit_per_number;
        let heights = heights.into_iter().map(in_unit).collect();
        Pulses { is_steep: 2 * steep_edges > all.len(), all, heights, threshold }
    }
}

/// The lowest and the highest number of a channel without the half of its range that holds fewer samples; nothing where that
/// leaves one number.
fn without_outliers(samples: &Samples, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let middle = 0.5 * (low + high);
    let inside = || samples.iter().filter(|x| (low..=high).contains(x));
    let below = inside().filter(|x| *x < middle).count();
    let keeps_lower = 2 * below > inside().count();
    let kept = inside().filter(|x| (*x < middle) == keeps_lower);
    let [low, high] =
        kept.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    (low < high).then_some([low, high])
}

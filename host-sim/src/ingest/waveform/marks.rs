//! The keyphasor's marks in its channel, or those that a tacho's pulses make.

use anyhow::{Result, bail};
use rotor_edge_core::extraction::KeyphasorDetector;

use super::counts::ConvertedChannels;
use super::settings::KeyphasorSettings;
use crate::ingest::samples::Channel;

/// Pulses from whose intervals the first is judged.
const FIRST_PULSES: usize = 9;

/// A moment between two samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// The sample after it.
    pub sample: usize,
    /// How long before that sample, in samples, 0 to 1.
    pub age: f32,
}

impl Mark {
    /// Samples since the first.
    pub fn at(self) -> f64 {
        self.sample as f64 - f64::from(self.age)
    }
}

/// The marks of a recording, one a turn.
#[derive(Debug)]
pub struct Marks {
    pub all: Vec<Mark>,
    /// Where the channel was passed, in its unit.
    pub threshold: f64,
    /// Pulses of a tacho that did not come.
    pub missed: usize,
    /// The sample from which on it is not known which pulse of the turn is which.
    pub reference_lost: Option<usize>,
}

/// Finds them; `unit_per_number` is what a number of the channel stands for.
///
/// # Errors
/// If there is none.
pub fn marks(
    file: &str,
    channel: &Channel,
    unit_per_number: f64,
    settings: &KeyphasorSettings,
) -> Result<Marks> {
    let converted = ConvertedChannels::of(&[&channel.samples]);
    let [low, high] = channel.samples.extremes().map(|number| number * unit_per_number);
    let threshold = settings.threshold.unwrap_or(0.5 * (low + high));
    let hysteresis = settings.hysteresis.unwrap_or(0.2 * (high - low));
    let sign = if settings.falling { -1.0 } else { 1.0 };
    let mut detector = KeyphasorDetector::new(
        (sign * (threshold / unit_per_number - converted.zero) / converted.step).round() as i32,
        (hysteresis / unit_per_number / converted.step).round().max(1.0) as i32,
    );
    let turned = |count: i16| if settings.falling { -i32::from(count) } else { count.into() };
    let samples = converted.counts[0].iter().enumerate();
    let pulses: Vec<Mark> = samples
        .filter_map(|(sample, count)| detector.push(turned(*count)).map(|age| Mark { sample, age }))
        .collect();
    if pulses.is_empty() {
        let way = if settings.falling { "falls" } else { "rises" };
        bail!(
            "{file}: there is no keyphasor: channel {} stays between {low:.6} and {high:.6} and never {way} through \
             {threshold:.6}, expected a mark a turn or another --threshold",
            channel.header
        );
    }
    Ok(match settings.pulses {
        1 => Marks { all: pulses, threshold, missed: 0, reference_lost: None },
        pulses_a_turn => of_tacho(&pulses, pulses_a_turn as usize, threshold),
    })
}

/// Every so manieth pulse, the first included. A pulse that is missing is counted by the time that passes, and one too many
/// is left out, so that the others keep their place in the turn; after a pause of a turn nobody knows it.
fn of_tacho(pulses: &[Mark], pulses_a_turn: usize, threshold: f64) -> Marks {
    let mut found = Marks { all: pulses[..1].to_vec(), threshold, missed: 0, reference_lost: None };
    let mut first: Vec<f64> =
        pulses.windows(2).take(FIRST_PULSES - 1).map(|pair| pair[1].at() - pair[0].at()).collect();
    first.sort_by(f64::total_cmp);
    let Some(mut interval) = first.get(first.len() / 2).copied() else { return found };
    let (mut last, mut place) = (pulses[0], 0);
    for pulse in &pulses[1..] {
        let elapsed = pulse.at() - last.at();
        let steps = (elapsed / interval).round() as usize;
        if steps > pulses_a_turn {
            found.reference_lost = Some(pulse.sample);
            break;
        }
        if steps == 0 {
            continue;
        }
        found.missed += steps - 1;
        interval = elapsed / steps as f64;
        (last, place) = (*pulse, (place + steps) % pulses_a_turn);
        if place == 0 {
            found.all.push(*pulse);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_and_extra_pulses_keep_others_and_pause_ends() {
        let pulse = |at: usize| Mark { sample: at, age: 0.0 };
        let mut at: Vec<usize> = (0..40).map(|k| 10 * k).collect();
        at.retain(|at| *at != 70);
        at.push(204);
        at.extend([800, 810, 820]);
        at.sort_unstable();
        let pulses: Vec<Mark> = at.into_iter().map(pulse).collect();
        let found = of_tacho(&pulses, 4, 0.0);
        let marks: Vec<usize> = found.all.iter().map(|mark| mark.sample).collect();
        assert_eq!(marks, [0, 40, 80, 120, 160, 200, 240, 280, 320, 360]);
        assert_eq!((found.missed, found.reference_lost), (1, Some(800)));
    }
}

//! The keyphasor's marks in its channel, one a turn.

use anyhow::{Result, bail};

use super::mark::Mark;
use super::mark::UnequalMarks;
use super::pulses::{Pulses, pulses};
use super::settings::KeyphasorSettings;
use super::train::{held_off, repaired};
use super::{smooth, wheel};
use crate::ingest::samples::Channel;

/// The marks of a recording, one a turn.
#[derive(Debug, Default)]
pub struct Marks {
    pub all: Vec<Mark>,
    /// Where the channel was passed, in its unit.
    pub threshold: f64,
    /// Whether they were put on a curve, as the channel shows them to one sample only.
    pub is_smoothed: bool,
    /// Pulses of a tacho that did not come.
    pub missed: usize,
    /// Teeth of a wheel that are missing in every turn.
    pub missing_teeth: usize,
    /// Whether the marks are the pulses after a wheel's gap.
    pub is_after_gap: bool,
    /// Marks that came between two turns, or within the hold-off, and were left out.
    pub extra: usize,
    /// Marks that did not come and were put in between those beside them.
    pub filled: usize,
    /// Turns from a missing mark to the next, where these are equal.
    pub gap_every: Option<usize>,
    /// The sample from which on it is not known which pulse of the turn is which.
    pub reference_lost: Option<usize>,
}

/// Finds them; `unit_per_number` is what a number of the channel stands for.
///
/// # Errors
/// If there is none, or if they repeat so that nobody knows which of them begins a turn.
pub fn marks(
    file: &str,
    channel: &Channel,
    unit_per_number: f64,
    settings: &KeyphasorSettings,
) -> Result<Marks> {
    let found = pulses(file, channel, unit_per_number, settings)?;
    let place = format!("{file}: channel {}", channel.header);
    let pulses = match settings.hold_off {
        Some(part) => held_off(&found.all, part),
        None => found.all.clone(),
    };
    let held = found.all.len() - pulses.len();
    let mut marks = match settings.pulses.unwrap_or(1) {
        1 => {
            let repaired = repaired(&pulses);
            if let Some(unequal) = &repaired.unequal {
                refuse(&place, unequal, &found)?;
            }
            Marks {
                all: repaired.marks,
                extra: held + repaired.extra,
                filled: repaired.filled,
                gap_every: repaired.gap_every,
                ..Marks::default()
            }
        }
        stated => {
            let turns = wheel::turns(&place, &pulses, stated as usize)?;
            Marks {
                all: turns.marks,
                extra: held,
                missed: turns.missed,
                missing_teeth: turns.missing_teeth,
                is_after_gap: turns.is_after_gap,
                reference_lost: turns.reference_lost,
                ..Marks::default()
            }
        }
    };
    if found.is_steep {
        smooth::smooth(&mut marks.all);
    }
    Ok(Marks { threshold: found.threshold, is_smoothed: found.is_steep, ..marks })
}

/// The heights of pulses are in one or in two groups; two are so far apart, as a part of the way from the threshold.
const TWO_HEIGHTS: f64 = 0.2;

fn refuse(place: &str, unequal: &UnequalMarks, pulses: &Pulses) -> Result<()> {
    let parts: Vec<String> = unequal.parts.iter().map(|part| format!("{:.0}°", 360.0 * part)).collect();
    let number = parts.len();
    // the median of each place in the turn
    let mut heights: Vec<f64> = (0..number)
        .map(|first| {
            let mut of_place: Vec<f64> = pulses.heights.iter().skip(first).step_by(number).copied().collect();
            of_place.sort_by(f64::total_cmp);
            of_place[of_place.len() / 2]
        })
        .collect();
    let above = |height: &f64| (height - pulses.threshold).abs();
    heights.sort_by(|a, b| above(a).total_cmp(&above(b)));
    let [lower, higher] = [heights[number - 2], heights[number - 1]];
    let remedy = match above(&higher) - above(&lower) > TWO_HEIGHTS * above(&higher) {
        true => format!("--threshold {:.4} if only the highest is a mark", 0.5 * (lower + higher)),
        false => {
            let longest = unequal.parts.iter().copied().fold(0.0, f64::max);
            format!("--hold-off {:.2} if only the first after the longest is a mark", 1.0 - 0.5 * longest)
        }
    };
    bail!(
        "{place}: gives {number} marks a turn, {} apart, expected --pulses {number}, or {remedy}",
        parts.join(" and ")
    )
}

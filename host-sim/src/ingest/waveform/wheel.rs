//! Marks of a wheel with several pulses a turn, teeth that are missing included.

use anyhow::{Result, bail};

use super::mark::Mark;
use super::mark::intervals;
use super::train::mismatch;

/// Pulses from whose intervals the first is judged.
const FIRST_PULSES: usize = 9;
/// A wheel lacks a sixth of its teeth at most, or three.
const MOST_MISSING: [usize; 2] = [6, 3];
/// An interval so much longer than the usual one is a gap.
const GAP: f64 = 1.3;
/// Intervals repeat if what differs is less than this part of the time.
const REPEATED: f64 = 0.05;
/// A length between two pulses may be a sample longer or shorter than another that is as long, and the usual one a part of that.
const SLACK: f64 = 1.5;
/// A turn is whole intervals if no more than this is left, in intervals.
const UNEVEN: f64 = 0.2;

/// Every so manieth pulse of a train.
#[derive(Debug, Default, PartialEq)]
pub struct Turns {
    pub marks: Vec<Mark>,
    /// Pulses that did not come, besides the teeth that are missing.
    pub missed: usize,
    /// Teeth that are missing in every turn.
    pub missing_teeth: usize,
    /// Whether the marks are the pulses after a gap.
    pub is_after_gap: bool,
    /// The sample from which on it is not known which pulse of the turn is which.
    pub reference_lost: Option<usize>,
}

/// One mark a turn of a wheel with `stated` pulses, or with so many places of which some are empty.
///
/// # Errors
/// If the pulses repeat after another number.
pub fn turns(place: &str, pulses: &[Mark], stated: usize) -> Result<Turns> {
    let all = intervals(pulses);
    let period = period(&all, stated);
    let Some((gap, unit)) = gap(&all, period) else {
        return Ok(of_places(pulses, stated, 0));
    };
    // pulses that are equally far from one another but for the gap stand at whole places
    let turn: f64 = all[gap..].iter().take(period).sum();
    let places = (turn / unit).round();
    let is_even = (turn / unit - places).abs() <= UNEVEN;
    let from_gap = &pulses[gap + 1..];
    if is_even && (places as usize == stated || period == stated) {
        let places = places as usize;
        return Ok(Turns { is_after_gap: true, ..of_places(from_gap, places, places - period) });
    }
    if period == stated {
        let marks = from_gap.iter().step_by(stated).copied().collect();
        return Ok(Turns { marks, is_after_gap: true, ..Turns::default() });
    }
    bail!(
        "{place}: gives {period} pulses a turn with a gap as long as {:.1} of them, expected --pulses {period}",
        all[gap] / unit
    )
}

/// After how many pulses intervals repeat: as stated unless another number near it fits much better.
fn period(intervals: &[f64], stated: usize) -> usize {
    let [part, fewest] = MOST_MISSING;
    let reach = (stated / part).max(fewest);
    let others = stated.saturating_sub(reach).max(1)..=stated + reach;
    let best = others.map(|lag| (lag, mismatch(intervals, lag))).reduce(|a, b| if b.1 < a.1 { b } else { a });
    match best {
        Some((lag, differs)) if differs < REPEATED && 3.0 * differs < mismatch(intervals, stated) => lag,
        _ => stated,
    }
}

/// The first interval that is a gap, in two periods one after another, and the usual interval around it.
fn gap(intervals: &[f64], period: usize) -> Option<(usize, f64)> {
    let usual = |from: usize| {
        let mut sorted = intervals.get(from..from + period)?.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted[(period - 1) / 2];
        let usual = || sorted.iter().filter(|d| **d <= GAP * middle);
        Some(usual().sum::<f64>() / usual().count() as f64)
    };
    let is_gap =
        |at: usize, unit: f64| intervals.get(at).is_some_and(|d| *d > (GAP * unit).max(unit + SLACK));
    (0..period.min(intervals.len())).find_map(|at| {
        let unit = usual(at)?;
        (is_gap(at, unit) && is_gap(at + period, unit)).then_some((at, unit))
    })
}

/// Every so manieth pulse, the first included. A pulse that is missing is counted by the time that passes, and one too many
/// is left out, so that the others keep their place in the turn; after a pause of a turn nobody knows it.
fn of_places(pulses: &[Mark], places: usize, missing_teeth: usize) -> Turns {
    let mut found = Turns { marks: pulses[..1].to_vec(), missing_teeth, ..Turns::default() };
    let mut first: Vec<f64> = intervals(&pulses[..pulses.len().min(FIRST_PULSES)]);
    first.sort_by(f64::total_cmp);
    let Some(mut interval) = first.get(first.len() / 2).copied() else { return found };
    let (mut last, mut place) = (pulses[0], 0);
    for pulse in &pulses[1..] {
        let elapsed = pulse.at() - last.at();
        let steps = (elapsed / interval).round() as usize;
        if steps > places {
            found.reference_lost = Some(pulse.sample);
            break;
        }
        if steps == 0 {
            continue;
        }
        if steps != missing_teeth + 1 {
            found.missed += steps - 1;
        }
        interval = elapsed / steps as f64;
        (last, place) = (*pulse, (place + steps) % places);
        if place == 0 {
            found.marks.push(*pulse);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(places: impl IntoIterator<Item = usize>) -> Vec<Mark> {
        places.into_iter().map(|sample| Mark { sample, age: 0.0 }).collect()
    }

    fn samples(turns: &Turns) -> Vec<usize> {
        turns.marks.iter().map(|mark| mark.sample).collect()
    }

    #[test]
    fn missing_and_extra_pulses_keep_others_and_pause_ends() {
        let mut places: Vec<usize> = (0..40).map(|k| 10 * k).filter(|at| *at != 70).collect();
        places.extend([204, 800, 810, 820]);
        places.sort_unstable();
        let found = of_places(&at(places), 4, 0);
        assert_eq!(samples(&found), [0, 40, 80, 120, 160, 200, 240, 280, 320, 360]);
        assert_eq!((found.missed, found.reference_lost), (1, Some(800)));
    }

    #[test]
    fn wheel_with_missing_teeth_is_read_by_places_and_by_pulses() {
        // eight places of ten samples, the last two empty, from the middle of a turn on
        let pulses = at((3..80).filter(|k| k % 8 < 6).map(|k| 10 * k));
        for stated in [8, 6] {
            let found = turns("a.csv", &pulses, stated).unwrap();
            assert_eq!(samples(&found)[..3], [80, 160, 240], "{stated}");
            assert_eq!((found.missing_teeth, found.missed, found.is_after_gap), (2, 0, true));
        }
        let says = turns("a.csv: channel kph", &pulses, 7).unwrap_err().to_string();
        assert!(says.contains("gives 6 pulses a turn with a gap as long as 3.0"), "{says}");
    }

    #[test]
    fn teeth_of_few_samples_have_no_gap_and_count_as_stated() {
        // 60 teeth at 1493 rpm and 5,000 samples/s: intervals of three and four samples
        let pulses = at((0..3000).map(|k| (3.349 * f64::from(k)).ceil() as usize));
        let found = turns("a.csv", &pulses, 60).unwrap();
        assert_eq!((found.missing_teeth, found.missed, found.is_after_gap), (0, 0, false));
        assert_eq!(found.marks.len(), 50);
    }

    #[test]
    fn two_marks_at_unequal_distances_are_counted() {
        let pulses = at((0..20).flat_map(|k| [100 * k + 7, 100 * k + 100]));
        let found = turns("a.csv", &pulses, 2).unwrap();
        assert_eq!(samples(&found)[..2], [100, 200]);
    }
}

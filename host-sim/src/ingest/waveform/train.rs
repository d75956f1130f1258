//! Marks of a keyphasor that has one a turn: what is too many, what is missing, what repeats.

use super::bridge::bridged;
use super::mark::{
    ALIKE, LONGEST_FILL, Mark, OFF_BEAT, Repaired, SAMPLE, UnequalMarks, equal_steps, intervals,
};

/// Intervals repeat if what differs is less than this part of the time, and a third of what differs one interval on.
const REPEATED: f64 = 0.05;
/// Marks at either end of a file that may be false.
const MOST_ODD: usize = 3;
/// A pulse that follows so soon, as a part of the turn, is a second trigger of the same mark.
const SECOND_TRIGGER: f64 = 0.25;

fn is_alike(a: f64, b: f64) -> bool {
    (a - b).abs() <= (ALIKE * 0.5 * (a + b)).max(SAMPLE)
}

/// Whether an interval is as long as one beside it.
fn is_regular(intervals: &[f64], i: usize) -> bool {
    let beside = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|at| intervals.get(at));
    { beside }.any(|other| is_alike(intervals[i], *other))
}

/// Turns that are unlike both beside them, which a change of speed does not do.
pub fn uneven_turns(marks: &[Mark]) -> usize {
    let all = intervals(marks);
    (0..all.len()).filter(|i| !is_regular(&all, *i)).count()
}

/// The part of the time that intervals take that are as long as one beside them.
pub fn regular_share(intervals: &[f64]) -> f64 {
    let regular: f64 = (0..intervals.len()).filter(|i| is_regular(intervals, *i)).map(|i| intervals[i]).sum();
    let all: f64 = intervals.iter().sum();
    if all > 0.0 { regular / all } else { 0.0 }
}

/// Σ|d(i + lag) − d(i)| as a part of the time, without the sample to which each length is known; infinite where there are not
/// two periods.
pub fn mismatch(intervals: &[f64], lag: usize) -> f64 {
    if intervals.len() < 2 * lag {
        return f64::INFINITY;
    }
    let pairs = || intervals.iter().zip(&intervals[lag..]);
    let [differs, all] =
        pairs().fold([0.0, 0.0], |[d, t], (a, b)| [d + ((b - a).abs() - SAMPLE).max(0.0), t + a]);
    differs / all
}

/// How many intervals repeat, if they do and are not alike; up to `most`.
fn repeats(intervals: &[f64], most: usize) -> Option<usize> {
    let next = mismatch(intervals, 1);
    (2..=most).find(|lag| {
        let differs = mismatch(intervals, *lag);
        differs < REPEATED && 3.0 * differs < next
    })
}

/// The place, below `period`, of the interval that is the longest in its period on the whole, and its part of the period.
fn longest(intervals: &[f64], period: usize) -> (usize, f64) {
    let whole = &intervals[..intervals.len() / period * period];
    let all: f64 = whole.iter().sum();
    let places =
        (0..period).map(|place| (place, whole.iter().skip(place).step_by(period).sum::<f64>() / all));
    places.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a })
}

/// How many marks come in each turn, if several do at unequal distances.
fn several(intervals: &[f64]) -> Option<usize> {
    repeats(intervals, 8).filter(|_| regular_share(intervals) < 0.5)
}

/// Pulses without those that come within `part` of an interval after the one before.
pub fn held_off(pulses: &[Mark], part: f64) -> Vec<Mark> {
    let mut kept: Vec<Mark> = Vec::new();
    let all = intervals(pulses);
    // the first after the longest interval of a turn begins it, where several come in each
    let (first, turn) = match several(&all) {
        Some(period) => ((longest(&all, period).0 + 1) % period, all[..period].iter().sum()),
        None => (0, typical(&all)),
    };
    // of the last intervals the middle one, so that a missing pulse makes no longer hold-off
    let mut last = [turn; 3];
    for pulse in &pulses[first.min(pulses.len())..] {
        if let Some(before) = kept.last() {
            let elapsed = pulse.at() - before.at();
            let mut sorted = last;
            sorted.sort_by(f64::total_cmp);
            if elapsed < part * sorted[1] {
                continue;
            }
            last.rotate_left(1);
            last[2] = elapsed;
        }
        kept.push(*pulse);
    }
    kept
}

/// The interval in which the middle of all time lies: many short ones do not move it.
fn typical(intervals: &[f64]) -> f64 {
    let mut sorted = intervals.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = 0.5 * sorted.iter().sum::<f64>();
    let mut passed = 0.0;
    sorted
        .iter()
        .copied()
        .find(|d| {
            passed += d;
            passed >= half
        })
        .unwrap_or(0.0)
}

/// Marks between stretches of alike turns are put right where the stretches agree on the turn's length; others stay.
pub fn repaired(pulses: &[Mark]) -> Repaired {
    let all = intervals(pulses);
    let period = several(&all);
    if period.is_none_or(|period| longest(&all, period).1 < 1.0 - SECOND_TRIGGER)
        && let Some(bridged) = bridged(pulses, &all, period.is_some())
    {
        return bridged;
    }
    if let Some(period) = period {
        return unequal(pulses, &all, period);
    }
    let (pulses, cut) = without_ends(pulses);
    let all = intervals(pulses);
    let mut repaired =
        Repaired { marks: pulses.iter().take(1).copied().collect(), extra: cut, ..Repaired::default() };
    let mut gaps = Vec::new();
    let mut i = 0;
    while i < all.len() {
        let before =
            i.checked_sub(1).map(|last| all[last]).filter(|_| i < 2 || is_alike(all[i - 2], all[i - 1]));
        match before.and_then(|before| odd_stretch(&all, i, before)) {
            Some((end, turns, turn)) => {
                let start = pulses[i].at();
                for place in 1..turns {
                    let due = start + turn * place as f64;
                    let near = pulses[i + 1..end]
                        .iter()
                        .min_by(|a, b| (a.at() - due).abs().total_cmp(&(b.at() - due).abs()));
                    match near.filter(|mark| (mark.at() - due).abs() <= OFF_BEAT * turn) {
                        Some(mark) => repaired.marks.push(*mark),
                        None => {
                            gaps.push(repaired.marks.len());
                            repaired.filled += 1;
                            repaired.marks.push(Mark::between(due));
                        }
                    }
                }
                let kept = turns - 1;
                repaired.extra += (end - i - 1).saturating_sub(kept);
                repaired.marks.push(pulses[end]);
                i = end;
            }
            None => {
                repaired.marks.push(pulses[i + 1]);
                i += 1;
            }
        }
    }
    repaired.gap_every = equal_steps(&gaps);
    repaired
}

/// Pulses without those at either end that come too early to be a turn's; and how many these are.
fn without_ends(pulses: &[Mark]) -> (&[Mark], usize) {
    let all = intervals(pulses);
    let first = odd_ones(&mut all.iter().copied());
    let last = odd_ones(&mut all.iter().rev().copied());
    match pulses.get(first..pulses.len() - last) {
        Some(kept) => (kept, first + last),
        None => (pulses, 0),
    }
}

/// Intervals before the first two that are alike, if they are all shorter.
fn odd_ones(intervals: &mut dyn Iterator<Item = f64>) -> usize {
    let first: Vec<f64> = intervals.take(MOST_ODD + 2).collect();
    let regular = first.windows(2).position(|pair| is_alike(pair[0], pair[1]));
    let is_short = |at: &usize| first[..*at].iter().all(|odd| *odd < (1.0 - ALIKE) * first[*at]);
    regular.filter(is_short).unwrap_or(0)
}

/// Intervals from `i` on that are no turns although those before and after them are: the pulse that ends them, the turns that
/// they make up, and the length of each.
fn odd_stretch(all: &[f64], i: usize, before: f64) -> Option<(usize, usize, f64)> {
    if is_alike(all[i], before) {
        return None;
    }
    let mut length = 0.0;
    for end in i + 1..all.len() {
        length += all[end - 1];
        if length > (LONGEST_FILL as f64 + 1.5) * before {
            return None;
        }
        let after = all[end];
        if !is_alike(before, after) {
            continue;
        }
        let turn = 0.5 * (before + after);
        let turns = (length / turn).round();
        if turns >= 1.0 && (length / turn - turns).abs() <= OFF_BEAT {
            return Some((end, turns as usize, length / turns));
        }
    }
    None
}

/// Several marks a turn: second triggers of the first are left out, others are told.
fn unequal(pulses: &[Mark], all: &[f64], period: usize) -> Repaired {
    let (gap, part) = longest(all, period);
    let first = (gap + 1) % period;
    if part >= 1.0 - SECOND_TRIGGER {
        let marks: Vec<Mark> = pulses.iter().skip(first).step_by(period).copied().collect();
        let extra = pulses.len() - first - marks.len();
        return Repaired { marks, extra, ..Repaired::default() };
    }
    let whole = all.len() / period * period;
    let sum = |place: usize| all[..whole].iter().skip(place).step_by(period).sum::<f64>();
    let total: f64 = all[..whole].iter().sum();
    let parts = (0..period).map(|k| sum((first + k) % period) / total).collect();
    Repaired { marks: pulses.to_vec(), unequal: Some(UnequalMarks { parts }), ..Repaired::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(places: &[f64]) -> Vec<Mark> {
        places.iter().map(|at| Mark::between(*at)).collect()
    }

    fn places(marks: &[Mark]) -> Vec<f64> {
        marks.iter().map(|mark| mark.at().round()).collect()
    }

    #[test]
    fn extra_and_missing_marks_between_turns_are_put_right() {
        let turns: Vec<f64> = (0..30).map(|k| 100.0 * f64::from(k)).collect();
        let mut shown = turns.clone();
        shown.retain(|at| *at != 700.0 && *at != 1400.0 && *at != 1500.0);
        shown.extend([307.0, 2040.0, 2060.0]);
        shown.sort_by(f64::total_cmp);
        let repaired = repaired(&at(&shown));
        assert_eq!(places(&repaired.marks), turns);
        assert_eq!((repaired.extra, repaired.filled, repaired.gap_every), (3, 3, None));
    }

    #[test]
    fn clean_marks_stay_and_run_up_is_not_repaired() {
        for exponent in [1.0, 0.5, 0.8] {
            let shown: Vec<f64> = (1..60).map(|k| 1000.0 * f64::from(k).powf(exponent)).collect();
            let repaired = repaired(&at(&shown));
            assert_eq!(repaired.marks, at(&shown), "{exponent}");
            assert_eq!((repaired.extra, repaired.filled), (0, 0));
        }
    }

    #[test]
    fn second_trigger_of_every_turn_is_left_out() {
        // the file begins between a mark and its second trigger
        let shown: Vec<f64> =
            (0..20).flat_map(|k| [7.0, 100.0].map(|at| at + 100.0 * f64::from(k))).collect();
        let repaired = repaired(&at(&shown));
        assert_eq!(places(&repaired.marks)[..2], [100.0, 200.0]);
        assert_eq!(repaired.unequal, None);
        let held = held_off(&at(&shown), 0.3);
        assert_eq!(places(&held)[..2], [100.0, 200.0]);
    }

    #[test]
    fn unequal_marks_are_told_with_their_parts_of_turn() {
        let shown: Vec<f64> = (0..20).flat_map(|k| [0.0, 45.0].map(|at| at + 100.0 * f64::from(k))).collect();
        let parts = repaired(&at(&shown)).unequal.unwrap().parts;
        assert!((parts[0] - 0.45).abs() < 1e-9 && (parts[1] - 0.55).abs() < 1e-9, "{parts:?}");
    }

    #[test]
    fn pulses_that_fall_on_other_samples_are_no_unequal_marks() {
        // 60 teeth at 1493 rpm and 12,800 samples/s: intervals of 8 and 9 samples, in turn
        let shown: Vec<f64> = (0..3000).map(|k| (8.573 * f64::from(k)).ceil()).collect();
        assert_eq!(repaired(&at(&shown)).unequal, None);
    }

    #[test]
    fn gaps_at_equal_distances_are_told() {
        for every in [3, 4, 10] {
            let shown: Vec<f64> = (0..70).filter(|k| k % every != 1).map(|k| 100.0 * f64::from(k)).collect();
            let repaired = repaired(&at(&shown));
            assert_eq!(repaired.gap_every, Some(every as usize));
            assert!(repaired.unequal.is_none());
        }
        let shown: Vec<f64> = (0..70).filter(|k| k % 7 != 3).map(|k| 100.0 * f64::from(k)).collect();
        let repaired = repaired(&at(&shown));
        assert_eq!((repaired.filled, repaired.gap_every), (10, Some(7)));
    }

    #[test]
    fn missing_marks_of_any_share_up_to_one_in_three_are_bridged() {
        // a linear congruential generator: at random, and the same each time
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1_u32 << 31)
        };
        for share in [0.1, 0.25, 1.0 / 3.0] {
            for exponent in [1.0, 0.9] {
                // steady, and a run-up after some turns
                let turns: Vec<f64> = (20..220).map(|k| 1000.0 * f64::from(k).powf(exponent)).collect();
                let mut shown = turns.clone();
                let (first, last) = (turns[0], turns[199]);
                // at most four in a row
                let mut run = 0;
                shown.retain(|at| {
                    let stays = *at == first || *at == last || random() >= share || run == LONGEST_FILL;
                    run = if stays { 0 } else { run + 1 };
                    stays
                });
                let repaired = repaired(&at(&shown));
                assert_eq!(repaired.filled, turns.len() - shown.len(), "{share} {exponent}");
                let off = |(a, b): (&Mark, &f64)| (a.at() - b).abs() / 1000.0;
                let off = repaired.marks.iter().zip(&turns).map(off).fold(0.0, f64::max);
                assert!(off < 0.01 && repaired.gap_every.is_none(), "{share} {exponent}: {off}");
            }
        }
    }

    #[test]
    fn pause_between_missing_marks_is_not_filled() {
        let paused = |k: i32| (40..50).contains(&k) || k % 4 == 3;
        let shown: Vec<f64> = (0..90).filter(|k| !paused(*k)).map(|k| 100.0 * f64::from(k)).collect();
        let repaired = repaired(&at(&shown));
        assert_eq!(repaired.filled, (0..89).filter(|k| k % 4 == 3 && !(39..50).contains(k)).count());
        assert!(intervals(&repaired.marks).iter().filter(|d| **d > 101.0).count() == 1);
    }

    #[test]
    fn second_triggers_are_not_taken_for_missing_marks() {
        for (every, part) in [(5, 0.5), (5, 0.25), (1, 0.25), (1, 0.2)] {
            let shown: Vec<f64> = (0..60)
                .flat_map(|k| [Some(f64::from(k)), (k % every == 0).then_some(f64::from(k) + part)])
                .flatten()
                .map(|turn| 1000.0 * turn)
                .collect();
            assert_eq!(repaired(&at(&shown)).filled, 0, "{every} {part}");
        }
    }
}

//! Marks of a keyphasor that misses pulses, at random or regularly.

use super::mark::Mark;
use super::train::{ALIKE, LONGEST_FILL, OFF_BEAT, Repaired, SAMPLE, equal_steps, mark_at};

/// Marks with those that did not come put in, where each interval is a whole number of turns and most are one turn: then none
/// is too many. Of intervals that repeat, every second one may be longer, and the vibration must tell them from a wheel's.
pub fn bridged(pulses: &[Mark], all: &[f64], repeats: bool) -> Option<Repaired> {
    // where no mark is too many, the shortest is one turn
    let (shortest, turn) = all.iter().copied().enumerate().reduce(|a, b| if b.1 < a.1 { b } else { a })?;
    let mut turns = vec![1; all.len()];
    let places = [(shortest..all.len()).collect::<Vec<_>>(), (0..shortest).rev().collect()];
    for place in places {
        let mut turn = turn;
        for i in place {
            turns[i] = whole_turns(all[i], turn)?;
            // after a pause nobody knows how many passed
            turn = if turns[i] > 0 { all[i] / turns[i] as f64 } else { turn };
        }
    }
    let single = turns.iter().filter(|turns| **turns == 1).count();
    let are_most = if repeats { 2 * single + 1 >= all.len() } else { 2 * single > all.len() + 1 };
    if turns.iter().all(|turns| *turns < 2) || !are_most {
        return None;
    }
    let mut bridged = Repaired { marks: vec![pulses[0]], ..Repaired::default() };
    let mut gaps = Vec::new();
    for (i, turns) in turns.into_iter().enumerate() {
        let turn = all[i] / turns.max(1) as f64;
        for place in 1..turns {
            gaps.push(bridged.marks.len());
            bridged.marks.push(mark_at(pulses[i].at() + turn * place as f64));
        }
        bridged.marks.push(pulses[i + 1]);
    }
    Some(Repaired { filled: gaps.len(), gap_every: equal_steps(&gaps), ..bridged })
}

/// How many turns an interval is, by the length of the turn beside it; 0 if more than are filled in.
fn whole_turns(interval: f64, turn: f64) -> Option<usize> {
    let turns = (interval / turn).round();
    if turns > LONGEST_FILL as f64 + 1.0 {
        return Some(0);
    }
    // either length is known to a sample
    let slack = (ALIKE * turn).max(SAMPLE * (turns + 1.0)).min(2.0 * OFF_BEAT * turn);
    (turns >= 1.0 && (interval - turns * turn).abs() <= slack).then_some(turns as usize)
}

#[cfg(test)]
mod tests {
    use super::super::train::{intervals, repaired};
    use super::*;

    fn at(places: &[f64]) -> Vec<Mark> {
        places.iter().map(|at| mark_at(*at)).collect()
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

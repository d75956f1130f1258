//! Marks of a keyphasor that misses pulses, at random or regularly.

use super::mark::{ALIKE, LONGEST_FILL, Mark, OFF_BEAT, Repaired, SAMPLE, equal_steps};

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
            bridged.marks.push(Mark::between(pulses[i].at() + turn * place as f64));
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

//! Vectors that repeat to the bit more often than chance allows: stale data under fresh numbers.
//!
//! The chances are learned, so that they contain the noise and the resolution of what arrives:
//!
//! ```text
//! first repeat      p = (r + 1)/(c + 5) after r repeats in c comparisons with a predecessor that had moved
//! next repeat       (r' + w p)/(c' + w) after r' of c' with a predecessor that had repeated, w = c + 5, at most 16;
//!                   2 r'/(c' + r') if that is more
//! run of k repeats  the product of these, each repeat counted before the next
//! ```
//!
//! The first two are means of beta distributions: Beta(1, 4) before anything is known, since a stated noise contains the
//! rounding, so that one of five readings repeats at a guess; then the first repeat's mean as prior of the next one's. The
//! third halves the chance that a run ends: a value in the middle of a rounding step stays longer than the mean one does.
//!
//! A run is too long below a chance of 1e-6: after 68 repeats at the start, 6 when 60 readings have moved, 2 when 2,000 have.
//! Such a run teaches nothing.
//!
//! Not found: a loop longer than [`HISTORY`] readings, a loop of one probe while others move, and a sender whose
//! resolution hides the noise is taken for a stale one.

use crate::reading::{MAX_PROBES, ProbeVector, Reading};
use crate::scalar;

/// Chance below which a run is none.
const LEAST_CHANCE: f32 = 1e-6;
/// Comparisons that the first repeat's prior counts for, one of them a repeat.
const PRIOR_COMPARISONS: f32 = 5.0;
/// Comparisons that the first repeat's chance counts for in the next one's, at most.
const MOST_PRIOR: f32 = 16.0;
/// Comparisons after which both counts are halved: what the sender does now outweighs what it did.
const MOST_COMPARISONS: u16 = 4096;
/// Readings back to which a loop is looked for.
pub const HISTORY: usize = 64;

/// Which vectors repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Repetition {
    /// No probe moved since the reading before.
    pub is_whole: bool,
    /// Bit i: probe i has repeated too often; all bits if the whole reading has, or is part of a loop.
    pub excess_mask: u8,
}

/// Runs of repeats of each probe and of whole readings, and loops of readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeats {
    probes: [Run; MAX_PROBES],
    whole: Run,
    cycle: Cycle,
}

/// The present run of repeats, and how often there was one.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Run {
    chance: f32,
    /// Repeats, as long as the chance was not too small.
    length: u16,
    after_move: Counts,
    after_repeat: Counts,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Counts {
    comparisons: u16,
    repeats: u16,
}

/// A sequence of readings that comes again.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cycle {
    checksums: [u32; HISTORY],
    newest: u8,
    /// Checksums that are known.
    known: u8,
    /// The least distance at which the last reading was met before; zero if it was not.
    lag: u8,
    /// At one distance; the reading that chose the distance does not count.
    run: Run,
}

impl Repeats {
    /// Compares a reading with the last value of each probe, lost where there was none.
    pub fn update(&mut self, last: &[ProbeVector; MAX_PROBES], reading: &Reading) -> Repetition {
        let (mut excess_mask, mut compared, mut moved) = (0, false, false);
        for (place, ((run, last), now)) in self.probes.iter_mut().zip(last).zip(reading.probes()).enumerate()
        {
            if last.is_finite() && now.is_finite() {
                compared = true;
                moved |= now != last;
                excess_mask |= u8::from(run.is_too_long(now == last)) << place;
            }
        }
        let is_whole = compared && !moved;
        if (compared && self.whole.is_too_long(is_whole)) | self.cycle.is_closed(checksum(reading)) {
            excess_mask = u8::MAX;
        }
        Repetition { is_whole, excess_mask }
    }
}

impl Default for Repeats {
    fn default() -> Self {
        Self { probes: [Run::NONE; MAX_PROBES], whole: Run::NONE, cycle: Cycle::default() }
    }
}

impl Run {
    const NONE: Self = {
        let none = Counts { comparisons: 0, repeats: 0 };
        Self { chance: 1.0, length: 0, after_move: none, after_repeat: none }
    };

    /// Takes a comparison; whether the run is longer than chance allows.
    fn is_too_long(&mut self, is_repeat: bool) -> bool {
        let is_by_chance = self.chance >= LEAST_CHANCE;
        if !is_repeat {
            if is_by_chance {
                self.after_move.add(1, self.length.min(1));
                self.after_repeat.add(self.length, self.length.saturating_sub(1));
            }
            (self.chance, self.length) = (1.0, 0);
        } else if is_by_chance {
            self.chance *= self.chance_of_repeat();
            self.length = self.length.saturating_add(1);
        }
        self.chance < LEAST_CHANCE
    }

    fn chance_of_repeat(&self) -> f32 {
        let Counts { comparisons, repeats } = self.after_move.and(self.length.min(1));
        let prior = f32::from(comparisons) + PRIOR_COMPARISONS;
        let first = (f32::from(repeats) + 1.0) / prior;
        if self.length == 0 {
            return first;
        }
        let weight = scalar::lesser(prior, MOST_PRIOR);
        let Counts { comparisons, repeats } = self.after_repeat.and(self.length.saturating_sub(1));
        let next = (f32::from(repeats) + weight * first) / (f32::from(comparisons) + weight);
        // Of no repeats the second is zero or not a number.
        let known = f32::from(self.after_repeat.repeats);
        scalar::greater(next, 2.0 * known / (f32::from(self.after_repeat.comparisons) + known))
    }
}

impl Counts {
    fn add(&mut self, comparisons: u16, repeats: u16) {
        if self.comparisons >= MOST_COMPARISONS {
            *self = Self { comparisons: self.comparisons / 2, repeats: self.repeats / 2 };
        }
        self.comparisons = self.comparisons.saturating_add(comparisons);
        self.repeats = self.repeats.saturating_add(repeats);
    }

    /// With the repeats of the present run.
    fn and(self, repeats: u16) -> Self {
        let comparisons = self.comparisons.saturating_add(repeats);
        Self { comparisons, repeats: self.repeats.saturating_add(repeats) }
    }
}

impl Default for Cycle {
    fn default() -> Self {
        Self { checksums: [0; HISTORY], newest: 0, known: 0, lag: 0, run: Run::NONE }
    }
}

impl Cycle {
    /// Takes a reading's checksum; whether readings have come again in their order for longer than chance allows.
    ///
    /// No run of one is: three readings at least were met before, which checksums do by accident once in 1e27.
    fn is_closed(&mut self, checksum: u32) -> bool {
        let goes_on = self.lag != 0 && self.before(self.lag) == Some(checksum);
        let met = if goes_on { self.lag } else { self.least_lag(checksum) };
        // Met nowhere is not met at any distance.
        let is_compared = self.lag != 0 || (met == 0 && self.known >= 2);
        let is_too_long = is_compared && self.run.is_too_long(goes_on);
        self.lag = met;
        self.known = self.known.saturating_add(1);
        self.newest = (self.newest + 1) % HISTORY as u8;
        if let Some(newest) = self.checksums.get_mut(usize::from(self.newest)) {
            *newest = checksum;
        }
        is_too_long
    }

    /// The checksum of the reading `lag` before the one that comes.
    fn before(&self, lag: u8) -> Option<u32> {
        let place = usize::from(self.newest) + 1 + HISTORY - usize::from(lag);
        self.checksums.get(place % HISTORY).copied()
    }

    /// How far back a checksum was met last, the newest left out; zero if nowhere.
    fn least_lag(&self, checksum: u32) -> u8 {
        let newest = usize::from(self.newest);
        let is_met = |&met: &u32| met == checksum;
        let (later, earlier) = (self.checksums.get(..newest), self.checksums.get(newest + 1..));
        let later = later.and_then(|later| later.iter().rposition(is_met)).map(|place| newest - place);
        let earlier = || earlier?.iter().rposition(is_met).map(|place| HISTORY - 1 - place);
        later.or_else(earlier).map_or(0, |distance| distance as u8 + 1)
    }
}

/// Of the bits of all vectors, word by word (Fx, of Firefox): a cyclic code without a table takes ten times as long.
fn checksum(reading: &Reading) -> u32 {
    let words = reading.probes().iter().flat_map(|probe| [probe.cos_um.to_bits(), probe.sin_um.to_bits()]);
    words.fold(0, |sum: u32, word| (sum.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b9))
}

#[cfg(test)]
mod tests;

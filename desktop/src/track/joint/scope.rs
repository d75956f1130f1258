//! Scope of an event.

use crate::track::coefficients::FollowedNumber;

/// Unknowns that an event may have changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    pub bearings: BearingSet,
    pub unbalance: bool,
    /// Something between the bearings that changed bearings cannot represent near one speed: a seal or a bow. The
    /// unbalance is then assumed unchanged.
    pub elsewhere: bool,
    /// An instrument; the machine is then assumed unchanged.
    pub instrument: Option<Instrument>,
    /// Bearings and unbalance start again from wide priors, as after an outage; nothing of them is known from before.
    pub restart: bool,
}

/// Some of a machine's bearings, by their numbers in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BearingSet(u32);

impl BearingSet {
    const NONE: Self = Self(0);

    /// The bearings of a range; a machine has fewer than 32.
    fn range(bearings: std::ops::Range<usize>) -> Self {
        Self(bearings.fold(0, |bits, bearing| bits | 1 << bearing))
    }

    pub fn contains(self, bearing: usize) -> bool {
        self.0 >> bearing & 1 == 1
    }

    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..u32::BITS as usize).filter(move |bearing| self.contains(*bearing))
    }
}

/// Instrument that an event changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instrument {
    /// Gain of a probe, by its number.
    Gain(usize),
    /// Phase reference, which turns all probes alike.
    PhaseReference,
}

/// An event at an epoch.
pub type EventAt = (usize, Scope);

impl Scope {
    const fn new(bearings: BearingSet, unbalance: bool) -> Self {
        Self { bearings, unbalance, elsewhere: false, instrument: None, restart: false }
    }

    const fn of_instrument(instrument: Instrument) -> Self {
        Self { instrument: Some(instrument), ..Self::new(BearingSet::NONE, false) }
    }

    /// All bearings and the unbalance: covers any event in the machine whose scope is not yet known.
    pub fn whole(bearings: usize) -> Self {
        Self::new(BearingSet::range(0..bearings), true)
    }

    /// A machine that is new after an outage.
    pub fn restart(bearings: usize) -> Self {
        Self { restart: true, ..Self::whole(bearings) }
    }

    /// Scopes of events in a machine with so many bearings: each bearing, neighbours, as they share a load, and all of them, with and
    /// without the unbalance; the unbalance alone; something else.
    fn machine(bearings: usize) -> Vec<Self> {
        let single: Vec<BearingSet> = (0..bearings).map(|b| BearingSet::range(b..b + 1)).collect();
        let pairs = (1..bearings).map(|b| BearingSet::range(b - 1..b + 1));
        let several =
            pairs.chain([BearingSet::range(0..bearings)]).flat_map(|set| [(set, false), (set, true)]);
        let alone =
            [false, true].into_iter().flat_map(|unbalance| single.iter().map(move |set| (*set, unbalance)));
        let mut all = vec![Self::new(BearingSet::NONE, true)];
        for (set, unbalance) in alone.chain(several) {
            // of few bearings a pair is all of them, or one is
            let scope = Self::new(set, unbalance);
            if !all.contains(&scope) {
                all.push(scope);
            }
        }
        all.push(Self { elsewhere: true, ..Self::new(BearingSet::NONE, false) });
        all
    }

    /// Every scope of an event at any time, on a machine with so many bearings and probes.
    pub fn all(bearings: usize, probes: usize) -> Vec<Self> {
        let gains = (0..probes).map(Instrument::Gain);
        let instruments = gains.chain([Instrument::PhaseReference]).map(Self::of_instrument);
        Self::machine(bearings).into_iter().chain(instruments).collect()
    }

    /// Number of free real parameters, for a machine with these followed numbers and so many planes.
    pub fn freedom(self, numbers: &[FollowedNumber], planes: usize) -> usize {
        let bearings = numbers.iter().filter(|n| self.bearings.contains(n.bearing)).count();
        bearings + if self.unbalance { 2 * planes } else { 0 }
    }

    /// Whether the model of the machine changes.
    pub fn is_of_model(self) -> bool {
        self.elsewhere || !self.bearings.is_empty()
    }

    /// Whether the probes' factors change.
    pub fn has_factors(self) -> bool {
        self.elsewhere || self.instrument.is_some()
    }

    pub fn is_gain(self) -> bool {
        matches!(self.instrument, Some(Instrument::Gain(_)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{sample_rotor, train};
    use crate::track::coefficients::followed;

    /// Bearings of each scope in the machine, and whether the unbalance is in it.
    fn told(bearings: usize) -> Vec<(Vec<usize>, bool)> {
        let scopes = Scope::machine(bearings);
        assert!(scopes.last().unwrap().elsewhere);
        scopes[..scopes.len() - 1].iter().map(|s| (s.bearings.iter().collect(), s.unbalance)).collect()
    }

    #[test]
    fn scopes_of_one_two_and_four_bearings_are_without_repetition() {
        assert_eq!(told(1), [(vec![], true), (vec![0], false), (vec![0], true)]);
        let two = [
            (vec![], true),
            (vec![0], false),
            (vec![1], false),
            (vec![0], true),
            (vec![1], true),
            (vec![0, 1], false),
            (vec![0, 1], true),
        ];
        assert_eq!(told(2), two);
        let four = told(4);
        assert_eq!(four.len(), 1 + 2 * (4 + 3 + 1));
        assert!(four.contains(&(vec![1, 2], false)) && four.contains(&(vec![0, 1, 2, 3], true)));
    }

    #[test]
    fn freedom_counts_numbers_of_changed_bearings_and_all_planes() {
        let numbers = followed(&train());
        assert_eq!(Scope::whole(4).freedom(&numbers, 3), 16 + 6);
        assert_eq!(Scope::new(BearingSet::range(1..3), false).freedom(&numbers, 3), 8);
        assert_eq!(Scope::whole(2).freedom(&followed(&sample_rotor()), 2), 12);
    }
}

//! Scope of an event.

use crate::track::coefficients::PER_BEARING;

/// Unknowns that an event may have changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    pub bearings: [bool; 2],
    pub unbalance: bool,
    /// Something between the bearings that changed bearings cannot represent near one speed: a seal or a bow. The
    /// unbalance is then assumed unchanged.
    pub elsewhere: bool,
    /// An instrument; the machine is then assumed unchanged.
    pub instrument: Option<Instrument>,
    /// Bearings and unbalance start again from wide priors, as after an outage; nothing of them is known from before.
    pub restart: bool,
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
    /// Scopes of events in the machine.
    pub const MACHINE: [Self; 8] = [
        Self::new([false, false], true),
        Self::new([true, false], false),
        Self::new([false, true], false),
        Self::new([true, false], true),
        Self::new([false, true], true),
        Self::new([true, true], false),
        Self::WHOLE,
        Self { elsewhere: true, ..Self::new([false, false], false) },
    ];

    /// All bearings and the unbalance: covers any event in the machine whose scope is not yet known.
    pub const WHOLE: Self = Self::new([true, true], true);

    /// A machine that is new after an outage.
    pub const RESTART: Self = Self { restart: true, ..Self::WHOLE };

    const fn new(bearings: [bool; 2], unbalance: bool) -> Self {
        Self { bearings, unbalance, elsewhere: false, instrument: None, restart: false }
    }

    const fn of_instrument(instrument: Instrument) -> Self {
        Self { instrument: Some(instrument), ..Self::new([false, false], false) }
    }

    /// Every scope of an event at any time, on a machine with so many probes.
    pub fn all(probes: usize) -> Vec<Self> {
        let gains = (0..probes).map(Instrument::Gain);
        let instruments = gains.chain([Instrument::PhaseReference]).map(Self::of_instrument);
        Self::MACHINE.into_iter().chain(instruments).collect()
    }

    /// Number of free real parameters, for a machine with so many planes.
    pub fn freedom(self, planes: usize) -> usize {
        let bearings = self.bearings.iter().filter(|b| **b).count();
        bearings * PER_BEARING + if self.unbalance { 2 * planes } else { 0 }
    }

    /// Whether the model of the machine changes.
    pub fn is_of_model(self) -> bool {
        self.elsewhere || self.bearings.contains(&true)
    }

    /// Whether the probes' factors change.
    pub fn has_factors(self) -> bool {
        self.elsewhere || self.instrument.is_some()
    }

    pub fn is_gain(self) -> bool {
        matches!(self.instrument, Some(Instrument::Gain(_)))
    }
}

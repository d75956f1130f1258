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
}

/// An event at an epoch.
pub type EventAt = (usize, Scope);

impl Scope {
    pub const ALL: [Self; 8] = [
        Self::new([false, false], true),
        Self::new([true, false], false),
        Self::new([false, true], false),
        Self::new([true, false], true),
        Self::new([false, true], true),
        Self::new([true, true], false),
        Self::new([true, true], true),
        Self { elsewhere: true, ..Self::new([false, false], false) },
    ];

    const fn new(bearings: [bool; 2], unbalance: bool) -> Self {
        Self { bearings, unbalance, elsewhere: false }
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
}

//! What an event may be.

use crate::track::coefficients::PER_BEARING;

/// What an event may have changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scope {
    pub bearings: [bool; 2],
    pub unbalance: bool,
    /// Something between the bearings that near one speed no bearing can stand for: a seal that begins to act, a
    /// bow. The unbalance itself is then taken to go on as it was.
    pub elsewhere: bool,
}

/// An event at an epoch.
pub type Change = (usize, Scope);

impl Scope {
    /// Everything that an event can be.
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

    /// Real numbers that such an event is free in, of a machine with so many planes.
    pub fn freedom(self, planes: usize) -> usize {
        let bearings = self.bearings.iter().filter(|b| **b).count();
        bearings * PER_BEARING + if self.unbalance { 2 * planes } else { 0 }
    }

    /// Whether the model of the machine has to change with it.
    pub fn is_of_model(self) -> bool {
        self.elsewhere || self.bearings.contains(&true)
    }
}

//! Gyroscopic moments of disks and shaft.

use super::{Effect, Knowledge, Place, Scales, switched_on, unless};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// The polar inertia couples the planes: a term `iΩ² G` between x and y.
pub struct Gyroscopic;

impl Effect for Gyroscopic {
    fn name(&self) -> &'static str {
        "gyroscopic"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        unless(self.not_sought(rotor))
    }

    fn not_sought(&self, rotor: &Rotor) -> Option<&'static str> {
        switched_on(rotor.physics.gyroscopic)
    }

    fn apply(&self, _: &Rotor, _: Place, _: &[f64], _: &Scales, terms: &mut Terms) {
        terms.physics.gyroscopic = true;
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "Disks that tilt while they spin resist with a moment across the tilt: forward whirl is stiffened, \
                   backward whirl softened, both with speed squared.",
            means: "Nothing is wrong with the machine; the model was made without the polar inertia of its disks.",
            inspect: "Check the polar inertias in the file; nothing needs to be opened.",
        }
    }
}

//! Rotary inertia of the shaft's cross-sections.

use super::{Effect, Knowledge, Place, Scales, switched_on, unless};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// Inertia of the tilting sections of the shaft, in the mass.
pub struct RotaryInertia;

impl Effect for RotaryInertia {
    fn name(&self) -> &'static str {
        "rotary_inertia"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        unless(self.not_sought(rotor))
    }

    fn not_sought(&self, rotor: &Rotor) -> Option<&'static str> {
        switched_on(rotor.physics.rotary_inertia)
    }

    fn apply(&self, _: &Rotor, _: Place, _: &[f64], _: &Scales, terms: &mut Terms) {
        terms.physics.rotary_inertia = true;
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "Sections of the shaft have inertia against tilting, which lowers the bending resonances a little, \
                   the higher ones more.",
            means: "Nothing is wrong with the machine; the model leaves out a small inertia of a thick shaft.",
            inspect: "Check diameters in the file; nothing needs to be opened.",
        }
    }
}

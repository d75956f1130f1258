//! Shear flexibility of the shaft.

use super::{Effect, Knowledge, Place, Scales, switched_on, unless};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// Timoshenko's shear flexibility in every shaft element.
pub struct ShearDeformation;

impl Effect for ShearDeformation {
    fn name(&self) -> &'static str {
        "shear_deformation"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        unless(self.not_sought(rotor))
    }

    fn not_sought(&self, rotor: &Rotor) -> Option<&'static str> {
        switched_on(rotor.physics.shear_deformation)
    }

    fn apply(&self, _: &Rotor, _: Place, _: &[f64], _: &Scales, terms: &mut Terms) {
        terms.physics.shear_deformation = true;
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "Short, thick pieces of shaft shear as well as bend, so the shaft is softer than slender-beam theory \
                   says and its bending resonances lie lower.",
            means: "Nothing is wrong with the machine; the model treats a stout shaft as a slender one.",
            inspect: "Check diameters and lengths in the file; nothing needs to be opened.",
        }
    }
}

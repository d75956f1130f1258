//! A constant rotating force from the coupling.

use super::{Effect, Knowledge, Pattern, Place, Unknown, coupled_ends, end};
use crate::machine::drawing::Rotor;

/// A force at the coupled end, the right one where no place says otherwise, that turns with the shaft and does not depend on speed.
pub struct CouplingForce;

impl Effect for CouplingForce {
    fn name(&self) -> &'static str {
        "coupling_force"
    }

    fn general(&self) -> &'static str {
        "coupling_misaligned"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        coupled_ends()
    }

    fn unknowns(&self, _: &Rotor, place: Place) -> Vec<Unknown> {
        let pattern = Pattern::End(end(place));
        vec![Unknown { name: "n", unit: "N", pattern, per_unit: 1.0, largest: f64::INFINITY }]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "A force at the coupled end of the shaft turns with it and is the same at every speed. It acts mostly on the bearing next to the coupling.",
            means: "Misaligned or eccentric coupling halves, an unevenly tightened or worn coupling.",
            inspect: "Alignment hot and cold, face and rim runout of the coupling, bolts; look for a line at twice \
                      running speed.",
        }
    }
}

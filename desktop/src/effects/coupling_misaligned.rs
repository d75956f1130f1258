//! A misaligned coupling: a force and a moment that turn with the shaft.

use super::{Effect, Knowledge, Pattern, Place, Unknown, coupled_ends, end};
use crate::machine::drawing::Rotor;

/// A force and a moment at the coupled end, the right one where no place says otherwise, both turning with the shaft and the same at every speed.
pub struct CouplingMisaligned;

impl Effect for CouplingMisaligned {
    fn name(&self) -> &'static str {
        "coupling_misaligned"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        coupled_ends()
    }

    fn unknowns(&self, _: &Rotor, place: Place) -> Vec<Unknown> {
        let at = |name, unit, pattern| Unknown { name, unit, pattern, per_unit: 1.0, largest: f64::INFINITY };
        let end = end(place);
        vec![at("n", "N", Pattern::End(end)), at("nm", "N·m", Pattern::EndTilt(end))]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The coupling forces the end of the shaft aside and bends it as well: a force and a moment that turn \
                   with the shaft and are the same at every speed.",
            means: "Halves bolted up with an offset and an angle between them, coupling faces that are not square, a \
                    spacer or disc pack fitted askew.",
            inspect: "Face and rim runout of both halves, alignment hot and cold, the bolts; look for a line at twice \
                      running speed.",
        }
    }
}

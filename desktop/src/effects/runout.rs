//! Runout of the surfaces that the probes look at.

use super::{Effect, Knowledge, Pattern, Place, Unknown};
use crate::machine::drawing::Rotor;

/// A vector at each probe that is the same at every speed and moves nothing.
pub struct Runout;

impl Effect for Runout {
    fn name(&self) -> &'static str {
        "runout"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        vec![Place::Machine]
    }

    fn unknowns(&self, rotor: &Rotor, _: Place) -> Vec<Unknown> {
        let at =
            |p| Unknown { name: "v", unit: "m", pattern: Pattern::Runout(p), per_unit: 1.0, largest: 1e-3 };
        (0..rotor.probe.len()).map(at).collect()
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "Each probe sees its track's own unroundness or uneven permeability: a vector that is there at every \
                   speed, different at each probe, and not a motion of the shaft.",
            means: "Scratches, a track that is not concentric, residual magnetism, or chrome on the probe track.",
            inspect: "Measure slow roll and subtract it; dress or degauss the probe track.",
        }
    }
}

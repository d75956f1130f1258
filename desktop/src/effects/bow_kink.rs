//! A shaft that is bent at one place more than elsewhere.

use super::{Effect, Knowledge, Pattern, Place, Unknown};
use crate::machine::drawing::Rotor;

/// A permanent bow of which half a sine is not enough: a half and a full sine between the bearings, which follow a kink at
/// any place within a thirtieth of its height.
pub struct BowKink;

impl Effect for BowKink {
    fn name(&self) -> &'static str {
        "bow_kink"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        vec![Place::Machine]
    }

    fn unknowns(&self, rotor: &Rotor, _: Place) -> Vec<Unknown> {
        let largest = 0.01 * rotor.length_m();
        let bow = |name, pattern| Unknown { name, unit: "m", pattern, per_unit: 1.0, largest };
        vec![bow("half", Pattern::Bow), bow("full", Pattern::FullBow)]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The shaft is bent when it is free, more on one side of its middle than on the other, as by a kink. \
                Held in its bearings, it causes a rotating force that is the same at every speed. \
                Its distribution along the shaft differs from that of a bow.",
            means: "A disk or sleeve shrunk on askew, or a joint of a built-up rotor whose faces are not \
                square. Unevenly tightened tie bolts, or a shaft yielded at a fillet.",
            inspect: "Runout along the shaft on rollers: a bow is round, a kink has a corner. Faces, fit and bolts \
                      there.",
        }
    }
}

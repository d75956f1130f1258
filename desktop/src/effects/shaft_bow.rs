//! A bent shaft.

use super::{Effect, Knowledge, Pattern, Place, Unknown};
use crate::machine::drawing::Rotor;

/// A permanent bow, half a sine between the bearings: a rotating force that does not depend on speed.
pub struct ShaftBow;

impl Effect for ShaftBow {
    fn name(&self) -> &'static str {
        "shaft_bow"
    }

    fn general(&self) -> &'static str {
        "thermal_bow"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        vec![Place::Machine]
    }

    fn unknowns(&self, rotor: &Rotor, _: Place) -> Vec<Unknown> {
        let largest = 0.01 * rotor.length_m();
        vec![Unknown { name: "m", unit: "m", pattern: Pattern::Bow, per_unit: 1.0, largest }]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The shaft is bent when it is free. Held in its bearings, it causes a rotating force that is the same at every speed. So \
                it shows at slow roll already, and above a resonance it can cancel the unbalance.",
            means: "A thermal bow, a shaft left standing while warm, a heavy rub, or a bent shaft after transport.",
            inspect: "Slow-roll vectors and their change with temperature; runout of the shaft on rollers.",
        }
    }
}

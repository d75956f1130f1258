//! A shaft that bends as it warms up.

use super::{Effect, Knowledge, Pattern, Place, Unknown};
use crate::machine::drawing::Rotor;

/// A bow that grows evenly through each run, from the one at its start; models that know no run have it as at the end.
pub struct ThermalBow;

impl Effect for ThermalBow {
    fn name(&self) -> &'static str {
        "thermal_bow"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        vec![Place::Machine]
    }

    fn unknowns(&self, rotor: &Rotor, _: Place) -> Vec<Unknown> {
        let largest = 0.01 * rotor.length_m();
        let bow = |name, pattern| Unknown { name, unit: "m", pattern, per_unit: 1.0, largest };
        vec![bow("cold", Pattern::Bow), bow("growth", Pattern::GrowingBow)]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The shaft bends further while the run lasts: the vector turns and grows from reading to reading by \
                   more than the speed explains, and does not come back the way it went.",
            means: "A shaft heated on one side by a light rub or in its journal. A winding or insulation that warms unevenly, or parts that shift as \
                they expand.",
            inspect: "Vectors at constant speed over an hour, run-up against coast-down, slow roll cold and hot, bearing \
                      temperatures, and rub marks.",
        }
    }
}

//! Unbalance at a disk outside the planes that are sought.

use super::{Effect, Knowledge, Pattern, Place, Unknown};
use crate::machine::drawing::Rotor;
use crate::units::same_place;

/// A further unbalance, at one disk.
pub struct UnbalancePlane;

impl Effect for UnbalancePlane {
    fn name(&self) -> &'static str {
        "unbalance_plane"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        let at_a_plane =
            |i: &usize| rotor.plane.iter().any(|p| same_place(p.position_m, rotor.disk[*i].position_m));
        (0..rotor.disk.len()).filter(|i| !at_a_plane(i)).map(Place::Disk).collect()
    }

    fn unknowns(&self, _: &Rotor, place: Place) -> Vec<Unknown> {
        let Place::Disk(i) = place else { return Vec::new() };
        let pattern = Pattern::DiskUnbalance(i);
        vec![Unknown { name: "u", unit: "kg·m", pattern, per_unit: 1.0, largest: f64::INFINITY }]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "A force that turns with the shaft and grows with speed squared, at a disk where the model has no \
                   unbalance plane.",
            means: "Material lost or gained at that disk: a blade, a balance weight, deposits, an eccentric fit.",
            inspect: "The disk itself: blades, weights, deposits, fit on the shaft. Balance there, not only at the \
                      planes of the model.",
        }
    }
}

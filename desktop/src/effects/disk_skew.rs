//! A disk that is not square to the shaft.

use super::{Effect, Knowledge, Pattern, Place, Unknown};
use crate::machine::drawing::Rotor;

/// A moment `(I_d − I_p) τ Ω²` that turns with the shaft, τ the angle between disk and shaft.
pub struct DiskSkew;

impl Effect for DiskSkew {
    fn name(&self) -> &'static str {
        "disk_skew"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        let skewable = |i: &usize| lever(rotor, *i) != 0.0;
        (0..rotor.disk.len()).filter(skewable).map(Place::Disk).collect()
    }

    fn unknowns(&self, rotor: &Rotor, place: Place) -> Vec<Unknown> {
        let Place::Disk(i) = place else { return Vec::new() };
        let pattern = Pattern::DiskTilt(i);
        vec![Unknown { name: "rad", unit: "rad", pattern, per_unit: lever(rotor, i), largest: 0.2 }]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "A disk mounted at a small angle tries to right itself: a moment that turns with the shaft and grows \
                   with speed squared. It moves the two bearings against each other.",
            means: "A disk pressed on askew, a dirty or worn shoulder, a bent coupling hub.",
            inspect: "Axial runout of the disk's face; the fit and shoulder it sits on.",
        }
    }
}

fn lever(rotor: &Rotor, disk: usize) -> f64 {
    let d = &rotor.disk[disk];
    d.diametral_inertia_kg_m2 - d.polar_inertia_kg_m2
}

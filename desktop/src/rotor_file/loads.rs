//! What the shaft's weight puts on its film bearings.

use crate::bearing::Law;
use crate::machine::drawing::Rotor;
use crate::shaft::statics::statics;

/// Gives every film whose file states no load its share of the weight: of a horizontal shaft on bearings
/// at their heights.
/// Where statics has no answer the load stays unknown, which the checks of the machine tell.
pub fn assign_loads(rotor: &mut Rotor) {
    let waits = |law: &Law| matches!(law, Law::Film(film) if film.carries_weight());
    let drawn =
        !rotor.shaft.is_empty() && rotor.shaft.iter().all(|s| s.length_m > 0.0 && s.outer_diameter_m > 0.0);
    if !drawn || !rotor.bearing.iter().any(|b| waits(&b.law)) {
        return;
    }
    let Ok(found) = statics(rotor, &rotor.elevations_m()) else { return };
    for (bearing, load_n) in rotor.bearing.iter_mut().zip(found.load_n) {
        if let Law::Film(film) = &mut bearing.law
            && film.carries_weight()
        {
            film.carry(load_n);
        }
    }
}

//! A fit as the file of a rotor.

use super::parameters;
use crate::effects::entry;
use crate::fit::Fit;
use crate::fit::hypothesis::Hypothesis;
use crate::machine::drawing::{EffectEntry, Rotor};
use crate::rotor_file::SCHEMA;
use crate::unbalance::g_mm_deg;

/// A fitted hypothesis as the file of a rotor: bearings, with what was stated of them, planes and effects. What the file
/// states of runs that the data do not hold stays as it is.
pub fn as_file(with: &Hypothesis, fit: &Fit) -> Rotor {
    let mut rotor = with.rotor.clone();
    rotor.schema = rotor.schema.max(SCHEMA);
    rotor.bearing.iter_mut().for_each(|b| b.stated = Some(b.law.clone()));
    with.bearings.assign(&mut rotor, &fit.x);
    for (plane, u) in rotor.plane.iter_mut().zip(&fit.unknowns) {
        let [magnitude, angle] = g_mm_deg(*u);
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(magnitude), Some(angle));
    }
    let parts = parameters::split(with, fit);
    let fitted: Vec<EffectEntry> = (with.effects.iter().zip(parts))
        .map(|(a, (real, phasors))| {
            entry::written(with.rotor, a.effect, a.place, &with.scales, &real, phasors)
        })
        .collect();
    rotor.effect.retain(|e| !fitted.iter().any(|f| (&f.kind, &f.at) == (&e.kind, &e.at)));
    rotor.effect.extend(fitted);
    rotor.physics = with.terms(&fit.x).physics;
    rotor
}

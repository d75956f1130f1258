//! Damping inside the shaft.

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// Viscous damping that turns with the shaft, η times its stiffness: nothing for circular forward
/// whirl, `2iΩη K` for backward whirl at running speed.
pub struct InternalDamping;

impl Effect for InternalDamping {
    fn name(&self) -> &'static str {
        "internal_damping"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        vec![Place::Machine]
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        let scale = Scale::Linear(0.01 / scales.fastest_rad_s);
        vec![Parameter { name: "eta", unit: "s", scale, bounds: [0.0, f64::INFINITY] }]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.01 / scales.fastest_rad_s]]
    }

    fn apply(&self, _: &Rotor, _: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        terms.internal_damping_s = parameters[0];
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "Friction inside the rotor turns with it. A shaft that whirls forward in a circle is not flexed, so only the backward part of \
                the motion is damped. Above the first resonance it drives forward whirl.",
            means: "Shrink fits, splines or built-up rotors that slip, rubber in the coupling.",
            inspect: "Fits of disks and sleeves, coupling elements; look for a sub-synchronous line at the first \
                      natural frequency.",
        }
    }
}

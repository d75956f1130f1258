//! A bearing on a foundation that gives.

use super::{
    Effect, Knowledge, Parameter, Place, Scales, bearings, carrying, pedestal_mass, positive_damping,
};
use crate::bearing::support::Pedestal;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// Mass, spring and damper in series under one bearing.
pub struct OnPedestal;

impl Effect for OnPedestal {
    fn name(&self) -> &'static str {
        "pedestal"
    }

    fn general(&self) -> &'static str {
        "pedestal_by_direction"
    }

    fn as_general(&self, parameters: &[f64]) -> Option<Vec<f64>> {
        let &[stiffness_n_m, mass_kg, damping_n_s_m] = parameters else { return None };
        Some(vec![stiffness_n_m, stiffness_n_m, mass_kg, damping_n_s_m])
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        free_to_move(rotor)
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        vec![carrying("k", scales), pedestal_mass(scales), positive_damping()]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let mut starts = Vec::new();
        for stiffness in [1.0, 4.0] {
            for resonance in [0.5, 0.8, 1.5] {
                let k = stiffness * scales.stiffness_n_m;
                let m = k / (resonance * scales.fastest_rad_s).powi(2);
                starts.push(vec![k, m, 0.05 * k / scales.fastest_rad_s]);
            }
        }
        starts
    }

    fn strengthened(&self, scales: &Scales, parameters: &[f64], strength: f64) -> Vec<f64> {
        softened(&self.parameters(scales), parameters, strength)
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let &[stiffness_n_m, mass_kg, damping_n_s_m] = parameters else { return };
        terms.bearing_mut(place).pedestal = Some(Pedestal::isotropic(stiffness_n_m, damping_n_s_m, mass_kg));
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The housing under one bearing moves: a mass on a spring in series with the oil film, with a \
                   resonance of its own. Where it is stiff and light it only softens the bearing; its resonance is \
                   what gives it away.",
            means: "A soft or loose foundation, a cracked grout or sole plate, a bolt that lost its tension, or a \
                    casing that resonates.",
            inspect: "Seismic probe on the housing over the same run-up; bolt tension, grout, and the gap under each \
                      foot.",
        }
    }
}

/// Parameters of a pedestal that is so many times as soft. Its resonance stays the same as long as its mass stays within what physics
/// allows.
pub(super) fn softened(parameters: &[Parameter], of: &[f64], strength: f64) -> Vec<f64> {
    parameters.iter().zip(of).map(|(p, v)| (v / strength).min(p.bounds[1])).collect()
}

/// Every bearing whose housing the drawing leaves on rigid ground.
pub(super) fn free_to_move(rotor: &Rotor) -> Vec<Place> {
    let mut places = bearings(rotor);
    places.retain(|p| !matches!(p, Place::Bearing(i) if rotor.stands(*i)));
    places
}

//! Bearings that stiffen or soften with speed.

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales, bearings, switched_on, unless};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// `k(Ω) = k (1 + s (Ω/Ω_ref − 1))` for every bearing or for one, where no law states how they follow speed.
pub struct SpeedDependentStiffness;

impl Effect for SpeedDependentStiffness {
    fn name(&self) -> &'static str {
        "speed_dependent_stiffness"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        let mut places = unless(self.not_sought(rotor));
        if !places.is_empty() && rotor.bearing.len() > 1 {
            places.extend(bearings(rotor));
        }
        places
    }

    fn not_sought(&self, rotor: &Rotor) -> Option<&'static str> {
        switched_on(rotor.bearing.iter().any(|b| b.law.as_law().follows_speed()))
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        // the stiffness stays positive from standstill to the fastest speed
        let bounds = [-1.0 / (scales.fastest_rad_s / scales.reference_rad_s - 1.0).max(1e-3), 1.0];
        vec![Parameter { name: "slope", unit: "", scale: Scale::Linear(1.0), bounds }]
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.05], vec![-0.05], vec![0.5], vec![-0.5]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], scales: &Scales, terms: &mut Terms) {
        for (_, law) in terms.bearings_mut().filter(|(at, _)| place == Place::Machine || *at == place) {
            law.stiffness_slope += parameters[0];
            law.reference_rad_s = scales.reference_rad_s;
        }
    }

    fn settings(&self, scales: &Scales) -> Vec<(&'static str, f64)> {
        vec![("ref", scales.reference_rad_s)]
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The stiffness of all bearings, or of this one, changes with speed, so one value cannot place all resonances.",
            means: "Fluid-film bearings: the film thins or thickens as load, oil temperature and speed change.",
            inspect: "Oil temperature and supply pressure over speed; compare with the bearing maker's coefficients.",
        }
    }
}

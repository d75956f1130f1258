//! A housing that moves more in one direction than in the other.

use super::pedestal::{free_to_move, softened};
use super::{Effect, Knowledge, Parameter, Place, Scales, carrying, pedestal_mass, positive_damping};
use crate::bearing::support::Pedestal;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// A mass in series with one bearing, on springs that differ along x and y.
pub struct PedestalByDirection;

impl Effect for PedestalByDirection {
    fn name(&self) -> &'static str {
        "pedestal_by_direction"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        free_to_move(rotor)
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        vec![carrying("kx", scales), carrying("ky", scales), pedestal_mass(scales), positive_damping()]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let mut starts = Vec::new();
        for [kx, ky] in [[1.0, 3.0], [3.0, 1.0]] {
            for resonance in [0.5, 0.8, 1.5] {
                let k = scales.stiffness_n_m;
                let m = k / (resonance * scales.fastest_rad_s).powi(2);
                starts.push(vec![kx * k, ky * k, m, 0.05 * k / scales.fastest_rad_s]);
            }
        }
        starts
    }

    fn strengthened(&self, scales: &Scales, parameters: &[f64], strength: f64) -> Vec<f64> {
        softened(&self.parameters(scales), parameters, strength)
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let &[kx, ky, mass_kg, damping_n_s_m] = parameters else { return };
        terms.bearing_mut(place).pedestal = Some(Pedestal {
            stiffness_n_m: [kx, ky],
            damping_n_s_m: [damping_n_s_m; 2],
            mass_kg: [mass_kg; 2],
        });
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The housing under one bearing moves, and more easily in one direction than in the other: two \
                   resonances of its own instead of one.",
            means: "A pedestal that is loose or cracked on one side, a flexible casing foot, piping that holds it one way.",
            inspect: "Seismic probes on the housing, horizontal and vertical, over the same run-up; bolts, grout and \
                      the gap under each foot.",
        }
    }
}

//! A seal or labyrinth at a disk.

use nalgebra::Matrix2;

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales, disks};
use crate::bearing::support::SupportLaw;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// A support at a disk: direct stiffness and damping, the same in x and y, and cross-coupling.
pub struct Seal;

impl Effect for Seal {
    fn name(&self) -> &'static str {
        "seal"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        disks(rotor)
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        let (k, c) = (scales.stiffness_n_m, scales.stiffness_n_m / scales.fastest_rad_s);
        let any = f64::INFINITY;
        vec![
            Parameter { name: "k", unit: "N/m", scale: Scale::Linear(k), bounds: [0.0, any] },
            Parameter { name: "q", unit: "N/m", scale: Scale::Linear(k), bounds: [-any, any] },
            Parameter { name: "c", unit: "N·s/m", scale: Scale::Linear(c), bounds: [0.0, any] },
        ]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let (k, c) = (scales.stiffness_n_m, scales.stiffness_n_m / scales.fastest_rad_s);
        vec![vec![0.02 * k, 0.05 * k, 0.02 * c], vec![0.02 * k, -0.05 * k, 0.02 * c]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let &[k, q, c] = parameters else { return };
        let law = SupportLaw::linear(Matrix2::new(k, q, -q, k), Matrix2::identity() * c);
        terms.supports.push((place, law));
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The gas or liquid in a seal around one disk holds the shaft there: a spring, a damper and a \
                   cross-coupled stiffness. Forward whirl at one speed sees only Ωc − q, not the two apart.",
            means: "A labyrinth or balance-piston seal that was left out of the model, was replaced, or rubs.",
            inspect: "Seal clearances and wear at this disk, swirl brakes, and whether the vibration follows load \
                      (pressure) rather than speed.",
        }
    }
}

//! A disk that is heavier or lighter than drawn.

use nalgebra::Matrix2;

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales, disks};
use crate::bearing::support::SupportLaw;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// A mass added to (or missing from) one disk.
pub struct DiskMass;

impl Effect for DiskMass {
    fn name(&self) -> &'static str {
        "disk_mass"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        disks(rotor)
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        let scale = Scale::Linear(scales.stiffness_n_m / scales.fastest_rad_s.powi(2));
        vec![Parameter { name: "kg", unit: "kg", scale, bounds: [f64::NEG_INFINITY, f64::INFINITY] }]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let mass = scales.stiffness_n_m / scales.fastest_rad_s.powi(2);
        vec![vec![0.01 * mass], vec![-0.01 * mass]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let law =
            SupportLaw { mass_kg: parameters[0], ..SupportLaw::linear(Matrix2::zeros(), Matrix2::zeros()) };
        terms.supports.push((place, law));
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "One disk is heavier or lighter than the drawing says, which moves the resonances whose shape has \
                   motion at that disk.",
            means: "Deposits or erosion, a part added or left out, or a wrong figure in the drawing.",
            inspect: "Weigh or recompute the disk with everything that is mounted on it; look for deposits.",
        }
    }
}

//! The pull of an air gap on a disk.

use nalgebra::Matrix2;

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales, disks};
use crate::bearing::support::SupportLaw;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// A direct stiffness below zero at one disk, the same in x and y, without damping.
pub struct MagneticPull;

impl Effect for MagneticPull {
    fn name(&self) -> &'static str {
        "magnetic_pull"
    }

    fn general(&self) -> &'static str {
        "seal"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        disks(rotor)
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        let scale = Scale::Linear(scales.stiffness_n_m);
        vec![Parameter { name: "k", unit: "N/m", scale, bounds: [f64::NEG_INFINITY, 0.0] }]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![-0.01 * scales.stiffness_n_m]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let law = SupportLaw::linear(Matrix2::identity() * parameters[0], Matrix2::zeros());
        terms.supports.push((place, law));
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "A magnetic field pulls the rotor the way it already moves: a spring of negative stiffness at one \
                   disk, without damping, that lowers the resonances with motion there.",
            means: "The air gap of a motor or generator under field, or a magnetic bearing's bias.",
            inspect: "Compare a run under field with a coast-down without; the air gap all round; look for a line at \
                      twice the supply frequency.",
        }
    }
}

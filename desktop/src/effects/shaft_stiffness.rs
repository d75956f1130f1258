//! A length of shaft that is softer or stiffer than drawn.

use nalgebra::Matrix2;

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales};
use crate::bearing::support::SupportLaw;
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;
use crate::machine::place::STRAINS;
use crate::machine::span;

/// Stiffest and softest a length of shaft can be: a sleeve or hub shrunk on makes it three quarters thicker, a deep crack or a
/// groove takes away almost half of the diameter.
const BOUNDS: [f64; 2] = [0.1, 10.0];

/// A factor on the stiffness, in bending and in shear, of a length of shaft, the same in every direction. The mass stays.
///
/// Readings of a shaft that turns steadily hold no more: a stiffness that differs from one direction of the shaft to another, as
/// of an open crack, turns with it and shows at twice the speed. Its mean over the directions is this factor.
pub struct ShaftStiffness;

impl Effect for ShaftStiffness {
    fn name(&self) -> &'static str {
        span::SHAFT_STIFFNESS
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        span::sought(rotor).into_iter().map(Place::Span).collect()
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        vec![Parameter { name: "factor", unit: "", scale: Scale::Logarithmic, bounds: BOUNDS }]
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.7]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let (Place::Span(span), &[factor]) = (place, parameters) else { return };
        // per unit of strain energy, so that the whole length as drawn has one
        let law = SupportLaw::linear(Matrix2::identity() * (factor - 1.0), Matrix2::zeros());
        terms.supports.extend((0..STRAINS).map(|shape| (Place::Strain(span, shape), law.clone())));
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "A length of shaft between two neighbouring bearings or disks bends more or less easily than drawn, \
                   which moves the resonances that bend it. A short weak place within that length looks much like a \
                   smaller change of the whole length.",
            means: "A crack, a loose sleeve or shrink fit, a hub that stiffens the shaft, or a wrong diameter in the \
                    drawing.",
            inspect: "Check diameters, sleeves and fits over this length; if they are as drawn, look for a crack: the \
                      line at twice the speed, and dye penetrant or ultrasonic testing.",
        }
    }
}

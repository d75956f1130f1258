//! Cross-coupled stiffness of one bearing.

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales, bearings};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// `k_xy = q`, `k_yx = −q` at one bearing.
pub struct CrossCoupledStiffness;

impl Effect for CrossCoupledStiffness {
    fn name(&self) -> &'static str {
        "cross_coupled_stiffness"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        let open = |i: &usize| rotor.bearing[*i].law.as_law().opens_cross_terms();
        let mut places = bearings(rotor);
        // where the law leaves them to the data they are no effect
        places.retain(|p| !matches!(p, Place::Bearing(i) if open(i)));
        places
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        let scale = Scale::Linear(scales.stiffness_n_m);
        vec![Parameter { name: "q", unit: "N/m", scale, bounds: [f64::NEG_INFINITY, f64::INFINITY] }]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.02 * scales.stiffness_n_m], vec![-0.02 * scales.stiffness_n_m]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let law = terms.bearing_mut(place);
        law.stiffness_n_m[(0, 1)] += parameters[0];
        law.stiffness_n_m[(1, 0)] -= parameters[0];
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "A displacement in x causes a force in y at one bearing. For positive q it pushes the shaft along a \
                   forward whirl and takes damping from it; backward whirl is damped instead.",
            means: "The oil film of a plain or lightly loaded bearing; the usual way towards oil whirl.",
            inspect: "Bearing clearance, load and alignment, oil viscosity; look for a sub-synchronous line near half \
                      speed.",
        }
    }
}

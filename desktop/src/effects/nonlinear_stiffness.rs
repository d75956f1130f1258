//! Bearings whose stiffness depends on the amplitude.

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// The describing function `k (1 + ¾ κ a²)` of a cubic spring at both bearings, in each direction.
pub struct NonlinearStiffness;

impl Effect for NonlinearStiffness {
    fn name(&self) -> &'static str {
        "nonlinear_stiffness"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        vec![Place::Machine]
    }

    fn parameters(&self, scales: &Scales) -> Vec<Parameter> {
        let scale = Scale::Linear(scales.amplitude_m.powi(-2));
        vec![Parameter { name: "kappa", unit: "1/m²", scale, bounds: [f64::NEG_INFINITY, f64::INFINITY] }]
    }

    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
        let unit = scales.amplitude_m.powi(-2);
        vec![vec![0.02 * unit], vec![-0.02 * unit]]
    }

    fn apply(&self, _: &Rotor, _: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        for (_, law) in terms.bearings_mut() {
            law.hardening_per_m2 = parameters[0];
        }
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The bearings become stiffer or softer as the shaft moves more, so the resonance shifts and leans as weight is added. It shows near resonance only.",
            means: "A large amplitude for the clearance, a rub that acts as a spring, or looseness.",
            inspect: "Compare run-ups with different unbalance; bearing clearance, rub marks, looseness.",
        }
    }
}

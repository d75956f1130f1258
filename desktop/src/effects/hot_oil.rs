//! A film bearing whose oil is thinner or thicker than stated.

use super::{Effect, Knowledge, Parameter, Place, Scales, film_factor, film_mut, films};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// A factor on the viscosity of one film.
pub struct HotOil;

impl Effect for HotOil {
    fn name(&self) -> &'static str {
        "hot_oil"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        films(rotor)
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        film_factor()
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.6], vec![0.35], vec![1.5]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        if let (Some(film), &[factor]) = (film_mut(place, terms), parameters) {
            film.viscosity_pa_s *= factor;
        }
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The viscosity in one film differs from that of the stated oil by more than a few kelvin explain: the journal runs lower in a thinner film.",
            means: "Oil that runs hot, starved or is of another grade, water or fuel in it, a cooler that fails.",
            inspect: "Drain and metal temperatures, supply pressure and flow, a sample of the oil.",
        }
    }
}

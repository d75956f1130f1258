//! A film bearing that carries another load than the weight on it.

use super::{Effect, Knowledge, Parameter, Place, Scales, film_factor, film_mut, films};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// A factor on the load of one film.
pub struct MovedLoad;

impl Effect for MovedLoad {
    fn name(&self) -> &'static str {
        "moved_load"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        films(rotor)
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        film_factor()
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        vec![vec![1.5], vec![0.6], vec![2.5]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        if let (Some(film), &[factor]) = (film_mut(place, terms), parameters) {
            film.load_n *= factor;
        }
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "One film carries more or less than the shaft puts on it by its weight: with three or more bearings alignment decides who carries what.",
            means: "Misalignment, thermal growth of a pedestal, a settled foundation, pipe or gear forces.",
            inspect: "Alignment hot and cold, shaft centreline positions of all bearings, metal temperatures of neighbours.",
        }
    }
}

//! A film bearing whose clearance is not what was made.

use super::{Effect, Knowledge, Parameter, Place, Scales, film_factor, film_mut, films};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// A factor on the clearance of one film.
pub struct WornClearance;

impl Effect for WornClearance {
    fn name(&self) -> &'static str {
        "worn_clearance"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        films(rotor)
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        film_factor()
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        vec![vec![1.4], vec![2.0], vec![0.8]]
    }

    fn apply(&self, _: &Rotor, place: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        if let (Some(film), &[factor]) = (film_mut(place, terms), parameters) {
            film.clearance_m *= factor;
        }
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The clearance of one oil film differs from the drawing by more than a bore is off: the film is softer and damps less where it is wider, at every speed by one law.",
            means: "Wear or wiped white metal, a bearing of another size fitted, or a shell that lost its crush.",
            inspect: "Lift check or lead wire at the next stop; the shaft centreline at rest against that at speed; metal temperature and oil analysis.",
        }
    }
}

//! A phase reference that is not where the file has it.

use nalgebra::Complex;

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales, unless};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// All phasors turned by one angle against the angles that the file states.
pub struct KeyphasorOffset;

impl Effect for KeyphasorOffset {
    fn name(&self) -> &'static str {
        "keyphasor_offset"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        unless(self.not_sought(rotor))
    }

    fn not_sought(&self, rotor: &Rotor) -> Option<&'static str> {
        // without a known angle to hold it against, the planes turn with it
        let known = rotor.run.iter().any(|run| !run.added_unbalance.is_empty());
        (!known).then_some("turns nothing but the planes' angles: no run states a trial weight")
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        let turn = std::f64::consts::TAU;
        vec![Parameter { name: "phase", unit: "rad", scale: Scale::Linear(1.0), bounds: [-turn, turn] }]
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        [0.3, -0.3, 1.6, -1.6, 3.1].map(|phase| vec![phase]).to_vec()
    }

    fn apply(&self, _: &Rotor, _: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        let turn = Complex::from_polar(1.0, parameters[0]);
        terms.gains.iter_mut().for_each(|gain| *gain *= turn);
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "Every probe is turned by the same angle at every speed: phases count from another mark than the \
                   angles of the trial weights do.",
            means: "The keyphasor stands elsewhere than assumed, its other edge triggers, or weights were counted from \
                    another hole or against the rotation.",
            inspect: "Mark and keyphasor at standstill against the balance plane's zero, the trigger edge, and the \
                      sense in which holes are numbered.",
        }
    }
}

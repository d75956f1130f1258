//! A speed reading that is off by a factor.

use super::{Effect, Knowledge, Parameter, Place, Scale, Scales};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// The machine runs at `factor` times the speed that the data state.
pub struct SpeedFactor;

impl Effect for SpeedFactor {
    fn name(&self) -> &'static str {
        "speed_factor"
    }

    fn places(&self, _: &Rotor) -> Vec<Place> {
        vec![Place::Machine]
    }

    fn parameters(&self, _: &Scales) -> Vec<Parameter> {
        // wider than two marks a turn or one in two, as of most gears
        vec![Parameter { name: "factor", unit: "", scale: Scale::Logarithmic, bounds: [0.1, 10.0] }]
    }

    fn starts(&self, _: &Scales) -> Vec<Vec<f64>> {
        [0.9, 1.1, 0.5, 2.0].map(|factor| vec![factor]).to_vec()
    }

    fn apply(&self, _: &Rotor, _: Place, parameters: &[f64], _: &Scales, terms: &mut Terms) {
        terms.speed_factor *= parameters[0];
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The machine turns faster or slower than the speeds in the data say, all by one factor: every \
                   resonance, and every force that grows with speed, stands at another speed than it seems to.",
            means: "Two marks or keyways a turn counted as one, the keyphasor of the other shaft of a gear, a tachometer \
                    ratio set wrongly.",
            inspect: "Marks a turn at the keyphasor, the ratio in the rack, the speed beside a stroboscope or a line \
                      in the spectrum.",
        }
    }
}

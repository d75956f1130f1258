//! A probe whose signal has the wrong sign.

use super::{Effect, Knowledge, Place, Scales};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// One probe shows the motion away from it as motion towards it: half a turn at every speed.
pub struct ProbeReversed;

impl Effect for ProbeReversed {
    fn name(&self) -> &'static str {
        "probe_reversed"
    }

    fn general(&self) -> &'static str {
        "probe_calibration"
    }

    /// A gain of 1, and half a turn.
    fn as_general(&self, _: &[f64]) -> Option<Vec<f64>> {
        Some(vec![1.0, std::f64::consts::PI])
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        (0..rotor.probe.len()).map(Place::Probe).collect()
    }

    fn apply(&self, _: &Rotor, place: Place, _: &[f64], _: &Scales, terms: &mut Terms) {
        if let Place::Probe(p) = place {
            terms.gains[p] = -terms.gains[p];
        }
    }

    fn misreading(&self, rotor: &Rotor, place: Place, _: &[f64]) -> Option<String> {
        Some(format!(
            "Probe {} shows the opposite of what the others do: its sign is reversed",
            place.name(rotor)?
        ))
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "One probe shows the right motion with the wrong sign, half a turn off at every speed.",
            means: "A probe on the other side of the shaft than the file says, or a signal inverted in wiring or in \
                    the rack.",
            inspect: "Which side of the shaft the probe looks from, the polarity of its channel, its angle in the file.",
        }
    }
}

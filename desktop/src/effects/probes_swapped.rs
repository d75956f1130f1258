//! The two probes of a bearing on each other's cables.

use super::{Effect, Knowledge, Place, Scales, bearings};
use crate::effects::terms::Terms;
use crate::machine::drawing::Rotor;

/// What the file calls one probe of a bearing is the other one.
pub struct ProbesSwapped;

impl Effect for ProbesSwapped {
    fn name(&self) -> &'static str {
        "probes_swapped"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        let mut places = bearings(rotor);
        places.retain(|p| matches!(p, Place::Bearing(i) if pair(rotor, *i).is_some()));
        places
    }

    fn apply(&self, rotor: &Rotor, place: Place, _: &[f64], _: &Scales, terms: &mut Terms) {
        let Place::Bearing(bearing) = place else { return };
        if let Some([x, y]) = pair(rotor, bearing) {
            terms.shows.swap(x, y);
        }
    }

    fn misreading(&self, rotor: &Rotor, place: Place, _: &[f64]) -> Option<String> {
        Some(format!("The two probes of bearing {} are exchanged", place.name(rotor)?))
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The two probes at one bearing are exchanged: each column holds what the other probe sees, and \
                   forward whirl there looks like backward whirl.",
            means: "Cables exchanged at the proximitors or at the rack, or channels named the wrong way round.",
            inspect: "Trace both cables from probe to channel; tap or move one probe and see which channel answers.",
        }
    }
}

/// The probes of a bearing, where they are two.
fn pair(rotor: &Rotor, bearing: usize) -> Option<[usize; 2]> {
    let here = |p: &usize| rotor.bearing_of(&rotor.probe[*p]) == Some(bearing);
    <[usize; 2]>::try_from((0..rotor.probe.len()).filter(here).collect::<Vec<_>>()).ok()
}

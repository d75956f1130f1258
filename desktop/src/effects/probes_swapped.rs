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

/// The probes of a bearing where they are two; of more, those at the place of the first one where they are two there.
fn pair(rotor: &Rotor, bearing: usize) -> Option<[usize; 2]> {
    let of_bearing = |p: &usize| rotor.bearing_of(&rotor.probe[*p]) == Some(bearing);
    let all: Vec<usize> = (0..rotor.probe.len()).filter(of_bearing).collect();
    let at_first = |all: Vec<usize>| {
        let position_m = rotor.probe[*all.first()?].position_m;
        let here = all.into_iter().filter(|p| rotor.probe[*p].position_m == position_m);
        here.collect::<Vec<_>>().try_into().ok()
    };
    all.try_into().map_or_else(at_first, Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::Probe;
    use crate::testing::sample_rotor;

    #[test]
    fn further_probes_at_a_bearing_leave_its_pair_as_it_is() {
        let mut rotor = sample_rotor();
        let own = pair(&rotor, 0).unwrap();
        let further =
            own.map(|p| Probe { position_m: rotor.probe[p].position_m + 0.1, ..rotor.probe[p].clone() });
        rotor.probe.push(further[0].clone());
        assert_eq!(pair(&rotor, 0), Some(own));
        rotor.probe.push(further[1].clone());
        assert_eq!(pair(&rotor, 0), Some(own));
        // two cables at one place may be exchanged, three in more ways than one
        let position_m = rotor.probe[own[0]].position_m;
        rotor.probe.iter_mut().rev().take(1).for_each(|p| p.position_m = position_m);
        assert_eq!(pair(&rotor, 0), None);
    }
}

//! A run that carries another unbalance than the others.

use super::{Effect, Knowledge, Pattern, Place, Unknown};
use crate::machine::drawing::Rotor;

/// In one run the unbalance of the planes differs from what all other runs and this run's stated weights say; models
/// that know no run leave it out: they are of the machine as the other runs have it.
pub struct UnbalanceOfRun;

impl Effect for UnbalanceOfRun {
    fn name(&self) -> &'static str {
        "unbalance_of_run"
    }

    fn places(&self, rotor: &Rotor) -> Vec<Place> {
        let runs: Vec<usize> = (0..rotor.run.len()).filter(|k| !rotor.run[*k].slow_roll).collect();
        let weighted = |k: usize| !rotor.run[k].added_unbalance.is_empty();
        match runs[..] {
            [] | [_] => Vec::new(),
            // which of the two changed cannot be told
            [first, later] if !weighted(first) && !weighted(later) => vec![Place::Run(later)],
            _ => runs.into_iter().map(Place::Run).collect(),
        }
    }

    fn unknowns(&self, rotor: &Rotor, place: Place) -> Vec<Unknown> {
        let Place::Run(run) = place else { return Vec::new() };
        let in_plane = |plane| Unknown {
            name: "u",
            unit: "kg·m",
            pattern: Pattern::RunUnbalance { run, plane },
            per_unit: 1.0,
            largest: f64::INFINITY,
        };
        (0..rotor.plane.len()).map(in_plane).collect()
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge {
            what: "The unbalance of one run differs from that of the other runs and its own stated \
                weights. Within the run its force grows with speed squared, like that of any \
                unbalance.",
            means: "A trial weight that is not as stated: left off, in another hole, counted against the rotation, of \
                    another mass or radius. Or a rotor that changed between run-ups: a thermal state, parts that seat \
                    anew, a weight that came loose, material lost.",
            inspect: "The weights of that run: their holes, masses and radii against the record. The fits \
                of disks and coupling. Then a further run-up in the same state, cold and hot.",
        }
    }
}

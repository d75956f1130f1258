//! An unknown force against one that is known.

use super::*;
use crate::fit::Effort;
use crate::fit::unknown::Assumption;
use crate::machine::place::SpeedLaw;

#[test]
fn a_constant_force_at_the_coupled_end_is_found_in_law_size_and_sense() {
    let mut rotor = machine();
    rotor.tolerance = None;
    let data = measured(&rotor, &run_up(40), &["coupling_force"], &DVector::zeros(0));
    let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &data));
    let h = Hypothesis::drawn(&rotor, fitter.scales(None));
    let drawing = fitter.exact_drawing();
    let fit = fitter.fit(&h, &[h.bearings.stated()], &drawing, Effort::Search, None).unwrap();

    let everywhere = fitter.unknown_causes();
    let costs = fitter.screened(&h, &fit, &drawing, &everywhere).unwrap();
    let least = |law: SpeedLaw| {
        let of_law = everywhere
            .iter()
            .zip(&costs)
            .filter(move |(a, _)| matches!(a, Assumption::Force { law: of, .. } if *of == law));
        of_law.map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min)
    };
    assert!(least(SpeedLaw::Constant) < least(SpeedLaw::Squared) - 100.0, "its law is told: {costs:?}");

    let end = Assumption::Force { position_m: rotor.length_m(), law: SpeedLaw::Constant };
    let found = fitter.with_unknown(&h, &fit, &drawing, &end).unwrap();
    let (_, _, _, truth) = every_effect().into_iter().find(|e| e.0 == "coupling_force").unwrap();
    // where it outweighs the unbalance; at speed it is hardly more than a change of it
    let slow =
        found.forces_n.iter().filter(|(speed_rad_s, _)| *speed_rad_s < 0.25 * fitter.data.fastest_rad_s());
    for (_, force_n) in slow {
        let [forward, backward] = force_n[0];
        assert!((forward - truth[0]).norm() < 0.05 * truth[0].norm(), "{forward} for {}", truth[0]);
        assert!(backward.norm() < 0.05 * truth[0].norm(), "{backward}");
    }
}

#[test]
fn a_machine_that_hides_nothing_is_explained_no_better_with_an_unknown_force() {
    let mut rotor = machine();
    rotor.tolerance = None;
    let data = measured(&rotor, &run_up(40), &[], &DVector::zeros(0));
    let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &data));
    let h = Hypothesis::drawn(&rotor, fitter.scales(None));
    let drawing = fitter.exact_drawing();
    let fit = fitter.fit(&h, &[h.bearings.stated()], &drawing, Effort::Search, None).unwrap();
    let own = fitter.cost_under_own_scatter(&fit, &drawing);
    let with = fitter.screened(&h, &fit, &drawing, &fitter.unknown_causes()).unwrap();
    assert!(with.iter().all(|cost| cost - own > -1.0), "{own}: {with:?}");
}

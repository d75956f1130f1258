//! Pedestals that are softer in one direction, far from the stiffness that a search begins with.

use crate::machines::machine::diagnosed;

#[test]
fn pedestal_by_direction_is_named_whatever_its_stiffness() {
    let all = diagnosed("pedestals");
    assert_eq!(all.len(), 4);
    for (m, answer) in &all {
        assert!(m.is_named_by(answer), "{} hides {}: {}", m.name, m.truth_label(), answer.summary);
        // a pedestal that moves alike in both directions is a special case of it, so that it fits no worse than that one
        let least = |effect: &str| {
            let of_kind = answer.candidates.iter().filter(|c| c.effect == effect);
            of_kind.map(|c| c.chi2_per_value).fold(f64::INFINITY, f64::min)
        };
        let (general, special) = (least("pedestal_by_direction"), least("pedestal"));
        assert!(general <= special + 1e-3, "{}: {general} beside {special}", m.name);
    }
}

//! Compressors on tilting-pad, lemon and plain film bearings of ROSS's own solver, of which the drawing knows neither
//! geometry nor table: the data learn the bearings over speed, and nothing may be claimed that is not there.

use std::sync::OnceLock;

use crate::machine::{Machine, machines};
use rotor_edge_desktop::diagnose::{Diagnosis, Verdict, diagnose};

/// Four hide; the smallest, under a tilting-pad bearing, is followed by what is learned of the bearings.
const BOWS_NAMED: usize = 3;

fn found() -> &'static [(Machine, Diagnosis)] {
    static FOUND: OnceLock<Vec<(Machine, Diagnosis)>> = OnceLock::new();
    FOUND.get_or_init(|| {
        let diagnosed = |m: Machine| {
            let answer = diagnose(&m.rotor, &m.readings).unwrap_or_else(|e| panic!("{}: {e}", m.name));
            (m, answer)
        };
        machines("film").into_iter().map(diagnosed).collect()
    })
}

fn label(answer: &Diagnosis) -> String {
    let first = &answer.candidates[0];
    first.at.as_ref().map_or_else(|| first.effect.to_string(), |at| format!("{}@{at}", first.effect))
}

#[test]
fn nothing_is_claimed_on_a_film_machine_that_hides_nothing() {
    for (m, answer) in found().iter().filter(|(m, _)| m.truth.is_empty()) {
        assert_eq!(answer.verdict, Verdict::Adequate, "{}: {}", m.name, answer.summary);
    }
}

#[test]
fn what_is_named_on_a_film_machine_is_there_or_in_a_group_that_holds_it() {
    for (m, answer) in found().iter().filter(|(_, a)| a.verdict != Verdict::Adequate) {
        let truth = m.truth_label();
        let group = answer.indistinguishable.first().is_some_and(|g| g.contains(&truth));
        assert!(label(answer) == truth || group, "{}: {}", m.name, answer.summary);
    }
}

#[test]
fn bows_that_show_against_films_are_named() {
    let bows = found().iter().filter(|(m, _)| m.truth_label() == "shaft_bow");
    let named = bows.filter(|(m, answer)| {
        let truth = m.truth_label();
        answer.verdict != Verdict::Adequate
            && (label(answer) == truth
                || answer.indistinguishable.first().is_some_and(|g| g.contains(&truth)))
    });
    assert!(named.count() >= BOWS_NAMED);
}

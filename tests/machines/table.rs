//! Compressors on films of ROSS's own solvers, with records of its own forced response, whose drawings have a table for
//! each bearing that is off by up to 5 %.

use std::sync::OnceLock;

use crate::machine::{Machine, diagnosed};
use rotor_edge_desktop::diagnose::{Diagnosis, Verdict};

/// Of sixteen; 90 % would be fifteen. What is missed:
/// - 12 (seal), 23 (disk mass): a factor on each of sixteen columns follows all but what 3 and 1 parameters cost;
/// - 17 (seal): damping inside the shaft, one parameter, drives forward whirl as the seal does with three;
/// - 10 (bow): the kind that turns with the shaft is named, but at other places; the table's six rows leave 3 % of a
///   stiffness open between them.
const NAMED: usize = 12;

fn found() -> &'static [(Machine, Diagnosis)] {
    static FOUND: OnceLock<Vec<(Machine, Diagnosis)>> = OnceLock::new();
    FOUND.get_or_init(|| diagnosed("table"))
}

#[test]
fn nothing_is_claimed_on_a_table_machine_that_hides_nothing() {
    for (m, answer) in found().iter().filter(|(m, _)| m.truth.is_empty()) {
        assert_eq!(answer.verdict, Verdict::Adequate, "{}: {}", m.name, answer.summary);
    }
}

#[test]
fn what_hides_on_a_table_machine_is_named_first_or_in_its_group() {
    let hiding = || found().iter().filter(|(m, _)| !m.truth.is_empty());
    let missed = hiding().filter(|(m, answer)| !m.is_named_by(answer));
    let missed: Vec<String> =
        missed.map(|(m, answer)| format!("\n  {}: {}", m.name, answer.summary)).collect();
    assert!(hiding().count() - missed.len() >= NAMED, "{}", missed.concat());
}

//! Compressors on films of ROSS's own solvers, with records of its own forced response, whose drawings have a table for
//! each bearing that is off by up to 5 %.

use std::sync::OnceLock;

use crate::machines::machine::{Machine, diagnosed, machines};
use rotor_edge_desktop::diagnose::{Diagnosis, DiagnosisVerdict, diagnose};
use rotor_edge_tests::sampled;

/// Of sixteen; 90 % would be fifteen. What is missed:
/// - 12 (seal), 23 (disk mass): a factor on each of sixteen columns follows all but what 3 and 1 parameters cost;
/// - 17 (seal): damping inside the shaft, one parameter, drives forward whirl as the seal does with three;
/// - 10 (bow): the kind that turns with the shaft is named, but at other places; the table's six rows leave 3 % of a
///   stiffness open between them.
const NAMED: usize = 12;
/// What is missed at most where the drawing says that its tables are good to a tenth: 12, undecided between a disk's mass and damping,
/// and 10 as above, which are both among every second machine. At a twentieth 12 is called a disk's mass, 94.7 % sure, which is wrong: its tables are off
/// by more where they have no rows.
const MISSED_WITH_STATED_TABLES: usize = 2;
const STATED_RELATIVE: f64 = 0.1;

fn found() -> &'static [(Machine, Diagnosis)] {
    static FOUND: OnceLock<Vec<(Machine, Diagnosis)>> = OnceLock::new();
    FOUND.get_or_init(|| diagnosed("table"))
}

#[test]
fn nothing_is_claimed_on_a_table_machine_that_hides_nothing() {
    for (m, answer) in found().iter().filter(|(m, _)| m.truth.is_empty()) {
        let nothing = matches!(answer.verdict, DiagnosisVerdict::Adequate | DiagnosisVerdict::NotDetermined);
        assert!(nothing, "{}: {}", m.name, answer.summary);
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

#[test]
fn tables_stated_to_10_percent_name_more_and_no_false_effects() {
    let trusted = |mut m: Machine| {
        m.rotor.bearing.iter_mut().for_each(|b| b.coefficients_relative = Some(STATED_RELATIVE));
        let answer = diagnose(&m.rotor, &m.readings).unwrap_or_else(|e| panic!("{}: {e}", m.name));
        (m, answer)
    };
    let found: Vec<(Machine, Diagnosis)> = sampled(2, machines("table")).map(trusted).collect();
    for (m, answer) in &found {
        let is_right = if m.truth.is_empty() {
            answer.verdict == DiagnosisVerdict::Adequate
        } else {
            answer.verdict != DiagnosisVerdict::Missing || m.is_named_by(answer)
        };
        assert!(is_right, "{}: {}", m.name, answer.summary);
    }
    let hiding = || found.iter().filter(|(m, _)| !m.truth.is_empty());
    let named = hiding().filter(|(m, answer)| m.is_named_by(answer)).count();
    assert!(hiding().count() - named <= MISSED_WITH_STATED_TABLES, "{named}");
}

//! The tolerance of a drawing: the usual one is assumed and told, an exact one is believed, a contradiction is refused.

use super::{Case, json};
use crate::program::{assert_says, refusal, rotor_edge};
use rotor_edge_desktop::rotor_file;

const FAN: &str = include_str!("../../../../tests/machines/ordinary/fan-002-none/rotor.toml");
const FAN_DATA: &str = include_str!("../../../../tests/machines/ordinary/fan-002-none/measured.csv");

/// A sound fan; the `[tolerance]` table of its file is `tolerance`.
fn fan(tolerance: &str) -> Case {
    Case::new(&FAN.replacen("[noise]", &format!("{tolerance}\n[noise]"), 1), FAN_DATA)
}

#[test]
fn ordinary_drawing_is_assumed_and_told() {
    let case = fan("");
    let shown = rotor_edge(&["diagnose", &case.rotor, &case.data]).stdout;
    let text = String::from_utf8(shown).unwrap();
    assert_says(&text, &["adequate", "has no [tolerance]", "diameters 0.2 %", "`exact = true`"]);
    let answer = json(&["improve", &case.rotor, &case.data, "-o", &case.new]);
    assert_eq!(answer["steps"].as_array().unwrap().len(), 0);
    let written = rotor_file::read(case.new.as_ref()).unwrap().tolerance.unwrap();
    assert_eq!((written.diameter_relative, written.exact), (0.002, false));
    assert!(written.found.len() > 10, "{:?}", written.found);
}

#[test]
fn drawing_stated_as_exact_is_taken_at_its_word() {
    let case = fan("[tolerance]\nexact = true\n");
    let answer = json(&["diagnose", &case.rotor, &case.data]);
    assert_ne!(answer["verdict"], "adequate", "{}", answer["summary"]);
    assert!(!answer["remarks"].to_string().contains("[tolerance]"), "{}", answer["remarks"]);
}

#[test]
fn exact_drawing_with_errors_is_refused() {
    let case = fan("[tolerance]\nexact = true\nmass_relative = 0.01\n");
    let said = refusal(&["diagnose", &case.rotor, &case.data]);
    assert_says(&said, &["rotor.toml", "[tolerance] exact", "expected one or the other"]);
}

//! A probe with a wrong gain: `diagnose` names it, and `improve --without` goes on without it.

use super::Case;
use crate::program::{assert_says, json, rotor_edge};
use rotor_edge_desktop::rotor_file;

const ROTOR: &str = include_str!("../../../../tests/machines/ordinary/007-probe_calibration/rotor.toml");
const DATA: &str = include_str!("../../../../tests/machines/ordinary/007-probe_calibration/measured.csv");

#[test]
fn bad_probe_is_named_and_left_out_next() {
    let case = Case::new(ROTOR, DATA);
    let shown = rotor_edge(&["diagnose", &case.rotor, &case.data]).stdout;
    let text = String::from_utf8(shown).unwrap();
    assert_says(&text, &["missing: Probe BX does not show what the others do: gain 1.", "--without BX"]);
    let improved = rotor_edge(&["improve", &case.rotor, &case.data, "--without", "BX", "-o", &case.new]);
    assert_says(&String::from_utf8(improved.stdout).unwrap(), &["adequate", "Not used: BX"]);
    let written = rotor_file::read(case.new.as_ref()).unwrap();
    assert!(written.effect.is_empty(), "{:?}", written.effect);
    assert_eq!(written.unused.len(), 1);
}

#[test]
fn two_probes_that_cannot_be_told_apart_are_both_named() {
    let rotor = include_str!("../../../../tests/machines/ordinary/006-none/rotor.toml");
    let case = Case::new(rotor, "");
    let gain = ["--with", "probe_calibration@BX", "--set", "gain=1.2", "--set", "phase=0"];
    // with this unbalance a gain of 1.2 in x shows nearly as one of 1 over 1.2 in y
    let rest = ["--speeds", "600..4600:44", "--seed", "3", "--drawing-error", "3", "--force"];
    let simulated = rotor_edge(&[&["simulate", &case.rotor, "-o", &case.data], &gain[..], &rest].concat());
    assert!(simulated.status.success());
    let found = json(&rotor_edge(&["diagnose", &case.rotor, &case.data, "--json"]));
    assert_eq!(found["verdict"], "undecided");
    let said = [
        "A probe is off, and the data cannot tell which. Probe BX",
        "gain 1.2",
        ", or: Probe BY",
        "gain 0.8",
    ];
    assert_says(found["summary"].as_str().unwrap(), &said);
}

#[test]
fn probe_that_looks_elsewhere_is_named_whatever_the_reason() {
    let rotor = include_str!("../../../../tests/machines/single/case-018/rotor.toml");
    let case = Case::new(&rotor.replace("[tolerance]\nexact = true\n", ""), "");
    let phase = ["--with", "probe_calibration@DEX", "--set", "gain=1", "--set", "phase=-0.2618"];
    let rest = ["--speeds", "600..4200:30", "--seed", "1", "--drawing-error", "1", "--force"];
    let simulated = rotor_edge(&[&["simulate", &case.rotor, "-o", &case.data], &phase[..], &rest].concat());
    assert!(simulated.status.success());
    let found = json(&rotor_edge(&["diagnose", &case.rotor, &case.data, "--json"]));
    assert_eq!(found["verdict"], "undecided");
    assert_eq!(found["bad_probe"], "DEX");
    let said = ["Probe DEX does not show what the others do", "cannot tell this from a wrong angle of DEX"];
    assert_says(found["summary"].as_str().unwrap(), &said);
}

//! A probe with a wrong gain: `diagnose` names it, and `improve --without` goes on without it.

use super::Case;
use crate::program::{assert_says, rotor_edge};
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

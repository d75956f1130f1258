//! A cause outside the list of effects.

use rotor_edge_desktop::diagnose::improve;
use rotor_edge_desktop::{measurement, rotor_file};
use rotor_edge_tests::repository;

/// Effects that imitate an asymmetric shaft end at numbers that physics hardly allows, such as a friction of 2.9 in a rub.
#[test]
fn improved_file_of_an_unlisted_cause_states_what_a_file_may() {
    let folder = repository("tests/machines/unlisted/001-asymmetric-shaft");
    let rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
    let readings = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
    let outcome = improve(&rotor, &readings, |_| ()).unwrap();
    let written = tempfile::tempdir().unwrap();
    let path = written.path().join("better.toml");
    rotor_file::write(&path, &outcome.rotor).unwrap();
    let effects = rotor_file::read(&path).unwrap().effect;
    assert_eq!(effects.len(), outcome.steps.len());
}

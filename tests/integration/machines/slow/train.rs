//! A train of two spans on four bearings, with and without a seal that the drawing lacks.

use crate::machines::machine::diagnosed;
use rotor_edge_desktop::diagnose::DiagnosisVerdict;

#[test]
fn sound_train_is_adequate_and_hidden_seal_is_named() {
    for (m, answer) in diagnosed("train") {
        if m.truth.is_empty() {
            assert_eq!(answer.verdict, DiagnosisVerdict::Adequate, "{}: {}", m.name, answer.summary);
        } else {
            assert!(m.is_named_by(&answer), "{}: {}", m.name, answer.summary);
        }
    }
}

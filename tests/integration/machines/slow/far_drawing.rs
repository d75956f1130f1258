//! Probes that are off on machines whose drawings are far off: a search around the drawing as stated alone misses them.

use rotor_edge_desktop::diagnose::DiagnosisVerdict;

use crate::machines::machine::diagnosed;

#[test]
fn probe_that_is_off_is_named_where_the_drawing_is_far_off() {
    let all = diagnosed("far-drawing");
    assert_eq!(all.len(), 2);
    for (m, answer) in &all {
        assert!(
            answer.verdict != DiagnosisVerdict::Adequate && m.is_named_by(answer),
            "{} hides {}: {}",
            m.name,
            m.truth_label(),
            answer.summary
        );
    }
}

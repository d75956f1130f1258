//! Effects that explain the data only together: `diagnose` names them, and leads to `improve`.

use std::path::Path;

use super::Case;
use crate::program::{assert_says, rotor_edge};
use serde_json::Value;

const KIT: &str = include_str!("../../../sample/kit/rotor.toml");
const KIT_DATA: &str = include_str!("../../../sample/kit/startup.csv");
/// What was hidden when the kit was simulated with ROSS.
const TRUTH: &str = include_str!("../../../../tests/kits/sample/truth.json");
/// What a page may weigh; the kit's has five runs with all their figures.
const MOST_BYTES: u64 = 1_500_000;

#[test]
fn effects_that_explain_only_together_lead_to_improve() {
    let case = Case::new(KIT, KIT_DATA);
    let page = case.folder.path().join("page.html").display().to_string();
    let shown = rotor_edge(&["diagnose", &case.rotor, &case.data, "--report", &page]);
    let text = String::from_utf8(shown.stdout).unwrap();
    assert_says(&text, &["together do", "Next: add them", "rotor-edge improve"]);
    assert!(!text.contains("tells the rivals apart"), "{text}");
    let weight = std::fs::metadata(Path::new(&page)).unwrap().len();
    assert!(weight <= MOST_BYTES, "{weight} bytes");
    let answer = rotor_edge(&["diagnose", &case.rotor, &case.data, "--json"]).stdout;
    let answer: Value = serde_json::from_slice(&answer).unwrap();
    let truth: Value = serde_json::from_str(TRUTH).unwrap();
    let hidden = truth["effects"].as_array().unwrap().iter().map(|e| {
        let at = e["at"].as_str().map(|at| format!("@{at}"));
        format!("{}{}", e["effect"].as_str().unwrap(), at.unwrap_or_default())
    });
    assert_eq!(answer["together"], Value::from(hidden.collect::<Vec<_>>()), "as hidden");
}

//! `plan` as a user meets it.

use crate::program::{assert_says, json, refusal, rotor_edge};

fn kit() -> String {
    format!("{}/sample/kit/rotor.toml", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn plan_json_has_documented_keys() {
    let plan = json(&rotor_edge(&["plan", &kit(), "--speeds", "500..4000:9", "--json"]));
    let effects = plan["effects"].as_array().unwrap();
    assert!(effects.len() > 20 && plan["readings"] == 9 * plan["runs"].as_array().unwrap().len().max(1));
    for e in effects {
        assert!(e["effect"].is_string() && e["confused_with"].is_array(), "{e}");
        if e["smallest"].is_object() {
            let found = e["smallest"]["found"].as_f64().unwrap();
            assert!(found >= 0.9, "{e}");
        }
    }
    assert!(plan["planes"].as_array().unwrap().iter().all(|p| p["accuracy"].as_f64().unwrap() > 0.0));
    let gains: Vec<f64> =
        plan["next"].as_array().unwrap().iter().map(|n| n["gain"].as_f64().unwrap()).collect();
    assert!(gains.len() > 3 && gains.windows(2).all(|g| g[0] >= g[1]), "{gains:?}");
}

#[test]
fn text_begins_with_the_answer_and_the_page_has_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("plan.html").display().to_string();
    let output =
        rotor_edge(&["plan", &kit(), "--speeds", "500..4000:9", "--unbalance", "5", "--report", &report]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("With these "), "{text}");
    assert_says(
        &text,
        &["sizes that matter", "The unbalance is known to ±", "Further measurements", "Next: "],
    );
    let page = std::fs::read_to_string(report).unwrap();
    assert!(page.contains("Smallest effects found") && page.contains("shaft_bow"));
}

#[test]
fn trial_weights_are_runs_and_wrong_requests_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let rotor = std::fs::read_to_string(kit()).unwrap();
    let plane = rotor.split("[[plane]]").nth(1).unwrap().split('"').nth(1).unwrap().to_string();
    let header = "run,plane,magnitude_g_mm,angle_deg\n";
    let weights = write("weights.csv", &format!("{header}trial,{plane},5,0\n"));
    let speeds = ["--speeds", "500..4000:21"];
    let plan = json(&rotor_edge(&["plan", &kit(), "--json", speeds[0], speeds[1], "--runs", &weights]));
    assert_eq!(plan["runs"], serde_json::json!(["base", "trial"]));
    assert_eq!(plan["readings"], 42);
    let elsewhere = write("elsewhere.csv", &format!("{header}trial,nowhere,5,0\n"));
    let kit = kit();
    let refused = |more: &[&str]| {
        let words: Vec<&str> = ["plan", &kit].into_iter().chain(more.iter().copied()).collect();
        refusal(&words)
    };
    assert_says(
        &refused(&[speeds[0], speeds[1], "--runs", &elsewhere]),
        &["elsewhere.csv", "no plane \"nowhere\""],
    );
    assert_says(&refused(&[speeds[0], speeds[1], "--unbalance", "nowhere=5"]), &["--unbalance", "no plane"]);
}

#[test]
fn measurement_that_tells_two_effects_apart_is_named_first() {
    let (kit, speeds) = (kit(), ["--speeds", "500..4000:9"]);
    let of = |effects: &[&'static str], more: &[&'static str]| -> Vec<String> {
        let between = effects.iter().flat_map(|effect| ["--between", effect]);
        let words = ["plan", &kit].into_iter().chain(speeds).chain(between).chain(more.iter().copied());
        words.map(Into::into).collect()
    };
    let run = |all: Vec<String>| rotor_edge(&all.iter().map(String::as_str).collect::<Vec<_>>());
    let plan = json(&run(of(&["runout", "shaft_bow"], &["--json"])));
    let decision = &plan["between"];
    assert_eq!(decision["effects"], serde_json::json!(["runout", "shaft_bow"]));
    let of_key = |key: &str| decision[key].as_f64().unwrap();
    assert!(of_key("probability") >= of_key("probability_without"), "{decision}");
    let measurement = decision["measurement"].as_str().unwrap().to_string();
    let text = String::from_utf8(run(of(&["runout", "shaft_bow"], &[])).stdout).unwrap();
    let first = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(first.contains("between runout and shaft_bow"), "{first}");
    assert!(first.find(&measurement) < first.find("With these"), "{first}");
    let refused = |effects: &[&'static str]| {
        let all = of(effects, &[]);
        refusal(&all.iter().map(String::as_str).collect::<Vec<_>>())
    };
    assert_says(&refused(&["runout"]), &["--between", "runout alone", "two effects or more"]);
    assert_says(&refused(&["runout", "rust"]), &["\"rust\"", "expected one of", "shaft_bow"]);
}

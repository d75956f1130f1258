//! Sliders, fits with held parameters, readings that are left out, branches, a hidden machine.

use std::io::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::browser::Browser;
use crate::client;
use crate::program::Studio;

/// Speeds of the sample's run-up.
const SPEEDS: u64 = 51;
/// Steps of a slider that is dragged.
const MOVES: usize = 40;

/// A time of many moves, in words.
fn median_and_95th(timings: &[Value], of: &str) -> String {
    let mut ms: Vec<f64> = timings.iter().map(|t| t[of].as_f64().unwrap()).collect();
    ms.sort_by(f64::total_cmp);
    let at = |share: f64| ms[(share * (ms.len() - 1) as f64).round() as usize];
    format!("{:.0} ms (95th percentile {:.0} ms)", at(0.5), at(0.95))
}

#[test]
fn slider_step_evaluates_the_model_once_a_speed() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    browser.wait_for_verdict("missing");
    browser.wait("document.querySelectorAll('#figures .chart svg').length === 4");
    browser.value("document.querySelector('#sliders input[type=range]').focus()");
    for moved in 1..=MOVES {
        browser.press("ArrowRight", 39);
        browser.wait(&format!("document.documentElement.dataset.moves >= {moved}"));
    }
    let timings = browser.value("studio.timings");
    let timings = timings.as_array().unwrap();
    assert!(timings.iter().all(|t| t["evaluations"] == SPEEDS), "{timings:?}");
    let said = format!(
        "slider step, 51 speeds and 4 probes: figures drawn after {}, of which the server took {}\n",
        median_and_95th(timings, "ms"),
        median_and_95th(timings, "answer_ms")
    );
    std::io::stderr().write_all(said.as_bytes()).unwrap();
    assert!(browser.text("#moved").starts_with("Moved by hand: error "));
    browser.keep("studio-moved");
    browser.click("#put-back");
    browser.wait("document.getElementById('moved').textContent.startsWith('Move a number')");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

/// A parameter of a state by its owner and name.
fn parameter<'s>(session: &'s Value, owner: &str, name: &str) -> &'s Value {
    let all = session["parameters"].as_array().unwrap();
    all.iter().find(|p| p["owner"] == owner && p["name"] == name).unwrap()
}

#[test]
fn held_parameter_stays_in_a_fit_that_settles_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let before = studio.changed("open", &client::sample());
    let id = parameter(&before, "bearing 15", "k_xx")["id"].clone();
    let moved = studio.ask("move", &json!({ "id": id, "share": 0.55, "tab": "Bode, run day 126" })).json();
    assert!(moved["figures"]["figures"].as_array().unwrap().len() == 4, "{moved}");
    studio.changed("hold", &json!({ "id": id, "is_held": true }));
    let after = studio.changed("fit", &json!({}));
    assert_eq!(parameter(&after, "bearing 15", "k_xx")["text"], moved["text"]);
    let other = |session: &Value| parameter(session, "bearing 15", "k_yy")["text"].clone();
    assert_ne!(other(&after), other(&before));
    assert_eq!(after["steps"][1]["label"], "fitted, 1 held");
    let phasor = parameter(&before, "unbalance at 15", "size");
    assert_eq!(phasor["can_hold"], false);
    // the way back
    assert_eq!(other(&studio.changed("undo", &json!({}))), other(&before));
}

#[test]
fn slider_that_is_put_where_it_was_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let session = studio.changed("open", &client::sample());
    let slider = parameter(&session, "bearing 16", "c_yy");
    let moving = json!({ "id": slider["id"], "share": slider["share"], "tab": "Bode, run day 126" });
    let moved = studio.ask("move", &moving).json()["figures"]["moved"].clone();
    assert_eq!(moved["error"], session["verdict"]["error"]);
    assert_eq!(moved["evaluations"], SPEEDS);
}

#[test]
fn readings_left_out_are_predicted_and_the_kept_ones_saved() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("add", &json!({ "effect": "seal", "at": "disk 3" }));
    let mask = json!({ "runs": [], "probes": ["15Y"], "speeds_rpm": [9000.0, 10000.0] });
    let session = studio.changed("leave_out", &mask);
    let sentence = session["mask"]["sentence"].as_str().unwrap();
    assert!(sentence.contains("51 readings with values left out"), "{sentence}");
    studio.changed("save", &json!({ "what": "readings", "path": "kept.csv" }));
    let kept = std::fs::read_to_string(folder.path().join("kept.csv")).unwrap();
    assert!(!kept.contains("15Y") && kept.contains("15X"));
    // the header, and all speeds but the five from 9,100 to 9,900 rpm
    assert_eq!(kept.lines().count(), 1 + 51 - 5);
    let all = studio.changed("leave_out", &json!({ "runs": [], "probes": [], "speeds_rpm": null }));
    assert!(all["mask"]["sentence"].is_null());
}

#[test]
fn two_branches_stand_side_by_side_in_figures() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("branch", &json!({ "branch": null }));
    studio.changed("add", &json!({ "effect": "seal", "at": "disk 3" }));
    studio.changed("branch", &json!({ "branch": 0 }));
    let session = studio.changed("add", &json!({ "effect": "seal", "at": "disk 2" }));
    let branches = session["branches"].as_array().unwrap();
    assert_eq!(
        (&branches[0]["label"], &branches[1]["label"]),
        (&json!("seal@disk 2"), &json!("seal@disk 3"))
    );
    let (server, path) = studio.parts();
    let asked = format!("{path}api/figures?tab=Bode%2C+run+day+126");
    let figures = client::request(server, "GET", &asked, server, "").json();
    let names: Vec<&str> = figures["figures"][0]["chart"]["series"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|s| s["name"].as_str())
        .collect();
    for name in ["A: with seal at disk 2", "B: with seal at disk 3", "measured"] {
        assert!(names.contains(&name), "{names:?}");
    }
}

#[test]
fn hidden_effect_is_told_by_reveal_alone() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    browser.click("#open-hidden");
    browser.wait("document.querySelector('#practice button[data-key=reveal]')");
    assert!(!browser.text("#practice").contains("Hidden:"));
    browser.click("#practice button[data-key=reveal]");
    browser.wait("document.querySelector('#practice .reveal')");
    assert!(browser.text("#practice .reveal").contains("Nothing was added yet"));
    browser.keep("studio-practice");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn report_holds_verdict_steps_and_commands() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("add", &json!({ "effect": "seal", "at": "disk 3" }));
    let verdict = studio.diagnosed()["verdict"]["sentence"].as_str().unwrap().to_string();
    studio.changed("save", &json!({ "what": "report", "path": "report.html" }));
    let report = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    for part in [verdict.as_str(), "The fall of the error", "seal@disk 3", "rotor-edge add rotor.toml"] {
        assert!(report.contains(part), "{part}");
    }
}

/// Asked before the diagnosis is done, which says between what a measurement is to decide.
#[test]
fn plan_waits_for_the_rivals_between_which_it_decides() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/machines/single/case-009");
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(own.join("rotor.toml"), folder.path().join("rotor.toml")).unwrap();
    let measured = std::fs::read_to_string(own.join("measured.csv")).unwrap();
    let rows = measured.lines().skip(1).step_by(6);
    let fewer: Vec<&str> = measured.lines().take(1).chain(rows).collect();
    std::fs::write(folder.path().join("measured.csv"), fewer.join("\n")).unwrap();
    let studio = Studio::start(folder.path(), &["rotor.toml", "measured.csv"]);
    let session = studio.changed("plan", &json!({}));
    assert!(session["further"]["progress"].is_array(), "{session}");
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    browser.wait_for_verdict("undecided");
    browser.click("#further summary");
    browser.wait("document.querySelector('#further').textContent.includes('decides between')");
    let text = browser.text("#further");
    let rivals = ["disk_skew@disk 1", "unbalance_plane@disk 1"];
    assert!(rivals.iter().all(|rival| text.matches(rival).count() > 1), "{text}");
    browser.keep("studio-decision");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn further_measurements_are_those_of_plan() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("plan", &json!({}));
    let begun = std::time::Instant::now();
    let next = loop {
        let further = studio.changed("plan", &json!({}))["further"].clone();
        assert!(further["error"].is_null(), "{further}");
        if further["progress"].is_null() {
            break further["next"].clone();
        }
        assert!(begun.elapsed().as_secs() < 120, "{further}");
        std::thread::sleep(std::time::Duration::from_millis(50));
    };
    let next = next.as_array().unwrap();
    assert!(!next.is_empty() && next.iter().all(|n| n.as_str().unwrap().ends_with(" bits)")), "{next:?}");
}

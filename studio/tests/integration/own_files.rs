//! A person's own files: a slow roll that is subtracted, and something hidden in their machine.

use std::collections::BTreeSet;
use std::path::Path;

use rotor_edge::command::{Listener, object};
use rotor_edge::sample;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::browser::Browser;
use crate::program::{Studio, refused};

/// A machine of somebody else with its measurements, and the sample's with a slow roll of its own.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/machines/single/case-029");
    for (from, to) in [("rotor.toml", "mine.toml"), ("measured.csv", "mine.csv")] {
        std::fs::copy(own.join(from), folder.path().join(to)).unwrap();
    }
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("rotor.toml", sample::ROTOR);
    write("data.csv", sample::RUNUP_DAY_126);
    let slow = "speed_rpm,15X_cos_um,15X_sin_um,15Y_cos_um,15Y_sin_um,16X_cos_um,16X_sin_um,16Y_cos_um,16Y_sin_um\n\
                300,4.0,-2.0,1.0,3.0,-2.5,1.5,0.5,-4.0\n";
    write("slow.csv", slow);
    folder
}

/// Speeds of a table of readings.
fn speeds(path: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(path).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|name| name == "speed_rpm").unwrap();
    let rows = text.lines().skip(1).map(|row| row.split(',').nth(column).unwrap());
    rows.map(|speed| speed.parse::<f64>().unwrap().to_string()).collect()
}

/// Summary of a diagnosis by the command, in a folder.
fn summary(folder: &Path, words: &[&str]) -> Value {
    let file = |name: &&str| match folder.join(name) {
        path if path.is_file() => path.display().to_string(),
        _ => (*name).to_string(),
    };
    let words = ["diagnose"].iter().chain(words).chain(&["--json"]).map(file);
    let said = object(words.map(Into::into), Listener::Terminal).unwrap();
    serde_json::from_str::<Value>(&said).unwrap()["summary"].clone()
}

#[test]
fn slow_roll_is_subtracted_as_diagnose_subtracts_it() {
    let folder = folder();
    let words = ["rotor.toml", "data.csv", "--slow-roll", "slow.csv"];
    let studio = Studio::start(folder.path(), &words);
    let session = studio.diagnosed();
    let with = summary(folder.path(), &words);
    assert_eq!(session["verdict"]["sentence"], with);
    let paths = json!({ "what": "paths", "rotor": "rotor.toml", "data": "data.csv", "slow_roll": "" });
    studio.changed("open", &paths);
    let without = studio.diagnosed();
    assert_ne!(without["verdict"]["error"], session["verdict"]["error"], "the slow roll matters");
    // by the page's form, kept in the session's file
    let mut paths = paths;
    paths["slow_roll"] = json!("slow.csv");
    let again = studio.changed("open", &paths);
    assert_eq!(again["verdict"]["error"], session["verdict"]["error"]);
    let command = again["commands"][0].as_str().unwrap();
    assert_eq!(command, "rotor-edge diagnose rotor.toml data.csv --slow-roll slow.csv");
    studio.changed("save", &json!({ "what": "session", "path": "session.json" }));
    drop(studio);
    std::fs::remove_file(folder.path().join("slow.csv")).unwrap();
    let studio = Studio::start(folder.path(), &["--session", "session.json"]);
    assert_eq!(studio.diagnosed()["verdict"]["sentence"], with);
    drop(studio);
    let said = refused(folder.path(), &["rotor.toml", "data.csv", "--slow-roll", "none.csv"]);
    assert!(said.contains("\"none.csv\" is neither a run of this file nor a file"), "{said}");
}

#[test]
fn effect_hidden_in_own_machine_is_revealed() {
    let folder = folder();
    let studio = Studio::start(folder.path(), &["mine.toml", "mine.csv"]);
    let own = studio.diagnosed();
    let before = studio.changed("branch", &json!({ "branch": null }));
    let hidden = studio.changed("open", &json!({ "what": "hidden", "seed": 3 }));
    assert_eq!(hidden["machine"], own["machine"]);
    assert_eq!(hidden["data_file"], "hidden-3.csv");
    studio.changed("save", &json!({ "what": "readings", "path": "hidden.csv" }));
    let at = |name: &str| speeds(&folder.path().join(name));
    assert_eq!(at("hidden.csv"), at("mine.csv"));
    let told = studio.changed("reveal", &json!({}))["practice"]["reveal"].clone();
    assert!(told["sentence"].as_str().unwrap().ends_with("Nothing was added yet."), "{told}");
    // another one, and back
    studio.changed("open", &json!({ "what": "hidden", "seed": 4 }));
    let back = studio.changed("open", &json!({ "what": "before_hidden" }));
    assert_eq!(back["branches"].as_array().unwrap().len(), 2);
    assert_eq!((&back["steps"], &back["data_file"]), (&before["steps"], &json!("mine.csv")));
    assert!(
        studio.refusal("open", &json!({ "what": "before_hidden" })).contains("no measurements were open")
    );
    assert_eq!(studio.diagnosed()["verdict"]["sentence"], own["verdict"]["sentence"]);
}

#[test]
fn own_files_are_hidden_in_from_the_first_page() {
    let folder = folder();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    browser.write("#open-paths [name=rotor]", "mine.toml");
    browser.write("#open-paths [name=data]", "mine.csv");
    browser.click("#open-paths [value=hidden]");
    browser.wait("document.querySelector('#practice button[data-key=reveal]')");
    // figures that are still to come move the button
    browser.wait("document.querySelectorAll('#figures .chart svg').length === 4");
    assert!(browser.text("#files").contains("mine.toml, hidden-"));
    browser.click("#practice button[data-key=reveal]");
    browser.wait("document.querySelector('#practice .reveal')");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

//! `estimate` as a user meets it.

use crate::program::{assert_says, json, refusal, rotor_edge};
use tempfile::TempDir;

fn rig(name: &str) -> String {
    format!("{}/../tests/rigs/rk4/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    std::fs::read_to_string(rig(name)).unwrap()
}

/// The rig's file with these runs alone, and its data.
fn with_runs(folder: &TempDir, names: &[&str]) -> [String; 2] {
    let text = read("rotor.toml");
    let mut parts = text.split("[[run]]");
    let mut kept = parts.next().unwrap().to_string();
    for part in parts.filter(|p| names.iter().any(|n| p.contains(&format!("\"{n}\"")))) {
        kept.push_str("[[run]]");
        kept.push_str(part);
    }
    [written(folder, "rotor.toml", &kept), rig("measured.csv")]
}

fn written(folder: &TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn estimate_json_has_documented_keys_and_blind_runs() {
    let folder = tempfile::tempdir().unwrap();
    let [rotor, data] = with_runs(&folder, &["BASE", "A005", "B022"]);
    let all = json(&rotor_edge(&["estimate", &rotor, &data, "--leave-one-out", "--json"]));
    let estimates = all["estimates"].as_array().unwrap();
    assert_eq!(estimates.len(), 84, "every run but the base");
    let blind = estimates.iter().find(|e| e["run"] == "B045").unwrap();
    assert!(blind["stated"].is_null() && blind["speed_rpm"].as_array().unwrap().len() == 2);
    for p in blind["planes"].as_array().unwrap() {
        assert!(
            p["name"].is_string() && p["angle_deg"].is_f64() && p["region"]["semi_axes_g_mm"][1].is_f64()
        );
        let [low, high] = [0, 1].map(|i| p["interval_95"][i].as_f64().unwrap());
        let size = p["unbalance_g_mm"].as_f64().unwrap();
        assert!((low..=high).contains(&size), "{p}");
    }
    assert_eq!(blind["influence"]["planes"].as_array().unwrap().len(), 2);
    assert_eq!(all["condition"].as_array().unwrap().len(), 3, "two speeds and both together");
    assert!(all["refuted_runs"].as_array().unwrap().is_empty(), "three runs refute nothing");
    assert!(all["determined"]["poorly"].as_bool().unwrap());
}

#[test]
fn text_names_the_base_refuted_runs_and_what_would_help() {
    let folder = tempfile::tempdir().unwrap();
    let report = folder.path().join("report.html").display().to_string();
    let output = rotor_edge(&["estimate", &rig("rotor.toml"), &rig("measured.csv"), "--report", &report]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let says = ["relative to run BASE", "poorly determined", "would help", "weights of run B047 are wrong"];
    assert_says(&text, &says);
    let page = std::fs::read_to_string(report).unwrap();
    assert!(
        page.contains("Unbalance by run") && page.contains("regions-1") && page.contains("\"name\":\"95 %\"")
    );
}

#[test]
fn what_cannot_be_estimated_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let [rotor, data] = with_runs(&folder, &["A005", "B022"]);
    assert_says(&refusal(&["estimate", &rotor, &data]), &["without weights", "--base"]);
    assert_says(&refusal(&["estimate", &rotor, &data, "--base", "nobody"]), &["no run \"nobody\""]);
    assert_says(&refusal(&["estimate", &rotor, &data, "--base", "A005"]), &["base run \"A005\" has weights"]);
    let [rotor, data] = with_runs(&folder, &["BASE"]);
    assert_says(&refusal(&["estimate", &rotor, &data]), &["added_unbalance"]);
    let broken = read("measured.csv").replacen("1.0447", "NaN", 1);
    let broken = written(&folder, "broken.csv", &broken);
    assert_says(&refusal(&["estimate", &rotor, &broken]), &["broken.csv", "row 2", "not a number"]);
    let elsewhere = read("rotor.toml").replacen(
        "added_unbalance = [{ position_m = 0.16",
        "added_unbalance = [{ position_m = 0.2",
        1,
    );
    let elsewhere = written(&folder, "elsewhere.toml", &elsewhere);
    assert_says(&refusal(&["estimate", &elsewhere, &data]), &["at 0.2 m", "no [[plane]]"]);
}

/// The data of the rig with the session of each run, by its name.
fn with_sessions(folder: &TempDir, session: impl Fn(&str) -> &'static str) -> String {
    let text = read("measured.csv");
    let mut lines = text.lines();
    let mut all = lines.next().unwrap().replacen("run,", "run,session,", 1) + "\n";
    for line in lines {
        let (run, rest) = line.split_once(',').unwrap();
        all += &format!("{run},{},{rest}\n", session(run));
    }
    written(folder, "sessions.csv", &all)
}

#[test]
fn stated_sessions_are_told_and_their_shift_is_learned() {
    let folder = tempfile::tempdir().unwrap();
    let data = with_sessions(&folder, |run| match run {
        run if run.starts_with('A') => "first",
        "C004" => "laetr",
        _ => "later",
    });
    let names: Vec<String> = (1..=48).flat_map(|k| [format!("A{k:03}"), format!("B{k:03}")]).collect();
    let known: Vec<&str> = names.iter().map(String::as_str).chain(["BASE"]).collect();
    let [rotor, _] = with_runs(&folder, &known);
    let all = json(&rotor_edge(&["estimate", &rotor, &data, "--trust-weights", "--json"]));
    let sessions = &all["sessions"];
    assert_eq!((sessions["source"].as_str(), sessions["learned_from"].as_u64()), (Some("stated"), Some(2)));
    assert_eq!(sessions["new_runs"], 1, "C004 alone is of no session with stated weights");
    assert!(sessions["words"][0].as_str().unwrap().contains("Session laetr has no run with stated weights"));
    let of =
        |run: &str| all["estimates"].as_array().unwrap().iter().find(|e| e["run"] == run).unwrap().clone();
    assert_eq!(
        (of("C003")["session"].as_str(), of("A001")["session"].as_str()),
        (Some("later"), Some("first"))
    );
}

#[test]
fn run_in_two_sessions_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let data = with_sessions(&folder, |_| "first");
    let text = std::fs::read_to_string(&data).unwrap().replacen("A005,first", "A005,second", 1);
    let data = written(&folder, "twice.csv", &text);
    let said = refusal(&["estimate", &rig("rotor.toml"), &data]);
    assert_says(&said, &["twice.csv", "run \"A005\"", "\"second\"", "\"first\"", "one session"]);
}

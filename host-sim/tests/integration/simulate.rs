//! `simulate` as a user meets it.

use crate::program::{assert_says, json, program, refusal, rotor_edge};
use rotor_edge::sample;
use serde_json::Value;
use tempfile::TempDir;

/// A folder with the sample's rotor, and where readings go.
struct Case {
    folder: TempDir,
    rotor: String,
    data: String,
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let (rotor, data) = (path("rotor.toml"), path("measured.csv"));
        std::fs::write(&rotor, sample::ROTOR).unwrap();
        Self { folder, rotor, data }
    }

    /// The same where the drawing has its usual errors.
    fn with_usual_errors() -> Self {
        let case = Self::new();
        let loose = sample::ROTOR
            .replace("exact = true", "exact = false\nmodulus_relative = 0.01\nposition_m = 5e-4");
        assert!(loose != sample::ROTOR);
        std::fs::write(&case.rotor, loose).unwrap();
        case
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// `simulate` with a few speeds, and more words.
    fn words<'a>(&'a self, more: &[&'a str]) -> Vec<&'a str> {
        let own = ["simulate", &self.rotor, "-o", &self.data, "--speeds", "2000..11000:19"];
        [&own, more].concat()
    }

    fn json(&self, more: &[&str]) -> Value {
        json(&rotor_edge(&[&self.words(more)[..], &["--json"]].concat()))
    }

    /// The sentence of a refusal that leaves nothing behind.
    #[track_caller]
    fn refused(&self, more: &[&str]) -> String {
        let said = refusal(&self.words(more));
        assert!(!std::path::Path::new(&self.data).exists(), "{said}");
        said
    }
}

#[test]
fn simulate_json_has_documented_keys_and_truth_file_the_same() {
    let case = Case::new();
    let truth = case.path("truth.json");
    let seal = [
        "--with",
        "seal@disk 3",
        "--set",
        "k=2e7",
        "--set",
        "q=5e6",
        "--with",
        "shaft_bow",
        "--set",
        "m=2e-5@90",
    ];
    let more = [&seal[..], &["--unbalance", "15=500@30", "--seed", "3", "--truth", &truth]].concat();
    let all = case.json(&more);
    assert_eq!((all["readings"].as_u64(), all["speeds_rpm"].as_array().unwrap().len()), (Some(19), 19));
    assert_eq!(all["probes"].as_array().unwrap().len(), 4);
    for p in all["probes"].as_array().unwrap() {
        assert!(
            p["name"].is_string() && p["largest_um"].as_f64().unwrap() > 0.0 && p["run"].is_null(),
            "{p}"
        );
        assert!((2000.0..=11_000.0).contains(&p["speed_rpm"].as_f64().unwrap()));
    }
    assert!(!all["critical_speeds_rpm"].as_array().unwrap().is_empty());
    assert!(all["noise"]["relative"].is_f64() && all["noise"]["floor_um"].is_f64());
    let written: Value = serde_json::from_str(&case.read("truth.json")).unwrap();
    assert_eq!(written, all["truth"]);
    let [first, second] = [0, 1].map(|k| &written["effects"][k]);
    assert_eq!((&first["effect"], &first["at"]), (&"seal".into(), &"disk 3".into()));
    assert_eq!(first["parameters"], serde_json::json!({ "k": 2e7, "q": 5e6, "c": 0.0 }));
    assert!(second["at"].is_null() && second["units"]["m"] == "m" && second["visible_sd"].is_null());
    assert!((second["parameters"]["m"][1].as_f64().unwrap() - 2e-5).abs() < 1e-12);
    let plane = &written["unbalance"][0];
    assert_eq!(plane["name"], "15");
    assert!((plane["unbalance_g_mm"].as_f64().unwrap() - 500.0).abs() < 1e-9);
    assert_eq!((&written["seed"], &written["hidden_seed"]), (&3.into(), &Value::Null));
}

#[test]
fn text_begins_with_the_readings_and_ends_with_the_next_step() {
    let case = Case::new();
    let page = case.path("page.html");
    let output = rotor_edge(&case.words(&[
        "--with",
        "pedestal@16",
        "--set",
        "k=2e8",
        "--set",
        "m=300",
        "--set",
        "c=4e4",
        "--report",
        &page,
    ]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.starts_with(&case.data)
            && text.contains("holds 19 simulated readings of 4 probes, at 19 speeds"),
        "{text}"
    );
    assert_says(
        &text,
        &[
            "largest, µm pk-pk",
            "µm 0-pk",
            "Undamped critical speeds as drawn",
            "Effect: pedestal@16 with c = 40.00 kN·s/m",
            "k = 200.0 MN/m",
        ],
    );
    assert!(
        text.trim_end().ends_with(&format!("rotor-edge diagnose {} {}", case.rotor, case.data)),
        "{text}"
    );
    let narrow = program().env("COLUMNS", "80").args(case.words(&[])).output().unwrap();
    let lines = String::from_utf8(narrow.stdout).unwrap();
    // a path is one word however long
    assert!(lines.lines().filter(|l| !l.contains('/')).all(|l| l.chars().count() <= 80), "{lines}");
    assert_says(
        &std::fs::read_to_string(page).unwrap(),
        &["Largest amplitude of each probe", "Probe 15X", "without noise"],
    );
}

#[test]
fn readings_are_read_by_compare_and_fit_within_their_noise() {
    let case = Case::new();
    assert!(rotor_edge(&case.words(&[])).status.success());
    assert!(case.read("measured.csv").starts_with("# simulated readings of "));
    let compared = json(&rotor_edge(&["compare", &case.rotor, &case.data, "--json"]));
    assert_eq!(compared["verdict"], "adequate");
    let chi2 = compared["chi2_per_value"].as_f64().unwrap();
    assert!((0.6..1.3).contains(&chi2), "{chi2}");
}

#[test]
fn trial_weights_make_runs_that_the_written_rotor_lists() {
    let case = Case::new();
    let table = case.path("weights.csv");
    std::fs::write(&table, "run,plane,magnitude_g_mm,angle_deg\nfirst,15,400,90\nfirst,16,100,0\n").unwrap();
    let with_runs = case.path("runs.toml");
    let all = case.json(&["--weights", &table, "--weight", "second:16=300@-45", "--write-rotor", &with_runs]);
    let names: Vec<&str> =
        all["runs"].as_array().unwrap().iter().map(|r| r["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["as found", "first", "second"]);
    assert_eq!(all["runs"][1]["weights"].as_array().unwrap().len(), 2);
    assert!(all["remarks"].as_array().unwrap().is_empty() && all["readings"] == 57);
    assert!(case.read("measured.csv").lines().nth(1).unwrap().starts_with("run,speed_rpm,15X_cos_um,"));
    let estimates = json(&rotor_edge(&["estimate", &with_runs, &case.data, "--json"]));
    let second = estimates["estimates"].as_array().unwrap().iter().find(|e| e["run"] == "second").unwrap();
    let stated = second["stated"].as_array().unwrap();
    assert!((stated[1]["unbalance_g_mm"].as_f64().unwrap() - 300.0).abs() < 1e-6);
    let without = case.json(&["--weight", "second:16=300@-45"]);
    assert_says(without["remarks"][0].as_str().unwrap(), &["does not list the runs", "--write-rotor FILE"]);
}

#[test]
fn same_seed_gives_the_same_file_and_another_seed_another_one() {
    let case = Case::with_usual_errors();
    let of = |more: &[&str]| {
        assert!(rotor_edge(&case.words(more)).status.success());
        case.read("measured.csv")
    };
    let first = of(&["--seed", "4"]);
    assert_eq!(first, of(&["--seed", "4"]));
    assert!(first != of(&["--seed", "5"]));
    assert!(first != of(&["--seed", "4", "--drawing-error", "1"]));
    let silent = of(&["--noise", "0", "--unbalance", "15=500@0", "--unbalance", "16=0@0"]);
    assert_eq!(
        silent,
        of(&["--noise", "0", "--unbalance", "15=500@0", "--unbalance", "16=0@0", "--seed", "9"])
    );
}

#[test]
fn hidden_effect_is_told_in_the_truth_alone() {
    let case = Case::new();
    let truth = case.path("truth.json");
    let output = rotor_edge(&case.words(&["--hide", "2", "--truth", &truth]));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let written: Value = serde_json::from_str(&case.read("truth.json")).unwrap();
    let hidden = &written["effects"][0];
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(!text.contains(hidden["effect"].as_str().unwrap()), "{text}");
    assert_says(&text, &["One effect is hidden, and told in the truth alone.", "rotor-edge diagnose"]);
    assert!(hidden["visible_sd"].as_f64().unwrap() >= 7.0 && written["hidden_seed"] == 2);
    let all = case.json(&["--hide", "2"]);
    assert!(all["truth"].is_null());
    assert_says(all["remarks"][0].as_str().unwrap(), &["the same command with --truth FILE tells it"]);
}

#[test]
fn drawing_error_is_told_with_its_numbers() {
    let case = Case::with_usual_errors();
    let all = case.json(&["--drawing-error", "11"]);
    let drawing = all["truth"]["drawing"].as_array().unwrap();
    assert!(drawing.len() > 10 && all["truth"]["drawing_seed"] == 11);
    for change in drawing {
        let is_position = change["what"].as_str().unwrap().ends_with("position_m");
        assert_eq!(change["unit"], if is_position { "m" } else { "" });
        assert!(change["deviations"].as_f64().unwrap().abs() <= 2.0, "{change}");
    }
}

#[test]
fn bad_statements_are_refused_in_one_sentence_and_write_nothing() {
    let case = Case::new();
    let missing = case.path("none.csv");
    let masses = case.path("masses.csv");
    std::fs::write(&masses, "run,plane,magnitude_g,angle_deg\nT,15,4,90\n").unwrap();
    for (more, says) in [
        (&["--with", "gremlins"][..], "there is no effect \"gremlins\", expected one of gyroscopic,"),
        (
            &["--with", "seal@disk 9", "--set", "k=1"],
            "seal cannot sit at \"disk 9\", expected one of \"disk 1\"",
        ),
        (&["--with", "seal", "--set", "k=1"], "seal needs a place, one of \"disk 1\""),
        (&["--with", "seal@disk 3"], "its size is not stated, expected k (N/m), q (N/m), c (N·s/m)"),
        (&["--with", "seal@disk 3", "--set", "kk=1"], "there is no parameter kk, expected k (N/m)"),
        (&["--with", "seal@disk 3", "--set", "k=-1e12"], "the parameter k is -1e12, expected"),
        (
            &["--with", "pedestal@16", "--set", "k=2e8"],
            "the parameter m is missing, expected k (N/m), m (kg), c (N·s/m)",
        ),
        (&["--with", "gyroscopic"], "gyroscopic is already in the model"),
        (&["--with", "runout", "--set", "v=1e-6"], "expected one for each probe: 15X, 15Y, 16X, 16Y"),
        (&["--unbalance", "17=5@0"], "there is no plane \"17\", expected one of \"15\", \"16\""),
        (&["--unbalance", "15=9e9@0"], "expected at most 5000 µm"),
        (&["--weight", "T:17=5@0"], "--weight: there is no plane \"17\""),
        (&["--weights", &missing], "none.csv"),
        (&["--weights", &masses], "masses.csv: states masses, expected unbalances as magnitude_g_mm"),
    ] {
        assert_says(&case.refused(more), &[says]);
    }
    assert_says(&case.refused(&["--drawing-error", "1"]), &["rotor.toml: ", "states an exact drawing"]);
    std::fs::write(&case.rotor, "speed_rpm,15X_cos_um\n1,2\n").unwrap();
    assert_says(&case.refused(&[]), &["rotor.toml", "expected a rotor file"]);
}

#[test]
fn wrong_notation_is_wrong_usage_with_an_example() {
    let case = Case::new();
    for (more, says) in [
        (&["--speeds", "9000..2000"][..], "does not go up, expected for example 600..6000:40"),
        (&["--noise", "2,0.1"], "is no noise, expected a part of the amplitude and µm 0-pk"),
        (&["--unbalance", "15"], "is no unbalance, expected PLANE=SIZE@ANGLE"),
        (&["--weight", "15=5@0"], "is no weight, expected RUN:PLANE=SIZE@ANGLE"),
        (&["--with", "seal@disk 3", "--set", "k"], "is no parameter, expected NAME=VALUE"),
        (&["--set", "k=1", "--with", "seal@disk 3"], "--set stands before any --with"),
    ] {
        let own = ["simulate", &case.rotor, "-o", &case.data];
        let output = rotor_edge(&[&own, more].concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        assert_says(&String::from_utf8_lossy(&output.stderr), &[says]);
    }
}

#[test]
fn rotor_that_is_read_is_not_overwritten_by_truth_or_readings() {
    let case = Case::new();
    for option in ["--truth", "--write-rotor", "--report"] {
        assert_says(&case.refused(&[option, &case.rotor]), &["is read and would be overwritten"]);
    }
    let said = refusal(&["simulate", &case.rotor, "-o", &case.rotor]);
    assert_says(&said, &["is read and would be overwritten"]);
    assert_says(&case.refused(&["--truth", &case.data]), &["name one file, expected two"]);
    assert_eq!(case.read("rotor.toml"), sample::ROTOR);
}

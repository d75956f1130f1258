//! `compare`, `diagnose`, `add` and `improve` as a user meets them: the JSON keys that others read, the
//! loop on the sample, and one clear sentence for each bad input.

mod bearing;
mod drawing;
mod mistakes;
mod probe;
mod refuted;
mod together;

use std::path::PathBuf;

use crate::program::{assert_says, refusal, rotor_edge};
use rotor_edge::sample;
use serde_json::Value;
use tempfile::TempDir;

/// The run-up of the day after the event.
const RUNUP: &str = include_str!("../../sample/turbine/runup-day126.csv");
const KIT: &str = include_str!("../../../tests/machines/single/case-000/rotor.toml");
const KIT_DATA: &str = include_str!("../../../tests/machines/single/case-000/measured.csv");
const PUMP_DATA: &str = include_str!("../../../tests/machines/single/case-003/measured.csv");

/// A rotor and what was measured on it, as files, and where a new rotor would go.
struct Case {
    folder: TempDir,
    rotor: String,
    data: String,
    new: String,
}

impl Case {
    fn new(rotor: &str, data: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let case = Self { rotor: path("rotor.toml"), data: path("data.csv"), new: path("new.toml"), folder };
        std::fs::write(&case.rotor, rotor).unwrap();
        std::fs::write(&case.data, data).unwrap();
        case
    }

    /// The sample turbine and its run-up of day 126.
    fn sample() -> Self {
        Self::new(sample::ROTOR, RUNUP)
    }

    fn new_exists(&self) -> bool {
        PathBuf::from(&self.new).exists()
    }

    fn compare(&self) -> Vec<&str> {
        vec!["compare", &self.rotor, &self.data]
    }

    fn diagnose(&self) -> Vec<&str> {
        vec!["diagnose", &self.rotor, &self.data]
    }

    fn add<'a>(&'a self, effect: &'a str) -> Vec<&'a str> {
        vec!["add", &self.rotor, effect, "--data", &self.data, "-o", &self.new]
    }

    fn improve(&self) -> Vec<&str> {
        vec!["improve", &self.rotor, &self.data, "-o", &self.new]
    }

    /// The one sentence that a command fails with.
    #[track_caller]
    fn refusal(&self, arguments: &[&str]) -> String {
        let message = refusal(arguments);
        let left = std::fs::read_dir(self.folder.path()).unwrap().count();
        assert_eq!(left, 2, "nothing is written when refused: {message}");
        message
    }

    /// Every command that reads data refuses these, in a sentence with these parts.
    #[track_caller]
    fn refused_by_all(&self, effect: &str, parts: &[&str]) {
        let all = [self.compare(), self.diagnose(), self.add(effect), self.improve()];
        let wrong: Vec<String> = all
            .iter()
            .filter_map(|arguments| {
                let output = rotor_edge(arguments);
                let said = String::from_utf8_lossy(&output.stderr).into_owned();
                let refused =
                    output.status.code() == Some(1) && output.stdout.is_empty() && !self.new_exists();
                let clear = said.trim_end().lines().count() == 1 && parts.iter().all(|p| said.contains(p));
                let shown = String::from_utf8_lossy(&output.stdout).into_owned();
                let _ = std::fs::remove_file(&self.new);
                (!refused || !clear).then(|| format!("{}: {said}{shown}", arguments[0]))
            })
            .collect();
        assert!(wrong.is_empty(), "expected to be refused with {parts:?}:\n{}", wrong.join("\n"));
    }
}

#[track_caller]
fn json(arguments: &[&str]) -> Value {
    crate::program::json(&rotor_edge(&[arguments, &["--json"]].concat()))
}

#[track_caller]
fn assert_keys(object: &Value, keys: &[&str]) {
    for key in keys {
        assert!(object.get(key).is_some(), "{key} is missing in: {object}");
    }
}

fn label(object: &Value) -> String {
    let effect = object["effect"].as_str().unwrap();
    object["at"].as_str().map_or_else(|| effect.to_string(), |at| format!("{effect}@{at}"))
}

/// Each reading of one probe, changed; components in µm.
fn change(data: &str, probe: &str, with: impl Fn(f64, f64) -> (f64, f64)) -> String {
    let header: Vec<&str> = data.lines().next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == format!("{probe}_{name}_um")).unwrap();
    let (cos, sin) = (column("cos"), column("sin"));
    let row = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
        let (c, s) = with(cells[cos].parse().unwrap(), cells[sin].parse().unwrap());
        (cells[cos], cells[sin]) = (format!("{c:.5}"), format!("{s:.5}"));
        cells.join(",")
    };
    let rows: Vec<String> = data.lines().skip(1).map(row).collect();
    format!("{}\n{}\n", header.join(","), rows.join("\n"))
}

const SAMPLE_PROBES: [&str; 4] = ["15X", "15Y", "16X", "16Y"];

#[test]
fn json_has_the_keys_that_others_read() {
    let case = Case::sample();
    let compared = json(&case.compare());
    assert_keys(
        &compared,
        &["readings", "residual_ratio", "relative_error", "chi2_per_value", "by_probe", "by_speed"],
    );
    assert_keys(&compared["residual_um"], &["sum", "mean"]);
    assert_keys(&compared["worst"], &["probe", "speed_rpm", "run"]);
    assert_eq!(compared["verdict"], "misses");
    assert_eq!(compared["by_probe"].as_array().unwrap().len(), 4);
    let diagnosed = json(&case.diagnose());
    assert_keys(&diagnosed, &["verdict", "error_before", "indistinguishable", "advice"]);
    let first = &diagnosed["candidates"][0];
    let keys = ["effect", "at", "probability", "delta_bic", "error_after", "parameters", "explanation"];
    assert_keys(first, &keys);
    assert_keys(&first["parameters"], &["k", "q", "c"]);
    assert!(diagnosed["indistinguishable"].as_array().unwrap().iter().all(Value::is_array));
    let sum: f64 =
        diagnosed["candidates"].as_array().unwrap().iter().map(|c| c["probability"].as_f64().unwrap()).sum();
    assert!(sum <= 1.0 + 1e-9, "probabilities add up to {sum}");
    let added = json(&case.add("seal@disk 3"));
    assert_keys(&added, &["error_before", "error_after", "parameters"]);
    assert_keys(&added["parameters"], &["k", "q", "c"]);
    for (a, b) in [("error_before", &diagnosed["error_before"]), ("error_after", &first["error_after"])] {
        let (a, b) = (added[a].as_f64().unwrap(), b.as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 0.01, "the commands agree: {a}, {b}");
    }
    let improved = json(&case.improve());
    assert_keys(&improved, &["steps", "verdict"]);
    assert_keys(&improved["steps"][0], &["effect", "at", "error_after"]);
}

#[test]
fn the_loop_closes_on_the_sample() {
    let case = Case::sample();
    let page = case.folder.path().join("page.html").display().to_string();
    let improved = json(&[&case.improve()[..], &["--report", &page]].concat());
    assert_eq!(improved["verdict"], "adequate", "{improved}");
    let page = std::fs::read_to_string(&page).unwrap();
    let heard =
        ["What is wrong", "How much better", "as it was", "Residual map before", "Residual map after"];
    assert_says(&page, &heard);
    assert_says(&page, &["SHA-256", &case.data, concat!("rotor-edge ", env!("CARGO_PKG_VERSION"))]);
    assert_eq!(improved["steps"].as_array().unwrap().len(), 1);
    assert_eq!(label(&improved["steps"][0]), "seal@disk 3");
    let written = std::fs::read_to_string(&case.new).unwrap();
    assert_says(&written, &["[[effect]]", "kind = \"seal\"", "at = \"disk 3\""]);
    let better = Case::new(&written, RUNUP);
    let compared = json(&better.compare());
    assert_eq!(compared["verdict"], "adequate");
    let (error, said) = (&compared["relative_error"], &improved["steps"][0]["error_after"]);
    assert!((error.as_f64().unwrap() / said.as_f64().unwrap() - 1.0).abs() < 0.02, "{error}, {said}");
    let again = json(&better.diagnose());
    assert_eq!(again["verdict"], "adequate");
    assert_says(&better.refusal(&better.add("seal@disk 3")), &["seal@disk 3", "already in the model"]);
    let nothing_more = json(&better.improve());
    assert_eq!(nothing_more["steps"].as_array().unwrap().len(), 0);
}

#[test]
fn people_are_told_what_was_found_and_what_to_do_next() {
    let case = Case::sample();
    let text = String::from_utf8(rotor_edge(&case.diagnose()).stdout).unwrap();
    assert_says(&text, &["seal@disk 3", "Seen here", "Inspect", "Next:", "rotor-edge add"]);
    let text = String::from_utf8(rotor_edge(&case.add("seal@disk 3")).stdout).unwrap();
    assert_says(&text, &["seal@disk 3 added", "error", "→", "Written to", "Next:"]);
}

#[test]
fn one_speed_leaves_everything_open_and_a_run_up_is_advised() {
    let case = Case::new(sample::ROTOR, sample::RECORD);
    let found = json(&case.diagnose());
    assert_eq!(found["verdict"], "undecided", "{}", found["summary"]);
    let candidates: Vec<String> = found["candidates"].as_array().unwrap().iter().map(label).collect();
    let group: Vec<&str> =
        found["indistinguishable"][0].as_array().unwrap().iter().map(|g| g.as_str().unwrap()).collect();
    assert!(candidates.len() > 10 && group.len() == candidates.len(), "{candidates:?}, {group:?}");
    let advice = found["advice"].to_string();
    assert!(advice.contains("run-up"), "{advice}");
    let fastest = |line: &str| line.split(',').nth(1).and_then(|v| v.parse::<f64>().ok());
    let fastest = sample::RECORD.lines().skip(1).filter_map(fastest).fold(0.0, f64::max);
    for a in found["advice"].as_array().unwrap() {
        let speed = a["speed_rpm"].as_f64().unwrap();
        assert!(speed <= 1.0501 * fastest, "{a} is faster than a machine that ran at {fastest} may turn");
    }
    let improved = json(&case.improve());
    assert_eq!(improved["verdict"], "undecided");
    assert_eq!(improved["steps"].as_array().unwrap().len(), 0, "nothing is claimed at one speed");
}

#[test]
fn one_reading_is_too_little_and_that_is_said() {
    let few: Vec<&str> = RUNUP.lines().take(2).collect();
    let case = Case::new(sample::ROTOR, &few.join("\n"));
    let found = json(&case.diagnose());
    assert_eq!(found["verdict"], "undecided");
    assert_says(found["summary"].as_str().unwrap(), &["1 operating point"]);
    // what tells effects apart lies far above the one slow speed, and nobody said that the machine may run there
    assert_eq!(found["advice"], serde_json::json!([]));
    assert_says(&found["remarks"].to_string(), &["another kind of measurement", "[rated] speed_rpm"]);
    // two planes and eight coefficients already have more unknowns than eight numbers
    assert_says(
        &case.refusal(&case.add("seal@disk 3")),
        &["8 measured values", "cannot determine 12 unknowns"],
    );
    assert_says(&case.refusal(&case.compare()), &["cannot determine", "more speeds"]);
}

#[test]
fn without_a_noise_section_noise_is_assumed_and_that_is_said() {
    let (head, tail) = sample::ROTOR.split_once("[noise]").unwrap();
    let rotor = format!("{head}{}", &tail[tail.find('[').unwrap()..]);
    let case = Case::new(&rotor, RUNUP);
    for arguments in [case.compare(), case.diagnose()] {
        assert_says(&json(&arguments)["remarks"].to_string(), &["no [noise]", "assumed"]);
        let text = String::from_utf8(rotor_edge(&arguments).stdout).unwrap();
        assert_says(&text, &["no [noise]", "assumed"]);
    }
    assert_eq!(label(&json(&case.diagnose())["candidates"][0]), "seal@disk 3");
}

#[test]
fn a_probe_stuck_at_zero_is_named() {
    let data = change(RUNUP, "16Y", |_, _| (0.0, 0.0));
    Case::new(sample::ROTOR, &data).refused_by_all("seal@disk 1", &["probe 16Y", "stuck or dead"]);
}

#[test]
fn a_clipped_probe_is_named() {
    let largest = |data: &str, probe: &str| {
        let seen = std::cell::Cell::new(0.0_f64);
        change(data, probe, |c, s| {
            seen.set(seen.get().max(c.hypot(s)));
            (c, s)
        });
        seen.get()
    };
    let limit = 0.5 * largest(RUNUP, "16X");
    let clipped = |c: f64, s: f64| {
        let factor = (limit / c.hypot(s)).min(1.0);
        (c * factor, s * factor)
    };
    let data = change(RUNUP, "16X", clipped);
    Case::new(sample::ROTOR, &data).refused_by_all("seal@disk 1", &["probe 16X", "clipped"]);
}

#[test]
fn reversed_phases_are_recognised() {
    let reversed = |data: &str, probes: &[&str]| {
        probes.iter().fold(data.to_string(), |data, probe| change(&data, probe, |c, s| (c, -s)))
    };
    let turbine = Case::new(sample::ROTOR, &reversed(RUNUP, &SAMPLE_PROBES));
    turbine.refused_by_all("seal@disk 1", &["phases are reversed", "_sin_um"]);
    let kit = Case::new(KIT, &reversed(KIT_DATA, &["IBX", "IBY", "OBX", "OBY"]));
    kit.refused_by_all("seal@disk 1", &["phases are reversed", "_sin_um"]);
}

#[test]
fn a_reader_that_stops_reading_is_no_failure() {
    let case = Case::sample();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = crate::program::program();
    let output = command.args(case.diagnose()).stdout(writer).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn data_without_this_rotors_probes_are_refused() {
    Case::new(KIT, PUMP_DATA).refused_by_all("seal@disk 1", &["data.csv", "header", "IBX_cos_um", "kit"]);
}

#[test]
fn unknown_effects_and_places_are_refused_with_valid_ones() {
    let case = Case::sample();
    let says = |effect: &str, parts: &[&str]| assert_says(&case.refusal(&case.add(effect)), parts);
    says("seal@disk 9", &["seal cannot sit at \"disk 9\"", "\"disk 1\", \"disk 2\", \"disk 3\""]);
    says("seal@16", &["seal cannot sit at \"16\"", "\"disk 1\""]);
    says("pedestal@disk 1", &["pedestal cannot sit at \"disk 1\"", "\"15\", \"16\""]);
    says("seal", &["seal needs a place", "\"disk 1\""]);
    says("seal@", &["seal", "\"\"", "\"disk 1\""]);
    says("shaft_bow@disk 1", &["shaft_bow", "whole machine", "\"disk 1\""]);
    says("friction", &["no effect \"friction\"", "shaft_bow", "internal_damping"]);
    says("gyroscopic", &["gyroscopic", "already in the model"]);
}

#[test]
fn effects_in_the_rotors_file_are_checked() {
    let refused = |entry: &str, parts: &[&str]| {
        let case = Case::new(&format!("{}\n[[effect]]\n{entry}\n", sample::ROTOR), RUNUP);
        for arguments in [case.diagnose(), case.improve()] {
            let message = case.refusal(&arguments);
            assert_says(&message, &["rotor.toml"]);
            assert_says(&message, parts);
        }
    };
    let seal = "kind = \"seal\"\nat = \"disk 3\"\nparameters = { k = 1e6, q = 1e6, c = 1e3 }";
    refused(&seal.replace("c = 1e3", "d = 1e3"), &["[[effect]]", "seal", "parameter c is missing", "N·s/m"]);
    refused(&seal.replace("c = 1e3", "c = 1e3, d = 1e3"), &["[[effect]]", "parameter d", "k, q, c"]);
    refused(&seal.replace("1e3", "nan"), &["[[effect]]", "parameter c"]);
    refused(&seal.replace("c = 1e3", "c = [1.0, 2.0]"), &["[[effect]]", "parameter c"]);
    refused(&seal.replace("disk 3", "disk 9"), &["[[effect]]", "\"disk 9\"", "\"disk 3\""]);
    refused(&seal.replace("at = \"disk 3\"\n", ""), &["[[effect]]", "seal needs a place"]);
    refused(&seal.replace("seal", "friction"), &["[[effect]]", "no effect \"friction\""]);
    refused(&format!("{seal}\n[[effect]]\n{seal}"), &["[[effect]]", "seal", "twice"]);
    refused("kind = \"shaft_bow\"\nparameters = { m = 1e-5 }", &["[[effect]]", "m", "[real, imaginary]"]);
    refused(&seal.replace("kind", "name"), &["name"]);
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let case = Case::sample();
    let nowhere = case.folder.path().join("no/such/new.toml").display().to_string();
    let add = ["add", &case.rotor, "seal@disk 3", "--data", &case.data, "-o", &nowhere];
    let improve = ["improve", &case.rotor, &case.data, "-o", &nowhere];
    for arguments in [&add[..], &improve] {
        assert_says(&case.refusal(&[arguments, &["--json"]].concat()), &["new.toml", "cannot be written"]);
    }
    for arguments in [case.compare(), case.diagnose()] {
        let message = case.refusal(&[&arguments[..], &["--report", "/no/such/report.html"]].concat());
        assert_says(&message, &["report.html", "cannot be written"]);
    }
}

#[test]
fn improve_writes_no_model_beside_an_unknown_cause_unless_asked() {
    // two runs of a rig one of whose probes is off: too few to name it
    let rig = include_str!("../../../tests/rigs/rk4/rotor.toml");
    let measured = include_str!("../../../tests/rigs/rk4/measured.csv").lines();
    let of_run = |line: &&str| ["run,", "A003,", "A007,"].iter().any(|start| line.starts_with(start));
    let rows: Vec<&str> = measured.filter(of_run).collect();
    let case = Case::new(rig, &format!("{}\n", rows.join("\n")));
    let output = rotor_edge(&case.improve());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.starts_with("unknown: "), "{text}");
    assert_says(&text, &["Nothing is written", "--even-so", "rotor-edge diagnose"]);
    assert!(!case.new_exists());
    assert_eq!(json(&case.improve())["written"], false);
    let even_so = json(&[&case.improve()[..], &["--even-so"]].concat());
    assert_eq!((&even_so["written"], &even_so["verdict"]), (&true.into(), &"unknown".into()));
    assert!(case.new_exists());
}

#[test]
fn wrong_usage_exits_with_2() {
    let case = Case::sample();
    let (rotor, data, new) = (case.rotor.as_str(), case.data.as_str(), case.new.as_str());
    for arguments in [
        &["add", rotor, "seal@disk 3", "-o", new][..],
        &["add", rotor, "seal@disk 3", "--data", data],
        &["add", rotor, "--data", data, "-o", new],
        &["improve", rotor, data],
        &["improve", rotor, "-o", new],
        &["diagnose", rotor],
        &["diagnose", rotor, data, "--top", "many"],
        &["compare", rotor],
        &["compare"],
    ] {
        let output = rotor_edge(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty());
    }
    assert!(!case.new_exists());
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn the_data_of_a_similar_machine_are_not_explained() {
        let compressor = include_str!("../../../tests/machines/single/case-008/measured.csv");
        let fan = include_str!("../../../tests/machines/single/case-009/measured.csv");
        for (data, probes) in [
            (compressor, ["1X", "1Y", "2X", "2Y"]),
            (fan, ["NDEX", "NDEY", "DEX", "DEY"]),
            (PUMP_DATA, ["NDEX", "NDEY", "DEX", "DEY"]),
        ] {
            let (header, rows) = data.split_once('\n').unwrap();
            let header = probes.iter().zip(SAMPLE_PROBES).fold(format!(",{header}"), |h, (from, to)| {
                h.replace(&format!(",{from}_"), &format!(",{to}_"))
            });
            let case = Case::new(sample::ROTOR, &format!("{}\n{rows}", &header[1..]));
            let verdict = json(&case.diagnose())["verdict"].clone();
            assert!(verdict == "undecided" || verdict == "unknown", "{verdict}");
            assert_eq!(json(&case.compare())["verdict"], "misses");
        }
    }

    #[test]
    fn the_data_of_another_machine_are_recognised() {
        let renamed = PUMP_DATA
            .replace("NDEX", "IBX")
            .replace("NDEY", "IBY")
            .replace("DEX", "OBX")
            .replace("DEY", "OBY");
        Case::new(KIT, &renamed).refused_by_all("seal@disk 1", &["another machine", "kit"]);
        let renamed =
            KIT_DATA.replace("IBX", "15X").replace("IBY", "15Y").replace("OBX", "16X").replace("OBY", "16Y");
        Case::new(sample::ROTOR, &renamed).refused_by_all("seal@disk 1", &["another machine", "turbine"]);
    }
}

/// The run-up with nonsense for a probe, and without its columns.
fn spoilt_and_bare(probe: &str) -> [String; 2] {
    let header: Vec<&str> = RUNUP.lines().next().unwrap().split(',').collect();
    let is_of_probe = |column: usize| header[column].starts_with(probe);
    let changed = |change: &dyn Fn(usize, usize, &str) -> Option<String>| {
        let row = |(number, line): (usize, &str)| {
            let cells = line.split(',').enumerate();
            cells.filter_map(|(column, cell)| change(number, column, cell)).collect::<Vec<_>>().join(",")
        };
        RUNUP.lines().enumerate().map(row).collect::<Vec<_>>().join("\n") + "\n"
    };
    let spoilt = changed(&|row, column, cell| {
        let nonsense = ((row * 7 + column * 3) % 11) as f64 * 9.5;
        Some(if row > 0 && is_of_probe(column) { nonsense.to_string() } else { cell.into() })
    });
    let bare = changed(&|_, column, cell| (!is_of_probe(column)).then(|| cell.into()));
    [spoilt, bare]
}

#[test]
fn probe_left_out_stays_in_file_and_is_used_by_no_command() {
    let [spoilt, bare] = spoilt_and_bare("16X");
    let case = Case::new(sample::ROTOR, &spoilt);
    let improve = |more: &[&str]| rotor_edge(&[&case.improve()[..], more].concat());
    let mut found = crate::program::json(&improve(&["--without", "16X", "--json"]));
    let remarks = found.as_object_mut().unwrap().remove("remarks").unwrap().to_string();
    assert_says(&remarks, &["Not used: 16X. Readings have 6 features for 4 unknowns: 2 left."]);
    let written = std::fs::read_to_string(&case.new).unwrap();
    assert_eq!((written.matches("[[probe]]").count(), written.matches("used = false").count()), (4, 1));

    // the same as of a machine that has no such probe
    let mut rotor = rotor_edge_desktop::rotor_file::parse("rotor.toml", sample::ROTOR).unwrap();
    rotor.probe.retain(|probe| probe.name != "16X");
    let other = Case::new(&toml::to_string(&rotor).unwrap(), &bare);
    let mut expected = crate::program::json(&rotor_edge(&[&other.improve()[..], &["--json"]].concat()));
    expected.as_object_mut().unwrap().remove("remarks");
    assert_eq!(found, expected);

    let again = rotor_edge(&["diagnose", &case.new, &case.data]);
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    let unknown = refusal(&[&case.improve()[..], &["--without", "17X"]].concat());
    assert_says(&unknown, &["there is no probe \"17X\"", "\"15X\", \"15Y\", \"16X\", \"16Y\""]);
}

//! The program as a user meets it: exit codes, JSON, and one clear sentence for each bad input.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::program::{assert_says, rotor_edge};
use rotor_edge::sample;
use serde_json::Value;
use tempfile::TempDir;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, text: &str) -> String {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name).display().to_string()
    }
}

/// The sample's drawing and first days in a folder, and the arguments that identify them.
fn identify(folder: &Folder) -> Vec<String> {
    let (rotor, record) = (folder.file("r.toml", sample::ROTOR), folder.file("c.csv", sample::RECORD));
    ["identify", &rotor, &record, "-o"].map(String::from).to_vec()
}

/// Runs `replay` on these texts; the one sentence that it fails with.
fn refusal(rotor: &str, record: &str) -> String {
    let folder = Folder::new();
    let (rotor, record) = (folder.file("rotor.toml", rotor), folder.file("record.csv", record));
    crate::program::refusal(&["replay", "--rotor", &rotor, "--record", &record])
}

fn json(arguments: &[&str]) -> Value {
    crate::program::json(&rotor_edge(arguments))
}

#[test]
fn without_a_command_the_main_job_runs_and_says_what_to_do_next() {
    let output = rotor_edge(&[]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success());
    assert_says(
        &text,
        &["turbine", "on day 125", "suspect bearing 16", "Next:", "improve", "replay --better"],
    );
}

#[test]
fn replay_json_has_the_keys_that_others_read() {
    let all = json(&["replay", "--json"]);
    assert_eq!(all["readings"], 451, "one of them without a probe");
    let e = &all["equivalence"];
    assert!(e["max_relative_feature_error"].as_f64().unwrap() <= 1e-5);
    let unbalance = &all["unbalance"];
    assert_eq!(unbalance["with_bearings"], true, "phase I was run: {unbalance}");
    assert_eq!(unbalance["outdated"], true, "the last readings are flagged");
    assert!(unbalance["time_d"].as_f64().unwrap() <= 126.0, "{unbalance}");
    for plane in unbalance["determined"]["planes"].as_array().unwrap() {
        let bound = |side: usize| plane["interval_95"][side].as_f64().unwrap();
        let found = plane["unbalance_g_mm"].as_f64().unwrap();
        assert!(bound(0) < found && found < bound(1), "{plane}");
    }
    for key in ["max_residual_excess_um", "max_unbalance_difference_g_mm", "max_angle_difference_deg"] {
        assert!(e[key].is_f64(), "{key}");
    }
    assert!(e["max_relative_gap"].as_f64().unwrap() <= 1e-3);
    assert_eq!((&e["compared"], &e["certified"]), (&451.into(), &451.into()));
    let states = all["states"].as_array().unwrap();
    let told: Vec<[&str; 2]> =
        states.iter().map(|s| ["state", "reason"].map(|key| s[key].as_str().unwrap())).collect();
    assert!(told.windows(2).all(|pair| pair[0] != pair[1]), "changes only: {told:?}");
    assert_eq!(told[..3], [["waiting", "no_reading"], ["learning", "learning"], ["tracking", "none"]]);
    let first_flag = states.iter().find(|s| s["state"] == "flagged").unwrap();
    assert_eq!(first_flag["time_d"], all["flags"][0]["time_d"]);
    assert_eq!(all["flags"][0]["suspect"], "16");
    assert!((125.0..=130.0).contains(&all["flags"][0]["time_d"].as_f64().unwrap()));
    assert_eq!(all["frames"]["lost"], 0);
    assert_eq!(all["frames"]["sent"], all["frames"]["received"]);
}

#[test]
fn identified_rotor_is_written_whole_and_can_be_replayed() {
    let folder = Folder::new();
    let rotor = folder.file("rotor.toml", sample::ROTOR);
    let record = folder.file("record.csv", sample::RECORD);
    let runup = folder.file("runup.csv", sample::RUNUP_DAY_0);
    let new = folder.path("new.toml").display().to_string();
    let found =
        json(&["identify", &rotor, &record, "--days", "0..2", "--runup", &runup, "-o", &new, "--json"]);
    assert_eq!(found["bearings"].as_array().unwrap().len(), 8);
    assert_eq!(found["planes"].as_array().unwrap().len(), 2);
    assert!(found["residual_ratio"].as_f64().unwrap() < 0.1);
    let played = json(&["replay", "--identified", "--rotor", &new, "--record", &record, "--json"]);
    assert_eq!(played["readings"], 451);
    let direct = json(&["replay", "--json"]);
    assert_eq!(played["flags"], direct["flags"], "the file carries the whole model");
}

#[test]
fn record_at_one_speed_leaves_coefficients_unidentified() {
    let folder = Folder::new();
    let rotor = folder.file("rotor.toml", sample::ROTOR);
    let record = folder.file("record.csv", sample::RECORD);
    let new = folder.path("new.toml").display().to_string();
    let found = json(&["identify", &rotor, &record, "-o", &new, "--json"]);
    let open = found["bearings"].as_array().unwrap().iter().filter(|b| b["identified"] == false).count();
    assert!(open >= 3, "one speed cannot fix eight coefficients: {found}");
    for plane in found["determined"]["planes"].as_array().unwrap() {
        assert!(plane["interval_95"][1].as_f64() > plane["unbalance_g_mm"].as_f64(), "{plane}");
    }
}

#[test]
fn bad_rotors_are_refused_with_the_key_and_what_was_expected() {
    let good = sample::ROTOR;
    let change = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        refusal(&good.replacen(from, to, 1), sample::RECORD)
    };
    assert_says(&change("schema = 2", "schema = 3"), &["rotor.toml", "schema", "expected 1 to 2"]);
    assert_says(&change("[physics]", "colour = 3\n[physics]"), &["line", "colour"]);
    assert_says(&change("length_m = 0.08", "length_m = -0.08"), &["[[shaft]] 1 length_m", "-0.08"]);
    assert_says(&change("length_m = 0.08", "length_m = 80.0"), &["[[shaft]] 1 length_m", "50"]);
    assert_says(&change("youngs_modulus_pa = 2.0800e+11", "youngs_modulus_pa = 208.0"), &["Pa"]);
    assert_says(
        &change("position_m = 0.76", "position_m = 7.6"),
        &["disk 3", "7.6 m is not on the shaft", "1.04"],
    );
    assert_says(
        &change("bearing = \"15\"", "bearing = \"17\""),
        &["15X", "no bearing \"17\"", "\"15\", \"16\""],
    );
    assert_says(&change("mass_kg = 18.0", "mass_kg = nan"), &["disk 1", "mass_kg"]);
    assert_says(&change("name = \"16X\"", "name = \"15X\""), &["[[probe]]", "15X", "twice"]);
    assert_says(&change("relative = 0.02", "relative = -1.0"), &["[noise] relative"]);
    let without_shaft = good.split("[[shaft]]").next().unwrap();
    assert_says(&refusal(without_shaft, sample::RECORD), &["shaft"]);
    let third = "\n[[bearing]]\nname = \"17\"\nposition_m = 0.5\nstiffness_n_m = { xx = 1e8, yy = 1e8 }\ndamping_n_s_m = { xx = 1e5, yy = 1e5 }\n";
    let many: String = (0..15)
        .map(|i| third.replace("17", &format!("x{i}")).replace("0.5", &format!("0.5{i:02}")))
        .collect();
    assert_says(&refusal(&format!("{good}{many}"), sample::RECORD), &["17 given", "one to 16 bearings"]);
    let twice = third.replace("0.5", "0.11");
    let place = good
        .split("[[bearing]]")
        .nth(1)
        .unwrap()
        .split("position_m = ")
        .nth(1)
        .unwrap()
        .lines()
        .next()
        .unwrap();
    assert_says(
        &refusal(&format!("{good}{}", twice.replace("0.11", place)), sample::RECORD),
        &["[[bearing]] \"17\" position_m", "the bearing \"15\" is at the same place"],
    );
    let head = good.split("[[bearing]]").next().unwrap();
    let tail = &good[good.find("[[probe]]").unwrap()..];
    assert_says(&refusal(&format!("{head}{tail}"), sample::RECORD), &["0 given", "one to 16 bearings"]);
}

#[test]
fn invalid_records_are_refused_with_row_and_column() {
    let good = sample::RECORD;
    let change = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        refusal(sample::ROTOR, &good.replacen(from, to, 1))
    };
    assert_says(&refusal(sample::ROTOR, ""), &["record.csv", "empty"]);
    assert_says(&refusal(sample::ROTOR, good.lines().next().unwrap()), &["no reading"]);
    assert_says(&change("2.03961,", ""), &["row 2", "9 cells, expected 10"]);
    assert_says(&change("2.03961", "abc"), &["row 2, column 15X_cos_um", "\"abc\" is not a number"]);
    assert_says(&change("2.03961", "NaN"), &["row 2, column 15X_cos_um", "NaN"]);
    assert_says(&change("2.03961", "inf"), &["row 2", "inf"]);
    assert_says(&change("2.03961", "2039610"), &["row 2", "more than a probe can see"]);
    assert_says(&change("11033.79", "0"), &["row 2, column speed_rpm", "positive speed in rpm"]);
    assert_says(&change("11033.79", ""), &["row 2, column speed_rpm"]);
    assert_says(&change("\n2,", "\n0.5,"), &["row 4", "time_d goes back from 1 to 0.5"]);
    // the last day jumps
    assert_says(&change("\n458,", "\n3e8,"), &["record.csv: row 452, column time_d", "300000000", "no day"]);
    assert_says(&change("15X_cos_um", "3X_cos_um"), &["header", "15X_cos_um", "turbine", "missing"]);
    assert_says(&change("time_d,", "time_d,extra,"), &["header", "extra", "no probe"]);
}

#[test]
fn replay_with_row_of_zeros_finds_no_error_of_the_core() {
    let zeros = |line: &str| {
        let cells = line.split(',').enumerate();
        cells.map(|(column, cell)| if column < 2 { cell } else { "0" }).collect::<Vec<_>>().join(",")
    };
    let rows = sample::RECORD.lines().take(29).enumerate();
    let rows: Vec<String> =
        rows.map(|(row, line)| if row == 15 { zeros(line) } else { line.into() }).collect();
    let folder = Folder::new();
    let files = [("r.toml", sample::ROTOR), ("c.csv", &rows.join("\n")), ("u.csv", sample::RUNUP_DAY_0)];
    let [rotor, record, runup] = files.map(|(name, text)| folder.file(name, text));
    let output = rotor_edge(&["replay", "--rotor", &rotor, "--record", &record, "--runup", &runup, "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn missing_files_and_unwritable_outputs_are_named() {
    let missing = rotor_edge(&["replay", "--rotor", "nowhere.toml", "--record", "nowhere.csv"]);
    assert_eq!(missing.status.code(), Some(1));
    assert_says(&String::from_utf8(missing.stderr).unwrap(), &["nowhere.toml", "cannot be read"]);
    let folder = Folder::new();
    let (rotor, record) = (folder.file("r.toml", sample::ROTOR), folder.file("c.csv", sample::RECORD));
    let output = folder.path("no/such/folder/new.toml").display().to_string();
    let refused = rotor_edge(&["identify", &rotor, &record, "-o", &output]);
    assert_eq!(refused.status.code(), Some(1));
    assert_says(&String::from_utf8(refused.stderr).unwrap(), &["new.toml", "cannot be written"]);
    assert!(!Path::new(&output).exists());
}

#[test]
fn input_files_and_devices_are_not_overwritten_without_force() {
    let folder = Folder::new();
    let arguments = identify(&folder);
    let with = |more: &[&str]| {
        let all: Vec<&str> = arguments.iter().map(String::as_str).chain(more.iter().copied()).collect();
        rotor_edge(&all)
    };
    let said = |more: &[&str]| {
        let refused = with(more);
        assert_eq!(refused.status.code(), Some(1), "{more:?}");
        String::from_utf8(refused.stderr).unwrap()
    };
    let rotor = arguments[1].as_str();
    assert_says(&said(&[rotor]), &["r.toml: is read and would be overwritten", "--force"]);
    assert_says(&said(&["/dev/null"]), &["/dev/null: cannot be written", "a device"]);
    let new = folder.path("new.toml").display().to_string();
    assert_says(&said(&[&new, "--report", &new]), &["new.toml", "one file, expected two"]);
    assert_eq!(std::fs::read_to_string(rotor).unwrap(), sample::ROTOR);
    assert!(with(&[rotor, "--force"]).status.success());
    assert!(std::fs::read_to_string(rotor).unwrap().contains("unbalance_g_mm"));
}

#[test]
fn closed_pipe_succeeds_and_full_disk_on_stdout_fails() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let folder = Folder::new();
    let rotor = folder.file("r.toml", sample::ROTOR);
    let mut check = crate::program::program();
    let refused = check.args(["check", &rotor]).stdout(full).output().unwrap();
    assert_eq!(refused.status.code(), Some(1));
    assert_says(&String::from_utf8(refused.stderr).unwrap(), &["standard output: cannot be written"]);
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut check = crate::program::program();
    let unread = check.args(["check", &rotor]).stdout(writer).output().unwrap();
    assert!(unread.status.success(), "{}", String::from_utf8_lossy(&unread.stderr));
}

#[test]
fn completions_and_manual_pages_cover_every_command() {
    let help = String::from_utf8(rotor_edge(&["--help"]).stdout).unwrap();
    let listed = help.lines().skip_while(|l| *l != "Commands:").skip(1).take_while(|l| !l.is_empty());
    // A description that a narrow terminal wraps goes on further to the right than a name begins.
    let names = listed.filter_map(|l| l.strip_prefix("  ")).filter(|l| !l.starts_with(' '));
    let commands: Vec<&str> =
        names.filter_map(|l| l.split_whitespace().next()).filter(|c| *c != "help").collect();
    assert!(commands.contains(&"improve"), "{commands:?}");
    for shell in ["bash", "zsh", "fish"] {
        let script = String::from_utf8(rotor_edge(&["completions", shell]).stdout).unwrap();
        assert_says(&script, &commands);
    }
    let folder = Folder::new();
    let target = folder.path("");
    assert!(rotor_edge(&["manual", "--folder", &target.display().to_string()]).status.success());
    assert!(std::fs::read_to_string(folder.path("rotor-edge.1")).unwrap().contains(".TH"));
    for command in commands {
        let page = std::fs::read_to_string(folder.path(&format!("rotor-edge-{command}.1"))).unwrap();
        assert!(page.contains(".SH SYNOPSIS"), "{command}: {page}");
    }
    let nowhere = folder.path("none").display().to_string();
    assert_says(&crate::program::refusal(&["manual", "--folder", &nowhere]), &["there is no such folder"]);
}

#[test]
fn version_in_git_clone_ends_with_commit() {
    let shown = String::from_utf8(rotor_edge(&["--version"]).stdout).unwrap();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let plain = concat!("rotor-edge ", env!("CARGO_PKG_VERSION"));
    let head = Command::new("git").current_dir(repository).args(["log", "-1", "--format=%H"]).output();
    // a machine may have the clone and no git, and a copy without its history may lie in another's repository
    let Some(head) = head.ok().filter(|_| repository.join(".git").exists()) else {
        return assert_eq!(shown.trim_end(), plain);
    };
    let commit = String::from_utf8(head.stdout).unwrap();
    let named =
        shown.trim_end().strip_prefix(plain).and_then(|rest| rest.strip_prefix(" (")?.strip_suffix(')'));
    assert!(named.is_some_and(|named| named.len() >= 12 && commit.starts_with(named)), "{shown}: {commit}");
}

#[test]
fn wrong_usage_exits_with_2() {
    for arguments in
        [&["replay", "--rotor", "only.toml"][..], &["fly"], &["identify"], &["replay", "--node", "x"]]
    {
        assert_eq!(rotor_edge(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn invalid_node_number_and_probability_are_refused() {
    for (arguments, says) in [
        (&["replay", "--node", "31"][..], "0 to 30"),
        (&["replay", "--loss", "1.5"], "probability between 0 and 1"),
        (&["replay", "--growth", "nan"], "--growth"),
    ] {
        let output = rotor_edge(arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        assert_says(&String::from_utf8(output.stderr).unwrap(), &[says]);
    }
}

#[test]
fn nothing_is_said_of_a_record_of_which_no_reading_arrived() {
    let refused = crate::program::refusal(&["replay", "--loss", "1"]);
    assert_says(&refused, &["0 of ", "readings were evaluated", "nothing can be said"]);
}

#[test]
fn power_cuts_keep_flags_and_states_show_each_restart() {
    let whole = json(&["replay", "--json"]);
    let cut = json(&["replay", "--json", "--power-cut", "60", "--power-cut", "200"]);
    assert_eq!(cut["flags"], whole["flags"]);
    assert_eq!(cut["readings"], whole["readings"]);
    let states = cut["states"].as_array().unwrap();
    let back = |day: f64| states.iter().find(|s| s["time_d"] == day).unwrap()["state"].clone();
    assert_eq!((back(60.0), back(200.0)), ("waiting".into(), "flagged".into()));
    let after = states.iter().filter(|s| s["time_d"].as_f64().unwrap() >= 127.0);
    assert!(after.into_iter().all(|s| s["state"] == "flagged"), "{states:?}");
    let refused = crate::program::refusal(&["replay", "--power-cut", "500"]);
    assert_says(&refused, &["--power-cut 500", "the record lasts from day 0 to 458"]);
}

#[test]
fn failed_probe_is_named_and_remaining_probes_are_used() {
    let folder = Folder::new();
    let rotor = folder.file("rotor.toml", sample::ROTOR);
    let (record, runup) =
        (folder.file("record.csv", sample::RECORD), folder.file("runup.csv", sample::RUNUP_DAY_0));
    let new = folder.path("new.toml").display().to_string();
    json(&["identify", &rotor, &record, "--runup", &runup, "-o", &new, "--json"]);
    // 16Y from day 40 on, 16X too from day 80 on
    let dead = |(number, line): (usize, &str)| {
        let day = line.split(',').next().and_then(|day| day.parse::<f64>().ok());
        let mut cells: Vec<&str> = line.split(',').collect();
        let lost = match day.filter(|_| number > 0) {
            Some(day) if day >= 80.0 => 4,
            Some(day) if day >= 40.0 => 2,
            _ => 0,
        };
        let kept = cells.len() - lost;
        cells[kept..].fill("");
        cells.join(",") + "\n"
    };
    let text: String = sample::RECORD.lines().enumerate().take(115).map(dead).collect();
    let record = folder.file("dying.csv", &text);
    let all = json(&["replay", "--identified", "--rotor", &new, "--record", &record, "--json", "--answers"]);
    assert_eq!(all["flags"], Value::Array(vec![]));
    let said: Vec<(f64, &str, &str)> = all["states"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| (s["time_d"].as_f64().unwrap(), s["state"].as_str().unwrap(), s["reason"].as_str().unwrap()))
        .collect();
    assert!(said.contains(&(40.0, "tracking", "probes")), "{said:?}");
    let (from_d, _, reason) = said.iter().find(|(_, state, _)| *state == "blind").unwrap();
    assert!(
        *from_d >= 80.0 && *from_d <= 81.0 && ["no_redundancy", "undetermined"].contains(reason),
        "{said:?}"
    );
    // nothing was judged after day 79 or so, and two and a half days later that is said
    assert!(said.iter().any(|(day, state, _)| *state == "stale" && *day > 80.0 && *day < 84.0), "{said:?}");
    assert!(
        said.iter().filter(|(day, ..)| *day > 81.0).all(|(_, state, _)| *state != "tracking"),
        "{said:?}"
    );
    let used = |row: &Value| row["probes_used"].as_array().unwrap().len();
    let answers = all["answers"].as_array().unwrap();
    assert!(answers.iter().all(|a| used(a) == if a["time_d"].as_f64() < Some(40.0) { 4 } else { 3 }
        || a["time_d"].as_f64() >= Some(80.0)));
    assert!(all["equivalence"]["max_relative_feature_error"].as_f64().unwrap() <= 1e-5);
    let text = String::from_utf8(
        rotor_edge(&["replay", "--identified", "--rotor", &new, "--record", &record]).stdout,
    );
    assert_says(
        &text.unwrap(),
        &["from day 40", "tracking: probes, without 16Y", "blind", "stale", "a verdict counts for 2.5 d"],
    );
}

#[test]
fn the_age_limit_and_every_threshold_can_be_given() {
    let folder = Folder::new();
    let text: String = sample::RECORD
        .lines()
        .enumerate()
        .filter(|(n, _)| *n < 30 || *n > 40)
        .map(|(_, l)| format!("{l}\n"))
        .collect();
    let record = folder.file("hole.csv", &text);
    let rotor = folder.file("rotor.toml", sample::ROTOR);
    let stale = |more: &[&str]| {
        let all = json(&[&["replay", "--rotor", &rotor, "--record", &record, "--json"], more].concat());
        let states = all["states"].as_array().unwrap().clone();
        states.iter().find(|s| s["state"] == "stale").map(|s| s["time_d"].as_f64().unwrap())
    };
    // the last reading before the hole is that of day 28
    assert_eq!(stale(&[]), Some(30.5));
    assert_eq!(stale(&["--age-limit-s", "432000"]), Some(33.0));
    assert_eq!(stale(&["--set", "age_limit_s=604800"]), Some(35.0));
    for (set, says) in [
        ("height=1", "there is no threshold height"),
        ("rise=-1", "rise is to be from 0 to 100"),
        ("age_limit_s=0", "age_limit_s is to be from 0.1 s"),
    ] {
        assert_says(&crate::program::refusal(&["replay", "--set", set]), &[says]);
    }
}

#[test]
fn the_protocol_of_any_monitor_is_written_as_a_dbc_file() {
    let folder = Folder::new();
    let path = folder.path("monitor7.dbc").display().to_string();
    let shown = String::from_utf8(rotor_edge(&["dbc", "--node", "7"]).stdout).unwrap();
    assert_says(&shown, &["BO_ 263 ReadingStart", "BO_ 1031 Heartbeat", "of monitor 7"]);
    json(&["dbc", "--node", "7", "-o", &path, "--json"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), shown);
    assert_eq!(json(&["dbc", "--node", "7", "--json"])["dbc"], shown.as_str());
    assert_eq!(rotor_edge(&["dbc", "--node", "31"]).status.code(), Some(2));
    let nowhere = folder.path("no/folder/x.dbc").display().to_string();
    assert_says(&crate::program::refusal(&["dbc", "-o", &nowhere]), &["x.dbc", "cannot be written"]);
}

#[test]
fn a_track_of_planes_with_commas_in_their_names_is_forecast() {
    let folder = Folder::new();
    let rotor = folder.file("r.toml", &sample::ROTOR.replace("\"15\"", "\"1,5\""));
    let (record, track) = (folder.file("c.csv", sample::RECORD), folder.path("t.csv").display().to_string());
    let tracked = rotor_edge(&["track", &rotor, &record, "--method", "fixed", "--csv", &track]);
    assert!(tracked.status.success(), "{}", String::from_utf8_lossy(&tracked.stderr));
    let forecast = rotor_edge(&["forecast", &track, "--model", "naive"]);
    assert!(forecast.status.success(), "{}", String::from_utf8_lossy(&forecast.stderr));
}

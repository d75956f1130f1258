//! Tracking and forecasting as a user meets them, on long records whose truth is known.

mod refused;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::program::{json, refusal, rotor_edge};
use rotor_edge::sample;
use rotor_edge_desktop::measurement::{self, Reading};
use serde_json::Value;
use tempfile::TempDir;

const METHODS: [&str; 4] = ["fixed", "adaptive", "bayes", "joint"];

/// A machine's files, some of them written for the occasion.
struct Case {
    folder: TempDir,
    rotor: String,
    record: String,
    runup: String,
    truth: String,
}

impl Case {
    /// The built-in sample.
    fn turbine() -> Self {
        let truth = records().join("turbine/truth.csv");
        Self::of(sample::ROTOR, sample::RECORD, sample::RUNUP_DAY_0, truth)
    }

    /// A record of `tests/records`, of the same turbine on other bearings.
    fn named(name: &str) -> Self {
        let text = |file: &str| std::fs::read_to_string(records().join(file)).unwrap();
        let [record, runup] = ["record.csv", "runup.csv"].map(|file| text(&format!("{name}/{file}")));
        Self::of(&text("rotor.toml"), &record, &runup, records().join(name).join("truth.csv"))
    }

    fn of(rotor: &str, record: &str, runup: &str, truth: PathBuf) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).unwrap();
            folder.path().join(name).display().to_string()
        };
        let rotor = file("machine.toml", rotor);
        let (record, runup) = (file("record.csv", record), file("runup.csv", runup));
        Self { rotor, record, runup, truth: truth.display().to_string(), folder }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn track(&self, method: &str, more: &[&str]) -> Value {
        let mut all =
            vec!["track", &self.rotor, &self.record, "--runup", &self.runup, "--json", "--method", method];
        all.extend(more);
        let output = rotor_edge(&all);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// Rows of the truth by day.
    fn truth(&self) -> BTreeMap<i64, Vec<f64>> {
        let text = std::fs::read_to_string(&self.truth).unwrap();
        let row = |line: &str| {
            let numbers: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            (numbers[0] as i64, numbers[1..].to_vec())
        };
        text.lines().skip(1).map(row).collect()
    }

    /// Root mean square error of each plane's unbalance vector over these days, g·mm.
    fn unbalance_error_g_mm(&self, track: &Value, days: impl Fn(f64) -> bool) -> [f64; 2] {
        let truth = self.truth();
        let (mut squares, mut count) = ([0.0; 2], 0.0);
        for e in track["estimates"].as_array().unwrap() {
            let day = number(&e["time_d"]);
            if !days(day) {
                continue;
            }
            count += 1.0;
            let of_day = &truth[&(day as i64)];
            for j in 0..2 {
                let plane = &e["planes"][j];
                let [x, y] = vector(number(&plane["unbalance_g_mm"]), number(&plane["angle_deg"]));
                let [tx, ty] = vector(of_day[2 * j], of_day[2 * j + 1]);
                squares[j] += (x - tx).powi(2) + (y - ty).powi(2);
            }
        }
        squares.map(|s| (s / f64::max(count, 1.0)).sqrt())
    }

    /// Mean of what the noise alone added to the residual of the days that were tracked, µm.
    fn noise_um(&self, track: &Value) -> f64 {
        let truth = self.truth();
        let all = track["estimates"].as_array().unwrap();
        all.iter().map(|e| truth[&(number(&e["time_d"]) as i64)][4]).sum::<f64>() / all.len() as f64
    }
}

fn records() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/records")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn vector(magnitude: f64, angle_deg: f64) -> [f64; 2] {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    [magnitude * cos, magnitude * sin]
}

/// The sample's first 60 days as dates, with rows of a trip and of a slow roll.
#[test]
fn trips_and_dates_give_the_estimates_of_plain_days() {
    let case = Case::turbine();
    let lines: Vec<&str> = sample::RECORD.lines().filter(|line| !line.starts_with('#')).take(61).collect();
    let rest = |line: &str| line.split_once(',').unwrap().1.to_string();
    let begin: jiff::Timestamp = "2026-03-01T06:00:00Z".parse().unwrap();
    let date = |line: &str| {
        let day: f64 = line.split(',').next().unwrap().parse().unwrap();
        (begin + jiff::SignedDuration::from_secs_f64(day * 86_400.0)).to_string()
    };
    let slow = |line: &str, rpm: &str| {
        let cells = line.split(',').count() - 2;
        format!("{},{rpm}{}", date(line).replace("06:00", "18:00"), ",0.8".repeat(cells))
    };
    let mut dated = vec![format!("time,{}", rest(lines[0]))];
    for (row, line) in lines.iter().enumerate().skip(1) {
        dated.push(format!("{},{}", date(line), rest(line)));
        dated.extend(
            [(20, "0"), (21, "0"), (30, "250")]
                .iter()
                .filter(|(at, _)| *at == row)
                .map(|(_, rpm)| slow(line, rpm)),
        );
    }
    let [plain, trips] =
        [("plain.csv", lines.join("\n")), ("trips.csv", dated.join("\n"))].map(|(name, text)| {
            std::fs::write(case.path(name), text).unwrap();
            json(&rotor_edge(&["track", &case.rotor, &case.path(name), "--runup", &case.runup, "--json"]))
        });
    assert_eq!(trips["begin"], "2026-03-01T06:00:00Z");
    let said = trips["remarks"][0].as_str().unwrap();
    assert!(said.starts_with("3 rows were passed over, 2 at 0 rpm and 1 below"), "{said}");
    let days = |answer: &Value| -> Vec<(f64, f64)> {
        let of = |e: &Value| (number(&e["time_d"]), number(&e["planes"][0]["unbalance_g_mm"]));
        answer["estimates"].as_array().unwrap().iter().map(of).collect()
    };
    for (a, b) in days(&plain).iter().zip(days(&trips)) {
        assert!((a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-6 * a.1, "{a:?} {b:?}");
    }
    assert_eq!(days(&plain).len(), days(&trips).len());
}

#[test]
fn event_at_bearing_15_is_found_on_its_day_to_noise_residual() {
    let case = Case::named("one_bearing");
    let adaptive = case.track("adaptive", &[]);
    assert_eq!(adaptive["reidentified"].as_array().unwrap().len(), 1);
    assert_eq!(adaptive["reidentified"][0]["bearing"], "15");
    assert_eq!(adaptive["reidentified"][0]["case"], 1);
    assert_eq!(adaptive["reidentified"][0]["time_d"], 202.0);
    assert_eq!(adaptive["reidentified"][0]["cases"].as_array().unwrap().len(), 4);
    assert!(number(&adaptive["reduction_against_fixed"]["whole"]) >= 0.5512);
    let joint = case.track("joint", &[]);
    assert_eq!(joint["joint"]["events"][0]["time_d"], 200.0);
    assert_eq!(joint["joint"]["events"][0]["changed"], "bearing 15");
    let ratio = number(&joint["residual_um"]["mean"]) / case.noise_um(&joint);
    assert!(ratio < 1.15, "{ratio}");
}

/// Share of the days on which the interval of each plane's size, and of its angle, holds the truth.
fn held(case: &Case, track: &Value, days: impl Fn(f64) -> bool) -> [f64; 2] {
    let truth = case.truth();
    let (mut sizes, mut angles, mut count) = (0.0, 0.0, 0.0);
    for e in track["estimates"].as_array().unwrap().iter().filter(|e| days(number(&e["time_d"]))) {
        for j in 0..2 {
            let plane = &e["interval_95"]["planes"][j];
            let ends = |key: &str| [0, 1].map(|end| number(&plane[key][end]));
            let of_day = &truth[&(number(&e["time_d"]) as i64)];
            let ([low, high], [from, to]) = (ends("unbalance_g_mm"), ends("angle_deg"));
            sizes += f64::from(u8::from((low..=high).contains(&of_day[2 * j])));
            let off = (of_day[2 * j + 1] - 0.5 * (from + to) + 540.0).rem_euclid(360.0) - 180.0;
            angles += f64::from(u8::from(off.abs() <= 0.5 * (to - from)));
            count += 1.0;
        }
    }
    [sizes / count, angles / count]
}

#[test]
fn added_unbalance_of_run_is_in_estimates_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (rotor, record, _) = sample::load().unwrap();
    let named: Vec<Reading> =
        record[..40].iter().map(|r| Reading { run: Some("found".into()), ..r.clone() }).collect();
    let mut bytes = Vec::new();
    measurement::write(&mut bytes, &rotor, &named).unwrap();
    std::fs::write(path("m.csv"), bytes).unwrap();
    let unbalance = |position_m: f64, magnitude_g_mm: f64| {
        let run = format!(
            "\n[[run]]\nname = \"found\"\nadded_unbalance = [{{ position_m = {position_m}, magnitude_g_mm = \
             {magnitude_g_mm}, angle_deg = 30.0 }}]\n"
        );
        std::fs::write(path("r.toml"), sample::ROTOR.to_owned() + &run).unwrap();
        rotor_edge(&[
            "track",
            &path("r.toml"),
            &path("m.csv"),
            "--method",
            "fixed",
            "--growth",
            "50",
            "--json",
        ])
    };
    let plane_m = rotor.plane[0].position_m;
    let [light, heavy] = [1e-3, 200.0].map(|g_mm| json(&unbalance(plane_m, g_mm)));
    // what the readings show is the machine with the weight, whatever was there before it
    for (a, b) in light["estimates"].as_array().unwrap().iter().zip(heavy["estimates"].as_array().unwrap()) {
        let [a, b] = [a, b].map(|e| number(&e["planes"][0]["unbalance_g_mm"]));
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
    let nowhere = unbalance(plane_m + 0.05, 200.0);
    let told = String::from_utf8_lossy(&nowhere.stderr).to_string();
    assert!(!nowhere.status.success() && told.contains("run \"found\" has a weight at"), "{told}");
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn every_tracking_method_reaches_its_residual_on_sample() {
        let case = Case::turbine();
        println!("method      residual µm   less by   after event   unbalance error before, after, g·mm");
        for (method, least) in METHODS.into_iter().zip([0.0, 0.5512, 0.7448, 0.7448]) {
            let track = case.track(method, &[]);
            let reduction = &track["reduction_against_fixed"];
            let (whole, after) = (number(&reduction["whole"]), number(&reduction["after_event"]));
            let [[a, b], [c, d]] = [false, true]
                .map(|after_event| case.unbalance_error_g_mm(&track, |day| (day >= 125.0) == after_event));
            println!(
                "{method:<12} {:>8.3} {:>10.2} % {:>10.2} %   {a:>6.1} {b:>6.1}   {c:>6.1} {d:>6.1}",
                number(&track["residual_um"]["mean"]),
                100.0 * whole,
                100.0 * after
            );
            assert!(whole >= least && after >= least, "{method}: {whole} {after}");
            assert_eq!(track["event_d"], 125.0, "{method}");
            // method 1 identifies nothing anew, so it claims nothing of the new state
            let open = if method == "fixed" { Value::Null } else { 125.0.into() };
            assert_eq!(track["undiagnosed_since_d"], open, "{method}");
        }
    }

    #[test]
    fn without_an_event_nothing_is_identified_anew_by_any_method() {
        for name in ["quiet", "disturbed"] {
            let case = Case::named(name);
            for method in METHODS {
                let track = case.track(method, &[]);
                assert_eq!(track["reidentified"], serde_json::json!([]), "{name} {method}");
                assert_eq!(track["event_d"], Value::Null, "{name} {method}");
                assert_eq!(track["undiagnosed_since_d"], Value::Null, "{name} {method}");
            }
        }
    }

    #[test]
    fn bayes_chains_converge_and_intervals_cover_unlike_paper() {
        for name in ["quiet", "disturbed", "one_bearing"] {
            let case = Case::named(name);
            let track = case.track("bayes", &[]);
            let days = track["sampling"]["days"].as_array().unwrap();
            assert_eq!(days.len(), track["estimates"].as_array().unwrap().len(), "{name}");
            for day in days {
                let [r_hat, bulk, tail] =
                    ["r_hat", "effective_samples", "effective_samples_tail"].map(|key| number(&day[key]));
                assert!(r_hat <= 1.02 && bulk >= 200.0 && tail >= 100.0, "{name} {day}");
            }
            let [sizes, angles] = held(&case, &track, |_| true);
            println!("{name}: sizes held on {sizes:.3} of the days, angles on {angles:.3}");
            assert!(sizes >= 0.92 && angles >= 0.92, "{name}: {sizes} {angles}");
            let paper = case.track("bayes", &["--paper"]);
            assert!(number(&paper["sampling"]["median"]["r_hat"]) > 1.5, "{name}");
            assert!(paper["sampling"]["adaptive_metropolis"]["r_hat"].is_number(), "{name}");
            assert!(held(&case, &paper, |_| true)[1] < angles, "{name}");
        }
        let odd = refusal(&["track", "r.toml", "m.csv", "--method", "joint", "--paper"]);
        assert!(odd.contains("--paper is for --method bayes"), "{odd}");
    }

    #[test]
    fn track_csv_is_forecast_by_model_naive_and_drift() {
        let case = Case::turbine();
        let (csv, report) = (case.path("track.csv"), case.path("track.html"));
        let begin = ["--begin", "2024-03-01T06:00+01:00"];
        let track = case.track("joint", &[&["--csv", &csv, "--report", &report], &begin[..]].concat());
        assert_eq!(track["begin"], "2024-03-01T05:00:00Z");
        assert!(
            track["joint"]["events"][0]["time"].as_str().unwrap().starts_with("2024-07-0"),
            "{}",
            track["joint"]
        );
        let page = std::fs::read_to_string(&report).unwrap();
        for heading in [
            "days from 2024-03-01 05:00 UTC",
            "Does the model fit?",
            "Calculated and measured features",
            "Unbalance",
            "Bearings",
        ] {
            assert!(page.contains(heading), "{heading}");
        }
        let fans = case.path("forecast.html");
        let output = rotor_edge(&[
            "forecast",
            &csv,
            "--model",
            "arima",
            "--order",
            "1,1,1",
            "--horizons",
            "1,7,30,60",
            "--limit",
            "900",
            "--json",
            "--report",
            &fans,
        ]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let forecast: Value = serde_json::from_slice(&output.stdout).unwrap();
        for series in ["U_g", "alpha_g", "U_d", "alpha_d"] {
            for horizon in ["1", "7", "30", "60"] {
                for by in
                    [&forecast["rmse"], &forecast["baselines"]["naive"], &forecast["baselines"]["drift"]]
                {
                    assert!(number(&by[series][horizon]) > 0.0, "{series} {horizon}");
                }
                assert!((0.5..=1.0).contains(&number(&forecast["coverage_95"][series][horizon])));
            }
        }
        for by in ["arima", "state", "naive", "drift"] {
            let score = &forecast["scores"][by]["U_g"]["30"];
            let [rmse, crps] = ["rmse", "crps"].map(|key| number(&score[key]));
            // of a forecast that errs at random CRPS is 0.56 of the error at best
            assert!(0.3 * rmse < crps && crps < rmse, "{by}: {rmse} {crps}");
            assert!(["p5", "p50", "p95"].iter().all(|p| number(&score["pinball"][p]) > 0.0), "{score}");
            assert!(number(&score["coverage_95"]) > 0.5 && number(&score["compared"]) > 100.0, "{score}");
        }
        assert_eq!(forecast["forecast"].as_array().unwrap().len(), 60);
        assert_eq!(forecast["forecast"][0]["time"], "2025-06-03T05:00:00Z");
        assert_eq!(forecast["limit"]["exceeded"], false);
        assert_eq!(forecast["limit"]["chance_until"].as_array().unwrap().len(), 60);
        assert_eq!(forecast["against_naive"].as_array().unwrap().len(), 4);
        assert!(number(&forecast["limit"]["chance"]) <= 1.0);
        let page = std::fs::read_to_string(&fans).unwrap();
        for part in [
            "Angle of the dynamic unbalance",
            "Root mean square error by days ahead",
            "Continuous ranked probability score (CRPS) by days ahead",
            "Pinball loss at 95 % by days ahead",
            "95 % interval",
            "Chance that the limit is reached",
            "limit, 900 g·mm",
        ] {
            assert!(page.contains(part), "{part}");
        }
        // what the filter knew is the first choice where the track holds it
        let first = rotor_edge(&["forecast", &csv, "--json"]);
        let first: Value = serde_json::from_slice(&first.stdout).unwrap();
        assert_eq!(first["model"], "state");
        assert_eq!(first["scores"]["state"], forecast["scores"]["state"]);
        // one event in the 459 days of the track, 60 ahead
        let events = track["joint"]["events"].as_array().unwrap().len();
        let chance = 1.0 - (459.0_f64 / 519.0).powf(events as f64 + 0.5);
        assert!((number(&forecast["event_chance"]) - chance).abs() < 1e-9, "{forecast}");
        // the days of the limit are those of the track
        let text = rotor_edge(&["forecast", &csv, "--model", "naive", "--limit", "10"]);
        let text = String::from_utf8_lossy(&text.stdout).to_string();
        let exceeded = "The static unbalance exceeds the limit of 10 g·mm already: ";
        assert!(text.starts_with(exceeded) && text.contains("on day 458, 2025-06-02 05:00 UTC."), "{text}");
        assert!(
            text.contains("Continuous ranked probability score") && text.contains("Pinball loss at 5 %"),
            "{text}"
        );
        assert!(text.contains(&format!("{events} in 459 days make one within 60 days")), "{text}");
    }

    #[test]
    fn run_up_after_event_makes_joint_estimate_right() {
        let case = Case::turbine();
        let later = case.path("later.csv");
        std::fs::write(&later, sample::RUNUP_DAY_126).unwrap();
        let track = case.track("joint", &["--later-runup", &later]);
        assert_eq!(track["joint"]["effects"][0], "seal@disk 3");
        assert_eq!(track["reidentified"][0]["bearing"], "16");
        assert_eq!(track["undiagnosed_since_d"], Value::Null);
        let fixed = case.track("fixed", &[]);
        for after_event in [false, true] {
            let error = |t: &Value| case.unbalance_error_g_mm(t, |day| (day >= 125.0) == after_event);
            let (ours, constant) = (error(&track), error(&fixed));
            for (ours, constant) in ours.iter().zip(constant) {
                assert!(*ours < 0.5 * constant, "after the event: {after_event}; {ours} {constant}");
            }
        }
    }

    #[test]
    fn disturbed_readings_are_left_out_and_long_gaps_are_remarked() {
        let track = Case::named("disturbed").track("joint", &[]);
        let left_out: Vec<f64> =
            track["joint"]["left_out_d"].as_array().unwrap().iter().map(number).collect();
        assert!(left_out.contains(&150.0) && left_out.contains(&151.0), "{left_out:?}");
        let remarks = track["remarks"].to_string();
        assert!(remarks.contains("No reading from day 59 to day"), "{remarks}");
    }
}

#[test]
fn condition_that_changes_nothing_is_told_and_not_used() {
    let case = Case::turbine();
    let mut record = String::new();
    for (k, line) in sample::RECORD.lines().take(110).enumerate() {
        // one in five is lost
        let value = match k {
            0 => "oil_temperature_degc".into(),
            _ if k.is_multiple_of(5) => String::new(),
            _ => format!("{:.1}", 45.0 + 5.0 * (k as f64 * 1.3).sin()),
        };
        record += &format!("{line},{value}\n");
    }
    let path = case.path("with_oil.csv");
    std::fs::write(&path, record).unwrap();
    let track = |method: &str| {
        json(&rotor_edge(&[
            "track",
            &case.rotor,
            &path,
            "--runup",
            &case.runup,
            "--json",
            "--method",
            method,
        ]))
    };
    let joint = track("joint");
    let [condition] = &joint["joint"]["conditions"].as_array().unwrap()[..] else { panic!("{joint}") };
    assert_eq!((&condition["name"], &condition["unit"]), (&"oil temperature".into(), &"°C".into()));
    assert!(condition["used"] == false && condition["log_evidence"].as_f64().unwrap() < 0.0, "{condition}");
    let remarks = track("adaptive")["remarks"].to_string();
    assert!(remarks.contains("(oil_temperature_degc); --method joint does"), "{remarks}");
}

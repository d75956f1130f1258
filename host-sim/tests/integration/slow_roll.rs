//! `--slow-roll` as a user meets it: what the probes read of a shaft that only turns is taken off.

use crate::program::{assert_says, json, refusal, rotor_edge};
use nalgebra::Complex;
use rotor_edge::sample;
use rotor_edge_desktop::measurement::{self, Reading};
use tempfile::TempDir;

/// The sample's run-up, as probes with runout show it, and a slow roll of the same probes.
struct Scratched {
    folder: TempDir,
    runup: Vec<Reading>,
    slow: Vec<Reading>,
}

impl Scratched {
    fn new() -> Self {
        let (_, _, runup) = sample::load().unwrap();
        let runout_m = |probe: usize| Complex::from_polar(20e-6, probe as f64);
        let add = |r: &Reading| {
            let probes = r.probes.iter().enumerate().map(|(p, y)| y.map(|y| y + runout_m(p)));
            Reading { run: Some("up".into()), probes: probes.collect(), ..r.clone() }
        };
        let turning = |speed_rpm: f64| Reading {
            run: Some("turning gear".into()),
            time_d: runup[0].time_d,
            speed_rpm,
            probes: (0..runup[0].probes.len()).map(|p| Some(runout_m(p))).collect(),
            ..Reading::default()
        };
        let scratched = Self {
            slow: vec![turning(60.0), turning(70.0)],
            runup: runup.iter().map(add).collect(),
            folder: tempfile::tempdir().unwrap(),
        };
        std::fs::write(scratched.path("rotor.toml"), sample::ROTOR).unwrap();
        scratched.write("clean.csv", &runup);
        scratched
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, readings: &[Reading]) -> String {
        let (rotor, ..) = sample::load().unwrap();
        let mut text = Vec::new();
        measurement::write(&mut text, &rotor, readings).unwrap();
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    fn chi2(&self, data: &str, more: &[&str]) -> f64 {
        let rotor = self.path("rotor.toml");
        let arguments = [&["compare", &rotor, data, "--json"], more].concat();
        json(&rotor_edge(&arguments))["chi2_per_value"].as_f64().unwrap()
    }
}

#[test]
fn slow_roll_from_run_or_file_removes_runout() {
    let scratched = Scratched::new();
    let together = scratched.write("together.csv", &[&scratched.slow[..], &scratched.runup].concat());
    let alone = scratched.write("alone.csv", &scratched.runup);
    let slow = scratched.write("slow.csv", &scratched.slow);
    let clean = scratched.chi2(&scratched.path("clean.csv"), &[]);
    let run = scratched.chi2(&together, &["--slow-roll", "turning gear"]);
    let file = scratched.chi2(&alone, &["--slow-roll", &slow]);
    assert!((run / clean - 1.0).abs() < 1e-3 && (file / clean - 1.0).abs() < 1e-3, "{run} {file} {clean}");
    assert!(scratched.chi2(&alone, &[]) > 2.0 * clean);
}

#[test]
fn error_after_slow_roll_rows_has_row_of_file() {
    let scratched = Scratched::new();
    let rotor = scratched.path("rotor.toml");
    let mut record = scratched.runup[..12].to_vec();
    record.iter_mut().enumerate().for_each(|(day, r)| r.time_d = Some(day as f64));
    record[7].time_d = Some(6.0);
    let slow = scratched.slow.iter().map(|r| Reading { time_d: Some(0.0), ..r.clone() });
    let file = scratched.write("record.csv", &slow.chain(record).collect::<Vec<_>>());
    // after the header, two rows of slow roll and seven others
    let error = refusal(&["track", &rotor, &file, "--slow-roll", "turning gear"]);
    assert_says(&error, &["row 11", "day 6 is there twice"]);
}

#[test]
fn missing_or_too_fast_slow_roll_is_refused() {
    let scratched = Scratched::new();
    let rotor = scratched.path("rotor.toml");
    let alone = scratched.write("alone.csv", &scratched.runup);
    let says = refusal(&["compare", &rotor, &alone, "--slow-roll", "turning gear"]);
    assert_says(&says, &["alone.csv", "\"turning gear\" is neither a run of this file nor a file"]);
    let says = refusal(&["diagnose", &rotor, &alone, "--slow-roll", &alone]);
    assert_says(&says, &["alone.csv: slow roll", "no more than half the fastest speed"]);
}

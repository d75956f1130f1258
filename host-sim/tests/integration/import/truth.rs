//! Readings that are known, and files as systems write them.

use std::fmt::Write;
use std::path::PathBuf;

use nalgebra::Complex;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::measurement::phasor_m;
use tempfile::TempDir;

/// One known reading of two probes.
#[derive(Debug, Clone)]
pub struct True {
    /// Hours since 2024-03-05 10:00:00.
    pub hours: f64,
    pub speed_rpm: f64,
    /// Phasors `cos − i sin` of the probes, µm zero-to-peak.
    pub probes: [Complex<f64>; 2],
}

impl True {
    /// Amplitude, µm zero-to-peak, and phase lag, degrees from 0 to 360.
    pub fn polar(&self, probe: usize) -> (f64, f64) {
        let (amplitude, angle) = self.probes[probe].to_polar();
        (amplitude, (-angle.to_degrees()).rem_euclid(360.0))
    }

    /// `u(t) = cos · cos Ωt + sin · sin Ωt`, µm.
    pub fn components(&self, probe: usize) -> [f64; 2] {
        [self.probes[probe].re, -self.probes[probe].im]
    }

    /// Day of the month and hour in March 2024.
    pub fn day_and_hour(&self) -> (u32, u32) {
        let hours = self.hours as u32 + 10;
        (5 + hours / 24, hours % 24)
    }
}

/// Twelve readings that differ in everything; the hours are whole.
pub fn truth() -> Vec<True> {
    let reading = |k: usize| {
        let t = k as f64;
        let probe = |p: f64| {
            Complex::from_polar(18.0 + 7.0 * p + 3.0 * (0.7 * t + p).sin(), -(0.3 + 0.9 * p + 0.11 * t))
        };
        True { hours: 7.0 * t, speed_rpm: 10_900.25 + 12.5 * t, probes: [probe(0.0), probe(1.0)] }
    };
    (0..12).map(reading).collect()
}

/// Lines, one a reading.
pub fn lines(head: &str, line: impl Fn(&True) -> String) -> String {
    let mut text = head.to_string();
    for reading in truth() {
        writeln!(text, "{}", line(&reading)).unwrap();
    }
    text
}

/// Text with the decimal comma.
pub fn comma(x: f64) -> String {
    x.to_string().replace('.', ",")
}

/// A folder with files.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(name), contents).unwrap();
        self.text(name)
    }

    /// What is in it.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

/// Readings and probes of `measured.csv`, read without this project's reader.
pub fn measured(path: &std::path::Path) -> (Vec<String>, Vec<Reading>) {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().skip_while(|line| line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| header.iter().position(|h| *h == name);
    let probes: Vec<String> =
        header.iter().filter_map(|h| h.strip_suffix("_cos_um")).map(str::to_string).collect();
    let reading = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |name: &str| at(name).and_then(|i| cells[i].parse::<f64>().ok());
        let phasor =
            |p: &String| Some(phasor_m(number(&format!("{p}_cos_um"))?, number(&format!("{p}_sin_um"))?));
        Reading {
            row: None,
            run: at("run").map(|i| cells[i].to_string()),
            session: None,
            time_d: number("time_d"),
            speed_rpm: number("speed_rpm").unwrap(),
            probes: probes.iter().map(phasor).collect(),
            gaps_v: probes.iter().map(|p| number(&format!("{p}_gap_v"))).collect(),
            conditions: Vec::new(),
        }
    };
    // of a row without speed the time alone is known
    let has_speed = |line: &&str| {
        at("speed_rpm").and_then(|i| line.split(',').nth(i)).is_some_and(|cell| !cell.is_empty())
    };
    let readings = lines.filter(has_speed).map(reading).collect();
    (probes, readings)
}

/// The readings are those that are known, to a relative error of `within`.
#[track_caller]
pub fn assert_true(readings: &[Reading], truth: &[True], within: f64) {
    assert_eq!(readings.len(), truth.len());
    for (reading, known) in readings.iter().zip(truth) {
        assert!((reading.speed_rpm / known.speed_rpm - 1.0).abs() <= within, "{reading:?} {known:?}");
        for (y, known) in reading.probes.iter().zip(known.probes) {
            let y = y.expect("not lost") * 1e6;
            assert!((y - known).norm() <= within * known.norm(), "{y} {known}");
        }
        if let Some(days) = reading.time_d {
            // text has seconds
            assert!((days - known.hours / 24.0).abs() < 1e-8, "{days} {}", known.hours / 24.0);
        }
    }
}

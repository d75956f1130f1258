//! Machines whose readings are kept, and the jobs over them.

use std::path::PathBuf;

use rotor_edge::sample;
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor_file;
use rotor_edge_plant::item::{Body, Item, ReadingItem, SCHEMA, Source};
use rotor_edge_plant::sink::Sink as _;
use rotor_edge_plant::store::Store;
use serde_json::Value;

use super::run;

const DAY_US: i64 = 86_400_000_000;
/// When the first reading was, µs since 1970.
const BEGIN_US: i64 = 1_767_225_600_000_000;

pub struct Plant {
    pub folder: tempfile::TempDir,
    store: PathBuf,
}

impl Plant {
    /// Machines that told the same data, given as CSV, and whose drawing is the sample's.
    pub fn of(nodes: std::ops::Range<u8>, data: &str, time_us: impl Fn(usize, Option<f64>) -> i64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("rotor.toml"), sample::ROTOR).unwrap();
        std::fs::write(at("data.csv"), data).unwrap();
        let rotor = rotor_file::read(&at("rotor.toml")).unwrap();
        let readings = measurement::read(&at("data.csv"), &rotor).unwrap();
        let store = at("plant.db");
        let mut kept = Store::open(&store).unwrap();
        for node in nodes.clone() {
            let item = |(row, reading): (usize, &measurement::Reading)| {
                let um = |phasor: &nalgebra::Complex<f64>| {
                    [Some((phasor.re * 1e6) as f32), Some((-phasor.im * 1e6) as f32)]
                };
                let body = Body::Reading(ReadingItem {
                    speed_rpm: Some(reading.speed_rpm as f32),
                    keyphasor: "locked".into(),
                    probes_um: reading.probes.iter().map(|p| p.as_ref().map_or([None; 2], um)).collect(),
                    gaps_v: vec![],
                });
                Item {
                    schema: SCHEMA,
                    source: Source { plant: "north".into(), bus: "hall1".into(), node },
                    epoch: 0,
                    sequence: row as u16,
                    time_us: BEGIN_US + time_us(row, reading.time_d),
                    is_clock_doubtful: false,
                    body,
                }
            };
            let items: Vec<Item> = readings.iter().enumerate().map(item).collect();
            kept.put(&items).unwrap();
        }
        let plant = Self { folder, store };
        for node in nodes {
            let rotor = plant.at("rotor.toml");
            plant.says(
                &["machine", plant.path(), &format!("north/hall1/{node}"), &rotor],
                "watches the machine",
            );
        }
        plant
    }

    /// A machine with one reading a day.
    pub fn of_days(nodes: std::ops::Range<u8>, days: usize) -> Self {
        Self::of(nodes, &days_of(days), |_, time_d| (time_d.unwrap() * DAY_US as f64).round() as i64)
    }

    pub fn at(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    pub fn path(&self) -> &str {
        self.store.to_str().unwrap()
    }

    #[track_caller]
    pub fn says(&self, words: &[&str], expected: &str) {
        let output = run(words);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success() && said.contains(expected),
            "{said}{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }

    pub fn jobs(&self) -> Vec<Value> {
        let output = run(&["fleet", "status", self.path(), "--json"]);
        let mut status: Value = serde_json::from_slice(&output.stdout).unwrap();
        status["jobs"].as_array_mut().map(std::mem::take).unwrap()
    }

    pub fn has_state(&self, state: &str) -> bool {
        self.jobs().iter().any(|job| job["state"] == state)
    }
}

pub fn days_of(days: usize) -> String {
    let lines: Vec<&str> = sample::RECORD.lines().take(1 + days).collect();
    lines.join("\n") + "\n"
}

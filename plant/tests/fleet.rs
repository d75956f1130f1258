//! Commands of the desk over many machines: what workers answer is what the desk answers, once, whoever is killed.

mod common;

use std::path::{Path, PathBuf};

use common::{Program, refusal, run, until};
use rotor_edge::command::{Listener, object};
use rotor_edge::sample;
use rotor_edge_desktop::machine::rotor_file;
use rotor_edge_desktop::measurement;
use rotor_edge_plant::item::{Body, Item, Reading, SCHEMA, Source};
use rotor_edge_plant::keeper::Keeper as _;
use rotor_edge_plant::store::Store;
use serde_json::Value;

const DAY_US: i64 = 86_400_000_000;
/// When the first reading was, µs since 1970.
const BEGIN_US: i64 = 1_767_225_600_000_000;

struct Plant {
    folder: tempfile::TempDir,
    store: PathBuf,
}

impl Plant {
    /// Machines that told the same data, given as CSV, and whose drawing is the sample's.
    fn of(nodes: std::ops::Range<u8>, data: &str, time_us: impl Fn(usize, Option<f64>) -> i64) -> Self {
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
                let body = Body::Reading(Reading {
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
    fn of_days(nodes: std::ops::Range<u8>, days: usize) -> Self {
        Self::of(nodes, &days_of(days), |_, time_d| (time_d.unwrap() * DAY_US as f64).round() as i64)
    }

    fn at(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn path(&self) -> &str {
        self.store.to_str().unwrap()
    }

    #[track_caller]
    fn says(&self, words: &[&str], expected: &str) {
        let output = run(words);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success() && said.contains(expected),
            "{said}{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }

    fn jobs(&self) -> Vec<Value> {
        let output = run(&["fleet", "status", self.path(), "--json"]);
        let mut status: Value = serde_json::from_slice(&output.stdout).unwrap();
        status["jobs"].as_array_mut().map(std::mem::take).unwrap()
    }

    fn has_state(&self, state: &str) -> bool {
        self.jobs().iter().any(|job| job["state"] == state)
    }
}

fn days_of(days: usize) -> String {
    let lines: Vec<&str> = sample::RECORD.lines().take(1 + days).collect();
    lines.join("\n") + "\n"
}

/// What the desk says of files.
fn desk(command: &str, rotor: &Path, data: &Path) -> Value {
    let words = [command.into(), rotor.into(), data.into(), "--json".into()];
    serde_json::from_str(&object(words, Listener::Program(&|_, _| {})).unwrap()).unwrap()
}

#[test]
fn two_workers_answer_what_the_desk_answers_and_the_same_job_twice_is_one() {
    let plant = Plant::of_days(1..4, 40);
    plant.says(&["fleet", "track", plant.path()], "3 new jobs.");
    plant.says(&["fleet", "track", plant.path(), "north/hall1/2"], "0 new jobs, 1 were asked for before.");
    let workers = [(); 2].map(|()| Program::start(&["worker", plant.path(), "--once"]));
    until("three answers", || plant.jobs().iter().filter(|job| job["state"] == "done").count() == 3);
    for mut worker in workers {
        assert!(worker.child.wait().unwrap().success());
    }
    let folder = plant.folder.path();
    let expected = desk("track", &folder.join("rotor.toml"), &folder.join("data.csv"));
    for job in plant.jobs() {
        assert_eq!((&job["tries"], &job["node"].as_u64().is_some()), (&1.into(), &true), "{job}");
        assert_eq!(job["answer"]["estimates"], expected["estimates"], "to the bit");
    }
    let said = String::from_utf8(run(&["fleet", "status", plant.path()]).stdout).unwrap();
    assert!(
        said.contains("3 done") && said.contains("north/hall1/2") && said.contains("40 days, 0 flags"),
        "{said}"
    );
}

#[test]
fn the_job_of_a_killed_worker_is_done_by_another_within_its_lease() {
    // a minute of readings, a second apart: all of them are used
    let plant = Plant::of(1..3, sample::RUNUP_DAY_126, |row, _| row as i64 * 1_000_000);
    plant.says(&["fleet", "improve", plant.path(), "north"], "2 new jobs.");
    let first = Program::start(&["worker", plant.path()]);
    until("a job that runs", || plant.has_state("running"));
    first.kill();
    let was_running = plant.has_state("running");
    plant.says(&["worker", plant.path(), "--once"], "jobs ended.");
    let jobs = plant.jobs();
    let tries: u64 = jobs.iter().map(|job| job["tries"].as_u64().unwrap()).sum();
    assert_eq!(tries, 2 + u64::from(was_running));
    let folder = plant.folder.path();
    let better = folder.join("better.toml");
    let data = folder.join("data.csv");
    let words = [
        "improve".into(),
        folder.join("rotor.toml").into(),
        data.into(),
        "-o".into(),
        better.clone().into(),
        "--json".into(),
    ];
    let expected: Value =
        serde_json::from_str(&object(words, Listener::Program(&|_, _| {})).unwrap()).unwrap();
    for job in &jobs {
        assert_eq!(job["state"], "done", "{job}");
        assert_eq!(job["answer"]["steps"][0]["effect"], "seal");
        assert_eq!(job["answer"]["verdict"], expected["verdict"]);
        assert!(job["model"].as_str().unwrap().contains("kind = \"seal\""), "the better drawing");
    }
}

#[test]
fn what_cannot_be_asked_or_done_is_one_sentence() {
    let plant = Plant::of_days(1..2, 3);
    let path = plant.path();
    let rotor = plant.at("rotor.toml");
    let said = refusal(&["machine", path, "north/hall1/9", &rotor]);
    assert!(said.contains("no monitor north/hall1/9 was heard, expected one of north/hall1/1"), "{said}");
    assert!(refusal(&["machine", path, "north/hall1/1", &plant.at("data.csv")]).contains("data.csv"));
    assert!(refusal(&["fleet", "track", path, "south"]).contains("no machine is chosen"));
    assert!(refusal(&["fleet", "cancel", path, "abc"]).contains("no job abc waits or runs"));
    assert!(refusal(&["worker", &plant.at("none.db")]).contains("is not there"));
    plant.says(&["fleet", "diagnose", path, "--to", "2020-01-01T00:00Z"], "1 new jobs.");
    plant.says(&["worker", path, "--once"], "1 jobs ended.");
    let jobs = plant.jobs();
    assert_eq!(
        (&jobs[0]["state"], &jobs[0]["answer"]),
        (&"failed".into(), &"no reading in this time".into())
    );
}

//! A store and messages of earlier programs stay readable: `tests/compatibility/plant` has one of each.

use std::path::{Path, PathBuf};

use rotor_edge_plant::item::{Item, Kind};
use rotor_edge_plant::store::Store;
use serde_json::Value;

use crate::common::run;

fn kept(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/compatibility/plant").join(name)
}

/// What the program prints of a copy of the store.
#[track_caller]
fn said(arguments: impl Fn(&str) -> Vec<String>) -> String {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("store.db");
    std::fs::copy(kept("store.db"), &copy).unwrap();
    let arguments = arguments(copy.to_str().unwrap());
    let output = run(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn store_of_version_4_keeps_every_row() {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("store.db");
    std::fs::copy(kept("store.db"), &copy).unwrap();
    let store = Store::open(&copy).unwrap();
    let rows = Kind::ALL.map(|kind| store.count(kind).unwrap());
    assert_eq!(rows, [15, 15, 5, 4], "readings, results, states, heartbeats");
}

#[test]
fn store_of_version_4_shows_monitor_job_and_answer() {
    let status = said(|store| vec!["status".into(), store.into()]);
    assert!(["north", "hall3", "flagged"].iter().all(|word| status.contains(word)), "{status}");
    let jobs = said(|store| vec!["fleet".into(), "status".into(), store.into()]);
    let words = ["dd7753c571", "track", "north/hall3/1", "done", "20 days, 0 flags"];
    assert!(words.iter().all(|word| jobs.contains(word)), "{jobs}");
}

#[test]
fn store_of_version_4_is_exported_day_by_day() {
    let folder = tempfile::tempdir().unwrap();
    let days = folder.path().join("days").display().to_string();
    let text = said(|store| vec!["export".into(), store.into(), days.clone()]);
    assert_eq!(text, "32 files written with 39 rows, 0 left as they were.\n");
}

#[test]
fn message_of_schema_1_keeps_every_field() {
    let text = std::fs::read_to_string(kept("items.jsonl")).unwrap();
    let mut kinds = Vec::new();
    for line in text.lines() {
        let item: Item = serde_json::from_str(line).unwrap();
        kinds.push(item.body.kind());
        let then: Value = serde_json::from_str(line).unwrap();
        let now = serde_json::to_value(&item).unwrap();
        assert!(contains(&now, &then), "{now}, expected {then}");
    }
    assert_eq!(kinds, Kind::ALL);
}

/// Whether a value has every field of an earlier one; numbers are of single precision.
fn contains(now: &Value, then: &Value) -> bool {
    match (now, then) {
        (Value::Object(now), Value::Object(then)) => {
            then.iter().all(|(key, then)| now.get(key).is_some_and(|now| contains(now, then)))
        }
        (Value::Array(now), Value::Array(then)) => {
            now.len() == then.len() && now.iter().zip(then).all(|(now, then)| contains(now, then))
        }
        (Value::Number(now), Value::Number(then)) => {
            now.as_f64().map(|now| now as f32) == then.as_f64().map(|then| then as f32)
        }
        _ => now == then,
    }
}

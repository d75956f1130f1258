//! Files with a mistake that is often made: it is named, no effect is claimed, and `improve` writes nothing.

use super::{Case, json};
use crate::program::{assert_says, rotor_edge};

const ROTOR: &str = include_str!("../../../../tests/machines/ordinary/fan-001-none/rotor.toml");
const DATA: &str = include_str!("../../../../tests/machines/ordinary/fan-001-none/measured.csv");

/// The first screen of `diagnose`, after it was checked that no effect is claimed and `improve` writes nothing.
fn diagnosed(rotor: &str, data: &str) -> String {
    let case = Case::new(rotor, data);
    let answer = json(&["diagnose", &case.rotor, &case.data]);
    assert_eq!(answer["verdict"], "undecided", "{}", answer["summary"]);
    assert!(answer["mistake"]["words"].is_string(), "{}", answer["summary"]);
    let probable = |c: &serde_json::Value| c["probability"].as_f64().unwrap();
    assert!(answer["candidates"].as_array().unwrap().iter().all(|c| probable(c) < 0.5));
    let improved = rotor_edge(&["improve", &case.rotor, &case.data, "-o", &case.new]);
    assert_says(
        &String::from_utf8(improved.stdout).unwrap(),
        &["Nothing is written: correct the mistake first"],
    );
    assert!(!case.new_exists());
    answer["summary"].as_str().unwrap().to_string()
}

#[test]
fn exchanged_columns_of_bearings_are_named() {
    let header = DATA.lines().next().unwrap();
    let exchanged = header.replace('A', "#").replace('B', "A").replace('#', "B");
    let said = diagnosed(ROTOR, &DATA.replace(header, &exchanged));
    assert_says(&said, &["columns of bearings A and B look exchanged"]);
}

#[test]
fn angles_in_radians_are_named() {
    let said = diagnosed(&ROTOR.replace("angle_deg = 90", "angle_deg = 1.5708"), DATA);
    assert_says(&said, &["angles of probes AY, BY look like radians", "1.5708 rad is 90°"]);
}

#[test]
fn amplitudes_in_millimetres_are_named_by_their_size() {
    let thousandth = |cell: &str| cell.parse::<f64>().map_or(cell.to_string(), |v| (v / 1e3).to_string());
    let row = |line: &str| {
        let mut cells = line.split(',');
        let speed = cells.next().unwrap_or_default().to_string();
        std::iter::once(speed).chain(cells.map(thousandth)).collect::<Vec<_>>().join(",")
    };
    let data: Vec<String> = DATA.lines().map(row).collect();
    let said = diagnosed(ROTOR, &(data.join("\n") + "\n"));
    assert_says(&said, &["amplitudes look like mm in place of µm 0-pk", "balance quality of G 0.00"]);
}

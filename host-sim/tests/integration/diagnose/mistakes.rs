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
    let said = diagnosed(ROTOR, &divided_by(1e3));
    assert_says(&said, &["amplitudes look like mm in place of µm 0-pk", "balance quality of G 0.00"]);
}

#[test]
fn amplitudes_in_mils_are_remarked_where_noise_is_stated() {
    let case = Case::new(ROTOR, &divided_by(25.4));
    let answer = json(&["diagnose", &case.rotor, &case.data]);
    let remarks = answer["remarks"].as_array().unwrap();
    let words = "the amplitudes are in a larger unit than µm 0-pk (mils, mm or m)";
    assert!(remarks.iter().any(|remark| remark.as_str().unwrap().contains(words)), "{remarks:?}");
}

/// The measurement with every amplitude divided by a number.
fn divided_by(unit_um: f64) -> String {
    let divided = |cell: &str| cell.parse::<f64>().map_or(cell.to_string(), |v| (v / unit_um).to_string());
    let row = |line: &str| {
        let (speed, amplitudes) = line.split_once(',').unwrap();
        std::iter::once(speed.to_string())
            .chain(amplitudes.split(',').map(divided))
            .collect::<Vec<_>>()
            .join(",")
    };
    DATA.lines().map(row).collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
fn shaft_of_radii_is_warned_of_by_its_sag() {
    let checked = |rotor: &str| {
        let case = Case::new(rotor, DATA);
        String::from_utf8(rotor_edge(&["check", &case.rotor]).stdout).unwrap()
    };
    let radii = ROTOR.replace("outer_diameter_m = 0.05", "outer_diameter_m = 0.025");
    assert_ne!(radii, ROTOR);
    assert_says(&checked(&radii), &["The shaft sags by", "Are the outer_diameter_m radii?"]);
    assert!(!checked(ROTOR).contains("sags by"));
}

//! A `rotor.toml` of each schema is read, and each of its numbers means what it meant.

use serde_json::Value;

use super::argument;
use crate::program::{json, rotor_edge};

/// Far above the effect of another numerical method, far below that of another unit, sign or default.
const RELATIVE: f64 = 1e-3;

/// What `check` told of a file when it was made.
struct Machine {
    file: &'static str,
    mass_kg: f64,
    loads_n: &'static [f64],
    /// The lowest modes: frequency and log decrement.
    modes_rpm: &'static [[f64; 2]],
}

fn numbers(list: &Value, key: &str) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|entry| entry[key].as_f64().unwrap()).collect()
}

#[track_caller]
fn assert_near(what: &str, now: &[f64], then: &[f64]) {
    assert!(now.len() >= then.len(), "{what}: {now:?}, expected {then:?}");
    for (now, then) in now.iter().zip(then) {
        assert!((now - then).abs() <= RELATIVE * then.abs(), "{what}: {now}, expected {then}");
    }
}

#[track_caller]
fn assert_read_as_then(machine: &Machine) {
    let answer = json(&rotor_edge(&["check", &argument(machine.file), "--json"]));
    assert_near("mass, kg", &[answer["mass_kg"].as_f64().unwrap()], &[machine.mass_kg]);
    assert_near("loads, N", &numbers(&answer["bearings"], "load_n"), machine.loads_n);
    let modes = ["frequency_rpm", "log_decrement"].map(|key| numbers(&answer["modes"], key));
    for (index, modes) in modes.iter().enumerate() {
        let then: Vec<f64> = machine.modes_rpm.iter().map(|mode| mode[index]).collect();
        assert_near("modes", modes, &then);
    }
}

#[test]
fn rotor_file_of_schema_1_means_what_it_meant() {
    assert_read_as_then(&Machine {
        file: "rotor/schema-1.toml",
        mass_kg: 90.604595,
        loads_n: &[401.563197, 486.964358],
        modes_rpm: &[[4199.851440, 18.432912], [6792.663908, 24.779485], [13016.146860, 10.578801]],
    });
}

#[test]
fn rotor_file_of_schema_2_means_what_it_meant() {
    assert_read_as_then(&Machine {
        file: "rotor/schema-2.toml",
        mass_kg: 84.722774,
        loads_n: &[450.0, 383.720893],
        modes_rpm: &[[509.556424, 12.232662], [13238.841690, 1.520025], [13516.152282, 0.599526]],
    });
}

#[test]
fn every_bearing_law_coupling_and_foundation_is_read() {
    assert_read_as_then(&Machine {
        file: "rotor/bearing-laws.toml",
        mass_kg: 161.976760,
        loads_n: &[310.481273, 417.972738, 203.575771, 6.661284, 180.148574, 305.232382, 164.377376],
        modes_rpm: &[[315.767647, 140.008656], [460.846764, 86.182392], [801.776375, 28.156941]],
    });
}

//! Other files that the program wrote and reads again.

use super::argument;
use crate::program::{json, rotor_edge};

#[test]
fn kept_influence_coefficients_give_the_same_weights() {
    let [runs, coefficients] = ["../golden/inputs/later-run.csv", "tables/coefficients.toml"].map(argument);
    let answer =
        json(&rotor_edge(&["balance", "--trial-only", &runs, "--coefficients", &coefficients, "--json"]));
    for (weight, then) in answer["weights"].as_array().unwrap().iter().zip([[30.0, 220.0], [20.0, 80.0]]) {
        for (key, then) in ["magnitude_g_mm", "angle_deg"].into_iter().zip(then) {
            let now = weight[key].as_f64().unwrap();
            assert!((now / then - 1.0).abs() < 1e-3, "{key}: {now}, expected {then}");
        }
    }
}

#[test]
fn kept_column_mapping_gives_the_columns_it_gave() {
    let [export, mapping] = ["../golden/inputs/export.csv", "tables/mapping.toml"].map(argument);
    let folder = tempfile::tempdir().unwrap();
    let measured = folder.path().join("measured.csv");
    let output = measured.display().to_string();
    assert!(rotor_edge(&["import", &export, "--mapping", &mapping, "-o", &output]).status.success());
    let text = std::fs::read_to_string(measured).unwrap();
    let head = text.lines().find(|line| !line.starts_with('#')).unwrap();
    let columns: Vec<&str> = head.split(',').collect();
    assert_eq!(columns, ["time_d", "speed_rpm", "16X_cos_um", "16X_sin_um", "16Y_cos_um", "16Y_sin_um"]);
}

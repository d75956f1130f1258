//! Exports that are longer than what one thread reads at once.

use std::fmt::Write;

use super::truth::{Folder, measured};
use super::{refused, run};
use crate::program::assert_says;

/// Readings of each probe; the text is a few times as long as a block.
const READINGS: usize = 60_000;

/// A row a probe and time, with quoted names, standstill and a header again between them; `FIRST` is the first row of data.
fn export() -> String {
    let head = "\"Point\",\"Time [s]\",\"Run\",\"Speed [rpm]\",\"1X Amp [um pp]\",\"1X Phase [deg lag]\",\"Gap [V]\"\n";
    let mut text = head.to_string();
    for n in 0..READINGS {
        let run = if n < READINGS / 2 { "first" } else { "second" };
        for probe in ["DE X", "DE Y"].into_iter().take(if n < READINGS - 10 { 1 } else { 2 }) {
            let amplitude = 20.0 + 0.001 * (n % 1000) as f64;
            let lag = (n % 360) as f64;
            writeln!(
                text,
                "{probe},{n}.5,{run},3000.25,{amplitude:.3},{lag},-{}",
                9.0 + (n % 7) as f64 / 8.0
            )
            .unwrap();
        }
        if n % 20_000 == 19_999 {
            text.push_str(&head.replace('"', ""));
            writeln!(text, "DE X,{n}.75,{run},0,0.1,0,-9").unwrap();
        }
    }
    text + ",,,,,,\nEnd of the export,,,,,,\n"
}

#[test]
fn long_export_of_points_and_runs_is_imported_in_order() {
    let folder = Folder::new();
    let file = folder.write("long.csv", export());
    let answer = run(&[&file], &folder.text("m.csv"), &["--keep-outliers"]);
    assert_eq!(answer["rows"], READINGS);
    assert_eq!(answer["skipped"]["standstill"], 3);
    assert_eq!(answer["skipped"]["no_data"], 4, "three headers and the last line");
    let first = answer["skipped"]["first"].to_string();
    assert!(
        first.contains("row 20003: standstill") && first.contains("row 20002: a header again"),
        "{first}"
    );
    let (probes, readings) = measured(&folder.path("m.csv"));
    assert_eq!(probes, ["DE X", "DE Y"]);
    for (n, reading) in readings.iter().enumerate() {
        let expected = nalgebra::Complex::from_polar(
            0.5e-6 * (20.0 + 0.001 * (n % 1000) as f64),
            -((n % 360) as f64).to_radians(),
        );
        let of_x = reading.probes[0].unwrap();
        assert!((of_x - expected).norm() < 1e-15, "reading {n}: {of_x}");
        assert_eq!(reading.probes[1].is_some(), n >= READINGS - 10, "reading {n}");
        assert_eq!(reading.gaps_v[0], Some(-9.0 - (n % 7) as f64 / 8.0), "reading {n}");
        assert_eq!(reading.run.as_deref(), Some(if n < READINGS / 2 { "first" } else { "second" }));
        assert!((reading.time_d.unwrap() - (n as f64 + 0.5) / 86_400.0).abs() < 1e-12);
    }
}

#[test]
fn first_fault_of_a_long_export_is_named() {
    let folder = Folder::new();
    let text = export();
    let rows: Vec<&str> = text.lines().collect();
    let mut bad = rows.clone();
    bad[30_000] = "DE X,29997.5,first,3000.25,twenty,0,-9";
    bad[50_000] = "DE X,49994.5,second,fast,20,0,-9";
    let file = folder.write("bad.csv", bad.join("\n"));
    assert_says(
        &refused(&folder, &file, &[]),
        &["bad.csv: row 30001, column 5", "\"twenty\" is not a number"],
    );
}

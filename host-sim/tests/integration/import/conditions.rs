//! Columns of temperatures, pressures and loads in exports.

use super::truth::{Folder, True, lines, measured};
use super::{refused, run};
use crate::program::assert_says;

const HEAD: &str = "Time [h],Speed [rpm],16X 1X Amp [um pp],16X 1X Phase [deg lag],Lube Oil Temp [°F],Load,Oil pressure (psig)\n";

/// An export whose load is 55, or another cell in the row of an hour.
fn export(load: impl Fn(&True) -> String) -> String {
    lines(HEAD, |t| {
        let (a, p) = t.polar(0);
        format!("{},{},{},{p},{},{},29.00754", t.hours, t.speed_rpm, 2.0 * a, 113.0 + 1.8 * t.hours, load(t))
    })
}

fn written(folder: &Folder) -> (String, Vec<Vec<String>>) {
    let text = std::fs::read_to_string(folder.path("m.csv")).unwrap();
    let rows: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let cells = |row: &&str| row.split(',').map(String::from).collect();
    (rows[0].into(), rows[1..].iter().map(cells).collect())
}

#[test]
fn conditions_pass_through_import_in_plain_units() {
    let folder = Folder::new();
    let file = folder.write("a.csv", export(|_| "55".into()));
    let answer = run(&[&file], &folder.text("m.csv"), &[]);
    let left = &answer["left"][0];
    assert_eq!(left["from"], "Load", "{answer}");
    assert_says(
        left["why"].as_str().unwrap(),
        &["a condition without a unit", "\"Load=load:condition:UNIT\""],
    );
    let oil = &answer["columns"][4];
    assert_eq!((&oil["to"], &oil["unit"]), (&"lube_oil_temp:condition".into(), &"degF".into()));
    assert!((oil["offset"].as_f64().unwrap() + 160.0 / 9.0).abs() < 1e-9, "{oil}");
    let (header, rows) = written(&folder);
    assert_eq!(header, "time_d,speed_rpm,16X_cos_um,16X_sin_um,lube_oil_temp_degc,oil_pressure_bar");
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
    assert!((number(0, 4) - 45.0).abs() < 1e-9 && (number(3, 4) - 66.0).abs() < 1e-9, "{rows:?}");
    assert!((number(0, 5) - 2.0).abs() < 1e-5, "{rows:?}");
    let (probes, readings) = measured(&folder.path("m.csv"));
    assert_eq!((probes.len(), readings.len()), (1, 12));
}

#[test]
fn stated_unit_takes_a_condition_and_the_mapping_keeps_it() {
    let folder = Folder::new();
    let lost = |t: &True| if t.hours == 7.0 { String::new() } else { "55".into() };
    let file = folder.write("a.csv", export(lost));
    let rule = ["--column", "Load=generator:condition:kW"];
    run(&[&file], &folder.text("m.csv"), &rule);
    let (header, rows) = written(&folder);
    assert!(header.contains(",generator_mw"), "{header}");
    assert_eq!([&rows[0][5], &rows[1][5]], ["0.055", ""]);
    let again = run(&[&file], &folder.text("again.csv"), &["--mapping", &folder.text("m.csv")]);
    assert_eq!(again["columns"][5]["to"], "generator:condition", "{again}");
}

#[test]
fn text_in_a_condition_is_refused_with_its_place() {
    let folder = Folder::new();
    let warm = |t: &True| if t.hours == 7.0 { "warm".into() } else { "55".into() };
    let file = folder.write("a.csv", export(warm));
    let says = refused(&folder, &file, &["--column", "Load=load:condition:MW"]);
    assert_says(&says, &["row 3, column 6 `Load`", "\"warm\" is not a number", "\"Load=left\""]);
    let says = refused(&folder, &file, &["--column", "Load=load:condition"]);
    assert_says(&says, &["column 6 `Load`", "a condition without a unit", "bar, MW or percent"]);
}

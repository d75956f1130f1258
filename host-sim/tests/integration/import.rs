//! `import` as a user meets it: exports of other systems become the readings that they were made of, or are refused.

mod conditions;
mod exports;
mod long;
mod public;
pub mod truth;

use crate::program::{assert_says, json, refusal, rotor_edge};
use exports::exports;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;
use rust_xlsxwriter::Workbook;
use truth::{Folder, assert_true, lines, measured, truth};

const HEAD: &str = "Time [h],Speed [rpm],16X 1X Amp [um pp],16X 1X Phase [deg lag],16Y 1X Amp [um pp],16Y 1X Phase [deg lag]\n";

/// A plain export of the truth, with another header.
fn plain(head: &str) -> String {
    lines(head, |t| {
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)];
        format!("{},{},{},{p},{},{q}", t.hours, t.speed_rpm, 2.0 * a, 2.0 * b)
    })
}

fn run(files: &[&str], output: &str, options: &[&str]) -> serde_json::Value {
    json(&rotor_edge(&[&["import"], files, &["-o", output, "--json"], options].concat()))
}

/// The one sentence that an import fails with, which leaves nothing behind.
#[track_caller]
fn refused(folder: &Folder, file: &str, options: &[&str]) -> String {
    let before = folder.names();
    let output = folder.text("out.csv");
    let says = refusal(&[&["import", file, "-o", &output], options].concat());
    assert_eq!(folder.names(), before, "nothing half-written");
    says
}

#[cfg(feature = "parquet")]
#[test]
fn imported_data_frame_keeps_times_units_and_lost_rows() {
    let folder = Folder::new();
    let export = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/import/export.parquet");
    let output = folder.text("measured.csv");
    let answer = run(&[export], &output, &[]);
    assert_eq!((&answer["rows"], &answer["lost"]), (&40.into(), &4.into()), "{answer}");
    let (probes, readings) = measured(&folder.path("measured.csv"));
    assert_eq!(probes, ["15X", "15Y", "16X", "16Y"]);
    // 2.39 mil pk-pk are 30.353 µm zero to peak, a lag of 41.95°
    let last = readings[39].probes[0].unwrap() * 1e6;
    assert!(
        (last.norm() - 2.39 * 12.7).abs() < 1e-6 && (last.arg().to_degrees() + 41.95).abs() < 1e-6,
        "{last}"
    );
    assert!((readings[39].time_d.unwrap() - 39.0 / 24.0).abs() < 1e-9);
    assert_eq!(readings[7].probes, [None; 4]);
}

#[test]
fn twelve_exports_import_at_first_try_as_known_readings() {
    let folder = Folder::new();
    let all = exports(&folder);
    assert_eq!(all.len(), 12);
    for export in all {
        let output = folder.text("measured.csv");
        let files: Vec<&str> = export.files.iter().map(String::as_str).collect();
        let options = [export.options, &["--force"]].concat();
        let answer = run(&files, &output, &options);
        assert_eq!(answer["lost"], export.lost, "{}: {answer}", export.name);
        assert_eq!(answer["rows"], 12, "{}: {answer}", export.name);
        let (probes, readings) = measured(&folder.path("measured.csv"));
        assert_eq!(probes, ["16X", "16Y"], "{}", export.name);
        let mut known = truth();
        let mut seen = readings.clone();
        // what is lost is compared with itself
        for (reading, known) in seen.iter_mut().zip(&mut known) {
            for (y, known) in reading.probes.iter_mut().zip(known.probes) {
                *y = y.or(Some(known * 1e-6));
            }
        }
        assert_true(&seen, &known, export.digits);
        let lost = readings.iter().flat_map(|r| &r.probes).filter(|y| y.is_none()).count();
        assert_eq!(lost, export.lost, "{}", export.name);
    }
}

#[test]
fn imported_file_is_measurement_and_its_comment_is_mapping() {
    let folder = Folder::new();
    let file = folder.write("a.csv", plain("t,n,a,b,c,d\n"));
    let columns = [
        "t=time:h",
        "n=speed:rpm",
        "a=16X:amplitude:um pp",
        "b=16X:phase:deg lag",
        "c=16Y:amplitude",
        "d=16Y:phase:deg",
    ];
    assert_says(&refused(&folder, &file, &[]), &["a.csv", "no row is the header"]);
    let (first, second, mapping) = (folder.text("1.csv"), folder.text("2.csv"), folder.text("m.toml"));
    let file = folder.write("a.csv", plain("time,n,16X a,16X b,16Y amp,16Y phase\n"));
    let columns =
        columns.map(|c| c.replacen("t=", "time=", 1).replacen("a=", "16X a=", 1).replacen("b=", "16X b=", 1));
    let mut options = vec!["--lag", "--pp", "--unit", "um", "--write-mapping", &mapping];
    columns[..4].iter().for_each(|c| options.extend(["--column", c]));
    run(&[&file], &first, &options);
    for kept in [&first, &mapping] {
        run(&[&file], &second, &["--mapping", kept, "--force"]);
        let without_comment = |path: &str| -> Vec<String> {
            let text = std::fs::read_to_string(path).unwrap();
            text.lines().filter(|line| !line.starts_with('#')).map(str::to_string).collect()
        };
        assert_eq!(without_comment(&first), without_comment(&second));
    }
    let (probes, readings) = measured(&folder.path("1.csv"));
    assert_eq!(probes, ["16X", "16Y"]);
    assert_true(&readings, &truth(), 1e-9);
}

#[test]
fn rk4_record_in_mil_pk_pk_and_phase_lag_is_recovered() {
    let rig = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/rigs/rk4");
    let rotor_path = format!("{rig}/rotor.toml");
    let rotor = rotor_file::read(rotor_path.as_ref()).unwrap();
    let known = measurement::read(format!("{rig}/measured.csv").as_ref(), &rotor).unwrap();
    let names: Vec<&str> = rotor.probe.iter().map(|p| p.name.as_str()).collect();
    let mut text = String::from("Condition,Speed (rpm)");
    names.iter().for_each(|name| text += &format!(",{name} 1X Amp (mil pp),{name} 1X Phase (deg lag)"));
    for r in &known {
        text += &format!("\n{},{}", r.run.as_deref().unwrap(), r.speed_rpm);
        for y in r.probes.iter().flatten() {
            text += &format!(",{},{}", 2e6 * y.norm() / 25.4, (-y.arg().to_degrees()).rem_euclid(360.0));
        }
    }
    let folder = Folder::new();
    let file = folder.write("rk4.csv", text);
    let output = folder.text("measured.csv");
    let answer = run(&[&file], &output, &["--rotor", &rotor_path]);
    assert_eq!((answer["rows"].as_u64(), answer["lost"].as_u64()), (Some(510), Some(0)));
    let readings = measurement::read(output.as_ref(), &rotor).unwrap();
    assert_eq!(readings.len(), known.len());
    for (a, b) in readings.iter().zip(&known) {
        assert_eq!((&a.run, a.speed_rpm), (&b.run, b.speed_rpm));
        for (y, known) in a.probes.iter().flatten().zip(b.probes.iter().flatten()) {
            assert!((y - known).norm() <= 1e-9 * known.norm(), "{y} {known}");
        }
    }
    let again = folder.text("again.csv");
    let source = format!("{rig}/measured.csv");
    run(&[&source], &again, &[]);
    let as_it_is = measurement::read(again.as_ref(), &rotor).unwrap();
    assert_eq!(as_it_is.len(), known.len());
}

#[test]
fn hash_comments_before_header_keep_row_numbers() {
    let rotor = rotor_file::parse("rotor.toml", rotor_edge::sample::ROTOR).unwrap();
    let text = rotor_edge::sample::RUNUP_DAY_0;
    let plain = measurement::parse("m.csv", text, &rotor).unwrap();
    let commented = format!("# of a system, \"quoted\"\n#\n{text}");
    let above = measurement::parse("m.csv", &commented, &rotor).unwrap();
    let without_comments = above.iter().map(|r| Reading { row: r.row.map(|row| row - 2), ..r.clone() });
    assert_eq!(without_comments.collect::<Vec<_>>(), plain);
    let broken = commented.replacen(",1500.00,", ",fast,", 1);
    let error = measurement::parse("m.csv", &broken, &rotor).unwrap_err().to_string();
    assert_says(&error, &["m.csv: row 4, column speed_rpm", "\"fast\" is not a number"]);
    assert!(measurement::parse("m.csv", "# nothing else", &rotor).is_err());
}

#[test]
fn a_slow_roll_is_taken_off_by_row_by_run_and_by_file() {
    let folder = Folder::new();
    let head = HEAD.replacen("Time [h]", "Run,Time [h]", 1);
    let shown = |t: &truth::True, runout: f64| {
        let polar = |p: usize| (t.probes[p] + runout).to_polar();
        let [(a, p), (b, q)] = [polar(0), polar(1)];
        let (p, q) = (-p.to_degrees(), -q.to_degrees());
        format!("up,{},{},{},{p},{},{q}\n", t.hours, t.speed_rpm, 2.0 * a, 2.0 * b)
    };
    let all: String = truth().iter().map(|t| shown(t, 4.0)).collect();
    let roll = "turning,-1,250,8,0,8,0\n";
    let together = folder.write("together.csv", format!("{head}{roll}{all}"));
    let alone = folder.write("alone.csv", format!("{head}{all}"));
    let slow = folder.write("slow.csv", format!("{head}{roll}"));
    for (file, slow_roll) in [(&together, "turning"), (&together, "2"), (&alone, slow.as_str())] {
        let answer = run(&[file], &folder.text("m.csv"), &["--slow-roll", slow_roll, "--force"]);
        assert!((answer["runout_um"][0][0].as_f64().unwrap() - 4.0).abs() < 1e-9, "{answer}");
        assert_true(&measured(&folder.path("m.csv")).1, &truth(), 1e-9);
    }
    assert_says(&refused(&folder, &alone, &["--slow-roll", "gear"]), &["\"gear\" is neither a run"]);
    assert_says(
        &refused(&folder, &together, &["--slow-roll", "5"]),
        &["no more than half the fastest speed"],
    );
}

#[test]
fn a_phase_reference_that_was_moved_on_a_date_is_moved_back() {
    let folder = Folder::new();
    let head = HEAD.replacen("Time [h]", "Time", 1);
    let text = lines(&head, |t| {
        let (day, hour) = t.day_and_hour();
        let moved = if day >= 7 { 40.0 } else { 0.0 };
        let [(a, p), (b, q)] = [t.polar(0), t.polar(1)];
        let (p, q) = (p + moved, q + moved);
        format!("2024-03-{day:02}T{hour:02}:00,{},{},{p},{},{q}", t.speed_rpm, 2.0 * a, 2.0 * b)
    });
    let file = folder.write("a.csv", text);
    let answer = run(&[&file], &folder.text("m.csv"), &["--phase-shift", "2024-03-07=40"]);
    assert!(answer["turned"].as_u64().unwrap() > 2, "{answer}");
    assert_true(&measured(&folder.path("m.csv")).1, &truth(), 1e-9);
    assert_says(
        &refused(&folder, &file, &["--phase-shift", "spring"]),
        &["--phase-shift spring: expected DATE=DEGREES"],
    );
}

#[test]
fn stale_values_and_outliers_are_lost_and_resonance_is_kept() {
    let folder = Folder::new();
    let row = |k: usize, speed: f64, amp: f64, phase: f64| {
        format!("{k},{speed},{amp},{phase},{},{}\n", 30.0 + 0.1 * (k % 3) as f64, 50 + k % 2)
    };
    let mut text = HEAD.to_string();
    for k in 0..30 {
        let scatter = 0.05 * ((k * 7) % 5) as f64;
        let (amp, phase) = match k {
            10..=14 => (21.0, 31.0),
            // the mean of 359 and 1 degrees, by a system that does not know of angles
            20 => (20.0, 180.0),
            25 => (400.0, 30.0),
            _ => (20.0 + scatter, 30.0 + scatter),
        };
        text += &row(k, 11_000.0, amp, phase);
    }
    let file = folder.write("steady.csv", &text);
    let answer = run(&[&file], &folder.text("m.csv"), &[]);
    assert_eq!(
        answer["marked"],
        serde_json::json!({"no_measurement": 0, "stale": 4, "outliers": 2}),
        "{answer}"
    );
    assert_eq!(answer["lost"], 6);
    let kept = run(&[&file], &folder.text("m.csv"), &["--keep-stale", "--keep-outliers", "--force"]);
    assert_eq!(kept["lost"], 0);
    let mut sweep = HEAD.to_string();
    for k in 0..30 {
        let speed = 1000.0 + 100.0 * k as f64;
        sweep += &row(k, speed, if k == 15 { 200.0 } else { 10.0 + 0.1 * k as f64 }, 30.0);
    }
    let file = folder.write("sweep.csv", sweep);
    assert_eq!(run(&[&file], &folder.text("m.csv"), &["--force"])["lost"], 0);
}

#[test]
fn a_rotor_names_the_probes_and_what_is_of_no_probe_is_left() {
    let folder = Folder::new();
    let rotor = folder.write("rotor.toml", rotor_edge::sample::ROTOR);
    let probes: Vec<String> =
        rotor_file::read(rotor.as_ref()).unwrap().probe.iter().map(|p| p.name.clone()).collect();
    let mut head = String::from("RPM");
    let mut row = String::from("11000");
    for name in probes.iter().map(String::as_str).chain(["99Z"]) {
        head += &format!(",BRG {name} Probe 1X Amp (um pp),BRG {name} Probe 1X Phase (deg lag)");
        row += ",20,90";
    }
    let file = folder.write("a.csv", format!("{head}\n{row}\n"));
    let answer = run(&[&file], &folder.text("m.csv"), &["--rotor", &rotor]);
    assert_eq!(answer["left"].as_array().unwrap().len(), 2, "{answer}");
    assert_says(answer["left"][0]["why"].as_str().unwrap(), &["99Z\" is no probe of the rotor"]);
    let (names, readings) = measured(&folder.path("m.csv"));
    assert_eq!(names, probes);
    let y = readings[0].probes[0].unwrap() * 1e6;
    assert!((y.re).abs() < 1e-9 && (y.im + 10.0).abs() < 1e-9, "lag of 90 degrees is sin alone: {y}");
    let says = refused(
        &folder,
        &file,
        &["--rotor", &rotor, "--column", "RPM=speed:rpm", "--column", "2=7X:amplitude:um pp"],
    );
    assert_says(&says, &["a.csv", "the rotor has no probe 7X"]);
    let lacking = folder.write("b.csv", HEAD.to_string() + "1,11000,20,90,20,90\n");
    assert_says(&refused(&folder, &lacking, &["--rotor", &rotor]), &["b.csv"]);
}

#[test]
fn dry_run_shows_columns_and_output_is_not_overwritten() {
    let folder = Folder::new();
    let file = folder.write("a.csv", plain(HEAD));
    let output = folder.text("m.csv");
    let shown = rotor_edge(&["import", &file, "-o", &output, "--dry-run"]);
    let text = String::from_utf8(shown.stdout).unwrap();
    assert_says(
        &text,
        &[
            "3 `16X 1X Amp [um pp]`",
            "probe 16X, amplitude",
            "um pp",
            "halved to µm 0-pk",
            "Nothing was written",
        ],
    );
    assert_eq!(folder.names(), ["a.csv"]);
    run(&[&file], &output, &[]);
    let before = std::fs::read(&output).unwrap();
    let again = refusal(&["import", &file, "-o", &output]);
    assert_says(&again, &["m.csv: exists already", "--force"]);
    let onto_itself = refusal(&["import", &file, "-o", &file]);
    assert_says(&onto_itself, &["a.csv: is read and would be overwritten"]);
    assert_eq!(std::fs::read(&output).unwrap(), before);
    run(&[&file], &output, &["--force"]);
}

#[test]
fn what_would_change_the_physics_is_asked_for_and_never_guessed() {
    let folder = Folder::new();
    let other = |from: &str, to: &str| plain(&HEAD.replace(from, to));
    for (text, says) in [
        (
            other(" lag", ""),
            vec!["row 1, column 4 `16X 1X Phase [deg]`", "neither lag nor lead", "--lag or --lead"],
        ),
        (
            other(" pp", ""),
            vec!["column 3 `16X 1X Amp [um]`", "does not state pk-pk", "--pp, --zero-peak or --rms"],
        ),
        (other("um pp", "pp"), vec!["column 3", "states no unit", "--unit um"]),
        (other("um pp", "V pp"), vec!["column 3", "is a voltage", "--sensitivity-mv-um"]),
        (
            HEAD.replace("deg lag", "lag") + "1,11000,20,1.5,20,2\n",
            vec!["column 4", "degrees or radians", "--angle"],
        ),
        (
            HEAD.replace("Speed [rpm]", "Speed") + "1,183,20,30,20,30\n",
            vec!["column 2 `Speed`", "183", "speed:Hz"],
        ),
        (
            HEAD.replace("Time [h]", "Date") + "03/04/2024,11000,20,30,20,30\n",
            vec!["row 2, column 1 `Date`", "03/04/2024", "--dates"],
        ),
        (
            HEAD.replace("Time [h]", "Time") + "45356.5,11000,20,30,20,30\n",
            vec!["row 2, column 1 `Time`", "time:excel"],
        ),
        (
            HEAD.replace(',', ";") + "1;11000;12,345;30;20;30\n",
            vec!["\"12,345\"", "--decimal comma or --decimal point"],
        ),
        (HEAD.replace(',', ";") + "1;11000;12,34;30.5;20;30\n", vec!["decimal comma and some a point"]),
        (
            other("16X 1X Amp", "16X"),
            vec!["column 3 `16X [um pp]`", "all frequencies", "16X [um pp]=16X:amplitude"],
        ),
        (other("16Y 1X", "16X 1X"), vec!["column 3", "column 5", "both the amplitude of 16X"]),
        (other("16X ", "").replace("16Y ", ""), vec!["names no probe", "PROBE:amplitude"]),
    ] {
        let file = folder.write("a.csv", text);
        let message = refused(&folder, &file, &[]);
        assert_says(&message, &[&["a.csv"], &says[..]].concat());
    }
    let file =
        folder.write("a.csv", plain("Time [h],Speed,16X 1X Amp,16X 1X Phase,16Y 1X Amp,16Y 1X Phase\n"));
    assert_says(&refused(&folder, &file, &[]), &["--unit um", "--pp", "--lag or --lead"]);
}

#[test]
fn invalid_exports_are_refused_with_row_and_column() {
    let folder = Folder::new();
    let row = "1,11000,20,30,20,30\n";
    let machine = HEAD.replacen("Time [h]", "Machine,Time [h]", 1);
    for (text, says) in [
        (
            format!("{HEAD}{row}2,11000,stopped,30,20,30\n{row}"),
            vec!["row 3, column 3", "\"stopped\" is not a number"],
        ),
        (
            format!("{HEAD}1,11000,20 um,30,20,30\n2,11000,0.8 mil,30,20,30\n"),
            vec!["row 3, column 3", "0.8 mil", "one unit"],
        ),
        (HEAD.replace("um pp", "um mil pp") + row, vec!["row 1, column 3", "contradict"]),
        (
            format!("{machine}K-101,{row}K-102,{row}"),
            vec!["row 3, column 1", "\"K-102\"", "\"K-101\"", "--machine"],
        ),
        (HEAD.replace("Speed [rpm]", "Load") + row, vec!["row 1", "no column is a speed", "--speed-rpm"]),
        (HEAD.replace("16X 1X Phase [deg lag]", "Oil") + row, vec!["amplitude of 16X and no phase"]),
        (HEAD.replace("um pp", "mm/s rms").replace("deg lag", "x") + row, vec!["row 1"]),
        (
            format!("{HEAD}1,11000,20,5,30,20,30\n"),
            vec!["row 2 has 7 cells, the header has 6", "decimal comma"],
        ),
        (format!("{HEAD}1,11000,-20,30,20,30\n"), vec!["row 2, column 3", "-20 is no amplitude"]),
        (format!("{HEAD}1,11000,90000,30,20,30\n"), vec!["row 2, column 3", "more than a probe can see"]),
        (format!("{HEAD}1,-11000,20,30,20,30\n"), vec!["row 2, column 2", "positive speed"]),
        (format!("{HEAD},11000,20,30,20,30\n"), vec!["row 2, column 1", "is empty, expected a time"]),
        (
            format!("{HEAD}1,11000,20,30,20,30\n2024-03-05,11000,20,30,20,30\n").replace(" [h]", " [d]"),
            vec!["a.csv: row 3", "others not, expected one kind"],
        ),
        (format!("{HEAD}yesterday,11000,20,30,20,30\n"), vec!["row 2, column 1", "is not a time"]),
        (HEAD.to_string(), vec!["there is no reading below the header"]),
        ("Dear colleague,\nplease find the data attached.\n".into(), vec!["no row is the header"]),
        (String::new(), vec!["is empty"]),
    ] {
        let file = folder.write("a.csv", text);
        assert_says(&refused(&folder, &file, &[]), &[&["a.csv"], &says[..]].concat());
    }
    let picture = folder.write("picture.csv", b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR");
    assert_says(&refused(&folder, &picture, &[]), &["picture.csv", "neither text nor a workbook"]);
    if cfg!(not(feature = "parquet")) {
        let parquet = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/import/export.parquet");
        assert_says(&refused(&folder, parquet, &[]), &["is Parquet", "--features parquet"]);
    }
    let archive = folder.write("archive.xlsx", b"PK\x03\x04 and nothing else");
    assert_says(&refused(&folder, &archive, &[]), &["archive.xlsx", "cannot be read as a workbook"]);
    assert_says(&refused(&folder, &folder.text("none.csv"), &[]), &["none.csv", "cannot be read"]);
    let good = folder.write("a.csv", plain(HEAD));
    assert_says(&refused(&folder, &good, &["--column", "Torque=left"]), &["\"Torque\": there is no column"]);
    let mapping = folder.write("m.toml", "phase = \"sideways\"\n");
    assert_says(&refused(&folder, &good, &["--mapping", &mapping]), &["m.toml"]);
    let one = folder.write("one.csv", format!("Machine: K-101\n{HEAD}{row}"));
    let other = folder.write("other.csv", format!("Machine: K-102\n{HEAD}{row}"));
    assert_says(&refused(&folder, &one, &[&other]), &["other.csv", "\"K-102\"", "\"K-101\"", "one machine"]);
}

#[test]
fn options_that_do_not_fit_name_the_file() {
    let folder = Folder::new();
    let row = "1,11000,20,30,20,30\n";
    let file = folder.write("a.csv", HEAD.to_string() + row);
    let named = folder.write("n.csv", format!("Machine: K-101\n{HEAD}{row}"));
    run(&[&named], &folder.text("n.out.csv"), &["--machine", "K-101"]);
    let timeless = folder.write("b.csv", HEAD.replacen("Time [h]", "Load", 1) + row);
    for (file, options, says) in [
        (&file, ["--column", "nope=left"], ["a.csv", "--column \"nope\"", "expected one of `"]),
        (&file, ["--phase-shift", "2024-03-05=40"], ["a.csv", "--phase-shift", "without a calendar"]),
        (&timeless, ["--phase-shift", "2024-03-05=40"], ["b.csv", "--phase-shift", "no time"]),
        (&file, ["--sheet", "May"], ["a.csv", "--sheet \"May\"", "there are no sheets"]),
        (&file, ["--machine", "K-1"], ["a.csv", "--machine \"K-1\"", "no column names machines"]),
        (&named, ["--machine", "K-1"], ["n.csv", "--machine \"K-1\"", "the file is of \"K-101\""]),
    ] {
        assert_says(&refused(&folder, file, &options), &says);
    }
    let machines = folder.write("m1.csv", format!("Machine,{HEAD}K-1,{row}"));
    let says = refused(&folder, &machines, &["--machine", "K-3"]);
    assert_says(&says, &["m1.csv", "--machine \"K-3\"", "no row is of that machine"]);
    let alone = folder.write("c.csv", "Run,Speed [rpm],Fan DE 1X Amp [um pp]\nasfound,1480,152\n");
    assert_says(&refused(&folder, &alone, &[]), &["c.csv", "no phase", "`rotor-edge balance --trial-only`"]);
    let elapsed = folder.write("d.csv", HEAD.replacen("Time [h]", "t [h]", 1) + row + "24" + &row[1..]);
    run(&[&elapsed], &folder.text("m.csv"), &[]);
    assert_eq!(measured(&folder.path("m.csv")).1[1].time_d, Some(1.0));
}

#[test]
fn workbook_errors_name_sheet_and_two_tables_need_option() {
    let folder = Folder::new();
    let book = |sheets: &[&str], amplitude: &str| {
        let mut book = Workbook::new();
        for name in sheets {
            let sheet = book.add_worksheet().set_name(*name).unwrap();
            for (column, text) in HEAD.trim_end().split(',').enumerate() {
                sheet.write(2, column as u16, text).unwrap();
            }
            for (column, value) in [1.0, 11_000.0, 0.0, 30.0, 20.0, 30.0].into_iter().enumerate() {
                sheet.write(3, column as u16, value).unwrap();
            }
            sheet.write(3, 2, amplitude).unwrap();
        }
        book.save_to_buffer().unwrap()
    };
    let file = folder.write("a.xlsx", book(&["Trend"], "see note"));
    let says = refused(&folder, &file, &[]);
    assert_says(&says, &["a.xlsx: sheet \"Trend\": row 4, column 3", "\"see note\" is not a number"]);
    let file = folder.write("a.xlsx", book(&["May", "June"], "20"));
    assert_says(&refused(&folder, &file, &[]), &["sheet \"May\"", "sheet \"June\"", "--sheet"]);
    assert_eq!(run(&[&file], &folder.text("m.csv"), &["--sheet", "June"])["rows"], 1);
    assert_says(&refused(&folder, &file, &["--sheet", "July"]), &["of sheet \"July\""]);
}

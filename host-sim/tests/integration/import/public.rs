//! Exports as public reports of bugs describe them: headers of two rows, units of velocity, System 1, clocks.

use std::f64::consts::PI;

use rotor_edge_desktop::measurement::Reading;
use rust_xlsxwriter::{Format, Workbook};

use super::truth::{Folder, measured};
use super::{refused, run};
use crate::program::assert_says;

/// The readings of files, and the answer.
fn imported(folder: &Folder, files: &[&str], options: &[&str]) -> (serde_json::Value, Vec<Reading>) {
    let answer = run(files, &folder.text("m.csv"), &[options, &["--force"]].concat());
    let (_, readings) = measured(&folder.path("m.csv"));
    (answer, readings)
}

/// Amplitude, µm pk-pk, and lag, degrees, of a probe.
fn polar(reading: &Reading, probe: usize) -> (f64, f64) {
    let y = reading.probes[probe].unwrap();
    (2e6 * y.norm(), (-y.arg().to_degrees()).rem_euclid(360.0))
}

#[track_caller]
fn assert_polar(reading: &Reading, probe: usize, (um_pp, lag_deg): (f64, f64)) {
    let (found, lag) = polar(reading, probe);
    let off_deg = ((lag - lag_deg + 180.0).rem_euclid(360.0) - 180.0).abs();
    assert!((found / um_pp - 1.0).abs() < 1e-6 && off_deg < 1e-6, "{found} µm at {lag}°");
}

fn times_s(readings: &[Reading]) -> Vec<f64> {
    readings.iter().map(|r| (r.time_d.unwrap() * 86_400.0 * 1e3).round() / 1e3).collect()
}

#[test]
fn names_in_the_upper_header_row_alone_are_kept() {
    let folder = Folder::new();
    let rows = "2025-03-05 10:00:00,2980,30,10,20,80,7\n2025-03-04 10:00:00,2981,31,11,21,81,7\n";
    let amplitudes = "1X Amp [um pp],1X Phase [deg lag],1X Amp [um pp],1X Phase [deg lag]";
    for (head, left) in [
        (format!("Timestamp,Speed,DE X,,DE Y,,Load\n,rpm,{amplitudes},\n"), "Load"),
        (format!("Timestamp,Speed rpm,DE X,,DE Y,,Load\n,,{amplitudes},\n"), "Load"),
        (format!("K-101,,DE,,,,\nTimestamp,Speed,X,,Y,,\n,rpm,{amplitudes},Load\n"), "Load"),
        ("Timestamp,Speed,DE X,,DE Y,,\n,rpm,um pp,deg lag,um pp,deg lag,MW\n".to_string(), "MW"),
    ] {
        let options: &[&str] = if left == "MW" {
            &["--column", "3=DE X:amplitude", "--column", "5=DE Y:amplitude"]
        } else {
            &[]
        };
        let file = folder.write("a.csv", format!("{head}{rows}"));
        let (answer, readings) = imported(&folder, &[&file], options);
        assert_eq!(answer["left"][0]["from"], left, "{head}{answer}");
        assert_eq!(times_s(&readings), [0.0, 86_400.0], "{head}");
        assert!(answer["sorted"].as_bool().unwrap() && readings[1].speed_rpm == 2980.0, "{head}{answer}");
        assert_polar(&readings[1], 1, (20.0, 80.0));
    }
    let file = folder.write("a.csv", format!("Timestamp,Speed,DE X,,DE Y,,Load\n,rpm,{amplitudes},\n{rows}"));
    let says = refused(&folder, &file, &["--speed-rpm", "1000"]);
    assert_says(&says, &["a.csv: column `Speed` is the speed", "expected no --speed-rpm"]);
}

#[test]
fn column_without_header_is_listed_and_reached_by_number() {
    let folder = Folder::new();
    let text = ",Speed [rpm],DE X 1X Amp [um pp],DE X 1X Phase [deg lag]\n0,2980,30,10\n10,2900,31,11\n";
    let file = folder.write("a.csv", text);
    let (answer, _) = imported(&folder, &[&file], &[]);
    assert_eq!(
        (&answer["left"][0]["column"], &answer["left"][0]["why"]),
        (&1.into(), &"it has no header".into())
    );
    let (_, readings) = imported(&folder, &[&file], &["--column", "1=time:ms"]);
    assert_eq!(times_s(&readings), [0.0, 0.01]);
}

#[test]
fn velocities_and_accelerations_become_displacements() {
    let folder = Folder::new();
    let omega = 1180.0 * PI / 30.0;
    // the displacement lags the velocity by a quarter of a turn, the acceleration by half
    let velocity = |mm_s: f64| (2e3 * mm_s / omega, 18.0 + 90.0);
    let acceleration = |m_s2: f64| (2e6 * m_s2 / (omega * omega), 18.0 + 180.0);
    for (unit, options, expected) in [
        ("in/s pk", &[][..], velocity(0.36 * 25.4)),
        ("ips pk", &[], velocity(0.36 * 25.4)),
        ("mm/s rms", &[], velocity(0.36 * 2_f64.sqrt())),
        ("mm/sec 0-pk", &[], velocity(0.36)),
        ("mm s⁻¹ 0-pk", &[], velocity(0.36)),
        ("mil/s pk", &[], velocity(0.36 * 0.0254)),
        ("g pk", &[], acceleration(0.36 * 9.80665)),
        ("m/s² rms", &[], acceleration(0.36 * 2_f64.sqrt())),
        ("V pk", &["--sensitivity", "100 mV/g"], acceleration(3.6 * 9.80665)),
        ("V pk, 4 mV/(mm/s)", &[], velocity(90.0)),
        ("pk", &["--unit", "mm/s"], velocity(0.36)),
        ("um pp", &[], (0.36, 18.0)),
    ] {
        let head = format!("Run;Speed [rpm];Brg1 1X Amp [{unit}];Brg1 1X Phase [deg lag]\n");
        let file = folder.write("a.csv", format!("{head}base;1180;0.36;18\ntrial;1180;0.26;121\n"));
        let (_, readings) = imported(&folder, &[&file], options);
        assert_polar(&readings[0], 0, expected);
    }
    let text = "Speed [rpm],DE 1X Velocity [pk],DE 1X Phase [deg lag]\n2980,3,10\n";
    let file = folder.write("a.csv", text);
    assert_says(
        &refused(&folder, &file, &["--unit", "um"]),
        &["is a velocity or an acceleration", "--unit mm/s"],
    );
}

#[test]
fn speeds_in_every_unit_become_rpm() {
    let folder = Folder::new();
    for (head, value, rpm) in [
        ("Speed [krpm]", 12.5, 12_500.0),
        ("n [1/s]", 49.0, 2_940.0),
        ("Speed [rev/s]", 49.0, 2_940.0),
        ("Speed (cpm)", 2980.0, 2_980.0),
        ("Omega [1/s]", 100.0 * PI, 3_000.0),
        ("Drehzahl [s⁻¹]", 50.0, 3_000.0),
    ] {
        let text = format!("{head};DE X 1X Amp [um pp];DE X 1X Phase [deg lag]\n{value};30;10\n");
        let (_, readings) = imported(&folder, &[&folder.write("a.csv", text)], &[]);
        assert!((readings[0].speed_rpm / rpm - 1.0).abs() < 1e-9, "{head}: {}", readings[0].speed_rpm);
    }
}

/// A trend export of one probe in the layout of System 1.
fn system_1(point: &str, variable: &str, rows: &[(&str, f64, f64)]) -> String {
    let mut text = format!(
        "Machine Name,K-310,,,,,\nPoint Name,{point},,,,,\nComp,,,,,,\nY-Axis Unit,µm pp,,,,,\nSpeed Unit,rpm,,,,,\n\
         Variable,{variable},,,,,\n\
         X-Axis Value,Y-Axis Value,Y-Axis Status,Phase,Phase Status,Speed,Speed Status\n"
    );
    for (time, um_pp, lag_deg) in rows {
        text += &format!("{time},{um_pp},Valid,{lag_deg},Valid,5000,Valid\n");
    }
    text + "2/4/2024 6:00:00 AM,0.4,Valid,77,Invalid,4000,Valid\n2/4/2024 8:00:00 AM,0.4,Valid,,Invalid,,Invalid\n"
}

#[test]
fn system_1_trends_of_two_probes_become_one_record() {
    let folder = Folder::new();
    let times =
        ["2/3/2024 10:00:00 PM", "2/4/2024 12:00:00 AM", "2/4/2024 2:00:00 AM", "2/4/2024 4:00:00 AM"];
    let rows = |um_pp: f64, lag_deg: f64| -> Vec<(&str, f64, f64)> {
        times.iter().enumerate().map(|(i, time)| (*time, um_pp + i as f64, lag_deg)).collect()
    };
    let x = folder.write("x.csv", system_1("31VT-4101X", "1X", &rows(21.0, 140.0)));
    let y = folder.write("y.csv", system_1("31VT-4101Y", "1X", &rows(17.0, 50.0)));
    let (answer, readings) = imported(&folder, &[&x, &y], &["--lag"]);
    let (probes, _) = measured(&folder.path("m.csv"));
    assert_eq!(probes, ["31VT-4101X", "31VT-4101Y"]);
    assert_eq!(times_s(&readings), [0.0, 7200.0, 14_400.0, 21_600.0, 28_800.0]);
    let text = std::fs::read_to_string(folder.path("m.csv")).unwrap();
    assert_eq!(text.lines().last(), Some("0.4166666666666667,,,,,"), "a time without speed keeps its row");
    assert_polar(&readings[1], 0, (22.0, 140.0));
    assert_polar(&readings[1], 1, (18.0, 50.0));
    assert_eq!(readings[4].probes, [None, None], "an invalid phase");
    assert_eq!((&answer["rows"], &answer["lost"]), (&6.into(), &4.into()), "{answer}");
    assert_eq!(answer["skipped"]["without_speed"], 0, "{answer}");
    assert!(answer["remarks"][0].as_str().unwrap().contains("month first"), "{answer}");
    assert_says(
        answer["remarks"][2].as_str().unwrap(),
        &["x.csv: row 13", "no speed", "its probes are empty"],
    );
    let second = folder.write("2x.csv", system_1("31VT-4101X", "2X", &rows(21.0, 140.0)));
    assert_says(&refused(&folder, &second, &["--lag"]), &["no column is a 1x vibration", "`Y-Axis Value`"]);
}

#[test]
fn every_time_of_either_trend_has_its_row() {
    let folder = Folder::new();
    let x = [("2/3/2024 10:00:00 PM", 21.0, 140.0), ("2/4/2024 2:00:00 AM", 22.0, 140.0)];
    let y = [("2/4/2024 12:00:00 AM", 17.0, 50.0), ("2/4/2024 2:00:00 AM", 18.0, 50.0)];
    let x = folder.write("x.csv", system_1("31VT-4101X", "1X", &x));
    // the speed of the last row is valid in one file alone
    let text = system_1("31VT-4101Y", "1X", &y).replace("77,Invalid,4000,Valid", "51,Valid,4000,Valid");
    let text = text.replace(",,Invalid,,Invalid", ",52,Valid,4990,Valid")
        + "2/4/2024 10:00:00 AM,1,Valid,2,Valid,0,Valid\n";
    let y = folder.write("y.csv", text);
    let (answer, readings) = imported(&folder, &[&x, &y], &["--lag", "--dates", "month-first"]);
    assert_eq!(times_s(&readings), [0.0, 7200.0, 14_400.0, 28_800.0, 36_000.0]);
    let held: Vec<[bool; 2]> = readings.iter().map(|r| [0, 1].map(|p| r.probes[p].is_some())).collect();
    assert_eq!(held, [[true, false], [false, true], [true, true], [false, true], [false, true]]);
    assert_eq!((readings[4].speed_rpm, &answer["rows"]), (4990.0, &5.into()));
    assert_says(answer["skipped"]["first"][0].as_str().unwrap(), &["y.csv: row 12: standstill"]);
}

#[test]
fn epochs_of_every_unit_give_the_same_times() {
    let folder = Folder::new();
    // 2024-03-05T14:30:15Z and 250 ms later
    let times = [1_709_649_015_000_u64, 1_709_649_015_250];
    let export = |header: &str, write: &dyn Fn(u64) -> String| {
        let row = |ms: &u64| format!("{},2980,30,{}\n", write(*ms), 10 + ms % 9);
        let rows: String = times.iter().map(row).collect();
        folder.write("a.csv", format!("{header},Speed [rpm],16X Amp [um pp],16X Phase [deg lag]\n{rows}"))
    };
    let decimals = |ms: u64| format!("{}.{:03}", ms / 1000, ms % 1000);
    let ns = |ms: u64| format!("{ms}000000");
    let writers: [&dyn Fn(u64) -> String; 5] =
        [&decimals, &|ms| ms.to_string(), &|ms| format!("{ms}000"), &ns, &|ms| {
            format!("{:.18e}", ms as f64 * 1e6)
        }];
    for (header, write) in ["time", "Timestamp", "unix", "Time [ns]", "epoch_ns"]
        .into_iter()
        .flat_map(|header| writers.iter().map(move |write| (header, write)))
    {
        // a stated unit is that of the numbers
        let is_ns = write(times[0]).trim_end_matches("e18").len() >= 19;
        if header.ends_with("ns]") && !is_ns {
            continue;
        }
        let file = export(header, write);
        let (answer, readings) = imported(&folder, &[&file], &[]);
        assert_eq!(answer["start"], "2024-03-05T14:30:15Z", "{header}");
        assert_eq!(times_s(&readings), [0.0, 0.25], "{header}");
    }
    let file = export("time", &|_| "1.70965E+18".into());
    let says = refused(&folder, &file, &[]);
    assert_says(
        &says,
        &["row 2, column 1 `time`", "1.70965E+18", "without its seconds", "all of its digits"],
    );
    let file = export("Time [h]", &ns);
    assert_says(&refused(&folder, &file, &[]), &["row 2", "h is more than 10,000 years", "time:UNIT"]);
}

#[test]
fn times_of_day_over_midnight_keep_the_order_of_the_file() {
    let folder = Folder::new();
    let mut book = Workbook::new();
    let sheet = book.add_worksheet();
    let clock = Format::new().set_num_format("hh:mm:ss");
    let rows = [(1438.0, 2981), (1439.0, 2982), (0.0, 2983), (1.0, 2984)];
    for (column, text) in
        ["Time", "Speed [rpm]", "DE X 1X Amp [um pp]", "DE X 1X Phase [deg lag]"].iter().enumerate()
    {
        sheet.write(0, column as u16, *text).unwrap();
    }
    let mut text = String::from("Time,Speed [rpm],DE X 1X Amp [um pp],DE X 1X Phase [deg lag]\n");
    for (i, (minutes, rpm)) in rows.into_iter().enumerate() {
        let row = i as u32 + 1;
        sheet.write_with_format(row, 0, minutes / 1440.0, &clock).unwrap();
        for (column, value) in [f64::from(rpm), 30.0 + i as f64, 10.0].into_iter().enumerate() {
            sheet.write(row, column as u16 + 1, value).unwrap();
        }
        let (hour, minute) = (minutes as u32 / 60, minutes as u32 % 60);
        text += &format!("{hour}:{minute:02}:00,{rpm},{},10\n", 30 + i);
    }
    let workbook = folder.write("a.xlsx", book.save_to_buffer().unwrap());
    for file in [workbook, folder.write("a.csv", &text)] {
        let (answer, readings) = imported(&folder, &[&file], &[]);
        let speeds: Vec<f64> = readings.iter().map(|r| r.speed_rpm).collect();
        assert_eq!(speeds, [2981.0, 2982.0, 2983.0, 2984.0], "{file}");
        assert_eq!(times_s(&readings), [86_280.0, 86_340.0, 86_400.0, 86_460.0], "{file}");
        assert!(
            !answer["sorted"].as_bool().unwrap()
                && answer["remarks"][0].as_str().unwrap().contains("midnight")
        );
    }
    let back = text.replace("23:59", "23:28");
    assert_says(&refused(&folder, &folder.write("b.csv", back), &[]), &["b.csv: row 3", "1800 s before"]);
}

#[test]
fn hour_that_comes_twice_in_autumn_keeps_the_order_of_the_file() {
    let folder = Folder::new();
    let head = "Time,Speed [rpm],DE X 1X Amp [um pp],DE X 1X Phase [deg lag]\n";
    let rows = ["02:30", "02:45", "02:00", "02:15", "03:00"];
    let row = |(i, time): (usize, &&str)| format!("2025-10-26 {time}:00,298{i},3{i},10\n");
    let newest_last: Vec<String> = rows.iter().enumerate().map(row).collect();
    let newest_first: Vec<String> = newest_last.iter().rev().cloned().collect();
    for lines in [newest_last, newest_first] {
        let file = folder.write("a.csv", head.to_string() + &lines.concat());
        let (answer, readings) = imported(&folder, &[&file], &[]);
        assert_eq!(times_s(&readings), [0.0, 900.0, 1800.0, 2700.0, 5400.0]);
        let speeds: Vec<f64> = readings.iter().map(|r| r.speed_rpm).collect();
        assert_eq!(speeds, [2980.0, 2981.0, 2982.0, 2983.0, 2984.0]);
        assert!(answer["remarks"][0].as_str().unwrap().contains("the clock was set back"), "{answer}");
    }
    // in summer the rows are out of order
    let lines: Vec<String> = rows.iter().enumerate().map(row).collect();
    let file = folder.write("a.csv", head.to_string() + &lines.concat().replace("-10-26", "-07-26"));
    let (answer, readings) = imported(&folder, &[&file], &[]);
    assert_eq!(times_s(&readings), [0.0, 900.0, 1800.0, 2700.0, 3600.0]);
    assert!(answer["sorted"].as_bool().unwrap(), "{answer}");
}

#[test]
fn probes_stamped_shortly_apart_become_whole_readings() {
    let folder = Folder::new();
    let head = "Run,Point,Timestamp,Speed (rpm),1X Ampl (um pp),1X Phase (deg lag)\n";
    let mut text = head.to_string();
    for (hour, run) in ["base", "t1", "t2"].iter().enumerate() {
        text += &format!("{run},DE,2025-03-04 1{hour}:00:00.10,298{hour},80,30\n");
        text += &format!("{run},NDE,2025-03-04 1{hour}:00:00.25,298{hour},60,200\n");
    }
    let (answer, readings) = imported(&folder, &[&folder.write("a.csv", &text)], &[]);
    assert_eq!((&answer["rows"], &answer["lost"]), (&3.into(), &0.into()), "{answer}");
    assert_polar(&readings[2], 1, (60.0, 200.0));
    assert_eq!(answer["remarks"][0], "3 rows were joined with rows of other probes up to 0.150 s before.");
    // the same with a column for each
    let mut wide = String::from("Timestamp,Speed [rpm],DE 1X Amp [um pp],DE 1X Phase [deg lag],");
    wide += "NDE 1X Amp [um pp],NDE 1X Phase [deg lag]\n";
    for hour in 0..3 {
        wide += &format!("2025-03-04 1{hour}:00:00.10,298{hour},80,30,,\n");
        wide += &format!("2025-03-04 1{hour}:00:00.25,298{hour},,,60,200\n");
    }
    let (answer, readings) = imported(&folder, &[&folder.write("w.csv", wide)], &[]);
    assert_eq!((&answer["rows"], &answer["lost"]), (&3.into(), &0.into()), "{answer}");
    assert_polar(&readings[2], 1, (60.0, 200.0));
    // half the time to the next reading is another reading
    let apart = text.replace(":00:00.25", ":30:00");
    let (answer, _) = imported(&folder, &[&folder.write("a.csv", apart)], &[]);
    assert_eq!((&answer["rows"], &answer["lost"]), (&6.into(), &6.into()), "{answer}");
}

#[test]
fn many_rows_of_one_time_become_as_many_readings() {
    let folder = Folder::new();
    let mut text = String::from("Point,Date,Speed (rpm),1X Ampl (um pp),1X Phase (deg lag)\n");
    for i in 0..30_000 {
        for (point, um_pp) in [("DE", 80.0), ("NDE", 60.0)] {
            text += &format!("{point},2025-03-04,2980,{},30\n", um_pp + f64::from(i % 7));
        }
    }
    let (answer, _) = imported(&folder, &[&folder.write("a.csv", text)], &[]);
    assert_eq!((&answer["rows"], &answer["lost"]), (&30_000.into(), &0.into()));
}

#[test]
fn tables_too_large_for_memory_are_refused_by_name() {
    let folder = Folder::new();
    let wide = format!("Speed [rpm]{}\n", ",P 1X Amp [um pp]".repeat(50_000));
    let says = refused(&folder, &folder.write("wide.csv", wide), &[]);
    assert_says(&says, &["wide.csv: row 1 has 50001 cells, expected at most 16384"]);
    let mut book = Workbook::new();
    let sheet = book.add_worksheet();
    sheet.write(0, 0, "Speed [rpm]").unwrap();
    for row in 0..1_000 {
        sheet.write(row, 16_383, 1.0).unwrap();
    }
    let says = refused(&folder, &folder.write("far.xlsx", book.save_to_buffer().unwrap()), &[]);
    assert_says(&says, &["far.xlsx: sheet \"Sheet1\"", "row 977, column 16384", "without cells far off"]);
}

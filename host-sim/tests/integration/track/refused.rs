//! Records and tracks that are refused, each in one sentence that names the file and the row.

use rotor_edge::sample;

use super::Case;
use crate::program::{refusal, rotor_edge};

#[test]
fn records_that_cannot_be_followed_are_refused_in_one_sentence() {
    let case = Case::turbine();
    let record = |name: &str, text: String| {
        let path = case.path(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let track = |record: &str| refusal(&["track", &case.rotor, record, "--method", "adaptive"]);
    let lines: Vec<&str> = sample::RECORD.lines().collect();
    let part = |rows: std::ops::Range<usize>| [&lines[..1], &lines[rows]].concat().join("\n");
    let wide = refusal(&["track", &case.rotor, &case.record, "--growth", "1e300"]);
    assert!(wide.contains("--growth") && wide.contains("at most 100"), "{wide}");
    let few = track(&record("few.csv", part(1..7)));
    assert!(few.contains("6 complete readings") && few.contains("at least 10"), "{few}");
    let begin = |record: &str, begin: &str| rotor_edge(&["track", &case.rotor, record, "--begin", begin]);
    let said = |output: std::process::Output| String::from_utf8(output.stderr).unwrap();
    let odd = said(begin(&case.record, "yesterday"));
    assert!(odd.contains("yesterday\" is no moment, expected one as in 2024-03-01"), "{odd}");
    let undated: Vec<&str> = lines.iter().take(60).map(|line| line.split_once(',').unwrap().1).collect();
    let undated = said(begin(&record("undated.csv", undated.join("\n")), "2024-03-01"));
    assert!(undated.contains("undated.csv: there is no column time_d"), "{undated}");
    let second = lines[1].split_once(',').unwrap().1;
    let same: Vec<String> = (0..40).map(|day| format!("{day},{second}")).collect();
    let constant = track(&record("constant.csv", format!("{}\n{}", lines[0], same.join("\n"))));
    assert!(constant.contains("15X") && constant.contains("stuck"), "{constant}");
    let cells = |row: usize| lines[row].split(',').collect::<Vec<_>>();
    let with = |row: usize, column: usize, value: &str| {
        let mut cells = cells(row);
        cells[column] = value;
        [&lines[..row], &[cells.join(",").as_str()], &lines[row + 1..60]].concat().join("\n")
    };
    let day = |row: usize| cells(row)[0];
    let twice = track(&record("twice.csv", with(20, 0, day(19))));
    assert!(twice.contains("twice.csv: row 21") && twice.contains("is there twice"), "{twice}");
    let back = track(&record("back.csv", with(20, 0, day(3))));
    assert!(back.contains("back.csv: row 21: time_d goes back"), "{back}");
    let condition = |name: &str, value: &str| {
        let row = |(k, line): (usize, &&str)| format!("{line},{}", if k == 0 { name } else { value });
        track(&record(
            "condition.csv",
            lines[..60].iter().enumerate().map(row).collect::<Vec<_>>().join("\n"),
        ))
    };
    let unknown = condition("oil_temperature", "45");
    assert!(unknown.contains("oil_temperature has no unit that is known"), "{unknown}");
    let text = condition("oil_temperature_degc", "warm");
    assert!(text.contains("row 2, column oil_temperature_degc: \"warm\" is not a number"), "{text}");
    let cold = condition("oil_temperature_degc", "-300");
    assert!(cold.contains("-300 °C is below absolute zero"), "{cold}");
    let outage = |ends: &str, method: &str| {
        refusal(&["track", &case.rotor, &case.record, "--method", method, "--outage", ends])
    };
    let other = outage("60..120", "adaptive");
    assert!(other.contains("--outage is for --method joint"), "{other}");
    let turned = outage("120..60", "joint");
    assert!(turned.contains("--outage 120..60: expected the earlier end first"), "{turned}");
    let undated = outage("2026-03-01..2026-04-01", "joint");
    assert!(undated.contains("the record has no dates; say with --begin"), "{undated}");
    let outside = outage("60..1200", "joint");
    assert!(outside.contains("is none of this record; expected two ascending days from 0"), "{outside}");
    let mixed = track(&record("mixed.csv", with(20, 0, "2026-03-01T06:00:00Z")));
    assert!(mixed.contains("mixed.csv: row 21, column time_d") && mixed.contains("mixed"), "{mixed}");
    let repeated = |from: usize| {
        let held = cells(from)[2..].join(",");
        let again = |row: usize| format!("{},{},{held}", cells(row)[0], cells(row)[1]);
        let frozen: Vec<String> = (from..from + 6).map(again).collect();
        [lines[..from].join("\n"), frozen.join("\n"), lines[from + 6..60].join("\n")].join("\n")
    };
    let froze = track(&record("froze.csv", repeated(30)));
    assert!(
        froze.contains("froze.csv: row 31: the values of probe 15X") && froze.contains("until row 36"),
        "{froze}"
    );
    let turned = |row: usize| {
        let mut own: Vec<String> = cells(row).iter().map(ToString::to_string).collect();
        for pair in own[2..].chunks_mut(2) {
            let [cos, sin] = [0, 1].map(|k| pair[k].parse::<f64>().unwrap_or(f64::NAN));
            let (by_sin, by_cos) = 40_f64.to_radians().sin_cos();
            // a lost reading stays lost
            if cos.is_finite() {
                pair[0] = (cos * by_cos + sin * by_sin).to_string();
                pair[1] = (sin * by_cos - cos * by_sin).to_string();
            }
        }
        own.join(",")
    };
    let moved: Vec<String> = (40..90).map(turned).collect();
    let moved = track(&record("moved.csv", format!("{}\n{}", lines[..40].join("\n"), moved.join("\n"))));
    assert!(moved.contains("moved.csv: row 41") && moved.contains("keyphasor"), "{moved}");
    let after =
        refusal(&["track", &case.rotor, &record("after.csv", part(130..200)), "--runup", &case.runup]);
    assert!(after.contains("begins before the event"), "{after}");
    let odd = refusal(&["track", &case.rotor, &case.record, "--growth", "0.5"]);
    assert!(odd.contains("--growth") && odd.contains("at least 1"), "{odd}");
    let later = refusal(&["track", &case.rotor, &case.record, "--later-runup", &case.runup]);
    assert!(later.contains("--method joint"), "{later}");
}

#[test]
fn tracks_that_cannot_be_forecast_are_refused_in_one_sentence() {
    let case = Case::turbine();
    let head = "time_d,static_g_mm,static_deg,dynamic_g_mm,dynamic_deg\n";
    let track = |name: &str, rows: &mut dyn Iterator<Item = String>| {
        let path = case.path(name);
        std::fs::write(&path, format!("{head}{}", rows.collect::<String>())).unwrap();
        path
    };
    let wave = |day: u32| format!("{day},{},10,20,{}\n", 400.0 + f64::from(day % 9), f64::from(day % 5));
    let short = refusal(&["forecast", &track("short.csv", &mut (0..40).map(wave))]);
    assert!(short.contains("40 days"), "{short}");
    let gap = refusal(&["forecast", &track("gap.csv", &mut (0..100).chain(130..200).map(wave))]);
    assert!(gap.contains("no estimate from day 99 to day 130"), "{gap}");
    let constant = track("constant.csv", &mut (0..200).map(|day| format!("{day},400,10,20,30\n")));
    let constant = refusal(&["forecast", &constant]);
    assert!(constant.contains("U_g is the same on every day"), "{constant}");
    let long = track("long.csv", &mut (0..200).map(wave));
    let order = refusal(&["forecast", &long, "--order", "30,1,3"]);
    assert!(order.contains("ARIMA(30,1,3)") && order.contains("up to 8"), "{order}");
    assert_eq!(rotor_edge(&["forecast", &long, "--order", "3,1"]).status.code(), Some(2));
    if !cfg!(feature = "lstm") {
        let lstm = refusal(&["forecast", &long, "--model", "lstm"]);
        assert!(lstm.contains("--features lstm"), "{lstm}");
    }
}

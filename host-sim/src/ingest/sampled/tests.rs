use super::*;
use crate::ingest::unit::Unit;

fn read_text(text: &str) -> Result<Waveform> {
    of_text(&Text::of("a.csv", text.as_bytes().to_vec())?.without_comments())
}

fn values(waveform: &Waveform, channel: usize) -> &[f64] {
    let Samples::Values(values) = &waveform.channels[channel].samples else { panic!("counts") };
    values
}

fn headers(waveform: &Waveform) -> Vec<&str> {
    waveform.channels.iter().map(|c| c.header.as_str()).collect()
}

#[test]
fn separators_decimals_and_the_rate_are_told_from_the_file() {
    let waveform =
        read_text("# made by a logger, v2\ntime_s;15X;kph\n0;-9,5;0\n0,5e-3;-9,25;1\n0,001;-9;0\n").unwrap();
    assert!((waveform.rate_hz.unwrap() - 2000.0).abs() < 1e-9);
    assert_eq!((waveform.channels[0].number, values(&waveform, 0)), (2, &[-9.5, -9.25, -9.0][..]));
    let three_digits = read_text("a;kph\n-9,125;0,001\n-9,250;0.002\n").unwrap();
    assert_eq!(values(&three_digits, 0), [-9.125, -9.25]);
    assert_eq!(values(&three_digits, 1), [0.001, 0.002], "a point is never thousands");
}

#[test]
fn a_lost_row_a_cell_of_text_and_a_missing_header_are_named() {
    let lost = read_text("time_s,a\n0,1\n1,1\n2,1\n4,1\n5,1\n").unwrap();
    assert_eq!(lost.rate_hz, None);
    let uneven = lost.uneven.unwrap();
    assert!(uneven.contains("sample 4, column time_s: goes from 2 to 4"), "{uneven}");
    for (text, says) in [
        ("a,b\n1,2\n1,x\n", "row 3, column b: \"x\" is not a number"),
        ("a,b\nx,y\n", "row 2, column a: \"x\" is not a number"),
        ("a,b\n1,2\n1\n", "row 3 has 1 cells, the header has 2"),
        ("a,b\n1,2\n1,2,3\n", "row 3 has 3 cells, the header has 2"),
        ("1,2\n1,2\n", "holds the number 1, expected a header"),
    ] {
        let error = read_text(text).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn time_columns_of_other_programs_give_the_rate_and_no_channel() {
    for (text, rate_hz) in [
        ("Time [ms],PX,kph\n0,1,0\n0.5,2,0\n1.0,3,0\n", 2000.0),
        ("Time (s);PX;kph\n0,000;1;0\n0,001;2;0\n", 1000.0),
        ("Zeit;PX;kph\nms;V;V\n0;1;0\n0,5;2;0\n", 2000.0),
        ("Timestamp,PX,kph\n2025-03-04 10:00:00.000,1,0\n2025-03-04 10:00:00.004,2,0\n", 250.0),
        ("Time,PX,kph\n0,1,0\n0.01,2,0\n", 100.0),
        ("Time,PX,kph\n(us),(mV),(V)\n\n0,1,0\n10,2,0\n", 1e5),
        ("Time [ns],PX,kph\n0,1,0\n500,2,0\n", 2e6),
        ("time_us,PX,kph\n0,1,0\n500,2,0\n", 2000.0),
        ("Time,PX,kph\n1709649015000000000,1,0\n1709649015001024000,2,0\n", 976.5625),
        ("unix,PX,kph\n1709649015000000,1,0\n1709649015001000,2,0\n", 1000.0),
        ("Time,PX,kph\n23:59:59.996,1,0\n00:00:00.000,2,0\n00:00:00.004,2,0\n", 250.0),
        ("# fs = 2000\nPX,kph\n1,0\n2,0\n", 2000.0),
        ("CH1(V),CH2(V),t0 =-1.5s, tInc = 5e-4,\n1,0,,,\n2,0,,,\n", 2000.0),
        ("  Time   PX  kph\n 0.0000  1.0   0\n 0.0005 -2.0   0\n", 2000.0),
    ] {
        let waveform = read_text(text).unwrap();
        let names = headers(&waveform);
        assert!(names == ["PX", "kph"] || names == ["CH1(V)", "CH2(V)"], "{text}: {names:?}");
        assert!((waveform.rate_hz.unwrap() / rate_hz - 1.0).abs() < 1e-9, "{text}: {waveform:?}");
    }
}

#[test]
fn lines_above_the_header_and_comments_beside_it_are_left() {
    let text = "LabVIEW Measurement\nSeparator,Comma\nDate,2025/03/04\n***End_of_Header***\n\
                X_Value,PX,kph,Comment\n0.000,1,0\n0.001,2,0,restart\n0.002,3,0\n";
    let waveform = read_text(text).unwrap();
    assert_eq!(headers(&waveform), ["PX", "kph"]);
    assert_eq!(values(&waveform, 0), [1.0, 2.0, 3.0]);
    assert!((waveform.rate_hz.unwrap() - 1000.0).abs() < 1e-9);
}

#[test]
fn date_and_clock_in_two_columns_give_the_rate() {
    let row = |n: u32| format!("2025-03-04,10:00:00.{:03},{n},0\n", 4 * n);
    let text = ["Date,Time,PX,kph\n".to_string()].into_iter().chain((0..20).map(row));
    let waveform = read_text(&text.collect::<String>()).unwrap();
    assert_eq!(headers(&waveform), ["PX", "kph"]);
    assert!((waveform.rate_hz.unwrap() - 250.0).abs() < 1e-6);
}

#[test]
fn preamble_with_a_number_for_each_channel_is_no_table() {
    let text = "Model,MSO4054\nSample Interval,5e-4,,\nProbe Attenuation,1,1\nVertical Units,V,V\n\
                Vertical Offset,0,0\nVertical Scale,5,1\nVertical Position,0,0\n,,\nLabel,PX,KPH\n\
                TIME,CH1,CH2\n0,1,0\n0.0005,2,0\n0.001,3,0\n0.0015,4,5\n";
    let waveform = read_text(text).unwrap();
    assert_eq!((headers(&waveform), values(&waveform, 0)), (vec!["CH1", "CH2"], &[1.0, 2.0, 3.0, 4.0][..]));
}

#[test]
fn preamble_beside_the_samples_is_no_column() {
    let text = "Record Length,4,,0.0000,1.0,\nSample Interval,5e-4,,0.0005,2.0,\nSource,CH1,,0.001,3.0,\n\
                ,,,0.0015,4.0,\n";
    let waveform = read_text(text).unwrap();
    assert_eq!((headers(&waveform), values(&waveform, 0)), (vec!["CH1"], &[1.0, 2.0, 3.0, 4.0][..]));
    assert!((waveform.rate_hz.unwrap() - 2000.0).abs() < 1e-6);
}

#[test]
fn lost_samples_are_counted_and_no_rate_is_advised() {
    let text: String = (0..40).filter(|n| *n < 20 || *n > 22).map(|n| format!("{n},{n}.5\n")).collect();
    let uneven = read_text(&format!("time_ms,PX\n{text}")).unwrap().uneven.unwrap();
    assert!(uneven.contains("4 steps at once; 3 samples are lost in all"), "{uneven}");
    assert!(!uneven.contains("--rate-hz"), "{uneven}");
}

#[test]
fn texts_of_another_kind_are_refused_by_their_widths() {
    let commas = ",".repeat(100_000);
    let error = read_text(&commas).unwrap_err().to_string();
    assert!(
        error.contains("a.csv: row 1 has 100001 cells, expected at most 65536: a row for each sample"),
        "{error}"
    );
    let error = read_text(&"a".repeat(200_000)).unwrap_err().to_string();
    assert!(error.contains("a.csv: row 1 has a cell of 200000 characters"), "{error}");
}

#[test]
fn names_lose_their_unit_unless_two_would_be_one() {
    let waveform = read_text("15X [V],15Y [mV],Speed [rpm],kph [V]\n1,2,3,4\n1,2,3,4\n").unwrap();
    let names: Vec<&str> = waveform.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["15X", "15Y", "Speed [rpm]", "kph"]);
    assert_eq!(waveform.channels[1].unit, Some(Unit::Millivolt));
    assert_eq!(waveform.channels.iter().filter(|c| c.is_speed).count(), 1);
    let alike = read_text("DE (V),DE (g),kph\n1,2,3\n1,2,3\n").unwrap();
    assert_eq!(alike.channels[0].name, "DE (V)");
    assert!(alike.channel("de (g)", "--channel").is_ok());
}

#[test]
fn sheets_of_samples_are_read_as_text_is() {
    let texts = |number: usize, cells: &[&str]| SheetRow {
        number,
        cells: cells.iter().map(|cell| Cell::copied(cell)).collect(),
    };
    let numbers = |number: usize, cells: &[f64]| SheetRow {
        number,
        cells: cells.iter().map(|x| Cell::Number(*x)).collect(),
    };
    let rows = [
        texts(1, &["Run-up"]),
        texts(3, &["Time", "15X", "kph"]),
        texts(4, &["ms", "V", "V"]),
        numbers(5, &[0.0, -9.5, 0.0]),
        numbers(6, &[0.5, -9.25, 1.0]),
    ];
    let at = header_row(&rows, DECIMAL).unwrap();
    let waveform = of_rows("a.xlsx", &rows, at).unwrap();
    assert_eq!((waveform.rate_hz, values(&waveform, 0)), (Some(2000.0), &[-9.5, -9.25][..]));
}

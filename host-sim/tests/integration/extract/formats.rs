//! The same samples in files of every kind that is read.

use super::*;

#[test]
fn csv_vectors_equal_least_squares_fit_and_closed_form() {
    let folder = Folder::new();
    let recording = Recording::default();
    let file = folder.write("a.csv", recording.csv());
    let (answer, readings) = run(&folder, &file, &DC);
    assert!(readings.len() > 5);
    assert_eq!(answer["files"][0]["channels"][1], serde_json::json!({"probe": "15Y", "channel": "15Y"}));
    for probe in 0..4 {
        let expected = Recording::phasor_um(probe);
        let fitted = least_squares_um(&recording, probe);
        assert!((fitted - expected).norm() < 1e-9 * expected.norm());
        // 16 bits over the range that the channels use, 1.4 V, are 0.003 µm a count
        assert!(miss(&readings, probe, fitted) < 1e-5, "{probe}: {:.1e}", miss(&readings, probe, fitted));
        let gap_v = readings[0].gaps_v[probe].unwrap();
        assert!((gap_v - Recording::GAP_V).abs() < 1e-4, "{gap_v}");
    }
    for reading in &readings {
        assert!((reading.speed_rpm / recording.speed_rpm - 1.0).abs() < 1e-6);
    }
    // a window of 16 turns, its middle 8 turns before its end, from the second mark on
    let turn_d = 60.0 / recording.speed_rpm / 86_400.0;
    let [first, second] = [&readings[0], &readings[1]].map(|r| r.time_d.unwrap());
    assert!(((second - first) / (16.0 * turn_d) - 1.0).abs() < 1e-3);
    assert!(first > 8.0 * turn_d && first < 11.0 * turn_d);
}

#[test]
fn arrays_of_numpy_give_what_the_csv_of_the_same_numbers_gives() {
    use npyz::WriterBuilder as _;
    let folder = Folder::new();
    let recording = Recording::default();
    let csv = folder.write("a.csv", recording.csv());
    let known = run(&folder, &csv, &DC).1;
    let array = |shape: &[u64], values: Vec<f64>| {
        let mut bytes = Vec::new();
        let mut writer =
            npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut bytes).begin_nd().unwrap();
        writer.extend(values).unwrap();
        writer.finish().unwrap();
        bytes
    };
    let samples = recording.samples();
    let row =
        |n: usize| [0, 1, 2, 3].map(|probe| recording.volts(probe, n)).into_iter().chain([recording.key(n)]);
    let npy = folder.write("a.npy", array(&[samples as u64, 5], (0..samples).flat_map(row).collect()));
    let numbered = ["--rate-hz", "20000", "--keyphasor", "5"];
    let as_npy = run(&folder, &npy, &[&DC[..], &numbered].concat());
    assert_eq!(as_npy.0["files"][0]["channels"][3]["probe"], "4");
    let file = std::fs::File::create(folder.path("a.npz")).unwrap();
    let mut archive = zip::ZipWriter::new(file);
    let mut add = |name: &str, shape: &[u64], values: Vec<f64>| {
        archive.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).unwrap();
        std::io::Write::write_all(&mut archive, &array(shape, values)).unwrap();
    };
    let all = |value: &dyn Fn(usize) -> f64| (0..samples).map(value).collect::<Vec<_>>();
    for probe in 0..4 {
        add(NAMES[probe], &[samples as u64], all(&|n| recording.volts(probe, n)));
    }
    add("kph", &[samples as u64], all(&|n| recording.key(n)));
    add("rate_hz", &[], vec![20_000.0]);
    archive.finish().unwrap();
    let as_npz = run(&folder, &folder.text("a.npz"), &DC);
    assert_eq!(as_npz.0["files"][0]["channels"][3]["probe"], "16Y");
    for readings in [as_npy.1, as_npz.1] {
        assert_eq!(readings.len(), known.len());
        for (reading, known) in readings.iter().zip(&known) {
            assert_eq!((&reading.probes, &reading.gaps_v), (&known.probes, &known.gaps_v));
        }
    }
}

#[test]
fn headers_with_units_give_what_the_bare_csv_gives() {
    let folder = Folder::new();
    let recording = Recording { seconds: 0.3, ..Recording::default() };
    let text = recording.csv();
    let known = run(&folder, &folder.write("a.csv", text.as_bytes()), &DC).1;
    let body = text.split_once('\n').unwrap().1;
    let headed = format!("Made by a logger\nTime (s),15X [V],15Y [V],16X [V],16Y [V],kph [V]\n{body}");
    let (answer, readings) = run(&folder, &folder.write("units.csv", headed.as_bytes()), &DC);
    assert_eq!(answer["files"][0]["channels"][1], serde_json::json!({"probe": "15Y", "channel": "15Y [V]"}));
    assert_eq!(readings, known);
    for name in ["Time (s)", "time (S)"] {
        let file = folder.write("units.csv", headed.as_bytes());
        assert_eq!(
            run(&folder, &file, &[&DC[..], &["--time", name]].concat()).1,
            known,
            "the times by their name"
        );
    }
    let mixed = headed.replace("15Y [V]", "15Y [mV]");
    let says = refused(&folder, &folder.write("mixed.csv", mixed.as_bytes()), &DC);
    assert_says(&says, &["mixed.csv: channel 15Y [mV] is in mV, --unit is V, expected --unit"]);
}

#[test]
fn scipy_mat_gives_known_vectors_and_its_counts_equal_wav() {
    let folder = Folder::new();
    let options = |more: &[&'static str]| [&DC[..], &["--revolutions", "4"], more].concat();
    let named = ["15X=Brg15X", "15Y=Brg15Y", "16X=Brg16X", "16Y=Brg16Y"];
    let channels: Vec<&str> = named.iter().flat_map(|stated| ["--channel", stated]).collect();
    let (answer, readings) = run(&folder, VOLTS_MAT, &options(&channels));
    assert_eq!((&answer["files"][0]["rate_hz"], readings.len()), (&20_000.0.into(), 1));
    for probe in 0..4 {
        // single precision of 9.5 V is 1e-6 of the 0.4 V that vibrate
        let miss = miss(&readings, probe, Recording::phasor_um(probe));
        assert!(miss < 1e-5, "{probe}: {miss:.1e}");
    }
    let recording = Recording { seconds: 0.05, ..Recording::default() };
    let frames =
        |n| [0, 1, 2, 3].map(|probe| recording.volts(probe, n)).into_iter().chain([recording.key(n)]);
    let wav = folder.text("counts.wav");
    let counts = (0..recording.samples()).flat_map(frames).map(|v| (v / COUNT_V).round() as i32);
    write_wav(&wav, 16, counts, SampleFormat::Int);
    let of_counts = ["--full-scale", "24", "--rate-hz", "20000", "--keyphasor"];
    let from_wav = run(&folder, &wav, &options(&[&of_counts[..], &["5"]].concat())).1;
    let from_mat = run(&folder, COUNTS_MAT, &options(&[&of_counts[..], &["ch.5"]].concat())).1;
    assert_eq!((from_mat.len(), &from_mat), (1, &from_wav));
}

#[test]
fn wav_of_24_bits_and_floats_equals_csv_within_resolution() {
    let folder = Folder::new();
    let recording = Recording { seconds: 0.3, ..Recording::default() };
    let known = run(&folder, &folder.write("a.csv", recording.csv()), &DC).1;
    let options = [&DC[..], &["--full-scale", "24", "--keyphasor", "5"]].concat();
    let row = |n| [0, 1, 2, 3].map(|probe| recording.volts(probe, n)).into_iter().chain([recording.key(n)]);
    let all = || (0..recording.samples()).flat_map(row);
    let wav = folder.text("a.wav");
    write_wav(&wav, 24, all().map(|v| (v / 24.0 * f64::from(1 << 23)).round() as i32), SampleFormat::Int);
    let of_24_bits = run(&folder, &wav, &options).1;
    let floats = folder.text("floats.wav");
    write_wav(&floats, 32, all().map(|v| (v / 24.0) as f32), SampleFormat::Float);
    let of_floats = run(&folder, &floats, &options).1;
    for (readings, resolution_v) in
        [(of_24_bits, 24.0 / f64::from(1 << 23)), (of_floats, 24.0 * 2.0_f64.powi(-25))]
    {
        assert_eq!(readings.len(), known.len());
        for (reading, known) in readings.iter().zip(&known) {
            for probe in 0..4 {
                let um = 1e6 * (reading.probes[probe].unwrap() - known.probes[probe].unwrap()).norm();
                // a step of the file and one of the 16 bits over the 1.4 V of the channels
                let step_um = 1e3 * (resolution_v + 1.4 / 64_000.0) / Recording::MV_UM.abs();
                assert!(um < step_um, "{um} {step_um}");
                let gap_v = reading.gaps_v[probe].unwrap() - known.gaps_v[probe].unwrap();
                assert!(gap_v.abs() < resolution_v + 1.4 / 64_000.0, "{gap_v}");
            }
        }
    }
}

#[test]
fn preambles_of_other_systems_give_what_the_bare_csv_gives() {
    let folder = Folder::new();
    let recording = Recording { seconds: 0.3, ..Recording::default() };
    let known = run(&folder, &folder.write("a.csv", recording.csv()), &DC).1;
    let text = recording.csv();
    let row = |line: &str| line.split(',').map(str::to_string).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = text.lines().skip(1).map(row).collect();
    let body = |separator: &str, time: &dyn Fn(usize) -> String| -> String {
        let line = |(n, row): (usize, &Vec<String>)| [&[time(n)], &row[1..]].concat().join(separator) + "\n";
        rows.iter().enumerate().map(line).collect()
    };
    let seconds = |n: usize| rows[n][0].clone();
    let none = |_: usize| String::new();
    let number = |n: usize| n.to_string();
    let ms = |n: usize| (0.05 * n as f64).to_string();
    let key = ["--keyphasor", "kph"];
    for (name, head, separator, time, key) in [
        (
            "keysight.csv",
            "x-axis,1,2,3,4,5\nsecond,Volt,Volt,Volt,Volt,Volt\n",
            ",",
            &seconds as &dyn Fn(usize) -> String,
            ["--keyphasor", "5"],
        ),
        ("pico.csv", "Time,A,B,C,D,kph\n(ms),(V),(V),(V),(V),(V)\n\n", ",", &ms, key),
        (
            "tek.csv",
            "Model,MSO24\nHorizontal Units,s\nSample Interval,5.0E-5\nProbe Attenuation,1,1\n,,\nLabel,,\nTIME,A,B,C,D,kph\n",
            ",",
            &seconds,
            key,
        ),
        (
            "rigol.csv",
            "X,A,B,C,D,kph,Start,Increment\nSequence,Volt,Volt,Volt,Volt,Volt,0.0,5.0e-05\n",
            ",",
            &number,
            key,
        ),
        (
            "a.lvm",
            "LabVIEW Measurement\t\nX_Columns\tNo\n***End_of_Header***\t\nChannels\t2\nX_Dimension\tTime\tTime\n\
             X0\t0.0\t0.0\nDelta_X\t0.00005\t0.00005\n***End_of_Header***\t\t\nX_Value\tA\tB\tC\tD\tkph\tComment\n",
            "\t",
            &none,
            key,
        ),
    ] {
        let file = folder.write(name, format!("{head}{}", body(separator, time)));
        let (answer, readings) = run(&folder, &file, &[&DC[..], &key].concat());
        assert!((answer["files"][0]["rate_hz"].as_f64().unwrap() / 20_000.0 - 1.0).abs() < 1e-6, "{name}");
        assert_eq!(answer["files"][0]["channels"].as_array().unwrap().len(), 4, "{name}: {answer}");
        for (reading, known) in readings.iter().zip(&known) {
            assert!((reading.probes[2].unwrap() - known.probes[2].unwrap()).norm() < 1e-11, "{name}");
        }
        assert_eq!(readings.len(), known.len(), "{name}");
    }
}

#[test]
fn synchronous_samples_need_no_keyphasor() {
    let folder = Folder::new();
    let turn = |k: u32| TAU * f64::from(k) / 64.0;
    let phase = 140_f64.to_radians();
    let um = |k: u32| 10.5 * (turn(k) - phase).cos() + 2.0 * (2.0 * turn(k)).cos() - 3.0;
    let body: String =
        (0..512).map(|k| format!("{:.4},{:.6}\n", f64::from(k) * 12.0 / 64.0, um(k))).collect();
    let head = "Point Name,31VT-4101X\nNumber of Revs,8\nX-Axis Unit,ms\nY-Axis Unit,µm\nSample Speed, 5000 rpm\n\
                Variable,Disp Wf(64X/8revs)\nX-Axis Value,Y-Axis Value\n";
    let stated = folder.write("a.csv", format!("{head}{body}"));
    let bare = folder.write("bare.csv", format!("time_ms,31VT-4101X\n{body}"));
    let options = ["--unit", "um", "--samples-per-turn", "64"];
    for (file, options) in [(stated, &[][..]), (bare, &options)] {
        let (answer, readings) = run(&folder, &file, options);
        assert_eq!((readings.len(), &answer["lost"]), (1, &0.into()), "{answer}");
        assert_eq!(answer["files"][0]["channels"][0]["probe"], "31VT-4101X");
        let expected = Complex::from_polar(10.5, -phase);
        assert!(miss(&readings, 0, expected) < 1e-4, "{:?}", readings[0].probes);
        assert!((readings[0].speed_rpm / 5000.0 - 1.0).abs() < 1e-3, "{}", readings[0].speed_rpm);
        // eight turns of 12 ms from the beginning on
        assert!((readings[0].time_d.unwrap() * 86_400.0 / 0.048 - 1.0).abs() < 1e-2);
    }
}

#[test]
fn float_wav_is_in_volts_or_fractions_of_full_scale() {
    let folder = Folder::new();
    let recording = Recording { seconds: 0.3, ..Recording::default() };
    let known = run(&folder, &folder.write("a.csv", recording.csv()), &DC).1;
    let row = |n| [0, 1, 2, 3].map(|probe| recording.volts(probe, n)).into_iter().chain([recording.key(n)]);
    let all = || (0..recording.samples()).flat_map(row);
    let volts = folder.text("volts.wav");
    write_wav(&volts, 32, all().map(|v| v as f32), SampleFormat::Float);
    let readings = run(&folder, &volts, &[&DC[..], &["--keyphasor", "5"]].concat()).1;
    assert!(miss(&readings, 1, 1e6 * known[0].probes[1].unwrap()) < 1e-5);
    let fractions = folder.text("fractions.wav");
    write_wav(&fractions, 32, all().map(|v| (v / 24.0) as f32), SampleFormat::Float);
    let says = refused(&folder, &fractions, &[&DC[..], &["--keyphasor", "5"]].concat());
    assert_says(
        &says,
        &["fractions.wav: holds floats within ±1, expected --full-scale with the value of 1.0"],
    );
}

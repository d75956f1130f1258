//! `extract` as a user meets it: waveforms become the readings that the controller would send, or are refused.

mod beside;
mod formats;
mod keyphasor;
mod recording;
mod sign;

use std::f64::consts::TAU;

use crate::import::truth::{Folder, measured};
use crate::program::{assert_says, json, refusal, rotor_edge};
use hound::SampleFormat;
use nalgebra::Complex;
use recording::{NAMES, Recording, least_squares_um};
use rotor_edge_core::extraction::{Converter, Extraction, ExtractionConfig, Extractor, KeyphasorDetector};
use rotor_edge_core::reading::Keyphasor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;

const DC: [&str; 2] = ["--mv-um", "7.87"];
/// Written by SciPy, see tests/reference/make_mat.py.
const VOLTS_MAT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/extract/volts.mat");
const COUNTS_MAT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/extract/counts.mat");
/// Of 16 bits over 24 V either way.
const COUNT_V: f64 = 24.0 / 32_768.0;

/// A WAV of five channels at 20 kHz.
fn write_wav<S: hound::Sample>(
    path: &str,
    bits_per_sample: u16,
    samples: impl Iterator<Item = S>,
    sample_format: SampleFormat,
) {
    let spec = hound::WavSpec { channels: 5, sample_rate: 20_000, bits_per_sample, sample_format };
    let mut writer = hound::WavWriter::create(path, spec).unwrap();
    samples.for_each(|sample| writer.write_sample(sample).unwrap());
    writer.finalize().unwrap();
}

/// What an extraction prints and writes.
fn run(folder: &Folder, file: &str, options: &[&str]) -> (serde_json::Value, Vec<Reading>) {
    let output = folder.text("measured.csv");
    let answer =
        json(&rotor_edge(&[&["extract", file, "-o", &output, "--json", "--force"], options].concat()));
    let (_, readings) = measured(&folder.path("measured.csv"));
    assert_eq!(answer["readings"], readings.len());
    (answer, readings)
}

/// The one sentence that an extraction fails with, which leaves nothing behind.
#[track_caller]
fn refused(folder: &Folder, file: &str, options: &[&str]) -> String {
    let before = folder.names();
    let output = folder.text("out.csv");
    let says = refusal(&[&["extract", file, "-o", &output], options].concat());
    assert_eq!(folder.names(), before, "nothing half-written");
    says
}

/// The largest distance of a probe's readings from a phasor, relative.
fn miss(readings: &[Reading], probe: usize, expected_um: Complex<f64>) -> f64 {
    let far = |r: &Reading| (1e6 * r.probes[probe].unwrap() - expected_um).norm() / expected_um.norm();
    readings.iter().map(far).fold(0.0, f64::max)
}

/// All that the core makes of counts by itself; the last channel is the keyphasor.
fn by_hand(
    config: ExtractionConfig<4>,
    frames: &[[i16; 5]],
    threshold: i16,
    hysteresis: i16,
) -> Vec<Extraction<4>> {
    let mut detector = KeyphasorDetector::new(threshold.into(), hysteresis.into());
    let mut extractor = Extractor::new(config).unwrap();
    let mut push = |[a, b, c, d, key]: [i32; 5]| extractor.push([a, b, c, d], detector.push(key));
    frames.iter().filter_map(|frame| push(frame.map(i32::from))).collect()
}

#[test]
fn wav_counts_of_six_probes_equal_core_to_the_bit() {
    let folder = Folder::new();
    let recording = Recording::default();
    let (full_scale_v, count_v) = (24.0, COUNT_V);
    let frames: Vec<[i16; 5]> = (0..recording.samples())
        .map(|n| {
            let volts = |probe: usize| recording.volts(probe, n);
            [volts(0), volts(1), volts(2), volts(3), recording.key(n)].map(|v| (v / count_v).round() as i16)
        })
        .collect();
    let spec = hound::WavSpec {
        channels: 7,
        sample_rate: 20_000,
        bits_per_sample: 16,
        sample_format: SampleFormat::Int,
    };
    let mut writer = hound::WavWriter::create(folder.path("a.wav"), spec).unwrap();
    for [a, b, c, d, key] in &frames {
        // the fifth and the sixth show what the second and the third show
        [a, b, c, d, b, c, key].into_iter().for_each(|count| writer.write_sample(*count).unwrap());
    }
    writer.finalize().unwrap();
    let options = ["--full-scale", "24", "--keyphasor", "7", "--threshold", "-6", "--hysteresis", "1"];
    let (answer, readings) = run(&folder, &folder.text("a.wav"), &[&DC[..], &options].concat());
    let config = ExtractionConfig {
        converter: Converter {
            rails: [i16::MIN.into(), i16::MAX.into()],
            zero_count: 0.0,
            mv_per_count: (1000.0 * full_scale_v / 32_768.0) as f32,
        },
        ..ExtractionConfig::new()
    };
    let known = by_hand(config, &frames, (-6.0 / count_v).round() as i16, (1.0 / count_v).round() as i16);
    assert!(known.len() > 5 && known.iter().all(|e| e.keyphasor == Keyphasor::Locked));
    assert_eq!((readings.len(), &answer["lost"]), (known.len(), &0.into()));
    for (reading, known) in readings.iter().zip(&known) {
        assert_eq!((reading.speed_rpm as f32).to_bits(), known.reading.speed_rpm.to_bits());
        for (probe, same) in [0, 1, 2, 3, 1, 2].into_iter().enumerate() {
            let (y, expected) = (1e6 * reading.probes[probe].unwrap(), known.reading.probes()[same]);
            assert_eq!((y.re as f32).to_bits(), expected.cos_um.to_bits());
            assert_eq!((-y.im as f32).to_bits(), expected.sin_um.to_bits());
            let gap_v = reading.gaps_v[probe].unwrap();
            assert_eq!((gap_v as f32).to_bits(), known.reading.gaps_v()[same].to_bits());
        }
    }
}

#[test]
fn ac_coupled_channels_are_lost_unless_stated() {
    let folder = Folder::new();
    let recording = Recording::default();
    let without_gap = |_: f64, row: &mut [f64; 5]| row[..4].iter_mut().for_each(|v| *v -= Recording::GAP_V);
    let file = folder.write("a.csv", recording.csv_with(without_gap));
    let says = refused(&folder, &file, &DC);
    assert_says(&says, &["a.csv: every reading is lost", "probe 15X (gap voltage out of range", "--ac"]);
    let (answer, readings) = run(&folder, &file, &["--mv-um", "7.87", "--ac"]);
    assert_eq!(answer["lost"], 0);
    assert!(miss(&readings, 2, Recording::phasor_um(2)) < 1e-5);
    let text = std::fs::read_to_string(folder.path("measured.csv")).unwrap();
    assert!(!text.contains("gap_v"), "{text}");
}

#[test]
fn velocity_and_acceleration_are_integrated_to_displacement() {
    let folder = Folder::new();
    let recording = Recording::default();
    let omega = TAU * recording.speed_rpm / 60.0;
    let i = Complex::<f64>::i();
    for (unit, factor) in [
        ("um", Complex::from(1.0)),
        ("mm/s", i * omega * 1e-3),
        ("m/s2", Complex::from(-omega * omega * 1e-6)),
        ("g", Complex::from(-omega * omega * 1e-6 / 9.806_65)),
    ] {
        let in_unit = |turns: f64, row: &mut [f64; 5]| {
            for (probe, value) in row[..4].iter_mut().enumerate() {
                let y = factor * Recording::phasor_um(probe);
                *value = (y * Complex::from_polar(1.0, TAU * turns)).re;
            }
        };
        let file = folder.write("a.csv", recording.csv_with(in_unit));
        let (_, readings) = run(&folder, &file, &["--unit", unit]);
        for probe in 0..4 {
            let miss = miss(&readings, probe, Recording::phasor_um(probe));
            assert!(miss < 1e-5, "{unit}, probe {probe}: {miss:.1e}");
        }
        assert_says(
            &refused(&folder, &file, &["--unit", unit, "--mv-um", "8"]),
            &["a.csv: --mv-um", "no voltages"],
        );
    }
}

#[test]
fn a_tacho_keeps_its_place_in_the_turn_over_a_missing_pulse() {
    let folder = Folder::new();
    let recording = Recording { speed_rpm: 1000.0, seconds: 4.0, ..Recording::default() };
    let eight = |turns: f64, row: &mut [f64; 5]| {
        let is_missing = (10.45..10.55).contains(&turns);
        row[4] = if is_missing { -10.0 } else { Recording::pulse(8.0 * turns) };
    };
    let file = folder.write("a.csv", recording.csv_with(eight));
    let (answer, readings) = run(&folder, &file, &["--mv-um", "7.87", "--pulses", "8"]);
    assert_eq!((&answer["files"][0]["keyphasor"]["missed_pulses"], &answer["lost"]), (&1.into(), &0.into()));
    assert!(readings.len() >= 3);
    // the recording begins at 0.37 of a turn, and the first pulse is at 3/8
    let turned = Complex::from_polar(1.0, TAU * 3.0 / 8.0);
    for probe in 0..4 {
        let miss = miss(&readings, probe, Recording::phasor_um(probe) * turned);
        assert!(miss < 1e-5, "{probe}: {miss:.1e}");
    }
}

#[test]
fn lost_mark_is_filled_and_clipping_loses_affected_readings() {
    let folder = Folder::new();
    let recording = Recording::default();
    let skips_one = |turns: f64, row: &mut [f64; 5]| {
        if (49.7..50.7).contains(&turns) {
            row[4] = -10.0;
        }
    };
    let whole = run(&folder, &folder.write("a.csv", recording.csv()), &DC).1.len();
    let file = folder.write("a.csv", recording.csv_with(skips_one));
    let (answer, readings) = run(&folder, &file, &DC);
    assert_eq!((answer["lost"].as_u64(), readings.len()), (Some(0), whole), "{answer}");
    assert_eq!(answer["files"][0]["keyphasor"]["filled_marks"], 1);
    assert!((0..4).all(|probe| miss(&readings, probe, Recording::phasor_um(probe)) < 1e-5));

    // small at first, then cut at −9.7 V
    let cut = |turns: f64, row: &mut [f64; 5]| {
        row[1] = if turns > 100.0 { row[1].max(-9.7) } else { -9.5 + 0.2 * (row[1] + 9.5) }
    };
    let file = folder.write("a.csv", recording.csv_with(cut));
    let (answer, readings) = run(&folder, &file, &DC);
    let (why, probe) = (&answer["files"][0]["losses"][0]["why"], &answer["files"][0]["losses"][0]["probe"]);
    assert_eq!(
        (why.as_str(), probe.as_str(), answer["files"][0]["losses"].as_array().unwrap().len()),
        (Some("clipped"), Some("15Y"), 1)
    );
    let lost = readings.iter().filter(|r| r.probes[1].is_none()).count();
    assert_eq!((answer["lost"].as_u64(), readings.len()), (Some(lost as u64), whole));
    assert!(lost > whole / 3 && lost < whole);
    assert!([0, 2, 3].iter().all(|probe| miss(&readings, *probe, Recording::phasor_um(*probe)) < 1e-5));
}

#[test]
fn a_run_up_is_cut_into_bins_of_speed() {
    let folder = Folder::new();
    let recording = Recording { speed_rpm: 2000.0, rise_rpm_s: 100.0, seconds: 4.0, ..Recording::default() };
    let file = folder.write("a.csv", recording.csv());
    let all = run(&folder, &file, &[&DC[..], &["--revolutions", "4"]].concat()).1;
    let binned = run(&folder, &file, &[&DC[..], &["--revolutions", "4", "--bin-rpm", "50"]].concat()).1;
    assert!(all.len() > 30 && (7..=8).contains(&binned.len()), "{} {}", all.len(), binned.len());
    // the last bin ends with the file
    for pair in binned[..binned.len() - 1].windows(2) {
        assert!((40.0..70.0).contains(&(pair[1].speed_rpm - pair[0].speed_rpm)));
        assert!(pair[1].time_d > pair[0].time_d);
    }
    // a hundredth of a degree is 2e-4
    assert!((0..4).all(|probe| miss(&binned, probe, Recording::phasor_um(probe)) < 2e-4));
    let report = folder.text("report.html");
    run(&folder, &file, &[&DC[..], &["--revolutions", "4", "--report", &report]].concat());
    let page = std::fs::read_to_string(report).unwrap();
    assert_says(&page, &["id=\"speed-over-time\"", "id=\"probe-15x\"", "id=\"probe-16y\"", "SHA-256"]);
    assert_says(
        &page,
        &["id=\"orbits-at-15x-and-15y\"", "id=\"orbits-at-16x-and-16y\"", "id=\"centreline-at-15x-and-15y\""],
    );
    let too_fast = refused(&folder, &file, &["--mv-um", "7.87", "--largest-drift", "0.0001"]);
    assert_says(&too_fast, &["every reading is lost", "the speed changed too much within the window"]);
}

#[test]
fn drifting_windows_are_counted_and_suggested_option_keeps_all() {
    let folder = Folder::new();
    let recording = Recording { speed_rpm: 2500.0, rise_rpm_s: 100.0, rate_hz: 5000.0, seconds: 8.0 };
    let file = folder.write("a.csv", recording.csv());
    let (answer, _) = run(&folder, &file, &DC);
    let drifted = &answer["files"][0]["drifted"];
    // from the first turn of sixteen to the last, 15 turns of 24 ms
    let first_change = 15.0 * 100.0 * 60.0 / 2500.0 / 2500.0;
    let largest = drifted["largest"].as_f64().unwrap();
    assert!((0.9 * first_change..1.1 * first_change).contains(&largest), "{largest} {first_change}");
    assert_eq!(drifted["windows"], answer["lost"]);
    let shown = std::fs::read_to_string(folder.path("measured.csv")).unwrap();
    let turns = (16.0 * 0.01 / largest).floor();
    let windows = format!("within {} of {} windows", drifted["windows"], drifted["in_all"]);
    assert_says(&shown, &[&windows, &format!("--revolutions {turns} keeps them")]);
    let all_lost = refused(&folder, &file, &[&DC[..], &["--largest-drift", "0.001"]].concat());
    assert_says(&all_lost, &["every reading is lost", "--largest-drift 0.01", " keeps them"]);
    let (fewer, _) = run(&folder, &file, &[&DC[..], &["--revolutions", &turns.to_string()]].concat());
    assert_eq!((&fewer["lost"], &fewer["files"][0]["drifted"]), (&0.into(), &serde_json::Value::Null));
}

#[test]
fn several_files_become_runs_with_same_vectors_as_alone() {
    let folder = Folder::new();
    let recordings = [11_000.0, 9_000.0].map(|speed_rpm| Recording { speed_rpm, ..Recording::default() });
    let [first, second] = [0, 1].map(|i| folder.write(["first.csv", "second.csv"][i], recordings[i].csv()));
    let alone = [&first, &second].map(|file| run(&folder, file, &DC).1);
    let (answer, together) = run(&folder, &first, &[&[second.as_str()], &DC[..]].concat());
    assert_eq!(
        (&answer["files"][1]["run"], &answer["files"][1]["readings"]),
        (&"second".into(), &alone[1].len().into())
    );
    let names = |name: &'static str, of: &[Reading]| vec![Some(name.to_string()); of.len()];
    let runs: Vec<_> = together.iter().map(|r| r.run.clone()).collect();
    assert_eq!(runs, [names("first", &alone[0]), names("second", &alone[1])].concat());
    for (i, (reading, known)) in together.iter().zip(alone.iter().flatten()).enumerate() {
        assert_eq!((&reading.probes, &reading.gaps_v), (&known.probes, &known.gaps_v));
        let begins_d = if i < alone[0].len() { 0.0 } else { 1.0 / 86_400.0 };
        assert!((reading.time_d.unwrap() - known.time_d.unwrap() - begins_d).abs() < 1e-10);
    }
    let report = folder.text("report.html");
    let named = ["--run", "as found", "--run", "trial", "--report", &report];
    let (_, readings) = run(&folder, &first, &[&[second.as_str()], &DC[..], &named].concat());
    assert_eq!(readings.last().unwrap().run.as_deref(), Some("trial"));
    let page = std::fs::read_to_string(report).unwrap();
    // amplitude and lag in the figure of each probe
    let curves = |run: &str| page.matches(&format!("\"name\":\"{run}\"")).count();
    assert_eq!([curves("as found"), curves("trial")], [8, 8]);

    let other = folder.write("other.csv", recordings[1].csv().replacen("15X", "7X", 1));
    for (more, says) in [
        (&[first.as_str()][..], "two runs are called first, expected --run with a name for each file"),
        (&[&second, "--run", "a"], "--run: names 1 runs, expected one for each of the 2 files"),
        (&[&other], "other.csv: has the probes 7X, 15Y, 16X, 16Y, expected 15X, 15Y, 16X, 16Y as in"),
    ] {
        assert_says(&refused(&folder, &first, &[more, &DC[..]].concat()), &[says]);
    }
}

#[test]
fn rotor_probes_are_matched_to_channels_by_name_or_option() {
    let folder = Folder::new();
    let rotor_path = folder.write("rotor.toml", rotor_edge::sample::ROTOR);
    let rotor = rotor_file::read(rotor_path.as_ref()).unwrap();
    let recording = Recording::default();
    let text = recording.csv().replacen("15X,15Y,16X,16Y", "BRG 15X,BRG 15Y,a,spare", 1);
    let file = folder.write("a.csv", text);
    let of_rotor = [&DC[..], &["--rotor", &rotor_path, "--channel", "16Y=4"]].concat();
    assert_says(
        &refused(&folder, &file, &of_rotor),
        &["a.csv: no channel is named as the probe 16X", "spare"],
    );
    let stated = [&of_rotor[..], &["--channel", "16X=spare"]].concat();
    run(&folder, &file, &stated);
    let readings = measurement::read(&folder.path("measured.csv"), &rotor).unwrap();
    for (probe, shown) in [0, 1, 3, 2].into_iter().enumerate() {
        assert!(miss(&readings, probe, Recording::phasor_um(shown)) < 1e-5, "{}", rotor.probe[probe].name);
    }
    // a vibration that is the same at every speed is refused by compare
    let run_up = Recording { rise_rpm_s: 100.0, ..recording };
    let grows = |turns: f64, row: &mut [f64; 5]| {
        row[..4].iter_mut().for_each(|v| *v += (*v - Recording::GAP_V) * 1e-3 * turns);
    };
    let growing = folder.write("run-up.csv", run_up.csv_with(grows));
    run(&folder, &growing, &[&DC[..], &["--rotor", &rotor_path]].concat());
    json(&rotor_edge(&["compare", &rotor_path, &folder.text("measured.csv"), "--json"]));
    let wrong = [&stated[..], &["--channel", "17X=a"]].concat();
    assert_says(&refused(&folder, &file, &wrong), &["--channel 17X", "15X, 15Y, 16X, 16Y"]);
}

#[test]
fn invalid_waveforms_are_refused_and_nothing_is_overwritten() {
    let folder = Folder::new();
    let recording = Recording { seconds: 0.2, ..Recording::default() };
    let good = folder.write("a.csv", recording.csv());
    let still = folder.write("still.csv", recording.csv_with(|_, row| row[4] = -10.0));
    let says = refused(&folder, &still, &DC);
    assert_says(
        &says,
        &["still.csv: there is no keyphasor: channel kph is -10.000000 throughout", "expected a mark a turn"],
    );
    let beyond = [&DC[..], &["--threshold", "-1"]].concat();
    assert_says(&refused(&folder, &good, &beyond), &["there is no keyphasor", "-1.0"]);
    let text = recording.csv();
    let words = folder.write("words.csv", text.replacen("\n0.00005,", "\n0.00005,n/a", 1));
    assert_says(&refused(&folder, &words, &DC), &["words.csv: row 3, column 15X: \"n/a", "is not a number"]);
    let short = folder.write("short.csv", text.lines().take(400).collect::<Vec<_>>().join("\n"));
    assert_says(&refused(&folder, &short, &DC), &["make no window of 16 turns", "--revolutions"]);
    let whole_mat = std::fs::read(VOLTS_MAT).unwrap();
    let hdf5_mat = [&whole_mat[..124], b"\x00\x02IM", &[0; 400]].concat();
    for (name, bytes, says) in [
        (
            "a.tdms",
            &b"TDSm"[..],
            "a.tdms: the extension names no supported format of waveforms, expected one of .csv, .wav",
        ),
        ("a", b"x", "the extension names no supported format"),
        ("a.wav", b"no wave", "a.wav: cannot be read as WAV"),
        ("a.npy", b"no array", "a.npy: cannot be read as a NumPy array"),
        ("a.npz", b"no archive", "a.npz: cannot be read as a NumPy archive"),
        ("a.mat", &hdf5_mat, "a.mat: is no MATLAB file of level 5 (7.3 is another)"),
        ("cut.mat", &whole_mat[..whole_mat.len() - 9], "cut.mat: cannot be read as a MATLAB file"),
        ("text.mat", &whole_mat[..128], "text.mat: holds no array of real numbers"),
        ("twice.csv", b"a,a,kph\n1,1,1\n", "twice.csv: two channels are called a"),
        ("empty.csv", b"a,kph\n", "there is no sample"),
    ] {
        assert_says(&refused(&folder, &folder.write(name, bytes), &DC), &[says]);
    }
    for (options, says) in [
        (&[][..], "a.csv: states no unit, so the channels count as voltages, expected --mv-um"),
        (&["--unit", "V"], "a.csv: the channels are voltages, expected --mv-um"),
        (&["--mv-um", "9X=7.87"], "a.csv: --mv-um 9X: there is no such probe, expected one of 15X"),
        (&["--mv-um", "15X=7.87"], "has no sensitivity, expected --mv-um"),
        (&["--mv-um", "7.87", "--keyphasor", "7X"], "--keyphasor: no channel is \"7X\", there are 15X"),
        (&["--mv-um", "7.87", "--keyphasor", "15X", "--channel", "15X=2"], "cannot be the probe 15X"),
        (&["--mv-um", "7.87", "--channel", "15X=1", "--channel", "15X=2"], "--channel 15X: is stated twice"),
        (&["--mv-um", "7.87", "--bin-rpm", "0"], "--bin-rpm: expected a positive number"),
        (&["--mv-um", "7.87", "--full-scale", "10"], "--full-scale"),
        (
            &["--mv-um", "7.87", "--rate-hz", "1"],
            "a.csv: --rate-hz 1: a turn at --slowest-rpm 100 would have 0.6 samples, expected 8 to 16,777,216: --rate-hz with",
        ),
        (
            &["--mv-um", "7.87", "--rate-hz", "1e12"],
            "a.csv: --rate-hz 1000000000000: expected at most 1e9 samples",
        ),
        (&["--mv-um", "7.87", "--gap-v", "-2", "-18"], "--gap-v"),
    ] {
        assert_says(&refused(&folder, &good, options), &[says]);
    }
    let output = folder.write("kept.csv", "kept");
    let again = refusal(&["extract", &good, "-o", &output, "--mv-um", "7.87"]);
    assert_says(&again, &["kept.csv: exists already", "--force"]);
    let onto_itself = refusal(&["extract", &good, "-o", &good, "--mv-um", "7.87"]);
    assert_says(&onto_itself, &["a.csv: is read and would be overwritten"]);
    assert_eq!(std::fs::read(&output).unwrap(), b"kept");
}

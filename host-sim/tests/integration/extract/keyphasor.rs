//! Keyphasors as they are found: double triggers, pulses that do not come, wheels, tachos of few samples a turn.

use super::*;

/// The same probe samples with another keyphasor: volts by turns since the mark.
fn file(folder: &Folder, recording: &Recording, key: impl Fn(f64) -> f64) -> String {
    folder.write("a.csv", recording.csv_with(|turns, row| row[4] = key(turns)))
}

/// 5 V for a part of each turn.
fn pulse(turns: f64, from: f64, width: f64) -> f64 {
    if (turns - from).rem_euclid(1.0) < width { 5.0 } else { 0.0 }
}

/// Steep edges place a mark to half a sample of 109: 1.7° of a turn, and 3 % of the vector, at worst.
const HALF_SAMPLE: f64 = 0.03;

#[track_caller]
fn assert_same_vectors(readings: &[Reading], fewest: usize) {
    assert!(readings.len() >= fewest, "{}", readings.len());
    for probe in 0..4 {
        let miss = miss(readings, probe, Recording::phasor_um(probe));
        assert!(miss < HALF_SAMPLE, "{probe}: {miss:.1e}");
    }
}

#[test]
fn false_and_missing_marks_lose_no_reading() {
    let folder = Folder::new();
    let recording = Recording::default();
    let again = |turns: f64, every: f64| {
        let is_false = turns.floor().rem_euclid(every) == 0.0;
        pulse(turns, 0.0, 0.03) + if is_false { pulse(turns, 0.07, 0.03) } else { 0.0 }
    };
    let skips = |turns: f64| if turns.floor().rem_euclid(7.0) == 3.0 { 0.0 } else { pulse(turns, 0.0, 0.03) };
    let spike = |turns: f64| if (20.4..20.41).contains(&turns) { 400.0 } else { pulse(turns, 0.0, 0.03) };
    for (key, name) in [
        (Box::new(|t: f64| again(t, 1.0)) as Box<dyn Fn(f64) -> f64>, "extra_marks"),
        (Box::new(|t: f64| again(t, 5.0)), "extra_marks"),
        (Box::new(skips), "filled_marks"),
        (Box::new(spike), "extra_marks"),
    ] {
        let (answer, readings) = run(&folder, &file(&folder, &recording, key), &DC);
        let told = answer["files"][0]["keyphasor"][name].as_u64().unwrap();
        assert!(answer["lost"] == 0 && told > 0, "{answer}");
        assert_same_vectors(&readings, 11);
    }
}

#[test]
fn no_mark_and_marks_below_the_slowest_speed_name_the_cause() {
    let folder = Folder::new();
    let recording = Recording::default();
    let constant = file(&folder, &recording, |_| 5.0);
    assert_says(&refused(&folder, &constant, &DC), &["a.csv", "channel kph is 5.000000 throughout"]);
    let sound = file(&folder, &recording, |turns| pulse(turns, 0.0, 0.03));
    let says = refused(&folder, &sound, &[&DC[..], &["--slowest-rpm", "100000"]].concat());
    assert_says(&says, &["a.csv", "no mark for the longest turn", "expected --slowest-rpm below"]);
}

#[test]
fn missing_marks_are_bridged_and_told_with_their_share() {
    let folder = Folder::new();
    // steep edges know a mark to a sample, whose error two marks beside a gap share
    let recording = Recording::default();
    let at_random = |turn: f64, one_in: f64| (1e4 * (turn + 1.0).sin()).rem_euclid(1.0) < 1.0 / one_in;
    for (one_in, random) in
        [(3.0, false), (4.0, false), (10.0, false), (3.0, true), (4.0, true), (10.0, true)]
    {
        let is_missing = |turn: f64| match random {
            true => at_random(turn, one_in),
            false => turn.rem_euclid(one_in) == 1.0,
        };
        let key = |t: f64| if is_missing(t.floor()) { 0.0 } else { pulse(t, 0.0, 0.03) };
        let (answer, readings) = run(&folder, &file(&folder, &recording, key), &DC);
        let filled = answer["files"][0]["keyphasor"]["filled_marks"].as_f64().unwrap();
        let in_all = recording.turns(recording.samples()).floor();
        assert!((filled / in_all * one_in - 1.0).abs() < 0.35, "one in {one_in}: {filled} of {in_all}");
        // more than four in a row are a pause, which loses its window
        assert!(answer["lost"].as_u64().unwrap() <= u64::from(random), "{answer}");
        assert_same_vectors(&readings, 10);
    }
    // of two in three missing nobody knows how long a turn is
    let key = |t: f64| if at_random(t.floor(), 1.5) { 0.0 } else { pulse(t, 0.0, 0.03) };
    let says = refused(&folder, &file(&folder, &recording, key), &DC);
    assert_says(
        &says,
        &["turns are unlike those beside them", "pulses are missing or false", "a clear pulse in each turn"],
    );
    // one tooth of a wheel of three is not one mark in three that is missing; phases count from the tooth behind the gap
    let wheel =
        |t: f64| if (3.0 * t).floor().rem_euclid(3.0) == 2.0 { 0.0 } else { pulse(3.0 * t, 0.0, 0.1) };
    let wheel = file(&folder, &recording, wheel);
    let says = refused(&folder, &wheel, &DC);
    assert_says(
        &says,
        &["marks seem to be missing", "1/3 of the marks' frequency", "--pulses 3", "--pulses 1"],
    );
    assert_same_vectors(&run(&folder, &wheel, &[&DC[..], &["--pulses", "3"]].concat()).1, 10);
}

#[test]
fn several_marks_a_turn_are_refused_with_the_remedy() {
    let folder = Folder::new();
    let recording = Recording::default();
    let two = file(&folder, &recording, |t| pulse(t, 0.0, 0.03) + pulse(t, 0.5, 0.03));
    let says = refused(&folder, &two, &DC);
    assert_says(&says, &["channel kph: the vibration at 1/2 of the marks' frequency is", "--pulses 2"]);
    assert_same_vectors_turned(&run(&folder, &two, &[&DC[..], &["--pulses", "2"]].concat()).1);
    let unequal = file(&folder, &recording, |t| pulse(t, 0.0, 0.03) + pulse(t, 0.42, 0.03));
    let says = refused(&folder, &unequal, &DC);
    assert_says(&says, &["gives 2 marks a turn", "--pulses 2", "--hold-off 0.71"]);
    let held = run(&folder, &unequal, &[&DC[..], &["--hold-off", "0.71"]].concat());
    assert_same_vectors(&held.1, 10);
    let scratch = file(&folder, &recording, |t| pulse(t, 0.0, 0.03) + 0.6 * pulse(t, 0.42, 0.03));
    assert_says(&refused(&folder, &scratch, &DC), &["--threshold 4.0"]);
    assert_same_vectors(&run(&folder, &scratch, &[&DC[..], &["--threshold", "4"]].concat()).1, 11);
}

/// The same but for the pulse that is first in the file.
#[track_caller]
fn assert_same_vectors_turned(readings: &[Reading]) {
    let expected = Recording::phasor_um(0).norm();
    for reading in readings {
        let amplitude = 1e6 * reading.probes[0].unwrap().norm();
        assert!((amplitude / expected - 1.0).abs() < 1e-3, "{amplitude}");
        assert!((reading.speed_rpm / 11_000.0 - 1.0).abs() < 1e-3);
    }
}

#[test]
fn wheel_with_missing_teeth_gives_phases_from_its_gap() {
    let folder = Folder::new();
    let recording = Recording { speed_rpm: 1500.0, ..Recording::default() };
    // teeth from 0 to 21 of 24 places
    let teeth = |turns: f64| {
        let place = turns.rem_euclid(1.0) * 24.0;
        if place < 22.0 && place.fract() < 0.5 { 5.0 } else { 0.0 }
    };
    let wheel = file(&folder, &recording, teeth);
    for pulses in ["24", "22"] {
        let (answer, readings) =
            run(&folder, &wheel, &[&DC[..], &["--pulses", pulses, "--revolutions", "4"]].concat());
        assert_eq!(answer["files"][0]["keyphasor"]["missing_teeth"], 2);
        assert_same_vectors(&readings, 4);
    }
    assert_says(&refused(&folder, &wheel, &[&DC[..], &["--revolutions", "4"]].concat()), &["--pulses 24"]);
    let wrong = [&DC[..], &["--pulses", "23"]].concat();
    assert_says(&refused(&folder, &wheel, &wrong), &["gives 22 pulses a turn", "--pulses 22"]);
}

#[test]
fn wheel_whose_teeth_nobody_stated_is_refused_with_their_number() {
    let folder = Folder::new();
    for (speed_rpm, teeth) in [(1500.0, 60.0), (1493.0, 60.0), (1500.0, 24.0)] {
        let recording = Recording { speed_rpm, ..Recording::default() };
        let wheel = file(&folder, &recording, |t| if (teeth * t).rem_euclid(1.0) < 0.5 { 5.0 } else { 0.0 });
        let stated = format!("--pulses {teeth}");
        assert_says(
            &refused(&folder, &wheel, &DC),
            &[&format!("1/{teeth} of the marks' frequency"), &stated],
        );
    }
}

#[test]
fn tacho_of_41_samples_a_turn_loses_no_window() {
    let folder = Folder::new();
    for samples in [41.0, 61.0, 97.0] {
        let rate_hz = 2000.0;
        let speed_rpm = 60.0 * rate_hz / (samples - 0.13);
        let recording = Recording { speed_rpm, rate_hz, seconds: 4.0, ..Recording::default() };
        let tacho = file(&folder, &recording, |turns| if pulse(turns, 0.0, 0.5) > 0.0 { 1.0 } else { 0.0 });
        let (answer, readings) = run(&folder, &tacho, &DC);
        assert_eq!((&answer["lost"], &answer["files"][0]["drifted"]), (&0.into(), &serde_json::Value::Null));
        assert!(readings.len() + 1 >= (recording.turns(8000) / 16.0) as usize, "{}", readings.len());
        for reading in &readings {
            assert!((reading.speed_rpm / speed_rpm - 1.0).abs() < 1e-3, "{}", reading.speed_rpm);
        }
        // a tenth of a sample
        let miss = miss(&readings, 0, Recording::phasor_um(0));
        assert!(miss < TAU * 0.1 / samples, "{samples}: {miss:.1e}");
    }
}

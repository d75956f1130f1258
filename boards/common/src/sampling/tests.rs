use std::vec::Vec;

use super::level::tests::{BOARD, convert};
use super::*;

const CONFIG: SamplingConfig = SamplingConfig {
    scan_us: 50,
    conversion_us: 260.0 / 42.5,
    level: BOARD,
    scale_mv_um: SCALES,
    gap_range_mv: [-18_000.0, -2_000.0],
    mark_mv: -12_000.0,
    hysteresis_mv: 2_000.0,
    captures: CaptureConfig { scan_ticks: 8_500, length_ticks: 8_500 * 1_000, first_ticks: FIRST_TICKS },
};
/// A tick is 1/170 µs.
const TICKS_PER_US: f64 = 170.0;
const FIRST_TICKS: u32 = 11_600;
/// No two the same, one whose voltage rises with the gap.
const SCALES: [f32; PROBES] = [-7.87, -7.6, 8.1, -8.3];
const RPM: f64 = 11_000.0;
const SCANS: usize = 100;
const HALF_US: u64 = 5_000;
/// cos and sin of each probe, µm.
const TRUTH: [[f64; 2]; PROBES] = [[40.0, 0.0], [0.0, 40.0], [-20.0, 30.0], [25.0, -25.0]];

/// The keyphasor rises from −18 V to −6 V in a tenth of a turn, through −12 V at the whole one, and falls at the half.
fn keyphasor_mv(turns: f64) -> f64 {
    match (turns + 0.5).rem_euclid(1.0) - 0.5 {
        turn if turn < -0.05 => -18_000.0,
        turn if turn < 0.05 => -12_000.0 + turn * 120_000.0,
        _ => -6_000.0,
    }
}

/// What the converter sees in a scan, each input at the instant of its own conversion.
fn scan(number: usize) -> [u16; INPUTS] {
    core::array::from_fn(|slot| {
        let time_s = (number as f64 * 50.0 + slot as f64 * 260.0 / 42.5) * 1e-6;
        let turns = time_s * RPM / 60.0;
        let probe = |probe: usize| {
            let (sin, cos) = (core::f64::consts::TAU * turns).sin_cos();
            let [c, s] = TRUTH[probe];
            -10_000.0 + f64::from(SCALES[probe]) * (c * cos + s * sin)
        };
        convert(
            &BOARD,
            match slot {
                2 => keyphasor_mv(turns),
                3.. => probe(slot - 1),
                _ => probe(slot),
            },
        )
    })
}

fn half(number: usize) -> Vec<[u16; INPUTS]> {
    (number * SCANS..(number + 1) * SCANS).map(scan).collect()
}

/// Scatter of a component by rounding to counts is `count/√12·√(2/N)`, N the 1745 samples of a reading: 0.008 µm; the mark's
/// rounding, half of 98 counts a sample, turns 40 µm by 0.012 µm. Five and one of these.
const TOLERANCE_UM: f64 = 5.0 * 0.008 + 0.012;

fn check(reading: &NumberedReading) {
    assert_eq!(reading.keyphasor, Keyphasor::Locked);
    assert!((f64::from(reading.reading.speed_rpm) - RPM).abs() < 1.0);
    for &gap_v in reading.reading.gaps_v() {
        // All probes are at −10 V; the mean of 1745 numbers, each off by half of 6.7 mV at most, is off by far less.
        assert!((gap_v + 10.0).abs() < 0.001, "{gap_v} V");
    }
    for (probe, [cos_um, sin_um]) in reading.reading.probes().iter().zip(TRUTH) {
        let miss = (f64::from(probe.cos_um) - cos_um).abs().max((f64::from(probe.sin_um) - sin_um).abs());
        assert!(miss < TOLERANCE_UM, "{probe:?} for {cos_um}, {sin_um}: {miss}");
    }
}

#[test]
fn readings_equal_closed_form_for_sequential_conversion() {
    let mut sampling = Sampling::new(CONFIG).unwrap();
    let mut readings = Vec::new();
    for number in 0..100 {
        let time_us = (number as u64 + 1) * HALF_US;
        sampling.take(&half(number), time_us, |reading| readings.push(reading)).unwrap();
    }
    // half a second holds 91.7 turns, of which one or two find the speed
    assert_eq!(readings.iter().map(|r| r.sequence).collect::<Vec<_>>(), [1, 2, 3, 4, 5]);
    readings.iter().for_each(check);
}

/// The gap of 2.75 turns begins at each twelfth of a turn, so that a keyphasor from before it would also make false marks.
#[test]
fn lost_samples_are_reported_and_never_spliced() {
    let told = |sampling: &mut Sampling, _| {
        sampling.lost();
    };
    let found_out = |sampling: &mut Sampling, behind: usize| {
        let late = half(behind - 1);
        let result = sampling.take(&late, behind as u64 * HALF_US, |_| panic!("a reading of late samples"));
        assert_eq!(result, Err(SamplesLost));
    };
    for notice in [&told as &dyn Fn(&mut Sampling, usize), &found_out] {
        for before in 24..36 {
            let behind = before + 3;
            let mut sampling = Sampling::new(CONFIG).unwrap();
            let mut readings = Vec::new();
            for number in (0..before).chain(behind..80) {
                if number == behind {
                    notice(&mut sampling, behind);
                }
                let time_us = (number as u64 + 1) * HALF_US;
                sampling.take(&half(number), time_us, |reading| readings.push(reading)).unwrap();
            }
            // one before the gap, the second was under way
            assert_eq!(readings.iter().map(|r| r.sequence).collect::<Vec<_>>(), [1, 3, 4]);
            readings.iter().for_each(check);
        }
    }
}

#[test]
fn gap_voltages_outside_the_configured_range_lose_their_probes() {
    // all probes are at -10 V
    for (gap_range_mv, is_lost) in [([-10_100.0, -9_900.0], false), ([-18_000.0, -10_100.0], true)] {
        let mut sampling = Sampling::new(SamplingConfig { gap_range_mv, ..CONFIG }).unwrap();
        let mut readings = Vec::new();
        for number in 0..30 {
            let time_us = (number as u64 + 1) * HALF_US;
            sampling.take(&half(number), time_us, |reading| readings.push(reading)).unwrap();
        }
        assert_eq!(readings.len(), 1);
        assert!(readings[0].reading.probes().iter().all(|probe| probe.cos_um.is_nan() == is_lost));
    }
}

#[test]
fn board_without_probes_is_silent_and_stopped_keyphasor_missing() {
    let mut sampling = Sampling::new(CONFIG).unwrap();
    let grounded = [[0; INPUTS]; SCANS];
    let silence = |sampling: &mut Sampling, from: usize| {
        let mut readings = Vec::new();
        for number in from..from + 300 {
            sampling.take(&grounded, (number as u64 + 1) * HALF_US, |r| readings.push(r)).unwrap();
        }
        readings
    };
    assert!(silence(&mut sampling, 0).is_empty());
    for number in 300..400 {
        sampling.take(&half(number), (number as u64 + 1) * HALF_US, |_| ()).unwrap();
    }
    let readings = silence(&mut sampling, 400);
    assert!(!readings.is_empty());
    assert!(readings.iter().all(|r| r.keyphasor == Keyphasor::Missing && !r.reading.speed_rpm.is_finite()));
}

#[test]
fn an_angle_is_turned_as_sine_and_cosine_do() {
    for step in -20..=20 {
        let angle = 0.01 * step as f32;
        let ProbeVector { cos_um, sin_um } = turned(ProbeVector { cos_um: 1.0, sin_um: 0.0 }, angle);
        let (sin, cos) = f64::from(angle).sin_cos();
        assert!((f64::from(cos_um) - cos).abs() < 2e-7 && (f64::from(sin_um) - sin).abs() < 2e-7);
    }
}

/// From −18 V to −6 V between any two samples, and back at the half turn.
fn steep_mv(turns: f64) -> f64 {
    if turns.rem_euclid(1.0) < 0.5 { -6_000.0 } else { -18_000.0 }
}

fn with_keyphasor(number: usize, keyphasor_mv: impl Fn(f64) -> f64) -> [u16; INPUTS] {
    let mut scan = scan(number);
    scan[2] = convert(&BOARD, keyphasor_mv(keyphasor_us(number) * 1e-6 * RPM / 60.0));
    scan
}

/// When a scan's keyphasor is converted.
fn keyphasor_us(scan: usize) -> f64 {
    scan as f64 * 50.0 + 2.0 * f64::from(CONFIG.conversion_us)
}

/// What the timer captures of the mark that begins a turn.
fn capture(turn: u32) -> u32 {
    let us = f64::from(turn) * 60e6 / RPM;
    let ticks = f64::from(FIRST_TICKS) + (us - keyphasor_us(0)) * TICKS_PER_US;
    (ticks.round() as u64 % u64::from(CONFIG.captures.length_ticks)) as u32
}

/// Two seconds of readings, with captures of those turns that are `captured`.
fn play(keyphasor_mv: impl Fn(f64) -> f64, captured: impl Fn(u32) -> bool) -> Vec<NumberedReading> {
    let mut sampling = Sampling::new(CONFIG).unwrap();
    let (mut readings, mut turn) = (Vec::new(), 1);
    for number in 0..400 {
        let end_us = keyphasor_us((number + 1) * SCANS);
        while f64::from(turn) * 60e6 / RPM < end_us {
            if captured(turn) {
                sampling.captured(capture(turn));
            }
            turn += 1;
        }
        let scans: Vec<_> =
            (number * SCANS..(number + 1) * SCANS).map(|scan| with_keyphasor(scan, &keyphasor_mv)).collect();
        let time_us = (number as u64 + 1) * HALF_US;
        sampling.take(&scans, time_us, |reading| readings.push(reading)).unwrap();
    }
    readings
}

fn worst_um(readings: &[NumberedReading]) -> f64 {
    let vectors = readings.iter().flat_map(|reading| reading.reading.probes().iter().zip(TRUTH));
    vectors.fold(0.0, |worst, (probe, [cos_um, sin_um])| {
        let miss = (f64::from(probe.cos_um) - cos_um).hypot(f64::from(probe.sin_um) - sin_um);
        miss.max(worst)
    })
}

/// A mark that lies anywhere between two samples 50 µs apart turns a turn's vectors by up to 1.7°, the mean of a window's 16
/// turns by less: at this speed they fall at 12 different places between samples.
#[test]
fn captured_marks_make_steep_edges_as_good_as_others() {
    let sampled = play(steep_mv, |_| false);
    let captured = play(|_| 0.0, |_| true);
    assert!(sampled.len() >= 20 && captured.len() >= 20, "{} {}", sampled.len(), captured.len());
    captured.iter().for_each(check);
    assert!(worst_um(&sampled) > 2.0 * TOLERANCE_UM, "{}", worst_um(&sampled));
}

#[test]
fn captures_take_over_and_give_back_without_a_reading_of_both() {
    // 366 turns; captures from the 100th to the 200th only, the samples' mark all the time
    let readings = play(keyphasor_mv, |turn| (100..200).contains(&turn));
    let locked: Vec<_> = readings.iter().filter(|r| r.keyphasor == Keyphasor::Locked).collect();
    locked.iter().for_each(|reading| check(reading));
    let missing = readings.iter().position(|r| r.keyphasor == Keyphasor::Missing).unwrap();
    assert!(missing > 5 && readings[missing + 1..].iter().any(|r| r.keyphasor == Keyphasor::Locked));
}

//! What is told where there are no vectors.

use super::*;

/// Turns of a length that follows from the number of the sample; a mark where each ends.
fn run(
    config: ExtractionConfig<PROBES>,
    samples: u32,
    period: impl Fn(u32) -> f64,
    count: impl Fn(u32) -> i32,
) -> Vec<Extraction<PROBES>> {
    let mut extractor = Extractor::new(config).unwrap();
    let (mut turns, mut results) = (0.0_f64, Vec::new());
    for n in 0..samples {
        let step = 1.0 / period(n);
        turns += step;
        let mark = (turns >= 1.0).then(|| ((turns - 1.0) / step) as f32);
        turns -= turns.floor();
        results.extend(extractor.push([count(n); PROBES], mark));
    }
    results
}

#[test]
fn gaps_need_no_keyphasor_and_tell_open_and_clipped_probes() {
    let config = ExtractionConfig::<3> { longest_turn_s: 0.1, ..ExtractionConfig::new() };
    let mut extractor = Extractor::new(config).unwrap();
    let mut results = Vec::new();
    for n in 0..10_000_u32 {
        // −9 V with vibration, −0.6 V, and −12 V with a sample at a rail in the second tenth of a second
        let wave = (200.0 * (TAU * f64::from(n) / 100.0).sin()).round() as i32;
        let third = if n == 3_000 { 4_095 } else { 2_048 };
        results.extend(extractor.push([2_560 + wave, 3_994, third], None));
    }
    assert_eq!(results.len(), 4);
    for (place, result) in results.iter().enumerate() {
        assert_eq!((result.outcome, result.keyphasor), (Outcome::NoMark, Keyphasor::Missing));
        assert_eq!((result.open, result.clipped), (0b010, if place == 1 { 0b100 } else { 0 }));
        // 2001 samples: the wave's last one, and what the sample at the rail adds, are left in the mean
        for (gap_mv, expected) in result.gap_mv.into_iter().zip([-9_000.0, -597.66, -12_000.0]) {
            assert!((gap_mv - expected).abs() < 7.0, "{gap_mv} for {expected}");
        }
        assert_eq!(result.reading.gaps_v(), result.gap_mv.map(|mv| 1e-3 * mv));
        assert!(result.reading.valid_mask() == 0 && result.reading.speed_rpm.is_nan());
    }
}

/// Single precision would lose the sixteenth part of a count a sample that this sum is made of.
#[test]
fn mean_of_a_million_samples_is_exact() {
    let config = ExtractionConfig {
        converter: Converter::unsigned(16, [0.0, 65_536.0]),
        gap_range_mv: [0.0, 65_536.0],
        longest_turn_s: 50.0,
        ..ExtractionConfig::<1>::new()
    };
    let mut extractor = Extractor::new(config).unwrap();
    let found = (0_i32..2_000_000).find_map(|n| extractor.push([60_000 + i32::from(n % 16 == 0)], None));
    assert_eq!(found.unwrap().gap_mv, [60_000.0 + 1.0 / 16.0]);
}

#[test]
fn too_few_samples_in_a_turn_are_told_once_a_reading() {
    let results = run(config(16), 7_500, |_| 7.5, |_| 1_000);
    // a thousand turns; the first has no beginning
    assert_eq!(results.len(), 999 / 16);
    assert!(results.iter().all(|r| r.outcome == Outcome::TooFewSamples && r.open == 0));
    assert!(results.iter().all(|r| (r.gap_mv[0] - 366.2).abs() < 0.1), "the gap is known all the same");
}

#[test]
fn limits_of_speed_are_where_the_settings_say() {
    let config = config(2);
    let samples_a_turn = |rpm: f32| 60.0 * 20_000.0 / f64::from(rpm);
    let outcomes = |period: f64| run(config, 60_000, |_| period, |_| 0).into_iter().map(|r| r.outcome);
    for (rpm, expected) in [
        (1.01 * config.fastest_rpm(), Outcome::TooFewSamples),
        (0.99 * config.fastest_rpm(), Outcome::Measured),
        (1.01 * config.slowest_rpm(), Outcome::Measured),
        (0.99 * config.slowest_rpm(), Outcome::NoMark),
    ] {
        let found: Vec<_> = outcomes(samples_a_turn(rpm)).collect();
        assert!(!found.is_empty() && found.iter().all(|o| *o == expected), "{rpm} rpm: {found:?}");
    }
}

#[test]
fn overspeed_in_a_window_is_too_few_samples_and_ends() {
    // from 20 samples a turn down to 7 and back, by less than 1 % a turn
    let period = |n: u32| 7.0 + 13.0 * (f64::from(n.abs_diff(20_000)) / 20_000.0);
    let outcomes: Vec<_> = run(config(4), 40_000, period, |_| 0).into_iter().map(|r| r.outcome).collect();
    let few = |o: &Outcome| *o == Outcome::TooFewSamples;
    let (first, last) = (outcomes.iter().position(few).unwrap(), outcomes.iter().rposition(few).unwrap());
    assert!(first > 100 && last < outcomes.len() - 100 && last - first > 50);
    assert!(outcomes[first..=last].iter().all(few));
    assert!(outcomes[..first].iter().chain(&outcomes[last + 1..]).all(|o| *o == Outcome::Measured));
}

#[test]
fn second_mark_soon_after_a_mark_is_out_of_step() {
    let mut extractor = Extractor::new(config(4)).unwrap();
    let outcomes: Vec<_> = (0..3_000_u32)
        .filter_map(|n| {
            let mark = n % 100 == 0 || n == 1_503;
            extractor.push([0; PROBES], mark.then_some(0.0)).map(|r| r.outcome)
        })
        .collect();
    assert_eq!(outcomes.iter().filter(|o| **o == Outcome::OutOfStep).count(), 1);
    assert!(outcomes.iter().all(|o| matches!(o, Outcome::OutOfStep | Outcome::Measured)));
}

#[test]
fn restarted_extractor_equals_a_new_one() {
    let feed = |extractor: &mut Extractor<PROBES>, from: u32| -> Vec<_> {
        (from..from + 2_000)
            .filter_map(|n| {
                let count = (500.0 * (TAU * f64::from(n) / 80.0).cos()) as i32;
                extractor.push([count; PROBES], (n % 80 == 7).then_some(0.25))
            })
            .collect()
    };
    let mut used = Extractor::new(config(4)).unwrap();
    feed(&mut used, 33);
    used.restart();
    let results = feed(&mut used, 0);
    assert!(results.len() >= 5);
    for (result, new) in results.iter().zip(feed(&mut Extractor::new(config(4)).unwrap(), 0)) {
        assert_eq!(result.reading.probes(), new.reading.probes());
        assert_eq!((result.reading.speed_rpm, result.gap_mv), (new.reading.speed_rpm, new.gap_mv));
    }
}

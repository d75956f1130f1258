//! Settings, converters and numbers of probes.

use super::*;

#[test]
fn each_impossible_setting_is_refused_by_its_name() {
    use ExtractionError as E;
    type Spoil = fn(&mut ExtractionConfig<PROBES>);
    let spoiled: [(E, &[Spoil]); 7] = [
        (
            E::SampleRate,
            &[
                |c| c.sample_rate_hz = 0.0,
                |c| c.sample_rate_hz = -20_000.0,
                |c| c.sample_rate_hz = f32::NAN,
                |c| c.sample_rate_hz = f32::INFINITY,
            ],
        ),
        (
            E::Converter,
            &[
                |c| c.converter.mv_per_count = 0.0,
                |c| c.converter.mv_per_count = f32::NAN,
                |c| c.converter.zero_count = f32::INFINITY,
                |c| c.converter.rails = [4095, 0],
                |c| c.converter.rails = [0, 1],
                |c| c.converter.rails = [i32::MIN, i32::MAX],
                |c| c.converter = Converter::unsigned(0, [-24_000.0, 0.0]),
                |c| c.converter = Converter::signed(25, [-24_000.0, 0.0]),
                |c| c.converter = Converter::unsigned(255, [-24_000.0, 0.0]),
                |c| c.converter = Converter::signed(16, [0.0, 0.0]),
            ],
        ),
        (
            E::Scale,
            &[
                |c| c.scale_mv_um[3] = 0.0,
                |c| c.scale_mv_um[0] = f32::NAN,
                |c| c.scale_mv_um[1] = f32::INFINITY,
            ],
        ),
        (
            E::GapRange,
            &[
                |c| c.gap_range_mv = [-2_000.0, -18_000.0],
                |c| c.gap_range_mv = [-2_000.0; 2],
                |c| c.gap_range_mv = [f32::NAN, 0.0],
            ],
        ),
        (E::Revolutions, &[|c| c.revolutions = 0]),
        (E::Drift, &[|c| c.largest_drift = 0.0, |c| c.largest_drift = -0.01, |c| c.largest_drift = f32::NAN]),
        (
            E::LongestTurn,
            &[
                |c| c.longest_turn_s = 0.0,
                |c| c.longest_turn_s = -1.0,
                |c| c.longest_turn_s = 7.0 / 20_000.0,
                |c| c.longest_turn_s = f32::NAN,
                |c| c.longest_turn_s = 900.0,
                // 65,535 turns of 100,000 samples
                |c| (c.longest_turn_s, c.revolutions) = (5.0, u16::MAX),
            ],
        ),
    ];
    for (error, spoils) in spoiled {
        for (place, spoil) in spoils.iter().enumerate() {
            let mut config = ExtractionConfig::new();
            assert_eq!(config.check(), Ok(()));
            spoil(&mut config);
            assert_eq!(config.check(), Err(error), "{error:?} {place}");
            assert_eq!(Extractor::new(config).err(), Some(error));
        }
    }
    let unlimited = [f32::NEG_INFINITY, f32::INFINITY];
    let bare = ExtractionConfig::<PROBES> { gap_range_mv: unlimited, ..ExtractionConfig::new() };
    assert_eq!(bare.check(), Ok(()));
}

/// Every usual converter over the same voltages, with its steps.
fn converters() -> [(Converter, f64, f64); 5] {
    let range_mv = [-24_000.0, 0.0];
    [
        (Converter::unsigned(12, range_mv), 0.0, 4_096.0),
        (Converter::signed(12, range_mv), -2_048.0, 4_096.0),
        (Converter::unsigned(16, range_mv), 0.0, 65_536.0),
        (Converter::signed(16, range_mv), -32_768.0, 65_536.0),
        (Converter::unsigned(24, range_mv), 0.0, 16_777_216.0),
    ]
}

#[test]
fn voltages_are_the_same_through_every_converter() {
    for (converter, lowest, steps) in converters() {
        let config = ExtractionConfig::<2> { converter, revolutions: 4, ..ExtractionConfig::new() };
        let mut extractor = Extractor::new(config).unwrap();
        let mut results = Vec::new();
        for n in 0..3_000_u32 {
            let counts = [0.0, 2.0].map(|lead| {
                let mv = -10_000.0 + 787.0 * (TAU * f64::from(n) / 100.37 + lead).cos();
                (lowest + (mv + 24_000.0) / 24_000.0 * steps).round() as i32
            });
            let turn = |n: u32| (f64::from(n) / 100.37).floor();
            let mark = (n == 0 || turn(n) > turn(n - 1)).then(|| (f64::from(n) % 100.37) as f32);
            results.extend(extractor.push(counts, mark));
        }
        assert!(results.len() >= 6);
        // 100 µm; a component's scatter by rounding, four and a half times, and f32
        let step_um = 24_000.0 / steps / 7.87;
        let allowed = 4.5 * step_um / 12f64.sqrt() * (2.0 / 401.0_f64).sqrt() + 100.0 * 3e-6;
        for result in results {
            assert_eq!((result.outcome, result.clipped, result.open), (Outcome::Measured, 0, 0));
            for (probe, lead) in result.reading.probes().iter().zip([0.0, 2.0]) {
                let truth = [100.0 * f64::cos(lead), -100.0 * f64::sin(lead)];
                let miss = (f64::from(probe.cos_um) - truth[0]).hypot(f64::from(probe.sin_um) - truth[1]);
                assert!(miss < allowed, "{converter:?}: {miss} of {allowed}");
            }
            assert!(
                result.gap_mv.iter().all(|gap_mv| (gap_mv + 10_000.0).abs() < 1.0),
                "{:?}",
                result.gap_mv
            );
        }
    }
}

#[test]
fn both_rails_clip_and_the_numbers_next_to_them_do_not() {
    for (converter, ..) in converters() {
        let unlimited = [f32::NEG_INFINITY, f32::INFINITY];
        let config = ExtractionConfig { converter, gap_range_mv: unlimited, ..ExtractionConfig::new() };
        let mut extractor = Extractor::<PROBES>::new(config).unwrap();
        let [lowest, highest] = converter.rails;
        // one sample of each, among others in the middle
        let seldom = [lowest, highest, lowest + 1, highest - 1];
        let found = (0..20_000)
            .find_map(|n| match n {
                5_000 => extractor.push(seldom, None),
                _ => extractor.push([lowest + (highest - lowest) / 2; PROBES], None),
            })
            .unwrap();
        assert_eq!(found.clipped, 0b0011, "{converter:?}");
    }
}

fn of_any_number<const N: usize>() -> Extractor<N> {
    let config = ExtractionConfig {
        converter: Converter::signed(16, [-12_000.0, 12_000.0]),
        gap_range_mv: [-11_000.0, 11_000.0],
        revolutions: 3,
        ..ExtractionConfig::new()
    };
    Extractor::new(config).unwrap()
}

/// What extractors of one probe find of each of N probes.
fn apart_and_together<const N: usize>() {
    let (mut together, mut apart) = (of_any_number::<N>(), [(); N].map(|()| of_any_number::<1>()));
    let mut results = 0;
    for n in 0..2_000_u32 {
        let mark = (n % 97 == 0).then_some(0.4);
        let counts: [i32; N] = array::from_fn(|probe| {
            let angle = TAU * f64::from(n) / 97.0 + probe as f64;
            // the fifth is clipped now and then
            let amplitude = if probe == 4 { 40_000.0 } else { 1_000.0 * (1.0 + probe as f64) };
            (amplitude * angle.sin()).clamp(-32_768.0, 32_767.0) as i32
        });
        let found = together.push(counts, mark);
        for (probe, extractor) in apart.iter_mut().enumerate() {
            let alone = extractor.push([counts[probe]], mark);
            assert_eq!(alone.is_some(), found.is_some());
            let (Some(found), Some(alone)) = (found, alone) else { continue };
            assert_eq!(found.reading.probes().len(), N);
            assert_eq!(found.reading.speed_rpm, alone.reading.speed_rpm);
            assert_eq!(found.gap_mv[probe], alone.gap_mv[0]);
            assert_eq!([found.clipped >> probe & 1, found.open >> probe & 1], [alone.clipped, alone.open]);
            assert_eq!(alone.clipped, u8::from(probe == 4));
            let bits = |v: ProbeVector| [v.cos_um, v.sin_um].map(f32::to_bits);
            assert_eq!(bits(found.reading.probes()[probe]), bits(alone.reading.probes()[0]));
            results += 1;
        }
    }
    assert!(results >= 5 * N);
}

#[test]
fn any_number_of_probes_gives_what_each_gives_alone() {
    apart_and_together::<1>();
    apart_and_together::<2>();
    apart_and_together::<3>();
    apart_and_together::<5>();
    apart_and_together::<6>();
    apart_and_together::<7>();
    apart_and_together::<8>();
}

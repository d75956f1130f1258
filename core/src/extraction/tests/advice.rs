//! Advised numbers of revolutions against simulated shafts.

use super::*;

const WINDOWS: usize = 60;

/// Root mean square error of a component, µm, over windows of all probes.
fn rms_um(config: &ExtractionConfig<PROBES>, period: f64, noise_um: f64, random: &mut Random) -> f64 {
    let samples = (period * f64::from(config.revolutions) * (WINDOWS + 1) as f64 + 3.0 * period) as u32;
    let results = steady(period).run(config, samples, |_, angle| {
        // uniform, of the standard deviation wanted: only whiteness counts
        50.0 * angle.cos() + noise_um * 3f64.sqrt() * f64::from(random.signed())
    });
    assert!(results.len() >= WINDOWS && results.iter().all(|r| r.outcome == Outcome::Measured));
    let probes = || results.iter().flat_map(|r| r.reading.probes());
    let squares = probes().map(|v| (f64::from(v.cos_um) - 50.0).powi(2) + f64::from(v.sin_um).powi(2));
    (squares.sum::<f64>() / (2 * probes().count()) as f64).sqrt()
}

#[test]
fn advised_revolutions_leave_the_error_and_fewer_leave_more() {
    let mut random = Random::new(21);
    // a mean of 2·4·60 squares of normal errors: its root scatters by 1/√(2·480) = 3.2 %; window ends weigh up to 1 %
    let scatter = 4.0 / (2.0 * 480_f64).sqrt() + 0.01;
    // the third is a converter of 12 bits, whose rounding, 0.2 µm rms, is most of the noise
    for (bits, period, noise_um, error_um) in
        [(16, 109.09, 1.0, 0.05), (16, 40.7, 3.0, 0.25), (12, 109.09, 0.1, 0.01), (16, 333.3, 2.0, 0.1)]
    {
        let converter = Converter::signed(bits, [-12_000.0, 12_000.0]);
        let config = ExtractionConfig { converter, ..config(1) };
        let speed_rpm = 60.0 * config.sample_rate_hz / period as f32;
        let revolutions = config.revolutions_for_noise(speed_rpm, noise_um as f32, error_um as f32).unwrap();
        assert!(revolutions > 1);
        let found = rms_um(&ExtractionConfig { revolutions, ..config }, period, noise_um, &mut random);
        let fewer = (f64::from(revolutions - 1) / f64::from(revolutions)).sqrt();
        assert!(found < error_um * (1.0 + scatter), "{revolutions}: {found} for {error_um}");
        assert!(found > error_um * fewer * (1.0 - scatter), "{revolutions}: {found} for {error_um}");
    }
}

#[test]
fn advised_revolutions_stay_within_the_drift_and_more_do_not() {
    for (period, rise) in [(150.0, 1e-3), (150.0, -1e-3), (60.0, 3e-4)] {
        let shaft = Shaft { rise, ..steady(period) };
        let config = config(1);
        let speed_rpm = 60.0 * config.sample_rate_hz / period as f32;
        // the speed rises by `rise` of itself in a turn of period/rate seconds
        let change_rpm_s = rise as f32 * speed_rpm * config.sample_rate_hz / period as f32;
        let advised = config.revolutions_for_drift(speed_rpm, change_rpm_s).unwrap();
        assert_eq!(advised, (0.01 / rise.abs()) as u16);
        let first = |revolutions| {
            let samples = (period * f64::from(revolutions + 6)) as u32;
            let results =
                shaft.run(&ExtractionConfig { revolutions, ..config }, samples, |_, angle| angle.cos());
            results[0].outcome
        };
        assert_eq!(
            (first(advised), first(advised + 2)),
            (Outcome::Measured, Outcome::Drift),
            "{period} {rise}"
        );
    }
}

#[test]
fn advice_is_refused_where_there_is_none() {
    let config = ExtractionConfig::<PROBES>::new();
    for speed_rpm in [0.0, -1_000.0, f32::NAN, 0.99 * config.slowest_rpm(), 1.01 * config.fastest_rpm()] {
        assert_eq!(config.revolutions_for_noise(speed_rpm, 1.0, 1.0), None, "{speed_rpm}");
        assert_eq!(config.revolutions_for_drift(speed_rpm, 1.0), None, "{speed_rpm}");
    }
    for (noise_um, error_um) in [
        (-1.0, 1.0),
        (1.0, 0.0),
        (1.0, -1.0),
        (f32::NAN, 1.0),
        (1.0, f32::NAN),
        (1.0, 1e-5),
        (f32::INFINITY, 1.0),
    ] {
        assert_eq!(config.revolutions_for_noise(9_000.0, noise_um, error_um), None, "{noise_um} {error_um}");
    }
    assert_eq!(config.revolutions_for_noise(9_000.0, 0.0, f32::INFINITY), Some(1));
    assert_eq!(config.revolutions_for_drift(9_000.0, 0.0), Some(u16::MAX));
    assert_eq!(config.revolutions_for_drift(9_000.0, f32::NAN), None);
}

//! The edge's 1x extraction against a least-squares fit in f64 with exact phases, and against the Cramér–Rao bound.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use nalgebra::{Matrix3, Vector3};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rotor_edge_core::can::Keyphasor;
use rotor_edge_core::extraction::{Converter, ExtractionConfig, Extractor};
use statrs::distribution::{ContinuousCDF, Normal};

const RATE_HZ: f64 = 20_000.0;
const UM_PER_COUNT: f64 = 0.05;
const PAGE: &str = include_str!("../../docs/extraction.md");

fn config(revolutions: u16) -> ExtractionConfig<1> {
    ExtractionConfig {
        converter: Converter { rails: [-32_768, 32_767], zero_count: 0.0, mv_per_count: 0.4 },
        scale_mv_um: [8.0],
        gap_range_mv: [-13_000.0, 13_000.0],
        revolutions,
        ..ExtractionConfig::new()
    }
}

/// Window by window: what the edge found, and the f64 fit of the same counts (cos, sin, µm).
struct Windows(Vec<([f64; 2], [f64; 2])>);

/// A shaft at `speed_rpm` whose first probe shows 50 µm at 60° lag, its second harmonic, and white noise.
fn windows(speed_rpm: f64, revolutions: u16, noise_um: f64, number: usize, seed: u64) -> Windows {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let mut noise = || {
        let uniform = ((random.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
        normal.inverse_cdf(uniform)
    };
    let period = 60.0 * RATE_HZ / speed_rpm;
    let [c, s] = truth();
    let turns = |n: f64| (n - 0.37) / period;
    let mut extractor = Extractor::new(config(revolutions)).expect("a possible configuration");
    let (mut found, mut counts_of_window) = (Vec::new(), Vec::new());
    let mut windows_begun = false;
    for n in 1.. {
        let now = turns(f64::from(n));
        let mark =
            (now.floor() > turns(f64::from(n - 1)).floor()).then(|| ((now - now.floor()) * period) as f32);
        let angle = TAU * now;
        let um = c * angle.cos() + s * angle.sin() + 10.0 * (2.0 * angle).cos() + noise_um * noise();
        let count = (um / UM_PER_COUNT).round() as i32;
        let result = extractor.push([count], mark);
        if let Some(result) = result {
            assert_eq!(result.keyphasor, Keyphasor::Locked);
            let probe = result.reading.probes()[0];
            found.push(([f64::from(probe.cos_um), f64::from(probe.sin_um)], fit(&counts_of_window)));
        }
        // the second mark begins the first window, each result the next
        if result.is_some() || (!windows_begun && mark.is_some() && now >= 2.0) {
            windows_begun = true;
            counts_of_window.clear();
        }
        counts_of_window.push((angle, f64::from(count) * UM_PER_COUNT));
        if found.len() == number {
            return Windows(found);
        }
    }
    unreachable!("windows go on coming");
}

fn truth() -> [f64; 2] {
    let lag = 60_f64.to_radians();
    [50.0 * lag.cos(), 50.0 * lag.sin()]
}

/// Mean, cosine, sine, and the second harmonic taken out beforehand where it is known to be: the textbook's normal equations.
fn fit(samples: &[(f64, f64)]) -> [f64; 2] {
    let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for &(angle, um) in samples {
        let row = Vector3::new(1.0, angle.cos(), angle.sin());
        gram += row * row.transpose();
        right += row * (um - 10.0 * (2.0 * angle).cos());
    }
    let solved = gram.lu().solve(&right).expect("a whole number of turns");
    [solved[1], solved[2]]
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn noiseless_edge_and_f64_fit_differ_by_rounding_and_leakage() {
    for speed_rpm in [300.0, 1_000.0, 3_600.0, 11_000.0] {
        for ((edge, exact), window) in windows(speed_rpm, 16, 0.0, 5, 1).0.into_iter().zip(0..) {
            let samples = 16.0 * 60.0 * RATE_HZ / speed_rpm;
            let rounding = UM_PER_COUNT / 12f64.sqrt() * (2.0 / samples).sqrt();
            let allowed = 50.0 * 3e-6 + 10.0 * 1e-4 + rounding;
            assert!(distance(edge, exact) < allowed, "{speed_rpm} rpm, window {window}");
            assert!(distance(edge, truth()) < allowed + 4.5 * rounding);
        }
    }
}

#[test]
fn extraction_error_stays_at_cramer_rao_bound() {
    const WINDOWS: usize = 200;
    let mut table = String::from(
        "| speed, rpm | turns | noise, µm rms | error of a component, µm rms | bound, µm | ratio | amplitude, % | phase, ° |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for (speed_rpm, revolutions, noise_um) in [
        (11_000.0, 1, 1.0),
        (11_000.0, 4, 1.0),
        (11_000.0, 16, 1.0),
        (11_000.0, 64, 1.0),
        (11_000.0, 16, 5.0),
        (3_600.0, 16, 1.0),
        (600.0, 4, 1.0),
    ] {
        let all = windows(speed_rpm, revolutions, noise_um, WINDOWS, 7).0;
        let squares: f64 = all.iter().map(|(edge, _)| distance(*edge, truth()).powi(2)).sum();
        let rms = (squares / (2 * WINDOWS) as f64).sqrt();
        // rounding of counts is noise too; N samples give each component 2σ²/N (Cramér and Rao)
        let sigma = noise_um.hypot(UM_PER_COUNT / 12f64.sqrt());
        let samples = f64::from(revolutions) * 60.0 * RATE_HZ / speed_rpm;
        let bound = sigma * (2.0 / samples).sqrt();
        let ratio = rms / bound;
        // χ² with 2·WINDOWS degrees: the rms scatters by 1/√(4·WINDOWS) = 3.5 %; ends of windows weigh up to 1 %
        let scatter = 1.0 / (4.0 * WINDOWS as f64).sqrt();
        assert!((ratio - 1.0).abs() < 4.0 * scatter + 0.01, "{speed_rpm} {revolutions} {noise_um}: {ratio}");
        let _ = writeln!(
            table,
            "| {speed_rpm} | {revolutions} | {noise_um} | {rms:.3} | {bound:.3} | {ratio:.2} | {:.2} | {:.2} |",
            100.0 * rms / 50.0,
            (rms / 50.0).to_degrees()
        );
    }
    println!("{table}");
    assert_eq!(
        PAGE.split("<!-- extraction -->\n").nth(1),
        Some(table.as_str()),
        "the table in docs/extraction.md"
    );
}

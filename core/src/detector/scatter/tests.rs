use std::vec::Vec;

use nalgebra::Complex;

use super::*;
use crate::testing::{Random, normal, rounded};

const NOISE: Noise = Noise { relative: 0.02, floor_um: 0.03 };
const SPEED_RPM: f32 = 9000.0;
type Vectors = [Complex<f32>; 4];

/// Four probes' phasors of a machine in order.
fn healthy() -> Vectors {
    [(5.0, 1.0), (-3.0, 2.0), (0.5, 8.0), (-4.0, -4.0)].map(|(re, im)| Complex::new(re, im))
}

/// Readings one after another, with the noise that the model states times a factor.
struct Sender {
    scatter: Scatter,
    last: [ProbeVector; MAX_PROBES],
    last_rpm: f32,
    random: Random,
    noise: Noise,
}

impl Sender {
    fn new(seed: u64) -> Self {
        Self {
            scatter: Scatter::default(),
            last: [ProbeVector::LOST; MAX_PROBES],
            last_rpm: f32::NAN,
            random: Random::new(seed),
            noise: NOISE,
        }
    }

    fn noisy(&mut self, vectors: Vectors, factor: f32) -> Reading {
        let vectors = vectors.map(|phasor| {
            let vector = ProbeVector::from_phasor(phasor);
            let sigma_um = factor * NOISE.deviation_um(vector);
            let mut part = |value: f32| value + sigma_um * normal(&mut self.random);
            ProbeVector { cos_um: part(vector.cos_um), sin_um: part(vector.sin_um) }
        });
        Reading::new(SPEED_RPM, &vectors).unwrap()
    }

    fn send(&mut self, reading: &Reading) -> Dispersion {
        let dispersion = self.scatter.update(self.noise, &self.last, self.last_rpm, reading);
        self.last[..reading.probes().len()].copy_from_slice(reading.probes());
        self.last_rpm = reading.speed_rpm;
        dispersion
    }

    fn send_noisy(&mut self, vectors: Vectors, factor: f32) -> Dispersion {
        let reading = self.noisy(vectors, factor);
        self.send(&reading)
    }

    /// A sender after so many healthy readings, none of which scattered too much.
    fn after(number: usize, seed: u64) -> Self {
        let mut sender = Self::new(seed);
        assert!((0..number).all(|_| sender.send_noisy(healthy(), 1.0) == Dispersion::Usual));
        sender
    }

    fn angle(&mut self) -> Complex<f32> {
        turn(180.0 * self.random.signed())
    }
}

fn turn(angle_deg: f32) -> Complex<f32> {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    Complex::new(cos, sin)
}

/// `ln E exp(s S)` of the mean square of normal noise, by the determinant of a tridiagonal matrix.
fn log_moment(s: Complex<f64>) -> Complex<f64> {
    let w = f64::from(WEIGHT);
    let (mut sum, mut ratio, mut weight_before) = (Complex::new(0.0, 0.0), Complex::new(1.0, 0.0), 0.0);
    let mut weight = w;
    for _ in 0..600 {
        ratio = Complex::new(1.0, 0.0) - s * weight - s * s * (weight * weight_before / 4.0) / ratio;
        // methods of Complex need its feature std
        sum -= Complex::new(ratio.norm_sqr().ln() / 2.0, ratio.im.atan2(ratio.re));
        (weight_before, weight) = (weight, weight * (1.0 - w));
    }
    sum
}

/// The least `exp(−θc) E exp(θ S)`, and its θ.
fn chernoff(c: f64) -> (f64, f64) {
    let thetas = (1..1200).map(|step| 0.01 * f64::from(step));
    let moments = thetas.map(|theta| (log_moment(Complex::new(theta, 0.0)), theta));
    // Beyond the pole of the moment the logarithm is complex.
    let bounds = moments
        .take_while(|(moment, _)| moment.im == 0.0)
        .map(|(m, theta)| ((m.re - theta * c).exp(), theta));
    bounds.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

/// `P(S > c)`, the inverse of the Laplace transform along a line through the saddle point.
fn exact_tail(c: f64) -> f64 {
    let ((_, theta), step) = (chernoff(c), 0.02);
    let value = |number: i32| {
        let s = Complex::new(theta, step * (f64::from(number) + 0.5));
        let exponent = log_moment(s) - s * c;
        let (sin, cos) = exponent.im.sin_cos();
        (Complex::new(cos, sin) * exponent.re.exp() / s).re
    };
    (0..20_000).map(value).sum::<f64>() * step / core::f64::consts::PI
}

#[test]
fn limit_is_exceeded_by_noise_once_in_1e9() {
    let limit = f64::from(LIMIT);
    let (bound, _) = chernoff(limit);
    assert!((0.9e-9..1e-9).contains(&bound), "{bound}");
    let exact = exact_tail(limit);
    assert!((1e-11..1e-9).contains(&exact), "{exact}");
    // The same formula where a simulation resolves it, with the first differences alone.
    let mut random = Random::new(5);
    let (mut mean, mut above) = (1.0, 0);
    let mut last = [0.0; 2];
    for _ in 0..400_000 {
        let now = [normal(&mut random), normal(&mut random)];
        mean += WEIGHT * (0.25 * square(now[0] - last[0], now[1] - last[1]) - mean);
        above += u32::from(mean > 1.7);
        last = now;
    }
    let (found, expected) = (f64::from(above) / 400_000.0, exact_tail(1.7));
    assert!((found / expected - 1.0).abs() < 0.2, "{found} {expected}");
}

#[test]
fn readings_without_direction_are_taken_for_one_once_in_1000() {
    let mut random = Random::new(6);
    let (mut directed, mut windows) = (0, 0);
    let mut scatter = Scatter::default();
    let mut probe = ProbeScatter::NONE;
    for number in 0..1_000_000 {
        let angle = core::f32::consts::PI * random.signed();
        let now = ProbeVector { cos_um: 3.0 * angle.cos(), sin_um: 3.0 * angle.sin() };
        let weight = scatter.weigh(number > 0);
        probe.average(weight, &now, square(now.cos_um, now.sin_um));
        let [x, y] = probe.mean_um;
        if number > 100 {
            windows += 1;
            directed += u32::from(square(x, y) >= LN_1_BY_P * scatter.variance * probe.power_um2);
        }
    }
    let share = f64::from(directed) / f64::from(windows);
    // The exponential distribution is reached from below with growing numbers.
    assert!((2e-4..1.2e-3).contains(&share), "{share}");
    assert!((scatter.variance - WEIGHT / (2.0 - WEIGHT)).abs() < 1e-6);
}

#[test]
fn healthy_noise_never_scatters_even_if_greater_than_stated() {
    for (seed, factor) in [(1, 1.0), (2, 0.1), (3, 1.5), (4, 2.0), (5, 2.5)] {
        let mut sender = Sender::new(seed);
        for number in 0..50_000 {
            let dispersion = sender.send_noisy(healthy(), factor);
            assert_eq!(dispersion, Dispersion::Usual, "{factor} times, reading {number}");
        }
    }
}

#[test]
fn rounded_values_of_a_healthy_machine_never_scatter() {
    // Display values of 1 µm and 1° have a deviation of 0.14 µm along and of 0.5 % across.
    let cases = [(0.03, Some(0.01)), (0.03, Some(0.1)), (0.3, Some(1.0)), (0.15, None)];
    for (number, (floor_um, step_um)) in cases.into_iter().enumerate() {
        let mut sender = Sender::new(number as u64);
        sender.noise.floor_um = floor_um;
        // Values on an edge move most.
        let vectors =
            [(5.5, 1.5), (-3.0, 2.5), (0.25, 8.25), (-4.5, -4.0)].map(|(re, im)| Complex::new(re, im));
        for step in 0..20_000 {
            let reading = rounded(&sender.noisy(vectors, 1.0), step_um);
            assert_eq!(sender.send(&reading), Dispersion::Usual, "case {number}, reading {step}");
        }
    }
}

#[test]
fn fivefold_noise_is_seen_within_30_readings() {
    for (before, seed) in [(0, 1), (10, 2), (60, 3), (300, 4), (3000, 5)] {
        let mut sender = Sender::after(before, seed);
        let seen = (0..30).position(|_| sender.send_noisy(healthy(), 5.0) == Dispersion::Excessive);
        assert!(seen.is_some(), "after {before}");
        // A direction is there all the same, and the past does not follow.
        for _ in 0..5000 {
            assert_ne!(sender.send_noisy(healthy(), 5.0), Dispersion::NoDirection);
        }
        let lasting =
            (0..1000).filter(|_| sender.send_noisy(healthy(), 5.0) == Dispersion::Excessive).count();
        assert!(lasting > 990, "after {before}: {lasting}");
    }
}

#[test]
fn noise_as_great_as_the_vibration_is_seen_within_12_readings() {
    let mut sender = Sender::after(100, 7);
    let seen = (0..12).position(|_| sender.send_noisy(healthy(), 50.0) != Dispersion::Usual);
    assert!(seen.is_some());
}

#[test]
fn random_angle_of_each_reading_has_no_direction() {
    for noise in [NOISE, Noise::default()] {
        let mut sender = Sender { noise, ..Sender::after(100, 8) };
        let mut found = Vec::new();
        for _ in 0..1000 {
            let angle = sender.angle();
            found.push(sender.send_noisy(healthy().map(|phasor| phasor * angle), 1.0));
        }
        assert!(found.iter().take(8).any(|&dispersion| dispersion != Dispersion::Usual), "{found:?}");
        assert!(found.iter().take(50).any(|&dispersion| dispersion == Dispersion::NoDirection));
        let blind =
            found.iter().skip(60).filter(|&&dispersion| dispersion == Dispersion::NoDirection).count();
        assert!(blind > 900, "{blind}");
        assert!(found.iter().skip(10).all(|&dispersion| dispersion != Dispersion::Usual));
        // In order again: within 30 readings.
        let usual = (0..30).position(|_| sender.send_noisy(healthy(), 1.0) == Dispersion::Usual);
        assert!(usual.is_some());
    }
}

#[test]
fn jumps_between_two_marks_are_seen() {
    for (seed, turn_deg) in [(9, 90.0_f32), (10, 45.0), (11, 180.0)] {
        let mut sender = Sender::after(100, seed);
        let turned = healthy().map(|phasor| phasor * turn(turn_deg));
        let mut seen = 0;
        for _ in 0..115 {
            let vectors = if sender.random.signed() > 0.0 { turned } else { healthy() };
            seen += u32::from(sender.send_noisy(vectors, 1.0) != Dispersion::Usual);
        }
        assert!(seen > 95, "{turn_deg}: {seen} of 115");
    }
}

#[test]
fn scatter_of_one_probe_is_seen_and_is_not_blind() {
    let mut sender = Sender::after(100, 12);
    let mut seen = 0;
    for _ in 0..100 {
        let mut vectors = healthy();
        vectors[2] *= sender.angle();
        let dispersion = sender.send_noisy(vectors, 1.0);
        assert_ne!(dispersion, Dispersion::NoDirection);
        seen += u32::from(dispersion == Dispersion::Excessive);
    }
    assert!(seen > 85, "{seen}");
}

#[test]
fn steps_and_ramps_of_a_healthy_machine_do_not_scatter() {
    // 15 % of an amplitude a hundred times the noise and more, at once and over ten to a thousand readings.
    let mut sender = Sender::after(100, 13);
    for (number, readings) in [1, 10, 100, 1000].into_iter().cycle().take(40).enumerate() {
        for step in 0..=readings {
            let part = step as f32 / readings as f32;
            let factor = if number % 2 == 0 { 1.0 + 0.15 * part } else { 1.15 - 0.15 * part };
            let vectors = healthy().map(|phasor| phasor * factor);
            assert_eq!(sender.send_noisy(vectors, 0.1), Dispersion::Usual, "{readings} readings");
        }
        assert!((0..30).all(|_| {
            sender.send_noisy(healthy().map(|p| p * if number % 2 == 0 { 1.15 } else { 1.0 }), 0.1)
                == Dispersion::Usual
        }));
    }
}

#[test]
fn a_weight_on_the_opposite_side_is_not_blind() {
    let mut sender = Sender::after(100, 14);
    for _ in 0..100 {
        assert_eq!(sender.send_noisy(healthy().map(|phasor| -phasor), 1.0), Dispersion::Usual);
    }
}

/// A vector through a resonance at 9,000 rpm with an amplification of 8.
fn resonant(speed_rpm: f32) -> Complex<f32> {
    let ratio = speed_rpm / 9000.0;
    Complex::new(2.0 * ratio * ratio, 0.0) / Complex::new(1.0 - ratio * ratio, ratio / 8.0)
}

#[test]
fn run_ups_through_a_resonance_do_not_scatter() {
    // From 1,000 to 30 readings from a third below to a third above.
    for readings in [1000, 300, 100, 30] {
        let mut sender = Sender::new(15);
        for run in 0..20 {
            for step in 0..=readings {
                let part = step as f32 / readings as f32;
                let speed_rpm = 6000.0 + 6000.0 * if run % 2 == 0 { part } else { 1.0 - part };
                let vectors = [1.0, 0.5, -0.8, 2.0].map(|factor| resonant(speed_rpm) * factor);
                let mut reading = sender.noisy(vectors, 1.0);
                reading.speed_rpm = speed_rpm;
                assert_eq!(sender.send(&reading), Dispersion::Usual, "{readings} readings, {speed_rpm} rpm");
            }
        }
    }
}

#[test]
fn speed_that_varies_within_tolerance_does_not_scatter() {
    let mut sender = Sender::new(16);
    for _ in 0..20_000 {
        // 16 % above the resonance, as far as it may be.
        let speed_rpm = 10_440.0 * (1.0 + 0.002 * sender.random.signed());
        let vectors = [1.0, 0.5, -0.8, 2.0].map(|factor| resonant(speed_rpm) * factor);
        let mut reading = sender.noisy(vectors, 1.0);
        reading.speed_rpm = speed_rpm;
        assert_eq!(sender.send(&reading), Dispersion::Usual);
    }
}

#[test]
fn nothing_that_arrives_makes_a_number_that_is_none() {
    let mut sender = Sender::new(17);
    for (number, value) in [0.0, 1e-30, 1e4, f32::NAN, -1e4, 0.0].into_iter().cycle().take(600).enumerate() {
        let vector = ProbeVector { cos_um: value, sin_um: -value };
        let speed_rpm = [9000.0, 9001.0, 600.0, 1e9][number % 4];
        sender.send(&Reading::new(speed_rpm, &[vector; 8]).unwrap());
        for probe in &sender.scatter.probes {
            assert!(probe.square.is_finite() && probe.level.is_finite() && probe.power_um2.is_finite());
        }
    }
}

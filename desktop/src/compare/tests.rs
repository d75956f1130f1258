//! The comparison against closed forms, and its error rates on synthetic noise.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::*;
use crate::testing::uniform_shaft;

const NOISE: Noise =
    Noise { relative: 0.0, floor_um: 0.1, scale: None, correlation: None, between_runs: None };
const SPEEDS: usize = 50;

/// Two standard normal numbers.
fn normal_pair(random: &mut StdRng) -> C {
    C::new(random.sample(StandardNormal), random.sample(StandardNormal))
}

/// A smooth forward response of the four probes AX, AY, BX, BY, m.
fn truth(row: usize) -> Vec<C> {
    let at = |size_um: f64| C::from_polar(size_um * 1e-6, -0.05 * row as f64);
    let (a, b) = (at(5.0), at(3.0));
    vec![a, -C::i() * a, b, -C::i() * b]
}

fn reading(row: usize, probes: &[C]) -> Reading {
    let speed_rpm = 1000.0 + 100.0 * row as f64;
    Reading { speed_rpm, probes: probes.iter().copied().map(Some).collect(), ..Reading::default() }
}

fn predicted() -> Vec<Vec<C>> {
    (0..SPEEDS).map(truth).collect()
}

/// Truth, noise and a runout at each probe in standard deviations.
fn measured(seed: u64, runout_sigmas: [f64; 4]) -> Vec<Reading> {
    let mut random = StdRng::seed_from_u64(seed);
    let sigma_m = NOISE.floor_um * 1e-6;
    let mut value = |(y, runout): (&C, &f64)| y + (normal_pair(&mut random) + runout) * sigma_m;
    (0..SPEEDS)
        .map(|row| reading(row, &truth(row).iter().zip(&runout_sigmas).map(&mut value).collect::<Vec<_>>()))
        .collect()
}

fn compare(readings: &[Reading]) -> Comparison {
    Comparison::new(&uniform_shaft(), readings, &predicted(), &NOISE, 0)
}

#[test]
fn sums_of_a_known_difference_follow_by_hand() {
    let um = |re: f64, im: f64| C::new(re, im) * 1e-6;
    let mut readings = vec![reading(0, &[um(3.0, 4.0), um(0.0, 2.0), um(1.0, 0.0), um(1.0, 1.0)])];
    readings[0].probes[3] = None;
    let model = vec![vec![um(3.3, 4.0), um(0.0, 2.0), um(1.0, -0.4), um(9.0, 9.0)]];
    let c = Comparison::new(&uniform_shaft(), &readings, &model, &NOISE, 2);
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} is not {b}");
    near(c.residual_um.sum, 0.7);
    near(c.residual_um.mean, 0.7);
    near(c.residual_ratio, 0.7 / 10.0);
    near(c.relative_error, (0.25_f64 / 30.0).sqrt());
    near(c.chi2_per_value, 25.0 / 6.0);
    assert_eq!((c.values, c.degrees_of_freedom), (6, 4));
    // χ² with four degrees of freedom: (1 + x/2) e^{-x/2}
    near(c.chi2_p_value, (1.0 + 12.5) * (-12.5_f64).exp());
    let worst = c.worst.unwrap();
    assert_eq!((worst.probe.as_str(), worst.speed_rpm), ("BX", 1000.0));
    near(worst.error_um, 0.4);
    near(worst.error_sigmas, 4.0);
    near(c.by_probe[0].residual_um, 0.3);
    near(c.by_probe[0].relative_error, 0.06);
    assert!(c.standardised[0][3].is_none());
}

#[test]
fn a_lost_record_is_compared_without_dividing_by_nothing() {
    let mut readings = vec![reading(0, &truth(0))];
    readings[0].probes = vec![None; 4];
    let c = Comparison::new(&uniform_shaft(), &readings, &[truth(0)], &NOISE, 4);
    assert_eq!((c.values, c.worst, c.relative_error), (0, None, 0.0));
    assert_eq!((c.chi2_p_value, c.verdict, c.reversed), (1.0, Adequacy::Adequate, false));
}

#[test]
fn noise_alone_is_called_physics_at_the_nominal_rate() {
    const SEEDS: u64 = 4000;
    let (mut size, mut structure, mut either) = (0.0, 0.0, 0.0);
    let (mut z, mut z2, mut reversed) = (0.0, 0.0, 0);
    for seed in 0..SEEDS {
        let c = compare(&measured(seed, [0.0; 4]));
        size += f64::from(u8::from(c.chi2_p_value < SIGNIFICANCE));
        structure += f64::from(u8::from(c.neighbours.p_value < SIGNIFICANCE));
        either += f64::from(u8::from(c.verdict == Adequacy::Misses));
        z += c.neighbours.z_score;
        z2 += c.neighbours.z_score.powi(2);
        reversed += u32::from(c.reversed);
    }
    let n = SEEDS as f64;
    // four standard deviations of a count with this chance
    let around = |count: f64, chance: f64| {
        let allowed = 4.0 * (n * chance).sqrt();
        assert!((count - n * chance).abs() < allowed, "{count} of {n}, expected {}", n * chance);
    };
    around(size, SIGNIFICANCE);
    around(structure, SIGNIFICANCE);
    around(either, 1.0 - (1.0 - SIGNIFICANCE).powi(2));
    assert!((z / n).abs() < 4.0 / n.sqrt(), "mean of z {}", z / n);
    assert!((z2 / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "variance of z {}", z2 / n);
    assert_eq!(reversed, 0);
}

#[test]
fn residual_correlation_is_independent_of_stated_noise() {
    let readings = measured(5, [0.0; 4]);
    let loud = Noise {
        relative: 0.0,
        floor_um: 10.0 * NOISE.floor_um,
        scale: None,
        correlation: None,
        between_runs: None,
    };
    let as_stated = compare(&readings);
    let overstated = Comparison::new(&uniform_shaft(), &readings, &predicted(), &loud, 0);
    assert!((as_stated.neighbours.correlation - overstated.neighbours.correlation).abs() < 1e-12);
    assert!((as_stated.chi2_per_value / overstated.chi2_per_value - 100.0).abs() < 1e-9);
}

#[test]
fn a_runout_of_three_sigma_is_found_at_its_probe() {
    const SEEDS: u64 = 20;
    let mut correlation = 0.0;
    for seed in 0..SEEDS {
        let c = compare(&measured(seed, [0.0, 0.0, 3.0, 0.0]));
        assert_eq!(c.verdict, Adequacy::Misses);
        assert!(c.chi2_p_value < SIGNIFICANCE && c.neighbours.p_value < SIGNIFICANCE);
        let worst = c.by_probe.iter().max_by(|a, b| a.chi2_per_value.total_cmp(&b.chi2_per_value)).unwrap();
        assert_eq!(worst.probe, "BX");
        let series = c.neighbours.series.iter().max_by(|a, b| a.z_score.total_cmp(&b.z_score)).unwrap();
        assert_eq!(series.probe, "BX");
        correlation += series.correlation / SEEDS as f64;
    }
    // white noise around a constant m in one of two components: r = m² / (2 + m²), less its missing end
    let expected = 9.0 / 11.0 * (1.0 - 1.0 / SPEEDS as f64);
    assert!((correlation - expected).abs() < 0.03, "{correlation}, expected {expected}");
}

#[test]
fn residual_structure_is_found_with_overstated_noise() {
    let mut readings = measured(3, [0.0; 4]);
    for (row, r) in readings.iter_mut().enumerate() {
        let smooth = C::from_polar(0.5e-7, 0.2 * row as f64);
        for (probe, truth) in r.probes.iter_mut().zip(truth(row)) {
            *probe = probe.map(|y| truth + (y - truth) * 0.5 + smooth);
        }
    }
    let c = compare(&readings);
    assert!(c.chi2_per_value < 0.6 && c.chi2_p_value > 0.5);
    assert_eq!(c.verdict, Adequacy::Misses);
}

#[test]
fn whirl_of_any_two_probes_is_that_of_x_and_y() {
    let (x, y) = (C::new(1.0, -2.0), C::new(0.5, 0.7));
    for [a, b] in [[0.0, 90.0], [45.0, 135.0], [-45.0, 45.0], [30.0, 75.0], [90.0, 0.0]] {
        let mut rotor = uniform_shaft();
        (rotor.probe[0].angle_deg, rotor.probe[1].angle_deg) = (a, b);
        let read = [a, b].map(|d: f64| x * d.to_radians().cos() + y * d.to_radians().sin());
        let [forward, backward] = probe_pairs(&rotor)[0].whirl(read);
        assert!((forward - (x + C::i() * y) / 2.0).norm() < 1e-12);
        assert!((backward - (x - C::i() * y) / 2.0).norm() < 1e-12);
    }
}

#[test]
fn parallel_probes_are_no_pair() {
    let mut rotor = uniform_shaft();
    (rotor.probe[0].angle_deg, rotor.probe[1].angle_deg) = (30.0, 210.0);
    let pairs = probe_pairs(&rotor);
    assert_eq!(pairs.len(), 1);
    assert_eq!(pairs[0].bearing, 1);
}

#[test]
fn forward_circle_has_no_backward_whirl_and_one_sigma_noise() {
    let c = compare(&measured(11, [0.0; 4]));
    let w = &c.whirl[0];
    assert_eq!((w.bearing.as_str(), w.probes[1].as_str()), ("A", "AY"));
    assert!((w.forward.model_um - 5.0).abs() < 1e-9 && w.backward.model_um < 1e-9);
    for part in c.whirl.iter().flat_map(|w| [w.forward, w.backward]) {
        assert!((part.error_sigmas - 1.0).abs() < 0.3, "{}", part.error_sigmas);
        // σ of (x + i y)/2 is that of a probe over √2; both components together √2 of that
        assert!((part.error_um - NOISE.floor_um * part.error_sigmas).abs() < 1e-9);
    }
}

#[test]
fn reversed_phases_and_swapped_probes_are_detected() {
    let right = measured(1, [0.0; 4]);
    assert!(!compare(&right).reversed);
    let mut conjugate = right.clone();
    for y in conjugate.iter_mut().flat_map(|r| r.probes.iter_mut().flatten()) {
        *y = y.conj();
    }
    assert!(compare(&conjugate).reversed);
    let mut exchanged = right.clone();
    for r in &mut exchanged {
        r.probes.swap(0, 1);
        r.probes.swap(2, 3);
    }
    assert!(compare(&exchanged).reversed);
    let mut one_bearing = right;
    for r in &mut one_bearing {
        r.probes.swap(0, 1);
    }
    assert!(!compare(&one_bearing).reversed, "one bearing alone can whirl backward");
}

#[test]
fn speeds_come_ascending_by_run_and_many_are_gathered() {
    let rows = 300;
    let mut readings: Vec<Reading> = (0..rows).rev().map(|row| reading(row, &truth(row))).collect();
    for r in &mut readings[..100] {
        r.run = Some("first".into());
    }
    let model: Vec<Vec<C>> = (0..rows).rev().map(truth).collect();
    let c = Comparison::new(&uniform_shaft(), &readings, &model, &NOISE, 0);
    assert_eq!(c.by_run.iter().map(|r| r.readings).collect::<Vec<_>>(), [100, 200]);
    for run in [Some("first".to_string()), None] {
        let speeds: Vec<&SpeedMisfit> = c.by_speed.iter().filter(|s| s.run == run).collect();
        assert!(speeds.len() <= MOST_SPEEDS && speeds.len() > MOST_SPEEDS / 2);
        assert!(speeds.windows(2).all(|w| w[0].speed_rpm < w[1].speed_rpm));
    }
    assert_eq!(c.by_speed.iter().map(|s| s.readings).sum::<usize>(), rows);
    assert!(c.relative_error == 0.0 && c.verdict == Adequacy::Adequate);
}

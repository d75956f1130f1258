use nalgebra::Complex;
use rand::{Rng, SeedableRng, rngs::StdRng};
use rand_distr::StandardNormal;

use super::circle::circle;
use super::estimate::{AmplitudeShift, OwnUnbalance, RunEstimates};
use super::half_power::half_power;
use super::least_squares::least_squares;
use super::series::{Point, RunUp, directions, series};
use super::shaft::ShaftSpring;
use super::*;
use crate::machine::drawing::{Disk, Physics};
use crate::testing::uniform_shaft;
use crate::units::rad_s;

type C = Complex<f64>;

/// Eccentricity of the test oscillators, m.
const ECCENTRICITY_M: f64 = 3e-5;

fn start_up(modal: Modal, speeds_rpm: impl Iterator<Item = f64>, sigma_m: f64) -> Vec<Point> {
    let force = C::from_polar(ECCENTRICITY_M, 0.7);
    let at = |speed_rpm: f64| {
        let speed_rad_s = rad_s(speed_rpm);
        Point { speed_rad_s, motion_m: force * modal.per_eccentricity(speed_rad_s), sigma_m }
    };
    speeds_rpm.map(at).collect()
}

fn steps(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    (0..=((to - from) / step).round() as usize).map(move |i| from + i as f64 * step)
}

fn at_1700(damping_ratio: f64) -> Modal {
    Modal { natural_rad_s: rad_s(1700.0), damping_ratio }
}

fn assert_near(found: Modal, truth: Modal, tolerance: f64, what: &str) {
    assert!(
        (found.natural_rad_s / truth.natural_rad_s - 1.0).abs() < tolerance,
        "{what}: {found:?} {truth:?}"
    );
    assert!(
        (found.damping_ratio / truth.damping_ratio - 1.0).abs() < tolerance,
        "{what}: {found:?} {truth:?}"
    );
}

#[test]
fn all_three_methods_recover_closed_form_oscillator() {
    for damping in [0.01, 0.05, 0.15, 0.3, 0.37] {
        for step in [25.0, 50.0, 180.0] {
            let truth = at_1700(damping);
            let points = start_up(truth, steps(300.0, 12_000.0, step), 1e-12);
            // between steps far wider than its peak, a resonance shows in three readings at best
            if damping < 0.05 && step > 50.0 {
                continue;
            }
            assert_near(half_power(&points).unwrap().modal, truth, 1e-6, "half power");
            assert_near(least_squares(&points).unwrap().modal(), truth, 1e-6, "least squares");
            assert_near(circle(&points).unwrap(), truth, 1e-6, "circle");
        }
    }
}

#[test]
fn half_power_formula_holds_only_for_light_damping() {
    let ratio = |damping: f64| {
        let points = start_up(at_1700(damping), steps(300.0, 12_000.0, 10.0), 1e-12);
        half_power(&points).unwrap().light_damping_ratio / damping
    };
    assert!((ratio(0.01) - 1.0).abs() < 1e-3);
    // ½ (√(1/(cos 2φ − sin 2φ)) − √(1/(cos 2φ + sin 2φ))) √cos 2φ, φ = asin 0.3
    let double_phi = 2.0 * 0.3_f64.asin();
    let (c, s) = (double_phi.cos(), double_phi.sin());
    let closed = 0.5 * ((c - s).sqrt().recip() - (c + s).sqrt().recip()) * c.sqrt() / 0.3;
    assert!((ratio(0.3) / closed - 1.0).abs() < 1e-6 && closed > 1.3, "{closed}");
}

#[test]
fn missing_half_power_point_is_reported_and_fit_still_works() {
    let truth = at_1700(0.42);
    let points = start_up(truth, steps(300.0, 12_000.0, 50.0), 1e-8);
    let why = half_power(&points).unwrap_err();
    assert!(why.contains("the upper half-power point lies outside the data"), "{why}");
    assert_near(least_squares(&points).unwrap().modal(), truth, 1e-6, "least squares");
    let cut = start_up(at_1700(0.1), steps(1600.0, 4000.0, 20.0), 1e-8);
    assert!(half_power(&cut).unwrap_err().contains("the lower half-power point lies outside the data"));
}

#[test]
fn start_up_below_resonance_or_in_noise_has_no_resonance() {
    let rising = start_up(at_1700(0.05), steps(300.0, 1500.0, 25.0), 1e-8);
    let why = half_power(&rising).unwrap_err();
    assert!(why.starts_with("no resonance between 300 and 1500 rpm") && why.ends_with("run faster"), "{why}");
    let drowned = start_up(at_1700(0.05), steps(300.0, 4000.0, 25.0), 1e-3);
    assert!(half_power(&drowned).unwrap_err().contains("no speed stands out of the noise"));
    assert!(half_power(&[]).is_err());
}

#[test]
fn stated_uncertainties_are_what_repeated_noise_scatters_by() {
    const DRAWS: usize = 60;
    let truth = at_1700(0.06);
    let clean = start_up(truth, steps(500.0, 4000.0, 50.0), 0.0);
    let mut random = StdRng::seed_from_u64(7);
    let mut sums = [[0.0; 2]; 3];
    for _ in 0..DRAWS {
        let noisy: Vec<Point> = clean
            .iter()
            .map(|p| {
                let sigma_m = 1.5e-7 + 0.01 * p.motion_m.norm();
                let noise = C::new(random.sample(StandardNormal), random.sample(StandardNormal)) * sigma_m;
                Point { motion_m: p.motion_m + noise, sigma_m, ..*p }
            })
            .collect();
        let seen = RunEstimates::of(&noisy);
        for (method, sums) in sums.iter_mut().enumerate() {
            let found = seen.found(method).unwrap();
            let off = [
                found.modal.natural_rad_s - truth.natural_rad_s,
                found.modal.damping_ratio - truth.damping_ratio,
            ];
            for (i, sum) in sums.iter_mut().enumerate() {
                *sum += off[i].powi(2) / found.covariance[(i, i)] / DRAWS as f64;
            }
        }
    }
    // a mean of 60 squared standard normal numbers scatters by √(2/60) = 0.18
    for sums in sums {
        assert!(sums.iter().all(|s| (0.45..1.65).contains(s)), "{sums:?}");
    }
}

fn kit(disk_at_m: f64, bearings_m: [f64; 2], angles_deg: [f64; 2]) -> Rotor {
    let mut rotor = uniform_shaft();
    rotor.physics = Physics { shear_deformation: false, ..Physics::default() };
    rotor.disk = vec![Disk {
        name: "disk".into(),
        position_m: disk_at_m,
        mass_kg: 0.8,
        diametral_inertia_kg_m2: 3e-4,
        polar_inertia_kg_m2: 5e-4,
    }];
    rotor.bearing.iter_mut().zip(bearings_m).for_each(|(b, z)| b.position_m = z);
    rotor.probe.iter_mut().zip(angles_deg.into_iter().cycle()).for_each(|(p, a)| p.angle_deg = a);
    rotor
}

#[test]
fn shaft_spring_equals_beam_theory_at_midspan_and_overhang() {
    let bending = 2.08e11 * std::f64::consts::PI * 0.05_f64.powi(4) / 64.0;
    let stiffness = |z: f64, bearings: [f64; 2]| {
        let rotor = kit(z, bearings, [0.0, 90.0]);
        ShaftSpring::of(&rotor, &rotor.disk[0]).unwrap()
    };
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-8, "{a} {b}");
    near(stiffness(0.5, [0.0, 1.0]).stiffness_n_m, 48.0 * bending);
    let (a, b) = (0.2_f64, 0.6_f64);
    near(stiffness(0.3, [0.1, 0.9]).stiffness_n_m, 3.0 * bending * (a + b) / (a * a * b * b));
    let (span, beyond) = (0.7_f64, 0.2_f64);
    near(stiffness(1.0, [0.1, 0.8]).stiffness_n_m, 3.0 * bending / (beyond * beyond * (span + beyond)));
    // 17/35 of a uniform shaft's mass moves with a disk in its middle
    let shaft_kg = 7850.0 * std::f64::consts::PI * 0.05_f64.powi(2) / 4.0;
    let spring = stiffness(0.5, [0.0, 1.0]);
    assert!((spring.effective_mass_kg - 0.8 - 17.0 / 35.0 * shaft_kg).abs() < 1e-2 * shaft_kg);
    near(spring.rotor_mass_kg, 0.8 + shaft_kg);
    let rotor = kit(0.1, [0.1, 0.9], [0.0, 90.0]);
    assert!(ShaftSpring::of(&rotor, &rotor.disk[0]).unwrap_err().to_string().contains("sits on a bearing"));
}

#[test]
fn two_springs_in_series_are_taken_apart_again() {
    let spring = ShaftSpring { stiffness_n_m: 4e4, effective_mass_kg: 1.0, rotor_mass_kg: 1.0 };
    let together = 1.0 / (1.0 / 4e4 + 1.0 / 9e4);
    assert!((spring.in_series_with_n_m(together).unwrap() / 9e4 - 1.0).abs() < 1e-12);
    assert_eq!(spring.in_series_with_n_m(4.1e4), None);
}

#[test]
fn probes_at_any_angle_show_the_same_x_and_y() {
    let motion = [C::new(3e-6, -1e-6), C::new(-2e-6, 2e-6)];
    let noise = Noise { relative: 0.0, floor_um: 0.1, ..Noise::default() };
    for angles in [[0.0, 90.0], [45.0, 135.0], [-30.0, 50.0]] {
        let rotor = kit(0.5, [0.0, 1.0], angles);
        let seen = rotor.probe.iter().map(|p| {
            let a = p.angle_deg.to_radians();
            Some(motion[0] * a.cos() + motion[1] * a.sin())
        });
        let reading = Reading { speed_rpm: 1000.0, probes: seen.collect(), ..Reading::default() };
        let readings = [reading];
        let run = &RunUp::all(&rotor, &readings)[0];
        let all = directions(&rotor);
        assert_eq!(all.iter().map(|d| d.label.as_str()).collect::<Vec<_>>(), ["A x", "A y", "B x", "B y"]);
        for (d, direction) in all.iter().enumerate() {
            let point = series(&readings, &noise, run, direction)[0];
            assert!((point.motion_m - motion[d % 2]).norm() < 1e-18);
        }
        // a rotation leaves the noise of two probes as it is, another angle between them raises it
        let square = |d: usize| series(&readings, &noise, run, &all[d])[0].sigma_m.powi(2);
        let expected = 2e-14 / (angles[1] - angles[0]).to_radians().sin().powi(2);
        assert!(((square(0) + square(1)) / expected - 1.0).abs() < 1e-9);
    }
    let mut alone = kit(0.5, [0.0, 1.0], [30.0, 90.0]);
    alone.probe.remove(1);
    let all = directions(&alone);
    assert_eq!(all[0].label, "AX");
    assert!((all[0].angle_rad.to_degrees() - 30.0).abs() < 1e-9);
}

/// Runs of an oscillator whose stiffness grows with its own peak squared, with known weights.
fn runs_of(softening_per_m2: f64, own_kg_m: C, mass_kg: f64) -> (Vec<RunUp>, Vec<Vec<RunEstimates>>) {
    let weights = [0.0, 1.2e-5, 2.4e-5, 3.6e-5].map(C::from);
    let of = |added: C| {
        let damping_ratio = 0.08;
        let force = (own_kg_m + added) / mass_kg;
        let peak = force.norm() / (2.0 * damping_ratio);
        let natural_rad_s = rad_s(1700.0) * (1.0 + softening_per_m2 * peak * peak).sqrt();
        let modal = Modal { natural_rad_s, damping_ratio };
        let points: Vec<Point> = steps(500.0, 4200.0, 50.0)
            .map(|rpm| {
                let speed_rad_s = rad_s(rpm);
                let motion_m = force * modal.per_eccentricity(speed_rad_s);
                Point { speed_rad_s, motion_m, sigma_m: 1.5e-7 + 0.01 * motion_m.norm() }
            })
            .collect();
        (
            RunUp { name: Some(format!("{added}")), added_kg_m: added, rows: Vec::new() },
            vec![RunEstimates::of(&points)],
        )
    };
    weights.into_iter().map(of).unzip()
}

#[test]
fn amplitude_dependent_resonance_is_detected() {
    let shift = |softening: f64| {
        let (_, seen) = runs_of(softening, C::from_polar(3e-6, 1.0), 0.95);
        AmplitudeShift::of(seen.iter().map(|run| &run[0])).unwrap()
    };
    let [soft, linear, hard] = [-1e6, 0.0, 1e6].map(|kappa| shift(kappa).natural_rad_s);
    assert!(
        soft.sigmas < -5.0 && linear.sigmas.abs() < 0.1 && hard.sigmas > 5.0,
        "{soft:?} {linear:?} {hard:?}"
    );
    assert!((soft.at_rest.value / rad_s(1700.0) - 1.0).abs() < 2e-3);
    assert!(soft.at_largest < soft.at_rest.value);
    assert!(shift(-1e6).damping_ratio.sigmas.abs() < 0.1, "this oscillator's damping ratio stays");
}

#[test]
fn known_trial_weights_give_unbalance_and_modal_mass() {
    let own = C::from_polar(3e-6, 1.0);
    let (runs, seen) = runs_of(0.0, own, 0.95);
    let rotor = kit(0.5, [0.0, 1.0], [0.0, 90.0]);
    let along_x = &directions(&rotor)[..1];
    let found = OwnUnbalance::of(&runs, &[true; 4], along_x, &seen).unwrap();
    assert!((found.unbalance_kg_m - own).norm() < 1e-4 * own.norm());
    assert!((found.modal_mass_kg - 0.95).abs() < 1e-4);
    assert!(OwnUnbalance::of(&runs[..1], &[true], along_x, &seen[..1]).is_none(), "one run cannot tell");
}

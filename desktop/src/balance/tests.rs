use nalgebra::{Complex, DVector};
use rand::{Rng, SeedableRng, rngs::StdRng};
use rand_distr::StandardNormal;

use super::model::from_model;
use super::optimum::Criterion;
use super::places::Holes;
use super::trial_runs::from_trial_runs;
use super::weights::Allowed;
use super::*;
use crate::grade::{Rigid, largest_plausible_g_mm, permissible_g_mm};
use crate::machine::drawing::{AddedUnbalance, Disk, Noise, Rated, Run, Tolerance};
use crate::machine::tolerance::Deviations;
use crate::measurement::Reading;
use crate::model::Model;
use crate::testing::{sample_rotor, uniform_shaft};
use crate::unbalance::{G_MM, phasor_kg_m};
use crate::units::SAME_SPEED;
use crate::units::rad_s;

type C = Complex<f64>;

/// What the machine hides: g·mm and degrees in each plane.
const OWN: [[f64; 2]; 2] = [[900.0, 35.0], [600.0, -110.0]];

fn own_kg_m() -> Vec<C> {
    OWN.map(|[size, angle]| phasor_kg_m(size, angle)).to_vec()
}

/// A machine with a run without weights and one with a trial weight in each plane.
fn machine() -> Rotor {
    let mut rotor = sample_rotor();
    rotor.noise = Some(Noise { relative: 0.01, floor_um: 0.02, ..Noise::default() });
    let weight = |plane: usize, magnitude_g_mm: f64, angle_deg: f64| AddedUnbalance {
        position_m: rotor.plane[plane].position_m,
        magnitude_g_mm,
        angle_deg,
    };
    let run = |name: &str, added_unbalance| Run { name: name.into(), added_unbalance, slow_roll: false };
    rotor.run = vec![
        run("as found", vec![]),
        run("trial 1", vec![weight(0, 800.0, 0.0)]),
        run("trial 2", vec![weight(1, 800.0, 90.0)]),
    ];
    rotor
}

/// Vibration of the true machine with its own unbalance and weights, at one speed.
fn response(model: &Model, rotor: &Rotor, added: &[AddedUnbalance], speed_rpm: f64) -> DVector<C> {
    let mut all = own_kg_m();
    for a in added {
        let plane = rotor.plane.iter().position(|p| p.position_m == a.position_m).unwrap();
        all[plane] += phasor_kg_m(a.magnitude_g_mm, a.angle_deg);
    }
    model.response(rad_s(speed_rpm)).unwrap().at(&DVector::from_vec(all))
}

fn measured(rotor: &Rotor, seed: Option<u64>) -> Vec<Reading> {
    let model = Model::finite_elements(rotor);
    let noise = rotor.noise.unwrap();
    let mut random = StdRng::seed_from_u64(seed.unwrap_or(0));
    let mut readings = Vec::new();
    for run in &rotor.run {
        for step in 0..28 {
            let speed_rpm = 1500.0 + 250.0 * f64::from(step);
            let clean = response(&model, rotor, &run.added_unbalance, speed_rpm);
            let probes = clean.iter().map(|y| {
                let sigma = noise.sigma_m(*y);
                let scatter = C::new(random.sample(StandardNormal), random.sample(StandardNormal)) * sigma;
                Some(if seed.is_some() { y + scatter } else { *y })
            });
            readings.push(Reading {
                run: Some(run.name.clone()),
                speed_rpm,
                probes: probes.collect(),
                ..Reading::default()
            });
        }
    }
    readings
}

fn plan(planes: &[usize]) -> BalancePlan {
    BalancePlan {
        planes: planes.to_vec(),
        wanted: Wanted::default(),
        range_rpm: [0.0, 1e5],
        service_rpm: 8000.0,
        same_speed: SAME_SPEED,
        interpolate: false,
    }
}

/// Vibration left on the true machine with weights in place, relative to before.
fn truly_left(rotor: &Rotor, plan: &BalancePlan, weights: &[Filling]) -> f64 {
    let model = Model::finite_elements(rotor);
    let total = |weights: &[Filling]| -> f64 {
        let added: Vec<AddedUnbalance> = plan
            .planes
            .iter()
            .zip(weights)
            .map(|(p, w)| AddedUnbalance {
                position_m: rotor.plane[*p].position_m,
                magnitude_g_mm: w.sum_g_mm().norm(),
                angle_deg: w.sum_g_mm().arg().to_degrees(),
            })
            .collect();
        (0..28).map(|i| response(&model, rotor, &added, 1500.0 + 250.0 * f64::from(i)).norm_squared()).sum()
    };
    (total(weights) / total(&[])).sqrt()
}

#[test]
fn trial_runs_without_noise_give_negative_hidden_unbalance() {
    let mut rotor = machine();
    rotor.noise = Some(Noise { relative: 1e-9, floor_um: 1e-9, ..Noise::default() });
    let found = from_trial_runs(&rotor, &measured(&rotor, None), &plan(&[0, 1])).unwrap();
    for (w, own) in found.wanted_kg_m.iter().zip(own_kg_m()) {
        assert!((w + own).norm() < 1e-9 * own.norm());
    }
    assert!(found.overall.reduction() > 1.0 - 1e-9);
    assert_eq!(found.misfit, None, "three runs for three unknowns leave nothing to judge by");
}

#[test]
fn both_methods_remove_95_percent_of_vibration_under_noise() {
    let rotor = machine();
    let readings = measured(&rotor, Some(3));
    // the file's bearings are guesses
    let mut guess = rotor.clone();
    for b in &mut guess.bearing {
        b.constants_mut().unwrap().stiffness_n_m.xx *= 1.2;
        b.constants_mut().unwrap().damping_n_s_m.yy *= 0.85;
    }
    let plan = plan(&[0, 1]);
    let model = from_model(&guess, &readings, &plan).unwrap();
    let trial = from_trial_runs(&guess, &readings, &plan).unwrap();
    for found in [&model, &trial] {
        let left = truly_left(&rotor, &plan, &found.placed);
        assert!(left < 0.05, "{left}");
        assert!(found.overall.reduction() > 0.95);
        // what is said to be left holds: within three standard deviations
        let Overall { before_m: before, after_m: after, after_sd_m: sd } = found.overall;
        assert!(left * before < after + 3.0 * sd, "{left} of {before}, said {after} ± {sd}");
        for (w, (own, sd)) in found.wanted_kg_m.iter().zip(own_kg_m().iter().zip(&found.sd_kg_m)) {
            assert!((w + own).norm() < 4.0 * sd, "{w} {own} ± {sd}");
            assert!(*sd < 0.03 * own.norm());
        }
        assert!(found.grade.after_at_most_mm_s < 0.1 * found.grade.before_mm_s);
    }
    assert!((model.misfit.unwrap().chi2_per_value - 1.0).abs() < 0.2);
}

#[test]
fn weight_sd_equals_scatter_over_repeated_noise() {
    const DRAWS: u64 = 25;
    let rotor = machine();
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..DRAWS {
        let found = from_trial_runs(&rotor, &measured(&rotor, Some(100 + seed)), &plan(&[0, 1])).unwrap();
        for ((w, own), sd) in found.wanted_kg_m.iter().zip(own_kg_m()).zip(&found.sd_kg_m) {
            sum += (w + own).norm_sqr() / (2.0 * sd * sd);
            count += 1.0;
        }
    }
    // a mean of 100 squared standard normal numbers scatters by √(2/100) = 0.14; both planes go together
    let mean = sum / count;
    assert!((0.5..1.6).contains(&mean), "{mean}");
}

#[test]
fn weight_sd_holds_at_weight_limit_and_for_min_max() {
    const DRAWS: u64 = 12;
    let rotor = machine();
    // the first plane needs 900 g·mm and may have 600
    let limits = vec![(Some(rotor.plane[0].name.clone()), 600.0)];
    for criterion in [Criterion::LeastSquares, Criterion::MinMax] {
        let plan = BalancePlan {
            wanted: Wanted { criterion, limits: limits.clone(), ..Wanted::default() },
            ..plan(&[0, 1])
        };
        type Way = fn(&Rotor, &[Reading], &BalancePlan) -> Result<Balanced, Error>;
        for (name, way) in [("model", from_model as Way), ("trial runs", from_trial_runs as Way)] {
            let all: Vec<Balanced> = (0..DRAWS)
                .map(|seed| way(&rotor, &measured(&rotor, Some(300 + seed)), &plan).unwrap())
                .collect();
            assert!(
                all.iter().all(|found| (found.wanted_kg_m[0].norm() * G_MM - 600.0).abs() < 0.6),
                "{name}"
            );
            let mean = all.iter().map(|found| found.wanted_kg_m[1]).sum::<C>() / DRAWS as f64;
            let scatter = all.iter().map(|found| (found.wanted_kg_m[1] - mean).norm_sqr()).sum::<f64>();
            let stated = all.iter().map(|found| 2.0 * found.sd_kg_m[1].powi(2)).sum::<f64>() / DRAWS as f64;
            // 22 squared standard normal numbers: 95 % of their means lie within 0.5 and 1.67
            let ratio = scatter / (DRAWS - 1) as f64 / stated;
            assert!((0.4..1.9).contains(&ratio), "{name}, {criterion:?}: {ratio}");
        }
    }
}

#[test]
fn weights_go_into_free_holes_within_limit() {
    let rotor = machine();
    let holes = Holes { count: 12, first_deg: 0.0, against_rotation: false, most: 2 };
    let first = rotor.plane[0].name.clone();
    let wanted = Wanted {
        holes: Some(holes),
        // 900 g·mm at 35 − 180 = 215° lies between holes 8 at 210° and 9 at 240°
        taken: vec![(Some(first), 8)],
        ..Wanted::default()
    };
    let plan = BalancePlan { wanted, ..plan(&[0, 1]) };
    let readings = measured(&rotor, Some(3));
    for found in [from_model(&rotor, &readings, &plan), from_trial_runs(&rotor, &readings, &plan)] {
        let found = found.unwrap();
        let numbers =
            |plane: usize| found.placed[plane].pieces.iter().map(|p| p.hole.unwrap()).collect::<Vec<_>>();
        assert_eq!(
            (numbers(0), numbers(1)),
            (vec![7, 9], vec![3, 4]),
            "70° is between holes 3 at 60° and 4 at 90°"
        );
        let reached =
            |plane: usize| (found.placed[plane].sum_g_mm() - found.wanted_kg_m[plane] * G_MM).norm();
        assert!((0..2).all(|plane| reached(plane) < 1e-6));
        assert!(truly_left(&rotor, &plan, &found.placed) < 0.05);
    }
    let there = Wanted { taken: vec![(None, 13)], ..plan.wanted };
    let why = there.check(&rotor.plane.iter().map(|p| p.name.clone()).collect::<Vec<_>>()).unwrap_err();
    assert!(why.to_string().contains("there is no hole 13, expected 1 to 12"), "{why}");
}

#[test]
fn run_ups_at_unequal_speeds_balance_when_interpolated() {
    let rotor = machine();
    let mut readings = measured(&rotor, None);
    let model = Model::finite_elements(&rotor);
    for reading in &mut readings {
        let run = rotor.run.iter().find(|run| Some(&run.name) == reading.run.as_ref()).unwrap();
        let off = 1.0 + 0.004 * run.added_unbalance.len() as f64;
        reading.speed_rpm = 4000.0 + 0.4 * (reading.speed_rpm * off - 4000.0);
        let clean = response(&model, &rotor, &run.added_unbalance, reading.speed_rpm);
        reading.probes = clean.iter().map(|y| Some(*y)).collect();
    }
    let apart = BalancePlan { same_speed: 1e-4, ..plan(&[0, 1]) };
    assert!(from_trial_runs(&rotor, &readings, &apart).is_err());
    let found =
        from_trial_runs(&rotor, &readings, &BalancePlan { interpolate: true, ..apart.clone() }).unwrap();
    assert!(
        found.remarks[0].starts_with("Runs are interpolated to the speeds of run"),
        "{:?}",
        found.remarks
    );
    for (w, own) in found.wanted_kg_m.iter().zip(own_kg_m()) {
        assert!((w + own).norm() < 0.03 * own.norm(), "{w} {own}");
    }
    assert!(truly_left(&rotor, &apart, &found.placed) < 0.05);
}

#[test]
fn one_plane_residual_agrees_between_both_methods() {
    let rotor = machine();
    let readings = measured(&rotor, Some(4));
    let plan = plan(&[0]);
    let model = from_model(&rotor, &readings, &plan).unwrap();
    let trial = from_trial_runs(&rotor, &readings, &plan).unwrap();
    assert!(model.overall.reduction() > 0.05 && model.overall.reduction() < 0.9);
    assert!((model.overall.after_m / trial.overall.after_m - 1.0).abs() < 0.03);
    assert!((model.wanted_kg_m[0] - trial.wanted_kg_m[0]).norm() < 0.03 * model.wanted_kg_m[0].norm());
    let left = truly_left(&rotor, &plan, &model.placed);
    assert!((left - (1.0 - model.overall.reduction())).abs() < 0.02, "the rest is foretold: {left}");
}

#[test]
fn runs_without_trial_weight_or_common_speeds_are_refused() {
    let mut rotor = machine();
    let readings = measured(&rotor, Some(5));
    let alone: Vec<Reading> =
        readings.iter().filter(|r| r.run.as_deref() != Some("trial 2")).cloned().collect();
    let why = from_trial_runs(&rotor, &alone, &plan(&[0, 1])).unwrap_err().to_string();
    assert!(why.starts_with("no run has a trial weight in plane \"2\""), "{why}");
    let mut apart = readings.clone();
    apart.iter_mut().filter(|r| r.run.as_deref() == Some("trial 1")).for_each(|r| r.speed_rpm *= 1.02);
    let why = from_trial_runs(&rotor, &apart, &plan(&[0, 1])).unwrap_err().to_string();
    assert!(why.contains("was measured in 3 runs with independent trial weights"), "{why}");
    // twice the same weight is no new information
    rotor.run[2].added_unbalance = rotor.run[1].added_unbalance.clone();
    assert!(from_trial_runs(&rotor, &readings, &plan(&[0, 1])).is_err());
    assert!(
        BalancePlan::planes_named(&rotor, &["3".into()])
            .unwrap_err()
            .to_string()
            .contains("there is no plane \"3\"")
    );
}

#[test]
fn weights_come_in_steps_at_the_radius_that_fits_best() {
    let wanted = phasor_kg_m(95.0, 20.0);
    let allowed = Allowed { radii_mm: vec![30.0, 25.0], step_g: Some(0.2) };
    // 3.8 g at 25 mm is 95 g·mm; 3.2 g at 30 mm is 96
    let weight = allowed.nearest(wanted);
    let [mass, radius] = weight.mass_and_radius.unwrap();
    assert!((mass - 3.8).abs() < 1e-9 && radius == 25.0);
    assert!((weight.unbalance_kg_m - wanted).norm() < 1e-12);
    let any = Allowed { radii_mm: vec![25.0, 30.0], step_g: None }.nearest(wanted);
    assert_eq!(any.mass_and_radius.unwrap()[1], 30.0, "the lightest of equals");
    assert_eq!(Allowed::default().nearest(wanted).mass_and_radius, None);
}

#[test]
fn grade_of_central_or_couple_unbalance_is_u_omega_over_m() {
    let rotor = uniform_shaft();
    let rigid = Rigid::of(&rotor);
    let mass = 7850.0 * std::f64::consts::PI * 0.05_f64.powi(2) / 4.0;
    assert!((rigid.mass_kg / mass - 1.0).abs() < 1e-9);
    // 1 g·mm/kg at 9549.3 rpm (1000 rad/s) is G 1
    let central = rigid.grade_mm_s(&[(0.5, C::from(mass * 1e-6))], 30_000.0 / std::f64::consts::PI);
    assert!((central - 1.0).abs() < 1e-9, "{central}");
    let couple = [(0.0, C::from(mass * 0.5e-6)), (1.0, C::from(-mass * 0.5e-6))];
    assert!((rigid.grade_mm_s(&couple, 30_000.0 / std::f64::consts::PI) - 1.0).abs() < 1e-9);
}

#[test]
fn grade_shares_follow_the_centre_of_mass() {
    // ISO 21940-11: the permissible unbalance is divided so that an unbalance in the plane of the centre of mass uses up
    // the shares of both bearings alike; from a heavy disk at 0.4 of the span on
    let mut rotor = uniform_shaft();
    rotor.disk.push(Disk {
        name: "heavy".into(),
        position_m: 0.4,
        mass_kg: 200.0,
        polar_inertia_kg_m2: 1.0,
        diametral_inertia_kg_m2: 0.5,
    });
    let rigid = Rigid::of(&rotor);
    let shaft_kg = 7850.0 * std::f64::consts::PI * 0.05_f64.powi(2) / 4.0;
    let centre_m = (0.4 * 200.0 + 0.5 * shaft_kg) / (200.0 + shaft_kg);
    let unbalance = C::from(rigid.mass_kg * 1e-6);
    let grade = rigid.grade_mm_s(&[(centre_m, unbalance)], 30_000.0 / std::f64::consts::PI);
    assert!((grade - 1.0).abs() < 1e-9, "{grade}");
}

#[test]
fn permissible_unbalance_is_the_standards_example() {
    // ISO 21940-11: G 2.5 at 3000 rpm is 8 g·mm/kg
    let rigid = Rigid::of(&uniform_shaft());
    let per_mass = rigid.permissible_kg_m(2.5, 3000.0) * G_MM / rigid.mass_kg;
    assert!((per_mass - 7.96).abs() < 0.01, "{per_mass}");
}

#[test]
fn permissible_unbalance_is_grade_eccentricity_times_mass() {
    let mut rotor = uniform_shaft();
    assert_eq!(permissible_g_mm(&rotor), None);
    rotor.rated = Some(Rated { speed_rpm: [500.0, 3000.0], balance_grade_mm_s: None });
    assert_eq!(largest_plausible_g_mm(&rotor), None);
    rotor.rated = Some(Rated { speed_rpm: [500.0, 3000.0], balance_grade_mm_s: Some(2.5) });
    // G 2.5 at 3000 rpm is 7.96 um, on a bar of 1 m x 50 mm of 15.4 kg
    let mass_g = 7850e3 * std::f64::consts::PI * 0.025_f64.powi(2);
    let eccentricity_mm = 2.5 / (100.0 * std::f64::consts::PI);
    let permissible = permissible_g_mm(&rotor).unwrap();
    assert!((permissible / (mass_g * eccentricity_mm) - 1.0).abs() < 1e-9, "{permissible}");
    // G 2.5, 6.3, 16, 40
    let ratio = largest_plausible_g_mm(&rotor).unwrap() / permissible;
    assert!((ratio - 40.0 / 2.5).abs() < 0.5, "{ratio}");
}

#[test]
fn trial_weights_in_plane_move_with_fitted_plane() {
    let mut rotor = machine();
    rotor.tolerance = Some(Tolerance { position_m: 0.002, ..Tolerance::default() });
    // as a file may round it
    rotor.run[1].added_unbalance[0].position_m += 4e-7;
    let readings = measured(&machine(), None);
    let drawn = from_trial_runs(&rotor, &readings, &plan(&[0, 1])).unwrap();
    let deviations = Deviations::of(&rotor);
    let t = DVector::from_fn(deviations.len(), |k, _| if k % 2 == 0 { 0.7 } else { -0.4 });
    let before = rotor.plane[0].position_m;
    deviations.build_into(&mut rotor, &t);
    assert!((rotor.plane[0].position_m - before).abs() > 1e-4);
    let moved = from_trial_runs(&rotor, &readings, &plan(&[0, 1])).unwrap();
    assert_eq!(drawn.wanted_kg_m, moved.wanted_kg_m);
}

//! A fit repeated on the same data does not count them twice.

use std::path::Path;

use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::diagnose::{add, best_fit, diagnose, improve};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;

/// A machine that differs from its drawing within stated tolerances.
fn machine(case: &str) -> (Rotor, Vec<Reading>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/machines/tolerance").join(case);
    let rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
    let readings = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
    (rotor, readings)
}

/// As another run of the program finds it: written and read again.
fn reread(rotor: &Rotor) -> Rotor {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rotor.toml");
    rotor_file::write(&path, rotor).unwrap();
    rotor_file::read(&path).unwrap()
}

/// How far a machine is from its drawing, in standard deviations squared.
fn moved(rotor: &Rotor) -> f64 {
    let tolerance = rotor.tolerance.as_ref().unwrap();
    let sd = |name: &str| match name.rsplit(' ').next().unwrap() {
        "youngs_modulus" => tolerance.modulus_relative,
        "outer_diameter" => tolerance.diameter_relative,
        "mass" => tolerance.mass_relative,
        "diametral_inertia" | "polar_inertia" => tolerance.inertia_relative,
        "position_m" => tolerance.position_m,
        other => panic!("{other}"),
    };
    tolerance.found.iter().map(|(name, by)| (by / sd(name)).powi(2)).sum()
}

fn coefficients(rotor: &Rotor) -> Vec<f64> {
    let each = |law: &Law| match law {
        Law::Constant(law) => {
            let (k, c) = (law.stiffness_n_m, law.damping_n_s_m);
            [k.xx, k.yy, c.xx, c.yy]
        }
        other => panic!("{other:?}"),
    };
    rotor.bearing.iter().flat_map(|b| each(&b.law)).collect()
}

fn assert_fixed_point(drawn: &Rotor, readings: &[Reading], first: &Rotor) {
    assert!(moved(first) > 0.5, "the data move the drawing by {:.2} sd²", moved(first));
    let mut again = reread(first);
    for repeat in 2..=5 {
        again = reread(&improve(&again, readings, |_| {}).unwrap().rotor);
        let drift = moved(&again) - moved(first);
        assert!(drift.abs() < 0.05, "repeat {repeat}: the drawing moved by {drift:.3} sd² more");
        for (now, before) in coefficients(&again).into_iter().zip(coefficients(first)) {
            assert!(
                (now / before - 1.0).abs() < 1e-3,
                "repeat {repeat}: a bearing went from {before:e} to {now:e}"
            );
        }
    }
    let stated = again.as_stated();
    assert_eq!(coefficients(&stated), coefficients(drawn));
    for (now, before) in stated.shaft.iter().zip(&drawn.shaft) {
        assert!((now.outer_diameter_m / before.outer_diameter_m - 1.0).abs() < 1e-14);
    }
    for (now, before) in stated.probe.iter().zip(&drawn.probe) {
        assert!((now.position_m - before.position_m).abs() < 1e-14);
    }
}

#[test]
fn improving_complete_model_5_times_equals_improving_once() {
    let (drawn, readings) = machine("case-003");
    let first = improve(&drawn, &readings, |_| {}).unwrap().rotor;
    assert_fixed_point(&drawn, &readings, &first);
}

#[test]
fn improving_with_effect_5_times_equals_improving_once() {
    let (drawn, readings) = machine("case-004");
    let first = add(&drawn, &readings, "pedestal", Some("NDE")).unwrap().rotor;
    assert_fixed_point(&drawn, &readings, &first);
}

#[test]
fn a_model_that_remembers_its_noise_is_judged_as_before() {
    let (mut rotor, readings) = machine("case-003");
    let noise = rotor.noise.as_mut().unwrap();
    (noise.relative, noise.floor_um) = (noise.relative / 1.5, noise.floor_um / 1.5);
    let (before, verdict) =
        (best_fit(&rotor, &readings).unwrap(), diagnose(&rotor, &readings).unwrap().verdict);
    let written = reread(&before.rotor);
    let remembered = written.noise.unwrap();
    assert!((remembered.scale.unwrap() / 1.5 - 1.0).abs() < 0.2, "{remembered:?}");
    let after = best_fit(&written, &readings).unwrap();
    assert!((after.chi2_per_value / before.chi2_per_value - 1.0).abs() < 1e-3);
    assert!((after.scatter.scale / before.scatter.scale - 1.0).abs() < 0.02);
    assert_eq!(diagnose(&written, &readings).unwrap().verdict, verdict);
}

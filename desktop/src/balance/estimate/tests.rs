//! On a simulated machine: known influence, known weights.

use nalgebra::{Complex, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::prior::MachinePrior;
use super::{EstimateOptions, estimate};
use crate::balance::influence::regression::stacked;
use crate::machine::drawing::{AddedUnbalance, Rotor, Run};
use crate::measurement::Reading;
use crate::model::Model;
use crate::testing::sample_rotor;
use crate::unbalance::{G_MM, phasor_kg_m};
use crate::units::rad_s;

type C = Complex<f64>;

/// Speeds of the dwells, rpm.
const SPEEDS_RPM: [f64; 2] = [3000.0, 4500.0];
/// The machine's own unbalance, g·mm.
const OWN: [f64; 2] = [300.0, 200.0];

fn run(rotor: &Rotor, name: &str, weights: &[[f64; 2]]) -> Run {
    let placed = |(plane, [magnitude_g_mm, angle_deg]): (usize, &[f64; 2])| AddedUnbalance {
        position_m: rotor.plane[plane].position_m,
        magnitude_g_mm: *magnitude_g_mm,
        angle_deg: *angle_deg,
    };
    let added = weights.iter().enumerate().filter(|(_, w)| w[0] > 0.0).map(placed);
    Run { name: name.into(), added_unbalance: added.collect(), slow_roll: false }
}

/// Readings of a machine whose probe 1 reads 0.7 times its motion, 40° late; relative noise by mounting.
fn measured(rotor: &Rotor, runs: &[(&str, [[f64; 2]; 2])], noise: f64, random: &mut StdRng) -> Vec<Reading> {
    let model = Model::finite_elements(rotor);
    let mut readings = Vec::new();
    for (name, weights) in runs {
        for speed_rpm in SPEEDS_RPM {
            let u: Vec<C> = (0..2)
                .map(|j| phasor_kg_m(OWN[j], 50.0) + phasor_kg_m(weights[j][0], weights[j][1]))
                .collect();
            let mut y = model.response(rad_s(speed_rpm)).unwrap().at(&DVector::from_vec(u));
            y[0] *= C::from_polar(0.7, -40.0_f64.to_radians());
            let mut normal = || random.sample::<f64, _>(StandardNormal) * noise;
            let probes = y.iter().map(|y| Some(y * C::new(1.0 + normal(), normal()))).collect();
            readings.push(Reading { run: Some((*name).into()), speed_rpm, probes, ..Reading::default() });
        }
    }
    readings
}

const RUNS: [(&str, [[f64; 2]; 2]); 5] = [
    ("base", [[0.0, 0.0], [0.0, 0.0]]),
    ("one", [[200.0, 10.0], [0.0, 0.0]]),
    ("two", [[0.0, 0.0], [200.0, 100.0]]),
    ("both", [[150.0, -60.0], [150.0, 120.0]]),
    ("blind", [[120.0, 200.0], [80.0, -20.0]]),
];

fn stated(known: &[&str]) -> Rotor {
    let mut rotor = sample_rotor();
    let listed = RUNS.iter().filter(|(name, _)| known.contains(name));
    rotor.run = listed.map(|(name, weights)| run(&rotor, name, weights)).collect();
    rotor
}

#[test]
fn blind_run_without_noise_is_found_with_miscalibrated_probe() {
    let rotor = stated(&["base", "one", "two", "both"]);
    let readings = measured(&rotor, &RUNS, 0.0, &mut StdRng::seed_from_u64(1));
    let found = estimate(&rotor, &readings, &EstimateOptions::default()).unwrap();
    let blind = found.runs.iter().find(|e| e.run == "blind").unwrap();
    for (p, [magnitude, angle_deg]) in blind.planes.iter().zip(RUNS[4].1) {
        let truth = phasor_kg_m(magnitude, angle_deg) * G_MM;
        assert!((p.unbalance_g_mm - truth).norm() < 0.01 * magnitude, "{p:?}");
    }
    for (u, [magnitude, angle_deg]) in blind.influence_g_mm.iter().flatten().zip(RUNS[4].1) {
        let truth = phasor_kg_m(magnitude, angle_deg) * G_MM;
        assert!((u - truth).norm() < 1e-6 * magnitude, "linear least squares is exact: {u}");
    }
}

#[test]
fn physics_with_one_trial_run_finds_plane_without_trial() {
    let rotor = stated(&["base", "one"]);
    let readings = measured(&rotor, &RUNS, 0.002, &mut StdRng::seed_from_u64(2));
    let found = estimate(&rotor, &readings, &EstimateOptions::default()).unwrap();
    let two = found.runs.iter().find(|e| e.run == "two").unwrap();
    assert!(two.influence_g_mm.is_none());
    let truth = phasor_kg_m(200.0, 100.0) * G_MM;
    assert!((two.planes[1].unbalance_g_mm - truth).norm() < 60.0, "{two:?}");
    let [low, high] = two.planes[1].magnitude_95_g_mm();
    assert!(low <= 200.0 && 200.0 <= high, "{two:?}");
}

#[test]
fn prior_mean_equals_model_and_slopes_equal_differences() {
    let rotor = sample_rotor();
    let speeds = SPEEDS_RPM.map(rad_s);
    let machine = MachinePrior::new(&rotor, &speeds);
    let drawn = DVector::zeros(machine.parameters());
    let linear = machine.near(drawn.clone()).unwrap();
    let model = Model::finite_elements(&rotor);
    for (s, speed) in speeds.iter().enumerate() {
        let exact = model.response(*speed).unwrap().per_unbalance;
        let block = linear.influence.rows(s * rotor.probe.len(), rotor.probe.len());
        assert!((block - &exact).norm() < 2e-3 * exact.norm(), "as good as its shape functions");
    }
    for k in 0..machine.parameters() {
        let step = 0.01;
        let moved = |by: f64| {
            let mut at = drawn.clone();
            at[k] = by;
            stacked(&machine.influence_at(&at, &speeds).unwrap())
        };
        let central = (moved(step) - moved(-step)) / (2.0 * step);
        let error = (linear.slopes.column(k) - &central).norm();
        assert!(error <= 0.02 * central.norm() + 1e-6 * linear.mean.norm(), "parameter {k}: {error}");
    }
}

#[test]
fn a_run_at_a_speed_of_its_own_is_left_out_with_a_remark() {
    let rotor = stated(&["base", "one", "two", "both"]);
    let mut readings = measured(&rotor, &RUNS, 0.0, &mut StdRng::seed_from_u64(3));
    readings.iter_mut().filter(|r| r.run.as_deref() == Some("blind")).for_each(|r| r.speed_rpm += 500.0);
    let found = estimate(&rotor, &readings, &EstimateOptions::default()).unwrap();
    assert!(found.runs.iter().all(|e| e.run != "blind"));
    assert!(found.remarks.iter().any(|r| r.contains("Run blind is left out")), "{:?}", found.remarks);
}

#[test]
fn one_probe_at_one_speed_leaves_two_planes_undetermined() {
    let mut rotor = stated(&["base", "one", "two", "both"]);
    let mut readings = measured(&rotor, &RUNS, 0.0, &mut StdRng::seed_from_u64(4));
    rotor.probe.truncate(1);
    readings.retain(|r| r.speed_rpm == SPEEDS_RPM[0]);
    readings.iter_mut().for_each(|r| r.probes.truncate(1));
    let found = estimate(&rotor, &readings, &EstimateOptions::default()).unwrap();
    assert!(found.determined.poorly && !found.determined.words.is_empty());
    let wide = |p: &crate::unbalance::region::UnbalanceRegion| p.semi_axes_g_mm[0] > 200.0;
    assert!(found.runs.iter().any(|e| e.planes.iter().any(wide)), "{:?}", found.runs);
}

//! Phase I on synthetic machines whose truth is known.

use nalgebra::{Complex, DVector};

use super::*;
use crate::diagnose::PlaneUnbalances;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::fit::hypothesis::Hypothesis;
use crate::machine::drawing::{Noise, Rotor, SearchBounds, Tolerance};
use crate::measurement::Reading;
use crate::model::Model;
use crate::simulate::{Simulation, SimulationRequest, simulate};
use crate::testing::sample_rotor;
use crate::unbalance::g_mm_deg;
use crate::units::rad_s;

/// A swarm that only has to find the neighbourhood.
const SHORT: PhaseOneConfig = PhaseOneConfig { particles: 6, iterations: 3, seed: 1, bounds: None };

/// Guess over truth: stiffness and damping of both bearings, x then y.
const WRONG: [[[f64; 2]; 2]; 2] = [[[1.25, 0.8], [0.7, 1.4]], [[0.8, 1.2], [1.3, 0.75]]];

fn true_unbalance_kg_m() -> DVector<Complex<f64>> {
    DVector::from_vec(vec![Complex::from_polar(4e-4, 0.6), Complex::from_polar(5e-4, -0.9)])
}

/// The sample machine as its file would guess it, with nearly noiseless probes.
fn guessed() -> Rotor {
    let mut rotor = sample_rotor();
    for (bearing, [k, c]) in rotor.bearing.iter_mut().zip(WRONG) {
        bearing.constants_mut().unwrap().stiffness_n_m.xx *= k[0];
        bearing.constants_mut().unwrap().stiffness_n_m.yy *= k[1];
        bearing.constants_mut().unwrap().damping_n_s_m.xx *= c[0];
        bearing.constants_mut().unwrap().damping_n_s_m.yy *= c[1];
    }
    rotor.noise = Some(Noise { relative: 1e-4, floor_um: 1e-5, ..Noise::default() });
    rotor
}

/// Noiseless readings of the true machine on full finite elements.
fn readings(speeds_rpm: impl IntoIterator<Item = f64>) -> Vec<Reading> {
    let model = Model::finite_elements(&sample_rotor());
    let read = |speed_rpm| {
        let motion = model.response(rad_s(speed_rpm)).unwrap().at(&true_unbalance_kg_m());
        Reading { speed_rpm, probes: motion.iter().copied().map(Some).collect(), ..Reading::default() }
    };
    speeds_rpm.into_iter().map(read).collect()
}

fn run_up() -> Vec<Reading> {
    readings((0..40).map(|i| 1000.0 + 300.0 * f64::from(i)))
}

fn three_days() -> Vec<Reading> {
    readings([11_000.0; 3])
}

/// Coefficients in the order of phase I.
fn coefficients(rotor: &Rotor) -> Vec<f64> {
    let stiffness = rotor
        .bearing
        .iter()
        .filter_map(|b| b.constants())
        .flat_map(|b| [b.stiffness_n_m.xx, b.stiffness_n_m.yy]);
    let damping = rotor
        .bearing
        .iter()
        .filter_map(|b| b.constants())
        .flat_map(|b| [b.damping_n_s_m.xx, b.damping_n_s_m.yy]);
    stiffness.chain(damping).collect()
}

#[test]
fn noiseless_run_up_recovers_true_bearings_and_unbalance() {
    let rotor = guessed();
    let found = identify(&rotor, &run_up(), &PhaseOneConfig::default()).unwrap();
    let truth = coefficients(&sample_rotor());
    assert_eq!(coefficients(&found.rotor), found.bearings.iter().map(|p| p.value).collect::<Vec<_>>());
    for ((p, truth), start) in found.bearings.iter().zip(truth).zip(coefficients(&rotor)) {
        assert!((p.value / truth - 1.0).abs() < 1e-3, "{p:?}, expected {truth}");
        assert!((p.start / start - 1.0).abs() < 1e-12, "{p:?}, expected a start at {start}");
        assert_eq!(p.identified, Identifiability::FromData, "{p:?}");
    }
    let error = &found.unbalance_kg_m - true_unbalance_kg_m();
    assert!(error.camax() < 1e-3 * true_unbalance_kg_m().camax(), "{error}");
    assert!(found.unbalance_relative_sd.iter().all(|sd| *sd < 1e-2), "{:?}", found.unbalance_relative_sd);
    assert!(found.residual_ratio < 1e-3, "{}", found.residual_ratio);
    assert!(found.residual_um < found.swarm_residual_um);
}

#[test]
fn three_days_at_one_speed_leave_coefficients_near_their_start() {
    let rotor =
        Rotor { noise: Some(Noise { relative: 0.02, floor_um: 0.03, ..Noise::default() }), ..guessed() };
    let found = identify(&rotor, &three_days(), &PhaseOneConfig::default()).unwrap();
    let open: Vec<_> =
        found.bearings.iter().filter(|p| p.identified == Identifiability::StayedAtStart).collect();
    assert!(!open.is_empty(), "{:?}", found.bearings);
    for p in open {
        assert!(p.relative_sd <= 0.5 + 1e-9, "no worse than the prior: {p:?}");
        assert!((p.value / p.start).ln().abs() < 2.0 * 0.5, "{p:?}");
    }
    assert!(found.chi2_per_value < 1.0, "{}", found.chi2_per_value);
}

#[test]
fn coefficient_stops_at_a_bound_that_excludes_the_truth() {
    let rotor = guessed();
    // of the stiffnesses 1.8, 2.2, 3.2 and 1.5 × 10⁸ N/m only the third is beyond
    let bounds = SearchBounds { stiffness_n_m: [1e8, 2.8e8], damping_n_s_m: [2e4, 4e5] };
    let config = PhaseOneConfig { bounds: Some(bounds), ..PhaseOneConfig::default() };
    let found = identify(&rotor, &run_up(), &config).unwrap();
    let third = &found.bearings[2];
    assert_eq!((third.symbol.as_str(), third.identified), ("k_xx", Identifiability::AtBound), "{third:?}");
    assert!((third.value / 2.8e8 - 1.0).abs() < 1e-12, "{third:?}");
    let others = found.bearings.iter().enumerate().filter(|(i, _)| *i != 2);
    for (_, p) in others {
        assert_eq!(p.identified, Identifiability::FromData, "{p:?}");
    }
    // the others make up for it: better than at their own best without the bound
    let noise = rotor.noise.unwrap();
    let data = run_up();
    let fitter = Fitter::new(&rotor, Data::new(&rotor, &noise, &data));
    let hypothesis = Hypothesis::drawn(&rotor, fitter.scales(None));
    let drawing = fitter.exact_drawing();
    let free = identify(&rotor, &data, &PhaseOneConfig::default()).unwrap();
    let mut clamped: Vec<f64> = free.bearings.iter().map(|p| p.value.ln()).collect();
    clamped[2] = 2.8e8_f64.ln();
    let trial = fitter.trial(&hypothesis, &drawing, None).unwrap();
    let without = trial.summed_residual_um(&clamped).unwrap();
    assert!(found.residual_um < 0.8 * without, "{} {without}", found.residual_um);
    // the rotor's own range is the same where the configuration gives none
    let own = Rotor { identify: Some(bounds), ..rotor.clone() };
    let again = identify(&own, &run_up(), &PhaseOneConfig::default()).unwrap();
    assert_eq!(again.bearings, found.bearings);
}

#[test]
fn residuals_equal_those_of_the_identified_model() {
    let rotor =
        Rotor { noise: Some(Noise { relative: 0.02, floor_um: 0.03, ..Noise::default() }), ..guessed() };
    let days = three_days();
    let found =
        identify(&rotor, &days, &PhaseOneConfig { particles: 6, iterations: 3, ..Default::default() });
    let found = found.unwrap();
    let model = Model::finite_elements(&found.rotor);
    let mut residual_um = 0.0;
    let mut features_um = 0.0;
    for day in &days {
        let predicted = model.response(day.speed_rad_s()).unwrap().at(&found.unbalance_kg_m);
        for (y, measured) in predicted.iter().zip(day.complete().unwrap()) {
            residual_um += (y - measured).l1_norm() * 1e6;
            features_um += measured.l1_norm() * 1e6;
        }
    }
    assert!((found.residual_um - residual_um).abs() < 1e-5 * features_um, "{residual_um}");
    assert!((found.residual_ratio - found.residual_um / features_um).abs() < 1e-12);
}

#[test]
fn tolerance_of_a_drawing_widens_intervals_and_changes_no_value() {
    let rotor = guessed();
    let tolerance = Tolerance { diameter_relative: 0.01, ..Tolerance::default() };
    let tolerant = Rotor { tolerance: Some(tolerance), ..rotor.clone() };
    let [exact, allowed] = [&rotor, &tolerant].map(|r| identify(r, &run_up(), &SHORT).unwrap());
    assert_eq!(exact.unbalance_kg_m, allowed.unbalance_kg_m);
    for (exact, allowed) in exact.bearings.iter().zip(&allowed.bearings) {
        assert_eq!(exact.value, allowed.value);
        assert!(allowed.relative_sd > 10.0 * exact.relative_sd, "{exact:?} {allowed:?}");
    }
}

#[test]
fn intervals_hold_on_machines_that_are_off_their_drawing() {
    let noise = Noise { relative: 0.005, floor_um: 0.05, ..Noise::default() };
    let drawn = Rotor { tolerance: None, noise: Some(noise), ..sample_rotor() };
    let mut held = [0; 3];
    for seed in 1..=20 {
        let request = SimulationRequest {
            speeds_rpm: (0..30).map(|k| 1000.0 + 400.0 * f64::from(k)).collect(),
            seed,
            drawing_seed: Some(seed),
            ..SimulationRequest::default()
        };
        let Simulation { readings, unbalance_kg_m, .. } = simulate(&drawn, &request).unwrap();
        let found = identify(&drawn, &readings, &SHORT).unwrap();
        let covariance = found.unbalance_covariance();
        let names = drawn.plane.iter().map(|p| p.name.as_str());
        let planes = PlaneUnbalances::new(names, found.unbalance_kg_m.as_slice(), &covariance);
        for (plane, truth) in planes.planes.iter().zip(&unbalance_kg_m) {
            let [size, angle_deg] = g_mm_deg(*truth);
            let [least, most] = plane.interval_95_g_mm;
            let off_deg = (plane.angle_deg - angle_deg + 180.0).rem_euclid(360.0) - 180.0;
            held[0] += usize::from((least..=most).contains(&size));
            held[1] += usize::from(off_deg.abs() <= plane.angle_95_deg);
        }
        // the bearings as they are were drawn, and only what goes with them is off
        for p in &found.bearings {
            held[2] += usize::from((p.value / p.start).ln().abs() <= 1.96 * p.relative_sd);
        }
    }
    // of 40 planes and 160 coefficients: a coverage of 95 % is below that with a chance of one in a thousand
    assert!(held[0] >= 33 && held[1] >= 33 && held[2] >= 143, "{held:?}");
}

#[test]
fn fewer_values_than_planes_are_refused() {
    let mut one = readings([9000.0]);
    one[0].probes[1..].fill(None);
    let error = identify(&guessed(), &one, &PhaseOneConfig::default()).unwrap_err();
    assert_eq!(error.to_string(), "1 measured values cannot fix the unbalance of 2 planes");
}

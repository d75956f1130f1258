//! Simulated readings: the model of the file, its noise, effects that are stated, drawn and found again.

use nalgebra::{Complex, DVector};
use rotor_edge_desktop::diagnose::{DiagnosisVerdict, best_fit, diagnose};
use rotor_edge_desktop::machine::drawing::{Noise, ParameterValue, Rotor, Tolerance};
use rotor_edge_desktop::measurement::{Reading, phasor_m};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::shaft::structure::{ELEMENTS_PER_SEGMENT, Structure};
use rotor_edge_desktop::simulate::{
    JUST_VISIBLE_SD, STRONG_SD, Simulation, SimulationRequest, StatedEffect, simulate,
};
use rotor_edge_desktop::unbalance::phasor_kg_m;
use rotor_edge_desktop::units::rad_s;

use crate::effects::MACHINE;

type C = Complex<f64>;

fn machine() -> Rotor {
    rotor_file::parse("rotor.toml", MACHINE).unwrap()
}

/// Up to 9,000 rpm, through the bending resonance.
fn request() -> SimulationRequest {
    SimulationRequest {
        speeds_rpm: (0..36).map(|k| 2000.0 + 200.0 * f64::from(k)).collect(),
        unbalance_kg_m: vec![
            ("left".into(), phasor_kg_m(900.0, 30.0)),
            ("right".into(), phasor_kg_m(700.0, -80.0)),
        ],
        seed: 5,
        ..SimulationRequest::default()
    }
}

fn with(label: &str, parameters: &[(&str, ParameterValue)]) -> SimulationRequest {
    let parameters = parameters.iter().map(|(name, value)| (name.to_string(), value.clone())).collect();
    SimulationRequest {
        effects: vec![StatedEffect { parameters, ..StatedEffect::of_label(label) }],
        ..request()
    }
}

fn real(value: f64) -> ParameterValue {
    ParameterValue::Real(value)
}

fn refusal(request: &SimulationRequest) -> String {
    simulate(&machine(), request).unwrap_err().to_string()
}

/// Root mean square of the differences over that of `readings`.
fn difference(readings: &[Reading], others: impl IntoIterator<Item = Vec<C>>) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for (reading, other) in readings.iter().zip(others) {
        for (y, other) in reading.probes.iter().zip(other) {
            off += (y.unwrap() - other).norm_sqr();
            all += y.unwrap().norm_sqr();
        }
    }
    (off / all).sqrt()
}

#[test]
fn noise_free_readings_equal_a_fine_mesh_and_the_fitted_model() {
    let request = SimulationRequest { noise: Some(Noise::default()), ..request() };
    let (rotor, found) = (machine(), simulate(&machine(), &request).unwrap());
    let own = [phasor_kg_m(900.0, 30.0), phasor_kg_m(700.0, -80.0)];
    let on = |per_segment: usize| {
        let model = Model::on(Structure::finite_elements(&rotor, &rotor.physics, per_segment), &rotor);
        let shown = found.readings.iter().map(|r| {
            let trial =
                if r.run.as_deref() == Some("trial") { phasor_kg_m(500.0, 70.0) } else { C::from(0.0) };
            let u = DVector::from_column_slice(&[own[0] + trial, own[1]]);
            model.response(rad_s(r.speed_rpm)).unwrap().at(&u).as_slice().to_vec()
        });
        difference(&found.readings, shown)
    };
    let (fitted_mesh, fine_mesh) = (on(ELEMENTS_PER_SEGMENT), on(16 * ELEMENTS_PER_SEGMENT));
    let fit = best_fit(&rotor, &found.readings).unwrap();
    let of_fit = difference(&found.readings, fit.predicted_m.clone());
    println!(
        "differences: fine mesh {fine_mesh:.1e}, mesh of fits {fitted_mesh:.1e}, after a fit {of_fit:.1e}"
    );
    assert!(fine_mesh < 1e-4 && of_fit < 1e-3, "{fine_mesh:e} {of_fit:e}");
    // the one segment of this shaft is long: near the resonance its elements show
    assert!((1e-4..2e-3).contains(&fitted_mesh), "{fitted_mesh:e}");
}

#[test]
fn same_seed_gives_same_readings_and_noise_has_stated_size() {
    let of = |seed: u64| simulate(&machine(), &SimulationRequest { seed, ..request() }).unwrap();
    let (found, again, other) = (of(5), of(5), of(6));
    assert_eq!(found.readings, again.readings);
    assert!(found.readings != other.readings && found.noise_free == other.noise_free);
    let noise = machine().noise.unwrap();
    let squares: Vec<f64> = (found.readings.iter().zip(&found.noise_free))
        .flat_map(|(noisy, shown)| noisy.probes.iter().zip(&shown.probes))
        .flat_map(|(noisy, shown)| {
            let off = (noisy.unwrap() - shown.unwrap()) / noise.sigma_m(shown.unwrap());
            [off.re * off.re, off.im * off.im]
        })
        .collect();
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((mean - 1.0).abs() < 4.0 * (2.0 / squares.len() as f64).sqrt(), "{mean}");
}

#[test]
fn unbalance_without_statement_is_a_share_of_the_grade_by_seed() {
    let of = |seed: u64| {
        let nothing = SimulationRequest { seed, ..SimulationRequest::default() };
        simulate(&machine(), &nothing).unwrap()
    };
    let (found, other) = (of(1), of(2));
    let sizes: Vec<f64> = found.unbalance_kg_m.iter().map(|u| u.norm()).collect();
    assert!((sizes[0] - sizes[1]).abs() < 1e-12 && sizes[0] > 0.0);
    assert!(found.unbalance_kg_m != other.unbalance_kg_m);
    assert_eq!(found.speeds_rpm.len(), 40);
    assert!(
        found.speeds_rpm.last().unwrap() >= &found.critical_speeds_rpm[0],
        "{:?}",
        found.critical_speeds_rpm
    );
    let mut rated = machine();
    rated.plane[1].unbalance_g_mm = Some(123.0);
    rated.plane[1].angle_deg = Some(45.0);
    let stated = simulate(&rated, &SimulationRequest { seed: 1, ..SimulationRequest::default() }).unwrap();
    assert!((stated.unbalance_kg_m[1] - phasor_kg_m(123.0, 45.0)).norm() < 1e-12);
    assert_eq!(stated.unbalance_kg_m[0], found.unbalance_kg_m[0]);
}

#[test]
fn instruments_and_bow_show_in_readings_as_they_are_stated() {
    let exact = |request: SimulationRequest| {
        simulate(&machine(), &SimulationRequest { noise: Some(Noise::default()), ..request })
            .unwrap()
            .readings
    };
    let without = exact(request());
    let gain = exact(with("probe_calibration@AY", &[("gain", real(0.8)), ("phase", real(0.3))]));
    let runout = [[2e-6, 0.0], [0.0, 0.0], [0.0, -3e-6], [0.0, 0.0]];
    let runout = exact(with("runout", &[("v", ParameterValue::Phasors(runout.to_vec()))]));
    let reversed = exact(with("probe_reversed@BX", &[]));
    let of_run = exact(with(
        "unbalance_of_run@trial",
        &[("u", ParameterValue::Phasors(vec![[1e-4, 0.0], [0.0, 0.0]]))],
    ));
    for (k, before) in without.iter().enumerate() {
        let y = |readings: &[Reading], probe: usize| readings[k].probes[probe].unwrap();
        let is = |a: C, b: C| assert!((a - b).norm() < 1e-9 * b.norm(), "{a} {b}");
        is(y(&gain, 1), before.probes[1].unwrap() * C::from_polar(0.8, 0.3));
        is(y(&gain, 0), before.probes[0].unwrap());
        is(y(&runout, 0), before.probes[0].unwrap() + 2e-6);
        is(y(&runout, 2), before.probes[2].unwrap() + phasor_m(0.0, 3.0));
        is(y(&reversed, 2), -before.probes[2].unwrap());
        assert_eq!(y(&of_run, 0) == before.probes[0].unwrap(), before.run.as_deref() == Some("as found"));
    }
}

#[test]
fn thermal_bow_grows_from_nothing_while_a_run_lasts() {
    let bow = |cold: f64, growth: f64| {
        let phasor = |size: f64| ParameterValue::Phasor([size, 0.0]);
        let request = with("thermal_bow", &[("cold", phasor(cold)), ("growth", phasor(growth))]);
        simulate(&machine(), &SimulationRequest { noise: Some(Noise::default()), ..request })
            .unwrap()
            .readings
    };
    let (cold, warm, growing) = (bow(2e-6, 0.0), bow(8e-6, 0.0), bow(2e-6, 6e-6));
    for (k, reading) in growing.iter().enumerate() {
        let share = (k % 36) as f64 / 35.0;
        let of = |readings: &[Reading]| readings[k].probes[0].unwrap();
        let expected = of(&cold) * (1.0 - share) + of(&warm) * share;
        assert!((reading.probes[0].unwrap() - expected).norm() < 1e-9 * expected.norm());
    }
}

#[test]
fn weight_outside_planes_and_slow_roll_are_simulated() {
    let mut rotor = machine();
    rotor.run[1].added_unbalance[0].position_m = 1.3;
    rotor.run[1].slow_roll = false;
    let mut slow = rotor.run[0].clone();
    (slow.name, slow.slow_roll) = ("slow".into(), true);
    rotor.run.push(slow);
    let found = simulate(&rotor, &request()).unwrap();
    let of =
        |run: &str| found.noise_free.iter().filter(|r| r.run.as_deref() == Some(run)).collect::<Vec<_>>();
    assert!(of("trial")[20].probes != of("as found")[20].probes);
    assert!(of("slow").iter().all(|r| r.speed_rpm <= 200.0 && r.probes[0].unwrap().norm() < 1e-7));
    assert_eq!(of("slow").len(), 5);
}

#[test]
fn unknown_effect_place_or_parameter_is_refused_with_choices() {
    for (request, says) in [
        (with("seals@hub", &[]), "there is no effect \"seals\", expected one of gyroscopic, "),
        (with("seal@A", &[]), "seal cannot sit at \"A\", expected one of \"wheel 1\", \"wheel 2\", \"hub\""),
        (with("seal@hub", &[]), "seal@hub: its size is not stated, expected k (N/m), q (N/m), c (N·s/m)"),
        (
            with("seal@hub", &[("kk", real(1.0))]),
            "there is no parameter kk, expected k (N/m), q (N/m), c (N·s/m)",
        ),
        (with("seal@hub", &[("k", real(1.0)), ("k", real(2.0))]), "the parameter k is stated twice"),
        (with("seal@hub", &[("k", ParameterValue::Phasor([1.0, 2.0]))]), "the parameter k is one number"),
        (with("seal@hub", &[("k", real(-1e12))]), "k is -1e12"),
        (with("pedestal@A", &[("k", real(1e8))]), "the parameter m is missing, expected k (N/m), m (kg)"),
        (with("runout", &[("v", real(1e-6))]), "1 phasors, expected one for each probe: AX, AY, BX, BY"),
        (with("gyroscopic", &[]), "gyroscopic is already in the model"),
        (
            with("probe_reversed@AX", &[("gain", real(1.0))]),
            "there is no parameter gain, the effect has none",
        ),
        (
            SimulationRequest { unbalance_kg_m: vec![("middle".into(), C::from(1e-4))], ..request() },
            "there is no plane \"middle\", expected one of \"left\", \"right\"",
        ),
        (SimulationRequest { drawing_seed: Some(1), ..request() }, "states an exact drawing"),
        (
            SimulationRequest { unbalance_kg_m: vec![("left".into(), C::from(10.0))], ..request() },
            "expected at most 5000 µm",
        ),
    ] {
        let said = refusal(&request);
        assert!(said.contains(says), "{said}");
    }
    let twice = SimulationRequest {
        effects: [0; 2].map(|_| with("shaft_bow", &[("m", real(1e-6))]).effects[0].clone()).to_vec(),
        ..request()
    };
    assert!(refusal(&twice).contains("shaft_bow is stated twice"));
}

#[test]
fn drawn_machine_stays_within_two_deviations_and_is_told() {
    let rotor = Rotor { tolerance: None, ..machine() };
    let of =
        |seed: u64| simulate(&rotor, &SimulationRequest { drawing_seed: Some(seed), ..request() }).unwrap();
    let (found, again, other) = (of(3), of(3), of(4));
    assert!(
        found.drawing == again.drawing && found.drawing != other.drawing && found.readings == again.readings
    );
    assert!(found.drawing.iter().all(|d| d.deviations.abs() <= 2.0));
    let usual = Tolerance::holding(&rotor);
    let modulus = found.drawing.iter().find(|d| d.what == "shaft youngs_modulus").unwrap();
    assert!((modulus.change - usual.modulus_relative * modulus.deviations).abs() < 1e-15);
    let [drawn, true_one] = [&rotor, &found.machine].map(|r| r.shaft[0].youngs_modulus_pa);
    assert!((true_one / drawn - 1.0 - modulus.change).abs() < 1e-12);
    let position = found.drawing.iter().find(|d| d.what == "probe AX position_m").unwrap();
    assert!((found.machine.probe[0].position_m - rotor.probe[0].position_m - position.change).abs() < 1e-12);
}

#[test]
fn hidden_effects_differ_by_seed_are_visible_and_physical() {
    let rotor = machine();
    let of =
        |seed: u64| simulate(&rotor, &SimulationRequest { hidden_seed: Some(seed), ..request() }).unwrap();
    let found: Vec<Simulation> = (1..=8).map(of).collect();
    let mut kinds: Vec<String> = Vec::new();
    for (seed, simulation) in found.iter().enumerate() {
        let hidden = simulation.hidden.as_ref().unwrap();
        println!("seed {}: {:.1} sd, {:?}", seed + 1, hidden.visible_sd, hidden.entry);
        simulation.machine.validate().unwrap();
        assert_eq!(simulation.machine.effect.last(), Some(&hidden.entry));
        assert!(simulation.unstable_from_rpm.is_none());
        // a switch, such as a probe that is reversed, has no size
        let is_switch = hidden.entry.parameters.is_empty();
        assert!(hidden.visible_sd >= JUST_VISIBLE_SD && (is_switch || hidden.visible_sd <= STRONG_SD));
        kinds.push(hidden.entry.kind.clone());
    }
    assert_eq!(of(2).readings, found[1].readings);
    kinds.sort();
    kinds.dedup();
    assert!(kinds.len() >= 4, "{kinds:?}");
}

#[test]
fn stated_effects_are_named_by_the_diagnosis() {
    for (label, parameters) in [
        ("pedestal@A", vec![("k", real(1.2e8)), ("m", real(220.0)), ("c", real(2e4))]),
        ("shaft_bow", vec![("m", ParameterValue::Phasor([1.5e-5, -6e-6]))]),
    ] {
        let found = simulate(&machine(), &with(label, &parameters)).unwrap();
        let said = diagnose(&machine(), &found.readings).unwrap();
        let first = said.candidates[0].label();
        let group = said.indistinguishable.first().cloned().unwrap_or_default();
        let is_named = first == label || group.iter().any(|other| other == label);
        assert!(
            is_named && said.verdict != DiagnosisVerdict::Adequate,
            "{label}: {} {first} {group:?}",
            said.summary
        );
    }
}

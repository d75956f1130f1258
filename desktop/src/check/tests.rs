//! Against closed forms, and against the dense matrices of the model.

mod couplings;
mod stability;

use nalgebra::{Complex, DVector};

use super::campbell::Campbell;
use super::critical::critical_speeds;
use super::modes::modes;
use super::system::System;
use super::unbalance::{ResponseRequest, probes_at, responses, speeds_rad_s, trials};
use super::{CheckUnbalance, check};
use crate::bearing::Law;
use crate::bearing::constant::Coefficients;
use crate::bearing::flexibility::FlexibilityRow;
use crate::bearing::foundation::{Foundation, FoundationMode};
use crate::bearing::support::Pedestal;
use crate::bearing::table::{CoefficientTable, TableRow};
use crate::machine::drawing::{Bearing, EffectEntry, Formulation, Mount, ParameterValue, Rated, Rotor};
use crate::model::Model;
use crate::shaft::statics::mass_and_centre;
use crate::testing::{sample_rotor, train, uniform_shaft};
use crate::units::{rad_s, rpm};

type C = Complex<f64>;

/// A shaft that hardly bends, on two bearings alike at its ends.
fn rigid(stiffness_n_m: f64, damping_n_s_m: f64) -> Rotor {
    let mut rotor = uniform_shaft();
    rotor.shaft[0].youngs_modulus_pa = 1e14;
    let four = |v| Coefficients { xx: v, yy: v, xy: 0.0, yx: 0.0 };
    for b in &mut rotor.bearing {
        *b = Bearing::constant(b.name.clone(), b.position_m, four(stiffness_n_m), four(damping_n_s_m));
    }
    rotor
}

fn with_effects() -> Rotor {
    let mut rotor = sample_rotor();
    let entry = |kind: &str, at: Option<&str>, parameters: &[(&str, f64)]| EffectEntry {
        kind: kind.into(),
        at: at.map(String::from),
        parameters: parameters.iter().map(|(n, v)| (n.to_string(), ParameterValue::Real(*v))).collect(),
    };
    rotor.effect = vec![
        entry("seal", Some("disk 2"), &[("k", 2e7), ("q", 3e7), ("c", 1e4)]),
        entry("disk_mass", Some("disk 1"), &[("kg", 2.0)]),
        entry("internal_damping", None, &[("eta", 1e-6)]),
    ];
    rotor
}

#[test]
fn response_with_effects_and_pedestals_equals_dense_model() {
    let mut machines = vec![with_effects(), with_effects(), with_effects(), train()];
    machines[1].bearing[0].pedestal =
        Some(Pedestal { stiffness_n_m: [4e8, 9e8], damping_n_s_m: [2e4, 1e4], mass_kg: [60.0, 90.0] });
    machines[1].schema = 2;
    machines[2].physics.formulation = Formulation::Printed2023;
    let planes = [C::new(2e-4, 1e-4), C::new(-1e-4, 3e-4)];
    for rotor in machines {
        let (system, dense) = (System::new(&rotor).unwrap(), Model::finite_elements(&rotor));
        assert!(system.chain().is_some());
        for speed in [200.0, 700.0, 1300.0] {
            let response = dense.response(speed).unwrap();
            let expected = &response.per_unbalance * DVector::from_row_slice(&planes);
            let ours = DVector::from_vec(probes_at(&system, speed, &planes).unwrap());
            assert!((ours - &expected).camax() < 1e-8 * expected.camax());
        }
    }
}

#[test]
fn eigenvalues_equal_those_of_the_dense_model_with_a_seal() {
    let mut rotor = with_effects();
    rotor.effect.truncate(1);
    let dense = Model::finite_elements(&rotor).eigenvalues(600.0).unwrap();
    for mode in modes(&System::new(&rotor).unwrap(), 600.0, 0.0, 8).unwrap() {
        let off = dense.iter().map(|v| (v - mode.eigenvalue).norm()).fold(f64::INFINITY, f64::min);
        assert!(off < 1e-7 * mode.eigenvalue.norm(), "{} is off by {off}", mode.eigenvalue);
    }
}

#[test]
fn rigid_shaft_on_pedestals_has_two_mass_spring_frequencies() {
    let (k, kp, mp) = (2e4, 5e4, 12.0);
    let mut rotor = rigid(k, 0.0);
    rotor.bearing.iter_mut().for_each(|b| b.pedestal = Some(Pedestal::isotropic(kp, 0.0, mp)));
    let half = 0.5 * mass_and_centre(&rotor).0;
    // half ẍ + k (x − y) = 0, mp ÿ + kp y + k (y − x) = 0
    let (sum, product) = (k / half + (k + kp) / mp, k * kp / (half * mp));
    let root = (sum * sum - 4.0 * product).sqrt();
    let found = modes(&System::new(&rotor).unwrap(), 10.0, 0.0, 12).unwrap();
    for w2 in [0.5 * (sum - root), 0.5 * (sum + root)] {
        let nearest =
            found.iter().map(|m| (m.frequency_rad_s() / w2.sqrt() - 1.0).abs()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-4, "{} rad/s: {nearest:e}", w2.sqrt());
    }
}

#[test]
fn rigid_shaft_critical_speed_is_sqrt_of_stiffness_over_mass() {
    let mut rotor = rigid(1e4, 5.0);
    let mass = mass_and_centre(&rotor).0;
    let first = critical_speeds(&System::new(&rotor).unwrap(), 1000.0, 1)[0].clone();
    assert!((first.speed_rad_s / (2e4 / mass).sqrt() - 1.0).abs() < 1e-5);
    assert!((first.forward - 1.0).abs() < 1e-6, "alike in all directions");
    // k = a Ω gives Ω² m = 2 a Ω
    let row = |speed_rpm: f64| {
        let k = 500.0 * rad_s(speed_rpm);
        TableRow { speed_rpm, kxx: k, kxy: 0.0, kyx: 0.0, kyy: k, cxx: 10.0, cxy: 0.0, cyx: 0.0, cyy: 10.0 }
    };
    let table = CoefficientTable::new((1..=12).map(|i| row(500.0 * f64::from(i))).collect()).unwrap();
    rotor.bearing.iter_mut().for_each(|b| b.law = Law::Table(table.clone()));
    let found = critical_speeds(&System::new(&rotor).unwrap(), rad_s(6000.0), 1);
    let expected = 1e3 / mass;
    assert!(found.iter().any(|c| (c.speed_rad_s / expected - 1.0).abs() < 1e-4), "{expected}: {found:?}");
}

#[test]
fn instability_onset_is_where_cross_coupling_equals_damping() {
    // k_xy = q Ω = −k_yx on a rigid shaft: unstable from q Ω = c ω₀ on
    let (k, c, q) = (1e4, 4.0, 0.36);
    let mut rotor = rigid(k, c);
    let row = |speed_rpm: f64| {
        let cross = q * rad_s(speed_rpm);
        TableRow { speed_rpm, kxx: k, kxy: cross, kyx: -cross, kyy: k, cxx: c, cxy: 0.0, cyx: 0.0, cyy: c }
    };
    let table = CoefficientTable::new((1..=30).map(|i| row(500.0 * f64::from(i))).collect()).unwrap();
    rotor.bearing.iter_mut().for_each(|b| b.law = Law::Table(table.clone()));
    let natural = (2.0 * k / mass_and_centre(&rotor).0).sqrt();
    let expected = c * natural / q;
    assert!(expected < rad_s(15_000.0), "{}", rpm(expected));
    let system = System::new(&rotor).unwrap();
    let speeds: Vec<f64> = (1..=12).map(|i| expected * f64::from(i) / 8.3).collect();
    let found = Campbell::new(&system, &speeds, 2.0 * natural).unwrap().threshold(&system, 0).unwrap();
    // conical whirl of the uniform shaft is 1.7 times as fast and so the more stable
    assert!((found.speed_rad_s / expected - 1.0).abs() < 1e-4, "{} {expected}", found.speed_rad_s);
    assert!((found.frequency_rad_s / natural - 1.0).abs() < 1e-3);
}

#[test]
fn amplification_of_light_damping_is_one_over_two_zeta() {
    let zeta = 0.02;
    let k = 1e4;
    let mass = mass_and_centre(&rigid(k, 0.0)).0;
    let natural = (2.0 * k / mass).sqrt();
    let mut rotor = rigid(k, zeta * mass * natural);
    rotor.plane.iter_mut().zip([0.4, 0.6]).for_each(|(p, z)| p.position_m = z);
    let system = System::new(&rotor).unwrap();
    let speeds: Vec<f64> = (1..=10).map(|i| 0.2 * natural * f64::from(i)).collect();
    let critical = Campbell::new(&system, &speeds, 2.0 * natural).unwrap().damped_critical_speeds(&system);
    let curve = speeds_rad_s(1.5 * natural, &critical);
    let trial = &trials(&rotor, mass, 0.5, 5000.0)[0];
    let running = [1.2, 1.4].map(|f| rpm(f * natural));
    let asked =
        ResponseRequest { trial, speeds_rad_s: &curve, critical: &critical, running_rpm: Some(running) };
    for response in responses(&rotor, &system, &asked) {
        let peak = &response.peaks[0];
        assert!((peak.speed_rpm / rpm(natural) - 1.0).abs() < 2e-3, "{peak:?}");
        assert!((peak.amplification.unwrap() * 2.0 * zeta - 1.0).abs() < 0.02, "{peak:?}");
        let [margin, needed] = peak.margin_percent.unwrap();
        assert!((margin - 100.0 * (1.0 - 1.0 / 1.2)).abs() < 0.3);
        let amplification = 0.5 / zeta;
        assert!((needed - 17.0 * (1.0 - 1.0 / (amplification - 1.5))).abs() < 0.05);
    }
}

/// Two bearings on one mode of a foundation, with the probes on their housings.
fn on_foundation() -> Rotor {
    let mut rotor = with_effects();
    rotor.schema = 2;
    let bearings: Vec<String> = rotor.bearing.iter().map(|b| b.name.clone()).collect();
    let (x, y) = (vec![0.3, -0.2], vec![1.0, 0.6]);
    let mode = FoundationMode { frequency_hz: 90.0, damping_ratio: 0.04, modal_mass_kg: 400.0, x, y };
    rotor.foundation = Some(Foundation { bearings, mode: vec![mode], ..Foundation::default() });
    rotor.probe.iter_mut().for_each(|p| p.mount = Mount::Housing);
    rotor
}

/// The flexibility of the foundation instead of its modes.
fn measured(mut rotor: Rotor) -> Rotor {
    let by_modes = rotor.footing().unwrap();
    let foundation = rotor.foundation.as_mut().unwrap();
    for frequency_hz in [20.0, 85.0, 95.0, 250.0] {
        let all = by_modes.flexibility(std::f64::consts::TAU * frequency_hz);
        let foot = |i: usize| format!("{}.{}", foundation.bearings[i / 2], ["x", "y"][i % 2]);
        for (i, j) in (0..4).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let (real_m_n, imaginary_m_n) = (all[(i, j)].re, all[(i, j)].im);
            let (response, force) = (foot(i), foot(j));
            foundation.table.push(FlexibilityRow { frequency_hz, response, force, real_m_n, imaginary_m_n });
        }
    }
    foundation.mode.clear();
    rotor
}

#[test]
fn response_on_modal_or_tabled_foundation_equals_dense_model() {
    let rotor = on_foundation();
    let planes = [C::new(2e-4, 1e-4), C::new(-1e-4, 3e-4)];
    let (system, dense) = (System::new(&rotor).unwrap(), Model::finite_elements(&rotor));
    let measured = measured(rotor.clone());
    let by_table = (System::new(&measured).unwrap(), Model::finite_elements(&measured));
    for (speed, (system, dense)) in [200.0, 560.0, 1300.0]
        .into_iter()
        .flat_map(|s| [(s, (&system, &dense)), (s, (&by_table.0, &by_table.1))])
    {
        let expected = dense.response(speed).unwrap().per_unbalance * DVector::from_row_slice(&planes);
        let ours = DVector::from_vec(probes_at(system, speed, &planes).unwrap());
        // here no chain makes the reduced system exact
        assert!((ours - &expected).camax() < 1e-4 * expected.camax(), "{speed} rad/s");
    }
}

#[test]
fn foundation_adds_its_mode_and_stiff_one_changes_nothing() {
    let lowest = |rotor: &Rotor| modes(&System::new(rotor).unwrap(), 400.0, 0.0, 4).unwrap();
    let on = lowest(&on_foundation());
    let mut rigid = on_foundation();
    rigid.foundation = None;
    let off = lowest(&rigid);
    let near =
        |modes: &[super::modes::Mode], w: f64| modes.iter().any(|m| (m.eigenvalue.im / w - 1.0).abs() < 0.3);
    let own = std::f64::consts::TAU * 90.0;
    assert!(near(&on, own) && !near(&off, own), "{on:?} {off:?}");
    let mut stiff = on_foundation();
    stiff.foundation.as_mut().unwrap().mode[0].frequency_hz = 9e4;
    for (a, b) in lowest(&stiff).iter().zip(&off) {
        assert!((a.eigenvalue - b.eigenvalue).norm() < 1e-4 * b.eigenvalue.norm());
    }
}

#[test]
fn trial_unbalance_is_twice_stated_grade_or_api_617() {
    let mut rotor = uniform_shaft();
    let total_g_mm = |rotor: &Rotor| {
        let (mass, centre) = mass_and_centre(rotor);
        trials(rotor, mass, centre, 6000.0)[0].planes_kg_m.iter().sum::<C>().re * 1e6
    };
    let mass_kg = 7850.0 * std::f64::consts::PI * 0.025_f64.powi(2);
    assert!((total_g_mm(&rotor) / (2.0 * 6350.0 * mass_kg / 6000.0) - 1.0).abs() < 1e-9);
    rotor.rated = Some(Rated { speed_rpm: [500.0, 3000.0], balance_grade_mm_s: Some(6.3) });
    let permitted_g_mm = 6.3 / (100.0 * std::f64::consts::PI) * mass_kg * 1e3;
    assert!((total_g_mm(&rotor) / (2.0 * permitted_g_mm) - 1.0).abs() < 1e-9);
}

#[test]
fn raised_middle_bearing_load_equals_closed_form() {
    let mut rotor = uniform_shaft();
    rotor.physics.shear_deformation = false;
    let mut middle = rotor.bearing[0].clone();
    (middle.name, middle.position_m) = ("M".into(), 0.5);
    rotor.bearing.push(middle);
    let load = |rotor: &Rotor| {
        check(rotor, Some([500.0, 2000.0]), CheckUnbalance::Assumed).unwrap().bearings[2].load_n.unwrap()
    };
    let level = load(&rotor);
    rotor.bearing[2].elevation_m = 1e-5;
    let bending = 2.08e11 * std::f64::consts::PI * 0.05_f64.powi(4) / 64.0;
    assert!(((load(&rotor) - level) / (48.0 * bending * 1e-5) - 1.0).abs() < 1e-6);
}

#[test]
fn rated_speeds_set_searched_range_and_separation_margins() {
    let mut rotor = rigid(1e6, 500.0);
    rotor.rated = Some(Rated { speed_rpm: [4000.0, 5000.0], balance_grade_mm_s: None });
    let found = check(&rotor, None, CheckUnbalance::Assumed).unwrap();
    assert_eq!(found.range_rpm[1], 6250.0);
    let asked = check(&rotor, Some([4000.0, 5000.0]), CheckUnbalance::Assumed).unwrap();
    let margins = |c: &super::Check| -> Vec<Option<[f64; 2]>> {
        let all = c.responses.iter().flat_map(|(_, all)| all.iter().flat_map(|r| &r.peaks));
        all.map(|p| p.margin_percent).collect()
    };
    assert!(margins(&asked).iter().any(Option::is_some) && margins(&found).iter().any(Option::is_some));
}

use nalgebra::{Complex, DVector};

use super::*;
use crate::machine::drawing::{Noise, Rotor};
use crate::model::Model;
use crate::simulate::{SimulationRequest, simulate};
use crate::testing::{sample_rotor, uniform_shaft};
use crate::units::rad_s;

fn request(from: f64, to: f64, count: usize) -> PlanRequest {
    let at = |k: usize| from + (to - from) * k as f64 / (count - 1) as f64;
    PlanRequest::at((0..count).map(at).collect())
}

fn with_noise(rotor: Rotor, relative: f64, floor_um: f64) -> Rotor {
    Rotor { noise: Some(Noise { relative, floor_um, ..Noise::default() }), ..rotor }
}

/// One disk between bearings that are known, one plane at it.
fn one_mode() -> Rotor {
    let mut rotor = with_noise(uniform_shaft(), 0.0, 0.2);
    rotor.disk = vec![crate::machine::drawing::Disk { position_m: 0.5, ..sample_rotor().disk[0].clone() }];
    rotor.bearing.iter_mut().for_each(|b| b.coefficients_relative = Some(1e-6));
    rotor.plane.truncate(1);
    rotor.plane[0].position_m = 0.5;
    rotor
}

fn found<'p>(plan: &'p Plan, label: &str) -> &'p EffectPlan {
    plan.effects.iter().find(|e| e.label() == label).unwrap_or_else(|| panic!("no {label}"))
}

#[test]
fn predicted_probability_at_smallest_size_is_that_asked_for() {
    let plan = plan(&with_noise(sample_rotor(), 0.02, 0.1), &request(2000.0, 12000.0, 31)).unwrap();
    let sized: Vec<&EffectPlan> =
        plan.effects.iter().filter(|e| e.has_size && e.smallest.is_some()).collect();
    assert!(sized.len() > 8, "{} of {}", sized.len(), plan.effects.len());
    for e in sized {
        let size = e.smallest.as_ref().unwrap();
        assert!((0.9..0.97).contains(&size.found), "{}: {}", e.label(), size.found);
        assert!(size.alone <= size.found, "{}", e.label());
    }
}

#[test]
fn smallest_size_is_proportional_to_the_noise() {
    let smallest = |floor_um: f64| {
        let plan = plan(&with_noise(one_mode(), 0.0, floor_um), &request(500.0, 3000.0, 21)).unwrap();
        found(&plan, "runout").smallest.as_ref().unwrap().parameters[0].value
    };
    let ratio = smallest(0.2) / smallest(0.1);
    assert!((1.8..2.1).contains(&ratio), "{ratio}");
}

#[test]
fn pair_of_probes_at_antinode_helps_more_than_at_node() {
    // stiff bearings at the ends: the first bending mode has its nodes there
    let mut rotor = with_noise(one_mode(), 0.02, 0.2);
    rotor.bearing.iter_mut().for_each(|b| {
        b.law = crate::machine::drawing::Bearing::constant(
            "",
            0.0,
            crate::machine::drawing::Coefficients { xx: 1e9, yy: 1e9, xy: 0.0, yx: 0.0 },
            crate::machine::drawing::Coefficients { xx: 1e4, yy: 1e4, xy: 0.0, yx: 0.0 },
        )
        .law;
    });
    let campaign = Campaign::new(&rotor, &request(500.0, 3000.0, 21)).unwrap();
    let half_width = |z: f64| {
        let more = campaign.with(&further::pair(&campaign.rotor, z));
        let readings = more.readings().unwrap();
        let fitter = Fitter::new(&more.rotor, Data::new(&more.rotor, &more.noise, &readings));
        PlannedModel::of(&fitter, campaign.noise).unwrap().planes().unwrap().planes[0].region.semi_axes_g_mm
            [0]
    };
    let (antinode, node) = (half_width(0.5), half_width(0.001));
    assert!(antinode < 0.9 * node, "{antinode} {node}");
}

#[test]
fn effect_that_readings_cannot_show_is_not_found() {
    // a slender shaft far below its resonances: shear bends nothing
    let mut rotor = with_noise(one_mode(), 0.02, 0.2);
    rotor.physics.shear_deformation = false;
    let plan = plan(&rotor, &request(200.0, 600.0, 21)).unwrap();
    let shear = found(&plan, "shear_deformation");
    assert!(shear.smallest.is_none() && shear.relevant.found < 0.05, "{shear:?}");
}

#[test]
fn readings_that_bearings_use_up_find_nothing() {
    let plan = plan(&with_noise(sample_rotor(), 0.02, 0.1), &request(3000.0, 6000.0, 2)).unwrap();
    assert!(plan.saturated.is_some());
    assert!(plan.effects.iter().all(|e| e.smallest.is_none() && e.relevant.found == 0.0));
    assert!(!plan.next.is_empty() && plan.next[0].gain_bits > 0.0);
}

#[test]
fn one_mode_machine_has_accuracy_and_signal_in_closed_form() {
    let rotor = one_mode();
    let request = request(500.0, 3000.0, 21);
    let campaign = Campaign::new(&rotor, &request).unwrap();
    let readings = campaign.readings().unwrap();
    let fitter = Fitter::new(&campaign.rotor, Data::new(&campaign.rotor, &campaign.noise, &readings));
    let planned = PlannedModel::of(&fitter, campaign.noise).unwrap();
    // response to a unit of unbalance, and a unit of runout at the first probe, in noise units
    let model = Model::finite_elements(&rotor);
    let sigma_m = 0.2e-6;
    let h: Vec<Complex<f64>> = request
        .speeds_rpm
        .iter()
        .flat_map(|rpm| {
            model.response(rad_s(*rpm)).unwrap().per_unbalance.column(0).iter().copied().collect::<Vec<_>>()
        })
        .map(|y| y / sigma_m)
        .collect();
    let squares: f64 = h.iter().map(|y| y.norm_sqr()).sum();
    let half_width = (-2.0 * 0.05_f64.ln()).sqrt() / squares.sqrt() * 1e6;
    let told = planned.planes().unwrap().planes[0].region.semi_axes_g_mm[0];
    assert!((told / half_width - 1.0).abs() < 1e-2, "{told} {half_width}");
    let probes = rotor.probe.len();
    let runout: Vec<Complex<f64>> =
        (0..h.len()).map(|k| Complex::from(if k % probes == 0 { 1e-6 / sigma_m } else { 0.0 })).collect();
    let along: Complex<f64> = h.iter().zip(&runout).map(|(h, b)| h.conj() * b).sum();
    let closed = runout.iter().map(|b| b.norm_sqr()).sum::<f64>() - along.norm_sqr() / squares;
    let change = DVector::from_iterator(2 * h.len(), runout.iter().flat_map(|b| [b.re, b.im]));
    let signal = planned.signal(change).visible.norm_squared();
    assert!((signal / closed - 1.0).abs() < 1e-2, "{signal} {closed}");
}

#[test]
fn large_change_is_held_against_noise_of_changed_readings() {
    let rotor = with_noise(one_mode(), 0.02, 0.05);
    let request = request(500.0, 3000.0, 21);
    let campaign = Campaign::new(&rotor, &request).unwrap();
    let readings = campaign.readings().unwrap();
    let fitter = Fitter::new(&campaign.rotor, Data::new(&campaign.rotor, &campaign.noise, &readings));
    let planned = PlannedModel::of(&fitter, campaign.noise).unwrap();
    let y: Vec<Complex<f64>> = readings.iter().flat_map(|r| r.probes.iter().flatten().copied()).collect();
    // a runout of the first probe, as large as the vibration
    let largest = y.iter().map(|y| y.norm()).fold(0.0, f64::max);
    let of_probe = |k: usize| {
        if k.is_multiple_of(rotor.probe.len()) { Complex::from(largest) } else { Complex::from(0.0) }
    };
    let runout: Vec<Complex<f64>> = (0..y.len()).map(of_probe).collect();
    let parts = |k: usize| {
        let scaled = runout[k] / campaign.noise.sigma_m(y[k]);
        [scaled.re, scaled.im]
    };
    let change = DVector::from_iterator(2 * y.len(), (0..y.len()).flat_map(parts));
    // what a plane, which shows in proportion to the readings, leaves of it
    let left = |sigma: &dyn Fn(usize) -> f64| {
        let sum = |of: &dyn Fn(usize) -> Complex<f64>| -> Complex<f64> {
            (0..y.len()).map(|k| of(k) / sigma(k).powi(2)).sum()
        };
        let along = sum(&|k| y[k].conj() * runout[k]).norm_sqr() / sum(&|k| y[k].norm_sqr().into()).re;
        sum(&|k| runout[k].norm_sqr().into()).re - along
    };
    let before = left(&|k| campaign.noise.sigma_m(y[k]));
    let after = left(&|k| campaign.noise.sigma_m(y[k] + runout[k]));
    assert!(before > 1.5 * after, "{before} {after}");
    let found = planned.signal_beside_fit(&change).unwrap();
    for signal in [found.visible, found.linear] {
        assert!((signal.norm_squared() / after - 1.0).abs() < 1e-2, "{} {after}", signal.norm_squared());
    }
}

#[test]
fn planned_pair_of_probes_belongs_to_the_nearest_bearing() {
    let rotor = with_noise(sample_rotor(), 0.01, 0.1);
    let campaign = Campaign::new(&rotor, &request(500.0, 1000.0, 2)).unwrap();
    for bearing in &rotor.bearing {
        let more = campaign.with(&further::pair(&rotor, bearing.position_m + 0.01));
        let planned = &more.rotor.probe[rotor.probe.len()..];
        assert!(planned.len() == 2 && planned.iter().all(|p| p.bearing == bearing.name));
        // a machine that a file can hold
        let request = SimulationRequest { speeds_rpm: vec![500.0], ..Default::default() };
        let readings = simulate(&more.rotor, &request).unwrap().readings;
        assert_eq!(readings[0].probes.len(), rotor.probe.len() + 2);
    }
}

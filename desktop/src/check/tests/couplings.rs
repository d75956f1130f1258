//! Trains: against the shaft without its coupling, against single spans, and against closed forms.

use super::super::critical::critical_speeds;
use super::super::system::System;
use crate::bearing::constant::Coefficients;
use crate::machine::drawing::{Bearing, Coupling, Flexibility, Rotor};
use crate::model::Model;
use crate::reduction::basis;
use crate::reduction::nodal::Shaft;
use crate::shaft::statics::{GRAVITY_M_S2, statics};
use crate::shaft::structure::{ELEMENTS_PER_SEGMENT, Structure};
use crate::testing::{train, uniform_shaft};

fn coupling(position_m: f64, lateral_stiffness_n_m: f64, angular_stiffness_n_m_rad: f64) -> Coupling {
    Coupling {
        name: "C".into(),
        position_m,
        flexibility: Some(Flexibility { lateral_stiffness_n_m, angular_stiffness_n_m_rad }),
        mass_kg: 0.0,
        diametral_inertia_kg_m2: 0.0,
        polar_inertia_kg_m2: 0.0,
    }
}

fn on_springs(name: &str, position_m: f64, stiffness_n_m: f64) -> Bearing {
    let four = |v| Coefficients { xx: v, yy: v, xy: 0.0, yx: 0.0 };
    Bearing::constant(name, position_m, four(stiffness_n_m), four(0.0))
}

fn speeds(rotor: &Rotor, highest_rad_s: f64) -> Vec<f64> {
    let found = critical_speeds(&System::new(rotor).unwrap(), highest_rad_s, 0);
    found.iter().map(|c| c.speed_rad_s).collect()
}

fn worst(ours: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(ours.len(), expected.len(), "{ours:?} {expected:?}");
    ours.iter().zip(expected).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

/// Uniform shaft of two spans of 1 m that meet in the middle, with these bearings.
fn two_spans(bearings: &[(f64, f64)]) -> Rotor {
    let mut rotor = uniform_shaft();
    rotor.shaft.push(rotor.shaft[0]);
    rotor.bearing =
        bearings.iter().enumerate().map(|(i, (z, k))| on_springs(&i.to_string(), *z, *k)).collect();
    rotor.probe.clear();
    // the mesh is a mirror image of itself
    rotor.plane[1].position_m = 1.7;
    rotor
}

#[test]
fn stiffening_coupling_converges_to_continuous_shaft() {
    let mut rotor = train();
    let at = |rotor: &mut Rotor, lateral_stiffness_n_m, angular_stiffness_n_m_rad| {
        rotor.coupling[0].flexibility =
            Some(Flexibility { lateral_stiffness_n_m, angular_stiffness_n_m_rad });
        speeds(rotor, 3000.0)
    };
    let soft = at(&mut rotor, 4e6, 2e4);
    let stiff = at(&mut rotor, 1e11, 1e9);
    let stiffer = at(&mut rotor, 1e12, 1e10);
    let stiffest = at(&mut rotor, 1e13, 1e12);
    // a rigid one is mass and inertias on the continuous shaft, as a disk
    let c = rotor.coupling.remove(0);
    let mut hub = rotor.disk[0].clone();
    (hub.name, hub.position_m, hub.mass_kg) = ("hub".into(), c.position_m, c.mass_kg);
    (hub.diametral_inertia_kg_m2, hub.polar_inertia_kg_m2) =
        (c.diametral_inertia_kg_m2, c.polar_inertia_kg_m2);
    rotor.disk.push(hub);
    let continuous = speeds(&rotor, 3000.0);
    assert!(continuous.len() >= 4);
    assert!(worst(&stiffest, &continuous) < 1e-6, "{stiffest:?} {continuous:?}");
    let ratio = worst(&stiff, &continuous) / worst(&stiffer, &continuous);
    assert!((ratio - 10.0).abs() < 0.05, "what is left is the flexibility of the coupling: {ratio}");
    assert!((soft[0] / continuous[0] - 1.0).abs() > 0.01, "the flexible coupling is no rigid one");
    rotor.disk.pop();
    rotor.coupling = vec![Coupling { flexibility: None, ..c }];
    assert!(worst(&speeds(&rotor, 3000.0), &continuous) < 1e-12);
}

#[test]
fn softening_coupling_converges_to_separate_spans() {
    let mut both = train();
    let half = (
        both.coupling[0].mass_kg,
        both.coupling[0].diametral_inertia_kg_m2,
        both.coupling[0].polar_inertia_kg_m2,
    );
    both.coupling[0].flexibility =
        Some(Flexibility { lateral_stiffness_n_m: 1.0, angular_stiffness_n_m_rad: 1e-3 });
    let span = |from: f64, to: f64, hub_m: f64| {
        let mut one = both.clone();
        one.coupling.clear();
        one.shaft = vec![both.shaft[usize::from(from > 0.0)]];
        one.bearing.retain(|b| (from..to).contains(&b.position_m));
        one.bearing.iter_mut().for_each(|b| b.position_m -= from);
        let mut hub = one.disk[0].clone();
        (hub.name, hub.position_m, hub.mass_kg) = ("hub".into(), hub_m, 0.5 * half.0);
        (hub.diametral_inertia_kg_m2, hub.polar_inertia_kg_m2) = (0.5 * half.1, 0.5 * half.2);
        one.disk.retain(|d| (from..to).contains(&d.position_m));
        one.disk.iter_mut().for_each(|d| d.position_m -= from);
        one.disk.push(hub);
        one.probe.retain(|p| (from..to).contains(&p.position_m));
        one.probe.iter_mut().for_each(|p| p.position_m -= from);
        one.plane.retain(|p| (from..to).contains(&p.position_m));
        one.plane.iter_mut().for_each(|p| p.position_m -= from);
        speeds(&one, 3000.0)
    };
    let mut expected = [span(0.0, 1.0, 1.0), span(1.0, 1.8, 0.0)].concat();
    expected.sort_by(f64::total_cmp);
    assert!(expected.len() >= 4);
    let off = worst(&speeds(&both, 3000.0), &expected);
    assert!(off < 1e-6, "{off:e}");
}

#[test]
fn hinge_between_equal_spans_has_free_and_pinned_end_speeds() {
    let mut hinged = two_spans(&[(0.1, 3e7), (0.8, 5e7), (1.2, 5e7), (1.9, 3e7)]);
    hinged.coupling = vec![coupling(1.0, 1e12, 1e-3)];
    // motion alike on both sides shears nothing at the hinge, motion opposite leaves it in its place
    let mut one = two_spans(&[(0.1, 3e7), (0.8, 5e7)]);
    one.shaft.pop();
    let mut expected = speeds(&one, 4000.0);
    one.bearing.push(on_springs("hinge", 1.0, 1e12));
    expected.extend(speeds(&one, 4000.0));
    expected.sort_by(f64::total_cmp);
    assert!(expected.len() >= 4);
    let off = worst(&speeds(&hinged, 4000.0), &expected);
    assert!(off < 1e-6, "{off:e}");
}

#[test]
fn hinged_pinned_beam_has_closed_form_frequencies() {
    let mut rotor = two_spans(&[(0.0, 1e12), (2.0, 1e12)]);
    rotor.physics.gyroscopic = false;
    rotor.physics.rotary_inertia = false;
    rotor.physics.shear_deformation = false;
    // many segments make a fine mesh
    rotor.shaft = vec![rotor.shaft[0]; 20];
    rotor.shaft.iter_mut().for_each(|s| s.length_m = 0.1);
    rotor.coupling = vec![coupling(1.0, 1e12, 1e-3)];
    let (d, s) = (rotor.shaft[0].outer_diameter_m, rotor.shaft[0]);
    let wave = (s.youngs_modulus_pa / s.density_kg_m3).sqrt() * d / 4.0;
    // βL of sin βL = 0 and of tan βL = tanh βL
    let expected = [std::f64::consts::PI, 3.926_602_312_047_9].map(|beta| beta * beta * wave);
    let found = speeds(&rotor, 1.01 * expected[1]);
    // the angular spring that is all but absent holds a mechanism, far below
    let bending: Vec<f64> = found.into_iter().filter(|w| *w > 0.1 * expected[0]).collect();
    let off = worst(&bending, &expected);
    assert!(off < 1e-5, "{off:e}");
}

#[test]
fn loads_of_hinged_spans_equal_lever_rule_about_hinge() {
    let mut rotor = two_spans(&[(0.1, 1e8), (0.9, 1e8), (1.7, 1e8)]);
    rotor.coupling = vec![Coupling { mass_kg: 8.0, ..coupling(1.0, 1e9, 1e-3) }];
    let s = rotor.shaft[0];
    let w = s.density_kg_m3 * std::f64::consts::PI / 4.0 * s.outer_diameter_m.powi(2) * GRAVITY_M_S2;
    let half = 4.0 * GRAVITY_M_S2;
    // moments about the hinge of the right span, whose half of the coupling has no lever
    let right = 0.5 * w / 0.7;
    let at_hinge = w + 2.0 * half - right;
    // moments about the first bearing of the left span
    let middle = (w * 0.4 + at_hinge * 0.9) / 0.8;
    let expected = [w + at_hinge - middle, middle, right];
    let found = statics(&rotor, &[]).unwrap();
    for (a, b) in found.load_n.iter().zip(expected) {
        assert!((a - b).abs() < 1e-6 * w, "{:?} {expected:?}", found.load_n);
    }
    assert!((found.mass_kg * GRAVITY_M_S2 / (2.0 * w + 2.0 * half) - 1.0).abs() < 1e-12);
    // heights of bearings bend no hinged spans
    let raised = statics(&rotor, &[1e-3, -2e-3, 3e-3]).unwrap();
    assert!(raised.load_n.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4 * w));
}

#[test]
fn the_shaft_that_fits_are_made_on_is_that_of_the_model() {
    for flexible in [true, false] {
        let mut rotor = train();
        rotor.coupling[0].flexibility = rotor.coupling[0].flexibility.filter(|_| flexible);
        let ours = Shaft::unreduced(&rotor).matrices(&rotor, &Default::default());
        let full = Structure::finite_elements(&rotor, &rotor.physics, ELEMENTS_PER_SEGMENT);
        for (a, b) in [
            (ours.stiffness, full.stiffness),
            (ours.mass, full.mass),
            (ours.polar_inertia, full.polar_inertia),
        ] {
            assert!((a - &b).amax() < 1e-12 * b.amax(), "flexible: {flexible}");
        }
    }
}

#[test]
fn a_train_on_few_shapes_equals_its_finite_elements() {
    let full = Model::finite_elements(&train());
    let fastest_rad_s = 500.0;
    let unbalance = nalgebra::DVector::from_element(2, nalgebra::Complex::new(1e-4, 2e-4));
    let few = full.projected(&basis::closest(&full, 8, fastest_rad_s, &unbalance).unwrap());
    let mut worst = 0.0_f64;
    for k in 1..=20 {
        let speed = fastest_rad_s * f64::from(k) / 20.0;
        let (a, b) =
            (full.response(speed).unwrap().at(&unbalance), few.response(speed).unwrap().at(&unbalance));
        worst = worst.max((&a - b).camax() / a.camax());
    }
    println!("eight shapes of a train within {worst:.1e}");
    assert!(worst < 2e-3, "{worst:e}");
}

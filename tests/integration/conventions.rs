//! The sign conventions, each against something that can be worked out by hand.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{Complex, DVector};
use rotor_edge_desktop::machine::drawing::{Coefficients, Rotor};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::units::rad_s;
use rotor_edge_tests::repository;

type C = Complex<f64>;
const I: C = C::new(0.0, 1.0);

fn rotor(name: &str) -> Rotor {
    rotor_file::read(&repository(&format!("tests/reference/rotors/{name}.toml"))).unwrap()
}

fn isotropic(value: f64) -> Coefficients {
    Coefficients { xx: value, yy: value, xy: 0.0, yx: 0.0 }
}

/// A stiff, light shaft with all its mass in one disk midway between two equal bearings.
fn rigid_rotor(stiffness_n_m: f64, damping_n_s_m: f64) -> Rotor {
    let mut r = rotor("kit");
    for s in &mut r.shaft {
        s.youngs_modulus_pa = 1e13;
        s.outer_diameter_m = 0.2;
        s.density_kg_m3 = 100.0;
    }
    r.disk[0].mass_kg = 1000.0;
    r.disk[0].diametral_inertia_kg_m2 = 0.0;
    r.disk[0].polar_inertia_kg_m2 = 0.0;
    for b in &mut r.bearing {
        b.constants_mut().unwrap().stiffness_n_m = isotropic(stiffness_n_m);
        b.constants_mut().unwrap().damping_n_s_m = isotropic(damping_n_s_m);
    }
    r
}

#[test]
fn rigid_rotor_on_springs_equals_closed_form_of_one_dof() {
    let (k, c) = (2e7, 4e4);
    let r = rigid_rotor(k, c);
    let volume = std::f64::consts::PI * 0.01 * r.length_m();
    let mass = 1000.0 + 100.0 * volume;
    let u = C::from_polar(3e-3, 0.7);
    for speed_rpm in [600.0, 1500.0, 4000.0] {
        let w = rad_s(speed_rpm);
        let closed = u * w * w / (C::new(2.0 * k - w * w * mass, 2.0 * w * c));
        let motion = Model::finite_elements(&r).response(w).unwrap().at(&DVector::from_element(1, u));
        for pair in motion.as_slice().chunks(2) {
            assert!((pair[0] - closed).norm() < 1e-3 * closed.norm(), "x at {speed_rpm} rpm");
            assert!((pair[1] + I * closed).norm() < 1e-3 * closed.norm(), "y follows x by 90°");
        }
    }
}

#[test]
fn high_spot_is_at_heavy_spot_below_resonance_opposite_above() {
    let r = rigid_rotor(2e7, 1e3);
    let u = C::from_polar(3e-3, 0.4);
    let at = |speed_rpm: f64| {
        Model::finite_elements(&r).response(rad_s(speed_rpm)).unwrap().at(&DVector::from_element(1, u))[0]
    };
    assert!((at(100.0) / u).arg().abs() < 0.02);
    assert!(((at(20_000.0) / u).arg().abs() - std::f64::consts::PI).abs() < 0.02);
}

#[test]
fn jeffcott_rotor_response_equals_closed_form() {
    // kit: disk between stiff bearings, so a mass on the shaft's own stiffness 48 EI / L³
    let mut r = rotor("kit");
    r.physics.gyroscopic = false;
    r.physics.shear_deformation = false;
    for b in &mut r.bearing {
        b.constants_mut().unwrap().stiffness_n_m = isotropic(1e11);
        b.constants_mut().unwrap().damping_n_s_m = isotropic(0.0);
    }
    r.disk[0].diametral_inertia_kg_m2 = 0.0;
    r.probe[0].position_m = r.disk[0].position_m;
    for s in &mut r.shaft {
        s.density_kg_m3 = 100.0;
    }
    let span = r.bearing[1].position_m - r.bearing[0].position_m;
    let d = r.shaft[0].outer_diameter_m;
    let inertia = std::f64::consts::PI * d.powi(4) / 64.0;
    let k = 48.0 * r.shaft[0].youngs_modulus_pa * inertia / span.powi(3);
    let m = r.disk[0].mass_kg;
    for ratio in [0.3_f64, 0.6, 1.5, 3.0] {
        let w = ratio * (k / m).sqrt();
        let closed = w * w / (k - w * w * m);
        let ours = Model::finite_elements(&r).response(w).unwrap().per_unbalance[(0, 0)];
        assert!(
            (ours.re / closed - 1.0).abs() < 0.01 && ours.im.abs() < 1e-6 * closed.abs(),
            "ratio {ratio}"
        );
    }
}

#[test]
fn probe_at_45_degrees_equals_the_rotated_pair_at_0_and_90() {
    let mut turned = rotor("turbine");
    for p in &mut turned.probe {
        p.angle_deg += 45.0;
    }
    let u = DVector::from_vec(vec![C::new(2e-4, 1e-4), C::new(-1e-4, 3e-4)]);
    let straight = Model::finite_elements(&rotor("turbine")).response(900.0).unwrap().at(&u);
    let turned = Model::finite_elements(&turned).response(900.0).unwrap().at(&u);
    for b in [0, 2] {
        let (x, y) = (straight[b], straight[b + 1]);
        assert!(((x + y) * FRAC_1_SQRT_2 - turned[b]).norm() < 1e-12 * x.norm());
        assert!(((y - x) * FRAC_1_SQRT_2 - turned[b + 1]).norm() < 1e-12 * y.norm());
    }
}

#[test]
fn gyroscopic_moments_raise_forward_and_lower_backward_whirl() {
    let mut r = rotor("overhung");
    for b in &mut r.bearing {
        b.constants_mut().unwrap().stiffness_n_m = isotropic(b.constants_mut().unwrap().stiffness_n_m.xx);
        b.constants_mut().unwrap().damping_n_s_m = isotropic(0.0);
    }
    let model = Model::finite_elements(&r);
    let frequencies = |spin: f64| {
        let values = model.eigenvalues(spin).unwrap();
        let mut up: Vec<f64> = values.iter().map(|v| v.im).filter(|f| *f > 1.0).collect();
        up.sort_by(f64::total_cmp);
        [up[0], up[1]]
    };
    let [rest, rest_too] = frequencies(0.0);
    assert!((rest - rest_too).abs() < 1e-6 * rest, "isotropic: one frequency at rest");
    let [backward, forward] = frequencies(1500.0);
    assert!(backward < rest * 0.999 && forward > rest * 1.001);
    // synchronous response to unbalance is forward whirl, so it sees the stiffening: M − G, not M + G
    let n = model.structure.size();
    let w = 700.0;
    let (m, g) = (&model.structure.mass, &model.structure.polar_inertia);
    let mut z = (&model.structure.stiffness - (m - g) * (w * w)).map(C::from);
    for s in &model.supports {
        z += (&s.shape * s.shape.transpose()).map(|v| C::from(v * s.law.stiffness_n_m[(0, 0)]));
    }
    let force = model.planes[0].map(|s| C::from(s * w * w));
    let forward_only = z.lu().solve(&force).unwrap();
    let probe = &model.probes[0];
    let (cos, sin) = (probe.angle_rad.cos(), probe.angle_rad.sin());
    let at_probe: C = (0..n).map(|k| forward_only[k] * probe.shape[k]).sum::<C>() * C::new(cos, -sin);
    let ours = model.response(w).unwrap().per_unbalance[(0, 0)];
    assert!((ours - at_probe).norm() < 1e-9 * ours.norm());
}

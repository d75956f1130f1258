mod dense;

use heapless::Vec;
use nalgebra::{ComplexField, Matrix1, SMatrix, SVector};

use super::*;
use crate::model::tests::{rigid_matrices, rigid_place, rigid_rotor};
use crate::model::{Forcing, ForcingLaw, Matrices, Modes, Pedestal, Probe, Spring, Support};

const STILL: SupportAmplitudes = SupportAmplitudes([[0.0; 2]; MAX_SUPPORTS]);

/// A disk of 10 kg on two springs of half of `k` and `c` each: one shape, equal to one everywhere.
fn jeffcott(k: f32, c: f32) -> Model<1, 4, 1> {
    jeffcott_on(0.0, k, c)
}

/// The same with a spring in the shaft.
fn jeffcott_on(shaft_n_m: f64, k: f32, c: f32) -> Model<1, 4, 1> {
    let one = SVector::from([1.0]);
    let matrices = Matrices {
        stiffness: Matrix1::new(shaft_n_m),
        mass: Matrix1::new(10.0),
        polar_inertia: Matrix1::zeros(),
    };
    let springs = [Spring { shape: one, stiffness_n_m: f64::from(0.5 * k) }; 2];
    let modes = Modes::new(&matrices, &springs).unwrap();
    let here = modes.shape(&one);
    let directions = [[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
    Model {
        machine: [0; 4],
        shaft: modes.shaft(),
        internal_damping_s: 0.0,
        planes: Vec::from_array([here.forward]),
        supports: [0, 1].map(|_| Support::isotropic(here, 0.5 * k, 0.5 * c)).into_iter().collect(),
        knots: Vec::new(),
        forcings: Vec::new(),
        probes: directions.map(|direction| Probe::plain(here, direction, 0)).into_iter().collect(),
        masked: 0,
        initial_unbalance_g_mm: Vec::from_array([[1000.0, 0.0]]),
        unbalance_floor_g_mm: 1.0,
        noise: Default::default(),
        speed_range_rpm: [100.0, 20_000.0],
    }
}

fn close(got: C, want: C, tolerance: f32) {
    assert!((got - want).modulus() <= tolerance * want.modulus(), "got {got}, want {want}");
}

/// W²/(k − W²m + iWc) in f64, µm per g·mm.
fn closed_form(k: f64, c: f64, w: f64) -> C {
    let y = Complex::new(w * w, 0.0) / Complex::new(k - w * w * 10.0, w * c);
    C::new(y.re as f32, y.im as f32)
}

#[test]
fn jeffcott_rotor_agrees_with_closed_form_around_resonance() {
    for w in [300.0_f32, 1000.0, 1001.0, 2500.0] {
        let at_speed = response(&jeffcott(1e7, 500.0), w, &STILL).unwrap();
        let want = closed_form(1e7, 500.0, f64::from(w));
        close(at_speed.probes()[0].per_unbalance[0], want, 2e-5);
        // y lags x by a quarter turn: forward.
        close(at_speed.probes()[1].per_unbalance[0], C::new(want.im, -want.re), 2e-5);
    }
}

#[test]
fn shaft_far_above_resonance_opposes_unbalance() {
    let at_speed = response(&jeffcott(1e5, 1.0), 5000.0, &STILL).unwrap();
    let [x, y] = [0, 1].map(|probe| at_speed.probes()[probe].phasor(&[[1000.0, 0.0]]));
    assert!((x.re + 100.0).abs() < 0.1, "−U/m = −100 µm along x at the mark: {x}");
    assert!((y.im - 100.0).abs() < 0.1, "and a quarter turn later along y: {y}");
}

#[test]
fn forward_whirl_is_stiffened_by_the_gyroscopic_term() {
    let mut model = rigid_rotor();
    for support in &mut model.supports {
        *support = Support::isotropic(support.shape, 5e7, 0.0);
    }
    let w = 900.0;
    let at_speed = response(&model, w, &STILL).unwrap();
    let supports = [-1.0, 1.0]
        .map(rigid_place)
        .iter()
        .fold(SMatrix::<f64, 2, 2>::zeros(), |sum, shape| sum + shape * shape.transpose() * 5e7);
    let square = f64::from(w) * f64::from(w);
    let Matrices { mass, polar_inertia, .. } = rigid_matrices();
    let stiffness = supports - (mass - polar_inertia) * square;
    let p = stiffness.try_inverse().unwrap() * rigid_place(0.6) * square;
    let want = rigid_place(0.95).dot(&p) as f32;
    close(at_speed.probes()[2].per_unbalance[1], C::new(want, 0.0), 1e-5);
    close(at_speed.probes()[3].per_unbalance[1], C::new(0.0, -want), 1e-5);
}

#[test]
fn internal_damping_does_nothing_on_forward_synchronous_whirl() {
    let mut model = jeffcott_on(5e6, 1e6, 100.0);
    let without = response(&model, 700.0, &STILL).unwrap();
    model.internal_damping_s = 1e-3;
    let with = response(&model, 700.0, &STILL).unwrap();
    close(with.probes()[0].per_unbalance[0], without.probes()[0].per_unbalance[0], 1e-5);
    // Unlike supports bring backward whirl, which it does damp.
    model.supports[0].stiffness_n_m[0][0] *= 4.0;
    let unlike = response(&model, 700.0, &STILL).unwrap();
    model.internal_damping_s = 0.0;
    let unlike_without = response(&model, 700.0, &STILL).unwrap();
    assert!(
        (unlike.probes()[0].per_unbalance[0] - unlike_without.probes()[0].per_unbalance[0]).modulus() > 1e-3
    );
}

#[test]
fn probe_at_45_degrees_reads_rotated_combination() {
    let mut model = rigid_rotor();
    let plain = response(&model, 800.0, &STILL).unwrap();
    let half = 0.5_f32.sqrt();
    model.probes[0].direction = [half, half];
    model.probes[1].direction = [-half, half];
    let turned = response(&model, 800.0, &STILL).unwrap();
    for plane in 0..2 {
        let [x, y] = [plain.probes()[0].per_unbalance[plane], plain.probes()[1].per_unbalance[plane]];
        close(turned.probes()[0].per_unbalance[plane], (x + y) * half, 1e-5);
        close(turned.probes()[1].per_unbalance[plane], (y - x) * half, 1e-5);
    }
}

#[test]
fn gain_turns_and_scales_the_motion_but_not_the_runout() {
    let mut model = jeffcott(1e7, 500.0);
    model
        .forcings
        .push(Forcing { shape: model.planes[0], amplitude: [2e7, 0.0], law: ForcingLaw::Constant })
        .unwrap();
    let plain = response(&model, 500.0, &STILL).unwrap();
    model.probes[0].gain = [0.0, 1.1];
    model.probes[0].runout_um = [3.0, -4.0];
    let read = response(&model, 500.0, &STILL).unwrap();
    let gain = C::new(0.0, 1.1);
    close(read.probes()[0].per_unbalance[0], plain.probes()[0].per_unbalance[0] * gain, 1e-6);
    close(read.probes()[0].fixed, plain.probes()[0].fixed * gain + C::new(3.0, -4.0), 1e-6);
}

#[test]
fn constant_and_square_law_forcings_equal_an_unbalance() {
    let mut model = jeffcott(1e7, 500.0);
    let w = 600.0;
    let unit = response(&model, w, &STILL).unwrap().probes()[0].per_unbalance[0];
    let shape = model.planes[0];
    let amplitude = [30.0, -40.0];
    model.forcings.push(Forcing { shape, amplitude, law: ForcingLaw::SpeedSquared }).unwrap();
    close(response(&model, w, &STILL).unwrap().probes()[0].fixed, unit * C::new(30.0, -40.0), 1e-6);
    model.forcings[0].law = ForcingLaw::Constant;
    model.forcings[0].amplitude = amplitude.map(|a| a * w * w);
    close(response(&model, w, &STILL).unwrap().probes()[0].fixed, unit * C::new(30.0, -40.0), 1e-6);
}

#[test]
fn housing_probe_sees_bearings_share_of_series_springs() {
    let mut model = jeffcott(2e7, 0.0);
    for support in &mut model.supports {
        support.pedestal =
            Some(Pedestal { stiffness_n_m: [3e7; 2], damping_n_s_m: [0.0; 2], mass_kg: [0.0; 2] });
    }
    let ground = response(&model, 400.0, &STILL).unwrap();
    for probe in &mut model.probes {
        probe.mount = Some(0);
    }
    // The housing moves by 1e7/(1e7 + 3e7) of the shaft.
    let housing = response(&model, 400.0, &STILL).unwrap();
    for (ground, housing) in ground.probes().iter().zip(housing.probes()) {
        close(housing.per_unbalance[0], ground.per_unbalance[0] * 0.75, 1e-6);
    }
}

#[test]
fn pedestals_under_both_supports_are_springs_in_series() {
    let mut model = jeffcott(2e7, 0.0);
    for support in &mut model.supports {
        support.pedestal =
            Some(Pedestal { stiffness_n_m: [3e7; 2], damping_n_s_m: [0.0; 2], mass_kg: [0.0; 2] });
    }
    // Each side 1/(1/1e7 + 1/3e7) = 0.75e7.
    let at_speed = response(&model, 400.0, &STILL).unwrap();
    close(at_speed.probes()[0].per_unbalance[0], closed_form(1.5e7, 0.0, 400.0), 1e-5);
}

#[test]
fn hardening_is_a_stiffer_support_at_its_reported_motion() {
    let mut model = jeffcott(1e7, 500.0);
    for support in &mut model.supports {
        support.hardening_per_um2 = 1e-3;
    }
    let mut amplitudes = STILL;
    amplitudes.0[0] = [20.0, 20.0];
    amplitudes.0[1] = [20.0, 20.0];
    let at_speed = response(&model, 500.0, &amplitudes).unwrap();
    // 1 + ¾·1e-3·400 = 1.3.
    let want = closed_form(1.3e7, 500.0, 500.0);
    close(at_speed.probes()[0].per_unbalance[0], want, 1e-5);
    let [x, y] = support_amplitudes(&model, 500.0, &amplitudes, &[[300.0, 400.0]]).unwrap().0[0];
    assert!((x - 500.0 * want.modulus()).abs() < 1e-3 * x && (y - x).abs() < 1e-4 * x);
}

#[test]
fn an_undamped_resonance_is_an_error_and_not_a_number() {
    let model = jeffcott(10.0, 0.0);
    assert_eq!(response(&model, 1.0, &STILL), Err(ResponseError::Singular));
}

//! Bearing laws, trains of more than two bearings and probes on housings: the fit's response against full finite
//! elements, its derivatives against differences.

use nalgebra::{DMatrix, DVector};

use super::super::data::Data;
use super::super::drawing_errors::DrawingErrors;
use super::*;
use crate::bearing::Law;
use crate::bearing::constant::{Coefficients, Constant, SpeedTrend};
use crate::bearing::flexibility::FlexibilityRow;
use crate::bearing::foundation::{Foundation, FoundationMode};
use crate::bearing::support::Pedestal;
use crate::bearing::table::{CoefficientTable, TableRow};
use crate::effects::entry;
use crate::machine::drawing::{Bearing, Mount};
use crate::model::Model;

fn table() -> Law {
    let row = |speed_rpm: f64| {
        let k = 1.2e8 * (1.0 + speed_rpm / 9000.0);
        let c = 3e5 * (2000.0 / speed_rpm).sqrt();
        TableRow {
            speed_rpm,
            kxx: k,
            kxy: 0.5 * k,
            kyx: -0.8 * k,
            kyy: 1.6 * k,
            cxx: c,
            cxy: -0.2 * c,
            cyx: -0.2 * c,
            cyy: 1.4 * c,
        }
    };
    Law::Table(CoefficientTable::new([2000.0, 5000.0, 9000.0, 14_000.0].map(row).to_vec()).unwrap())
}

fn learned() -> Law {
    let at = |xx: f64, yy: f64, xy: f64, yx: f64| Coefficients { xx, yy, xy, yx };
    Law::Constant(Constant {
        stiffness_n_m: at(2e8, 1.6e8, 6e7, -9e7),
        damping_n_s_m: at(2e5, 1.5e5, -3e4, -3e4),
        learned: Some(SpeedTrend {
            reference_rpm: 7000.0,
            stiffness_per_log_n_m: at(2e7, -1e7, 1e7, -2e7),
            damping_per_log_n_s_m: at(-5e4, -4e4, 1e4, 1e4),
            stiffness_per_log2_n_m: at(3e6, 2e6, -1e6, 1e6),
            damping_per_log2_n_s_m: at(1e4, 2e4, 0.0, 3e3),
        }),
    })
}

/// A table, a learned bearing, a constant one with a third of the way between, a pedestal stated in the drawing, and
/// probes on its housing.
fn train() -> Rotor {
    let mut rotor = machine();
    rotor.schema = 2;
    rotor.bearing[0].law = table();
    rotor.bearing[1].law = learned();
    let direct = |k: f64| Coefficients { xx: k, yy: 0.8 * k, ..Coefficients::default() };
    rotor.bearing.push(Bearing::constant("C", 0.45, direct(2e7), direct(2e4)));
    rotor.bearing.push(Bearing::constant("D", 0.7, direct(3e7), direct(3e4)));
    rotor.bearing[1].pedestal =
        Some(Pedestal { stiffness_n_m: [6e8, 3e8], damping_n_s_m: [1e5, 2e5], mass_kg: [150.0, 90.0] });
    for probe in rotor.probe.iter_mut().filter(|p| p.bearing == "B") {
        probe.mount = Mount::Housing;
    }
    rotor
}

/// The same with its bearings A, C and D on one foundation, and probes on a housing there too.
fn on_foundation() -> Rotor {
    let mut rotor = train();
    let mode = |frequency_hz: f64, x: [f64; 3], y: [f64; 3]| FoundationMode {
        frequency_hz,
        damping_ratio: 0.03,
        modal_mass_kg: 300.0,
        x: x.to_vec(),
        y: y.to_vec(),
    };
    rotor.foundation = Some(Foundation {
        bearings: ["A", "C", "D"].map(String::from).to_vec(),
        mode: vec![
            mode(60.0, [0.2, 0.1, -0.1], [1.0, 0.8, 0.5]),
            mode(110.0, [1.0, -0.4, 0.3], [-0.2, 0.1, 0.6]),
        ],
        ..Foundation::default()
    });
    rotor.probe.iter_mut().for_each(|p| p.mount = Mount::Housing);
    rotor
}

#[test]
fn four_bearings_with_three_laws_equal_full_finite_elements() {
    equals_full_finite_elements(&train());
}

/// The same with the foundation's flexibility measured at a few frequencies instead.
fn on_measured_foundation() -> Rotor {
    let mut rotor = on_foundation();
    let by_modes = rotor.footing().unwrap();
    let foundation = rotor.foundation.as_mut().unwrap();
    let foot = |i: usize| format!("{}.{}", foundation.bearings[i / 2], ["x", "y"][i % 2]);
    for frequency_hz in [10.0, 60.0, 110.0, 200.0, 300.0] {
        let all = by_modes.flexibility(std::f64::consts::TAU * frequency_hz);
        let row = |(i, j): (usize, usize)| FlexibilityRow {
            frequency_hz,
            response: foot(i),
            force: foot(j),
            real_m_n: all[(i, j)].re,
            imaginary_m_n: all[(i, j)].im,
        };
        let measured: Vec<FlexibilityRow> =
            (0..6).flat_map(|i| (0..=i).map(move |j| (i, j))).map(row).collect();
        foundation.table.extend(measured);
    }
    foundation.mode.clear();
    rotor
}

#[test]
fn common_foundation_equals_full_finite_elements() {
    equals_full_finite_elements(&on_foundation());
    equals_full_finite_elements(&on_measured_foundation());
    let mut rigid = on_foundation();
    rigid.foundation = None;
    let read = |rotor: &Rotor| {
        Model::finite_elements(rotor).response(600.0).unwrap().at(&DVector::from_vec(planes()))
    };
    let (a, b) = (read(&on_foundation()), read(&rigid));
    assert!((&a - &b).norm() > 0.05 * b.norm());
}

fn equals_full_finite_elements(rotor: &Rotor) {
    rotor.validate().unwrap();
    let mut blank = readings(rotor, &run_up(6));
    blank.truncate(6);
    let fitter = Fitter::new(rotor, Data::new(rotor, &NOISE, &blank));
    let h = Hypothesis::drawn(rotor, fitter.scales(None));
    let x = h.origin();
    let p = problem(&fitter, &h, &x, &no_deviation(&fitter));
    let model = p.weighted_model(&x, &planes()).unwrap();
    let full = Model::finite_elements(rotor);
    let sigmas: Vec<f64> = fitter.data.values().map(|v| v.sigma_m).collect();
    let mut at = 0;
    for reading in &blank {
        let expected = full.response(reading.speed_rad_s()).unwrap().at(&DVector::from_vec(planes()));
        for y in expected.iter() {
            let got = C::new(model[2 * at], model[2 * at + 1]) * sigmas[at];
            assert!((got - y).norm() < 1e-4 * expected.camax(), "{} rpm: {got} {y}", reading.speed_rpm);
            at += 1;
        }
    }
}

#[test]
fn probe_on_moving_housing_differs_from_one_on_ground() {
    let (relative, mut absolute) = (train(), train());
    absolute.probe.iter_mut().for_each(|p| p.mount = Mount::Ground);
    let read = |rotor: &Rotor| {
        Model::finite_elements(rotor).response(900.0).unwrap().at(&DVector::from_vec(planes()))
    };
    let (a, b) = (read(&relative), read(&absolute));
    assert!((a[0] - b[0]).norm() < 1e-12 && (a[2] - b[2]).norm() > 0.05 * b[2].norm());
}

#[test]
fn law_housing_and_foundation_derivatives_equal_differences() {
    let effects = &["pedestal", "seal", "nonlinear_stiffness", "internal_damping"][..];
    for (chosen, mut rotor) in [
        (&[][..], train()),
        (effects, train()),
        (&[][..], on_foundation()),
        (effects, on_foundation()),
        (effects, on_measured_foundation()),
    ] {
        if chosen.contains(&"pedestal") {
            // the effect states what the drawing must not
            rotor.bearing[1].pedestal = None;
        }
        let blank = readings(&rotor, &run_up(5));
        let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &blank));
        let (h, x, _) = hypothesis(&fitter, chosen);
        let p = problem(&fitter, &h, &x, &no_deviation(&fitter));
        let unknowns = p.solved().unwrap().unknowns.clone();
        let side = |i: usize, by: f64| {
            let mut x = x.clone();
            x[i] += by;
            p.weighted_model(&x, &unknowns).unwrap()
        };
        let columns: Vec<DVector<f64>> =
            (0..x.len()).map(|i| (side(i, 1e-4) - side(i, -1e-4)) / 2e-4).collect();
        let (exact, expected) = (p.derivative().unwrap(), DMatrix::from_columns(&columns));
        for j in 0..x.len() {
            let (e, d) = (exact.column(j), expected.column(j));
            assert!((e - d).norm() < 1e-5 * d.norm() + 1e-7, "{chosen:?} {j}: {} {}", e.norm(), d.norm());
        }
    }
}

#[test]
fn housing_or_foundation_drawing_derivative_equals_differences() {
    [train(), on_foundation()].iter().for_each(drawing_errors_equal_differences);
}

fn drawing_errors_equal_differences(rotor: &Rotor) {
    let none = DVector::zeros(Fitter::new(rotor, Data::default()).deviations.len());
    let readings = measured(rotor, &run_up(5), &[], &none);
    let fitter = Fitter::new(rotor, Data::new(rotor, &NOISE, &readings));
    let (h, x, _) = hypothesis(&fitter, &[]);
    let p = problem(&fitter, &h, &x, &none);
    let errors = DrawingErrors::new(rotor, fitter.shaft(&as_drawn(rotor)), &fitter.deviations, &none);
    let exact = p.error_derivative(&errors).unwrap();
    let expected = drawing::by_differences(&fitter, &h, &x, &p.solved().unwrap().unknowns, &none);
    for j in 0..none.len() {
        let (e, d) = (exact.column(j), expected.column(j));
        let kind = &fitter.deviations.kinds[j];
        assert!((e - d).norm() < 1e-4 * d.norm() + 1e-7, "{kind:?}: {} against {}", (e - d).norm(), d.norm());
    }
}

#[test]
fn a_fitted_machine_written_down_responds_as_the_fit_did() {
    let rotor = train();
    let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &readings(&rotor, &run_up(3))));
    let (h, x, _) = hypothesis(&fitter, &[]);
    let mut written = rotor.clone();
    h.bearings.assign(&mut written, &x);
    let text = toml::to_string(&written).unwrap();
    let read = crate::rotor_file::parse("written.toml", &text).unwrap();
    for ((_, fitted), (_, again)) in h.terms(&x).supports.iter().zip(&entry::terms_of(&read).supports) {
        for speed in [300.0, 700.0, 1200.0] {
            let (a, b) =
                (fitted.dynamic_stiffness(speed, [0.0; 2]), again.dynamic_stiffness(speed, [0.0; 2]));
            // a monotone cubic through scaled rows is the scaled cubic, to rounding
            assert!((a - b).norm() < 1e-9 * a.norm());
        }
    }
}

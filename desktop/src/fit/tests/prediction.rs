//! Every effect: derivatives by search coordinates against differences, the response against full finite elements of a
//! file that states the effect.

use nalgebra::{DMatrix, DVector};

use super::super::data::{Amplitudes, Data, FitRow, FitValue};
use super::*;
use crate::effects::entry;
use crate::model::Model;
use crate::unbalance::g_mm_deg;

/// Motion at every place in the tests of this file, m: supports that depend on it are well away from rest.
const AMPLITUDE_M: f64 = 4e-5;

fn moved(fitter: &Fitter) -> Amplitudes {
    let still = fitter.still();
    still.into_iter().map(|row| vec![[AMPLITUDE_M * AMPLITUDE_M; 2]; row.len()]).collect()
}

/// The problem of a hypothesis at these amplitudes, evaluated at `x`.
fn problem_at<'p>(
    fitter: &'p Fitter<'p>,
    h: &'p Hypothesis<'p>,
    x: &[f64],
    amplitudes: &'p Amplitudes,
) -> Problem<'p> {
    let plant = fitter.plant(&no_deviation(fitter), &ShaftKind::of(&h.terms(x))).unwrap();
    let mut p = fitter.problem(h, plant, Some(amplitudes), &fitter.plain);
    p.go_to(x);
    p
}

#[test]
fn every_stated_effect_in_fit_equals_full_finite_elements() {
    let rotor = machine();
    let mut blank = readings(&rotor, &run_up(6));
    blank.truncate(6);
    let mut data = Data::new(&rotor, &NOISE, &blank);
    // a model knows no run that something grows through
    data.rows.iter_mut().for_each(|row| row.run_share = 1.0);
    let fitter = Fitter::new(&rotor, data);
    for (name, place, parameters, values) in every_effect() {
        let (mut h, _, unknowns) = hypothesis(&fitter, &[name]);
        let effect = find(name).unwrap();
        h.scales.reference_rad_s = 700.0;
        let mut x = h.bearings.stated();
        x.extend(effect.parameters(&h.scales).iter().zip(&parameters).map(|(p, v)| p.scale.from_si(*v)));
        let amplitudes = moved(&fitter);
        let p = problem_at(&fitter, &h, &x, &amplitudes);
        let model = p.weighted_model(&x, &unknowns).unwrap();
        let mut stated = rotor.clone();
        stated.effect = vec![entry::written(&rotor, effect, place, &h.scales, &parameters, &values)];
        let text = toml::to_string(&stated).unwrap();
        let full = Model::finite_elements(&crate::rotor_file::parse("stated.toml", &text).unwrap());
        for (row, reading) in blank.iter().enumerate() {
            let amplitudes_m = vec![[AMPLITUDE_M; 2]; full.supports.len()];
            let response = full.response_at(reading.speed_rad_s(), &amplitudes_m).unwrap();
            let expected = response.at(&DVector::from_vec(planes()));
            for (probe, y) in expected.iter().enumerate() {
                let at = 2 * (row * rotor.probe.len() + probe);
                let sigma_m = fitter.data.rows[row].values[probe].sigma_m;
                let got = C::new(model[at], model[at + 1]) * sigma_m;
                assert!(
                    (got - y).norm() < 1e-4 * expected.camax(),
                    "{name}, {}: {got} {y}",
                    reading.speed_rpm
                );
            }
        }
    }
}

#[test]
fn run_unbalance_equals_stated_weights_of_that_run() {
    let rotor = machine();
    let blank = readings(&rotor, &run_up(7));
    let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &blank));
    let (h, x, unknowns) = hypothesis(&fitter, &["unbalance_of_run"]);
    let mut stated = rotor.clone();
    for (plane, u) in rotor.plane.iter().zip(&unknowns[planes().len()..]) {
        let [magnitude_g_mm, angle_deg] = g_mm_deg(*u);
        let weight = AddedUnbalance { position_m: plane.position_m, magnitude_g_mm, angle_deg };
        stated.run[1].added_unbalance.push(weight);
    }
    let with_weights = Fitter::new(&stated, Data::new(&stated, &NOISE, &blank));
    let (drawn, at, _) = hypothesis(&with_weights, &[]);
    let model = |h: &Hypothesis, fitter: &Fitter, x: &[f64], unknowns: &[C]| {
        problem(fitter, h, x, &no_deviation(fitter)).weighted_model(x, unknowns).unwrap()
    };
    let by_effect = model(&h, &fitter, &x, &unknowns);
    let by_weights = model(&drawn, &with_weights, &at, &planes());
    let as_found = model(&drawn, &with_weights, &at, &[C::from(0.0); 2]);
    assert!((&by_effect - &by_weights).amax() < 1e-12 * by_weights.amax());
    assert!((by_effect - as_found).amax() > 0.01 * by_weights.amax(), "there is something to compare");
}

#[test]
fn derivative_equals_differences_for_every_effect() {
    let rotor = machine();
    for (name, ..) in every_effect() {
        let blank = readings(&rotor, &run_up(7));
        let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &blank));
        let (h, x, _) = hypothesis(&fitter, &[name]);
        let amplitudes = moved(&fitter);
        let p = problem_at(&fitter, &h, &x, &amplitudes);
        let unknowns = &p.solved().unwrap().unknowns;
        let columns: Vec<DVector<f64>> = (0..x.len())
            .map(|i| {
                let side = |by: f64| {
                    let mut x = x.clone();
                    x[i] += by;
                    p.weighted_model(&x, unknowns).unwrap()
                };
                (side(1e-4) - side(-1e-4)) / 2e-4
            })
            .collect();
        let (exact, expected) = (p.derivative().unwrap(), DMatrix::from_columns(&columns));
        for j in 0..x.len() {
            let (e, d) = (exact.column(j), expected.column(j));
            assert!((e - d).norm() < 1e-5 * d.norm() + 1e-7, "{name} {j}: {} {}", e.norm(), d.norm());
        }
    }
}

/// The same values with a row for each reading.
fn singly(data: &Data) -> Data {
    let mut rows = Vec::new();
    for row in &data.rows {
        for values in row.values.chunks(row.values.len() / row.readings) {
            let run_share = row.run_share * values[0].growth;
            let values = values.iter().map(|v| FitValue { growth: 1.0, ..*v }).collect();
            rows.push(FitRow { readings: 1, run_share, values, ..row.clone() });
        }
    }
    Data { rows, ..data.clone() }
}

#[test]
fn repeats_together_are_predicted_as_single_readings() {
    let rotor = machine();
    let thrice: Vec<f64> = run_up(7).into_iter().flat_map(|rpm| [rpm; 3]).collect();
    let together = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &readings(&rotor, &thrice)));
    let apart = Fitter::new(&rotor, singly(&together.data));
    assert_eq!([together.data.rows.len(), apart.data.rows.len()], [14, 42]);
    for (name, ..) in every_effect() {
        let (h, x, unknowns) = hypothesis(&together, &[name]);
        let at = |fitter: &Fitter| {
            let amplitudes = moved(fitter);
            let problem = problem_at(fitter, &h, &x, &amplitudes);
            let model = problem.weighted_model(&x, &unknowns).unwrap();
            (model, problem.chi2(), problem.derivative().unwrap())
        };
        let ((model, chi2, slopes), (expected, chi2_apart, slopes_apart)) = (at(&together), at(&apart));
        assert!((model - &expected).amax() < 1e-9 * expected.amax(), "{name}");
        assert!((chi2 / chi2_apart - 1.0).abs() < 1e-9, "{name}: {chi2} {chi2_apart}");
        // the mean of what grows stands for it where only the way down is sought
        if name != "thermal_bow" {
            assert!((slopes - &slopes_apart).amax() < 1e-9 * slopes_apart.amax() + 1e-12, "{name}");
        }
    }
}

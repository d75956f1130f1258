//! Errors of the drawing: derivatives against differences of whole plants.

use nalgebra::{DMatrix, DVector};

use super::super::data::Data;
use super::super::dimensions::FittedDimension;
use super::super::drawing_errors::DrawingErrors;
use super::super::{Drawing, Effort, Fitter};
use super::*;
use crate::statistics::scatter::Scatter;

/// Response per deviation by differences, the linear unknowns held.
pub(super) fn by_differences(
    fitter: &Fitter,
    h: &Hypothesis,
    x: &[f64],
    unknowns: &[C],
    centre: &DVector<f64>,
) -> DMatrix<f64> {
    let step = 0.02;
    let columns: Vec<DVector<f64>> = (0..centre.len())
        .map(|i| {
            let side = |by: f64| {
                let mut t = centre.clone();
                t[i] += by;
                problem(fitter, h, x, &t).weighted_model(x, unknowns).unwrap()
            };
            (side(step) - side(-step)) / (2.0 * step)
        })
        .collect();
    DMatrix::from_columns(&columns)
}

fn compare(chosen: &[&str], centre: f64) {
    compare_on(&machine(), chosen, centre);
}

fn compare_on(rotor: &Rotor, chosen: &[&str], centre: f64) {
    let none = DVector::zeros(Fitter::new(rotor, Data::default()).deviations.len());
    let readings = measured(rotor, &run_up(9), chosen, &none);
    let fitter = Fitter::new(rotor, Data::new(rotor, &NOISE, &readings));
    let (h, x, _) = hypothesis(&fitter, chosen);
    let centre = none.map(|_| centre);
    let p = problem(&fitter, &h, &x, &centre);
    let errors = DrawingErrors::new(rotor, fitter.shaft(&as_drawn(rotor)), &fitter.deviations, &centre);
    let exact = p.error_derivative(&errors).unwrap();
    let expected = by_differences(&fitter, &h, &x, &p.solved().unwrap().unknowns, &centre);
    for j in 0..centre.len() {
        let (e, d) = (exact.column(j), expected.column(j));
        let kind = &fitter.deviations.kinds[j];
        assert!((e - d).norm() < 1e-4 * d.norm() + 1e-7, "{kind:?}: {} against {}", (e - d).norm(), d.norm());
    }
}

#[test]
fn misfit_under_other_noise_follows_its_size() {
    let mut rotor = machine();
    let readings =
        measured(&rotor, &run_up(9), &["runout"], &no_deviation(&Fitter::new(&rotor, Data::default())));
    for exact in [false, true] {
        rotor.tolerance = rotor.tolerance.filter(|_| !exact).or(Some(Tolerance::exact()));
        let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &readings));
        let (h, x, _) = hypothesis(&fitter, &[]);
        let fit =
            |drawing: &Drawing, x: Vec<f64>| fitter.fit(&h, &[x], drawing, Effort::Search, None).unwrap();
        let drawing = fitter.around_the_stated(&h, &fit(&fitter.exact_drawing(), x.clone())).unwrap();
        let found = fit(&drawing, x);
        let under = |scale: f64| fitter.chi2_under(&found, &drawing, Scatter { scale, ..Scatter::STATED });
        assert!((under(1.0) / found.chi2 - 1.0).abs() < 1e-9, "{} {}", under(1.0), found.chi2);
        // errors of the drawing keep their size beside a larger noise, and take up less of what is left
        let quarter = found.chi2 / 4.0;
        let off = under(2.0) / quarter - 1.0;
        assert!(if exact { off.abs() < 1e-9 } else { off > 1e-6 }, "{off}");
    }
}

#[test]
fn drawing_derivative_of_plain_machine_equals_differences() {
    compare(&[], 0.0);
    compare(&[], 1.3);
}

#[test]
fn drawing_derivative_with_all_effects_equals_differences() {
    let all: Vec<&str> = every_effect().iter().map(|e| e.0).filter(|e| *e != "nonlinear_stiffness").collect();
    compare(&all, 0.7);
}

#[test]
fn drawing_derivative_with_coupling_equals_differences() {
    let mut rotor = machine();
    rotor.coupling = train().coupling;
    rotor.coupling[0].position_m = 0.8;
    compare_on(&rotor, &["shaft_bow", "internal_damping"], 0.7);
}

#[test]
fn a_machine_that_differs_from_its_drawing_is_found() {
    let rotor = machine();
    let count = Fitter::new(&rotor, Data::default()).deviations.len();
    let truth = DVector::from_fn(count, |i, _| 1.5 * (1.0 + i as f64).sin());
    let readings = measured(&rotor, &run_up(40), &[], &truth);
    let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &readings));
    let (h, _, _) = hypothesis(&fitter, &[]);
    let drawing = fitter.exact_drawing();
    let off = fitter.fit(&h, &[h.origin()], &drawing, Effort::Search, None).unwrap();
    let (fit, settled) = fitter.on_common_optimum(&h, &off, &drawing, Effort::Search, None).unwrap();
    // without noise all that is left is the pull of the priors
    assert!(fit.chi2 < 0.2 * off.chi2, "{} against {}", fit.chi2, off.chi2);
    let again = fitter.relinearised(&h, &fit, &settled).unwrap();
    assert!((&again.deviation - &settled.deviation).amax() < 0.02, "it has settled");
    let covariance = fitter.covariance(&h, &fit, &settled).unwrap().unwrap();
    let dimensions = fitter.dimensions(&h, &fit, &settled, &covariance).unwrap();
    for (d, ((_, tolerance), t)) in dimensions.iter().zip(fitter.deviations.kinds.iter().zip(&truth)) {
        assert!((d.interval_95[0]..=d.interval_95[1]).contains(&(tolerance * t)), "{t} of {d:?}");
    }
    let half = |d: &FittedDimension| 0.5 * (d.interval_95[1] - d.interval_95[0]);
    assert!(dimensions.iter().any(|d| half(d) < 0.8 * d.tolerance_95), "{dimensions:?}");
}

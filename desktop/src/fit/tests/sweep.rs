//! Runs that change speed too fast for a steady response: derivatives against differences.

use nalgebra::DMatrix;

use super::super::data::sweep::SweepPlan;
use super::super::drawing_errors::DrawingErrors;
use super::*;
use crate::units::SECONDS_A_DAY;

/// The machine's two runs, of which the second is a sweep at 700 rpm a second.
fn swept(rotor: &Rotor) -> Data {
    let mut all = readings(rotor, &run_up(9));
    for (k, reading) in all.iter_mut().enumerate() {
        reading.time_d = Some(reading.speed_rpm / 700.0 / SECONDS_A_DAY);
        reading.probes[k % 4] = None;
    }
    let plan = SweepPlan { runs: vec![Some("trial".into())], speeds: 200 };
    Data::swept(rotor, &NOISE, &all, &plan).unwrap()
}

/// Columns by differences of a model.
fn by_differences(count: usize, model: impl Fn(usize, f64) -> DVector<f64>) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = (0..count).map(|i| (model(i, 1e-4) - model(i, -1e-4)) / 2e-4).collect();
    DMatrix::from_columns(&columns)
}

#[test]
fn swept_derivative_equals_differences_for_every_effect() {
    let rotor = machine();
    for (name, ..) in every_effect() {
        let fitter = Fitter::new(&rotor, swept(&rotor));
        let (h, x, _) = hypothesis(&fitter, &[name]);
        let p = problem(&fitter, &h, &x, &no_deviation(&fitter));
        let unknowns = &p.solved().unwrap().unknowns;
        let expected = by_differences(x.len(), |i, by| {
            let mut x = x.clone();
            x[i] += by;
            p.weighted_model(&x, unknowns).unwrap()
        });
        let exact = p.derivative().unwrap();
        assert_eq!(exact.nrows(), 2 * fitter.data.count());
        for j in 0..x.len() {
            let (e, d) = (exact.column(j), expected.column(j));
            assert!((e - d).norm() < 1e-5 * d.norm() + 1e-7, "{name} {j}: {} {}", e.norm(), d.norm());
        }
    }
}

#[test]
fn swept_drawing_derivative_equals_differences() {
    let rotor = machine();
    let fitter = Fitter::new(&rotor, swept(&rotor));
    let (h, x, _) = hypothesis(&fitter, &["shaft_bow", "pedestal"]);
    let centre = no_deviation(&fitter).map(|_| 0.7);
    let p = problem(&fitter, &h, &x, &centre);
    let errors = DrawingErrors::new(&rotor, fitter.shaft(&as_drawn(&rotor)), &fitter.deviations, &centre);
    let exact = p.error_derivative(&errors).unwrap();
    let unknowns = &p.solved().unwrap().unknowns;
    let expected = by_differences(centre.len(), |i, by| {
        let mut t = centre.clone();
        t[i] += by;
        problem(&fitter, &h, &x, &t).weighted_model(&x, unknowns).unwrap()
    });
    for j in 0..centre.len() {
        let (e, d) = (exact.column(j), expected.column(j));
        assert!((e - d).norm() < 1e-4 * d.norm() + 1e-7, "{j}: {} against {}", (e - d).norm(), d.norm());
    }
}

/// What is the same at every speed is the same in a sweep, and a lost reading of one probe moves no other.
#[test]
fn runout_in_sweep_is_that_of_steady_run() {
    let rotor = machine();
    let fitter = Fitter::new(&rotor, swept(&rotor));
    let (h, x, mut unknowns) = hypothesis(&fitter, &["runout"]);
    unknowns[..2].fill(C::from(0.0));
    // no trial weight either
    let model = |unknowns: &[C]| {
        problem(&fitter, &h, &x, &no_deviation(&fitter)).weighted_model(&x, unknowns).unwrap()
    };
    let shown = model(&unknowns) - model(&vec![C::from(0.0); unknowns.len()]);
    let per_unit = h.unknowns()[0].per_unit;
    for (k, v) in fitter.data.values().enumerate() {
        let seen = C::new(shown[2 * k], shown[2 * k + 1]) * v.sigma_m;
        let expected = unknowns[2 + v.probe] * per_unit;
        assert!((seen - expected).norm() < 1e-12, "{k}: {seen} {expected}");
    }
}

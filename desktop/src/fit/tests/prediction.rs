//! Derivatives by search coordinates against differences.

use nalgebra::{DMatrix, DVector};

use super::super::data::Data;
use super::*;

#[test]
fn derivative_equals_differences_for_every_effect() {
    let rotor = machine();
    for (name, ..) in every_effect() {
        let blank = readings(&rotor, &run_up(7));
        let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &blank));
        let (h, x, _) = hypothesis(&fitter, &[name]);
        let p = problem(&fitter, &h, &x, &no_deviation(&fitter));
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
        let (exact, expected) = (p.raw_derivative().unwrap(), DMatrix::from_columns(&columns));
        for j in 0..x.len() {
            let (e, d) = (exact.column(j), expected.column(j));
            assert!((e - d).norm() < 1e-5 * d.norm() + 1e-7, "{name} {j}: {} {}", e.norm(), d.norm());
        }
    }
}

//! Shape functions of the real shaft, few enough for the controller.
//!
//! [`supported`]: modes of the shaft on springs of the bearings' mean stiffness, plus the shape it bends
//! into under a static force at each bearing. The modes carry the dynamics; the static shapes let a bearing
//! change without the basis having to change.
//!
//! [`of_responses`]: the shapes in which the machine moves most (proper orthogonal decomposition). A model
//! with effects bends under forces that no mode was chosen for, a bow or a skew moment; these shapes are
//! chosen for them, and for bearings that are softer or stiffer than stated.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::error::Error;
use crate::model::Model;

/// Speeds, up to the fastest, at which the machine's responses are taken.
const SPEEDS: usize = 12;
/// Stiffness of one bearing, relative to what the model states, in whose presence they are taken.
const BEARING_CHANGES: [f64; 2] = [0.6, 1.6];

/// Columns of the basis: `size` shape functions of one plane, orthonormal in the mass.
///
/// # Panics
/// If `size` is not larger than the number of bearings.
pub fn supported(model: &Model, size: usize) -> DMatrix<f64> {
    let statics = model.supports.len();
    assert!(size > statics, "{size} shape functions cannot hold {statics} static shapes and a mode");
    let structure = &model.structure;
    let stiffness = held_stiffness(model);
    let factor = structure.mass.clone().cholesky().expect("the mass of a shaft is positive definite").l();
    let half = factor.solve_lower_triangular(&stiffness).expect("the factor has a positive diagonal");
    let whole = factor.solve_lower_triangular(&half.transpose()).expect("the factor has a positive diagonal");
    let eigen = SymmetricEigen::new(whole);
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let transposed = factor.transpose();
    let mut columns: Vec<DVector<f64>> = order
        .iter()
        .take(size - statics)
        .map(|k| {
            let mode = eigen.eigenvectors.column(*k).into_owned();
            transposed.solve_upper_triangular(&mode).expect("the factor has a positive diagonal")
        })
        .collect();
    let held = stiffness.cholesky().expect("a shaft on springs is stable");
    for s in &model.supports {
        let mut shape = held.solve(&s.shape);
        // twice: Gram and Schmidt lose digits when a static shape is nearly a mode
        for _ in 0..2 {
            for column in &columns {
                shape.axpy(-column.dot(&(&structure.mass * &shape)), column, 1.0);
            }
        }
        let norm = shape.dot(&(&structure.mass * &shape)).sqrt();
        columns.push(shape / norm);
    }
    DMatrix::from_columns(&columns)
}

/// The `size` shapes that hold most of the machine's responses up to `fastest_rad_s`, orthonormal in the
/// mass; supports that harden or soften are taken at rest.
///
/// # Errors
/// If the machine is singular at one of the speeds.
pub fn of_responses(model: &Model, size: usize, fastest_rad_s: f64) -> Result<DMatrix<f64>, Error> {
    let n = model.structure.size();
    let at_rest = vec![[0.0; 2]; model.supports.len()];
    let mut machines = vec![model.clone()];
    for (support, change) in (0..2).flat_map(|s| BEARING_CHANGES.map(|c| (s, c))) {
        let mut changed = model.clone();
        changed.supports[support].law.stiffness_n_m *= change;
        machines.push(changed);
    }
    let mut shapes: Vec<DVector<f64>> = Vec::new();
    for machine in &machines {
        for k in 1..=SPEEDS {
            let motion = machine.motion(fastest_rad_s * k as f64 / SPEEDS as f64, &at_rest)?;
            for column in motion.column_iter().filter(|c| c.norm() > 0.0) {
                // every response counts alike, however large
                let unit = column.unscale(column.norm());
                for axis in 0..2 {
                    let part = unit.rows(axis * n, n);
                    shapes.push(part.map(|v| v.re));
                    shapes.push(part.map(|v| v.im));
                }
            }
        }
    }
    let factor =
        model.structure.mass.clone().cholesky().expect("the mass of a shaft is positive definite").l();
    let upper = factor.transpose();
    let weighed = &upper * DMatrix::from_columns(&shapes);
    let left = weighed.svd(true, false).u.expect("left vectors were asked for");
    let most = left.columns(0, size.min(left.ncols())).into_owned();
    Ok(upper.solve_upper_triangular(&most).expect("the factor has a positive diagonal"))
}

/// Stiffness of the shaft on springs of its supports' mean stiffness.
fn held_stiffness(model: &Model) -> DMatrix<f64> {
    let mut stiffness = model.structure.stiffness.clone();
    for s in &model.supports {
        // a seal may push; the basis needs something that holds
        stiffness.ger((0.5 * s.law.stiffness_n_m.trace()).max(0.0), &s.shape, &s.shape, 1.0);
    }
    stiffness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotor::{EffectEntry, ParameterValue, Rotor};
    use crate::testing::sample_rotor;
    use nalgebra::Complex;

    /// Half of the two percent by which a good 1x reading scatters.
    const WELL_BELOW_NOISE: f64 = 1e-2;

    fn worst(full: &Model, basis: &DMatrix<f64>, fastest: f64) -> f64 {
        let reduced = full.projected(basis);
        let u = DVector::from_element(2, Complex::new(2e-4, 1e-4));
        let error = |k: usize| {
            let w = fastest * k as f64 / 20.0;
            let (a, b) = (full.response(w).unwrap().at(&u), reduced.response(w).unwrap().at(&u));
            (&a - b).camax() / a.camax()
        };
        (1..=20).map(error).fold(0.0, f64::max)
    }

    fn with_effects() -> Rotor {
        let mut rotor = sample_rotor();
        let entry = |kind: &str, at: Option<&str>, parameters: &[(&str, ParameterValue)]| EffectEntry {
            kind: kind.into(),
            at: at.map(String::from),
            parameters: parameters.iter().map(|(n, v)| (n.to_string(), v.clone())).collect(),
        };
        let phasor = |re, im| ParameterValue::Phasor([re, im]);
        rotor.effect = vec![
            entry("shaft_bow", None, &[("m", phasor(2e-6, 1e-6))]),
            entry("disk_skew", Some("disk 1"), &[("rad", phasor(1e-3, -5e-4))]),
            entry(
                "seal",
                Some("disk 2"),
                &[
                    ("k", ParameterValue::Real(2e7)),
                    ("q", ParameterValue::Real(3e7)),
                    ("c", ParameterValue::Real(1e4)),
                ],
            ),
        ];
        rotor
    }

    #[test]
    fn six_shapes_of_responses_equal_full_finite_elements_with_a_bow_a_skew_and_a_seal() {
        let full = Model::finite_elements(&with_effects());
        let own = worst(&full, &of_responses(&full, 6, 1200.0).unwrap(), 1200.0);
        let modes = worst(&full, &supported(&full, 6), 1200.0);
        assert!(own < WELL_BELOW_NOISE, "{own}");
        assert!(own < 0.5 * modes, "why modes do not serve here: {modes} against {own}");
    }

    #[test]
    fn shapes_of_responses_still_serve_when_a_bearing_has_changed() {
        let full = Model::finite_elements(&with_effects());
        let basis = of_responses(&full, 6, 1200.0).unwrap();
        let mut changed = full.clone();
        changed.supports[1].law.stiffness_n_m *= 0.75;
        assert!(worst(&changed, &basis, 1200.0) < WELL_BELOW_NOISE);
    }
}

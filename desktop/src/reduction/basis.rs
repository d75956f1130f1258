//! Shape functions of the real shaft, few enough for the controller.
//!
//! [`supported`]: modes of the shaft on springs of the bearings' mean stiffness, plus the shape it bends
//! into under a static force at each bearing. The modes carry the dynamics; the static shapes let a bearing
//! change without the basis having to change.
//!
//! [`of_responses`]: the shapes in which the machine moves most (proper orthogonal decomposition). A model
//! with effects bends under forces that no mode was chosen for, a bow or a skew moment; these shapes are
//! chosen for them, and for bearings that are softer or stiffer than stated.

use nalgebra::{Complex, DMatrix, DVector};

use super::modes;
use crate::decomposition::svd;
use crate::error::Error;
use crate::machine::drawing::{BasisKind, Rotor};
use crate::model::Model;
use crate::shaft::assumed_modes;
use crate::shaft::structure::Structure;

/// Speeds, up to the fastest, at which the machine's responses are taken.
const SPEEDS: usize = 12;
/// Stiffness of one support, relative to what the model states, in whose presence they are taken.
const BEARING_CHANGES: [f64; 2] = [0.6, 1.6];

/// Modes that [`reduced`] keeps beside a static shape for each support, however many those are.
const LEAST_MODES: usize = 2;

/// The rotor on `size` shape functions a plane, of the kind its `[physics]` names; on more where its supports take so many.
pub fn reduced(rotor: &Rotor, size: usize) -> Model {
    match rotor.physics.basis {
        BasisKind::FreeFree => Model::on(assumed_modes::structure(rotor, size), rotor),
        BasisKind::Supported => {
            let full = Model::finite_elements(rotor);
            let size = size.max(full.supports.len() + LEAST_MODES);
            let basis = supported(&full, size.min(full.structure.size()));
            full.projected(&basis)
        }
    }
}

/// Columns of the basis: `size` shape functions of one plane, orthonormal in the mass.
///
/// # Panics
/// If `size` is not larger than the number of bearings.
pub fn supported(model: &Model, size: usize) -> DMatrix<f64> {
    let statics = model.supports.len();
    assert!(size > statics, "{size} shape functions cannot hold {statics} static shapes and a mode");
    let structure = &model.structure;
    let stiffness = held_stiffness(model);
    let held = stiffness.clone().cholesky().or_else(|| (&stiffness + anchored(structure)).cholesky());
    let held = held.expect("a shaft on springs that is anchored as well is stable");
    let mut columns = modes::lowest(&stiffness, &structure.mass, &held, size - statics);
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
    let changes = (0..model.supports.len()).flat_map(|s| BEARING_CHANGES.map(|c| (s, c)));
    let mut shapes: Vec<DVector<f64>> = Vec::new();
    for change in [None].into_iter().chain(changes.map(Some)) {
        let mut machine = model.clone();
        for k in 1..=SPEEDS {
            let speed_rad_s = fastest_rad_s * k as f64 / SPEEDS as f64;
            if let Some((support, factor)) = change {
                let law = &mut machine.supports[support].law;
                *law = model.supports[support].law.frozen_at(speed_rad_s);
                law.stiffness_n_m *= factor;
            }
            let motion = machine.motion(speed_rad_s, &at_rest)?;
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
    let unsuitable = || {
        Error::Unsuitable(
            "the shape functions of the shaft are linearly dependent; check lengths and positions".into(),
        )
    };
    let left = svd(weighed).and_then(|svd| svd.u).ok_or_else(unsuitable)?;
    let most = left.columns(0, size.min(left.ncols())).into_owned();
    Ok(upper.solve_upper_triangular(&most).expect("the factor has a positive diagonal"))
}

/// Whichever of [`supported`] and [`of_responses`] comes closer to the full model's response to this
/// unbalance (kg·m, one phasor a plane) up to `fastest_rad_s`; with few shapes neither is always better.
///
/// # Errors
/// If the machine is singular at one of the speeds.
pub fn closest(
    model: &Model,
    size: usize,
    fastest_rad_s: f64,
    unbalance_kg_m: &DVector<Complex<f64>>,
) -> Result<DMatrix<f64>, Error> {
    if model.supports.len() >= size {
        return of_responses(model, size, fastest_rad_s);
    }
    let modes = supported(model, size);
    let shapes = of_responses(model, size, fastest_rad_s)?;
    let error = |basis| worst_error(model, basis, fastest_rad_s, unbalance_kg_m);
    Ok(if error(&shapes)? < error(&modes)? { shapes } else { modes })
}

/// Largest difference of a reduced model from the full one at any probe, relative to the largest probe at
/// that speed.
fn worst_error(
    model: &Model,
    basis: &DMatrix<f64>,
    fastest_rad_s: f64,
    unbalance_kg_m: &DVector<Complex<f64>>,
) -> Result<f64, Error> {
    let reduced = model.projected(basis);
    let mut worst = 0.0_f64;
    for k in 1..=SPEEDS {
        let speed = fastest_rad_s * k as f64 / SPEEDS as f64;
        let full = model.response(speed)?.at(unbalance_kg_m);
        let few = reduced.response(speed)?.at(unbalance_kg_m);
        worst = worst.max((&full - few).camax() / full.camax().max(f64::MIN_POSITIVE));
    }
    Ok(worst)
}

/// Springs at all masses, soft beside the shaft itself: they hold one that its supports leave free to turn, about its
/// only bearing or at a coupling that is all but a hinge.
fn anchored(structure: &Structure) -> DMatrix<f64> {
    const SOFT: f64 = 1e-10;
    let stiffest = structure.stiffness.diagonal().component_div(&structure.mass.diagonal()).max();
    &structure.mass * (SOFT * stiffest)
}

/// Stiffness of the shaft on springs of its supports' mean stiffness.
pub(super) fn held_stiffness(model: &Model) -> DMatrix<f64> {
    let mut stiffness = model.structure.stiffness.clone();
    for s in &model.supports {
        // a seal may push; the basis needs something that holds
        stiffness.ger((0.5 * s.law.typical_stiffness_n_m().trace()).max(0.0), &s.shape, &s.shape, 1.0);
    }
    stiffness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::{EffectEntry, ParameterValue, Rotor};
    use crate::testing::{sample_rotor, uniform_shaft};

    const FASTEST_RAD_S: f64 = 1200.0;

    fn unbalance() -> DVector<Complex<f64>> {
        DVector::from_element(2, Complex::new(2e-4, 1e-4))
    }

    fn worst(full: &Model, basis: &DMatrix<f64>) -> f64 {
        worst_error(full, basis, FASTEST_RAD_S, &unbalance()).unwrap()
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
    fn closest_basis_with_effects_equals_full_finite_elements() {
        let full = Model::finite_elements(&with_effects());
        let chosen = closest(&full, 6, FASTEST_RAD_S, &unbalance()).unwrap();
        assert!(worst(&full, &chosen) < 3e-3);
        let other = of_responses(&full, 6, FASTEST_RAD_S).unwrap();
        assert!(worst(&full, &chosen) <= worst(&full, &other));
    }

    #[test]
    fn basis_size_grows_with_number_of_bearings() {
        let mut rotor = sample_rotor();
        for i in 0..6 {
            let mut further = rotor.bearing[0].clone();
            (further.name, further.position_m) = (format!("{i}"), 0.2 + 0.1 * f64::from(i));
            rotor.bearing.push(further);
        }
        assert_eq!(reduced(&rotor, 6).structure.size(), 10);
        assert_eq!(reduced(&sample_rotor(), 6).structure.size(), 6);
    }

    #[test]
    fn response_shapes_beat_modes_under_a_bending_moment() {
        let mut rotor = with_effects();
        rotor.effect.retain(|e| e.kind != "shaft_bow");
        rotor.effect[0].parameters.insert("rad".into(), ParameterValue::Phasor([2e-2, 0.0]));
        let full = Model::finite_elements(&rotor);
        let shapes = of_responses(&full, 6, FASTEST_RAD_S).unwrap();
        assert!(worst(&full, &shapes) < 0.5 * worst(&full, &supported(&full, 6)));
    }

    #[test]
    fn shapes_of_responses_converge_to_full_finite_elements() {
        let full = Model::finite_elements(&with_effects());
        let error = |size| worst(&full, &of_responses(&full, size, FASTEST_RAD_S).unwrap());
        assert!(error(8) < error(6) && error(12) < 1e-4);
    }

    #[test]
    fn shaft_on_one_bearing_has_unit_mass_shapes_at_any_diameter() {
        for outer_diameter_m in [0.02, 0.05, 0.1, 0.3, 0.7, 1.5] {
            let mut rotor = uniform_shaft();
            rotor.shaft[0].outer_diameter_m = outer_diameter_m;
            rotor.bearing.truncate(1);
            let full = Model::finite_elements(&rotor);
            let mass = full.projected(&supported(&full, 6)).structure.mass;
            assert!((mass - DMatrix::identity(6, 6)).amax() < 1e-6, "{outer_diameter_m} m");
        }
    }
}

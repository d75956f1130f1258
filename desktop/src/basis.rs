//! Shape functions of the real shaft, few enough for the controller.
//!
//! Modes of the shaft on springs of the bearings' mean stiffness, plus the shape it bends into under
//! a static force at each bearing. The modes carry the dynamics; the static shapes let a bearing
//! change without the basis having to change.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::model::Model;

/// Columns of the basis: `size` shape functions of one plane, orthonormal in the mass.
///
/// # Panics
/// If `size` is not larger than the number of bearings.
pub fn supported(model: &Model, size: usize) -> DMatrix<f64> {
    let statics = model.supports.len();
    assert!(size > statics, "{size} shape functions cannot hold {statics} static shapes and a mode");
    let structure = &model.structure;
    let mut stiffness = structure.stiffness.clone();
    for s in &model.supports {
        // a seal may push; the basis needs something that holds
        let mean = (0.5 * s.law.stiffness_n_m.trace()).max(0.0);
        stiffness.ger(mean, &s.shape, &s.shape, 1.0);
    }
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

//! Drawings are never exact: moduli, diameters, masses, inertias and positions differ from what is
//! stated, by standard deviations that `[tolerance]` gives.
//!
//! Near a given drawing the response is linear in those deviations, so a Gaussian prior on them is the
//! same as correlated noise with covariance `1 + J Jᵀ` in noise units, J the response per standard
//! deviation. Whitening by it makes the fit ignore what a drawing error could have done, no more.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::rotor::{Rotor, Tolerance};

/// One thing that may differ from the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Deviation {
    Modulus,
    Diameter(usize),
    DiskMass(usize),
    DiskDiametralInertia(usize),
    DiskPolarInertia(usize),
    BearingPosition(usize),
    DiskPosition(usize),
    ProbePosition(usize),
    PlanePosition(usize),
}

/// Everything that may differ, with its standard deviation.
#[derive(Debug, Clone)]
pub struct Deviations {
    kinds: Vec<(Deviation, f64)>,
}

/// Positions that differ from the drawing, m; empty for as drawn.
#[derive(Debug, Clone, Default)]
pub struct Offsets {
    /// Bearings.
    pub bearing_m: Vec<f64>,
    /// Disks.
    pub disk_m: Vec<f64>,
    /// Probes.
    pub probe_m: Vec<f64>,
    /// Planes.
    pub plane_m: Vec<f64>,
}

impl Deviations {
    /// The deviations of a rotor; none where the tolerance is zero.
    pub fn of(rotor: &Rotor) -> Self {
        let t: Tolerance = rotor.tolerance.unwrap_or_default();
        let mut kinds = vec![(Deviation::Modulus, t.modulus_relative)];
        kinds.extend((0..rotor.shaft.len()).map(|i| (Deviation::Diameter(i), t.diameter_relative)));
        for i in 0..rotor.disk.len() {
            kinds.push((Deviation::DiskMass(i), t.mass_relative));
            kinds.push((Deviation::DiskDiametralInertia(i), t.inertia_relative));
            kinds.push((Deviation::DiskPolarInertia(i), t.inertia_relative));
            kinds.push((Deviation::DiskPosition(i), t.position_m));
        }
        kinds.extend((0..rotor.bearing.len()).map(|i| (Deviation::BearingPosition(i), t.position_m)));
        kinds.extend((0..rotor.probe.len()).map(|i| (Deviation::ProbePosition(i), t.position_m)));
        kinds.extend((0..rotor.plane.len()).map(|i| (Deviation::PlanePosition(i), t.position_m)));
        kinds.retain(|(_, sd)| *sd > 0.0);
        Self { kinds }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Whether the drawing is taken as exact.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// The rotor with its deviations at `t` standard deviations, and the positions that moved.
    pub fn apply(&self, rotor: &Rotor, t: &DVector<f64>) -> (Rotor, Offsets) {
        let mut changed = rotor.clone();
        let mut offsets = Offsets {
            bearing_m: vec![0.0; rotor.bearing.len()],
            disk_m: vec![0.0; rotor.disk.len()],
            probe_m: vec![0.0; rotor.probe.len()],
            plane_m: vec![0.0; rotor.plane.len()],
        };
        for ((kind, sd), t) in self.kinds.iter().zip(t.iter()) {
            let by = sd * t;
            match kind {
                Deviation::Modulus => changed.shaft.iter_mut().for_each(|s| s.youngs_modulus_pa *= 1.0 + by),
                Deviation::Diameter(i) => changed.shaft[*i].outer_diameter_m *= 1.0 + by,
                Deviation::DiskMass(i) => changed.disk[*i].mass_kg *= 1.0 + by,
                Deviation::DiskDiametralInertia(i) => changed.disk[*i].diametral_inertia_kg_m2 *= 1.0 + by,
                Deviation::DiskPolarInertia(i) => changed.disk[*i].polar_inertia_kg_m2 *= 1.0 + by,
                Deviation::BearingPosition(i) => offsets.bearing_m[*i] = by,
                Deviation::DiskPosition(i) => offsets.disk_m[*i] = by,
                Deviation::ProbePosition(i) => offsets.probe_m[*i] = by,
                Deviation::PlanePosition(i) => offsets.plane_m[*i] = by,
            }
        }
        (changed, offsets)
    }
}

/// The correlated noise that drawing errors amount to, around deviations `centre`.
pub struct Whitening {
    /// Weighted response per standard deviation of each deviation.
    jacobian: DMatrix<f64>,
    /// Where the jacobian was taken, in standard deviations.
    centre: DVector<f64>,
    vectors: DMatrix<f64>,
    shrink: DVector<f64>,
    /// ln det of the covariance in noise units.
    pub log_det: f64,
}

impl Whitening {
    /// From the response per standard deviation at `centre`.
    pub fn new(jacobian: DMatrix<f64>, centre: DVector<f64>) -> Self {
        let eigen = SymmetricEigen::new(jacobian.tr_mul(&jacobian));
        let values = eigen.eigenvalues.map(|v| v.max(0.0));
        // (1 + JJᵀ)^(−1/2) = 1 − J V diag((1 − (1+λ)^(−1/2)) / λ) Vᵀ Jᵀ
        let shrink = values.map(|v| if v > 1e-9 { (1.0 - (1.0 + v).sqrt().recip()) / v } else { 0.5 });
        let log_det = values.iter().map(|v| (1.0 + v).ln()).sum();
        Self { jacobian, centre, vectors: eigen.eigenvectors, shrink, log_det }
    }

    /// Whitens every column.
    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        let mut inner = self.vectors.tr_mul(&self.jacobian.tr_mul(columns));
        for (mut row, s) in inner.row_iter_mut().zip(self.shrink.iter()) {
            row *= *s;
        }
        columns.gemm(-1.0, &self.jacobian, &(&self.vectors * inner), 1.0);
    }

    /// Whitens weighted residuals of the drawing at `centre`, as deviations are counted from the drawing.
    pub fn apply_centred(&self, residual: &mut DVector<f64>) {
        residual.gemv(1.0, &self.jacobian, &self.centre, 1.0);
        let mut inner = self.vectors.tr_mul(&self.jacobian.tr_mul(residual));
        inner.component_mul_assign(&self.shrink);
        residual.gemv(-1.0, &self.jacobian, &(&self.vectors * inner), 1.0);
    }

    /// Most probable deviations, in standard deviations, for weighted residuals of the drawing at `centre`.
    pub fn estimate(&self, residual: &DVector<f64>) -> DVector<f64> {
        let mut information = self.jacobian.tr_mul(&self.jacobian);
        for i in 0..information.nrows() {
            information[(i, i)] += 1.0;
        }
        let right = self.jacobian.tr_mul(&(residual + &self.jacobian * &self.centre));
        information.cholesky().map_or_else(|| self.centre.clone(), |c| c.solve(&right))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitening_equals_the_inverse_square_root_of_the_covariance() {
        let jacobian = DMatrix::from_fn(9, 3, |i, j| ((i * 3 + j * 7) as f64).sin());
        let covariance = DMatrix::identity(9, 9) + &jacobian * jacobian.transpose();
        let w = Whitening::new(jacobian, DVector::zeros(3));
        let mut root = DMatrix::identity(9, 9);
        w.apply(&mut root);
        assert!((&root * &covariance * &root - DMatrix::identity(9, 9)).amax() < 1e-12);
        assert!((w.log_det - covariance.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn estimate_recovers_deviations_that_the_data_show_and_shrinks_them_by_the_prior() {
        let jacobian = DMatrix::from_fn(40, 2, |i, j| 30.0 * ((i + 1) as f64 * (j + 1) as f64 * 0.3).sin());
        let truth = DVector::from_vec(vec![0.8, -1.4]);
        let centre = DVector::from_vec(vec![0.5, 0.5]);
        let w = Whitening::new(jacobian.clone(), centre.clone());
        let found = w.estimate(&(&jacobian * (&truth - centre)));
        assert!((found - truth).amax() < 1e-3);
    }
}

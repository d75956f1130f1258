//! Eigenvalues of the dense equations of motion: a reference for the modes of `check`.

use nalgebra::{Complex, DMatrix};

use super::Model;
use crate::decomposition::eigen::quadratic;
use crate::error::Error;

impl Model {
    /// Eigenvalues (rad/s) of the machine turning at `spin_rad_s`, by rising absolute frequency; the
    /// imaginary part is the damped natural frequency.
    ///
    /// Speed-dependent supports are taken at the spin speed; pedestals and a foundation are left out.
    ///
    /// # Errors
    /// If the mass matrix cannot be factored.
    pub fn eigenvalues(&self, spin_rad_s: f64) -> Result<Vec<Complex<f64>>, Error> {
        let n = self.structure.size();
        let zero = |rows, columns| DMatrix::<f64>::zeros(rows, columns);
        let (mut k, mut c, mut m) = (zero(2 * n, 2 * n), zero(2 * n, 2 * n), zero(2 * n, 2 * n));
        for axis in 0..2 {
            k.view_mut((axis * n, axis * n), (n, n)).copy_from(&self.structure.stiffness);
            m.view_mut((axis * n, axis * n), (n, n)).copy_from(&self.structure.mass);
        }
        let gyroscopic = &self.structure.polar_inertia * spin_rad_s;
        c.view_mut((0, n), (n, n)).copy_from(&gyroscopic);
        c.view_mut((n, 0), (n, n)).copy_from(&-gyroscopic);
        for s in &self.supports {
            let outer = &s.shape * s.shape.transpose();
            let held = s.law.dynamic_stiffness(spin_rad_s, [0.0; 2]);
            let damping = s.law.coefficients(spin_rad_s).damping;
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let mut block = k.view_mut((i * n, j * n), (n, n));
                block += &outer * held[(i, j)].re;
                let mut block = c.view_mut((i * n, j * n), (n, n));
                block += &outer * damping[(i, j)];
            }
        }
        // coordinates in which the mass is the identity keep the state matrix well scaled
        let factor = m
            .cholesky()
            .ok_or_else(|| Error::Unsuitable("the mass matrix is not positive definite".into()))?
            .l();
        let to_unit = |matrix: &DMatrix<f64>| -> Option<DMatrix<f64>> {
            let half = factor.solve_lower_triangular(matrix)?;
            factor.solve_lower_triangular(&half.transpose()).map(|t| t.transpose())
        };
        let (Some(k), Some(c)) = (to_unit(&k), to_unit(&c)) else {
            return Err(Error::Unsuitable("the mass matrix is singular".into()));
        };
        let mut values = quadratic(&c, &k)
            .ok_or_else(|| Error::Unsuitable("the eigenvalues of the model are not found".into()))?;
        values.sort_by(|a, b| a.im.abs().total_cmp(&b.im.abs()));
        Ok(values)
    }
}

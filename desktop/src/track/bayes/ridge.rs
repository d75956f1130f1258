//! Coordinates that follow the curved ridge of a posterior.
//!
//! A reading determines a few combinations of the bearings closely and leaves the others to their prior. The balance of forces at
//! the bearings is linear in their coefficients; in the logarithms, of which the prior is a Gaussian, the well-determined combinations
//! therefore bend along the others, and a Gaussian around the mode misses most of the ridge. With `l` the logarithms relative to the
//! mode, the negative log density is close to that of the linear problem in `x = exp(l) − 1`:
//!
//! ```text
//!   ½ xᵀ G x + gᵀ x + ½ |z|²        l = L (z − z₀)
//! ```
//!
//! with the curvature G and the slope g of the misfit at the mode z₀. The map here takes standard coordinates first along the
//! directions that the prior determines, then across: close to the minimum of this function over the other directions, and from there
//! their share in units of the width, whose change along the ridge is found by differences. Each coordinate may be stretched to one
//! side. The volume of the map is known, so that a sampler corrects what the approximation leaves (a transport map: El Moselhy and
//! Marzouk 2012, Journal of Computational Physics 231, 7815).

use nalgebra::{DMatrix, DVector};

use crate::decomposition::hermitian;

/// A direction counts as determined by the data where they halve the variance that it has in the prior.
const DETERMINED: f64 = 2.0;
/// Bound of a skew: at one, one side would have no width.
const MOST_SKEW: f64 = 0.6;
/// Longest step to the ridge, in logarithms.
const LONGEST: f64 = 0.5;
/// The width across is followed up to so many standard deviations along the ridge, and is constant beyond.
const FOLLOWED: f64 = 3.0;

#[derive(Debug, Clone)]
pub struct Ridge {
    mode: DVector<f64>,
    /// Directions of one standard deviation at the mode in the coordinates of the prior, along the ridge and across, and the same in
    /// logarithms.
    along: Directions,
    across: Directions,
    /// Curvature and slope of the misfit by logarithms at the mode.
    curvature: DMatrix<f64>,
    slope: DVector<f64>,
    /// Change of the curvature across for each direction along, in units of the linear problem's.
    widths: Vec<DMatrix<f64>>,
    /// How much longer the posterior reaches to the positive side of each coordinate than to the negative one.
    skews: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Directions {
    z: DMatrix<f64>,
    logs: DMatrix<f64>,
}

/// The ridge at some place along it.
struct Crossing {
    /// Coordinates across.
    across: DVector<f64>,
    /// Upper factor of the linear problem's curvature across.
    factor: DMatrix<f64>,
}

impl Ridge {
    /// Around the mode of a posterior whose prior is standard in `z`, where logarithms are `factor` times `z`. `curvature` is that of
    /// the negative log density; `None` if it is not positive definite at the mode.
    pub fn new(
        mode: DVector<f64>,
        factor: &DMatrix<f64>,
        mut curvature: impl FnMut(&DVector<f64>) -> Option<DMatrix<f64>>,
    ) -> Option<Self> {
        let n = mode.len();
        let at_mode = curvature(&mode)?;
        let eigen = hermitian(at_mode.clone());
        if eigen.eigenvalues.iter().any(|h| h.is_nan() || *h <= 0.0) {
            return None;
        }
        let directions = |held: bool| {
            let chosen = (0..n).filter(|i| (eigen.eigenvalues[*i] >= DETERMINED) == held);
            let scaled = chosen.map(|i| eigen.eigenvectors.column(i) / eigen.eigenvalues[i].sqrt());
            let columns: Vec<_> = scaled.collect();
            let z = if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) };
            Directions { logs: factor * &z, z }
        };
        let misfit = at_mode - DMatrix::identity(n, n);
        let half = factor.tr_solve_lower_triangular(&misfit)?;
        let mut ridge = Self {
            along: directions(false),
            across: directions(true),
            curvature: factor.tr_solve_lower_triangular(&half.transpose())?,
            // at the mode the slopes of misfit and prior cancel
            slope: -factor.tr_solve_lower_triangular(&mode)?,
            mode,
            widths: Vec::new(),
            skews: vec![0.0; n],
        };
        let widths = (0..ridge.along.z.ncols()).map(|i| ridge.width_change(i, &mut curvature));
        ridge.widths = widths.collect::<Option<_>>().unwrap_or_default();
        Some(ridge)
    }

    /// The same for a posterior of this skewness of its coordinates, of which `s + g s²/2` has three times g.
    pub fn with_skewness(mut self, skewness: &[f64]) -> Self {
        for (skew, skewness) in self.skews.iter_mut().zip(skewness) {
            *skew = (*skew + skewness / 3.0).clamp(-MOST_SKEW, MOST_SKEW);
        }
        self
    }

    pub fn dimensions(&self) -> usize {
        self.mode.len()
    }

    /// Half the difference of the curvature across between one standard deviation ahead and one behind.
    fn width_change(
        &self,
        direction: usize,
        curvature: &mut impl FnMut(&DVector<f64>) -> Option<DMatrix<f64>>,
    ) -> Option<DMatrix<f64>> {
        let size = self.across.z.ncols();
        let mut change = DMatrix::zeros(size, size);
        for step in [1.0, -1.0] {
            let mut along = DVector::zeros(self.along.z.ncols());
            along[direction] = step;
            let Crossing { across, factor } = self.crossing(&along)?;
            let z = &self.mode + &self.along.z * along + &self.across.z * across;
            let of_posterior = self.across.z.tr_mul(&(curvature(&z)? * &self.across.z));
            let half = factor.tr_solve_upper_triangular(&of_posterior)?;
            change += factor.tr_solve_upper_triangular(&half.transpose())? * (0.5 * step);
        }
        Some(change)
    }

    /// The ridge at these coordinates along it: a Newton step from the parabola that osculates it at the mode.
    fn crossing(&self, along: &DVector<f64>) -> Option<Crossing> {
        let logs_along = &self.along.logs * along;
        let z_along = &self.mode + &self.along.z * along;
        let bend = logs_along.map(|l| l.exp() - 1.0 - l);
        let mut across = -self.across.logs.tr_mul(&(&self.curvature * bend));
        let grown = (&logs_along + &self.across.logs * &across).map(f64::exp);
        let mut scaled = self.across.logs.clone();
        scaled.column_iter_mut().for_each(|mut column| column.component_mul_assign(&grown));
        let pull = &self.curvature * grown.add_scalar(-1.0) + &self.slope;
        let z = &z_along + &self.across.z * &across;
        let slope = scaled.tr_mul(&pull) + self.across.z.tr_mul(&z);
        let curvature = scaled.tr_mul(&(&self.curvature * &scaled)) + self.across.z.tr_mul(&self.across.z);
        let cholesky = curvature.cholesky()?;
        let step = cholesky.solve(&slope);
        let share = LONGEST / (&self.across.logs * &step).amax().max(LONGEST);
        across -= step * share;
        Some(Crossing { across, factor: cholesky.unpack().transpose() })
    }

    /// The point at standard coordinates `s`, and the logarithm of the volume there up to a constant.
    pub fn point(&self, s: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let stretched: Vec<(f64, f64)> = s.iter().zip(&self.skews).map(|(s, g)| stretch(*s, *g)).collect();
        let slopes: f64 = stretched.iter().map(|(_, slope)| slope.ln()).sum();
        let s = &DVector::from_iterator(s.len(), stretched.into_iter().map(|(s, _)| s));
        let free = self.along.z.ncols();
        let along = s.rows_range(..free).into_owned();
        let Crossing { across, factor } = self.crossing(&along)?;
        let size = across.len();
        let mut change = DMatrix::zeros(size, size);
        for (width, s) in self.widths.iter().zip(&along) {
            change += width * s.clamp(-FOLLOWED, FOLLOWED);
        }
        // the exponential to the second order, which is positive definite
        let width = DMatrix::identity(size, size) + &change + &change * &change * 0.5;
        let width = width.cholesky()?.unpack().transpose();
        let beside = width.solve_upper_triangular(&s.rows_range(free..).into_owned())?;
        let beside = factor.solve_upper_triangular(&beside)?;
        let log_volume =
            slopes - factor.diagonal().iter().chain(&width.diagonal()).map(|d| d.ln()).sum::<f64>();
        Some((&self.mode + &self.along.z * along + &self.across.z * (across + beside), log_volume))
    }
}

/// A standard coordinate stretched to one side, `s + g (√(1 + s²) − 1)`, and the slope there.
fn stretch(s: f64, skew: f64) -> (f64, f64) {
    let root = s.hypot(1.0);
    (s + skew * (root - 1.0), 1.0 + skew * s / root)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Misfit that is linear in the coefficients `exp(L z)`, two of four combinations measured to 2 %, and the prior.
    struct Linear {
        factor: DMatrix<f64>,
        weighed: DMatrix<f64>,
    }

    impl Linear {
        fn new() -> Self {
            let factor = DMatrix::from_row_slice(
                4,
                4,
                &[0.3, 0.0, 0.0, 0.0, 0.1, 0.3, 0.0, 0.0, 0.0, 0.0, 0.4, 0.0, 0.0, 0.1, 0.1, 0.3],
            );
            let weighed = DMatrix::from_row_slice(2, 4, &[1.0, -0.6, 0.8, 0.2, 0.3, 1.0, -0.5, 0.9]) * 50.0;
            Self { factor, weighed }
        }

        /// Residuals that are zero at the centre of the prior, and their slopes.
        fn residuals(&self, z: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
            let grown = (&self.factor * z).map(f64::exp);
            let slopes = &self.weighed * DMatrix::from_diagonal(&grown) * &self.factor;
            (&self.weighed * grown.add_scalar(-1.0), slopes)
        }

        fn log_density(&self, z: &DVector<f64>) -> f64 {
            -0.5 * (self.residuals(z).0.norm_squared() + z.norm_squared())
        }

        fn ridge(&self) -> Ridge {
            let curvature = |z: &DVector<f64>| {
                let slopes = self.residuals(z).1;
                Some(slopes.tr_mul(&slopes) + DMatrix::identity(4, 4))
            };
            Ridge::new(DVector::zeros(4), &self.factor, curvature).unwrap()
        }
    }

    #[test]
    fn volume_equals_determinant_of_differences() {
        let ridge = Linear::new().ridge().with_skewness(&[0.9, 0.0, -0.6, 3.0]);
        let volume = |s: &DVector<f64>| {
            let column = |i: usize| {
                let beside = |step: f64| {
                    let mut s = s.clone();
                    s[i] += step;
                    ridge.point(&s).unwrap().0
                };
                (beside(1e-5) - beside(-1e-5)) / 2e-5
            };
            let columns: Vec<DVector<f64>> = (0..4).map(column).collect();
            DMatrix::from_columns(&columns).determinant().abs().ln()
        };
        let [a, b] = [[0.3, -0.2, 0.5, 1.0], [-1.7, 1.2, -0.8, 2.1]].map(|s| DVector::from_row_slice(&s));
        let stated = ridge.point(&a).unwrap().1 - ridge.point(&b).unwrap().1;
        let differences = volume(&a) - volume(&b);
        assert!((stated - differences).abs() < 1e-6, "{stated} {differences}");
    }

    #[test]
    fn density_of_linear_forces_is_nearly_standard_along_ridge() {
        let target = Linear::new();
        let ridge = target.ridge();
        let height = |s: &DVector<f64>| {
            let (z, log_volume) = ridge.point(s).unwrap();
            target.log_density(&z) + log_volume + 0.5 * s.norm_squared()
        };
        let straight = |s: &DVector<f64>| {
            let z = &ridge.along.z * s.rows_range(..2) + &ridge.across.z * s.rows_range(2..);
            target.log_density(&z) + 0.5 * s.norm_squared()
        };
        let mut largest = [0.0_f64; 2];
        for s in [[2.0, 0.0, 0.0, 0.0], [0.0, -2.0, 0.0, 0.0], [-1.5, 1.5, 1.0, -1.0], [1.5, 1.5, -1.0, 0.5]]
        {
            let s = DVector::from_row_slice(&s);
            let zero = DVector::zeros(4);
            largest[0] = largest[0].max((height(&s) - height(&zero)).abs());
            largest[1] = largest[1].max((straight(&s) - straight(&zero)).abs());
        }
        assert!(largest[0] < 1.0 && largest[1] > 10.0, "{largest:?}");
    }
}

//! Eigenvalue problems of shafts: every mode of one at rest or in whirl, every eigenvalue of one with dampers, and one mode
//! made exact.

use nalgebra::{Complex, ComplexField, DMatrix, DVector};

use super::{eigenvalues, hermitian};

type C = Complex<f64>;

/// Eigenvalues and eigenvectors of `A x = θ B x`, A Hermitian and B positive definite.
pub(crate) struct DefinitePencil<T: ComplexField> {
    pub(crate) values: DVector<f64>,
    /// In the coordinates `Lᴴ x`, L the Cholesky factor of B.
    reduced: DMatrix<T>,
    upper: DMatrix<T>,
}

impl<T: ComplexField<RealField = f64>> DefinitePencil<T> {
    /// `lower` is the Cholesky factor of B.
    ///
    /// # Panics
    /// If a diagonal entry of `lower` is zero, which no Cholesky factor has.
    pub(crate) fn new(a: &DMatrix<T>, lower: &DMatrix<T>) -> Self {
        let solve = |m: &DMatrix<T>| lower.solve_lower_triangular(m).expect("a Cholesky factor is regular");
        let eigen = hermitian(solve(&solve(a).adjoint()));
        Self { values: eigen.eigenvalues, reduced: eigen.eigenvectors, upper: lower.adjoint() }
    }

    /// Numbers of the eigenvalues, the lowest first.
    pub(crate) fn ascending(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.values.len()).collect();
        order.sort_by(|a, b| self.values[*a].total_cmp(&self.values[*b]));
        order
    }

    /// The eigenvector of that number, of unit `xᴴ B x`.
    pub(crate) fn vector(&self, number: usize) -> DVector<T> {
        let reduced = self.reduced.column(number).into_owned();
        self.upper.solve_upper_triangular(&reduced).expect("a Cholesky factor is regular")
    }

    /// All eigenvectors, in the order of the eigenvalues.
    pub(crate) fn vectors(&self) -> DMatrix<T> {
        self.upper.solve_upper_triangular(&self.reduced).expect("a Cholesky factor is regular")
    }
}

/// All eigenvalues of `λ² + λ D + K`; `None` if they are not found.
pub(crate) fn quadratic(damping: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> Option<Vec<C>> {
    let n = stiffness.nrows();
    // velocities in units of the highest frequency, or rounding of K swamps the low modes
    let scale = stiffness.amax().sqrt();
    let mut state = DMatrix::zeros(2 * n, 2 * n);
    state.view_mut((0, n), (n, n)).fill_diagonal(scale);
    state.view_mut((n, 0), (n, n)).copy_from(&(stiffness * (-1.0 / scale)));
    state.view_mut((n, n), (n, n)).copy_from(&-damping);
    eigenvalues(state)
}

/// A matrix `T(λ)` that is singular at its eigenvalues.
pub(crate) trait MatrixFunction {
    /// `T'(λ) v`.
    fn slope(&self, lambda: C, v: &DVector<C>) -> DVector<C>;

    /// `T(λ)⁻¹ f`; `None` if it is singular.
    fn solve(&self, lambda: C, f: &DVector<C>) -> Option<DVector<C>>;
}

/// When Newton's method ends.
pub(crate) struct NewtonLimits {
    /// Step of the eigenvalue, relative, that ends it.
    pub(crate) settled: f64,
    /// Distance from the guess, relative, at which it gives up.
    pub(crate) farthest: f64,
    /// Whether the start is near the eigenvector; a start that is not says nothing of the eigenvalue.
    pub(crate) near: bool,
}

/// An eigenpair as Newton's method left it.
pub(crate) struct Eigenpair {
    pub(crate) value: C,
    /// Of unit length.
    pub(crate) vector: DVector<C>,
    pub(crate) settled: bool,
}

/// Rounds of Newton's method; it converges quadratically.
const MOST_ROUNDS: usize = 12;

/// The eigenpair next to a guess, by inverse iteration (Newton's method on the pair: A. Ruhe, SIAM J. Numer. Anal. 10
/// (1973), 674–689, section 3); `None` where it leaves the guess too far behind.
pub(crate) fn newton(
    function: &impl MatrixFunction,
    guess: C,
    start: &DVector<C>,
    limits: &NewtonLimits,
) -> Option<Eigenpair> {
    let (mut value, mut vector) = (guess, start.unscale(start.norm()));
    for round in 0..MOST_ROUNDS {
        let Some(next) = function.solve(value, &function.slope(value, &vector)) else {
            // an eigenvalue to the last digit; the smallest step off it has an inverse
            value *= 1.0 + 4.0 * f64::EPSILON;
            continue;
        };
        let step = vector.dotc(&next).inv();
        if !step.is_finite() {
            return None;
        }
        vector = next.unscale(next.norm());
        if round > 0 || limits.near {
            value -= step;
            if (value - guess).norm() > limits.farthest * guess.norm() {
                return None;
            }
            if step.norm() < limits.settled * value.norm() {
                return Some(Eigenpair { value, vector, settled: true });
            }
        }
    }
    Some(Eigenpair { value, vector, settled: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `λ² + λ D + K` of two masses in a row with a damper.
    fn chain() -> (DMatrix<f64>, DMatrix<f64>) {
        let damping = DMatrix::from_row_slice(2, 2, &[0.3, -0.3, -0.3, 0.3]);
        (damping, DMatrix::from_row_slice(2, 2, &[5.0, -2.0, -2.0, 3.0]))
    }

    struct Quadratic;

    impl MatrixFunction for Quadratic {
        fn slope(&self, lambda: C, v: &DVector<C>) -> DVector<C> {
            chain().0.map(C::from) * v + v * (lambda * 2.0)
        }

        fn solve(&self, lambda: C, f: &DVector<C>) -> Option<DVector<C>> {
            let (damping, stiffness) = chain();
            let t = stiffness.zip_map(&damping, |k, d| lambda * d + k);
            (t + DMatrix::identity(2, 2) * (lambda * lambda)).lu().solve(f)
        }
    }

    #[test]
    fn definite_pencil_has_closed_form_of_two_masses() {
        // masses 1 and 4, springs 3 and 1: 4θ² − 17θ + 3 = 0
        let a = DMatrix::from_row_slice(2, 2, &[4.0, -1.0, -1.0, 1.0]);
        let b = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 4.0]);
        let pencil = DefinitePencil::new(&a, &b.clone().cholesky().unwrap().l());
        let root = (17.0_f64 * 17.0 - 4.0 * 4.0 * 3.0).sqrt();
        let order = pencil.ascending();
        for (at, closed) in order.iter().zip([(17.0 - root) / 8.0, (17.0 + root) / 8.0]) {
            let (value, x) = (pencil.values[*at], pencil.vector(*at));
            assert!((value - closed).abs() < 1e-13, "{value} {closed}");
            assert!((x.dot(&(&b * &x)) - 1.0).abs() < 1e-14 && (&a * &x - &b * &x * value).amax() < 1e-13);
            assert!((pencil.vectors().column(*at) - x).amax() < 1e-15);
        }
    }

    #[test]
    fn newton_finds_the_eigenvalues_of_the_state_matrix() {
        let (damping, stiffness) = chain();
        let limits = NewtonLimits { settled: 1e-13, farthest: 0.5, near: false };
        let start = DVector::from_vec(vec![C::new(1.0, 0.2), C::new(-0.3, 0.5)]);
        for value in quadratic(&damping, &stiffness).unwrap() {
            let found = newton(&Quadratic, value * C::new(1.01, 0.003), &start, &limits).unwrap();
            assert!(found.settled && (found.value - value).norm() < 1e-12, "{} {value}", found.value);
        }
    }
}

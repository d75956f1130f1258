//! The regression behind all influence coefficients: runs with known weights, `Y = Y₀ + Σ A U + ε` at every row.
//!
//! A row is one probe at one speed. Information adds up: that of a prior, and that of every run with the covariance of its ε
//! over the rows. Without a prior, of one row alone, it is least squares.
//!
//! Complex numbers are in real form, as a prior from a model is not circular: real parts of the rows, then imaginary parts;
//! first those of Y₀, then those of each plane's A.

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};

use crate::decomposition::singular_values;
use crate::error::Error;

type C = Complex<f64>;

/// Smallest singular value, of trial weights scaled to one, above which they tell the planes apart.
const INDEPENDENT: f64 = 1e-3;

/// Information about Y₀ and A: the inverse of their covariance, and that times their mean.
pub struct Regression {
    precision: DMatrix<f64>,
    right: DVector<f64>,
    rows: usize,
    planes: usize,
}

/// Mean and covariance of Y₀ and A at some rows.
#[derive(Debug, Clone)]
pub struct InfluencePosterior {
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
    rows: usize,
    planes: usize,
}

impl Regression {
    pub fn new(rows: usize, planes: usize) -> Self {
        let size = 2 * rows * (1 + planes);
        Self { precision: DMatrix::zeros(size, size), right: DVector::zeros(size), rows, planes }
    }

    /// Adds a prior: Y₀ is zero with this precision in each component, A has a mean and a covariance.
    pub fn add_prior(&mut self, before: f64, mean: &DVector<f64>, covariance: &Cholesky<f64, Dyn>) {
        let (n, inner) = (2 * self.rows, 2 * self.rows * self.planes);
        (0..n).for_each(|i| self.precision[(i, i)] += before);
        let mut of_influence = self.precision.view_mut((n, n), (inner, inner));
        of_influence += covariance.inverse();
        let mut right = self.right.rows_mut(n, inner);
        right += covariance.solve(mean);
    }

    /// Adds a run with a share between 0 and 1: its components, their design and the inverse covariance of their ε.
    pub fn add(&mut self, design: &DMatrix<f64>, inverse: &DMatrix<f64>, y: &DVector<f64>, share: f64) {
        let weighted = design.tr_mul(inverse) * share;
        self.precision += &weighted * design;
        self.right += weighted * y;
    }

    /// Makes up for an effect that some of the added runs share: its covariance given Y₀ and A, `coupling` the information
    /// of these runs on it and on Y₀ and A, `right` that on it times their components.
    pub fn marginalize(&mut self, covariance: &DMatrix<f64>, coupling: &DMatrix<f64>, right: &DVector<f64>) {
        let through = coupling.tr_mul(covariance);
        self.precision -= &through * coupling;
        self.right -= through * right;
    }

    /// # Errors
    /// If the runs do not determine everything.
    pub fn solve(self) -> Result<InfluencePosterior, Error> {
        let solved = factor(self.precision)?;
        Ok(InfluencePosterior {
            mean: solved.solve(&self.right),
            covariance: solved.inverse(),
            rows: self.rows,
            planes: self.planes,
        })
    }
}

impl InfluencePosterior {
    /// These coefficients, known without error; rows × planes.
    pub fn known(per_weight: &DMatrix<C>) -> Self {
        let (rows, planes) = per_weight.shape();
        let size = 2 * rows * (1 + planes);
        let mut mean = DVector::zeros(size);
        mean.rows_mut(2 * rows, 2 * rows * planes).copy_from(&stacked(per_weight));
        Self { mean, covariance: DMatrix::zeros(size, size), rows, planes }
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn planes(&self) -> usize {
        self.planes
    }

    fn complex(&self, coefficient: usize, row: usize) -> C {
        let first = 2 * self.rows * coefficient + row;
        C::new(self.mean[first], self.mean[first + self.rows])
    }

    /// Y₀ of a row, then A of each plane.
    pub fn complex_mean(&self, row: usize) -> DVector<C> {
        DVector::from_fn(1 + self.planes, |coefficient, _| self.complex(coefficient, row))
    }

    /// A, rows × planes.
    pub fn per_weight(&self) -> DMatrix<C> {
        DMatrix::from_fn(self.rows, self.planes, |row, j| self.complex(1 + j, row))
    }

    /// Covariance per component of Y₀ and A of the first row, where that is circular.
    pub fn circular_covariance(&self) -> DMatrix<C> {
        let at = |i: usize| 2 * self.rows * i;
        let of = |i: usize, j: usize| {
            C::new(self.covariance[(at(i), at(j))], self.covariance[(at(i) + self.rows, at(j))])
        };
        DMatrix::from_fn(1 + self.planes, 1 + self.planes, of)
    }
}

/// Real parts of a column, then its imaginary parts; column after column.
pub fn stacked(influence: &DMatrix<C>) -> DVector<f64> {
    let parts = influence.column_iter().flat_map(|c| {
        let (re, im): (Vec<f64>, Vec<f64>) = c.iter().map(|h| (h.re, h.im)).unzip();
        re.into_iter().chain(im)
    });
    DVector::from_iterator(2 * influence.len(), parts.collect::<Vec<_>>())
}

/// Components of the rows per component of Y₀ and A, under these weights.
pub fn design(weights: &[C], rows: usize) -> DMatrix<f64> {
    let n = 2 * rows;
    let mut design = DMatrix::zeros(n, n * (1 + weights.len()));
    design.view_mut((0, 0), (n, n)).fill_with_identity();
    for (j, u) in weights.iter().enumerate() {
        for row in 0..rows {
            let at = n * (1 + j) + row;
            design[(row, at)] = u.re;
            design[(row, at + rows)] = -u.im;
            design[(rows + row, at)] = u.im;
            design[(rows + row, at + rows)] = u.re;
        }
    }
    design
}

/// Cholesky factor of a covariance.
pub fn factor(covariance: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>, Error> {
    covariance.cholesky().ok_or(Error::SingularScatter)
}

/// One reading of a row: the weights it was measured under, and the standard deviation of its components.
#[derive(Debug, Clone)]
pub struct Observation {
    pub weights: Vec<C>,
    pub phasor: C,
    pub sigma: f64,
}

/// Why a row has no coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Underdetermined {
    /// There are fewer readings than unknowns.
    TooFew,
    /// The trial weights do not tell the planes apart.
    Dependent,
}

/// Least squares of one row, with weights of about one.
///
/// # Errors
/// If the readings do not determine Y₀ and A.
pub fn least_squares(readings: &[Observation]) -> Result<InfluencePosterior, Underdetermined> {
    let planes = readings.first().map_or(0, |r| r.weights.len());
    if readings.len() < 1 + planes {
        return Err(Underdetermined::TooFew);
    }
    let plain = DMatrix::from_fn(readings.len(), 1 + planes, |i, j| match j {
        0 => C::from(1.0),
        _ => readings[i].weights[j - 1],
    });
    if singular_values(plain).min() < INDEPENDENT {
        return Err(Underdetermined::Dependent);
    }
    let mut regression = Regression::new(1, planes);
    for r in readings {
        let inverse = DMatrix::from_diagonal_element(2, 2, r.sigma.powi(-2));
        let components = DVector::from_column_slice(&[r.phasor.re, r.phasor.im]);
        regression.add(&design(&r.weights, 1), &inverse, &components, 1.0);
    }
    regression.solve().map_err(|_| Underdetermined::Dependent)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(weights: [C; 2], sigma: f64, off: C) -> Observation {
        let known = [C::new(3.0, -1.0), C::new(0.5, 2.0), C::new(-1.0, 0.3)];
        let phasor = known[0] + known[1] * weights[0] + known[2] * weights[1] + off;
        Observation { weights: weights.to_vec(), phasor, sigma }
    }

    /// Four runs with unlike noise.
    fn readings() -> Vec<Observation> {
        let i = C::i();
        let none = C::from(0.0);
        vec![
            reading([none, none], 0.1, C::new(0.05, 0.02)),
            reading([C::from(1.0), none], 0.2, C::new(-0.1, 0.04)),
            reading([none, i], 0.15, C::new(0.02, -0.03)),
            reading([-0.5 * i, C::new(0.6, 0.2)], 0.3, C::new(0.01, 0.2)),
        ]
    }

    #[test]
    fn real_form_solution_equals_complex_least_squares() {
        let readings = readings();
        let fit = least_squares(&readings).unwrap();
        let at = |i: usize, j: usize| if j == 0 { C::from(1.0) } else { readings[i].weights[j - 1] };
        let design = DMatrix::from_fn(4, 3, |i, j| at(i, j) / readings[i].sigma);
        let y = DVector::from_fn(4, |i, _| readings[i].phasor / readings[i].sigma);
        let inverse = (design.adjoint() * &design).try_inverse().unwrap();
        let expected = &inverse * design.adjoint() * y;
        assert!((fit.complex_mean(0) - expected).norm() < 1e-12);
        assert!((fit.circular_covariance() - inverse).norm() < 1e-12);
    }

    #[test]
    fn prior_without_precision_leaves_least_squares() {
        let readings = readings();
        let plain = least_squares(&readings).unwrap();
        let mut regression = Regression::new(1, 2);
        let vague = factor(DMatrix::from_diagonal_element(4, 4, 1e12)).unwrap();
        regression.add_prior(1e-12, &DVector::from_element(4, 5.0), &vague);
        for r in &readings {
            let inverse = DMatrix::from_diagonal_element(2, 2, r.sigma.powi(-2));
            let y = DVector::from_column_slice(&[r.phasor.re, r.phasor.im]);
            regression.add(&design(&r.weights, 1), &inverse, &y, 1.0);
        }
        assert!((regression.solve().unwrap().mean - plain.mean).norm() < 1e-9);
    }

    #[test]
    fn proportional_weights_are_dependent_and_few_runs_too_few() {
        let none = C::from(0.0);
        let run = |w: C| reading([w, 2.0 * w], 0.1, none);
        let all = [run(none), run(C::from(0.3)), run(C::i())];
        assert_eq!(least_squares(&all).unwrap_err(), Underdetermined::Dependent);
        assert_eq!(least_squares(&all[..2]).unwrap_err(), Underdetermined::TooFew);
    }
}

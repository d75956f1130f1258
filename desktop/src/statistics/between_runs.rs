//! Runs of one machine do not repeat to the last micrometre: between them it was stopped, cooled, mounted anew.
//!
//! The response of a run is off by a factor `1 + ε`, alike at all its probes and speeds, so that it grows with the response
//! and is correlated between probes; ε is complex and Gaussian, independent from run to run but for their mean. Its standard deviation
//! per component is found from the data with a prior of [`USUAL`]. To first order the error is ε times the model's response at the
//! last fit. It must not be taken of what was measured: a model that is too small everywhere would then shrink all that it misses
//! along with it, and fit better (d'Agostini, Nucl. Instrum. Methods A 1994, 346, 306).

use std::cmp::Ordering;

use nalgebra::{Complex, DMatrix, DVector};

use crate::decomposition::hermitian;
use crate::statistics::scatter::{MOST_BETWEEN_RUNS, Scatter};

/// Usual scatter between runs: on the rig of `tests/integration/rk4.rs` mountings repeat to about one percent.
const USUAL: f64 = 0.01;
/// How far that carries over to another machine: a factor of two, one standard deviation of the logarithm.
const USUAL_LOG_SD: f64 = 0.7;
/// Least that is looked at: it is hardly ever told from none.
const LEAST: f64 = 1e-4;
/// Steps over it in a search.
const GRID: usize = 16;

/// Minus twice the logarithm of the prior of scatter between runs, up to a constant; none costs like the least.
pub fn neg2_log_prior(scatter: &Scatter) -> f64 {
    ((scatter.between_runs.max(LEAST) / USUAL).ln() / USUAL_LOG_SD).powi(2)
}

/// Change of the readings, in stated noise units, per real and imaginary part of each way in which runs can differ from one another,
/// where the model predicts this: rows real and imaginary parts of the values, each known by its run and its standard deviation, m. Ways are Helmert's contrasts, each run against the mean
/// of those before it: what all runs share is the machine and no scatter. So there are none with one run alone.
pub fn columns(values: &[(usize, f64)], predicted_m: &[Complex<f64>]) -> DMatrix<f64> {
    let runs = values.iter().map(|(run, _)| run + 1).max().unwrap_or(0);
    let ways = runs.saturating_sub(1);
    let contrast = |run: usize, way: usize| {
        let size = ((way + 1) as f64 / (way + 2) as f64).sqrt();
        match run.cmp(&(way + 1)) {
            Ordering::Less => -size / (way + 1) as f64,
            Ordering::Equal => size,
            Ordering::Greater => 0.0,
        }
    };
    let mut columns = DMatrix::zeros(2 * values.len(), 2 * ways);
    for (i, ((run, sigma_m), predicted_m)) in values.iter().zip(predicted_m).enumerate() {
        for way in 0..ways {
            let y = predicted_m / *sigma_m * contrast(*run, way);
            columns.fixed_view_mut::<2, 2>(2 * i, 2 * way).copy_from_slice(&[y.re, y.im, -y.im, y.re]);
        }
    }
    columns
}

/// Residuals whose scatter between runs is sought.
pub struct BetweenRunsSearch {
    /// Eigenvalues and eigenvectors of the columns' products.
    values: DVector<f64>,
    vectors: DMatrix<f64>,
    /// The residuals' products with the columns, in those eigenvectors.
    seen: DVector<f64>,
}

/// A size of the scatter between runs that was tried.
pub struct BetweenRunsTrial {
    /// Standard deviation of each component of ε.
    pub between_runs: f64,
    /// Most probable size of each column.
    pub errors: DVector<f64>,
    /// Their squares in that deviation, what it costs to be so free, and the prior.
    pub cost: f64,
    /// Real numbers that they use up.
    pub used_up: f64,
}

impl BetweenRunsSearch {
    /// From columns and residuals whose noise is white and of unit size.
    pub fn new(columns: &DMatrix<f64>, residual: &DVector<f64>) -> Self {
        let eigen = hermitian(columns.tr_mul(columns));
        let seen = eigen.eigenvectors.tr_mul(&columns.tr_mul(residual));
        Self { values: eigen.eigenvalues.map(|v| v.max(0.0)), vectors: eigen.eigenvectors, seen }
    }

    /// Sizes over the whole range.
    pub fn tries(&self) -> impl Iterator<Item = BetweenRunsTrial> {
        let step = (MOST_BETWEEN_RUNS / LEAST).powf((GRID as f64).recip());
        (0..=GRID).map(move |k| self.of((LEAST * step.powi(k as i32)).min(MOST_BETWEEN_RUNS)))
    }

    fn of(&self, between_runs: f64) -> BetweenRunsTrial {
        let variance = between_runs * between_runs;
        let factor = self.values.map(|v| variance / (1.0 + variance * v));
        let errors = &self.vectors * self.seen.component_mul(&factor);
        let scatter = Scatter { between_runs, ..Scatter::STATED };
        let free: f64 = self.values.iter().map(|v| (1.0 + variance * v).ln()).sum();
        BetweenRunsTrial {
            between_runs,
            cost: errors.norm_squared() / variance + free + neg2_log_prior(&scatter),
            used_up: self.values.iter().map(|v| variance * v / (1.0 + variance * v)).sum(),
            errors,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    /// Columns of 60 values in each of `runs`, 100 noise units large, and residuals of runs that are off by `between_runs`.
    fn simulated(runs: usize, between_runs: f64) -> (DMatrix<f64>, DVector<f64>) {
        let mut random = StdRng::seed_from_u64(5);
        let mut normal = || -> f64 { random.sample(StandardNormal) };
        let mut columns = DMatrix::zeros(120 * runs, 2 * runs);
        for i in 0..60 * runs {
            let y = [100.0 * normal(), 100.0 * normal()];
            columns.fixed_view_mut::<2, 2>(2 * i, 2 * (i / 60)).copy_from_slice(&[y[0], y[1], -y[1], y[0]]);
        }
        let errors = DVector::from_fn(2 * runs, |_, _| between_runs * normal());
        let residual = &columns * errors + DVector::from_fn(120 * runs, |_, _| normal());
        (columns, residual)
    }

    fn most_probable(columns: &DMatrix<f64>, residual: &DVector<f64>) -> BetweenRunsTrial {
        let least = |t: &BetweenRunsTrial| (residual - columns * &t.errors).norm_squared() + t.cost;
        BetweenRunsSearch::new(columns, residual)
            .tries()
            .min_by(|a, b| least(a).total_cmp(&least(b)))
            .unwrap()
    }

    #[test]
    fn contrasts_are_orthonormal_and_blind_to_what_all_runs_share() {
        let values: Vec<(usize, f64)> = (0..5).map(|run| (run, 1.0)).collect();
        let columns = columns(&values, &[Complex::from(1.0); 5]);
        assert!((columns.tr_mul(&columns) - DMatrix::identity(8, 8)).amax() < 1e-12);
        let shared = DVector::from_fn(10, |i, _| [0.3, -0.7][i % 2]);
        assert!(columns.tr_mul(&shared).amax() < 1e-12);
    }

    #[test]
    fn between_run_scatter_is_recovered_and_near_zero_without_any() {
        for truth in [0.003, 0.01, 0.025] {
            let (columns, residual) = simulated(40, truth);
            let found = most_probable(&columns, &residual);
            assert!((found.between_runs / truth).ln().abs() < 0.35, "{} for {truth}", found.between_runs);
            assert!((found.used_up / 80.0 - 1.0).abs() < 0.2);
        }
        let (columns, residual) = simulated(40, 0.0);
        assert!(most_probable(&columns, &residual).between_runs < 0.002);
    }

    #[test]
    fn the_cost_of_a_try_is_that_of_the_whole_covariance() {
        let (columns, residual) = simulated(3, 0.02);
        let t = BetweenRunsSearch::new(&columns, &residual).of(0.02);
        let covariance = DMatrix::identity(residual.len(), residual.len())
            + &columns * columns.transpose() * 0.02f64.powi(2);
        let factor = covariance.cholesky().unwrap();
        let direct = residual.dot(&factor.solve(&residual)) + 2.0 * factor.l().diagonal().map(f64::ln).sum();
        let prior = neg2_log_prior(&Scatter { between_runs: 0.02, ..Scatter::STATED });
        let own = (&residual - &columns * &t.errors).norm_squared() + t.cost - prior;
        assert!((own - direct).abs() < 1e-8 * direct, "{own} {direct}");
    }
}

//! Runs of one machine do not repeat to the last micrometre: between them it was stopped, cooled, mounted anew.
//!
//! The response of a run is off by a factor `1 + ε`, alike at all its probes and speeds, so that it grows with the response
//! and is correlated between probes; ε is complex and Gaussian, independent from run to run but for their mean. Its standard deviation
//! per component is found from the data with a prior of [`USUAL`]. To first order the error is ε times the model's response at the
//! last fit. It must not be taken of what was measured: a model that is too small everywhere would then shrink all that it misses
//! along with it, and fit better (d'Agostini, Nucl. Instrum. Methods A 1994, 346, 306).

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, DVector};

use crate::statistics::scatter::{MOST_BETWEEN_RUNS, Scatter};

type C = Complex<f64>;

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

/// What the errors of runs change in the readings: `ε_r y` in every value of run r, y the predicted value in noise units.
///
/// The errors ε are complex, one a run, independent with the same standard deviation but for their mean: what all runs share is the
/// machine and no scatter. Their covariance is `s² (1 − 11ᵀ/R)`. As each error acts on its own run alone, everything that a fit needs
/// takes one pass over the values, whatever the number of runs.
#[derive(Debug, Clone)]
pub struct RunErrors {
    /// The run of each value; none where there is one run alone.
    run: Arc<[usize]>,
    runs: usize,
    /// y, real and imaginary parts in turn.
    response: DVector<f64>,
}

impl RunErrors {
    /// No errors, for so many real numbers.
    pub fn none(rows: usize) -> Self {
        Self { run: Arc::new([]), runs: 0, response: DVector::zeros(rows) }
    }

    /// From the values, each known by its run and its standard deviation, m, and what the model predicts there.
    pub fn new(values: &[(usize, f64)], predicted_m: &[C]) -> Self {
        let runs = values.iter().map(|(run, _)| run + 1).max().unwrap_or(0);
        if runs < 2 {
            return Self::none(2 * values.len());
        }
        let mut response = DVector::zeros(2 * values.len());
        for (i, ((_, sigma_m), predicted_m)) in values.iter().zip(predicted_m).enumerate() {
            let y = predicted_m / *sigma_m;
            (response[2 * i], response[2 * i + 1]) = (y.re, y.im);
        }
        Self { run: values.iter().map(|(run, _)| *run).collect(), runs, response }
    }

    pub fn is_empty(&self) -> bool {
        self.run.is_empty()
    }

    /// With its response whitened, which must mix values of the same run alone, real and imaginary parts alike.
    pub fn whitened(&self, whiten: impl FnOnce(&mut DMatrix<f64>)) -> Self {
        let mut response = DMatrix::from_columns(std::slice::from_ref(&self.response));
        whiten(&mut response);
        Self { response: response.column(0).into_owned(), ..self.clone() }
    }

    fn values(&self) -> impl Iterator<Item = (usize, C)> {
        let response = self.response.as_slice().chunks_exact(2).map(|y| C::new(y[0], y[1]));
        self.run.iter().copied().zip(response)
    }

    /// Σ|y|² of each run.
    fn squares(&self) -> Vec<f64> {
        let mut squares = vec![0.0; self.runs];
        self.values().for_each(|(run, y)| squares[run] += y.norm_sqr());
        squares
    }

    /// Σ ȳ x of each run, for values x as real and imaginary parts in turn.
    fn seen(&self, x: &[f64]) -> Vec<C> {
        let mut seen = vec![C::from(0.0); self.runs];
        for ((run, y), x) in self.values().zip(x.chunks_exact(2)) {
            seen[run] += y.conj() * C::new(x[0], x[1]);
        }
        seen
    }

    /// Adds the change that these errors cause.
    fn add(&self, errors: &[C], x: &mut [f64]) {
        for ((run, y), x) in self.values().zip(x.chunks_exact_mut(2)) {
            let change = y * errors[run];
            x[0] += change.re;
            x[1] += change.im;
        }
    }

    /// The change that these errors cause.
    pub fn change(&self, errors: &[C]) -> DVector<f64> {
        let mut change = DVector::zeros(self.response.len());
        self.add(errors, change.as_mut_slice());
        change
    }
}

/// Errors of runs with a standard deviation, allowed for as correlated noise beside white noise of unit size: covariance
/// `C = 1 + s² A P Aᴴ` with `P = 1 − 11ᵀ/R` and `A` the errors' action.
pub struct RunAllowance {
    errors: RunErrors,
    /// s², zero if nothing is allowed for.
    variance: f64,
    squares: Vec<f64>,
    /// `(1 − (1 + s²g)^(−½)) / g` with g the squares of a run: takes the run's own error off.
    shrink: Vec<f64>,
    /// What the errors share is given back: `A (1 + s²g)^(−½)`, and the factor on it.
    shared: Vec<C>,
    restored: f64,
}

impl RunAllowance {
    /// For errors with this standard deviation per component.
    pub fn new(errors: RunErrors, between_runs: f64) -> Self {
        let variance = if errors.is_empty() { 0.0 } else { between_runs * between_runs };
        let squares = errors.squares();
        let root = |g: &f64| (1.0 + variance * g).sqrt();
        let shrink = |g: &f64| if *g > 0.0 { (1.0 - root(g).recip()) / g } else { 0.0 };
        let shared = squares.iter().map(|g| C::from(root(g).recip())).collect();
        let together: f64 = squares.iter().map(|g| g / (1.0 + variance * g)).sum();
        // 1 − s²/R Σ g/(1+s²g), as a sum without cancellation
        let left = mean(squares.iter().map(|g| (1.0 + variance * g).recip()));
        let restored = if together > 0.0 { (left.sqrt().recip() - 1.0) / together } else { 0.0 };
        Self { shrink: squares.iter().map(shrink).collect(), shared, restored, variance, squares, errors }
    }

    pub fn is_empty(&self) -> bool {
        self.variance == 0.0
    }

    /// Every column times a root W of the inverse covariance, `W C Wᵀ = 1`: each run's own error is taken off, and what a shift of all
    /// runs alike lost by that is given back.
    pub fn whiten(&self, columns: &mut DMatrix<f64>) {
        if self.is_empty() {
            return;
        }
        for mut column in columns.column_iter_mut() {
            let x = column.as_mut_slice();
            let own: Vec<C> = self.errors.seen(x).iter().zip(&self.shrink).map(|(b, k)| -b * *k).collect();
            self.errors.add(&own, x);
            let alike: C = self.errors.seen(x).iter().zip(&self.shared).map(|(b, root)| b * root).sum();
            let alike: Vec<C> = self.shared.iter().map(|root| root * alike * self.restored).collect();
            self.errors.add(&alike, x);
        }
    }

    /// ln det of the covariance.
    pub fn log_det(&self) -> f64 {
        if self.is_empty() { 0.0 } else { log_det(&self.squares, self.variance) }
    }

    /// Most probable errors for residuals.
    pub fn estimate(&self, residual: &DVector<f64>) -> Vec<C> {
        most_probable(&self.errors.seen(residual.as_slice()), &self.squares, self.variance)
    }

    /// Squares of errors in their standard deviation.
    pub fn penalty(&self, errors: &[C]) -> f64 {
        if self.is_empty() { 0.0 } else { squares_of(errors) / self.variance }
    }
}

fn mean(numbers: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = numbers.len() as f64;
    numbers.sum::<f64>() / count
}

fn squares_of(errors: &[C]) -> f64 {
    errors.iter().map(C::norm_sqr).sum()
}

/// ln det of `1 + s² A P Aᴴ` over real and imaginary parts: that of independent errors, and of what their mean takes back
/// (matrix determinant lemma).
fn log_det(squares: &[f64], variance: f64) -> f64 {
    let own: f64 = squares.iter().map(|g| (variance * g).ln_1p()).sum();
    2.0 * (own + mean(squares.iter().map(|g| (1.0 + variance * g).recip())).ln())
}

/// Least `|x − Aε|² + |ε|²/s²` over errors that sum to zero, from `Aᴴx`.
fn most_probable(seen: &[C], squares: &[f64], variance: f64) -> Vec<C> {
    let weight = |g: &f64| variance / (1.0 + variance * g);
    let weights: f64 = squares.iter().map(weight).sum();
    if weights == 0.0 {
        return vec![C::from(0.0); seen.len()];
    }
    let level = seen.iter().zip(squares).map(|(b, g)| b * weight(g)).sum::<C>() / weights;
    seen.iter().zip(squares).map(|(b, g)| (b - level) * weight(g)).collect()
}

/// Residuals whose scatter between runs is sought.
pub struct BetweenRunsSearch {
    squares: Vec<f64>,
    seen: Vec<C>,
}

/// A size of the scatter between runs that was tried.
pub struct BetweenRunsTrial {
    /// Standard deviation of each component of ε.
    pub between_runs: f64,
    /// Most probable error of each run.
    pub errors: Vec<C>,
    /// Their squares in that deviation, what it costs to be so free, and the prior.
    pub cost: f64,
    /// Real numbers that they use up.
    pub used_up: f64,
}

impl BetweenRunsSearch {
    /// From errors and residuals whose noise is white and of unit size.
    pub fn new(errors: &RunErrors, residual: &DVector<f64>) -> Self {
        Self { squares: errors.squares(), seen: errors.seen(residual.as_slice()) }
    }

    /// Sizes over the whole range.
    pub fn tries(&self) -> impl Iterator<Item = BetweenRunsTrial> {
        let step = (MOST_BETWEEN_RUNS / LEAST).powf((GRID as f64).recip());
        (0..=GRID).map(move |k| self.of((LEAST * step.powi(k as i32)).min(MOST_BETWEEN_RUNS)))
    }

    fn of(&self, between_runs: f64) -> BetweenRunsTrial {
        let variance = between_runs * between_runs;
        let errors = most_probable(&self.seen, &self.squares, variance);
        let scatter = Scatter { between_runs, ..Scatter::STATED };
        // 2 s² d/ds² of half the ln det: Σ v/(1+v) over the eigenvalues v of the errors' covariance in noise units
        let share = |g: &f64| variance * g / (1.0 + variance * g);
        let left = |g: &f64| (1.0 + variance * g).recip();
        let all: f64 = self.squares.iter().map(left).sum();
        let taken: f64 = self.squares.iter().map(|g| share(g) * left(g)).sum();
        BetweenRunsTrial {
            between_runs,
            cost: squares_of(&errors) / variance
                + log_det(&self.squares, variance)
                + neg2_log_prior(&scatter),
            used_up: 2.0 * (self.squares.iter().map(share).sum::<f64>() - taken / all),
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

    /// Values of `each` a run, 100 noise units large, and residuals of runs that are off by `between_runs`.
    fn simulated(runs: usize, each: usize, between_runs: f64) -> (RunErrors, DVector<f64>) {
        let mut random = StdRng::seed_from_u64(5);
        let mut normal = || -> f64 { random.sample(StandardNormal) };
        let values: Vec<(usize, f64)> = (0..runs * each).map(|i| (i / each, 1.0)).collect();
        let predicted: Vec<C> = values.iter().map(|_| 100.0 * C::new(normal(), normal())).collect();
        let errors = RunErrors::new(&values, &predicted);
        let off: Vec<C> = (0..runs).map(|_| between_runs * C::new(normal(), normal())).collect();
        let rows = 2 * values.len();
        let residual = errors.change(&off) + DVector::from_fn(rows, |_, _| normal());
        (errors, residual)
    }

    /// The covariance as a matrix: of white noise, and of errors with Helmert's contrasts for the ways in which runs can differ.
    fn covariance(errors: &RunErrors, between_runs: f64) -> DMatrix<f64> {
        let rows = errors.response.len();
        let mut all = DMatrix::identity(rows, rows);
        for way in 0..errors.runs - 1 {
            let size = ((way + 1) as f64 / (way + 2) as f64).sqrt();
            let contrast = |run: usize| match run.cmp(&(way + 1)) {
                std::cmp::Ordering::Less => -size / (way + 1) as f64,
                std::cmp::Ordering::Equal => size,
                std::cmp::Ordering::Greater => 0.0,
            };
            for unit in [C::new(1.0, 0.0), C::new(0.0, 1.0)] {
                let of_runs: Vec<C> = (0..errors.runs).map(|run| unit * contrast(run)).collect();
                let column = errors.change(&of_runs) * between_runs;
                all += &column * column.transpose();
            }
        }
        all
    }

    fn most_probable(errors: &RunErrors, residual: &DVector<f64>) -> BetweenRunsTrial {
        let least = |t: &BetweenRunsTrial| (residual - errors.change(&t.errors)).norm_squared() + t.cost;
        let search = BetweenRunsSearch::new(errors, residual);
        search.tries().min_by(|a, b| least(a).total_cmp(&least(b))).unwrap()
    }

    #[test]
    fn whitened_covariance_is_one_and_its_determinant_known() {
        let (errors, residual) = simulated(4, 5, 0.02);
        let covariance = covariance(&errors, 0.02);
        let allowance = RunAllowance::new(errors, 0.02);
        let mut root = DMatrix::identity(40, 40);
        allowance.whiten(&mut root);
        assert!((&root * &covariance * root.transpose() - DMatrix::identity(40, 40)).amax() < 1e-10);
        let factor = covariance.cholesky().unwrap();
        let log_det = 2.0 * factor.l().diagonal().map(f64::ln).sum();
        assert!((allowance.log_det() - log_det).abs() < 1e-9 * log_det);
        // what the errors leave and what they cost is what the covariance makes of the residuals
        let found = allowance.estimate(&residual);
        let left = (&residual - allowance.errors.change(&found)).norm_squared() + allowance.penalty(&found);
        let direct = residual.dot(&factor.solve(&residual));
        assert!((left - direct).abs() < 1e-9 * direct, "{left} {direct}");
    }

    #[test]
    fn one_run_alone_has_no_error_and_shared_ones_are_none() {
        assert!(RunErrors::new(&[(0, 1.0); 6], &[C::from(1.0); 6]).is_empty());
        let (errors, _) = simulated(5, 3, 0.01);
        let alike = errors.change(&[C::new(0.3, -0.7); 5]);
        let found = RunAllowance::new(errors, 0.01).estimate(&alike);
        assert!(found.iter().sum::<C>().norm() < 1e-15);
    }

    #[test]
    fn between_run_scatter_is_recovered_and_near_zero_without_any() {
        for truth in [0.003, 0.01, 0.025] {
            let (errors, residual) = simulated(40, 60, truth);
            let found = most_probable(&errors, &residual);
            assert!((found.between_runs / truth).ln().abs() < 0.35, "{} for {truth}", found.between_runs);
            assert!((found.used_up / 78.0 - 1.0).abs() < 0.2);
        }
        let (errors, residual) = simulated(40, 60, 0.0);
        assert!(most_probable(&errors, &residual).between_runs < 0.002);
    }

    #[test]
    fn the_cost_of_a_try_is_that_of_the_whole_covariance() {
        let (errors, residual) = simulated(3, 60, 0.02);
        let t = BetweenRunsSearch::new(&errors, &residual).of(0.02);
        let covariance = covariance(&errors, 0.02);
        let beyond = &covariance - DMatrix::identity(residual.len(), residual.len());
        let factor = covariance.cholesky().unwrap();
        let direct = residual.dot(&factor.solve(&residual)) + 2.0 * factor.l().diagonal().map(f64::ln).sum();
        let prior = neg2_log_prior(&Scatter { between_runs: 0.02, ..Scatter::STATED });
        let own = (&residual - errors.change(&t.errors)).norm_squared() + t.cost - prior;
        assert!((own - direct).abs() < 1e-8 * direct, "{own} {direct}");
        assert!((t.used_up - factor.solve(&beyond).trace()).abs() < 1e-8);
    }
}

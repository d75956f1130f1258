//! How measured noise differs from the noise that a file states: larger or smaller by a factor, and
//! correlated from one reading to the next.
//!
//! Residuals in units of the stated standard deviation are taken as a first-order autoregression along each
//! series (one probe in one run, in the order of the file): `e_k = ρ e_{k−1} + s √(1 − ρ²) n_k` with white n of
//! unit size, so every residual has the size s and neighbours the correlation ρ (Box and Jenkins 1970, chapter 3).
//! Factor and correlation are found from the residuals, with the stated noise as a prior on the factor.

use nalgebra::DMatrix;

/// How far a stated standard deviation is trusted: a factor of 1.5 either way, one standard deviation of its
/// logarithm. It comes from a data sheet or from a handful of repeats, and five repeats of one value tell a
/// standard deviation to a third.
pub const STATED_LOG_SD: f64 = 0.405;
/// The same where the noise was assumed because no file states it: a factor of 3.
pub const ASSUMED_LOG_SD: f64 = 1.1;
/// Standard deviations of that trust beyond which it is no longer the noise that somebody stated: 1 % of all statements.
const BELIEVABLE: f64 = 2.58;
/// Largest correlation of what is still called noise: it loses half of itself in fourteen readings.
pub const MOST_CORRELATED: f64 = 0.95;
/// Largest scatter between runs, three times what is usual. Runs that differ by more differ in something that can be named.
pub const MOST_BETWEEN_RUNS: f64 = 0.03;
/// Steps over the correlation in a search.
const GRID: usize = 14;

/// The noise over what was stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Standard deviation over the stated one.
    pub scale: f64,
    /// Correlation of neighbouring readings of one probe.
    pub correlation: f64,
    /// Standard deviation of each component of what the response of a run is off by, relative, alike at all probes; zero where there
    /// is one run.
    pub between_runs: f64,
}

impl Scatter {
    /// As stated, white.
    pub const STATED: Self = Self { scale: 1.0, correlation: 0.0, between_runs: 0.0 };

    /// Minus twice the logarithm of the prior of the size, up to a constant: log-normal around the stated one.
    pub fn neg2_log_prior(&self, stated_log_sd: f64) -> f64 {
        (self.scale.ln() / stated_log_sd).powi(2)
    }

    /// Whether it is as correlated, or runs differ by as much, as what is still called noise can be: then it is not noise.
    pub fn is_at_edge(&self) -> bool {
        self.is_most_correlated() || self.between_runs > 0.999 * MOST_BETWEEN_RUNS
    }

    /// Whether it is as correlated as what is still called noise can be: it then takes for its own whatever changes slowly over speed.
    pub fn is_most_correlated(&self) -> bool {
        self.correlation > 0.999 * MOST_CORRELATED
    }

    /// Whether two are the same for all that a fit can notice.
    pub fn is_near(&self, other: &Self) -> bool {
        (self.scale / other.scale).ln().abs() < 0.01
            && (self.correlation - other.correlation).abs() < 0.01
            && (self.between_runs - other.between_runs).abs() <= 0.2 * self.between_runs
    }
}

/// Which value precedes each value in its series.
#[derive(Debug, Clone, Default)]
pub struct Predecessors {
    before: Vec<Option<usize>>,
    /// Values that have one before them.
    followers: usize,
}

impl Predecessors {
    /// From the label of the series of every value, in the order of the data.
    pub fn new<L: PartialEq>(labels: impl IntoIterator<Item = L>) -> Self {
        let mut last: Vec<(L, usize)> = Vec::new();
        let before = labels.into_iter().enumerate().map(|(at, label)| {
            match last.iter_mut().find(|(known, _)| *known == label) {
                Some((_, previous)) => Some(std::mem::replace(previous, at)),
                None => {
                    last.push((label, at));
                    None
                }
            }
        });
        let before: Vec<Option<usize>> = before.collect();
        Self { followers: before.iter().flatten().count(), before }
    }

    /// Turns residuals, or columns of a model, into ones whose noise is white and of unit size: two rows a
    /// value, real and imaginary part.
    pub fn whiten(&self, scatter: &Scatter, columns: &mut DMatrix<f64>) {
        let Scatter { scale, correlation, .. } = *scatter;
        let innovation = (scale * (1.0 - correlation * correlation).sqrt()).recip();
        for mut column in columns.column_iter_mut() {
            // backwards, so that what went before is still as it was
            for (at, before) in self.before.iter().enumerate().rev() {
                for part in 0..2 {
                    let own = column[2 * at + part];
                    column[2 * at + part] = match before {
                        Some(b) => (own - correlation * column[2 * b + part]) * innovation,
                        None => own / scale,
                    };
                }
            }
        }
    }

    /// Logarithm of the determinant of the noise's covariance in stated units, with `free` real numbers that
    /// were not used up by unknowns.
    pub fn log_det(&self, scatter: &Scatter, free: f64) -> f64 {
        let followers = 2.0 * self.followers as f64;
        2.0 * free * scatter.scale.ln() + followers * (1.0 - scatter.correlation.powi(2)).ln()
    }

    /// The most probable scatter of residuals in stated units, real and imaginary parts in turn, of which
    /// `free` are not used up by unknowns; and minus twice the logarithm of its probability.
    pub fn most_probable(&self, residuals: &[f64], free: f64, stated_log_sd: f64) -> (Scatter, f64) {
        self.best_of(&Sums::of(self, residuals), free, stated_log_sd)
    }

    /// What [`Self::most_probable`] costs on average where such residuals have white noise of the stated size, in `free` real
    /// numbers, beside them.
    pub fn expected_cost(&self, residuals: &[f64], free: f64, stated_log_sd: f64) -> f64 {
        let (values, followers) = (residuals.len() as f64, 2.0 * self.followers as f64);
        let each = free / values.max(1.0);
        let signal = Sums::of(self, residuals);
        let sums = Sums {
            first: signal.first + each * (values - followers),
            own: signal.own + each * followers,
            before: signal.before + each * followers,
            ..signal
        };
        self.best_of(&sums, free, stated_log_sd).1
    }

    fn best_of(&self, sums: &Sums, free: f64, stated_log_sd: f64) -> (Scatter, f64) {
        let at = |correlation: f64| {
            let squares = sums.whitened(correlation);
            let scale = scale_of(squares, free, stated_log_sd);
            let scatter = Scatter { scale, correlation, ..Scatter::STATED };
            let own = self.log_det(&scatter, free) + scatter.neg2_log_prior(stated_log_sd);
            (scatter, squares / (scale * scale) + own)
        };
        // by Fisher's z, in which a correlation is known equally well everywhere
        let most = MOST_CORRELATED.atanh();
        let grid = (0..=GRID).map(|k| at((most * k as f64 / GRID as f64).tanh()));
        let Some(best) = grid.min_by(|a, b| a.1.total_cmp(&b.1)) else { return at(0.0) };
        // between its neighbours, by the parabola through the three
        let step = most / GRID as f64;
        let z = best.0.correlation.atanh();
        let beside = |by: f64| at((z + by).clamp(0.0, most).tanh());
        let (low, high) = (beside(-step).1, beside(step).1);
        let bend = low - 2.0 * best.1 + high;
        if bend <= 0.0 {
            return best;
        }
        let refined = beside(0.5 * step * (low - high) / bend);
        if refined.1 < best.1 { refined } else { best }
    }
}

/// Sums of squares that the whitened residuals of any correlation are made of.
struct Sums {
    first: f64,
    own: f64,
    before: f64,
    product: f64,
}

impl Sums {
    fn of(series: &Predecessors, residuals: &[f64]) -> Self {
        let mut sums = Self { first: 0.0, own: 0.0, before: 0.0, product: 0.0 };
        for (at, before) in series.before.iter().enumerate() {
            for part in 0..2 {
                let own = residuals[2 * at + part];
                match before {
                    Some(b) => {
                        let b = residuals[2 * b + part];
                        sums.own += own * own;
                        sums.before += b * b;
                        sums.product += own * b;
                    }
                    None => sums.first += own * own,
                }
            }
        }
        sums
    }

    fn whitened(&self, correlation: f64) -> f64 {
        let innovations = self.own - 2.0 * correlation * self.product + correlation.powi(2) * self.before;
        self.first + innovations / (1.0 - correlation * correlation)
    }
}

/// The scale that makes `squares / s² + 2 free ln s + (ln s)² / sd²` least, by Newton's method in ln s.
fn scale_of(squares: f64, free: f64, stated_log_sd: f64) -> f64 {
    let (precision, most) = (stated_log_sd.powi(-2), BELIEVABLE * stated_log_sd);
    // the scale that the data alone give is nearly right: two or three steps lead from there to the optimum
    let of_data = 0.5 * (squares / free).ln();
    let mut log = if of_data.is_nan() { 0.0 } else { of_data.clamp(-most, most) };
    for _ in 0..50 {
        let data = squares * f64::exp(-2.0 * log);
        let slope = -2.0 * data + 2.0 * free + 2.0 * precision * log;
        let step = slope / (4.0 * data + 2.0 * precision);
        log -= step.clamp(-1.0, 1.0);
        if step.abs() < 1e-10 {
            break;
        }
    }
    log.clamp(-most, most).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    /// Two series of complex values, in turn.
    fn simulated(truth: &Scatter, count: usize, seed: u64) -> (Predecessors, Vec<f64>) {
        let mut random = StdRng::seed_from_u64(seed);
        let mut normal = || -> f64 { random.sample(StandardNormal) };
        let mut last = [[0.0; 2]; 2];
        let mut residuals = Vec::new();
        for k in 0..count {
            for state in &mut last {
                for x in state.iter_mut() {
                    let fresh = if k == 0 { 1.0 } else { (1.0 - truth.correlation.powi(2)).sqrt() };
                    *x = truth.correlation * *x * f64::from(u8::from(k > 0)) + fresh * truth.scale * normal();
                    residuals.push(*x);
                }
            }
        }
        (Predecessors::new((0..2 * count).map(|i| i % 2)), residuals)
    }

    #[test]
    fn whitening_equals_inverse_root_of_ar1_covariance() {
        let scatter = Scatter { scale: 1.7, correlation: 0.6, between_runs: 0.0 };
        let series = Predecessors::new([0, 1, 0, 0, 1]);
        let order: [i32; 5] = [0, 0, 1, 2, 1];
        let label = [0, 1, 0, 0, 1];
        let covariance = DMatrix::from_fn(10, 10, |i, j| {
            let (a, b) = (i / 2, j / 2);
            if label[a] != label[b] || i % 2 != j % 2 {
                return 0.0;
            }
            scatter.scale.powi(2) * scatter.correlation.powi((order[a] - order[b]).abs())
        });
        let mut root = DMatrix::identity(10, 10);
        series.whiten(&scatter, &mut root);
        let white = &root * &covariance * root.transpose();
        assert!((white - DMatrix::identity(10, 10)).amax() < 1e-12);
        assert!((series.log_det(&scatter, 10.0) - covariance.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn scale_and_correlation_of_simulated_noise_are_found() {
        for truth in [
            Scatter { scale: 1.0, correlation: 0.0, between_runs: 0.0 },
            Scatter { scale: 1.5, correlation: 0.8, between_runs: 0.0 },
            Scatter { scale: 0.7, correlation: 0.4, between_runs: 0.0 },
        ] {
            let (series, residuals) = simulated(&truth, 2000, 3);
            let (found, cost) = series.most_probable(&residuals, 8000.0, STATED_LOG_SD);
            assert!((found.scale / truth.scale - 1.0).abs() < 0.06, "{found:?} for {truth:?}");
            assert!((found.correlation - truth.correlation).abs() < 0.03, "{found:?} for {truth:?}");
            let mut white = DMatrix::from_column_slice(8000, 1, &residuals);
            series.whiten(&found, &mut white);
            let own = series.log_det(&found, 8000.0) + found.neg2_log_prior(STATED_LOG_SD);
            let direct = DVector::from_column_slice(white.as_slice()).norm_squared() + own;
            assert!((cost - direct).abs() < 1e-6 * direct.abs());
        }
    }

    #[test]
    fn few_residuals_keep_stated_noise_and_many_overrule_it() {
        let scale = |count: usize| {
            let residuals: Vec<f64> = (0..count).map(|i| if i % 4 < 2 { 2.0 } else { -2.0 }).collect();
            let lonely = Predecessors::new(0..count / 2);
            lonely.most_probable(&residuals, count as f64, STATED_LOG_SD).0.scale
        };
        assert!(scale(4) < 1.7, "{}", scale(4));
        assert!((scale(4000) - 2.0).abs() < 0.01);
    }
}

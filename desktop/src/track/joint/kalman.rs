//! A linear Gaussian filter and its smoother, for a state of any size.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Mean and covariance.
#[derive(Debug, Clone)]
pub struct Gaussian {
    /// Mean.
    pub mean: DVector<f64>,
    /// Covariance.
    pub covariance: DMatrix<f64>,
}

/// One step in time: `x → F x + noise of covariance Q`.
#[derive(Debug, Clone)]
pub struct Step {
    /// F.
    pub transition: DMatrix<f64>,
    /// Q.
    pub noise: DMatrix<f64>,
}

impl Gaussian {
    /// A step later.
    pub fn predicted(&self, step: &Step) -> Self {
        Self {
            mean: &step.transition * &self.mean,
            covariance: symmetric(
                &step.transition * &self.covariance * step.transition.transpose() + &step.noise,
            ),
        }
    }
}

/// A measurement held against a prediction: `y = C x + noise`, and what was measured minus `C mean`.
pub struct Innovation<'a> {
    slope: &'a DMatrix<f64>,
    left: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Squared innovation in its own standard deviations.
    pub squared: f64,
    /// Logarithm of the determinant of its covariance.
    pub log_det: f64,
}

impl<'a> Innovation<'a> {
    /// `None` if the covariance is not positive definite, which noise rules out.
    pub fn new(
        prior: &Gaussian,
        slope: &'a DMatrix<f64>,
        left: DVector<f64>,
        variance: &DVector<f64>,
    ) -> Option<Self> {
        let mut spread = slope * &prior.covariance * slope.transpose();
        for (i, v) in variance.iter().enumerate() {
            spread[(i, i)] += v;
        }
        let factor = symmetric(spread).cholesky()?;
        let squared = left.dot(&factor.solve(&left));
        let log_det = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(Self { slope, left, factor, squared, log_det })
    }

    /// The state with this measurement.
    pub fn update(&self, prior: &Gaussian) -> Gaussian {
        let seen = self.slope * &prior.covariance;
        let gain = self.factor.solve(&seen).transpose();
        Gaussian {
            mean: &prior.mean + &gain * &self.left,
            covariance: symmetric(&prior.covariance - gain * seen),
        }
    }
}

/// Smoothed states, and for each but the last the covariance of the next state with it.
///
/// `filtered[k]` is the state at `k` with everything measured until then, `steps[k]` leads from `k` to
/// `k + 1` (Rauch, Tung and Striebel 1965).
pub fn smooth(filtered: &[Gaussian], steps: &[Step]) -> (Vec<Gaussian>, Vec<DMatrix<f64>>) {
    let mut smoothed = vec![filtered[filtered.len() - 1].clone()];
    let mut cross = Vec::new();
    for (now, step) in filtered.iter().zip(steps).rev() {
        let next = &smoothed[smoothed.len() - 1];
        let predicted = now.predicted(step);
        let Some(factor) = predicted.covariance.clone().cholesky() else {
            // a prediction without any spread has nothing to learn from what came later
            cross.push(DMatrix::zeros(now.mean.len(), now.mean.len()));
            smoothed.push(now.clone());
            continue;
        };
        let gain = factor.solve(&(&step.transition * &now.covariance)).transpose();
        let mean = &now.mean + &gain * (&next.mean - predicted.mean);
        let change = &next.covariance - predicted.covariance;
        let covariance = symmetric(&now.covariance + &gain * change * gain.transpose());
        cross.push(&next.covariance * gain.transpose());
        smoothed.push(Gaussian { mean, covariance });
    }
    smoothed.reverse();
    cross.reverse();
    (smoothed, cross)
}

fn symmetric(m: DMatrix<f64>) -> DMatrix<f64> {
    (&m + m.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A random walk measured five times: filter and smoother against the normal equations of all at once.
    #[test]
    fn filter_and_smoother_equal_least_squares_over_all_times() {
        let (q, r, measured) = (0.3, 0.5, [1.0, 1.4, 0.2, 0.9, 2.0]);
        let n = measured.len();
        let one = |v: f64| DMatrix::from_element(1, 1, v);
        let step = Step { transition: one(1.0), noise: one(q) };
        let mut at = Gaussian { mean: DVector::zeros(1), covariance: one(4.0) };
        let slope = one(1.0);
        let (mut filtered, mut log_likelihood) = (Vec::new(), 0.0);
        for (k, y) in measured.iter().enumerate() {
            if k > 0 {
                at = at.predicted(&step);
            }
            let left = DVector::from_element(1, y - at.mean[0]);
            let innovation = Innovation::new(&at, &slope, left, &DVector::from_element(1, r)).unwrap();
            log_likelihood -= 0.5 * (innovation.squared + innovation.log_det);
            at = innovation.update(&at);
            filtered.push(at.clone());
        }
        let (smoothed, cross) = smooth(&filtered, &vec![step; n - 1]);
        // prior covariance of all five states, and of what is measured
        let prior = DMatrix::from_fn(n, n, |i, j| 4.0 + q * i.min(j) as f64);
        let all = &prior + DMatrix::identity(n, n) * r;
        let y = DVector::from_row_slice(&measured);
        let solve = |m: &DMatrix<f64>| all.clone().cholesky().unwrap().solve(m);
        let mean = &prior * all.clone().cholesky().unwrap().solve(&y);
        let covariance = &prior - &prior * solve(&prior);
        for k in 0..n {
            assert!((smoothed[k].mean[0] - mean[k]).abs() < 1e-12);
            assert!((smoothed[k].covariance[(0, 0)] - covariance[(k, k)]).abs() < 1e-12);
        }
        for k in 0..n - 1 {
            assert!((cross[k][(0, 0)] - covariance[(k + 1, k)]).abs() < 1e-12);
        }
        let expected = -0.5 * (y.dot(&all.clone().cholesky().unwrap().solve(&y)) + all.determinant().ln());
        assert!((log_likelihood - expected).abs() < 1e-10);
    }
}

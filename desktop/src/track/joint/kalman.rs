//! A linear Gaussian filter and its smoother, for a state of any size.
//!
//! The smoother goes back along the filter's innovations with the score `r` and the information `N` of what came
//! later (de Jong 1989, "Smoothing and interpolation with the state-space model"): with `a`, `P` what was
//! predicted, the smoothed state is `a + P r` with covariance `P − P N P`. No covariance is inverted, and the
//! same two numbers say how much a shock at that time would have explained.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

#[derive(Debug, Clone)]
pub struct Gaussian {
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// One step in time: `x → F x + s + noise of covariance Q`.
#[derive(Debug, Clone)]
pub struct Transition {
    /// Diagonal of F.
    pub keep: DVector<f64>,
    /// Off-diagonal entries of F: row, column, value.
    pub reach: Vec<(usize, usize, f64)>,
    /// Constant part s of the step.
    pub shift: DVector<f64>,
    /// Covariance Q of the noise.
    pub noise: DMatrix<f64>,
}

impl Transition {
    /// `F M`.
    fn forward(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        let mut moved = m.clone();
        for mut column in moved.column_iter_mut() {
            let before = column.clone_owned();
            column.component_mul_assign(&self.keep);
            for (to, from, share) in &self.reach {
                column[*to] += share * before[*from];
            }
        }
        moved
    }

    /// `Fᵀ M`.
    fn back(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        let mut moved = m.clone();
        for mut column in moved.column_iter_mut() {
            let before = column.clone_owned();
            column.component_mul_assign(&self.keep);
            for (to, from, share) in &self.reach {
                column[*from] += share * before[*to];
            }
        }
        moved
    }

    /// `F x + s` of a state.
    fn moved(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut moved = x.component_mul(&self.keep) + &self.shift;
        self.reach.iter().for_each(|(to, from, share)| moved[*to] += share * x[*from]);
        moved
    }
}

impl Gaussian {
    pub fn predicted(&self, step: &Transition) -> Self {
        let half = step.forward(&self.covariance).transpose();
        Self { mean: step.moved(&self.mean), covariance: symmetric(step.forward(&half) + &step.noise) }
    }

    pub fn smoothed(&self, later: &BackwardPass) -> Self {
        let seen = &later.information * &self.covariance;
        Self {
            mean: &self.mean + &self.covariance * &later.score,
            covariance: symmetric(&self.covariance - &self.covariance * seen),
        }
    }
}

/// Innovation of a measurement `y = C x + noise`: `y − C mean` with its covariance.
pub struct Innovation {
    slope: DMatrix<f64>,
    /// `C P`, and the gain `S⁻¹ C P`.
    seen: DMatrix<f64>,
    gain: DMatrix<f64>,
    /// `S⁻¹ (y − C mean)` with S the innovation's covariance.
    weighed: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    /// Squared innovation in its own standard deviations.
    pub squared: f64,
    /// Logarithm of the determinant of its covariance.
    pub log_det: f64,
}

impl Innovation {
    /// `None` if the covariance is not positive definite, which noise rules out.
    pub fn new(
        prior: &Gaussian,
        slope: DMatrix<f64>,
        left: &DVector<f64>,
        variance: &DVector<f64>,
    ) -> Option<Self> {
        let seen = &slope * &prior.covariance;
        let mut spread = &seen * slope.transpose();
        for (i, v) in variance.iter().enumerate() {
            spread[(i, i)] += v;
        }
        let factor = symmetric(spread).cholesky()?;
        let weighed = factor.solve(left);
        let log_det = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let gain = factor.solve(&seen);
        Some(Self { slope, seen, gain, squared: left.dot(&weighed), weighed, factor, log_det })
    }

    /// The state with this measurement.
    pub fn update(&self, prior: &Gaussian) -> Gaussian {
        let mean = &prior.mean + self.seen.tr_mul(&self.weighed);
        Gaussian { mean, covariance: symmetric(&prior.covariance - self.seen.tr_mul(&self.gain)) }
    }

    /// One step of the backward pass, from the state after this measurement to that before it.
    fn before(&self, later: &BackwardPass) -> BackwardPass {
        // with K the gain, r ← Cᵀ S⁻¹ e + (1 − K C)ᵀ r and N ← Cᵀ S⁻¹ C + (1 − K C)ᵀ N (1 − K C)
        let score = &later.score + self.slope.tr_mul(&(&self.weighed - &self.gain * &later.score));
        let half = &later.information - (&later.information * self.gain.transpose()) * &self.slope;
        let rest = &half - self.slope.tr_mul(&(&self.gain * &half));
        let own = self.slope.tr_mul(&self.factor.solve(&self.slope));
        BackwardPass { score, information: symmetric(rest + own) }
    }
}

/// Score and information of all later measurements for a state (de Jong's r and N).
#[derive(Debug, Clone)]
pub struct BackwardPass {
    /// Score r: derivative of the log likelihood.
    pub score: DVector<f64>,
    /// Information N of the later measurements.
    pub information: DMatrix<f64>,
}

/// The filter at one time.
pub struct FilterStep {
    pub predicted: Gaussian,
    /// The measurements, in the order in which they were taken in.
    pub seen: Vec<Innovation>,
    pub filtered: Gaussian,
}

/// The backward pass at each prediction; `steps[k]` leads from time `k` to `k + 1`.
pub fn later(visits: &[FilterStep], steps: &[Transition]) -> Vec<BackwardPass> {
    let size = visits[0].filtered.mean.len();
    let mut at = BackwardPass { score: DVector::zeros(size), information: DMatrix::zeros(size, size) };
    let mut all = Vec::with_capacity(visits.len());
    for (k, visit) in visits.iter().enumerate().rev() {
        if let Some(step) = steps.get(k) {
            let half = step.back(&at.information).transpose();
            at = BackwardPass {
                score: step.back(&DMatrix::from_columns(&[at.score])).column(0).into_owned(),
                information: symmetric(step.back(&half)),
            };
        }
        for innovation in visit.seen.iter().rev() {
            at = innovation.before(&at);
        }
        all.push(at.clone());
    }
    all.reverse();
    all
}

/// Covariance of the smoothed state after a step with the one before it, of the `size` components from `at` on.
pub fn across(
    before: &FilterStep,
    step: &Transition,
    after: &FilterStep,
    later: &BackwardPass,
    at: usize,
    size: usize,
) -> DMatrix<f64> {
    let moved = step.forward(&before.filtered.covariance.columns(at, size).into_owned());
    let seen = &later.information * &moved;
    moved.rows(at, size) - after.predicted.covariance.rows(at, size) * seen
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
        let step = Transition {
            keep: DVector::from_element(1, 1.0),
            reach: Vec::new(),
            shift: DVector::zeros(1),
            noise: one(q),
        };
        let mut at = Gaussian { mean: DVector::zeros(1), covariance: one(4.0) };
        let (mut visits, mut log_likelihood) = (Vec::new(), 0.0);
        for (k, y) in measured.iter().enumerate() {
            if k > 0 {
                at = at.predicted(&step);
            }
            let predicted = at.clone();
            let left = DVector::from_element(1, y - at.mean[0]);
            let innovation = Innovation::new(&at, one(1.0), &left, &DVector::from_element(1, r)).unwrap();
            log_likelihood -= 0.5 * (innovation.squared + innovation.log_det);
            at = innovation.update(&at);
            let seen = vec![innovation];
            visits.push(FilterStep { predicted, seen, filtered: at.clone() });
        }
        let steps = vec![step; n - 1];
        let later = later(&visits, &steps);
        let smoothed: Vec<Gaussian> =
            visits.iter().zip(&later).map(|(v, l)| v.predicted.smoothed(l)).collect();
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
            let cross = across(&visits[k], &steps[k], &visits[k + 1], &later[k + 1], 0, 1);
            assert!((cross[(0, 0)] - covariance[(k + 1, k)]).abs() < 1e-12);
        }
        let expected = -0.5 * (y.dot(&all.clone().cholesky().unwrap().solve(&y)) + all.determinant().ln());
        assert!((log_likelihood - expected).abs() < 1e-10);
    }

    /// Position and rate, the position measured twice: the smoother against a prior of both times.
    #[test]
    fn smoothed_rate_and_position_equal_joint_gaussian() {
        let step = Transition {
            keep: DVector::from_row_slice(&[1.0, 0.8]),
            reach: vec![(0, 1, 0.9)],
            shift: DVector::zeros(2),
            noise: DMatrix::from_diagonal(&DVector::from_row_slice(&[0.1, 0.2])),
        };
        let transition = DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.0, 0.8]);
        let start = Gaussian { mean: DVector::zeros(2), covariance: DMatrix::identity(2, 2) * 2.0 };
        let measured = [0.7, -1.1];
        let mut at = start.clone();
        let mut visits = Vec::new();
        for (k, y) in measured.iter().enumerate() {
            if k > 0 {
                at = at.predicted(&step);
            }
            let predicted = at.clone();
            let slope = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
            let left = DVector::from_element(1, y - at.mean[0]);
            let innovation = Innovation::new(&at, slope, &left, &DVector::from_element(1, 0.5)).unwrap();
            at = innovation.update(&at);
            visits.push(FilterStep { seen: vec![innovation], predicted, filtered: at.clone() });
        }
        let later = later(&visits, std::slice::from_ref(&step));
        let first = visits[0].predicted.smoothed(&later[0]);
        let moved = &transition * &start.covariance;
        let second = &moved * transition.transpose() + &step.noise;
        let mut both = DMatrix::zeros(4, 4);
        both.view_mut((0, 0), (2, 2)).copy_from(&start.covariance);
        both.view_mut((2, 0), (2, 2)).copy_from(&moved);
        both.view_mut((0, 2), (2, 2)).copy_from(&moved.transpose());
        both.view_mut((2, 2), (2, 2)).copy_from(&second);
        let seen = DMatrix::from_row_slice(2, 4, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let spread = &seen * &both * seen.transpose() + DMatrix::identity(2, 2) * 0.5;
        let gain = &both * seen.transpose() * spread.try_inverse().unwrap();
        let mean = &gain * DVector::from_row_slice(&measured);
        let covariance = &both - &gain * &seen * &both;
        for i in 0..2 {
            assert!((first.mean[i] - mean[i]).abs() < 1e-12);
            for j in 0..2 {
                assert!((first.covariance[(i, j)] - covariance[(i, j)]).abs() < 1e-12);
            }
        }
        let cross = across(&visits[0], &step, &visits[1], &later[1], 0, 2);
        assert!((cross - covariance.view((2, 0), (2, 2))).amax() < 1e-12);
    }
}

//! A linear Gaussian filter and its smoother, for a state of any size.
//!
//! The smoother goes back along the filter's innovations with the score `r` and the information `N` of what came
//! later (de Jong 1989, "Smoothing and interpolation with the state-space model"): with `a`, `P` what was
//! predicted, the smoothed state is `a + P r` with covariance `P − P N P`. No covariance is inverted, and the
//! same two numbers say how much a shock at that time would have explained.

use std::borrow::Borrow;

use nalgebra::{DMatrix, DVector};

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
    /// `F M`, or with `is_transposed` `Fᵀ M`, in place of M.
    fn apply(&self, m: &mut DMatrix<f64>, is_transposed: bool) {
        let mut added = vec![0.0; self.reach.len()];
        for mut column in m.column_iter_mut() {
            for (added, (to, from, share)) in added.iter_mut().zip(&self.reach) {
                *added = share * column[if is_transposed { *to } else { *from }];
            }
            column.component_mul_assign(&self.keep);
            for (added, (to, from, _)) in added.iter().zip(&self.reach) {
                column[if is_transposed { *from } else { *to }] += added;
            }
        }
    }

    /// `F M`.
    fn forward(&self, mut m: DMatrix<f64>) -> DMatrix<f64> {
        self.apply(&mut m, false);
        m
    }

    /// `F M Fᵀ` of a symmetric M, or with `is_transposed` `Fᵀ M F`.
    fn on_both_sides(&self, m: &DMatrix<f64>, is_transposed: bool) -> DMatrix<f64> {
        let mut both = m.clone();
        self.apply(&mut both, is_transposed);
        both.transpose_mut();
        self.apply(&mut both, is_transposed);
        both
    }

    /// `Fᵀ r` of a score.
    fn back(&self, score: DVector<f64>) -> DVector<f64> {
        let mut column = DMatrix::from_columns(&[score]);
        self.apply(&mut column, true);
        column.column(0).into_owned()
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
        let mut covariance = step.on_both_sides(&self.covariance, false);
        covariance += &step.noise;
        make_symmetric(&mut covariance);
        Self { mean: step.moved(&self.mean), covariance }
    }

    pub fn smoothed(&self, later: &BackwardPass) -> Self {
        let seen = &later.information * &self.covariance;
        let mut covariance = self.covariance.clone();
        covariance.gemm(-1.0, &self.covariance, &seen, 1.0);
        make_symmetric(&mut covariance);
        Self { mean: &self.mean + &self.covariance * &later.score, covariance }
    }
}

/// Innovation `y − C mean` of a measurement `y = C x + noise`, of covariance `S = L Lᵀ`. It is kept multiplied by `L⁻¹`: the covariance is
/// then the unit matrix, and each number of the measurement updates the state by itself. Matrices have a row for each component of the
/// state.
pub struct Innovation {
    /// `(L⁻¹ C)ᵀ`.
    slope: DMatrix<f64>,
    /// `P (L⁻¹ C)ᵀ`, with P the covariance before the measurement.
    seen: DMatrix<f64>,
    /// `L⁻¹ (y − C mean)`.
    left: DVector<f64>,
    /// Squared innovation in its own standard deviations.
    pub squared: f64,
    /// Logarithm of the determinant of its covariance.
    pub log_det: f64,
}

impl Innovation {
    /// `None` if the covariance is not positive definite, which noise rules out.
    pub fn new(
        prior: &Gaussian,
        slope: &DMatrix<f64>,
        left: &DVector<f64>,
        variance: &DVector<f64>,
    ) -> Option<Self> {
        let (mut slope, mut left) = (slope.transpose(), left.clone());
        let mut seen = &prior.covariance * &slope;
        let mut spread = slope.tr_mul(&seen);
        for (i, v) in variance.iter().enumerate() {
            spread[(i, i)] += v;
        }
        let factor = spread.cholesky()?.unpack_dirty();
        for i in 0..left.len() {
            for j in 0..i {
                for columns in [&mut slope, &mut seen] {
                    let (earlier, mut own) = columns.columns_range_pair_mut(j, i);
                    own.axpy(-factor[(i, j)], &earlier, 1.0);
                }
                left[i] -= factor[(i, j)] * left[j];
            }
            let scale = factor[(i, i)].recip();
            slope.column_mut(i).scale_mut(scale);
            seen.column_mut(i).scale_mut(scale);
            left[i] *= scale;
        }
        let log_det = 2.0 * factor.diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(Self { slope, seen, squared: left.norm_squared(), left, log_det })
    }

    /// The state with this measurement.
    pub fn update(&self, prior: &Gaussian) -> Gaussian {
        let mut now = prior.clone();
        for (seen, left) in self.seen.column_iter().zip(self.left.iter()) {
            now.mean.axpy(*left, &seen, 1.0);
            now.covariance.ger(-1.0, &seen, &seen, 1.0);
        }
        now
    }

    /// The score alone of [`Self::before`]: with D the slope, W what is seen and e what is left, r ← D e + (1 − D Wᵀ) r.
    fn score_before(&self, mut score: DVector<f64>) -> DVector<f64> {
        let unexplained = &self.left - self.seen.tr_mul(&score);
        score.gemv(1.0, &self.slope, &unexplained, 1.0);
        score
    }

    /// One step of the backward pass, from the state after this measurement to that before it.
    fn before(&self, mut later: BackwardPass) -> BackwardPass {
        // with D the slope and W what is seen: N ← D Dᵀ + (1 − D Wᵀ) N (1 − W Dᵀ), which is N + D Hᵀ + H Dᵀ with
        // H = D (1 + Wᵀ N W) / 2 − N W
        later.score = self.score_before(later.score);
        let mut half = &later.information * &self.seen;
        let mut twice = self.seen.tr_mul(&half);
        twice.iter_mut().step_by(self.left.len() + 1).for_each(|own| *own += 1.0);
        half.gemm(0.5, &self.slope, &twice, -1.0);
        for (slope, half) in self.slope.column_iter().zip(half.column_iter()) {
            later.information.ger(1.0, &slope, &half, 1.0);
            later.information.ger(1.0, &half, &slope, 1.0);
        }
        make_symmetric(&mut later.information);
        later
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

/// The filter at one time. The filtered state is worked out anew where it is asked for: of long records its covariances would be a
/// third of the memory.
pub struct FilterStep {
    pub predicted: Gaussian,
    /// The measurements, in the order in which they were taken in.
    pub seen: Vec<Innovation>,
}

impl FilterStep {
    /// The state with these measurements.
    pub fn filtered(&self) -> Gaussian {
        self.seen.iter().fold(self.predicted.clone(), |state, innovation| innovation.update(&state))
    }

    /// Columns of the filtered covariance: so many (`size`), beginning at `at`.
    fn filtered_columns(&self, at: usize, size: usize) -> DMatrix<f64> {
        let mut columns = self.predicted.covariance.columns(at, size).into_owned();
        for seen in self.seen.iter().flat_map(|innovation| innovation.seen.column_iter()) {
            columns.ger(-1.0, &seen, &seen.rows(at, size), 1.0);
        }
        columns
    }
}

/// The backward pass at each prediction; `steps[k]` leads from time `k` to `k + 1`.
pub fn later(visits: &[FilterStep], steps: &[impl Borrow<Transition>]) -> Vec<BackwardPass> {
    backward(visits, steps, |_, _, at| at.clone())
}

/// What is `taken` from the backward pass at each prediction, by number.
pub fn backward<T>(
    visits: &[FilterStep],
    steps: &[impl Borrow<Transition>],
    taken: impl Fn(usize, &FilterStep, &BackwardPass) -> T,
) -> Vec<T> {
    let size = visits[0].predicted.mean.len();
    let mut at = BackwardPass { score: DVector::zeros(size), information: DMatrix::zeros(size, size) };
    let mut all = Vec::with_capacity(visits.len());
    for (k, visit) in visits.iter().enumerate().rev() {
        if let Some(step) = steps.get(k).map(Borrow::borrow) {
            let mut information = step.on_both_sides(&at.information, true);
            make_symmetric(&mut information);
            at = BackwardPass { score: step.back(at.score), information };
        }
        for innovation in visit.seen.iter().rev() {
            at = innovation.before(at);
        }
        all.push(taken(k, visit, &at));
    }
    all.reverse();
    all
}

/// Means of the smoothed states, which need no information of what came later.
pub fn smoothed_means(visits: &[FilterStep], steps: &[impl Borrow<Transition>]) -> Vec<DVector<f64>> {
    let mut score = DVector::zeros(visits[0].predicted.mean.len());
    let mut all = Vec::with_capacity(visits.len());
    for (k, FilterStep { predicted, seen }) in visits.iter().enumerate().rev() {
        if let Some(step) = steps.get(k).map(Borrow::borrow) {
            score = step.back(score);
        }
        score = seen.iter().rev().fold(score, |score, innovation| innovation.score_before(score));
        all.push(&predicted.mean + &predicted.covariance * &score);
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
    let moved = step.forward(before.filtered_columns(at, size));
    let seen = &later.information * &moved;
    moved.rows(at, size) - after.predicted.covariance.rows(at, size) * seen
}

/// Takes off what rounding has made different on both sides of the diagonal.
fn make_symmetric(m: &mut DMatrix<f64>) {
    for j in 0..m.ncols() {
        for i in j + 1..m.nrows() {
            let mean = 0.5 * (m[(i, j)] + m[(j, i)]);
            (m[(i, j)], m[(j, i)]) = (mean, mean);
        }
    }
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
            let innovation = Innovation::new(&at, &one(1.0), &left, &DVector::from_element(1, r)).unwrap();
            log_likelihood -= 0.5 * (innovation.squared + innovation.log_det);
            at = innovation.update(&at);
            visits.push(FilterStep { predicted, seen: vec![innovation] });
        }
        assert_eq!(visits[n - 1].filtered().mean, at.mean);
        let steps = vec![step; n - 1];
        let later = later(&visits, &steps);
        let smoothed: Vec<Gaussian> =
            visits.iter().zip(&later).map(|(v, l)| v.predicted.smoothed(l)).collect();
        let means: Vec<DVector<f64>> = smoothed.iter().map(|state| state.mean.clone()).collect();
        assert_eq!(smoothed_means(&visits, &steps), means);
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

    /// Position and rate at two times, of which the position, or two combinations of both at once, are measured: filter and smoother
    /// against a prior of both times.
    #[test]
    fn smoothed_rate_and_position_equal_joint_gaussian() {
        let position = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        let combinations = DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.3, -1.0]);
        for (slope, measured) in [(position, vec![0.7, -1.1]), (combinations, vec![0.7, 0.2, -1.1, 0.6])] {
            smoothed_equals_joint_gaussian(&slope, &DVector::from_vec(measured));
        }
    }

    fn smoothed_equals_joint_gaussian(slope: &DMatrix<f64>, measured: &DVector<f64>) {
        let step = Transition {
            keep: DVector::from_row_slice(&[1.0, 0.8]),
            reach: vec![(0, 1, 0.9)],
            shift: DVector::zeros(2),
            noise: DMatrix::from_diagonal(&DVector::from_row_slice(&[0.1, 0.2])),
        };
        let transition = DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.0, 0.8]);
        let start = Gaussian { mean: DVector::zeros(2), covariance: DMatrix::identity(2, 2) * 2.0 };
        let (numbers, variance) = (slope.nrows(), 0.5);
        let mut at = start.clone();
        let (mut visits, mut log_likelihood) = (Vec::new(), 0.0);
        for k in 0..2 {
            if k > 0 {
                at = at.predicted(&step);
            }
            let predicted = at.clone();
            let left = measured.rows(k * numbers, numbers) - slope * &at.mean;
            let innovation =
                Innovation::new(&at, slope, &left, &DVector::from_element(numbers, variance)).unwrap();
            log_likelihood -= 0.5 * (innovation.squared + innovation.log_det);
            at = innovation.update(&at);
            visits.push(FilterStep { seen: vec![innovation], predicted });
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
        let mut seen = DMatrix::zeros(2 * numbers, 4);
        seen.view_mut((0, 0), (numbers, 2)).copy_from(slope);
        seen.view_mut((numbers, 2), (numbers, 2)).copy_from(slope);
        let spread =
            &seen * &both * seen.transpose() + DMatrix::identity(2 * numbers, 2 * numbers) * variance;
        let log_det = spread.determinant().ln();
        let precision = spread.try_inverse().unwrap();
        let expected = -0.5 * (measured.dot(&(&precision * measured)) + log_det);
        assert!((log_likelihood - expected).abs() < 1e-12);
        let gain = &both * seen.transpose() * precision;
        let mean = &gain * measured;
        let covariance = &both - &gain * &seen * &both;
        // the filter has seen everything at the second time
        assert!((&at.mean - mean.rows(2, 2)).amax() < 1e-12);
        assert!((&at.covariance - covariance.view((2, 2), (2, 2))).amax() < 1e-12);
        assert!((&first.mean - mean.rows(0, 2)).amax() < 1e-12);
        assert!((&first.covariance - covariance.view((0, 0), (2, 2))).amax() < 1e-12);
        let cross = across(&visits[0], &step, &visits[1], &later[1], 0, 2);
        assert!((cross - covariance.view((2, 0), (2, 2))).amax() < 1e-12);
    }
}

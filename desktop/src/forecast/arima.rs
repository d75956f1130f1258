//! ARIMA(p, d, q) by exact likelihood.
//!
//! The series is differenced d times; what is left is an ARMA process without a mean (around its mean if
//! d is 0) in Harvey's state-space form, begun from its stationary distribution, and a Kalman filter gives
//! the exact Gaussian likelihood. Parameters are searched as partial autocorrelations (Monahan 1984), so
//! that every trial is stationary and invertible; the variance of the shocks is solved for.

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::neldermead::NelderMead;
use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::error::{Error, ForecastError};

/// Largest p and q that are supported.
const LARGEST: usize = 8;
/// Largest d that is supported.
const MOST_DIFFERENCES: usize = 2;
/// Random starts of a search, and how many of the best ends are followed to the end.
const STARTS: usize = 12;
const FINISHED: usize = 3;
/// Change of the filter's variance below which it is taken as settled.
const SETTLED: f64 = 1e-12;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    pub p: usize,
    pub d: usize,
    /// Moving-average terms.
    pub q: usize,
}

impl Order {
    /// Checks an order against the length of a series.
    ///
    /// # Errors
    /// If it is too large, for itself or for the series.
    pub fn check(self, values: usize) -> Result<(), Error> {
        let Self { p, d, q } = self;
        if p > LARGEST || q > LARGEST || d > MOST_DIFFERENCES {
            let (largest, most_differences) = (LARGEST, MOST_DIFFERENCES);
            return Err(ForecastError::ArimaOrder { p, d, q, largest, most_differences }.into());
        }
        let needed = d + 4 * (p + q + 1);
        if values < needed {
            return Err(ForecastError::ShortForArima { p, d, q, values, needed }.into());
        }
        Ok(())
    }
}

/// A model with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Arima {
    pub order: Order,
    pub ar: Vec<f64>,
    pub ma: Vec<f64>,
    /// Variance of the shocks.
    pub variance: f64,
    /// Mean of the series where d is 0, else 0.
    pub centre: f64,
}

/// What the filter says of a series.
struct FilterSums {
    /// Σ v²/F and Σ ln F, with shocks of unit variance.
    squares: f64,
    logs: f64,
    /// State expected after the last value, and its covariance with shocks of unit variance.
    state: DVector<f64>,
    spread: DMatrix<f64>,
}

fn differences(series: &[f64], d: usize) -> Vec<f64> {
    (0..d).fold(series.to_vec(), |s, _| s.windows(2).map(|w| w[1] - w[0]).collect())
}

impl Arima {
    fn size(&self) -> usize {
        self.order.p.max(self.order.q + 1)
    }

    fn transition(&self) -> DMatrix<f64> {
        let ar = |i: usize| self.ar.get(i).copied().unwrap_or(0.0);
        DMatrix::from_fn(self.size(), self.size(), |i, j| {
            (if j == 0 { ar(i) } else { 0.0 }) + f64::from(u8::from(j == i + 1))
        })
    }

    /// What a shock of one does to the state.
    fn shock(&self) -> DVector<f64> {
        DVector::from_fn(self.size(), |i, _| match i {
            0 => 1.0,
            _ => self.ma.get(i - 1).copied().unwrap_or(0.0),
        })
    }

    /// The exact filter over an ARMA series.
    fn filter(&self, values: &[f64]) -> FilterSums {
        let n = self.size();
        let ar = |i: usize| self.ar.get(i).copied().unwrap_or(0.0);
        let shock = self.shock();
        let transition = self.transition();
        let push = &shock * shock.transpose();
        let mut spread = stationary(&transition, &push);
        let mut state = DVector::<f64>::zeros(n);
        let (mut squares, mut logs) = (0.0, 0.0);
        let mut settled: Option<(f64, Vec<f64>)> = None;
        let mut next = vec![0.0; n];
        for y in values {
            let error = y - state[0];
            let (f, gain) = match &settled {
                Some((f, gain)) => (*f, gain.clone()),
                None => {
                    let f = spread[(0, 0)];
                    let gain: Vec<f64> = spread.column(0).iter().map(|s| s / f).collect();
                    (f, gain)
                }
            };
            squares += error * error / f;
            logs += f.ln();
            for i in 0..n {
                state[i] += gain[i] * error;
            }
            for i in 0..n {
                next[i] = ar(i) * state[0] + if i + 1 < n { state[i + 1] } else { 0.0 };
            }
            state.as_mut_slice().copy_from_slice(&next);
            if settled.is_none() {
                let column = spread.column(0).into_owned();
                let updated = &spread - &column * column.transpose() / f;
                let predicted = &transition * updated * transition.transpose() + &push;
                if (&predicted - &spread).amax() < SETTLED {
                    settled = Some((f, gain));
                }
                spread = predicted;
            }
        }
        FilterSums { squares, logs, state, spread }
    }

    /// Exact logarithm of the likelihood of a series, of its differences if d is not 0.
    pub fn log_likelihood(&self, series: &[f64]) -> f64 {
        let values = self.prepared(series);
        let found = self.filter(&values);
        let n = values.len() as f64;
        -0.5 * (n * (std::f64::consts::TAU * self.variance).ln() + found.logs + found.squares / self.variance)
    }

    /// Akaike's criterion, the variance counted.
    pub fn aic(&self, series: &[f64]) -> f64 {
        2.0 * (self.order.p + self.order.q + 1) as f64 - 2.0 * self.log_likelihood(series)
    }

    fn prepared(&self, series: &[f64]) -> Vec<f64> {
        differences(series, self.order.d).into_iter().map(|v| v - self.centre).collect()
    }

    /// The most likely parameters for a series, sought from those of `near` if it is of the same order.
    ///
    /// # Errors
    /// If the order does not fit the series, or the series does not change.
    pub fn fit(series: &[f64], order: Order, near: Option<&Self>) -> Result<Self, Error> {
        order.check(series.len())?;
        let plain = differences(series, order.d);
        let centre = if order.d == 0 { plain.iter().sum::<f64>() / plain.len() as f64 } else { 0.0 };
        let values: Vec<f64> = plain.iter().map(|v| v - centre).collect();
        let mean_square = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        if mean_square <= f64::MIN_POSITIVE {
            return Err(ForecastError::ConstantSeries { purpose: "fit" }.into());
        }
        let near = near.filter(|n| n.order == order);
        let likelihood = Likelihood { order, values: &values };
        let best = match near {
            Some(near) => likelihood.descend(near.free(), [0.05, 60.0]),
            None => likelihood.search(),
        };
        let (_, free) = best.ok_or_else(|| {
            Error::Unsuitable("ARIMA: the likelihood has no maximum; choose another --order".into())
        })?;
        let mut fitted = Self::from_free(order, &free);
        fitted.variance = fitted.filter(&values).squares / values.len() as f64;
        fitted.centre = centre;
        Ok(fitted)
    }

    fn from_free(order: Order, free: &[f64]) -> Self {
        let (ar, ma) = free.split_at(order.p);
        let ma = coefficients(ma).into_iter().map(|c| -c).collect();
        Self { order, ar: coefficients(ar), ma, variance: 1.0, centre: 0.0 }
    }

    fn free(&self) -> Vec<f64> {
        let ma: Vec<f64> = self.ma.iter().map(|c| -c).collect();
        partials(&self.ar).into_iter().chain(partials(&ma)).collect()
    }

    /// The next values of a series, as they are expected.
    pub fn forecast(&self, series: &[f64], steps: usize) -> Vec<f64> {
        let mut state = self.filter(&self.prepared(series)).state;
        let n = self.size();
        let mut ahead = Vec::with_capacity(steps);
        for _ in 0..steps {
            ahead.push(state[0] + self.centre);
            let first = state[0];
            for i in 0..n {
                let ar = self.ar.get(i).copied().unwrap_or(0.0);
                state[i] = ar * first + if i + 1 < n { state[i + 1] } else { 0.0 };
            }
        }
        for k in (0..self.order.d).rev() {
            let level = *differences(series, k).last().expect("a checked series is longer than d");
            let mut sum = level;
            ahead.iter_mut().for_each(|v| {
                sum += *v;
                *v = sum;
            });
        }
        ahead
    }

    /// Standard deviations of the next values of a series: of what is not known of the state after the last
    /// value, and of the shocks since.
    pub fn spread(&self, series: &[f64], steps: usize) -> Vec<f64> {
        let unknown = self.filter(&self.prepared(series)).spread;
        let transition = self.transition();
        // what the state after the last value does to the value of each step
        let mut row = DMatrix::from_fn(1, self.size(), |_, j| f64::from(u8::from(j == 0)));
        let mut rows = Vec::with_capacity(steps);
        for _ in 0..steps {
            rows.push(row.clone());
            row = &row * &transition;
        }
        for _ in 0..self.order.d {
            for k in 1..rows.len() {
                rows[k] = &rows[k] + &rows[k - 1];
            }
        }
        let shock = self.shock();
        let mut shocks = 0.0;
        let of = |row: &DMatrix<f64>| {
            let variance = (row * &unknown * row.transpose())[0] + shocks;
            shocks += (row * &shock)[0].powi(2);
            (variance * self.variance).sqrt()
        };
        rows.iter().map(of).collect()
    }
}

/// Stationary covariance of `x → T x + e`, by doubling.
fn stationary(transition: &DMatrix<f64>, push: &DMatrix<f64>) -> DMatrix<f64> {
    let (mut power, mut sum) = (transition.clone(), push.clone());
    for _ in 0..60 {
        let more = &power * &sum * power.transpose();
        let change = more.amax();
        sum += more;
        power = &power * &power;
        if change <= 1e-16 * sum.amax() || !sum.amax().is_finite() {
            break;
        }
    }
    sum
}

/// Coefficients of a stationary autoregression from unbounded numbers, through partial autocorrelations.
fn coefficients(free: &[f64]) -> Vec<f64> {
    let mut all: Vec<f64> = Vec::new();
    for x in free {
        let r = x / (1.0 + x * x).sqrt();
        let before = all.clone();
        for (i, a) in all.iter_mut().enumerate() {
            *a -= r * before[before.len() - 1 - i];
        }
        all.push(r);
    }
    all
}

/// The unbounded numbers that give these coefficients.
fn partials(coefficients: &[f64]) -> Vec<f64> {
    let mut all = coefficients.to_vec();
    let mut free = Vec::new();
    while let Some(r) = all.pop() {
        let r = r.clamp(-1.0 + 1e-12, 1.0 - 1e-12);
        free.push(r / (1.0 - r * r).sqrt());
        let before = all.clone();
        for (i, a) in all.iter_mut().enumerate() {
            *a = (*a + r * before[before.len() - 1 - i]) / (1.0 - r * r);
        }
    }
    free.reverse();
    free
}

/// Minus the logarithm of the likelihood, the variance solved for.
struct Likelihood<'a> {
    order: Order,
    values: &'a [f64],
}

impl Likelihood<'_> {
    fn of(&self, free: &[f64]) -> f64 {
        let found = Arima::from_free(self.order, free).filter(self.values);
        let n = self.values.len() as f64;
        let height = 0.5 * (n * (found.squares / n).ln() + found.logs);
        if height.is_finite() { height } else { f64::MAX }
    }

    /// The highest likelihood that searches from several starts find; the surface has more than one top.
    fn search(&self) -> Option<(f64, Vec<f64>)> {
        let unknowns = self.order.p + self.order.q;
        let mut random = StdRng::seed_from_u64(1);
        let mut starts: Vec<Vec<f64>> = [0.5, 0.1, 1.5].map(|x| vec![x; unknowns]).to_vec();
        starts.extend((0..STARTS).map(|_| (0..unknowns).map(|_| random.random_range(-2.5..2.5)).collect()));
        let lower = |a: &(f64, Vec<f64>), b: &(f64, Vec<f64>)| a.0.total_cmp(&b.0);
        let mut found: Vec<(f64, Vec<f64>)> =
            starts.into_iter().filter_map(|start| self.descend(start, [0.4, 200.0])).collect();
        found.sort_by(lower);
        // a simplex that has shrunk begins afresh from where it ended
        let again = |(_, at): &(f64, Vec<f64>)| {
            let (_, at) = self.descend(at.clone(), [0.3, 600.0])?;
            self.descend(at, [0.1, 600.0])
        };
        found.iter().take(FINISHED).filter_map(again).min_by(lower)
    }

    /// Downhill from a start with a simplex of this size, in so many moves at most.
    fn descend(&self, start: Vec<f64>, [step, most]: [f64; 2]) -> Option<(f64, Vec<f64>)> {
        if start.is_empty() {
            return Some((self.of(&start), start));
        }
        let corner = |k: usize| {
            let mut at = start.clone();
            if k > 0 {
                at[k - 1] += step;
            }
            at
        };
        let simplex: Vec<Vec<f64>> = (0..=start.len()).map(corner).collect();
        let solver = NelderMead::new(simplex).with_sd_tolerance(1e-7).ok()?;
        let found = Executor::new(self, solver)
            .configure(|state| state.max_iters(most as u64))
            .ctrlc(false)
            .run()
            .ok()?;
        let best = found.state.get_best_param()?.clone();
        Some((self.of(&best), best))
    }
}

impl CostFunction for &Likelihood<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, free: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        Ok(self.of(free))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_autocorrelations_and_coefficients_are_inverses() {
        let free = [0.7, -1.3, 0.2];
        for (a, b) in partials(&coefficients(&free)).iter().zip(free) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn ar1_likelihood_equals_closed_form() {
        let series = [0.3, -0.2, 0.9, 1.1, 0.4, -0.5];
        let (a, s2) = (0.6, 0.5);
        let order = Order { p: 1, d: 0, q: 0 };
        let model = Arima { order, ar: vec![a], ma: vec![], variance: s2, centre: 0.0 };
        let normal = |x: f64, v: f64| -0.5 * ((std::f64::consts::TAU * v).ln() + x * x / v);
        let later: f64 = series.windows(2).map(|w| normal(w[1] - a * w[0], s2)).sum();
        let closed = normal(series[0], s2 / (1.0 - a * a)) + later;
        assert!((model.log_likelihood(&series) - closed).abs() < 1e-12);
    }

    #[test]
    fn orders_that_do_not_fit_are_refused_with_what_is_needed() {
        let of = |p, d, q, n| Order { p, d, q }.check(n).unwrap_err().to_string();
        assert!(of(3, 1, 3, 20).contains("needs at least 29"));
        assert!(of(30, 1, 3, 500).contains("up to 8"));
    }
}

//! Monotone piecewise cubics (Fritsch & Carlson 1980, slopes of Fritsch & Butland 1984): between knots
//! no value lies beyond them.

/// Several functions of one variable through the same knots.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Monotone<const N: usize> {
    x: Vec<f64>,
    y: Vec<[f64; N]>,
    slope: Vec<[f64; N]>,
}

impl<const N: usize> Monotone<N> {
    /// Through at least two knots in ascending order.
    pub(super) fn new(x: Vec<f64>, y: Vec<[f64; N]>) -> Self {
        let last = x.len() - 1;
        let mut slope = vec![[0.0; N]; x.len()];
        for f in 0..N {
            let secant = |i: usize| (y[i + 1][f] - y[i][f]) / (x[i + 1] - x[i]);
            for i in 1..last {
                let (left, right) = (x[i] - x[i - 1], x[i + 1] - x[i]);
                let (a, b) = (secant(i - 1), secant(i));
                if a * b > 0.0 {
                    let (p, q) = (2.0 * right + left, right + 2.0 * left);
                    slope[i][f] = (p + q) / (p / a + q / b);
                }
            }
            for (end, inner, first) in [(0, 1, 0), (last, last - 1, last - 1)] {
                let a = secant(first);
                let guess = if last == 1 { a } else { 1.5 * a - 0.5 * slope[inner][f] };
                slope[end][f] =
                    if guess * a <= 0.0 { 0.0 } else { a.signum() * guess.abs().min(3.0 * a.abs()) };
            }
        }
        Self { x, y, slope }
    }

    pub(super) fn range(&self) -> [f64; 2] {
        [self.x[0], self.x[self.x.len() - 1]]
    }

    /// Values and derivatives at `x`, held to the knots' range.
    pub(super) fn at(&self, x: f64) -> ([f64; N], [f64; N]) {
        let [first, last] = self.range();
        let x = x.clamp(first, last);
        let i = self.x.partition_point(|knot| *knot <= x).clamp(1, self.x.len() - 1) - 1;
        let h = self.x[i + 1] - self.x[i];
        let t = (x - self.x[i]) / h;
        let (mut value, mut rate) = ([0.0; N], [0.0; N]);
        for f in 0..N {
            let (a, b) = (self.y[i][f], self.y[i + 1][f]);
            let (u, v) = (h * self.slope[i][f], h * self.slope[i + 1][f]);
            let (second, third) = (3.0 * (b - a) - 2.0 * u - v, 2.0 * (a - b) + u + v);
            value[f] = a + t * (u + t * (second + t * third));
            rate[f] = (u + t * (2.0 * second + 3.0 * t * third)) / h;
        }
        (value, rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monotone_cubic_is_second_order_and_step_never_overshoots() {
        let cubic = |x: f64| x + x * x * x / 3.0;
        let knots = |n: usize| -> Vec<f64> { (0..=n).map(|i| i as f64 / n as f64).collect() };
        let error = |n: usize| {
            let table = Monotone::new(knots(n), knots(n).iter().map(|&x| [cubic(x)]).collect());
            (0..=1000)
                .map(|k| k as f64 / 1000.0)
                .map(|x| (table.at(x).0[0] - cubic(x)).abs())
                .fold(0.0, f64::max)
        };
        assert!(error(40) < error(20) / 3.9, "{} {}", error(40), error(20));

        let step = Monotone::new(knots(6), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0].map(|y| [y]).to_vec());
        assert!((0..=600).all(|k| (0.0..=1.0).contains(&step.at(k as f64 / 600.0).0[0])));
    }

    #[test]
    fn the_derivative_is_that_of_the_values() {
        let x: Vec<f64> = (0..9).map(|i| (i as f64).powf(1.3)).collect();
        let y = x.iter().map(|x| [x.sin(), x.exp().ln_1p()]).collect();
        let table = Monotone::new(x, y);
        for at in [0.3, 2.2, 5.7, 13.1] {
            let d = 1e-6;
            let (up, down) = (table.at(at + d).0, table.at(at - d).0);
            for f in 0..2 {
                assert!(((up[f] - down[f]) / (2.0 * d) - table.at(at).1[f]).abs() < 1e-6);
            }
        }
    }
}

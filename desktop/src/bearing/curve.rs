//! Coefficients that follow the speed.

use std::sync::Arc;

use super::dynamic_coefficients::DynamicCoefficients;
use super::film_curve::FilmCurve;

/// Stiffness (N/m) and damping (N·s/m) over speed, beside what is constant.
#[derive(Debug, Clone)]
pub enum Curve {
    /// Between knots, each column times its own factor.
    Knots {
        /// Where the coefficients are known.
        knots: Arc<Knots>,
        /// Factors on the columns, as [`DynamicCoefficients`] is ordered.
        factors: DynamicCoefficients,
    },
    /// A parabola in the logarithm of the speed: the sum of these, times `ln(Ω/Ω_ref)` to the power 0, 1 and 2.
    Logarithmic {
        /// At the reference; change per unit of the logarithm; per its square.
        terms: [DynamicCoefficients; 3],
        reference_rad_s: f64,
    },
    Film(FilmCurve),
}

impl Curve {
    pub fn at(&self, speed_rad_s: f64) -> DynamicCoefficients {
        match self {
            Self::Knots { knots, factors } => knots.at(speed_rad_s).map(factors, |v, f| v * f),
            Self::Logarithmic { terms: [at, per_log, per_square], reference_rad_s } => {
                let log = (speed_rad_s / reference_rad_s).ln();
                DynamicCoefficients::from_columns(|i| {
                    at.column(i) + log * (per_log.column(i) + log * per_square.column(i))
                })
            }
            Self::Film(film) => film.at(speed_rad_s),
        }
    }

    /// A speed in the middle of where the curve is stated, rad/s.
    pub fn middle_rad_s(&self) -> f64 {
        match self {
            Self::Knots { knots, .. } => (knots.speeds_rad_s[0] * knots.last_rad_s()).sqrt(),
            Self::Logarithmic { reference_rad_s, .. } => *reference_rad_s,
            Self::Film(film) => {
                let [slowest, fastest] = film.range_rad_s();
                (slowest * fastest).sqrt()
            }
        }
    }
}

impl PartialEq for Curve {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Knots { knots: a, factors: f }, Self::Knots { knots: b, factors: g }) => {
                f == g && (Arc::ptr_eq(a, b) || a == b)
            }
            (
                Self::Logarithmic { terms: a, reference_rad_s: r },
                Self::Logarithmic { terms: b, reference_rad_s: s },
            ) => a == b && r == s,
            (Self::Film(a), Self::Film(b)) => a == b,
            _ => false,
        }
    }
}

/// How values between knots are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines, as the controller does it.
    Straight,
    /// Cubics that never overshoot (Fritsch and Carlson 1980, SIAM J. Numer. Anal. 17, 238).
    Monotone,
}

/// Coefficients at ascending speeds; outside they stay as at the nearest knot.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    speeds_rad_s: Vec<f64>,
    values: Vec<DynamicCoefficients>,
    /// Change per rad/s at each knot; empty for straight lines.
    slopes: Vec<DynamicCoefficients>,
}

impl Knots {
    /// At least two speeds, ascending; one value a speed.
    ///
    /// # Panics
    /// If there are none, or not as many values as speeds.
    pub fn new(speeds_rad_s: Vec<f64>, values: Vec<DynamicCoefficients>, between: Interpolation) -> Self {
        assert!(!speeds_rad_s.is_empty() && speeds_rad_s.len() == values.len(), "one value a speed");
        let slopes = match between {
            Interpolation::Straight => Vec::new(),
            Interpolation::Monotone => monotone_slopes(&speeds_rad_s, &values),
        };
        Self { speeds_rad_s, values, slopes }
    }

    /// Speeds of the knots, rad/s.
    pub fn speeds_rad_s(&self) -> &[f64] {
        &self.speeds_rad_s
    }

    /// What was stated at the knots.
    pub fn values(&self) -> &[DynamicCoefficients] {
        &self.values
    }

    /// Speed of the last knot, rad/s.
    pub fn last_rad_s(&self) -> f64 {
        self.speeds_rad_s[self.speeds_rad_s.len() - 1]
    }

    pub fn at(&self, speed_rad_s: f64) -> DynamicCoefficients {
        let above = self.speeds_rad_s.partition_point(|s| *s < speed_rad_s);
        if above == 0 || above == self.speeds_rad_s.len() {
            return self.values[above.min(self.values.len() - 1)];
        }
        let (i, j) = (above - 1, above);
        let step = self.speeds_rad_s[j] - self.speeds_rad_s[i];
        let t = (speed_rad_s - self.speeds_rad_s[i]) / step;
        let (a, b) = (&self.values[i], &self.values[j]);
        if self.slopes.is_empty() {
            return a.map(b, |a, b| a + t * (b - a));
        }
        let (p, q) = (&self.slopes[i], &self.slopes[j]);
        let hermite = [
            (1.0 + 2.0 * t) * (1.0 - t).powi(2),
            t * (1.0 - t).powi(2) * step,
            t * t * (3.0 - 2.0 * t),
            t * t * (t - 1.0) * step,
        ];
        DynamicCoefficients::from_columns(|e| {
            let [h00, h10, h01, h11] = hermite;
            h00 * a.column(e) + h10 * p.column(e) + h01 * b.column(e) + h11 * q.column(e)
        })
    }
}

/// Slopes at the knots with which no cubic overshoots: zero at extremes, else the weighted harmonic mean of the
/// slopes on either side (Fritsch and Butland 1984, SIAM J. Sci. Stat. Comput. 5, 300).
fn monotone_slopes(speeds: &[f64], values: &[DynamicCoefficients]) -> Vec<DynamicCoefficients> {
    let n = speeds.len();
    if n == 1 {
        return vec![DynamicCoefficients::zeros()];
    }
    let step = |i: usize| speeds[i + 1] - speeds[i];
    let secant = |i: usize, e: usize| (values[i + 1].column(e) - values[i].column(e)) / step(i);
    let inside = |i: usize, e: usize| {
        let (before, after) = (secant(i - 1, e), secant(i, e));
        if before * after <= 0.0 {
            return 0.0;
        }
        let (left, right) = (step(i - 1), step(i));
        let (w, v) = (2.0 * right + left, right + 2.0 * left);
        (w + v) / (w / before + v / after)
    };
    // at an end, a parabola through three knots, held within what keeps it monotone
    let end = |near: f64, far: f64, h0: f64, h1: f64| {
        let slope = ((2.0 * h0 + h1) * near - h0 * far) / (h0 + h1);
        if slope * near <= 0.0 {
            0.0
        } else if near * far <= 0.0 && slope.abs() > 3.0 * near.abs() {
            3.0 * near
        } else {
            slope
        }
    };
    let at = |i: usize, e: usize| match i {
        _ if n == 2 => secant(0, e),
        0 => end(secant(0, e), secant(1, e), step(0), step(1)),
        last if last == n - 1 => end(secant(n - 2, e), secant(n - 3, e), step(n - 2), step(n - 3)),
        _ => inside(i, e),
    };
    (0..n).map(|i| DynamicCoefficients::from_columns(|e| at(i, e))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(values: &[f64], between: Interpolation) -> Knots {
        let speeds = (0..values.len()).map(|i| 100.0 * (i + 1) as f64 + 7.0 * (i * i) as f64).collect();
        let pairs =
            values.iter().map(|v| DynamicCoefficients::from_columns(|e| v * (1.0 + e as f64))).collect();
        Knots::new(speeds, pairs, between)
    }

    #[test]
    fn curve_meets_knots_and_never_overshoots_or_extrapolates() {
        let values = [1.0, 1.1, 5.0, 5.0, 2.0, 9.0];
        for between in [Interpolation::Straight, Interpolation::Monotone] {
            let k = knots(&values, between);
            for (speed, value) in k.speeds_rad_s().to_vec().into_iter().zip(values) {
                assert!((k.at(speed).stiffness.m11 - value).abs() < 1e-12);
                assert!((k.at(speed).damping.m22 - 8.0 * value).abs() < 1e-11);
            }
            assert_eq!(k.at(1.0).stiffness.m11, 1.0);
            assert_eq!(k.at(1e6).stiffness.m11, 9.0);
            for pair in k.speeds_rad_s().windows(2) {
                let ends = [k.at(pair[0]).stiffness.m12, k.at(pair[1]).stiffness.m12];
                let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                for i in 0..=50 {
                    let v = k.at(pair[0] + (pair[1] - pair[0]) * f64::from(i) / 50.0).stiffness.m12;
                    assert!(v >= low - 1e-12 && v <= high + 1e-12, "{between:?}: {low} {v} {high}");
                }
            }
        }
    }

    #[test]
    fn a_smooth_curve_is_met_to_third_order_and_a_line_exactly() {
        let line = |s: f64| DynamicCoefficients::from_columns(|e| 3.0 + s * (1.0 + e as f64));
        let speeds: Vec<f64> = [100.0, 180.0, 300.0, 450.0].to_vec();
        let k =
            Knots::new(speeds.clone(), speeds.iter().map(|s| line(*s)).collect(), Interpolation::Monotone);
        for s in [130.0, 222.0, 400.0] {
            assert!((k.at(s).damping - line(s).damping).norm() < 1e-9);
        }
        let worst = |n: usize| {
            let speeds: Vec<f64> = (0..=n).map(|i| 100.0 + 400.0 * i as f64 / n as f64).collect();
            let power = |s: f64| DynamicCoefficients::from_columns(|_| (s / 100.0).powf(-0.7));
            let k = Knots::new(
                speeds.clone(),
                speeds.iter().map(|s| power(*s)).collect(),
                Interpolation::Monotone,
            );
            (0..400).fold(0.0_f64, |worst, i| {
                let s = 100.0 + f64::from(i) + 0.5;
                worst.max((k.at(s).stiffness.m11 - power(s).stiffness.m11).abs())
            })
        };
        assert!(worst(16) < worst(8) / 4.0, "at least second order: {} {}", worst(8), worst(16));
    }

    #[test]
    fn logarithmic_curve_has_value_slope_and_curvature_at_reference() {
        let column = |k: f64| DynamicCoefficients::from_columns(|i| k * (3.0 + i as f64));
        let terms = [column(100.0), column(-9.0), column(2.0)];
        let curve = Curve::Logarithmic { terms, reference_rad_s: 300.0 };
        let beside = |log: f64| curve.at(300.0 * log.exp()).damping;
        let step = 1e-3;
        let slope = (beside(step) - beside(-step)) / (2.0 * step);
        let curvature = (beside(step) - beside(0.0) * 2.0 + beside(-step)) / (2.0 * step * step);
        assert!((beside(0.0) - terms[0].damping).norm() < 1e-12);
        assert!((slope - terms[1].damping).norm() < 1e-6 * terms[1].damping.norm());
        assert!((curvature - terms[2].damping).norm() < 1e-5 * terms[2].damping.norm());
    }
}

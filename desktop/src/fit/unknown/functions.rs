//! Functions of speed that are smooth and otherwise free.

/// Operating points for each knot at least, or a function could follow every single one.
const POINTS_A_KNOT: usize = 3;
/// Knots over the range of speeds at most: narrower than that is the resonance of a lightly damped rotor alone.
const MOST_KNOTS: usize = 12;

/// Functions whose sum, with independent factors of one size, is assumed of an unknown cause.
pub enum Functions {
    /// Piecewise linear, one at their knot.
    Knots(Vec<f64>),
    /// Legendre polynomials between two speeds up to the second: what follows speed without resonances of its own.
    Smooth([f64; 2]),
}

impl Functions {
    /// Knots over these speeds, rad/s.
    pub fn knots(speeds_rad_s: impl Iterator<Item = f64>) -> Self {
        let mut points: Vec<f64> = speeds_rad_s.collect();
        points.sort_by(f64::total_cmp);
        points.dedup_by(|a, b| (*a / *b - 1.0).abs() < 0.01);
        let count = (points.len() / POINTS_A_KNOT).clamp(1, MOST_KNOTS);
        let (first, last) = (points[0], points[points.len() - 1]);
        let at = |k: usize| first + (last - first) * (k as f64 + 0.5) / count as f64;
        Self::Knots((0..count).map(at).collect())
    }

    /// Polynomials over these speeds, rad/s.
    pub fn smooth(speeds_rad_s: impl Iterator<Item = f64>) -> Self {
        let around = |[low, high]: [f64; 2], w: f64| [low.min(w), high.max(w)];
        Self::Smooth(speeds_rad_s.fold([f64::INFINITY, 0.0], around))
    }

    /// Value of each function at a speed, rad/s; knots are flat beyond the first and last.
    pub fn at(&self, speed_rad_s: f64) -> Vec<f64> {
        match self {
            Self::Smooth([first, last]) => {
                let half = (0.5 * (last - first)).max(f64::MIN_POSITIVE);
                let s = (speed_rad_s - first) / half - 1.0;
                vec![1.0, s, 0.5 * (3.0 * s * s - 1.0)]
            }
            Self::Knots(knots) => {
                let mut values = vec![0.0; knots.len()];
                let after = knots.partition_point(|k| *k <= speed_rad_s);
                if after == 0 || after == knots.len() {
                    values[after.saturating_sub(1).min(knots.len() - 1)] = 1.0;
                } else {
                    let share = (speed_rad_s - knots[after - 1]) / (knots[after] - knots[after - 1]);
                    (values[after - 1], values[after]) = (1.0 - share, share);
                }
                values
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speeds() -> impl Iterator<Item = f64> {
        (0..=40).map(|k| 100.0 + 10.0 * f64::from(k))
    }

    #[test]
    fn knot_functions_sum_to_one_and_are_one_at_own_knot() {
        let functions = Functions::knots(speeds());
        for w in speeds() {
            assert!((functions.at(w).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        let Functions::Knots(knots) = &functions else { panic!() };
        assert_eq!(knots.len(), MOST_KNOTS);
        for (k, w) in knots.iter().enumerate() {
            assert!((functions.at(*w)[k] - 1.0).abs() < 1e-12);
        }
        // three points a knot
        let Functions::Knots(few) = Functions::knots(speeds().take(7)) else { panic!() };
        assert_eq!(few.len(), 2);
    }

    #[test]
    fn smooth_functions_are_orthogonal_and_one_at_range_end() {
        let functions = Functions::smooth(speeds());
        assert!(functions.at(500.0).iter().all(|f| (f - 1.0).abs() < 1e-12));
        let count = 40_000;
        let mean = |i: usize, j: usize| {
            let at = |k| functions.at(100.0 + 400.0 * (f64::from(k) + 0.5) / f64::from(count));
            (0..count).map(|k| at(k)[i] * at(k)[j]).sum::<f64>() / f64::from(count)
        };
        assert!(mean(0, 1).abs().max(mean(0, 2).abs()).max(mean(1, 2).abs()) < 1e-8);
    }
}

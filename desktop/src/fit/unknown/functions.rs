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

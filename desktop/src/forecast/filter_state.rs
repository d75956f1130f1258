//! The filtered state of a number on a day, and the forecast from it.

use super::ahead::ForecastPath;

/// Damped local-trend model: level and slope with their covariance, for one magnitude or angle of the unbalance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterState {
    pub level: f64,
    /// Slope: change over the next day.
    pub per_d: f64,
    /// Standard deviation of the level.
    pub level_sd: f64,
    /// Standard deviation of the slope.
    pub per_d_sd: f64,
    /// Correlation of the errors of `level` and `per_d`.
    pub correlation: f64,
    /// Damping of the slope: share that is left after a day.
    pub kept: f64,
    /// Standard deviation of the slope's process noise in a day.
    pub push_sd: f64,
}

impl FilterState {
    /// The same a day later, if nothing is measured.
    #[must_use]
    pub fn next_day(&self) -> Self {
        let covariance = self.correlation * self.level_sd * self.per_d_sd;
        let level = self.level_sd.powi(2) + 2.0 * covariance + self.per_d_sd.powi(2);
        let per_d = (self.kept * self.per_d_sd).powi(2) + self.push_sd.powi(2);
        let both = (level * per_d).sqrt();
        Self {
            level: self.level + self.per_d,
            per_d: self.kept * self.per_d,
            level_sd: level.sqrt(),
            per_d_sd: per_d.sqrt(),
            correlation: if both > 0.0 {
                self.kept * (covariance + self.per_d_sd.powi(2)) / both
            } else {
                0.0
            },
            ..*self
        }
    }

    pub fn ahead(&self, days: usize) -> ForecastPath {
        let all: Vec<Self> =
            std::iter::successors(Some(self.next_day()), |s| Some(s.next_day())).take(days).collect();
        ForecastPath {
            mean: all.iter().map(|s| s.level).collect(),
            sd: all.iter().map(|s| s.level_sd).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: FilterState = FilterState {
        level: 500.0,
        per_d: 2.0,
        level_sd: 10.0,
        per_d_sd: 0.5,
        correlation: 0.4,
        kept: 0.9,
        push_sd: 0.3,
    };

    /// A level that sums a fading movement, by the closed forms of its mean and variance.
    #[test]
    fn days_ahead_are_the_sum_of_a_movement_that_fades() {
        let ahead = NOW.ahead(60);
        for h in [1, 7, 60] {
            let sum = |days: i32| (1.0 - NOW.kept.powi(days)) / (1.0 - NOW.kept);
            let reach = sum(h);
            assert!((ahead.mean[h as usize - 1] - (NOW.level + NOW.per_d * reach)).abs() < 1e-9);
            let known = NOW.level_sd.powi(2)
                + 2.0 * reach * NOW.correlation * NOW.level_sd * NOW.per_d_sd
                + (reach * NOW.per_d_sd).powi(2);
            // a push of day d moves all days after it
            let pushed: f64 = (1..h).map(|d| (sum(h - d) * NOW.push_sd).powi(2)).sum();
            let sd = ahead.sd[h as usize - 1];
            assert!((sd.powi(2) - known - pushed).abs() < 1e-9, "{h}: {sd}");
        }
    }

    #[test]
    fn a_number_that_is_known_and_does_not_move_stays() {
        let still = FilterState { per_d: 0.0, level_sd: 0.0, per_d_sd: 0.0, push_sd: 0.0, ..NOW };
        assert_eq!(still.ahead(3), ForecastPath { mean: vec![500.0; 3], sd: vec![0.0; 3] });
    }
}

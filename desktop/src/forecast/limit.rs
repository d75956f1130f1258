//! Days until the static unbalance reaches a limit, as a distribution.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::ahead::ForecastPath;

/// Number of simulated paths.
const PATHS: usize = 4000;
/// Shares of the paths for which the days are told.
pub const SHARES: [f64; 5] = [0.05, 0.1, 0.5, 0.9, 0.95];

/// When the limit is reached.
#[derive(Debug, Clone, PartialEq)]
pub struct FirstPassage {
    pub limit_g_mm: f64,
    /// The unbalance of the last day, g·mm.
    pub now_g_mm: f64,
    /// Chance that it is reached until each day of the forecast.
    pub until: Vec<f64>,
    /// Days until each of [`SHARES`] of the paths have reached it; `None` beyond the forecast.
    pub days: [Option<f64>; 5],
}

impl FirstPassage {
    /// Whether the last day is at or beyond the limit: then nothing is left to foretell.
    pub fn already(&self) -> bool {
        self.now_g_mm >= self.limit_g_mm
    }

    /// Chance that it is reached within the days of the forecast.
    pub fn chance(&self) -> f64 {
        if self.already() { 1.0 } else { self.until.last().copied().unwrap_or(0.0) }
    }
}

/// First passage of the limit by paths around a forecast from `now_g_mm` on: each keeps to its own side of the expected
/// values, and moves from day to day by what the spread grows by.
pub fn first_passage(ahead: &ForecastPath, now_g_mm: f64, limit_g_mm: f64, seed: u64) -> FirstPassage {
    if now_g_mm >= limit_g_mm {
        let until = vec![1.0; ahead.mean.len()];
        return FirstPassage { limit_g_mm, now_g_mm, until, days: [Some(0.0); 5] };
    }
    let mut random = StdRng::seed_from_u64(seed);
    let mut first = vec![0_usize; ahead.mean.len()];
    for _ in 0..PATHS {
        let (mut off, mut variance) = (0.0, 0.0);
        for (day, (mean, sd)) in ahead.mean.iter().zip(&ahead.sd).enumerate() {
            let more = (sd * sd - variance).max(0.0);
            variance = variance.max(sd * sd);
            off += more.sqrt() * random.sample::<f64, _>(StandardNormal);
            if mean + off >= limit_g_mm {
                first[day] += 1;
                break;
            }
        }
    }
    let mut sum = 0;
    let until: Vec<f64> = first
        .iter()
        .map(|paths| {
            sum += paths;
            sum as f64 / PATHS as f64
        })
        .collect();
    let at = |share: f64| until.iter().position(|u| *u >= share).map(|day| day as f64 + 1.0);
    FirstPassage { limit_g_mm, now_g_mm, days: SHARES.map(at), until }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_crossing_of_random_walk_equals_reflection_principle() {
        let sure = ForecastPath { mean: (1..=60).map(f64::from).collect(), sd: vec![1e-9; 60] };
        assert_eq!(first_passage(&sure, 0.0, 30.5, 1).days, [Some(31.0); 5]);
        // P(max over n days > a) = 2 P(end > a) for a walk in small steps
        let walk =
            ForecastPath { mean: vec![0.0; 400], sd: (1..=400).map(|h| f64::from(h).sqrt()).collect() };
        let found = first_passage(&walk, 0.0, 20.0, 1);
        assert!((found.chance() - 0.317).abs() < 0.03, "{}", found.chance());
        assert!(found.until.windows(2).all(|w| w[0] <= w[1]), "what was reached stays reached");
        assert!(found.days[0] < found.days[1] && found.days[2].is_none(), "{:?}", found.days);
    }

    #[test]
    fn limit_below_todays_value_is_already_exceeded() {
        let falls = ForecastPath { mean: (1..=60).map(|d| 40.0 - f64::from(d)).collect(), sd: vec![1.0; 60] };
        let found = first_passage(&falls, 40.0, 30.5, 1);
        assert!(found.already() && found.chance() == 1.0);
        assert_eq!(found.days, [Some(0.0); 5]);
        assert!(!first_passage(&falls, 30.0, 30.5, 1).already());
    }
}

//! Days until the static unbalance reaches a limit, as a distribution.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;

use super::walk::Ahead;

/// Paths that are drawn.
const PATHS: usize = 4000;

/// When the limit is reached.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    /// The limit, g·mm.
    pub limit_g_mm: f64,
    /// Chance that it is reached within the days of the forecast.
    pub chance: f64,
    /// Days until one path in ten, one in two and nine in ten have reached it; `None` beyond the forecast.
    pub days: [Option<f64>; 3],
}

/// First passage of the limit by paths around a forecast: each keeps to its own side of the expected values,
/// and moves from day to day by what the spread grows by.
pub fn reached(ahead: &Ahead, now: f64, limit_g_mm: f64, seed: u64) -> Reached {
    let mut random = StdRng::seed_from_u64(seed);
    let mut first: Vec<f64> = Vec::new();
    for _ in 0..PATHS {
        if now >= limit_g_mm {
            first.push(0.0);
            continue;
        }
        let (mut off, mut variance) = (0.0, 0.0);
        for (day, (mean, sd)) in ahead.mean.iter().zip(&ahead.sd).enumerate() {
            let more = (sd * sd - variance).max(0.0);
            variance = variance.max(sd * sd);
            off += more.sqrt() * random.sample::<f64, _>(StandardNormal);
            if mean + off >= limit_g_mm {
                first.push(day as f64 + 1.0);
                break;
            }
        }
    }
    first.sort_by(f64::total_cmp);
    let at = |share: f64| first.get((share * PATHS as f64) as usize).copied();
    Reached { limit_g_mm, chance: first.len() as f64 / PATHS as f64, days: [at(0.1), at(0.5), at(0.9)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sure_forecast_reaches_its_limit_on_its_day_and_a_random_walk_by_reflection() {
        let sure = Ahead { mean: (1..=60).map(f64::from).collect(), sd: vec![1e-9; 60] };
        assert_eq!(reached(&sure, 0.0, 30.5, 1).days, [Some(31.0); 3]);
        assert_eq!(reached(&sure, 40.0, 30.5, 1).days, [Some(0.0); 3]);
        // P(max over n days > a) = 2 P(end > a) for a walk in small steps
        let walk = Ahead { mean: vec![0.0; 400], sd: (1..=400).map(|h| f64::from(h).sqrt()).collect() };
        let chance = reached(&walk, 0.0, 20.0, 1).chance;
        assert!((chance - 0.317).abs() < 0.03, "{chance}");
    }
}

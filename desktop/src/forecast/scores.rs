//! Proper scores of forecasts that say how sure they are: no forecaster does better by saying anything else than what it
//! believes (Gneiting and Raftery 2007, Journal of the American Statistical Association 102, 359).

use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use crate::statistics::interval::interval_95;

/// Quantiles that the pinball loss is of.
pub const LEVELS: [f64; 3] = [0.05, 0.5, 0.95];

/// Continuous ranked probability score of a Gaussian forecast, in the unit of what is forecast: the integral of
/// `(F(x) − 1{x ≥ outcome})²`, in closed form (Gneiting and others 2005, Monthly Weather Review 133, 1098, equation 5).
/// Of a forecast without doubt it is the absolute error.
pub fn crps(mean: f64, sd: f64, outcome: f64) -> f64 {
    let error = outcome - mean;
    if sd <= 0.0 {
        return error.abs();
    }
    let (normal, z) = (Normal::standard(), error / sd);
    sd * (z * (2.0 * normal.cdf(z) - 1.0) + 2.0 * normal.pdf(z) - std::f64::consts::PI.sqrt().recip())
}

/// Pinball loss of a stated quantile, in its unit (Koenker and Bassett 1978, Econometrica 46, 33).
pub fn pinball(level: f64, quantile: f64, outcome: f64) -> f64 {
    let above = outcome - quantile;
    if above >= 0.0 { level * above } else { (level - 1.0) * above }
}

/// What became of a method's forecasts of one series at one horizon. Not a number where nothing could be compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    pub rmse: f64,
    /// Mean continuous ranked probability score, in the series' unit.
    pub crps: f64,
    /// Mean pinball loss at each of [`LEVELS`], in the series' unit.
    pub pinball: [f64; 3],
    /// Share of the outcomes inside the 95 % interval.
    pub coverage: f64,
    /// Forecasts that could be compared.
    pub count: usize,
}

impl Score {
    /// Of Gaussian forecasts (mean and standard deviation) and their outcomes.
    pub fn of(forecasts: &[([f64; 2], f64)]) -> Self {
        let average = |of: &dyn Fn([f64; 2], f64) -> f64| {
            // of nothing: 0/0
            forecasts.iter().map(|(f, outcome)| of(*f, *outcome)).sum::<f64>() / forecasts.len() as f64
        };
        let normal = Normal::standard();
        let at = |level: f64| {
            let z = normal.inverse_cdf(level);
            average(&|[mean, sd], outcome| pinball(level, mean + z * sd, outcome))
        };
        let inside = |[mean, sd]: [f64; 2], outcome: f64| {
            let [low, high] = interval_95(mean, sd);
            f64::from(u8::from((low..=high).contains(&outcome)))
        };
        Self {
            rmse: average(&|[mean, _], outcome| (outcome - mean).powi(2)).sqrt(),
            crps: average(&|[mean, sd], outcome| crps(mean, sd, outcome)),
            pinball: LEVELS.map(at),
            coverage: average(&inside),
            count: forecasts.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;

    #[test]
    fn the_closed_form_of_crps_is_its_integral() {
        let normal = Normal::new(3.0, 2.0).unwrap();
        for outcome in [-1.0, 2.5, 3.0, 9.0] {
            let step = 1e-3;
            let at = |k: i32| -30.0 + step * (f64::from(k) + 0.5);
            let square = |x: f64| (normal.cdf(x) - f64::from(u8::from(x >= outcome))).powi(2);
            let integral: f64 = (0..66_000).map(|k| square(at(k)) * step).sum();
            let closed = crps(3.0, 2.0, outcome);
            assert!((integral - closed).abs() < 1e-3, "{outcome}: {integral} {closed}");
        }
        assert_eq!(crps(3.0, 0.0, 5.0), 2.0);
    }

    #[test]
    fn crps_is_twice_the_pinball_loss_over_all_levels() {
        let normal = Normal::new(1.0, 0.7).unwrap();
        let levels = 20_000;
        let level = |k: i32| (f64::from(k) + 0.5) / f64::from(levels);
        let mean = (0..levels).map(|k| pinball(level(k), normal.inverse_cdf(level(k)), 2.2)).sum::<f64>()
            / f64::from(levels);
        assert!((2.0 * mean - crps(1.0, 0.7, 2.2)).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn scores_are_best_for_true_uncertainty() {
        let mut random = StdRng::seed_from_u64(2);
        let outcomes: Vec<f64> = (0..4000).map(|_| 2.0 * random.sample::<f64, _>(StandardNormal)).collect();
        let score = |sd: f64| {
            let all: Vec<([f64; 2], f64)> = outcomes.iter().map(|o| ([0.0, sd], *o)).collect();
            Score::of(&all)
        };
        let (sure, honest, unsure) = (score(1.0), score(2.0), score(4.0));
        assert!(honest.crps < sure.crps && honest.crps < unsure.crps);
        assert!(honest.pinball[0] < sure.pinball[0] && honest.pinball[2] < unsure.pinball[2]);
        assert_eq!(sure.rmse, unsure.rmse, "an error alone does not see it");
        assert!((honest.coverage - 0.95).abs() < 0.015, "{}", honest.coverage);
        assert!(Score::of(&[]).crps.is_nan());
    }
}

//! Forecasts from every day of the past, as if it were the last, and what became of them.

use rayon::prelude::*;

use super::ahead::ForecastPath;
use super::arima::{Arima, Order};
use super::filter_state::FilterState;
use super::scores::Score;
use super::series::DailySeries;
use super::smooth::rlowess;
use crate::error::{Error, ForecastError};

/// Days that the smoothing of a day looks at.
const NEIGHBOURS: f64 = 21.0;
const ROBUST_ITERATIONS: usize = 3;
/// Orders that are tried around (3,1,3).
const AROUND: [usize; 5] = [0, 1, 2, 3, 4];
/// Days before a forecast that it may use: what was longer ago says nothing of the days to come that these do not.
const LONGEST_PAST_D: usize = 730;
/// Days that are forecast from at most, evenly spread over a longer track.
const MOST_ORIGINS: usize = 730;

/// What a forecast is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ForecastBasis {
    /// The state of the filter that followed the record, moved on.
    State,
    /// The smoothed past, by a model that is fitted to it.
    Model(ForecastModel),
}

impl From<ForecastModel> for ForecastBasis {
    fn from(model: ForecastModel) -> Self {
        Self::Model(model)
    }
}

/// A model of the past.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ForecastModel {
    /// It stays as it is.
    Naive,
    /// It goes on as on average.
    Drift,
    /// ARIMA of this order; of the best by Akaike's criterion if none is given.
    Arima(Option<Order>),
    /// A recurrent network, drawn from this seed.
    #[cfg(feature = "lstm")]
    Lstm {
        /// Of weights and dropout.
        seed: u64,
    },
}

impl ForecastModel {
    /// Days between two searches of the parameters; in between they are held.
    fn refit_every(self) -> usize {
        match self {
            #[cfg(feature = "lstm")]
            Self::Lstm { .. } => 60,
            _ => 5,
        }
    }
}

/// The smoothed past that a forecast is made from.
///
/// # Errors
/// If there are too few values.
pub fn smoothed(known: &[f64]) -> Result<Vec<f64>, Error> {
    rlowess(known, (NEIGHBOURS / known.len() as f64).min(1.0), ROBUST_ITERATIONS)
}

/// The order with the least criterion on a past.
///
/// # Errors
/// If no order fits.
pub fn best_order(past: &[f64]) -> Result<Order, Error> {
    let orders: Vec<Order> =
        AROUND.iter().flat_map(|p| AROUND.iter().map(|q| Order { p: *p, d: 1, q: *q })).collect();
    let tried = orders.par_iter().filter_map(|order| {
        let fitted = Arima::fit(past, *order, None).ok()?;
        Some((fitted.aic(past), *order))
    });
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, order)| order).ok_or_else(|| ForecastError::NoArimaOrder { values: past.len() }.into())
}

/// A model that has been fitted to a past.
#[derive(Debug, Clone)]
enum FittedModel {
    /// Per day, and standard deviation of a day's change around that.
    Walk {
        drift: f64,
        sd: f64,
    },
    Arima(Arima),
    #[cfg(feature = "lstm")]
    Lstm(Box<super::lstm::Network>),
}

impl FittedModel {
    fn new(model: ForecastModel, past: &[f64], near: Option<&Self>) -> Result<Self, Error> {
        let changes: Vec<f64> = past.windows(2).map(|w| w[1] - w[0]).collect();
        let count = changes.len().max(1) as f64;
        match model {
            ForecastModel::Naive | ForecastModel::Drift => {
                let mean =
                    if model == ForecastModel::Drift { changes.iter().sum::<f64>() / count } else { 0.0 };
                let sd = (changes.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / count).sqrt();
                Ok(Self::Walk { drift: mean, sd })
            }
            ForecastModel::Arima(order) => {
                let order = order.map_or_else(|| best_order(past), Ok)?;
                let near = match near {
                    Some(Self::Arima(near)) => Some(near),
                    _ => None,
                };
                Ok(Self::Arima(Arima::fit(past, order, near)?))
            }
            #[cfg(feature = "lstm")]
            ForecastModel::Lstm { seed } => {
                Ok(Self::Lstm(Box::new(super::lstm::Network::train(past, seed)?)))
            }
        }
    }

    fn ahead(&self, past: &[f64], days: usize) -> Result<ForecastPath, Error> {
        Ok(match self {
            Self::Walk { drift, sd } => ForecastPath {
                mean: (1..=days).map(|h| past[past.len() - 1] + drift * h as f64).collect(),
                sd: (1..=days).map(|h| sd * (h as f64).sqrt()).collect(),
            },
            Self::Arima(arima) => {
                ForecastPath { mean: arima.forecast(past, days), sd: arima.spread(past, days) }
            }
            #[cfg(feature = "lstm")]
            Self::Lstm(network) => ForecastPath {
                mean: network.forecast(past, days)?,
                sd: (1..=days).map(|h| network.sd * (h as f64).sqrt()).collect(),
            },
        })
    }
}

/// Makes forecasts from one day after another.
enum Forecaster<'a> {
    /// Of a filter's state on each day.
    State(&'a [FilterState]),
    /// By a model that is fitted to the smoothed past now and then, from the first day on.
    Fitted { model: ForecastModel, first: usize, fitted: Option<(FittedModel, usize)> },
}

impl<'a> Forecaster<'a> {
    fn new(by: ForecastBasis, series: &'a DailySeries, first: usize) -> Result<Self, Error> {
        match (by, &series.filter_states) {
            (ForecastBasis::State, Some(filter_states)) => Ok(Self::State(filter_states)),
            (ForecastBasis::State, None) => Err(ForecastError::NoFilterState.into()),
            // the order is chosen on the first days and kept: days to come have no say
            (ForecastBasis::Model(ForecastModel::Arima(None)), _) => {
                let order = best_order(&smoothed(&series.known[..first])?)?;
                Ok(Self::Fitted { model: ForecastModel::Arima(Some(order)), first, fitted: None })
            }
            (ForecastBasis::Model(model), _) => Ok(Self::Fitted { model, first, fitted: None }),
        }
    }

    /// From the `end` first days of a series.
    fn ahead(&mut self, series: &DailySeries, end: usize, days: usize) -> Result<ForecastPath, Error> {
        match self {
            Self::State(filter_states) => Ok(filter_states[end - 1].ahead(days)),
            Self::Fitted { model, first, fitted } => {
                let past = smoothed(&series.known[end.saturating_sub(LONGEST_PAST_D)..end])?;
                let period = |day: usize| (day - *first) / model.refit_every();
                let now = match fitted.take() {
                    Some((now, at)) if period(at) == period(end) => (now, at),
                    near => (FittedModel::new(*model, &past, near.as_ref().map(|(near, _)| near))?, end),
                };
                fitted.insert(now).0.ahead(&past, days)
            }
        }
    }
}

/// What could be wrong beyond a model's own spread: number and sum of squares of what its forecasts of the past were off,
/// by horizon.
#[derive(Debug, Clone)]
struct Misses(Vec<(usize, f64)>);

impl Misses {
    /// Standard deviation of a forecast: the model's own, or what its forecasts were off so far if that is
    /// more. A day's shocks alone do not know of turns that the past did not have.
    fn widened(&self, own: &[f64]) -> Vec<f64> {
        const ENOUGH: usize = 20;
        let seen = |h: usize| {
            let (count, squares) = self.0.get(h).filter(|(count, _)| *count >= ENOUGH)?;
            Some((squares / *count as f64).sqrt())
        };
        own.iter().enumerate().map(|(h, sd)| seen(h).map_or(*sd, |s| s.max(*sd))).collect()
    }
}

/// Forecasts of one series from each day on, the first from after `first` days: the score at each
/// horizon, and the forecast from the last day with intervals as wide as the past showed them to be. A forecast knows two
/// years at most, and of a track that is much longer some days are passed over, so that the work grows no further.
///
/// # Errors
/// If the series is too short or does not change, or the order does not fit.
pub fn backtest(
    series: &DailySeries,
    by: impl Into<ForecastBasis>,
    first: usize,
    horizons: &[usize],
    days_ahead: usize,
) -> Result<(Vec<Score>, ForecastPath), Error> {
    let n = series.values.len();
    if n < first + 1 {
        return Err(ForecastError::ShortTrack { days: n, first }.into());
    }
    if series.known.windows(2).all(|w| w[0] == w[1]) {
        return Err(ForecastError::ConstantTrack { series: series.name.into() }.into());
    }
    let longest = horizons.iter().copied().max().unwrap_or(1).max(days_ahead);
    let mut forecaster = Forecaster::new(by.into(), series, first)?;
    let mut misses = Misses(vec![(0, 0.0); longest]);
    // a forecast, the day after it was made, and how many days of it have come to pass
    let mut pending: Vec<(usize, usize, ForecastPath)> = Vec::new();
    let mut compared: Vec<Vec<([f64; 2], f64)>> = vec![Vec::new(); horizons.len()];
    let mut last = None;
    let step = (n - first).div_ceil(MOST_ORIGINS).max(1);
    // the last day is always one of them
    for end in (first..=n).rev().step_by(step).collect::<Vec<_>>().into_iter().rev() {
        // what the newest days say of earlier forecasts
        for (from, past, ahead) in &mut pending {
            let now = (end - *from).min(longest);
            for h in *past..now {
                let (count, squares) = &mut misses.0[h];
                *squares += (series.values[*from + h] - ahead.mean[h]).powi(2);
                *count += 1;
            }
            *past = now;
        }
        let mut ahead = forecaster.ahead(series, end, longest)?;
        ahead.sd = misses.widened(&ahead.sd);
        for (compared, h) in compared.iter_mut().zip(horizons) {
            if let Some(outcome) = series.values.get(end + h - 1) {
                compared.push(([ahead.mean[h - 1], ahead.sd[h - 1]], *outcome));
            }
        }
        pending.retain(|(from, ..)| end - from < longest);
        pending.push((end, 0, ahead.clone()));
        last = Some(ahead);
    }
    let mut ahead = last.ok_or_else(|| Error::Unsuitable("the track has no day to forecast from".into()))?;
    ahead.mean.truncate(days_ahead);
    ahead.sd.truncate(days_ahead);
    Ok((compared.iter().map(|c| Score::of(c)).collect(), ahead))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(values: Vec<f64>) -> DailySeries {
        DailySeries { name: "U_g", known: values.clone(), values, filter_states: None }
    }

    #[test]
    fn a_straight_line_is_foretold_by_drift_but_not_by_naive() {
        let line = series((0..200).map(|i| 400.0 + 0.5 * f64::from(i)).collect());
        let rmse = |model| backtest(&line, model, 90, &[1, 30], 60).unwrap().0[1].rmse;
        let stays = rmse(ForecastModel::Naive);
        assert!((stays - 15.0).abs() < 0.1, "{stays}");
        assert!(rmse(ForecastModel::Drift) < 0.1);
    }

    #[test]
    fn the_future_does_not_change_a_forecast() {
        let wave = |i: i32| 400.0 + 30.0 * (f64::from(i) / 17.0).sin() + f64::from(i * i % 7);
        let past: Vec<f64> = (0..150).map(wave).collect();
        let mut longer = past.clone();
        longer.extend((150..250).map(|i| -wave(i)));
        let order = ForecastModel::Arima(Some(Order { p: 2, d: 1, q: 1 }));
        let from_end = backtest(&series(past.clone()), order, 149, &[1], 20).unwrap().1;
        let again = backtest(&series(longer[..150].to_vec()), order, 149, &[1], 20).unwrap().1;
        assert_eq!(from_end, again);
    }

    #[test]
    fn intervals_of_a_random_walk_hold_about_what_they_promise() {
        use rand::{Rng, SeedableRng};
        let mut random = rand::rngs::StdRng::seed_from_u64(3);
        let mut level = 0.0;
        let walked: Vec<f64> = (0..600)
            .map(|_| {
                level += random.random_range(-1.0..1.0);
                level
            })
            .collect();
        let scores = backtest(&series(walked), ForecastModel::Naive, 90, &[7, 30], 30).unwrap().0;
        assert!(scores.iter().all(|s| (0.8..=1.0).contains(&s.coverage)), "{scores:?}");
    }

    #[test]
    fn long_track_is_subsampled_with_equal_scores() {
        let wave = |i: usize| 400.0 + 30.0 * (i as f64 / 17.0).sin() + 0.5 * ((i * i) % 7) as f64;
        let scores = |days: usize| {
            let all = backtest(&series((0..days).map(wave).collect()), ForecastModel::Naive, 90, &[7], 60)
                .unwrap()
                .0;
            (all[0].rmse, all[0].count)
        };
        let ((short, every), (long, some)) = (scores(800), scores(3000));
        assert_eq!(every, 800 - 90 - 6);
        assert!((700..=730).contains(&some), "{some}");
        assert!((long / short - 1.0).abs() < 0.05, "{short} {long}");
    }

    #[test]
    fn a_track_that_is_too_short_is_refused() {
        let short = series(vec![1.0; 40]);
        let refusal = backtest(&short, ForecastModel::Naive, 90, &[1], 60).unwrap_err().to_string();
        assert!(refusal.contains("40 days"), "{refusal}");
    }
}

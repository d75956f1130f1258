//! Answer of `forecast`.

use rotor_edge_desktop::forecast::ahead::ForecastPath;
use rotor_edge_desktop::forecast::events;
use rotor_edge_desktop::forecast::limit::FirstPassage;
use rotor_edge_desktop::forecast::scores::Score;
use rotor_edge_desktop::forecast::series::{DailySeries, History};
use rotor_edge_desktop::interval::interval_95;
use serde::Serialize;

use super::shared::ByName;

/// The forecast that nothing changes, as JSON and tables name it.
pub const NAIVE: &str = "naive";
/// The forecast that goes on as on average until then.
pub const DRIFT: &str = "drift";

/// A figure by the days ahead.
pub type ByHorizon = ByName<Option<f64>>;
/// The same by series: U_g and U_d are static and dynamic unbalance, g·mm, alpha_g and alpha_d their angles, degrees.
pub type BySeries = ByName<ByHorizon>;

/// Where the unbalance is going, and what became of forecasts of the past.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForecastAnswer {
    pub model: &'static str,
    pub rmse: BySeries,
    pub baselines: ByName<BySeries>,
    pub coverage_95: BySeries,
    pub compared: BySeries,
    /// By model, series and days ahead: rmse, crps, pinball, coverage_95, compared.
    pub scores: ByName<ByName<ByName<ScoreAnswer>>>,
    pub against_naive: Vec<String>,
    /// A day each: time_d, time (ISO 8601, if known), and value, low and high (95 %) of every series.
    pub forecast: Vec<ForecastDay>,
    /// Chance of an event, which would end the forecast, within its days; None where the track does not say.
    pub event_chance: Option<f64>,
    pub limit: Option<LimitAnswer>,
    /// The last day of the track.
    #[serde(skip)]
    pub last_d: f64,
    /// Days of the track, and events that it had.
    #[serde(skip)]
    pub events_seen: (f64, Option<usize>),
}

/// How good forecasts of the past were; a score that could not be formed is NaN.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreAnswer {
    pub rmse: f64,
    pub crps: f64,
    pub pinball: PinballAnswer,
    pub coverage_95: f64,
    pub compared: usize,
}

/// Pinball loss at three quantiles.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PinballAnswer {
    pub p5: f64,
    pub p50: f64,
    pub p95: f64,
}

/// A day that is forecast.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForecastDay {
    pub time_d: f64,
    pub time: Option<String>,
    #[serde(flatten)]
    pub series: ByName<IntervalAnswer>,
}

/// A value with its 95 % interval. A size is not negative. An angle is within ±180 degrees and its interval around it; an
/// interval as wide as the circle is the whole circle, and the angle undetermined.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct IntervalAnswer {
    pub value: f64,
    pub low: f64,
    pub high: f64,
    /// Whether the interval excludes anything.
    pub determined: bool,
}

/// Days until the limit is reached with a chance of 5 to 95 %; None is not within the forecast.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LimitDays {
    pub p5: Option<f64>,
    pub p10: Option<f64>,
    pub p50: Option<f64>,
    pub p90: Option<f64>,
    pub p95: Option<f64>,
}

/// When the static unbalance reaches a limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitAnswer {
    pub limit_g_mm: f64,
    pub now_g_mm: f64,
    pub exceeded: bool,
    pub chance: f64,
    /// Chance that it is reached by each day ahead.
    pub chance_until: Vec<f64>,
    pub days: LimitDays,
}

/// One series, scored and forecast by the model asked for, and scored by others.
pub struct SeriesForecast<'a> {
    pub series: &'a DailySeries,
    /// Name of each method, the model's first, and its scores at every horizon.
    pub scores: Vec<(&'static str, Vec<Score>)>,
    /// Forecast of the model asked for.
    pub ahead: ForecastPath,
}

impl SeriesForecast<'_> {
    /// The scores of a method by its name; none if it was not tried.
    fn of(&self, method: &str) -> &[Score] {
        self.scores.iter().find(|(name, _)| *name == method).map_or(&[], |(_, scores)| scores)
    }
}

/// A series as its fan draws it; every point is at its day of the track.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesCurves {
    /// Its column in the track.
    pub series: String,
    pub estimates: Vec<(f64, f64)>,
    pub forecast: Vec<(f64, f64)>,
    /// Day, lower and upper end.
    pub interval_95: Vec<[f64; 3]>,
}

impl SeriesCurves {
    pub fn of(history: &History, forecast: &SeriesForecast) -> Self {
        let SeriesForecast { series, ahead, .. } = forecast;
        let day = |k: usize| history.first_d + k as f64;
        let known = series.values.len();
        // an angle's curve goes on over whole turns, shifted so that the last estimate is within ±180 degrees
        let turned = match (is_size(series.name), series.values.last()) {
            (false, Some(last)) => on_circle_deg(*last) - last,
            _ => 0.0,
        };
        let days = 0..ahead.mean.len();
        let bounded = |k: usize| bounded(series.name, ahead, k).map(|v| v + turned);
        let band = |k: usize| {
            let [_, low, high] = bounded(k);
            [day(known + k), low, high]
        };
        Self {
            series: series.name.to_string(),
            estimates: series.values.iter().enumerate().map(|(k, value)| (day(k), value + turned)).collect(),
            forecast: days.clone().map(|k| (day(known + k), bounded(k)[0])).collect(),
            interval_95: days.map(band).collect(),
        }
    }
}

impl ForecastAnswer {
    /// Of the forecasts by `model`, scored at `horizons`; `time` is the moment of a day, if it is known.
    pub fn of(
        model: &'static str,
        history: &History,
        forecasts: &[SeriesForecast],
        horizons: &[usize],
        limit: Option<&FirstPassage>,
        time: impl Fn(f64) -> Option<String>,
    ) -> Self {
        let figure = |method: &str, of: fn(&Score) -> f64| -> BySeries {
            by_series(forecasts, horizons, method, |s| Some(of(s)).filter(|v| v.is_finite()))
        };
        let rmse = |method: &str| figure(method, |s| s.rmse);
        let last_d = history.last_d();
        let days = forecasts.first().map_or(0, |f| f.ahead.mean.len());
        let day = |k: usize| {
            let time_d = last_d + k as f64 + 1.0;
            let interval = |f: &SeriesForecast| IntervalAnswer::of(f.series.name, &f.ahead, k);
            let series = forecasts.iter().map(|f| (f.series.name.to_string(), interval(f)));
            ForecastDay { time_d, time: time(time_d), series: series.collect() }
        };
        let methods = forecasts.first().map_or(&[][..], |f| &f.scores);
        let scores = methods.iter().map(|(name, _)| {
            (name.to_string(), by_series(forecasts, horizons, name, |s| ScoreAnswer::from(s)))
        });
        let seen_d = last_d - history.first_d + 1.0;
        Self {
            model,
            rmse: rmse(model),
            baselines: [NAIVE, DRIFT].map(|name| (name.to_string(), rmse(name))).into_iter().collect(),
            coverage_95: figure(model, |s| s.coverage),
            compared: figure(model, |s| s.count as f64),
            scores: scores.collect(),
            against_naive: against_naive(model, forecasts, horizons),
            forecast: (0..days).map(day).collect(),
            event_chance: history.events.map(|seen| events::chance(seen, seen_d, days as f64)),
            limit: limit.map(LimitAnswer::from),
            last_d,
            events_seen: (seen_d, history.events),
        }
    }
}

fn by_series<T>(
    forecasts: &[SeriesForecast],
    horizons: &[usize],
    method: &str,
    of: impl Fn(&Score) -> T,
) -> ByName<ByName<T>> {
    let one = |f: &SeriesForecast| {
        let pairs = horizons.iter().zip(f.of(method));
        (f.series.name.to_string(), pairs.map(|(h, s)| (h.to_string(), of(s))).collect())
    };
    forecasts.iter().map(one).collect()
}

/// Whether a series, by the name of its column, is a size and not an angle.
pub fn is_size(series: &str) -> bool {
    series.starts_with('U')
}

/// An angle within ±180 degrees.
fn on_circle_deg(angle_deg: f64) -> f64 {
    180.0 - (180.0 - angle_deg).rem_euclid(360.0)
}

/// Value and ends of the 95 % interval of a day: sizes from zero on, angles half a turn either way at most.
fn bounded(series: &str, ahead: &ForecastPath, k: usize) -> [f64; 3] {
    let mean = ahead.mean[k];
    let [low, high] = interval_95(mean, ahead.sd[k]);
    if is_size(series) {
        [mean.max(0.0), low.max(0.0), high.max(0.0)]
    } else {
        [mean, low.max(mean - 180.0), high.min(mean + 180.0)]
    }
}

impl IntervalAnswer {
    fn of(series: &str, ahead: &ForecastPath, k: usize) -> Self {
        let [value, low, high] = bounded(series, ahead, k);
        if is_size(series) {
            return Self { value, low, high, determined: high.is_finite() };
        }
        let turned = on_circle_deg(value) - value;
        Self { value: value + turned, low: low + turned, high: high + turned, determined: high - low < 360.0 }
    }
}

impl From<&Score> for ScoreAnswer {
    fn from(s: &Score) -> Self {
        let [p5, p50, p95] = s.pinball;
        Self {
            rmse: s.rmse,
            crps: s.crps,
            pinball: PinballAnswer { p5, p50, p95 },
            coverage_95: s.coverage,
            compared: s.count,
        }
    }
}

impl From<&FirstPassage> for LimitAnswer {
    fn from(limit: &FirstPassage) -> Self {
        let [p5, p10, p50, p90, p95] = limit.days;
        Self {
            limit_g_mm: limit.limit_g_mm,
            now_g_mm: limit.now_g_mm,
            exceeded: limit.already(),
            chance: limit.chance(),
            chance_until: limit.until.clone(),
            days: LimitDays { p5, p10, p50, p90, p95 },
        }
    }
}

/// A series in words; its name is that of its column.
pub fn words(series: &str) -> &str {
    match series {
        "U_g" => "static size",
        "alpha_g" => "static angle",
        "U_d" => "dynamic size",
        "alpha_d" => "dynamic angle",
        other => other,
    }
}

/// Where the model is better than the naive forecast, in words.
fn against_naive(model: &str, forecasts: &[SeriesForecast], horizons: &[usize]) -> Vec<String> {
    let one = |(i, h): (usize, &usize)| {
        let (mut better, mut worse) = (Vec::new(), Vec::new());
        for f in forecasts {
            let (own, naive) = (f.of(model), f.of(NAIVE));
            if own[i].count == 0 {
                continue;
            }
            if own[i].rmse < naive[i].rmse {
                better.push(words(f.series.name))
            } else {
                worse.push(words(f.series.name))
            }
        }
        match (better.is_empty(), worse.is_empty()) {
            (true, true) => format!("At {h} days nothing can be compared: the track is too short."),
            (false, true) => format!("At {h} d it beats the naive forecast on all four."),
            (true, false) => format!("At {h} d it does not beat the naive forecast on any."),
            (false, false) => format!(
                "At {h} d it beats the naive forecast on {}, not on {}.",
                better.join(", "),
                worse.join(", ")
            ),
        }
    };
    horizons.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last(series: &str, mean: f64, sd: f64) -> IntervalAnswer {
        IntervalAnswer::of(series, &ForecastPath { mean: vec![mean], sd: vec![sd] }, 0)
    }

    #[test]
    fn forecast_size_near_zero_has_no_negative_interval() {
        let size = last("U_g", 48.6, 50.7);
        assert_eq!((size.low, size.determined), (0.0, true));
        assert!((size.high - 148.0).abs() < 0.1);
        assert_eq!(last("U_d", -3.0, 1.0).value, 0.0);
    }

    #[test]
    fn forecast_angle_over_whole_turns_is_on_the_circle() {
        let angle = last("alpha_g", -381.0, 10.0);
        assert!((angle.value + 21.0).abs() < 1e-9 && angle.determined, "{angle:?}");
        assert!((angle.low + 40.6).abs() < 1e-9 && (angle.high + 1.4).abs() < 1e-9, "{angle:?}");
    }

    #[test]
    fn forecast_angle_wider_than_the_circle_is_undetermined() {
        let angle = last("alpha_g", -381.0, 283.0);
        assert!(!angle.determined && (angle.high - angle.low - 360.0).abs() < 1e-9, "{angle:?}");
    }
}

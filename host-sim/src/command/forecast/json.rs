//! What `forecast --json` prints.

use rotor_edge_desktop::forecast::ahead::interval;
use rotor_edge_desktop::forecast::limit::FirstPassage;
use rotor_edge_desktop::forecast::scores::Score;
use rotor_edge_desktop::forecast::series::History;
use serde_json::{Map, Value, json};

use super::super::dates::Dates;
use super::{Arguments, DRIFT, Forecast, Kind, against_naive, event_chance};

fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

fn score(s: &Score) -> Value {
    let [low, middle, high] = s.pinball.map(number);
    json!({
        "rmse": number(s.rmse),
        "crps": number(s.crps),
        "pinball": { "p5": low, "p50": middle, "p95": high },
        "coverage_95": number(s.coverage),
        "compared": s.count,
    })
}

/// When the limit is reached; days from the last of the track on.
fn reached(limit: &FirstPassage) -> Value {
    let [p5, p10, p50, p90, p95] = limit.days;
    json!({
        "limit_g_mm": limit.limit_g_mm,
        "now_g_mm": limit.now_g_mm,
        "exceeded": limit.already(),
        "chance": limit.chance(),
        "chance_until": limit.until,
        "days": { "p5": p5, "p10": p10, "p50": p50, "p90": p90, "p95": p95 },
    })
}

pub fn summary(
    arguments: &Arguments,
    model: &str,
    history: &History,
    forecasts: &[Forecast],
    limit: Option<&FirstPassage>,
    dates: Dates,
) -> Value {
    let by_horizon = |scores: &[Score], of: &dyn Fn(&Score) -> Value| -> Value {
        let pairs = arguments.horizons.iter().zip(scores);
        pairs.map(|(h, s)| (h.to_string(), of(s))).collect::<Map<_, _>>().into()
    };
    let by_series = |method: &str, of: &dyn Fn(&Score) -> Value| -> Value {
        let one = |f: &Forecast| (f.series.name.to_string(), by_horizon(f.of(method), of));
        forecasts.iter().map(one).collect::<Map<_, _>>().into()
    };
    let rmse = |s: &Score| number(s.rmse);
    let last_d = history.last_d();
    let day = |k: usize| {
        let mut all = Map::new();
        let time_d = last_d + k as f64 + 1.0;
        all.insert("time_d".into(), json!(time_d));
        all.insert("time".into(), json!(dates.iso(time_d)));
        for f in forecasts {
            let [low, high] = interval(f.ahead.mean[k], f.ahead.sd[k]);
            all.insert(f.series.name.into(), json!({ "value": f.ahead.mean[k], "low": low, "high": high }));
        }
        Value::from(all)
    };
    let methods = forecasts.first().map_or(&[][..], |f| &f.scores);
    let scores = methods.iter().map(|(name, _)| (name.to_string(), by_series(name, &score)));
    json!({
        "model": model,
        "rmse": by_series(model, &rmse),
        "baselines": { "naive": by_series(Kind::Naive.name(), &rmse), "drift": by_series(DRIFT, &rmse) },
        "coverage_95": by_series(model, &|s| number(s.coverage)),
        "compared": by_series(model, &|s| number(s.count as f64)),
        "scores": scores.collect::<Map<_, _>>(),
        "against_naive": against_naive(forecasts, &arguments.horizons),
        "forecast": (0..arguments.days).map(day).collect::<Vec<_>>(),
        "event_chance": event_chance(history, arguments.days),
        "limit": limit.map(reached),
    })
}

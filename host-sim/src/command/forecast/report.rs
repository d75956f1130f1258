//! What `forecast --report` says: the tables of scores, the fans and the limit.

use rotor_edge_desktop::forecast::ahead::interval;
use rotor_edge_desktop::forecast::series::History;

use super::super::dates::Dates;
use super::{SCORES, Scored, limit_in_words, unit};
use crate::answers::forecast::{ForecastAnswer, LimitAnswer, SeriesForecast, words};
use crate::render::trend::{Trend, trend};
use crate::render::{Figure, PageTable, Section};
use crate::scale::three_digits;

/// Days of the past that a fan shows.
const PAST: usize = 180;

/// Scores at each horizon, a fan for each series, and when the limit is reached.
pub fn sections(
    answer: &ForecastAnswer,
    history: &History,
    forecasts: &[SeriesForecast],
    dates: Dates,
) -> Vec<Section> {
    let limit = answer.limit.as_ref();
    let mut scored = vec![
        "Every day of the past was forecast from as if it were the last; the errors are of those forecasts. CRPS and \
         pinball loss are small only for a forecast that is near and says how sure it is."
            .to_string(),
    ];
    scored.extend(answer.against_naive.iter().cloned());
    let reached = limit.map(|limit| limit_in_words(limit, answer.last_d, dates));
    // the limit is of the static unbalance, the first of the series
    let drawn = |i: usize| limit.filter(|_| i == 0).map(|limit| limit.limit_g_mm);
    let fans = forecasts.iter().enumerate().map(|(i, f)| fan(history, f, answer.model, drawn(i), dates));
    let passage =
        limit.filter(|limit| !limit.exceeded).map(|limit| first_passage(answer.last_d, limit, dates));
    let figures = fans.chain(passage).collect();
    let tables = SCORES.map(|scored| scores(answer, scored)).to_vec();
    let section = |heading: &str, paragraphs, tables, figures| Section {
        heading: heading.into(),
        paragraphs,
        tables,
        figures,
    };
    vec![
        section("Forecast", reached.into_iter().collect(), Vec::new(), figures),
        section("How good such forecasts were", scored, tables, Vec::new()),
    ]
}

/// One score of every method at every horizon.
fn scores(answer: &ForecastAnswer, (title, of, is_share): Scored) -> PageTable {
    let cell = |value: f64| match (value.is_finite(), is_share) {
        (false, _) => "–".to_string(),
        (true, false) => three_digits(value),
        (true, true) => format!("{:.1} %", 100.0 * value),
    };
    let own = || answer.scores.get(answer.model).into_iter().flat_map(|by_series| by_series.iter());
    let mut rows = Vec::new();
    for (series, _) in own() {
        for (method, by_series) in answer.scores.iter() {
            let mut row = vec![format!("{}, {}", words(series), unit(series)), method.to_string()];
            let scores = by_series.get(series).into_iter().flat_map(|by_horizon| by_horizon.iter());
            row.extend(scores.map(|(_, score)| cell(of(score))));
            rows.push(row);
        }
    }
    let mut columns = vec!["series".to_string(), "forecast by".into()];
    columns.extend(own().next().iter().flat_map(|(_, s)| s.iter()).map(|(h, _)| format!("{h} d")));
    PageTable { caption: format!("{title} by days ahead"), columns, rows }
}

/// How the chance grows that the limit is reached.
fn first_passage(last_d: f64, limit: &LimitAnswer, dates: Dates) -> Figure {
    let title = "Chance that the limit is reached".to_string();
    let day = |k: usize| last_d + k as f64 + 1.0;
    let chance = limit.chance_until.iter().enumerate().map(|(k, chance)| (day(k), 100.0 * chance)).collect();
    let quantiles = [(limit.days.p5, "5 %"), (limit.days.p50, "50 %"), (limit.days.p95, "95 %")];
    let events = quantiles.iter().filter_map(|(days, word)| Some((last_d + (*days)?, word.to_string())));
    Figure {
        id: "limit-reached".into(),
        caption: format!("Until each day, for {:.0} g·mm static unbalance.", limit.limit_g_mm),
        drawing: trend(&Trend {
            along: dates.axis(),
            quantity: "chance, %".into(),
            curves: vec![("reached until then".into(), chance)],
            events: events.collect(),
            ..Trend::default()
        })
        .into(),
        title,
    }
}

fn fan(history: &History, f: &SeriesForecast, model: &str, limit_g_mm: Option<f64>, dates: Dates) -> Figure {
    let n = f.series.values.len();
    let day = |k: usize| history.first_d + k as f64;
    let past = (n.saturating_sub(PAST)..n).map(|k| (day(k), f.series.values[k])).collect();
    let ahead = |value: &dyn Fn(usize) -> f64| {
        (0..f.ahead.mean.len()).map(|k| (day(n + k), value(k))).collect::<Vec<_>>()
    };
    let end = |k: usize, side: usize| interval(f.ahead.mean[k], f.ahead.sd[k])[side];
    let mut curves = vec![(format!("forecast, {model}"), ahead(&|k| f.ahead.mean[k]))];
    let band = (0..f.ahead.mean.len()).map(|k| [day(n + k), end(k, 0), end(k, 1)]).collect();
    let ends = [day(n.saturating_sub(PAST)), day(n + f.ahead.mean.len()) - 1.0];
    curves.extend(limit_g_mm.map(|limit| ("limit".to_string(), ends.map(|at| (at, limit)).to_vec())));
    let magnitude = f.series.name.starts_with('U');
    let kind = if f.series.name.ends_with("_g") { "static" } else { "dynamic" };
    let title = format!("{} of the {kind} unbalance", if magnitude { "Size" } else { "Angle" });
    let quantity = if magnitude { "unbalance, g·mm" } else { "angle, degrees" };
    Figure {
        id: format!("fan-{}", f.series.name.to_lowercase().replace('_', "-")),
        caption: format!(
            "The estimates, the forecast by {model} and its 95 % interval, as wide as forecasts of the past were off."
        ),
        drawing: trend(&Trend {
            along: dates.axis(),
            quantity: quantity.into(),
            measured: Some(("estimates".into(), past)),
            band: Some(("95 % interval".into(), band)),
            curves,
            ..Trend::default()
        })
        .into(),
        title,
    }
}

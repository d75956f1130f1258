//! Text and sections of an answer of `forecast`.

use std::fmt::Write as _;

use super::trend::{Trend, trend};
use super::{Figure, PageTable, Section};
use crate::answers::forecast::{ForecastAnswer, LimitAnswer, ScoreAnswer, SeriesCurves, words};
use crate::ingest::dates::Dates;
use crate::scale::three_digits;

/// Days of the past that a fan shows.
const PAST: usize = 180;

/// What forecasts are scored by: title, figure, and whether that is a share of one.
type Scored = (&'static str, fn(&ScoreAnswer) -> f64, bool);
const SCORES: [Scored; 6] = [
    ("Root mean square error", |s| s.rmse, false),
    ("Continuous ranked probability score (CRPS)", |s| s.crps, false),
    ("Pinball loss at 5 %", |s| s.pinball.p5, false),
    ("Pinball loss at 50 %", |s| s.pinball.p50, false),
    ("Pinball loss at 95 %", |s| s.pinball.p95, false),
    ("Share of outcomes inside the 95 % interval", |s| s.coverage_95, true),
];

/// Scores of the past, the forecast, and the limit; `first` is the number of days after which forecasts of the past begin.
pub fn text(answer: &ForecastAnswer, first: usize, dates: Dates) -> String {
    let mut text =
        format!("Forecasts made on every day of the past after {first}, and what became of them\n\n");
    for scored in SCORES {
        text += &text_table(answer, scored);
    }
    answer.against_naive.iter().for_each(|line| text += &format!("{line}\n"));
    let days = answer.forecast.len();
    let _ = writeln!(text, "\nIn {days} days, on {}", dates.day(answer.last_d + days as f64));
    for (series, last) in answer.forecast.last().iter().flat_map(|day| day.series.iter()) {
        let _ = writeln!(
            text,
            "  {:<14} {:>9.1}, between {:.1} and {:.1} with 95 %",
            words(series),
            last.value,
            last.low,
            last.high
        );
    }
    if let Some(chance) = answer.event_chance {
        let (seen_d, seen) = answer.events_seen;
        let _ = writeln!(
            text,
            "  An event at a bearing, a seal or the unbalance would end this; {} in {seen_d:.0} days make one within {days} \
             days {:.0} % probable.",
            seen.unwrap_or_default(),
            100.0 * chance
        );
    }
    text += &match &answer.limit {
        Some(limit) => format!(
            "\n{}\nNext: have correction weights ready before then, with rotor-edge balance\n",
            limit_in_words(limit, answer.last_d, dates)
        ),
        None => "\nNext: say at which static unbalance in g·mm the machine has to be balanced, with --limit, and read when \
                 that is\n"
            .into(),
    };
    text
}

/// One score of every method at every horizon.
fn text_table(answer: &ForecastAnswer, (title, of, is_share): Scored) -> String {
    let mut text = format!("{title}\n  {:<20} {:<6}", "series", "model");
    let own = answer.scores.get(answer.model);
    let horizons = own.and_then(|by_series| by_series.iter().next());
    for (horizon, _) in horizons.iter().flat_map(|(_, by_horizon)| by_horizon.iter()) {
        let _ = write!(text, " {:>9}", format!("{horizon} d"));
    }
    text += "\n";
    for (series, _) in own.iter().flat_map(|by_series| by_series.iter()) {
        for (k, (method, by_series)) in answer.scores.iter().enumerate() {
            let unit = if is_share { String::new() } else { format!(", {}", unit(series)) };
            let label = if k == 0 { format!("{}{unit}", words(series)) } else { String::new() };
            let _ = write!(text, "  {label:<20} {method:<6}");
            for (_, score) in by_series.get(series).iter().flat_map(|by_horizon| by_horizon.iter()) {
                let value = of(score);
                let _ = match (value.is_finite(), is_share) {
                    (false, _) => write!(text, " {:>9}", "–"),
                    (true, false) => write!(text, " {value:>9.2}"),
                    (true, true) => write!(text, " {:>7.1} %", 100.0 * value),
                };
            }
            text += "\n";
        }
    }
    text + "\n"
}

/// Scores at each horizon, a fan for each series, and when the limit is reached.
pub fn sections(answer: &ForecastAnswer, curves: &[SeriesCurves], dates: Dates) -> Vec<Section> {
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
    let fans = curves.iter().enumerate().map(|(i, series)| fan(series, answer.model, drawn(i), dates));
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

fn fan(series: &SeriesCurves, model: &str, limit_g_mm: Option<f64>, dates: Dates) -> Figure {
    let past = &series.estimates[series.estimates.len().saturating_sub(PAST)..];
    let mut curves = vec![(format!("forecast, {model}"), series.forecast.clone())];
    let ends = past.first().into_iter().chain(series.forecast.last());
    curves.extend(limit_g_mm.map(|limit| ("limit".to_string(), ends.map(|end| (end.0, limit)).collect())));
    let magnitude = series.series.starts_with('U');
    let kind = if series.series.ends_with("_g") { "static" } else { "dynamic" };
    let title = format!("{} of the {kind} unbalance", if magnitude { "Size" } else { "Angle" });
    let quantity = if magnitude { "unbalance, g·mm" } else { "angle, degrees" };
    Figure {
        id: format!("fan-{}", series.series.to_lowercase().replace('_', "-")),
        caption: format!(
            "The estimates, the forecast by {model} and its 95 % interval, as wide as forecasts of the past were off."
        ),
        drawing: trend(&Trend {
            along: dates.axis(),
            quantity: quantity.into(),
            measured: Some(("estimates".into(), past.to_vec())),
            band: Some(("95 % interval".into(), series.interval_95.clone())),
            curves,
            ..Trend::default()
        })
        .into(),
        title,
    }
}

/// What the limit comes to, in one sentence; days as the track counts them.
fn limit_in_words(limit: &LimitAnswer, last_d: f64, dates: Dates) -> String {
    let head = format!("The limit of {:.0} g·mm static unbalance", limit.limit_g_mm);
    if limit.exceeded {
        return format!(
            "{head} is exceeded already: the last of the track, {}, has {:.0} g·mm.",
            dates.day(last_d),
            limit.now_g_mm
        );
    }
    let day = |days: Option<f64>| match days {
        Some(days) => format!("on {}", dates.day(last_d + days)),
        None => "not within the forecast".to_string(),
    };
    format!(
        "{head} is reached within {} days with {:.0} %: with a chance of 5 % {}; of 50 % {}; of 95 % {}.",
        limit.chance_until.len(),
        100.0 * limit.chance,
        day(limit.days.p5),
        day(limit.days.p50),
        day(limit.days.p95)
    )
}

/// Unit of a series.
fn unit(series: &str) -> &'static str {
    if series.starts_with('U') { "g·mm" } else { "°" }
}

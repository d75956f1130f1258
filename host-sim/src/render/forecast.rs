//! Text and sections of an answer of `forecast`.

use std::fmt::Write as _;

use rotor_edge_desktop::significance::percent;

use super::text::capital;
use super::trend::{Trend, trend};
use super::{Figure, PageTable, Section, Story};
use crate::answers::forecast::{
    ForecastAnswer, IntervalAnswer, LimitAnswer, LimitDays, ScoreAnswer, SeriesCurves, is_size, words,
};
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

/// The limit, the forecast, what to do, and the scores of the past; forecasts of the past begin after `first` days.
pub fn text(answer: &ForecastAnswer, first: usize, dates: Dates) -> String {
    let mut text = format!("{}\n", verdict(answer, dates));
    if let Some(line) = event_line(answer) {
        text += &format!("{line}\n");
    }
    let days = answer.forecast.len();
    let _ = writeln!(
        text,
        "\nIn {days} days, on {}; intervals and ± hold with 95 %",
        dates.day(answer.last_d + days as f64)
    );
    for (series, last) in answer.forecast.last().iter().flat_map(|day| day.series.iter()) {
        let _ = writeln!(text, "  {:<14} {}", words(series), in_interval(series, last));
    }
    let _ = writeln!(text, "\nNext: {}", next(answer, dates));
    let _ = writeln!(text, "\nForecasts made on every day of the past after {first}, and their errors");
    answer.against_naive.iter().for_each(|line| text += &format!("{line}\n"));
    for scored in SCORES {
        text += &format!("\n{}", text_table(answer, scored));
    }
    text
}

/// The answer in one sentence: when the limit is reached; without one, where the static unbalance goes.
fn verdict(answer: &ForecastAnswer, dates: Dates) -> String {
    if let Some(limit) = &answer.limit {
        return limit_in_words(limit, answer.last_d, dates);
    }
    let days = answer.forecast.len();
    let last = answer.forecast.last().and_then(|day| day.series.iter().next());
    let size = last.map_or_else(String::new, |(series, at)| in_interval(series, at));
    format!("In {days} days the static unbalance is {size}, with 95 %.")
}

/// The first screen of the page.
pub fn story(answer: &ForecastAnswer, curves: &[SeriesCurves], dates: Dates) -> Story {
    let days = answer.forecast.len();
    let all = || answer.forecast.last().into_iter().flat_map(|day| day.series.iter());
    let at_end: Vec<String> =
        all().map(|(series, at)| format!("{} {}", words(series), in_interval(series, at))).collect();
    let end = format!("{} in {days} days, on {}.", at_end.join("; "), dates.day(answer.last_d + days as f64));
    let mut answers = vec![("What", capital(&end)), ("How sure", sure(answer))];
    answers.extend(event_line(answer).map(|line| ("What could end it", line)));
    let limit = answer.limit.as_ref();
    let passage = limit.filter(|limit| !limit.exceeded);
    Story {
        verdict: verdict(answer, dates),
        answers,
        next: (format!("{}.", next(answer, dates)), None),
        beside: curves.first().map(|of| fan(of, answer.model, limit, dates)).into_iter().collect(),
        below: passage.map(|limit| first_passage(answer.last_d, limit, dates)).into_iter().collect(),
    }
}

/// How often intervals of the past held, at the longest horizon that was scored.
fn sure(answer: &ForecastAnswer) -> String {
    let own = answer.scores.get(answer.model).and_then(|by_series| by_series.iter().next());
    let scored = own.into_iter().flat_map(|(_, by_horizon)| by_horizon.iter());
    let longest = scored.filter(|(_, score)| score.coverage_95.is_finite() && score.compared > 0).last();
    let held = longest.map(|(horizon, score)| {
        format!(
            "{:.0} % of {} past outcomes were inside the 95 % interval {horizon} days ahead.",
            100.0 * score.coverage_95,
            score.compared
        )
    });
    let held = held.unwrap_or_else(|| "The track is too short to score forecasts of the past.".into());
    std::iter::once(held).chain(answer.against_naive.last().cloned()).collect::<Vec<_>>().join(" ")
}

/// How probable an event is that would end the forecast.
fn event_line(answer: &ForecastAnswer) -> Option<String> {
    let chance = answer.event_chance?;
    let (seen_d, seen) = answer.events_seen;
    let (seen, days) = (seen.unwrap_or_default(), answer.forecast.len());
    Some(format!(
        "An event at a bearing, a seal or the unbalance would end the forecast: {seen} in {seen_d:.0} days make one within \
         {days} days {:.0} % probable.",
        100.0 * chance
    ))
}

/// A forecast number with its interval and unit.
fn in_interval(series: &str, at: &IntervalAnswer) -> String {
    let IntervalAnswer { value, low, high, determined } = at;
    match (is_size(series), determined) {
        (true, _) => format!("{value:.1} g·mm ({low:.1} to {high:.1})"),
        (false, true) => format!("{value:.1}° ± {:.1}°", 0.5 * (high - low)),
        (false, false) => "undetermined: any angle is possible".into(),
    }
}

/// What to do about the limit.
fn next(answer: &ForecastAnswer, dates: Dates) -> String {
    match &answer.limit {
        None => "state the static unbalance in g·mm that must not be exceeded with --limit".into(),
        Some(limit) if limit.exceeded => "balance the machine, with weights by rotor-edge balance".into(),
        Some(LimitAnswer { days: LimitDays { p5: Some(days), .. }, .. }) => format!(
            "have correction weights ready by {}, with rotor-edge balance",
            dates.day(answer.last_d + days)
        ),
        Some(_) => "no correction is due yet; forecast again as the record grows".into(),
    }
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

/// The fans that the first screen leaves out, and scores at each horizon.
pub fn sections(answer: &ForecastAnswer, curves: &[SeriesCurves], dates: Dates) -> Vec<Section> {
    let mut scored = vec![
        "Every day of the past was forecast from as if it were the last; the errors are of those forecasts. CRPS and \
         pinball loss are small only for a forecast that is near and says how sure it is."
            .to_string(),
    ];
    scored.extend(answer.against_naive.iter().cloned());
    let figures = curves.iter().skip(1).map(|series| fan(series, answer.model, None, dates)).collect();
    let tables = SCORES.map(|scored| scores(answer, scored)).to_vec();
    vec![
        Section { heading: "Forecast".into(), figures, ..Section::default() },
        Section {
            heading: "How good such forecasts were".into(),
            paragraphs: scored,
            tables,
            ..Section::default()
        },
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
            begin: dates.iso(0.0),
            ..Trend::default()
        })
        .into(),
        title,
    }
}

/// A series with its forecast; the limit is that of the static unbalance, the first of the series.
fn fan(series: &SeriesCurves, model: &str, limit: Option<&LimitAnswer>, dates: Dates) -> Figure {
    let past = &series.estimates[series.estimates.len().saturating_sub(PAST)..];
    let curves = vec![(format!("forecast, {model}"), series.forecast.clone())];
    let limits = limit.map(|limit| (format!("limit, {:.0} g·mm", limit.limit_g_mm), limit.limit_g_mm));
    let reached = limit.filter(|limit| !limit.exceeded).and_then(|limit| limit.days.p5);
    let last_d = series.estimates.last().map_or(0.0, |last| last.0);
    let magnitude = is_size(&series.series);
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
            bands: vec![("95 % interval".into(), series.interval_95.clone())],
            curves,
            limits: limits.into_iter().collect(),
            events: reached.map(|days| (last_d + days, "5 % chance".to_string())).into_iter().collect(),
            begin: dates.iso(0.0),
            ..Trend::default()
        })
        .into(),
        title,
    }
}

/// Chance and likely days of exceeding the limit; days as the track counts them.
fn limit_in_words(limit: &LimitAnswer, last_d: f64, dates: Dates) -> String {
    let LimitAnswer { limit_g_mm, now_g_mm, .. } = limit;
    if limit.exceeded {
        return format!(
            "The static unbalance exceeds the limit of {limit_g_mm:.0} g·mm already: {now_g_mm:.0} g·mm on {}.",
            dates.day(last_d)
        );
    }
    let day = |days: f64| dates.day(last_d + days);
    let head = format!(
        "{} chance of exceeding {limit_g_mm:.0} g·mm static unbalance in the next {} days",
        capital(&percent(limit.chance)),
        limit.chance_until.len()
    );
    let LimitDays { p5, p50, p95, .. } = limit.days;
    let Some(earliest) = p5 else { return format!("{head}.") };
    let later = [(p50, "50 %"), (p95, "95 %")];
    let later = later.iter().filter_map(|(days, share)| Some(format!(", {share} by {}", day((*days)?))));
    format!("{head}; the earliest likely day (5 %) is {}{}.", day(earliest), later.collect::<String>())
}

/// Unit of a series.
fn unit(series: &str) -> &'static str {
    if is_size(series) { "g·mm" } else { "°" }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forecast(limit: Option<LimitAnswer>) -> ForecastAnswer {
        ForecastAnswer {
            model: "state",
            rmse: Default::default(),
            baselines: Default::default(),
            coverage_95: Default::default(),
            compared: Default::default(),
            scores: Default::default(),
            against_naive: vec!["At 1 d it beats the naive forecast on all four.".into()],
            forecast: Vec::new(),
            event_chance: None,
            limit,
            last_d: 151.0,
            events_seen: (152.0, None),
        }
    }

    fn limit(chance: f64, days: [Option<f64>; 3]) -> LimitAnswer {
        let [p5, p50, p95] = days;
        LimitAnswer {
            limit_g_mm: 900.0,
            now_g_mm: 700.0,
            exceeded: false,
            chance,
            chance_until: vec![chance; 60],
            days: LimitDays { p5, p10: None, p50, p90: None, p95 },
        }
    }

    #[test]
    fn limit_with_no_chance_asks_for_no_weights() {
        let text = text(&forecast(Some(limit(0.0, [None; 3]))), 90, Dates::default());
        assert!(text.starts_with("Less than 0.1 % chance of exceeding 900 g·mm static"), "{text}");
        assert!(!text.contains("weights") && text.contains("no correction is due yet"), "{text}");
    }

    #[test]
    fn limit_with_a_chance_names_the_earliest_day_first() {
        let text = text(&forecast(Some(limit(0.6, [Some(10.0), Some(40.0), None]))), 90, Dates::default());
        let first = "60.0 % chance of exceeding 900 g·mm static unbalance in the next 60 days; the earliest likely day (5 %) is \
                     day 161, 50 % by day 191.\n";
        assert!(text.starts_with(first), "{text}");
        assert!(text.contains("Next: have correction weights ready by day 161"), "{text}");
    }

    #[test]
    fn undetermined_angle_is_named_and_has_no_interval() {
        let wide = IntervalAnswer { value: -21.0, low: -201.0, high: 159.0, determined: false };
        assert_eq!(in_interval("alpha_g", &wide), "undetermined: any angle is possible");
        let known = IntervalAnswer { value: -21.0, low: -40.6, high: -1.4, determined: true };
        assert_eq!(in_interval("alpha_g", &known), "-21.0° ± 19.6°");
    }
}

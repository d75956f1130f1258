//! An answer of `forecast` on a terminal.

use std::fmt::Write as _;

use super::super::dates::Dates;
use super::{SCORES, Scored, limit_in_words, unit};
use crate::answers::forecast::{ForecastAnswer, words};

/// Scores of the past, the forecast, and the limit; `first` is the number of days after which forecasts of the past begin.
pub fn text(answer: &ForecastAnswer, first: usize, dates: Dates) -> String {
    let mut text =
        format!("Forecasts made on every day of the past after {first}, and what became of them\n\n");
    for scored in SCORES {
        text += &table(answer, scored);
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
fn table(answer: &ForecastAnswer, (title, of, is_share): Scored) -> String {
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

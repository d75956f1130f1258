//! What `forecast --report` says: the table of errors and the fans.

use rotor_edge_desktop::prognosis::limit::Reached;
use rotor_edge_desktop::prognosis::series::History;
use rotor_edge_desktop::prognosis::walk::interval;

use super::{Forecast, against_naive};
use crate::report::scale::three_digits;
use crate::report::trend::{Trend, trend};
use crate::report::{Figure, Section, Table};

/// Days of the past that a fan shows.
const PAST: usize = 180;

/// Errors at each horizon, and a fan for each series.
pub fn sections(
    history: &History,
    forecasts: &[Forecast],
    horizons: &[usize],
    model: &str,
    limit: Option<&Reached>,
) -> Vec<Section> {
    let mut paragraphs = vec![
        "Every day of the past was forecast from as if it were the last; the errors are of those forecasts."
            .to_string(),
    ];
    paragraphs.extend(against_naive(forecasts, horizons));
    if let Some(r) = limit {
        let half = r.days[1].map_or("not within the forecast".into(), |d| format!("by {d:.0} days from now"));
        paragraphs.push(format!(
            "The limit of {:.0} g·mm is reached within the forecast with {:.0} %; one chance in two {half}.",
            r.limit_g_mm,
            100.0 * r.chance
        ));
    }
    let figures = forecasts.iter().map(|f| fan(history, f, model)).collect();
    let tables = vec![errors(forecasts, horizons, model), coverage(forecasts, horizons)];
    vec![Section { heading: "Forecast".into(), paragraphs, tables, figures }]
}

fn days_ahead(horizons: &[usize]) -> impl Iterator<Item = String> {
    horizons.iter().map(|h| format!("{h} d"))
}

/// A finite value, or a dash where nothing could be compared.
fn cells(values: &[f64], text: impl Fn(f64) -> String) -> impl Iterator<Item = String> {
    values.iter().map(move |v| if v.is_finite() { text(*v) } else { "–".into() })
}

/// Errors of the model, naive and drift.
fn errors(forecasts: &[Forecast], horizons: &[usize], model: &str) -> Table {
    let shown = if model == "naive" { 1..3 } else { 0..3 };
    let row = |(f, k): (&Forecast, usize)| {
        let unit = if f.series.name.starts_with('U') { "g·mm" } else { "°" };
        let by = [model, "naive", "drift"][k].to_string();
        [format!("{}, {unit}", f.series.name), by]
            .into_iter()
            .chain(cells(&f.scores[k].rmse, three_digits))
            .collect()
    };
    Table {
        caption: "Root mean square error by days ahead".into(),
        columns: ["series", "forecast by"]
            .map(String::from)
            .into_iter()
            .chain(days_ahead(horizons))
            .collect(),
        rows: forecasts.iter().flat_map(|f| shown.clone().map(move |k| (f, k))).map(row).collect(),
    }
}

/// How often the model's interval held what came.
fn coverage(forecasts: &[Forecast], horizons: &[usize]) -> Table {
    let row = |f: &Forecast| {
        let shares = cells(&f.scores[0].coverage, |c| format!("{:.1} %", 100.0 * c));
        [f.series.name.to_string()].into_iter().chain(shares).collect()
    };
    Table {
        caption: "Share of outcomes inside the model's 95 % interval".into(),
        columns: ["series".to_string()].into_iter().chain(days_ahead(horizons)).collect(),
        rows: forecasts.iter().map(row).collect(),
    }
}

fn fan(history: &History, f: &Forecast, model: &str) -> Figure {
    let n = f.series.values.len();
    let day = |k: usize| history.first_d + k as f64;
    let past = (n.saturating_sub(PAST)..n).map(|k| (day(k), f.series.values[k])).collect();
    let ahead = |value: &dyn Fn(usize) -> f64| {
        (0..f.ahead.mean.len()).map(|k| (day(n + k), value(k))).collect::<Vec<_>>()
    };
    let end = |k: usize, side: usize| interval(f.ahead.mean[k], f.ahead.sd[k])[side];
    let magnitude = f.series.name.starts_with('U');
    let kind = if f.series.name.ends_with("_g") { "static" } else { "dynamic" };
    let title = format!("{} of the {kind} unbalance", if magnitude { "Size" } else { "Angle" });
    let quantity = if magnitude { "unbalance, g·mm" } else { "angle, degrees" };
    Figure {
        id: format!("fan-{}", f.series.name.to_lowercase().replace('_', "-")),
        caption: format!(
            "The estimates, the forecast by {model} and its 95 % interval, as wide as forecasts of the past were off."
        ),
        svg: trend(
            &title,
            &Trend {
                along: "time, days".into(),
                quantity: quantity.into(),
                measured: Some(("estimates".into(), past)),
                curves: vec![
                    (format!("forecast, {model}"), ahead(&|k| f.ahead.mean[k])),
                    ("lower end".into(), ahead(&|k| end(k, 0))),
                    ("upper end".into(), ahead(&|k| end(k, 1))),
                ],
                ..Trend::default()
            },
        ),
        title,
    }
}

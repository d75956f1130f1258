//! `forecast`: where the unbalance of a track is going.

mod json;
mod report;
mod text;

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use rayon::prelude::*;
use rotor_edge_desktop::grade::Rigid;
use rotor_edge_desktop::prognosis::ahead::Ahead;
use rotor_edge_desktop::prognosis::arima::Order;
use rotor_edge_desktop::prognosis::events;
use rotor_edge_desktop::prognosis::limit::{Reached, reached};
use rotor_edge_desktop::prognosis::scores::Score;
use rotor_edge_desktop::prognosis::series::{self, History, Series};
use rotor_edge_desktop::prognosis::walk::{By, Model, walk};
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::G_MM;

use super::dates::Dates;
use super::listener::Listener;
use super::output::{self, Json};

#[derive(Debug, Args)]
pub struct Arguments {
    /// A track, as `track --csv` writes it
    track: PathBuf,
    /// What the forecast is made with; naive and drift are printed beside it, and state where the track holds one
    /// [default: state where the track holds one, else arima]
    #[arg(long, value_enum)]
    model: Option<Kind>,
    /// Order p,d,q of arima; the best by Akaike's criterion if absent
    #[arg(long, value_parser = order)]
    order: Option<Order>,
    /// Days ahead at which forecasts of the past are scored
    #[arg(long, value_delimiter = ',', default_values_t = [1, 7, 30, 60])]
    horizons: Vec<usize>,
    /// Days after which the first forecast of the past is made
    #[arg(long, default_value_t = 90)]
    first: usize,
    /// Days that are forecast from the last one
    #[arg(long, default_value_t = 60)]
    days: usize,
    /// Static unbalance at which something has to be done, g·mm
    #[arg(long, conflicts_with = "grade")]
    limit: Option<f64>,
    /// The same as a balance quality grade of ISO 21940-11, mm/s; needs --rotor and --rpm
    #[arg(long, requires = "rotor", requires = "rpm")]
    grade: Option<f64>,
    /// The rotor whose mass the grade is for, rotor.toml
    #[arg(long)]
    rotor: Option<PathBuf>,
    /// The speed that the grade is for, rpm
    #[arg(long)]
    rpm: Option<f64>,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    form: output::Form,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// The state of the filter that followed the record, moved on; of `track --method joint`
    State,
    /// ARIMA by exact likelihood
    Arima,
    /// A recurrent network; needs a build with `--features lstm`
    Lstm,
    /// It stays as it is
    Naive,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::State => "state",
            Self::Arima => "arima",
            Self::Lstm => "lstm",
            Self::Naive => "naive",
        }
    }
}

fn order(text: &str) -> Result<Order, String> {
    let numbers: Vec<usize> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match numbers[..] {
        [p, d, q] if text.split(',').count() == 3 => Ok(Order { p, d, q }),
        _ => Err(format!("\"{text}\" is not an order, expected p,d,q as in 3,1,3")),
    }
}

/// One series, scored and forecast by the model asked for, and scored by others.
pub struct Forecast<'a> {
    pub series: &'a Series,
    /// Name of each method, the model's first, and its scores at every horizon.
    pub scores: Vec<(&'static str, Vec<Score>)>,
    /// Forecast of the model asked for.
    pub ahead: Ahead,
}

impl Forecast<'_> {
    pub fn own(&self) -> &[Score] {
        &self.scores[0].1
    }

    /// The scores of a method by its name; none if it was not tried.
    pub fn of(&self, method: &str) -> &[Score] {
        self.scores.iter().find(|(name, _)| *name == method).map_or(&[], |(_, scores)| scores)
    }
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    if arguments.horizons.is_empty() || arguments.horizons.contains(&0) || arguments.days == 0 {
        bail!("--horizons and --days: expected whole days of at least 1");
    }
    if arguments.first < 30 {
        bail!("--first {}: expected at least 30 days to learn from", arguments.first);
    }
    let (history, dates) = read(&arguments.track)?;
    let limit_g_mm = limit_g_mm(arguments)?;
    let has_state = history.series.iter().all(|s| s.filter_states.is_some());
    let model = arguments.model.unwrap_or(if has_state { Kind::State } else { Kind::Arima });
    let ways: usize = history.series.iter().map(|s| 1 + baselines(s, model).count()).sum();
    let working = listener.progress("series forecast by each method", ways);
    // refused for the first series that cannot be forecast, whichever is ready first
    let forecasts: Vec<Result<Forecast>> =
        history.series.par_iter().map(|s| one(s, model, arguments, &working)).collect();
    working.finish_and_clear();
    let forecasts = forecasts.into_iter().collect::<Result<Vec<Forecast>>>()?;
    let limit = limit_g_mm.map(|limit| {
        let magnitude = &forecasts[0];
        let now = magnitude.series.known.last().copied().unwrap_or_default();
        reached(&magnitude.ahead, now, limit, arguments.seed)
    });
    if let Some(path) = &arguments.form.report {
        let sections =
            report::sections(&history, &forecasts, &arguments.horizons, model.name(), limit.as_ref(), dates);
        output::report(path, "Forecast of the unbalance", sections)?;
    }
    if arguments.form.json {
        return output::as_json(&json::summary(
            arguments,
            model.name(),
            &history,
            &forecasts,
            limit.as_ref(),
            dates,
        ));
    }
    text::print(arguments, &history, &forecasts, limit.as_ref(), dates);
    Ok(None)
}

/// A track, and when its days are.
fn read(path: &Path) -> Result<(History, Dates)> {
    let history = series::read(path)?;
    let text =
        std::fs::read_to_string(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    Ok((history, Dates::of_track(&text)))
}

fn limit_g_mm(arguments: &Arguments) -> Result<Option<f64>> {
    let positive = |name: &str, value: f64| match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => bail!("{name} {value}: expected a positive number"),
    };
    if let (Some(grade), Some(rotor), Some(rpm)) = (arguments.grade, &arguments.rotor, arguments.rpm) {
        let (grade_mm_s, service_rpm) = (positive("--grade", grade)?, positive("--rpm", rpm)?);
        let permissible_kg_m = Rigid::of(&rotor_file::read(rotor)?).permissible_kg_m(grade_mm_s, service_rpm);
        return Ok(Some(permissible_kg_m * G_MM));
    }
    arguments.limit.map(|limit| positive("--limit", limit)).transpose()
}

/// What a model is held against: the filter's own state where the track holds it, "it stays" and "it goes on".
fn baselines(series: &Series, model: Kind) -> impl Iterator<Item = (&'static str, By)> {
    let state = series.filter_states.is_some().then_some((Kind::State.name(), By::State));
    let others = [(Kind::Naive.name(), Model::Naive.into()), (DRIFT, Model::Drift.into())];
    state.into_iter().chain(others).filter(move |(name, _)| *name != model.name())
}

fn one<'a>(
    series: &'a Series,
    model: Kind,
    arguments: &Arguments,
    working: &ProgressBar,
) -> Result<Forecast<'a>> {
    let score = |by: By| walk(series, by, arguments.first, &arguments.horizons, arguments.days);
    let (own, ahead) = match model {
        Kind::State => score(By::State)?,
        Kind::Naive => score(Model::Naive.into())?,
        Kind::Arima => score(Model::Arima(arguments.order).into())?,
        Kind::Lstm => lstm(series, arguments)?,
    };
    working.inc(1);
    let mut scores = vec![(model.name(), own)];
    for (name, by) in baselines(series, model) {
        scores.push((name, score(by)?.0));
        working.inc(1);
    }
    Ok(Forecast { series, scores, ahead })
}

#[cfg(feature = "lstm")]
fn lstm(series: &Series, arguments: &Arguments) -> Result<(Vec<Score>, Ahead)> {
    let model = Model::Lstm { seed: arguments.seed };
    Ok(walk(series, model, arguments.first, &arguments.horizons, arguments.days)?)
}

#[cfg(not(feature = "lstm"))]
fn lstm(_: &Series, _: &Arguments) -> Result<(Vec<Score>, Ahead)> {
    bail!("this build has no LSTM; build it with `cargo build --release --features lstm` and run again")
}

/// The forecast that goes on as on average until then.
const DRIFT: &str = "drift";

/// What forecasts are scored by: title, figure, and whether that is a share of one.
type Scored = (&'static str, fn(&Score) -> f64, bool);
const SCORES: [Scored; 6] = [
    ("Root mean square error", |s| s.rmse, false),
    ("Continuous ranked probability score (CRPS)", |s| s.crps, false),
    ("Pinball loss at 5 %", |s| s.pinball[0], false),
    ("Pinball loss at 50 %", |s| s.pinball[1], false),
    ("Pinball loss at 95 %", |s| s.pinball[2], false),
    ("Share of outcomes inside the 95 % interval", |s| s.coverage, true),
];

/// What the limit comes to, in one sentence; days as the track counts them.
pub fn limit_in_words(limit: &Reached, last_d: f64, dates: Dates) -> String {
    let head = format!("The limit of {:.0} g·mm static unbalance", limit.limit_g_mm);
    if limit.already() {
        return format!(
            "{head} is exceeded already: the last of the track, {}, has {:.0} g·mm.",
            dates.day(last_d),
            limit.now_g_mm
        );
    }
    let day = |share: usize| match limit.days[share] {
        Some(days) => format!("on {}", dates.day(last_d + days)),
        None => "not within the forecast".to_string(),
    };
    format!(
        "{head} is reached within {} days with {:.0} %: with a chance of 5 % {}; of 50 % {}; of 95 % {}.",
        limit.until.len(),
        100.0 * limit.chance(),
        day(0),
        day(2),
        day(4)
    )
}

/// Chance of an event within the days that are forecast, of a track that says which it had.
fn event_chance(history: &History, days: usize) -> Option<f64> {
    let seen_d = history.last_d() - history.first_d + 1.0;
    history.events.map(|seen| events::chance(seen, seen_d, days as f64))
}

/// The same in one sentence.
fn event_in_words(history: &History, days: usize, chance: f64) -> String {
    format!(
        "An event at a bearing, a seal or the unbalance would end this; {} in {:.0} days make one within {days} days {:.0} % \
         probable.",
        history.events.unwrap_or_default(),
        history.last_d() - history.first_d + 1.0,
        100.0 * chance
    )
}

/// Unit of a series.
/// A series in words; its name is that of its column.
pub fn words(series: &Series) -> &'static str {
    match series.name {
        "U_g" => "static size",
        "alpha_g" => "static angle",
        "U_d" => "dynamic size",
        "alpha_d" => "dynamic angle",
        other => other,
    }
}

pub fn unit(series: &Series) -> &'static str {
    if series.name.starts_with('U') { "g·mm" } else { "°" }
}

/// Where the model is better than the naive forecast, in words.
pub fn against_naive(forecasts: &[Forecast], horizons: &[usize]) -> Vec<String> {
    let one = |(i, h): (usize, &usize)| {
        let (mut better, mut worse) = (Vec::new(), Vec::new());
        for f in forecasts {
            let (own, naive) = (f.own(), f.of(Kind::Naive.name()));
            if own[i].count == 0 {
                continue;
            }
            if own[i].rmse < naive[i].rmse {
                better.push(words(f.series))
            } else {
                worse.push(words(f.series))
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

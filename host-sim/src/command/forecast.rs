//! `forecast`: where the unbalance of a track is going.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use rayon::prelude::*;
use rotor_edge_desktop::forecast::ahead::ForecastPath;
use rotor_edge_desktop::forecast::arima::Order;
use rotor_edge_desktop::forecast::backtest::{ForecastBasis, ForecastModel, backtest};
use rotor_edge_desktop::forecast::limit::first_passage;
use rotor_edge_desktop::forecast::scores::Score;
use rotor_edge_desktop::forecast::series::{self, DailySeries, History};
use rotor_edge_desktop::grade::Rigid;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::G_MM;

use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::forecast::{DRIFT, ForecastAnswer, NAIVE, SeriesCurves, SeriesForecast};
use crate::ingest::dates::Dates;
use crate::render;
use crate::terminal;

#[derive(Debug, Args)]
pub struct Arguments {
    /// A track, written by `track --csv`
    track: PathBuf,
    /// Forecast model; naive and drift are printed beside it, and state if the track holds one [default: state if the
    /// track holds one, else arima]
    #[arg(long, value_enum)]
    model: Option<Kind>,
    /// Order p,d,q of arima; the best by Akaike's criterion if absent
    #[arg(long, value_parser = order)]
    order: Option<Order>,
    /// Horizons at which past forecasts are scored, days
    #[arg(long, value_delimiter = ',', default_values_t = [1, 7, 30, 60])]
    horizons: Vec<usize>,
    /// Days of data before the first past forecast
    #[arg(long, default_value_t = 90)]
    first: usize,
    /// Length of the forecast, days
    #[arg(long, default_value_t = 60)]
    days: usize,
    /// Largest permissible static unbalance, g·mm
    #[arg(long, conflicts_with = "grade")]
    limit: Option<f64>,
    /// Limit as a balance quality grade of ISO 21940-11, mm/s; needs --rotor and --rpm
    #[arg(long, requires = "rotor", requires = "rpm")]
    grade: Option<f64>,
    /// The rotor whose mass the grade refers to, rotor.toml
    #[arg(long)]
    rotor: Option<PathBuf>,
    /// The speed that the grade refers to, rpm
    #[arg(long)]
    rpm: Option<f64>,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    form: output::Form,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Filter state of `track --method joint`, propagated
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
            Self::Naive => NAIVE,
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
    let forecasts: Vec<Result<SeriesForecast>> =
        history.series.par_iter().map(|s| one(s, model, arguments, &working)).collect();
    working.finish_and_clear();
    let forecasts = forecasts.into_iter().collect::<Result<Vec<SeriesForecast>>>()?;
    let limit = limit_g_mm.map(|limit| {
        let magnitude = &forecasts[0];
        let now = magnitude.series.known.last().copied().unwrap_or_default();
        first_passage(&magnitude.ahead, now, limit, arguments.seed)
    });
    let answer = ForecastAnswer::of(
        model.name(),
        &history,
        &forecasts,
        &arguments.horizons,
        limit.as_ref(),
        |time_d| dates.iso(time_d),
    );
    if let Some(path) = &arguments.form.report {
        let curves: Vec<SeriesCurves> = forecasts.iter().map(|f| SeriesCurves::of(&history, f)).collect();
        let story = render::forecast::story(&answer, &curves, dates);
        let sections = render::forecast::sections(&answer, &curves, dates);
        output::story(path, "Forecast of the unbalance", &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::forecast::text(&answer, arguments.first, dates));
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
fn baselines(series: &DailySeries, model: Kind) -> impl Iterator<Item = (&'static str, ForecastBasis)> {
    let state = series.filter_states.is_some().then_some((Kind::State.name(), ForecastBasis::State));
    let others = [(Kind::Naive.name(), ForecastModel::Naive.into()), (DRIFT, ForecastModel::Drift.into())];
    state.into_iter().chain(others).filter(move |(name, _)| *name != model.name())
}

fn one<'a>(
    series: &'a DailySeries,
    model: Kind,
    arguments: &Arguments,
    working: &ProgressBar,
) -> Result<SeriesForecast<'a>> {
    let score = |by: ForecastBasis| {
        let scored = backtest(series, by, arguments.first, &arguments.horizons, arguments.days);
        output::about(&arguments.track, scored)
    };
    let (own, ahead) = match model {
        Kind::State => score(ForecastBasis::State)?,
        Kind::Naive => score(ForecastModel::Naive.into())?,
        Kind::Arima => score(ForecastModel::Arima(arguments.order).into())?,
        Kind::Lstm => lstm(series, arguments)?,
    };
    working.inc(1);
    let mut scores = vec![(model.name(), own)];
    for (name, by) in baselines(series, model) {
        scores.push((name, score(by)?.0));
        working.inc(1);
    }
    Ok(SeriesForecast { series, scores, ahead })
}

#[cfg(feature = "lstm")]
fn lstm(series: &DailySeries, arguments: &Arguments) -> Result<(Vec<Score>, ForecastPath)> {
    let model = ForecastModel::Lstm { seed: arguments.seed };
    let scored = backtest(series, model, arguments.first, &arguments.horizons, arguments.days);
    output::about(&arguments.track, scored)
}

#[cfg(not(feature = "lstm"))]
fn lstm(_: &DailySeries, _: &Arguments) -> Result<(Vec<Score>, ForecastPath)> {
    bail!("this build has no LSTM; build it with `cargo build --release --features lstm` and run again")
}

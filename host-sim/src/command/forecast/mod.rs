//! `forecast`: where the unbalance of a track is going.

mod report;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use rotor_edge_desktop::balance::grade::Rigid;
use rotor_edge_desktop::machine::rotor_file;
use rotor_edge_desktop::prognosis::arima::Order;
use rotor_edge_desktop::prognosis::limit::{Reached, reached};
use rotor_edge_desktop::prognosis::series::{self, History, Series};
use rotor_edge_desktop::prognosis::walk::{Ahead, Model, Score, interval, walk};
use rotor_edge_desktop::unbalance::G_MM;
use serde_json::{Map, Value, json};

use super::output;

#[derive(Debug, Args)]
pub struct Arguments {
    /// A track, as `track --csv` writes it
    track: PathBuf,
    /// What the forecast is made with; naive and drift are printed beside it
    #[arg(long, value_enum, default_value_t = Kind::Arima)]
    model: Kind,
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

/// One series, scored and forecast by the model asked for, naive and drift.
pub struct Forecast<'a> {
    /// The series.
    pub series: &'a Series,
    /// Model, naive, drift.
    pub scores: [Score; 3],
    /// By the model.
    pub ahead: Ahead,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.horizons.is_empty() || arguments.horizons.contains(&0) || arguments.days == 0 {
        bail!("--horizons and --days: expected whole days of at least 1");
    }
    if arguments.first < 30 {
        bail!("--first {}: expected at least 30 days to learn from", arguments.first);
    }
    let history = series::read(&arguments.track)?;
    let limit_g_mm = limit_g_mm(arguments)?;
    let working = output::spinner("forecasts of the past");
    // refused for the first series that cannot be forecast, whichever is ready first
    let forecasts: Vec<Result<Forecast>> = history.series.par_iter().map(|s| one(s, arguments)).collect();
    working.finish_and_clear();
    let forecasts = forecasts.into_iter().collect::<Result<Vec<Forecast>>>()?;
    let limit = limit_g_mm.map(|limit| {
        let magnitude = &forecasts[0];
        let now = magnitude.series.known.last().copied().unwrap_or_default();
        reached(&magnitude.ahead, now, limit, arguments.seed)
    });
    if let Some(path) = &arguments.form.report {
        let sections = report::sections(
            &history,
            &forecasts,
            &arguments.horizons,
            arguments.model.name(),
            limit.as_ref(),
        );
        output::report(path, "Forecast of the unbalance", sections)?;
    }
    if arguments.form.json {
        return output::json(&summary(arguments, &history, &forecasts, limit.as_ref()));
    }
    print(arguments, &forecasts, limit.as_ref());
    Ok(())
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

fn one<'a>(series: &'a Series, arguments: &Arguments) -> Result<Forecast<'a>> {
    let score = |model| walk(series, model, arguments.first, &arguments.horizons, arguments.days);
    let (naive, stays) = score(Model::Naive)?;
    let (drift, _) = score(Model::Drift)?;
    let (own, ahead) = match arguments.model {
        Kind::Naive => (naive.clone(), stays),
        Kind::Arima => score(Model::Arima(arguments.order))?,
        Kind::Lstm => lstm(series, arguments)?,
    };
    Ok(Forecast { series, scores: [own, naive, drift], ahead })
}

#[cfg(feature = "lstm")]
fn lstm(series: &Series, arguments: &Arguments) -> Result<(Score, Ahead)> {
    let model = Model::Lstm { seed: arguments.seed };
    Ok(walk(series, model, arguments.first, &arguments.horizons, arguments.days)?)
}

#[cfg(not(feature = "lstm"))]
fn lstm(_: &Series, _: &Arguments) -> Result<(Score, Ahead)> {
    bail!("this build has no LSTM; build it with `cargo build --release --features lstm` and run again")
}

/// Where the model is better than the naive forecast, in words.
pub fn against_naive(forecasts: &[Forecast], horizons: &[usize]) -> Vec<String> {
    let one = |(i, h): (usize, &usize)| {
        let (mut better, mut worse) = (Vec::new(), Vec::new());
        for f in forecasts {
            let [own, naive, _] = &f.scores;
            if own.count[i] == 0 {
                continue;
            }
            if own.rmse[i] < naive.rmse[i] { better.push(f.series.name) } else { worse.push(f.series.name) }
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

fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

fn summary(
    arguments: &Arguments,
    history: &History,
    forecasts: &[Forecast],
    limit: Option<&Reached>,
) -> Value {
    let by_horizon = |values: &[f64]| -> Value {
        let pairs = arguments.horizons.iter().zip(values);
        pairs.map(|(h, v)| (h.to_string(), number(*v))).collect::<Map<_, _>>().into()
    };
    let by_series = |value: &dyn Fn(&Forecast) -> Value| -> Value {
        forecasts.iter().map(|f| (f.series.name.to_string(), value(f))).collect::<Map<_, _>>().into()
    };
    let last_d = history.first_d + forecasts[0].series.values.len() as f64 - 1.0;
    let day = |k: usize| {
        let mut all = Map::new();
        all.insert("time_d".into(), json!(last_d + k as f64 + 1.0));
        for f in forecasts {
            let [low, high] = interval(f.ahead.mean[k], f.ahead.sd[k]);
            all.insert(f.series.name.into(), json!({ "value": f.ahead.mean[k], "low": low, "high": high }));
        }
        Value::from(all)
    };
    json!({
        "model": arguments.model.name(),
        "rmse": by_series(&|f| by_horizon(&f.scores[0].rmse)),
        "baselines": {
            "naive": by_series(&|f| by_horizon(&f.scores[1].rmse)),
            "drift": by_series(&|f| by_horizon(&f.scores[2].rmse)),
        },
        "coverage_95": by_series(&|f| by_horizon(&f.scores[0].coverage)),
        "compared": by_series(&|f| {
            let counts: Vec<f64> = f.scores[0].count.iter().map(|c| *c as f64).collect();
            by_horizon(&counts)
        }),
        "against_naive": against_naive(forecasts, &arguments.horizons),
        "forecast": (0..arguments.days).map(day).collect::<Vec<_>>(),
        "limit": limit.map(|r| json!({
            "limit_g_mm": r.limit_g_mm,
            "chance": r.chance,
            "days": { "p10": r.days[0], "p50": r.days[1], "p90": r.days[2] },
        })),
    })
}

fn print(arguments: &Arguments, forecasts: &[Forecast], limit: Option<&Reached>) {
    println!("Root mean square error of forecasts made on every day of the past after {}", arguments.first);
    print!("  {:<10} {:<8}", "series", "model");
    arguments.horizons.iter().for_each(|h| print!(" {:>9}", format!("{h} d")));
    println!();
    for f in forecasts {
        let unit = if f.series.name.starts_with('U') { "g·mm" } else { "°" };
        let names = [arguments.model.name(), "naive", "drift"];
        for (k, (name, score)) in names.iter().zip(&f.scores).enumerate() {
            if k > 0 && *name == names[0] {
                continue;
            }
            let label = if k == 0 { format!("{}, {unit}", f.series.name) } else { String::new() };
            print!("  {label:<12} {name:<6}");
            score.rmse.iter().for_each(|e| match e.is_finite() {
                true => print!(" {e:>9.2}"),
                false => print!(" {:>9}", "–"),
            });
            println!();
        }
    }
    println!("\nShare of outcomes inside the 95 % interval");
    for f in forecasts {
        print!("  {:<19}", f.series.name);
        f.scores[0].coverage.iter().for_each(|c| match c.is_finite() {
            true => print!(" {:>7.1} %", 100.0 * c),
            false => print!(" {:>9}", "–"),
        });
        println!();
    }
    println!();
    against_naive(forecasts, &arguments.horizons).iter().for_each(|line| println!("{line}"));
    println!("\nIn {} days", arguments.days);
    for f in forecasts {
        let k = arguments.days - 1;
        let [low, high] = interval(f.ahead.mean[k], f.ahead.sd[k]);
        println!("  {:<8} {:>9.1}, between {low:.1} and {high:.1} with 95 %", f.series.name, f.ahead.mean[k]);
    }
    if let Some(r) = limit {
        println!("\nThe limit of {:.0} g·mm static unbalance", r.limit_g_mm);
        println!("  is reached within {} days with {:.0} %", arguments.days, 100.0 * r.chance);
        for (share, days) in ["one in ten", "one in two", "nine in ten"].iter().zip(r.days) {
            match days {
                Some(days) => println!("  {share} by day {days:.0} from now"),
                None => println!("  {share} not within the forecast"),
            }
        }
    }
}

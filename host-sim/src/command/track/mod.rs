//! `track`: the unbalance of a long record, while bearings change.

mod table;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::track::{
    self, Config, DetectorThresholds, LaterRunup, Method, Outage, PROPOSALS_AS_PRINTED,
};

use super::listener::Listener;
use super::output::{self, Json};
use crate::answers::track::TrackAnswer;
use crate::answers::track_curves::TrackCurves;
use crate::command::shell;
use crate::ingest::calendar::Moment;
use crate::ingest::dates::{Dates, DayCount, moment};
use crate::render;
use crate::say;
use crate::terminal;

/// A bound on growth that is wider than this in a day is none.
const LARGEST_GROWTH: f64 = 100.0;

#[derive(Debug, Args)]
pub struct Arguments {
    /// The rotor, rotor.toml
    rotor: PathBuf,
    /// Record of this rotor, measured.csv
    record: PathBuf,
    /// A run-up in the state of the first days
    #[arg(long)]
    runup: Option<PathBuf>,
    /// A run-up after an event, for --method joint; its day is in a column time_d, or the number at the end of its
    /// run's name
    #[arg(long)]
    later_runup: Vec<PathBuf>,
    /// Method of tracking
    #[arg(long, value_enum, default_value_t = Way::Adaptive)]
    method: Way,
    /// The file's bearings and planes are identified already: no phase I
    #[arg(long)]
    identified: bool,
    /// Write every estimate as CSV; `forecast` reads it
    #[arg(long)]
    csv: Option<PathBuf>,
    /// With --method bayes, use the paper's random walk in bearings and unbalance together; its chains do not
    /// converge
    #[arg(long)]
    paper: bool,
    /// Proposals per chain and day with --method bayes, and as many again where the chains do not converge [default:
    /// 400, with --paper 200]
    #[arg(long, value_parser = clap::value_parser!(u16).range(20..))]
    proposals: Option<u16>,
    /// Date of day 0 of the record, as in 2024-03-01T06:00+01:00; days are then printed with dates [default: from the
    /// record's header comment]
    #[arg(long, value_parser = moment)]
    begin: Option<Moment>,
    /// With --method joint, re-estimate every Nth reading using only data up to that day
    #[arg(long, value_name = "EVERY")]
    as_known_then: Option<NonZeroUsize>,
    /// With --method joint, a period without operation, days or dates; bearings and unbalance may be new after it. May be given
    /// several times
    #[arg(long, value_name = "FROM..TO", value_parser = outage)]
    outage: Vec<OutageEnds>,
    /// Seed of the random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    flagging: Flagging,
    #[command(flatten)]
    runout: output::Runout,
    #[command(flatten)]
    form: output::Form,
}

/// The methods by their names on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Way {
    /// Bearings constant
    Fixed,
    /// Bearings identified anew when the residual jumps and stays
    Adaptive,
    /// Bearings and unbalance sampled every day
    Bayes,
    /// All days together: bearings that wander, unbalance that drifts and jumps
    Joint,
}

/// When a reading is suspicious, and when that is a flag.
#[derive(Debug, Args)]
struct Flagging {
    /// Relative rise of the residual above its running level that is suspicious [default: 0.5, with bayes 0.3]
    #[arg(long)]
    rise: Option<f64>,
    /// Residual over feature sum that is suspicious by itself
    #[arg(long, default_value_t = 1.0 / 3.0)]
    ratio_limit: f64,
    /// Residual over feature sum below which no rise is suspicious
    #[arg(long, default_value_t = 0.05)]
    ratio_floor: f64,
    /// Readings in a row that raise the flag
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=30))]
    persistence: u8,
    /// Largest unbalance of a plane relative to the day before
    #[arg(long, default_value_t = 1.2)]
    growth: f64,
}

impl Arguments {
    fn config(&self) -> Result<Config> {
        let f = &self.flagging;
        for (name, value, from, to) in [
            ("--growth", f.growth, 1.0, LARGEST_GROWTH),
            ("--rise", f.rise.unwrap_or(0.5), 0.0, f64::MAX),
            ("--ratio-limit", f.ratio_limit, 0.0, f64::MAX),
            ("--ratio-floor", f.ratio_floor, 0.0, f64::MAX),
        ] {
            if !(from..=to).contains(&value) {
                let most = if to < f64::MAX { format!(" and at most {to}") } else { String::new() };
                bail!("{name} {value}: expected a number of at least {from}{most}");
            }
        }
        let method = match self.method {
            Way::Fixed => Method::Fixed,
            Way::Adaptive => Method::Adaptive,
            Way::Bayes => Method::Bayes,
            Way::Joint => Method::Joint,
        };
        if self.paper && method != Method::Bayes {
            bail!("--paper is for --method bayes; the other methods have one form");
        }
        let usual = Config::new(method);
        let usual_proposals = if self.paper { PROPOSALS_AS_PRINTED } else { usual.proposals };
        let thresholds = DetectorThresholds {
            rise: f.rise.unwrap_or(usual.thresholds.rise),
            ratio_limit: f.ratio_limit,
            ratio_floor: f.ratio_floor,
            persistence: usize::from(f.persistence),
            ..usual.thresholds
        };
        Ok(Config {
            thresholds,
            growth: f.growth,
            identified: self.identified,
            proposals: self.proposals.map_or(usual_proposals, usize::from),
            paper: self.paper,
            seed: self.seed,
            ..usual
        })
    }
}

pub fn run(arguments: &Arguments, listener: Listener) -> Result<Json> {
    let mut config = arguments.config()?;
    if !arguments.outage.is_empty() && config.method != Method::Joint {
        bail!("--outage is for --method joint; the other methods do not start anew");
    }
    let rotor = rotor_file::read(&arguments.rotor)?;
    let count = DayCount::from(Dates::of(arguments.begin, &arguments.record)?);
    let day = |cell: &str| count.day(cell);
    let whole = arguments.runout.read_record(&arguments.record, &rotor, &day)?;
    let record = &whole.readings;
    track::check_record(&arguments.record.display().to_string(), &rotor, record)?;
    let dates = count.dates();
    config.conditions.clone_from(&whole.conditions);
    config.outages = arguments.outage.iter().map(|ends| ends.days(dates)).collect::<Result<_>>()?;
    if !dates.is_unknown() && record[0].time_d.is_none() {
        let file = arguments.record.display();
        bail!("{file}: there is no column time_d, expected one that counts the days from --begin on");
    }
    let runup = match &arguments.runup {
        Some(path) => read_runup(path, &rotor, arguments, dates)?,
        None => Vec::new(),
    };
    if !arguments.later_runup.is_empty() && config.method != Method::Joint {
        bail!("--later-runup is for --method joint; the other methods see the record alone");
    }
    let later: Vec<(f64, Vec<Reading>)> = arguments
        .later_runup
        .iter()
        .map(|path| later_runup(path, &rotor, arguments, dates))
        .collect::<Result<_>>()?;
    let later: Vec<LaterRunup> =
        later.iter().map(|(time_d, readings)| LaterRunup { time_d: *time_d, readings }).collect();
    if arguments.as_known_then.is_some() && config.method != Method::Joint {
        bail!("--as-known-then is for --method joint; of the other methods every estimate is one of its day");
    }
    let begun = Instant::now();
    let bar = listener.progress("track", record.len());
    let mut progress = |done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
        listener.step(done, Some(of));
    };
    let followed = match arguments.as_known_then {
        Some(every) => track::filtered(&rotor, record, &runup, &later, &config, every.get(), &mut progress),
        None => track::track(&rotor, record, &runup, &later, &config, &mut progress),
    };
    bar.finish_and_clear();
    let mut followed = followed.with_context(|| arguments.record.display().to_string())?;
    followed.remarks.splice(0..0, whole.passed_over());
    if let Some(path) = &arguments.csv {
        table::write(path, &rotor, &followed, dates)?;
    }
    let answer = TrackAnswer::of(&rotor, &followed, record.len(), &|time_d| dates.iso(time_d));
    if let Some(path) = &arguments.form.report {
        let curves = TrackCurves::of(&rotor, record, &followed);
        let story = render::track::story(&answer, &curves, dates, next(arguments, &answer));
        let sections = render::track::sections(&answer, &curves, dates);
        output::story(path, &format!("{}: the unbalance followed", rotor.name), &story, sections)?;
    }
    if arguments.form.json {
        return output::answer(&answer);
    }
    terminal::print(&render::track::text(&rotor.name, &answer, dates));
    say!("\nTracking took {:.2} s.", begun.elapsed().as_secs_f64());
    output::say_next(&next(arguments, &answer));
    Ok(None)
}

/// The ends of an outage as they are written.
#[derive(Debug, Clone)]
struct OutageEnds {
    from: String,
    to: String,
}

fn outage(text: &str) -> Result<OutageEnds, String> {
    let ends = text.split_once("..").filter(|(from, to)| !from.trim().is_empty() && !to.trim().is_empty());
    let (from, to) =
        ends.ok_or_else(|| format!("\"{text}\" is no outage, expected two days or dates as in 60..120"))?;
    Ok(OutageEnds { from: from.trim().into(), to: to.trim().into() })
}

impl OutageEnds {
    /// As days of a record.
    fn days(&self, dates: Dates) -> Result<Outage> {
        let day = |text: &str| -> Result<f64> {
            if let Ok(day) = text.parse::<f64>() {
                return Ok(day);
            }
            if dates.is_unknown() {
                bail!(
                    "--outage: \"{text}\" is no day, and the record has no dates; say with --begin when day 0 was"
                );
            }
            let day = DayCount::from(dates).day(text).unwrap_or_else(|| Err(format!("\"{text}\" is no day")));
            day.map_err(|why| anyhow::anyhow!("--outage: {why}"))
        };
        let (from_d, to_d) = (day(&self.from)?, day(&self.to)?);
        let is_ascending = from_d < to_d;
        if !is_ascending {
            bail!("--outage {}..{}: expected the earlier end first", self.from, self.to);
        }
        Ok(Outage { from_d, to_d })
    }
}

/// What to do, and the command for it.
fn next(arguments: &Arguments, answer: &TrackAnswer) -> output::Next {
    let then = match answer.undiagnosed_since_d {
        Some(_) => {
            "; once there is a run-up since the event, the same with --method joint --later-runup RUNUP.csv"
        }
        None => "",
    };
    match &arguments.csv {
        Some(path) => (
            format!("forecast the unbalance{then}"),
            Some(format!("rotor-edge forecast {}", shell::path(path))),
        ),
        None => (format!("the same with --csv TRACK.csv, which rotor-edge forecast reads{then}"), None),
    }
}

/// A run-up; its dates count as those of the record do.
fn read_runup(path: &Path, rotor: &Rotor, arguments: &Arguments, dates: Dates) -> Result<Vec<Reading>> {
    let count = DayCount::from(dates);
    let readings = arguments.runout.read_dated(path, rotor, &|cell: &str| count.day(cell))?;
    if dates.is_unknown() && !count.dates().is_unknown() {
        bail!(
            "{}: its times are dates and those of the record are days; say with --begin when day 0 was",
            path.display()
        );
    }
    Ok(readings)
}

/// A run-up and its day.
fn later_runup(
    path: &Path,
    rotor: &Rotor,
    arguments: &Arguments,
    dates: Dates,
) -> Result<(f64, Vec<Reading>)> {
    let readings = read_runup(path, rotor, arguments, dates)?;
    let first = &readings[0];
    let digits = |name: &String| {
        let from = name.rfind(|c: char| !(c.is_ascii_digit() || c == '.')).map_or(0, |at| at + 1);
        name[from..].parse::<f64>().ok()
    };
    match first.time_d.or_else(|| first.run.as_ref().and_then(digits)) {
        Some(time_d) => Ok((time_d, readings)),
        None => bail!(
            "{}: its day is not known; expected a column time_d, or a run whose name ends with the day",
            path.display()
        ),
    }
}

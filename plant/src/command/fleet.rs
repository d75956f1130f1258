//! `machine` and `fleet`: commands over many machines.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use jiff::Timestamp;
use serde_json::{Value, json};

use super::{Endpoint, on_signal, opened, tell};
use crate::fleet::machines::{StatedMachine, chosen, path_of, state};
use crate::fleet::queue::{Listed, ask, cancel, list};
use crate::fleet::record::whole;
use crate::fleet::server as jobs;
use crate::fleet::summary::{self, ChangeStatus, better};
use crate::fleet::task::FleetCommand;
use crate::fleet::worker::{now_us, short};
use crate::names::counted;
use crate::stream::access::Access;
use crate::stream::server::Server;

const US_A_DAY: f64 = 86_400e6;

#[derive(Debug, Args)]
pub struct MachineArguments {
    /// The file with the monitor's readings
    store: PathBuf,
    /// The monitor, PLANT/BUS/NODE
    monitor: String,
    /// Rotor file of its machine: the drawing or an identified model
    rotor: PathBuf,
}

#[derive(Debug, Args)]
pub struct Fleet {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Request the daily unbalance of each machine
    Track {
        #[command(flatten)]
        asked: Asked,
        /// How `rotor-edge track` follows the record
        #[arg(long, default_value = "adaptive", value_parser = ["fixed", "adaptive", "bayes", "joint"])]
        method: String,
    },
    /// Request a forecast of the unbalance of each machine
    Forecast {
        #[command(flatten)]
        asked: Asked,
        /// Largest permissible static unbalance, g·mm
        #[arg(long, allow_negative_numbers = true)]
        limit: Option<f64>,
    },
    /// Request the missing physical effect of each model
    Diagnose(Asked),
    /// Request a better model of each machine
    Improve(Asked),
    /// Send the better models found by `improve` to their monitors
    Deploy {
        /// The file
        store: PathBuf,
        /// PLANT, PLANT/BUS or PLANT/BUS/NODE; may be given several times [default: every machine with a better model]
        only: Vec<String>,
        /// Trial period of each model, s; it is kept only if its residual is not larger
        #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
        trial: Option<f64>,
    },
    /// Show machines that changed, missing effects, and better models to deploy
    Summary {
        /// The file
        store: PathBuf,
        /// Length of the period, days up to now
        #[arg(long, default_value_t = 7.0)]
        days: f64,
        /// Print one JSON object instead of text
        #[arg(long)]
        json: bool,
    },
    /// Send the jobs of this file to the workers of a NATS server, and collect their answers
    Share {
        /// The file
        store: PathBuf,
        /// The server, nats://HOST:PORT
        #[arg(long = "with", value_parser = Endpoint::of)]
        server: Endpoint,
        #[command(flatten)]
        access: Access,
    },
    /// Show the state and the answer of each job
    Status {
        /// The file
        store: PathBuf,
        /// Print one JSON object instead of text
        #[arg(long)]
        json: bool,
    },
    /// Cancel unfinished jobs
    Cancel {
        /// The file
        store: PathBuf,
        /// Id of a job, as shown by `fleet status`
        #[arg(value_parser = clap::builder::NonEmptyStringValueParser::new())]
        job: String,
    },
}

#[derive(Debug, Args)]
struct Asked {
    /// The file
    store: PathBuf,
    /// PLANT, PLANT/BUS or PLANT/BUS/NODE; may be given several times [default: every machine]
    only: Vec<String>,
    /// Start of the period, such as 2026-03-01T06:00Z [default: the first reading]
    #[arg(long)]
    from: Option<Timestamp>,
    /// End of the period [default: the last reading]
    #[arg(long)]
    to: Option<Timestamp>,
}

pub fn machine(arguments: &MachineArguments) -> Result<()> {
    let MachineArguments { store, monitor, rotor } = arguments;
    let text =
        std::fs::read_to_string(rotor).with_context(|| format!("{}: cannot be read", rotor.display()))?;
    state(&mut opened(store)?, monitor, &text).with_context(|| rotor.display().to_string())?;
    println!(
        "Monitor {monitor} watches the machine of {}.\nNext: rotor-edge-plant fleet track {}",
        rotor.display(),
        store.display()
    );
    Ok(())
}

fn positive(option: &str, stated: Option<f64>) -> Result<Option<f64>> {
    match stated.filter(|value| !(*value > 0.0 && value.is_finite())) {
        Some(value) => bail!("{option} {value}: expected a positive number"),
        None => Ok(stated),
    }
}

/// Asks, lists or cancels.
pub fn fleet(arguments: &Fleet) -> Result<()> {
    match &arguments.action {
        Action::Track { asked, method } => enqueue(FleetCommand::Track, Some(method), asked),
        Action::Forecast { asked, limit } => {
            let limit = positive("--limit", *limit)?.map(|limit| limit.to_string());
            enqueue(FleetCommand::Forecast, limit.as_deref(), asked)
        }
        Action::Diagnose(asked) => enqueue(FleetCommand::Diagnose, None, asked),
        Action::Improve(asked) => enqueue(FleetCommand::Improve, None, asked),
        Action::Deploy { store, only, trial } => deploy(store, only, positive("--trial", *trial)?),
        Action::Summary { store, days, json } => summarize(store, *days, *json),
        Action::Share { store, server, access } => share(store, server, access),
        Action::Status { store, json } => status(&list(opened(store)?.connection())?, *json),
        Action::Cancel { store, job } => {
            match cancel(opened(store)?.connection(), job, now_us())? {
                0 => bail!("{}: job {job} is neither waiting nor running", store.display()),
                jobs => println!("{} cancelled.", counted(jobs, "job")),
            }
            Ok(())
        }
    }
}

fn enqueue(command: FleetCommand, option: Option<&str>, asked: &Asked) -> Result<()> {
    let mut store = opened(&asked.store)?;
    let (mut new, mut old) = (0, 0);
    for machine in chosen(&mut store, &asked.only)? {
        let (first, last) = whole(&mut store, machine.id).with_context(|| path_of(&machine.source))?;
        let from_us = asked.from.map_or(first, Timestamp::as_microsecond);
        let to_us = asked.to.map_or(last, Timestamp::as_microsecond);
        match ask(store.connection(), &machine, (command, option), (from_us, to_us), now_us())? {
            true => new += 1,
            false => old += 1,
        }
    }
    let there = if old > 0 { format!(", {} requested before", counted(old, "job")) } else { String::new() };
    println!(
        "{}{there}.\nNext: rotor-edge-plant worker {} --once",
        counted(new, "new job"),
        asked.store.display()
    );
    Ok(())
}

/// Asks for the deployment of each better model; a machine that was named and has none is an error, and then nothing is asked.
fn deploy(path: &Path, only: &[String], trial_s: Option<f64>) -> Result<()> {
    let mut store = opened(path)?;
    let mut to_deploy = Vec::new();
    for machine in chosen(&mut store, only)? {
        match better(store.connection(), &machine)? {
            Some(found) if found.verdict == "adequate" => {
                to_deploy.push(StatedMachine { rotor: found.model, ..machine });
            }
            Some(found) if !only.is_empty() => {
                bail!(
                    "{}: the better model is not adequate yet but {}",
                    path_of(&machine.source),
                    found.verdict
                )
            }
            None if !only.is_empty() => {
                bail!(
                    "{}: no better model of it was found; fleet improve looks for one",
                    path_of(&machine.source)
                )
            }
            _ => {}
        }
    }
    let (mut new, now_us) = (0, now_us());
    let option = trial_s.map(|seconds| seconds.to_string());
    for machine in &to_deploy {
        // each time anew: what was deployed before may have been replaced since
        new += usize::from(ask(
            store.connection(),
            machine,
            (FleetCommand::Deploy, option.as_deref()),
            (now_us, now_us),
            now_us,
        )?);
    }
    println!(
        "{} to deploy.\nNext, where the bus and the keys are: rotor-edge-plant worker {} --plant PLANT --bus NAME=BUS --keys FOLDER --once",
        counted(new, "model"),
        path.display()
    );
    Ok(())
}

fn summarize(path: &Path, days: f64, as_json: bool) -> Result<()> {
    let from_us = now_us() - (days * US_A_DAY) as i64;
    let lines = summary::all(opened(path)?.connection(), from_us)?;
    if as_json {
        println!("{}", serde_json::to_string_pretty(&json!({ "days": days, "machines": lines }))?);
        return Ok(());
    }
    for (change, title) in [
        (ChangeStatus::Changed, "changed"),
        (ChangeStatus::CannotTell, "no usable data"),
        (ChangeStatus::NoFlag, "no flag"),
    ] {
        let of_change: Vec<_> = lines.iter().filter(|line| line.change == change).collect();
        if !of_change.is_empty() {
            println!("{}, {} of {} monitors in {days} days:", title, of_change.len(), lines.len());
            for line in of_change {
                println!(
                    "  {:<24} {}\n  {:<24} missing: {}",
                    path_of(&line.source),
                    line.why,
                    "",
                    line.missing
                );
            }
            println!();
        }
    }
    match lines.iter().filter(|line| line.is_to_deploy).count() {
        0 => println!("There is no better model to deploy."),
        better => {
            println!(
                "{} to deploy.\nNext: rotor-edge-plant fleet deploy {}",
                counted(better, "better model"),
                path.display()
            )
        }
    }
    Ok(())
}

fn share(path: &Path, server: &Endpoint, access: &Access) -> Result<()> {
    let Endpoint::Server(address) = server else { bail!("--with: expected nats://HOST:PORT") };
    let stop = on_signal()?;
    drop(opened(path)?);
    let server = Server::connect(address, access)?;
    tell(&format!("Jobs of {} are shared at {}; Ctrl-C ends it.", path.display(), server.name));
    let ended = jobs::share(&server, path, &stop, tell)?;
    println!(
        "{} done.\nNext: rotor-edge-plant fleet status {}",
        counted(ended as usize, "job"),
        path.display()
    );
    Ok(())
}

fn status(jobs: &[Listed], as_json: bool) -> Result<()> {
    if as_json {
        let parsed = |job: &Listed| {
            let mut job = json!(job);
            // an answer is an object itself
            if let Some(object) =
                job["answer"].as_str().and_then(|text| serde_json::from_str::<Value>(text).ok())
            {
                job["answer"] = object;
            }
            job
        };
        let jobs: Vec<Value> = jobs.iter().map(parsed).collect();
        println!("{}", serde_json::to_string_pretty(&json!({ "jobs": jobs }))?);
        return Ok(());
    }
    for state in ["waiting", "running", "done", "failed", "aside", "cancelled"] {
        let number = jobs.iter().filter(|job| job.state == state).count();
        if number > 0 {
            println!("{number:>6} {state}");
        }
    }
    println!("\n{:<11} {:<9} {:<24} {:<10} {:>8}  answer", "job", "command", "monitor", "state", "time");
    for job in jobs {
        let time = job.seconds.map_or("–".into(), |s| format!("{s:.1} s"));
        let (id, command, monitor) = (short(&job.id), &job.command, path_of(&job.source));
        println!("{id:<11} {command:<9} {monitor:<24} {:<10} {time:>8}  {}", job.state, job.in_a_word());
    }
    Ok(())
}

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
use crate::stream::access::Access;
use crate::stream::server::Server;

const US_A_DAY: f64 = 86_400e6;

#[derive(Debug, Args)]
pub struct MachineArguments {
    /// The file with the monitor's readings
    store: PathBuf,
    /// The monitor, PLANT/BUS/NODE
    monitor: String,
    /// The drawing of its machine, or the model that was found
    rotor: PathBuf,
}

#[derive(Debug, Args)]
pub struct Fleet {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Ask for the unbalance of each machine from day to day
    Track {
        #[command(flatten)]
        asked: Asked,
        /// How `rotor-edge track` follows the record
        #[arg(long, default_value = "adaptive", value_parser = ["fixed", "adaptive", "bayes", "joint"])]
        method: String,
    },
    /// Ask where the unbalance of each machine is going
    Forecast {
        #[command(flatten)]
        asked: Asked,
        /// Static unbalance at which something has to be done, g·mm
        #[arg(long, allow_negative_numbers = true)]
        limit: Option<f64>,
    },
    /// Ask which physical effect is missing in each model
    Diagnose(Asked),
    /// Ask for a better model of each machine
    Improve(Asked),
    /// Send the better models that `improve` found to their monitors
    Deploy {
        /// The file
        store: PathBuf,
        /// PLANT, PLANT/BUS or PLANT/BUS/NODE, several times if need be [default: every machine with a better model]
        only: Vec<String>,
        /// Try each for so many seconds and keep it only if its residual is no worse
        #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
        trial: Option<f64>,
    },
    /// Which machines changed, what is missing in each model, which models to deploy
    Summary {
        /// The file
        store: PathBuf,
        /// Days up to now that are looked at
        #[arg(long, default_value_t = 7.0)]
        days: f64,
        /// Print one JSON object instead of text
        #[arg(long)]
        json: bool,
    },
    /// Share the jobs of this file with the workers of a server, and bring their answers home
    Share {
        /// The file
        store: PathBuf,
        /// The server, nats://HOST:PORT
        #[arg(long = "with", value_parser = Endpoint::of)]
        server: Endpoint,
        #[command(flatten)]
        access: Access,
    },
    /// What became of the jobs
    Status {
        /// The file
        store: PathBuf,
        /// Print one JSON object instead of text
        #[arg(long)]
        json: bool,
    },
    /// Cancel jobs that are not ended
    Cancel {
        /// The file
        store: PathBuf,
        /// Id of a job as `fleet status` shows it
        #[arg(value_parser = clap::builder::NonEmptyStringValueParser::new())]
        job: String,
    },
}

#[derive(Debug, Args)]
struct Asked {
    /// The file
    store: PathBuf,
    /// PLANT, PLANT/BUS or PLANT/BUS/NODE, several times if need be [default: every machine]
    only: Vec<String>,
    /// Readings from this moment on, as 2026-03-01T06:00Z [default: the first]
    #[arg(long)]
    from: Option<Timestamp>,
    /// Readings up to this moment [default: the last]
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
                0 => bail!("{}: no job {job} waits or runs", store.display()),
                jobs => println!("{jobs} cancelled."),
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
    let there = if old > 0 { format!(", {old} were asked for before") } else { String::new() };
    println!("{new} new jobs{there}.\nNext: rotor-edge-plant worker {} --once", asked.store.display());
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
        "{new} models to deploy.\nNext, where the bus and the keys are: rotor-edge-plant worker {} --plant PLANT --bus NAME=BUS --keys FOLDER --once",
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
        (ChangeStatus::CannotTell, "cannot be told"),
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
        0 => println!("No better model waits to be deployed."),
        better => {
            println!("{better} better models wait.\nNext: rotor-edge-plant fleet deploy {}", path.display())
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
    println!("{ended} jobs ended.\nNext: rotor-edge-plant fleet status {}", path.display());
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

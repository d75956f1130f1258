//! `machine`, `fleet` and `worker`: commands over many machines.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use jiff::Timestamp;
use serde_json::{Value, json};

use super::{on_signal, tell};
use crate::fleet::machines::{chosen, path_of, state};
use crate::fleet::queue::{Command, Listed, ask, cancel, list};
use crate::fleet::record::whole;
use crate::fleet::worker::{self, short};
use crate::store::Store;

#[derive(Debug, Args)]
pub struct Machine {
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
    Track(Asked),
    /// Ask which physical effect is missing in each model
    Diagnose(Asked),
    /// Ask for a better model of each machine
    Improve(Asked),
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

#[derive(Debug, Args)]
pub struct Worker {
    /// The file
    store: PathBuf,
    /// End when nothing is left to do
    #[arg(long)]
    once: bool,
}

/// A store that is there.
fn opened(store: &Path) -> Result<Store> {
    if !store.is_file() {
        bail!("{}: is not there; a gateway or a collection makes it", store.display());
    }
    Store::open(store)
}

/// States a machine.
pub fn machine(arguments: &Machine) -> Result<()> {
    let Machine { store, monitor, rotor } = arguments;
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

/// Asks, lists or cancels.
pub fn fleet(arguments: &Fleet) -> Result<()> {
    match &arguments.action {
        Action::Track(asked) => enqueue(Command::Track, asked),
        Action::Diagnose(asked) => enqueue(Command::Diagnose, asked),
        Action::Improve(asked) => enqueue(Command::Improve, asked),
        Action::Status { store, json } => status(&list(opened(store)?.connection())?, *json),
        Action::Cancel { store, job } => {
            match cancel(opened(store)?.connection(), job, Timestamp::now().as_microsecond())? {
                0 => bail!("{}: no job {job} waits or runs", store.display()),
                jobs => println!("{jobs} cancelled."),
            }
            Ok(())
        }
    }
}

fn enqueue(command: Command, asked: &Asked) -> Result<()> {
    let mut store = opened(&asked.store)?;
    let (mut new, mut old) = (0, 0);
    for machine in chosen(&mut store, &asked.only)? {
        let (first, last) = whole(&mut store, machine.id).with_context(|| path_of(&machine.source))?;
        let from_us = asked.from.map_or(first, Timestamp::as_microsecond);
        let to_us = asked.to.map_or(last, Timestamp::as_microsecond);
        let now_us = Timestamp::now().as_microsecond();
        match ask(store.connection(), &machine, command, (from_us, to_us), now_us)? {
            true => new += 1,
            false => old += 1,
        }
    }
    let there = if old > 0 { format!(", {old} were asked for before") } else { String::new() };
    println!("{new} new jobs{there}.\nNext: rotor-edge-plant worker {} --once", asked.store.display());
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
        println!("{id:<11} {command:<9} {monitor:<24} {:<10} {time:>8}  {}", job.state, in_a_word(job));
    }
    Ok(())
}

/// What a person wants to know of an answer first.
fn in_a_word(job: &Listed) -> String {
    let text = job.answer.as_deref().unwrap_or_default();
    let Ok(answer) = serde_json::from_str::<Value>(text) else { return text.into() };
    let verdict = answer["verdict"].as_str();
    match job.command.as_str() {
        "track" => {
            let number = |key: &str| answer[key].as_array().map_or(0, Vec::len);
            format!("{} days, {} flags", number("estimates"), number("flags"))
        }
        "improve" => {
            let added: Vec<&str> = answer["steps"]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(|s| s["effect"].as_str())
                .collect();
            format!(
                "{}; added: {}",
                verdict.unwrap_or("–"),
                if added.is_empty() { "nothing".into() } else { added.join(", ") }
            )
        }
        _ => match answer["candidates"][0]["effect"].as_str() {
            Some(effect) if verdict == Some("missing") => format!("missing: {effect}"),
            _ => verdict.unwrap_or("–").into(),
        },
    }
}

/// Works on jobs.
pub fn work(arguments: &Worker) -> Result<()> {
    let stop = on_signal()?;
    drop(opened(&arguments.store)?);
    let ended = worker::run(&arguments.store, arguments.once, &stop, tell)?;
    println!("{ended} jobs ended.\nNext: rotor-edge-plant fleet status {}", arguments.store.display());
    Ok(())
}

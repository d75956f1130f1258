//! Takes jobs and does them with the desk's own commands.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};
use jiff::Timestamp;
use rotor_edge::command::{Listener, object};
use rotor_edge_desktop::machine::rotor_file;

use super::queue::{self, Command, Ended, Job};
use super::record::{Period, csv};
use crate::store::Store;

/// Between two looks for a job.
const LOOK: Duration = Duration::from_millis(300);
/// Between two renewals of a lease.
const RENEW: Duration = Duration::from_micros(queue::LEASE_US as u64 / 6);
/// `track` follows a machine from day to day.
const US_A_DAY: i64 = 86_400_000_000;

/// Works until `stop` rises, or until nothing is left to do if it is `once`; how many jobs it ended.
///
/// # Errors
/// If the store cannot be read or takes nothing.
pub fn run(store: &Path, is_once: bool, stop: &AtomicBool, tell: fn(&str)) -> Result<u64> {
    let mut queue = Store::open(store)?;
    let worker = format!("{}-{}", std::process::id(), Timestamp::now().as_microsecond());
    let mut ended = 0;
    while !stop.load(Ordering::Relaxed) {
        let Some(job) = queue::take(queue.connection(), &worker, now_us())? else {
            if is_once && !queue::is_busy(queue.connection())? {
                break;
            }
            std::thread::sleep(LOOK);
            continue;
        };
        let answer = while_renewing(store, &worker, &job, || done(&mut queue, &job))?;
        if queue::end(queue.connection(), &worker, &job.id, &answer, now_us())? {
            ended += 1;
        } else {
            tell(&format!(
                "job {} was cancelled or is another worker's by now; its answer is dropped",
                short(&job.id)
            ));
        }
    }
    Ok(ended)
}

/// The first digits of an id, enough for people.
pub fn short(id: &str) -> &str {
    id.get(..10).unwrap_or(id)
}

fn now_us() -> i64 {
    Timestamp::now().as_microsecond()
}

/// Does the work while a thread renews the lease.
fn while_renewing<T>(store: &Path, worker: &str, job: &Job, work: impl FnOnce() -> T) -> Result<T> {
    let mut renewing = Store::open(store)?;
    let (over, is_over) = std::sync::mpsc::channel::<()>();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            while is_over.recv_timeout(RENEW) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                // a store that is busy for long costs the lease, and the job is done again
                let _ = queue::renew(renewing.connection(), worker, &job.id, now_us());
            }
        });
        let done = work();
        drop(over);
        Ok(done)
    })
}

fn done(store: &mut Store, job: &Job) -> Ended {
    let tried = catch_unwind(AssertUnwindSafe(|| answer(store, job)));
    match tried {
        Ok(Ok((answer, model))) => Ended::Done(answer, model),
        Ok(Err(error)) => Ended::Failed(format!("{error:#}")),
        Err(_) => Ended::Failed("it panicked, which is a fault of the program".into()),
    }
}

/// What the command says of the machine's readings, and what it wrote.
fn answer(store: &mut Store, job: &Job) -> Result<(String, Option<String>)> {
    let folder = tempfile::tempdir().context("a folder for the job")?;
    let file = |name: &str| folder.path().join(name);
    std::fs::write(file("rotor.toml"), &job.rotor)?;
    let rotor = rotor_file::read(&file("rotor.toml"))?;
    let probes: Vec<String> = rotor.probe.iter().map(|probe| probe.name.clone()).collect();
    let every_us = if job.command == Command::Track { US_A_DAY } else { 0 };
    let (from_us, to_us) = job.period_us;
    std::fs::write(file("data.csv"), csv(store, job.source, Period { from_us, to_us, every_us }, &probes)?)?;
    let mut words: Vec<OsString> =
        vec![job.command.name().into(), file("rotor.toml").into(), file("data.csv").into()];
    if job.command == Command::Improve {
        words.extend(["-o".into(), file("better.toml").into()]);
    }
    words.push("--json".into());
    let answer = object(words, Listener::Program(&|_, _| {}))?;
    let model = (job.command == Command::Improve).then(|| std::fs::read_to_string(file("better.toml")));
    Ok((answer, model.transpose()?))
}

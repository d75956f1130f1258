//! Takes jobs of a store and does them.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Result;
use indicatif::ProgressBar;
use jiff::Timestamp;
use rotor_edge::command::Listener;
use rotor_edge_desktop::rotor_file;

use super::machines::path_of;
use super::queue::{self, Job};
use super::record::{Period, csv};
use super::task::{Ended, FleetCommand, Hands, Task};
use crate::item::Source;
use crate::store::Store;

/// Between two looks for a job.
const LOOK: Duration = Duration::from_millis(300);
/// Between two renewals of a lease.
pub const RENEW: Duration = Duration::from_micros(queue::LEASE_US as u64 / 6);
/// `track` follows a machine from day to day.
const US_A_DAY: i64 = 86_400_000_000;

/// Works until `stop` rises, or until nothing is left to do if it is `once`; how many jobs it ended.
///
/// # Errors
/// If the store cannot be read or takes nothing.
pub fn run(store: &Path, hands: &Hands, is_once: bool, stop: &AtomicBool, tell: fn(&str)) -> Result<u64> {
    let mut queue = Store::open(store)?;
    let worker = format!("{}-{}", std::process::id(), now_us());
    let (shown, mut ended) = (Shown::new(), 0);
    while !stop.load(Ordering::Relaxed) {
        let Some(job) = queue::take(queue.connection(), &worker, hands, now_us())? else {
            if is_once && !queue::is_busy(queue.connection(), hands)? {
                break;
            }
            std::thread::sleep(LOOK);
            continue;
        };
        shown.doing(ended, job.command, &job.source);
        let answer = while_renewing(store, &worker, &job, || match task_of(&mut queue, &job) {
            Ok(task) => task.done(hands),
            Err(error) => Ended::Failed(format!("{error:#}")),
        })?;
        if queue::end(queue.connection(), &worker, &job.id, &answer, now_us())? {
            ended += 1;
        } else {
            shown.while_hidden(|| tell(&dropped(&job.id)));
        }
        shown.waiting(ended);
    }
    Ok(ended)
}

/// What a person sees of a worker, on a terminal alone.
pub struct Shown(ProgressBar);

impl Shown {
    /// Of a worker that has just begun.
    pub fn new() -> Self {
        let shown = Self(Listener::Terminal.spinner(""));
        shown.waiting(0);
        shown
    }

    /// That it looks for a job.
    pub fn waiting(&self, ended: u64) {
        self.0.set_message(format!("{ended} jobs done; waiting for one"));
    }

    pub fn doing(&self, ended: u64, command: FleetCommand, source: &Source) {
        self.0.reset_elapsed();
        self.0.set_message(format!("{ended} jobs done; {} of {}", command.name(), path_of(source)));
    }

    /// Says something where the line was.
    pub fn while_hidden(&self, say: impl FnOnce()) {
        self.0.suspend(say);
    }
}

impl Default for Shown {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// What a person is told of an answer that nobody waits for.
pub fn dropped(id: &str) -> String {
    format!("job {} was cancelled or is another worker's by now; its answer is dropped", short(id))
}

/// The first digits of an id, enough for people.
pub fn short(id: &str) -> &str {
    id.get(..10).unwrap_or(id)
}

/// µs since 1970.
pub fn now_us() -> i64 {
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

/// A job with the readings that it is about.
///
/// # Errors
/// One sentence if there are none.
pub fn task_of(store: &mut Store, job: &Job) -> Result<Task> {
    let mut data = String::new();
    if job.command != FleetCommand::Deploy {
        let folder = tempfile::tempdir()?;
        let drawing = folder.path().join("rotor.toml");
        std::fs::write(&drawing, &job.rotor)?;
        let probes: Vec<String> =
            rotor_file::read(&drawing)?.probe.iter().map(|probe| probe.name.clone()).collect();
        let every_us = if job.command.is_daily() { US_A_DAY } else { 0 };
        let (from_us, to_us) = job.period_us;
        data = String::from_utf8(csv(store, job.source_id, Period { from_us, to_us, every_us }, &probes)?)?;
    }
    Ok(Task {
        id: job.id.clone(),
        version: job.version.clone(),
        command: job.command,
        option: job.option.clone(),
        source: job.source.clone(),
        rotor: job.rotor.clone(),
        data,
    })
}

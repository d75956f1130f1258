//! Jobs in a store. Whoever takes one has it for the time of a lease and renews that while it works; when it is killed, the
//! lease runs out and the job goes to another. An answer counts only while the lease does, so each job has one.

use anyhow::Result;
use rusqlite::{Connection, OptionalExtension as _, TransactionBehavior};
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::machines::Machine;
use crate::item::Source;

/// How long a worker may be silent, µs.
pub const LEASE_US: i64 = 9_000_000;
/// A job that was begun so often and never ended is set aside.
pub const MOST_TRIES: u32 = 3;

/// A command of the desk that a fleet is run through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Command {
    /// The unbalance over the days of the period.
    Track,
    /// Which physical effect is missing.
    Diagnose,
    /// Add effects until the model is adequate.
    Improve,
}

impl Command {
    /// As the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Track => "track",
            Self::Diagnose => "diagnose",
            Self::Improve => "improve",
        }
    }

    fn of(name: &str) -> Option<Self> {
        [Self::Track, Self::Diagnose, Self::Improve].into_iter().find(|command| command.name() == name)
    }
}

/// What there is to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    /// Made of everything else and of the version of the program.
    pub id: String,
    /// The command.
    pub command: Command,
    /// Number of the monitor's source in the store.
    pub source: i64,
    /// First and last moment of the readings, µs since 1970.
    pub period_us: (i64, i64),
    /// The drawing.
    pub rotor: String,
}

/// What became of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// It has an answer, a JSON object, and perhaps a better drawing.
    Done(String, Option<String>),
    /// It cannot be done, for a reason in one sentence.
    Failed(String),
}

/// A job as `fleet status` lists it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Listed {
    /// Its id.
    pub id: String,
    /// Its command.
    pub command: String,
    /// Its machine's monitor.
    #[serde(flatten)]
    pub source: Source,
    /// waiting, running, done, failed, aside or cancelled.
    pub state: String,
    /// How often it was begun.
    pub tries: u32,
    /// Time from its last begin to its end, s.
    pub seconds: Option<f64>,
    /// A JSON object, or why there is none.
    pub answer: Option<String>,
    /// The better drawing, of improve.
    pub model: Option<String>,
}

/// Asks for a command over a period of a machine; false if the same was asked for before.
///
/// # Errors
/// If the store takes nothing.
pub fn ask(
    connection: &Connection,
    machine: &Machine,
    command: Command,
    period_us: (i64, i64),
    now_us: i64,
) -> Result<bool> {
    let version = env!("CARGO_PKG_VERSION");
    let parts = [
        command.name().into(),
        machine.id.to_string(),
        period_us.0.to_string(),
        period_us.1.to_string(),
        version.to_string(),
        machine.rotor.clone(),
    ];
    let id: String = Sha256::digest(parts.join("\0")).iter().map(|byte| format!("{byte:02x}")).collect();
    let sql = "INSERT OR IGNORE INTO job (id, command, source, from_us, to_us, rotor, version, state, asked_us) \
               VALUES (?, ?, ?, ?, ?, ?, ?, 'waiting', ?)";
    let row = (id, command.name(), machine.id, period_us.0, period_us.1, &machine.rotor, version, now_us);
    Ok(connection.execute(sql, row)? > 0)
}

/// Takes the job that waits longest, or whose worker is silent. One that was begun too often is set aside first: it may be
/// what kills workers.
///
/// # Errors
/// If the store cannot be read or takes nothing.
pub fn take(connection: &mut Connection, worker: &str, now_us: i64) -> Result<Option<Job>> {
    let step = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    step.execute(
        "UPDATE job SET state = 'aside', ended_us = ?1, answer = 'it was begun ' || tries || ' times and never ended' \
         WHERE state = 'running' AND lease_us < ?1 AND tries >= ?2",
        (now_us, MOST_TRIES),
    )?;
    let sql = "SELECT id, command, source, from_us, to_us, rotor FROM job \
               WHERE state = 'waiting' OR (state = 'running' AND lease_us < ?) ORDER BY asked_us, id LIMIT 1";
    let row = |row: &rusqlite::Row| {
        let name: String = row.get(1)?;
        let command = Command::of(&name).ok_or(rusqlite::Error::InvalidQuery)?;
        let period_us = (row.get(3)?, row.get(4)?);
        Ok(Job { id: row.get(0)?, command, source: row.get(2)?, period_us, rotor: row.get(5)? })
    };
    let job = step.query_row(sql, [now_us], row).optional()?;
    if let Some(job) = &job {
        step.execute(
            "UPDATE job SET state = 'running', tries = tries + 1, worker = ?, lease_us = ?, begun_us = ? WHERE id = ?",
            (worker, now_us + LEASE_US, now_us, &job.id),
        )?;
    }
    step.commit()?;
    Ok(job)
}

/// Goes on with a job; false if it is not this worker's any more.
///
/// # Errors
/// If the store takes nothing.
pub fn renew(connection: &Connection, worker: &str, id: &str, now_us: i64) -> Result<bool> {
    let sql = "UPDATE job SET lease_us = ? WHERE id = ? AND worker = ? AND state = 'running'";
    Ok(connection.execute(sql, (now_us + LEASE_US, id, worker))? > 0)
}

/// Ends a job; false if it is not this worker's any more, and then its answer is dropped.
///
/// # Errors
/// If the store takes nothing.
pub fn end(connection: &Connection, worker: &str, id: &str, ended: &Ended, now_us: i64) -> Result<bool> {
    let (state, answer, model) = match ended {
        Ended::Done(answer, model) => ("done", answer, model.as_ref()),
        Ended::Failed(why) => ("failed", why, None),
    };
    let sql = "UPDATE job SET state = ?, answer = ?, model = ?, ended_us = ? WHERE id = ? AND worker = ? AND state = 'running'";
    Ok(connection.execute(sql, (state, answer, model, now_us, id, worker))? > 0)
}

/// Cancels jobs that are not ended and whose id begins so; how many.
///
/// # Errors
/// If the store takes nothing.
pub fn cancel(connection: &Connection, id: &str, now_us: i64) -> Result<usize> {
    let sql = "UPDATE job SET state = 'cancelled', ended_us = ?1 \
               WHERE substr(id, 1, length(?2)) = ?2 AND state IN ('waiting', 'running')";
    Ok(connection.execute(sql, (now_us, id))?)
}

/// Whether a job waits or is worked on.
///
/// # Errors
/// If the store cannot be read.
pub fn is_busy(connection: &Connection) -> Result<bool> {
    let sql = "SELECT EXISTS (SELECT 1 FROM job WHERE state IN ('waiting', 'running'))";
    Ok(connection.query_row(sql, [], |row| row.get(0))?)
}

/// All jobs, in the order in which they were asked for.
///
/// # Errors
/// If the store cannot be read.
pub fn list(connection: &Connection) -> Result<Vec<Listed>> {
    let mut statement = connection.prepare(
        "SELECT j.id, j.command, s.plant, s.bus, s.node, j.state, j.tries, j.ended_us - j.begun_us, j.answer, j.model \
         FROM job j JOIN source s ON s.id = j.source ORDER BY j.asked_us, j.id",
    )?;
    let row = |row: &rusqlite::Row| {
        Ok(Listed {
            id: row.get(0)?,
            command: row.get(1)?,
            source: Source { plant: row.get(2)?, bus: row.get(3)?, node: row.get(4)? },
            state: row.get(5)?,
            tries: row.get(6)?,
            seconds: row.get::<_, Option<i64>>(7)?.map(|us| us as f64 * 1e-6),
            answer: row.get(8)?,
            model: row.get(9)?,
        })
    };
    Ok(statement.query_map([], row)?.collect::<rusqlite::Result<_>>()?)
}

#[cfg(test)]
mod tests {
    use crate::store::Store;

    use super::*;

    const PERIOD_US: (i64, i64) = (0, 86_400_000_000);

    /// A store with jobs over so many machines, asked for one after the other.
    fn queue(machines: u8) -> (tempfile::TempDir, Store) {
        let folder = tempfile::tempdir().unwrap();
        let mut store = Store::open(&folder.path().join("plant.db")).unwrap();
        for node in 0..machines {
            let source = Source { plant: "north".into(), bus: "hall1".into(), node };
            let sql = "INSERT INTO source (plant, bus, node) VALUES ('north', 'hall1', ?)";
            store.connection().execute(sql, [node]).unwrap();
            let machine = Machine { id: i64::from(node) + 1, source, rotor: "drawing".into() };
            let asked =
                ask(store.connection(), &machine, Command::Track, PERIOD_US, i64::from(node)).unwrap();
            assert!(asked);
            let again = ask(store.connection(), &machine, Command::Track, PERIOD_US, 99).unwrap();
            assert!(!again, "the same job twice is one");
            assert!(
                ask(store.connection(), &machine, Command::Track, (0, 1), 1_000).unwrap(),
                "another period"
            );
            let newest = list(store.connection()).unwrap().pop().unwrap();
            cancel(store.connection(), &newest.id, 0).unwrap();
        }
        (folder, store)
    }

    fn states(store: &mut Store) -> Vec<(String, u32)> {
        let jobs = list(store.connection()).unwrap();
        jobs.into_iter().filter(|job| job.state != "cancelled").map(|job| (job.state, job.tries)).collect()
    }

    #[test]
    fn a_job_of_a_silent_worker_goes_to_another_and_its_answer_counts_once() {
        let (_folder, mut store) = queue(1);
        let queue = store.connection();
        let job = take(queue, "a", 100).unwrap().unwrap();
        assert_eq!(take(queue, "b", 100 + LEASE_US).unwrap(), None, "the lease lasts");
        assert!(renew(queue, "a", &job.id, 200).unwrap());
        assert_eq!(take(queue, "b", 200 + LEASE_US).unwrap(), None, "renewed");
        assert_eq!(take(queue, "b", 201 + LEASE_US).unwrap(), Some(job.clone()));
        assert!(!renew(queue, "a", &job.id, 300).unwrap());
        let done = Ended::Done("{}".into(), None);
        assert!(!end(queue, "a", &job.id, &done, 400).unwrap(), "it is b's");
        assert!(end(queue, "b", &job.id, &done, 400).unwrap());
        assert!(!end(queue, "b", &job.id, &done, 500).unwrap(), "once");
        assert_eq!(states(&mut store), [("done".to_string(), 2)]);
    }

    #[test]
    fn a_job_that_kills_its_workers_is_set_aside_and_the_others_are_done() {
        let (_folder, mut store) = queue(2);
        let queue = store.connection();
        let bad = take(queue, "a", 0).unwrap().unwrap();
        let good = take(queue, "b", 0).unwrap().unwrap();
        assert!(end(queue, "b", &good.id, &Ended::Failed("no reading".into()), 1).unwrap());
        for try_ in 1..i64::from(MOST_TRIES) {
            assert_eq!(take(queue, "c", try_ * 2 * LEASE_US).unwrap().unwrap().id, bad.id);
        }
        assert!(is_busy(queue).unwrap());
        assert_eq!(take(queue, "c", 99 * LEASE_US).unwrap(), None);
        assert!(!is_busy(queue).unwrap());
        assert_eq!(states(&mut store), [("aside".to_string(), 3), ("failed".to_string(), 1)]);
    }

    #[test]
    fn what_is_cancelled_is_not_begun_and_not_ended() {
        let (_folder, mut store) = queue(2);
        let queue = store.connection();
        let running = take(queue, "a", 0).unwrap().unwrap();
        assert_eq!(cancel(queue, "", 5).unwrap(), 2);
        assert!(!end(queue, "a", &running.id, &Ended::Done("{}".into(), None), 6).unwrap());
        assert_eq!(take(queue, "a", 7).unwrap(), None);
    }
}

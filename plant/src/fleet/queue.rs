//! Jobs in a store. Whoever takes one has it for the time of a lease and renews that while it works; when it is killed, the
//! lease runs out and the job goes to another. An answer counts only while the lease does, so each job has one.

use anyhow::Result;
use rusqlite::{Connection, TransactionBehavior};
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::machines::StatedMachine;
use super::summary::in_a_word;
use super::task::{Ended, FleetCommand, Hands, squeezed};
use crate::item::Source;

/// How long a worker may be silent, µs.
pub const LEASE_US: i64 = 9_000_000;
/// A job that was begun so often and never ended is set aside.
pub const MOST_TRIES: u32 = 3;
/// The version whose answers this program gives.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A job as the store has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    /// Made of everything else and of the version of the program.
    pub id: String,
    pub command: FleetCommand,
    /// What is said to it, as [`Task::option`](super::task::Task::option).
    pub option: Option<String>,
    /// Number of the monitor's source in the store.
    pub source_id: i64,
    pub source: Source,
    /// First and last moment of the readings, µs since 1970.
    pub period_us: (i64, i64),
    pub rotor: String,
    /// Version of the program whose answer is asked for.
    pub version: String,
    /// When it was asked for last, µs since 1970.
    pub asked_us: i64,
}

impl Job {
    /// Whether it is for these hands, and for a program of this version: another one's answer may be another. A model is the
    /// same whoever sends it.
    fn is_for(&self, hands: &Hands) -> bool {
        hands.takes(self.command, &self.source)
            && (self.command == FleetCommand::Deploy || self.version == VERSION)
    }
}

/// A job as it is listed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Listed {
    pub id: String,
    pub command: String,
    #[serde(flatten)]
    pub source: Source,
    /// waiting, running, done, failed, aside or cancelled.
    pub state: String,
    /// Version of the program whose answer is asked for.
    pub version: String,
    /// How often it was begun.
    pub tries: u32,
    /// Time from its last begin to its end, s.
    pub seconds: Option<f64>,
    /// A JSON object, or why there is none.
    pub answer: Option<String>,
    /// The better drawing, of improve.
    pub model: Option<String>,
    /// Whether its page is kept: it is the newest of its command and machine.
    pub has_report: bool,
}

/// Asks for a command over a period of a machine; false if the same was asked for before, and is done or will be. What has no
/// answer and will get none is begun anew.
///
/// # Errors
/// If the store takes nothing.
pub fn ask(
    connection: &Connection,
    machine: &StatedMachine,
    (command, option): (FleetCommand, Option<&str>),
    period_us: (i64, i64),
    now_us: i64,
) -> Result<bool> {
    let parts = [
        command.name().into(),
        machine.id.to_string(),
        period_us.0.to_string(),
        period_us.1.to_string(),
        VERSION.into(),
        machine.rotor.clone(),
        option.unwrap_or_default().into(),
    ];
    let id: String = Sha256::digest(parts.join("\0")).iter().map(|byte| format!("{byte:02x}")).collect();
    let sql = "INSERT INTO job (id, command, source, from_us, to_us, rotor, version, state, asked_us, option) \
               VALUES (?, ?, ?, ?, ?, ?, ?, 'waiting', ?, ?) \
               ON CONFLICT (id) DO UPDATE SET state = 'waiting', asked_us = excluded.asked_us, tries = 0, worker = NULL, \
               lease_us = NULL, begun_us = NULL, ended_us = NULL, answer = NULL WHERE state IN ('failed', 'aside', 'cancelled')";
    let row =
        (id, command.name(), machine.id, period_us.0, period_us.1, &machine.rotor, VERSION, now_us, option);
    Ok(connection.execute(sql, row)? > 0)
}

/// Of a row of `job j JOIN source s`.
pub(super) const COLUMNS: &str = "j.id, j.command, j.option, j.source, j.from_us, j.to_us, j.rotor, s.plant, s.bus, s.node, j.version, j.asked_us";

pub(super) fn job(row: &rusqlite::Row) -> rusqlite::Result<Job> {
    let name: String = row.get(1)?;
    Ok(Job {
        id: row.get(0)?,
        command: FleetCommand::of(&name).ok_or(rusqlite::Error::InvalidQuery)?,
        option: row.get(2)?,
        source_id: row.get(3)?,
        period_us: (row.get(4)?, row.get(5)?),
        rotor: row.get(6)?,
        source: Source { plant: row.get(7)?, bus: row.get(8)?, node: row.get(9)? },
        version: row.get(10)?,
        asked_us: row.get(11)?,
    })
}

/// Takes the job for these hands whose worker is silent, or else the one that waits longest. One that was begun too often is
/// set aside first: it may be what kills workers.
///
/// # Errors
/// If the store cannot be read or takes nothing.
pub fn take(connection: &mut Connection, worker: &str, hands: &Hands, now_us: i64) -> Result<Option<Job>> {
    let step = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    step.execute(
        "UPDATE job SET state = 'aside', ended_us = ?1, answer = 'it was begun ' || tries || ' times and never ended' \
         WHERE state = 'running' AND lease_us < ?1 AND tries >= ?2",
        (now_us, MOST_TRIES),
    )?;
    // by the index, so that a thousand jobs that wait cost no more than one
    let taken = match first(&step, "j.state = 'running' AND j.lease_us < ?", [now_us], hands)? {
        Some(job) => Some(job),
        None => first(&step, "j.state = 'waiting'", [], hands)?,
    };
    if let Some(job) = &taken {
        step.execute(
            "UPDATE job SET state = 'running', tries = tries + 1, worker = ?, lease_us = ?, begun_us = ? WHERE id = ?",
            (worker, now_us + LEASE_US, now_us, &job.id),
        )?;
    }
    step.commit()?;
    Ok(taken)
}

/// The first of these jobs that is for these hands.
fn first(
    connection: &Connection,
    which: &str,
    parameters: impl rusqlite::Params,
    hands: &Hands,
) -> Result<Option<Job>> {
    let sql = format!(
        "SELECT {COLUMNS} FROM job j JOIN source s ON s.id = j.source WHERE {which} ORDER BY j.asked_us, j.id"
    );
    let mut statement = connection.prepare_cached(&sql)?;
    let mut all = statement.query_map(parameters, job)?;
    Ok(all.find(|job| job.as_ref().is_ok_and(|job| job.is_for(hands))).transpose()?)
}

/// Goes on with a job; false if it is not this worker's any more.
///
/// # Errors
/// If the store takes nothing.
pub fn renew(connection: &Connection, worker: &str, id: &str, now_us: i64) -> Result<bool> {
    let sql = "UPDATE job SET lease_us = ? WHERE id = ? AND worker = ? AND state = 'running'";
    Ok(connection.execute(sql, (now_us + LEASE_US, id, worker))? > 0)
}

/// Ends a job; false if it is not this worker's any more, and then its answer is dropped. A model that was deployed is its
/// machine's drawing from now on.
///
/// # Errors
/// If the store takes nothing.
pub fn end(connection: &mut Connection, worker: &str, id: &str, ended: &Ended, now_us: i64) -> Result<bool> {
    let (state, answer, model, report) = match ended {
        Ended::Done { answer, model, report } => ("done", answer, model.as_ref(), report.as_ref()),
        Ended::Failed(why) => ("failed", why, None, None),
        Ended::Aside(why) => ("aside", why, None, None),
    };
    let step = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let sql = "UPDATE job SET state = ?, answer = ?, model = ?, ended_us = ? WHERE id = ? AND worker = ? AND state = 'running'";
    if step.execute(sql, (state, answer, model, now_us, id, worker))? == 0 {
        return Ok(false);
    }
    if let Some(report) = report {
        let sql = "INSERT OR REPLACE INTO report (source, command, job, page) SELECT source, command, id, ?2 FROM job WHERE id = ?1";
        step.execute(sql, (id, squeezed(report.as_bytes())?))?;
    }
    step.execute(
        "UPDATE machine SET rotor = j.rotor FROM job j \
         WHERE j.id = ? AND j.command = 'deploy' AND j.state = 'done' AND machine.source = j.source",
        [id],
    )?;
    step.commit()?;
    Ok(true)
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

/// Whether a job for these hands waits or is worked on.
///
/// # Errors
/// If the store cannot be read.
pub fn is_busy(connection: &Connection, hands: &Hands) -> Result<bool> {
    let sql = format!(
        "SELECT {COLUMNS} FROM job j JOIN source s ON s.id = j.source WHERE j.state IN ('waiting', 'running')"
    );
    let mut statement = connection.prepare(&sql)?;
    let mut all = statement.query_map([], job)?;
    Ok(all.any(|job| job.is_ok_and(|job| job.is_for(hands))))
}

/// All jobs, in the order in which they were asked for.
///
/// # Errors
/// If the store cannot be read.
pub fn list(connection: &Connection) -> Result<Vec<Listed>> {
    listed(connection, "ORDER BY j.asked_us, j.id", [])
}

/// The newest jobs, of all machines or of that of one source.
///
/// # Errors
/// If the store cannot be read.
pub fn newest(connection: &Connection, source: Option<i64>, most: u32) -> Result<Vec<Listed>> {
    let of_source = "WHERE ?1 IS NULL OR j.source = ?1 ORDER BY j.asked_us DESC, j.id LIMIT ?2";
    listed(connection, of_source, (source, most))
}

/// How many jobs there are in each state.
///
/// # Errors
/// If the store cannot be read.
pub fn numbers(connection: &Connection) -> Result<Vec<(String, u32)>> {
    let mut statement =
        connection.prepare("SELECT state, count(*) FROM job GROUP BY state ORDER BY state")?;
    let all = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
    Ok(all.collect::<rusqlite::Result<_>>()?)
}

fn listed(connection: &Connection, which: &str, parameters: impl rusqlite::Params) -> Result<Vec<Listed>> {
    let mut statement = connection.prepare(&format!(
        "SELECT j.id, j.command, s.plant, s.bus, s.node, j.state, j.tries, j.ended_us - j.begun_us, j.answer, j.model, r.job IS NOT NULL, j.version \
         FROM job j JOIN source s ON s.id = j.source \
         LEFT JOIN report r ON r.source = j.source AND r.command = j.command AND r.job = j.id {which}"
    ))?;
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
            has_report: row.get(10)?,
            version: row.get(11)?,
        })
    };
    Ok(statement.query_map(parameters, row)?.collect::<rusqlite::Result<_>>()?)
}

impl Listed {
    /// What a person wants to know of its answer first.
    pub fn in_a_word(&self) -> String {
        if self.state == "waiting" && self.version != VERSION && self.command != FleetCommand::Deploy.name() {
            return format!("for a worker of version {}, and this is {VERSION}", self.version);
        }
        let answer = self.answer.as_deref().unwrap_or_default();
        FleetCommand::of(&self.command).map_or_else(|| answer.into(), |command| in_a_word(command, answer))
    }
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
            let machine = StatedMachine { id: i64::from(node) + 1, source, rotor: "drawing".into() };
            let asked =
                ask(store.connection(), &machine, (FleetCommand::Track, None), PERIOD_US, i64::from(node))
                    .unwrap();
            assert!(asked);
            let again =
                ask(store.connection(), &machine, (FleetCommand::Track, None), PERIOD_US, 99).unwrap();
            assert!(!again, "the same job twice is one");
            assert!(
                ask(store.connection(), &machine, (FleetCommand::Track, None), (0, 1), 1_000).unwrap(),
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
    fn job_of_silent_worker_moves_and_counts_once() {
        let (_folder, mut store) = queue(1);
        let queue = store.connection();
        let job = take(queue, "a", &Hands::default(), 100).unwrap().unwrap();
        assert_eq!(take(queue, "b", &Hands::default(), 100 + LEASE_US).unwrap(), None, "the lease lasts");
        assert!(renew(queue, "a", &job.id, 200).unwrap());
        assert_eq!(take(queue, "b", &Hands::default(), 200 + LEASE_US).unwrap(), None, "renewed");
        assert_eq!(take(queue, "b", &Hands::default(), 201 + LEASE_US).unwrap(), Some(job.clone()));
        assert!(!renew(queue, "a", &job.id, 300).unwrap());
        let done = Ended::Done { answer: "{}".into(), model: None, report: None };
        assert!(!end(queue, "a", &job.id, &done, 400).unwrap(), "it is b's");
        assert!(end(queue, "b", &job.id, &done, 400).unwrap());
        assert!(!end(queue, "b", &job.id, &done, 500).unwrap(), "once");
        assert_eq!(states(&mut store), [("done".to_string(), 2)]);
    }

    #[test]
    fn job_that_kills_workers_is_set_aside() {
        let (_folder, mut store) = queue(2);
        let queue = store.connection();
        let bad = take(queue, "a", &Hands::default(), 0).unwrap().unwrap();
        let good = take(queue, "b", &Hands::default(), 0).unwrap().unwrap();
        assert!(end(queue, "b", &good.id, &Ended::Failed("no reading".into()), 1).unwrap());
        for try_ in 1..i64::from(MOST_TRIES) {
            assert_eq!(take(queue, "c", &Hands::default(), try_ * 2 * LEASE_US).unwrap().unwrap().id, bad.id);
        }
        assert!(is_busy(queue, &Hands::default()).unwrap());
        assert_eq!(take(queue, "c", &Hands::default(), 99 * LEASE_US).unwrap(), None);
        assert!(!is_busy(queue, &Hands::default()).unwrap());
        assert_eq!(states(&mut store), [("aside".to_string(), 3), ("failed".to_string(), 1)]);
    }

    #[test]
    fn unanswered_request_restarts_and_answered_one_does_not() {
        let (_folder, mut store) = queue(2);
        let queue = store.connection();
        let hands = Hands::default();
        let mut asked_again = |ended: &Ended, at_us| {
            let job = take(queue, "a", &hands, at_us).unwrap().unwrap();
            assert!(end(queue, "a", &job.id, ended, at_us).unwrap());
            let machine = StatedMachine { id: job.source_id, source: job.source, rotor: job.rotor };
            ask(queue, &machine, (job.command, None), job.period_us, at_us + 1).unwrap()
        };
        assert!(asked_again(&Ended::Failed("no reading in this period".into()), 10));
        // the other one has waited for longer
        assert!(!asked_again(&Ended::Done { answer: "{}".into(), model: None, report: None }, 20));
        let again = take(queue, "b", &hands, 30).unwrap().unwrap();
        assert_eq!(again.asked_us, 11);
        assert_eq!(states(&mut store), [("done".to_string(), 1), ("running".to_string(), 1)]);
    }

    #[test]
    fn an_answer_is_that_of_the_version_that_was_asked() {
        let (_folder, mut store) = queue(1);
        let queue = store.connection();
        queue.execute("UPDATE job SET version = '99.1.0' WHERE state = 'waiting'", []).unwrap();
        assert_eq!(take(queue, "a", &Hands::default(), 10).unwrap(), None);
        assert!(!is_busy(queue, &Hands::default()).unwrap());
        let waiting = list(queue).unwrap().into_iter().find(|job| job.state == "waiting").unwrap();
        assert!(waiting.in_a_word().starts_with("for a worker of version 99.1.0"), "{}", waiting.in_a_word());
    }

    #[test]
    fn what_is_cancelled_is_not_begun_and_not_ended() {
        let (_folder, mut store) = queue(2);
        let queue = store.connection();
        let running = take(queue, "a", &Hands::default(), 0).unwrap().unwrap();
        assert_eq!(cancel(queue, "", 5).unwrap(), 2);
        assert!(
            !end(queue, "a", &running.id, &Ended::Done { answer: "{}".into(), model: None, report: None }, 6)
                .unwrap()
        );
        assert_eq!(take(queue, "a", &Hands::default(), 7).unwrap(), None);
    }
}

//! Jobs on a NATS server. Who has the store shares its jobs and brings the answers home; workers of any host do them. The
//! server hands a job out again when its worker falls silent, and keeps both sides' messages while the other is away.
//!
//! | stream | subjects | holds |
//! |---|---|---|
//! | `ROTOR_EDGE_JOBS` | `rotor_edge_jobs.desk.VERSION.ID`, `rotor_edge_jobs.deploy.PLANT.BUS.ID` | a task, and whose it is |
//! | `ROTOR_EDGE_ANSWERS` | `rotor_edge_answers.FILE.ID` | what came of it |

use std::collections::HashSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context as _, Result, anyhow, bail};
use async_nats::jetstream::consumer::{AckPolicy, PullConsumer, pull};
use async_nats::jetstream::message::{AckKind, PublishMessage};
use async_nats::jetstream::stream::{Config, RetentionPolicy, StorageType};
use async_nats::jetstream::{Message, stream};
use futures_util::TryStreamExt as _;
use rusqlite::Connection;
use serde::{Deserialize, Serialize};

use super::queue::{self, COLUMNS, Job, MOST_TRIES};
use super::task::{Ended, FleetCommand, Hands, Task, packed, unpacked};
use super::worker::{RENEW, Shown, dropped, now_us, task_of};
use crate::item::plain_word;
use crate::store::Store;
use crate::stream::DUPLICATES;
use crate::stream::server::{Server, refused};

const JOBS: &str = "ROTOR_EDGE_JOBS";
const ANSWERS: &str = "ROTOR_EDGE_ANSWERS";
/// Whose the jobs of a store are that a server has.
const SHARED: &str = "server";
/// How long something is waited for before somebody looks around.
const LOOK: Duration = Duration::from_millis(300);
/// Wait before a server that is gone is asked again.
const AGAIN: Duration = Duration::from_secs(1);

/// A task and where its answer goes.
#[derive(Serialize, Deserialize)]
struct Sent {
    home: String,
    task: Task,
}

#[derive(Serialize, Deserialize)]
struct JobAnswer {
    id: String,
    ended: Ended,
}

fn subject(task: &Task) -> String {
    match task.command {
        FleetCommand::Deploy => format!("{}.{}", deployments(&task.source.plant, &task.source.bus), task.id),
        _ => format!("{}.{}", desk_commands(&task.version), task.id),
    }
}

/// Another version's answer may be another.
fn desk_commands(version: &str) -> String {
    format!("rotor_edge_jobs.desk.{}", plain_word(version))
}

fn deployments(plant: &str, bus: &str) -> String {
    format!("rotor_edge_jobs.deploy.{}.{}", plain_word(plant), plain_word(bus))
}

/// A stream whose messages go when they are acknowledged.
async fn work_queue(server: &Server, name: &str, subjects: &str) -> Result<stream::Stream> {
    let config = Config {
        name: name.into(),
        subjects: vec![subjects.into()],
        retention: RetentionPolicy::WorkQueue,
        storage: StorageType::File,
        duplicate_window: DUPLICATES,
        ..Config::default()
    };
    Ok(server.context.get_or_create_stream(config).await?)
}

async fn consumer(of: &stream::Stream, name: &str, filter: String) -> Result<PullConsumer> {
    let config = pull::Config {
        durable_name: Some(name.into()),
        ack_policy: AckPolicy::Explicit,
        ack_wait: Duration::from_micros(queue::LEASE_US as u64),
        filter_subject: filter,
        ..pull::Config::default()
    };
    Ok(of.get_or_create_consumer(name, config).await?)
}

async fn fetched(consumer: &PullConsumer, most: usize) -> Result<Vec<Message>, async_nats::Error> {
    consumer.fetch().max_messages(most).expires(LOOK).messages().await?.try_collect().await
}

async fn publish(server: &Server, subject: String, id: &str, bytes: Vec<u8>) -> Result<()> {
    let message = PublishMessage::build().payload(bytes.into()).message_id(id);
    server.context.send_publish(subject, message).await?.await?;
    Ok(())
}

/// Does jobs of a server until `stop` rises, or until nothing is left if it is `once`; how many it ended.
///
/// # Errors
/// If the server cannot be joined.
pub fn work(server: &Server, hands: &Hands, is_once: bool, stop: &AtomicBool, tell: fn(&str)) -> Result<u64> {
    let mut consumers = server
        .wait(async {
            let jobs = work_queue(server, JOBS, "rotor_edge_jobs.>").await?;
            let mut all = Vec::new();
            for bus in &hands.buses {
                let name = format!("deploy_{}_{}", plain_word(&hands.plant), plain_word(&bus.name));
                let filter = format!("{}.*", deployments(&hands.plant, &bus.name));
                all.push(consumer(&jobs, &name, filter).await?);
            }
            if all.is_empty() {
                let name = format!("desk_{}", plain_word(queue::VERSION));
                all.push(consumer(&jobs, &name, format!("{}.*", desk_commands(queue::VERSION))).await?);
            }
            anyhow::Ok(all)
        })
        .with_context(|| refused(&server.name))?;
    let (shown, mut ended) = (Shown::new(), 0);
    while !stop.load(Ordering::Relaxed) {
        let (mut busy, before) = (false, ended);
        for consumer in &mut consumers {
            let step = server.wait(async {
                for message in fetched(consumer, 1).await.map_err(|error| anyhow!("{error}"))? {
                    let doing = |task: &Task| shown.doing(ended, task.command, &task.source);
                    ended += u64::from(one(server, hands, message, doing, tell).await?);
                    shown.waiting(ended);
                }
                let info = consumer.info().await?;
                anyhow::Ok(info.num_pending > 0 || info.num_ack_pending > 0)
            });
            match step {
                Ok(is_busy) => busy |= is_busy,
                Err(error) => {
                    shown.while_hidden(|| tell(&format!("{}: {error:#}; trying again", server.name)));
                    std::thread::sleep(AGAIN);
                    busy = true;
                }
            }
        }
        if is_once && !busy && ended == before {
            break;
        }
    }
    Ok(ended)
}

/// Does one; whether it was one. It is the server's again when this worker is silent for a lease.
async fn one(
    server: &Server,
    hands: &Hands,
    message: Message,
    doing: impl Fn(&Task),
    tell: fn(&str),
) -> Result<bool> {
    let failed = |error: async_nats::Error| anyhow!("{error}");
    let Sent { home, task } = match unpacked(&message.payload) {
        Ok(sent) => sent,
        Err(why) => {
            tell(&format!("set aside: a message that is no job ({why:#})"));
            message.ack_with(AckKind::Term).await.map_err(failed)?;
            return Ok(false);
        }
    };
    let (tries, place) = {
        let info = message.info().map_err(failed)?;
        (info.delivered, info.stream_sequence)
    };
    doing(&task);
    let id = task.id.clone();
    let ended = if tries > i64::from(MOST_TRIES) {
        Ended::Aside(format!("it was begun {MOST_TRIES} times and never ended"))
    } else {
        let hands = hands.clone();
        let mut work = tokio::task::spawn_blocking(move || task.done(&hands));
        loop {
            match tokio::time::timeout(RENEW, &mut work).await {
                Ok(done) => break done?,
                Err(_) => {
                    // a server that is away for long costs the lease, and the job is done again
                    let _ = message.ack_with(AckKind::Progress).await;
                }
            }
        }
    };
    let bytes = small_enough(server, &id, ended)?;
    // the same delivered again gives the same answer; the same asked for again gives one of its own
    publish(server, format!("rotor_edge_answers.{home}.{id}"), &format!("{id}:{place}"), bytes).await?;
    message.double_ack().await.map_err(failed)?;
    Ok(true)
}

/// An answer that the server takes: without its page if need be, which people can have made again.
fn small_enough(server: &Server, id: &str, ended: Ended) -> Result<Vec<u8>> {
    let whole = packed(&JobAnswer { id: id.into(), ended: ended.clone() })?;
    let Some(why) = too_large(server, whole.len()) else { return Ok(whole) };
    let less = match ended {
        Ended::Done { answer, model, report: Some(_) } => {
            packed(&JobAnswer { id: id.into(), ended: Ended::Done { answer, model, report: None } })?
        }
        _ => whole,
    };
    match too_large(server, less.len()) {
        None => Ok(less),
        Some(_) => packed(&JobAnswer { id: id.into(), ended: Ended::Failed(format!("its answer is {why}")) }),
    }
}

/// Why the server would not take so many bytes.
fn too_large(server: &Server, bytes: usize) -> Option<String> {
    let most = server.client.server_info().max_payload;
    let mb = |bytes: usize| bytes as f64 / (1 << 20) as f64;
    (bytes > most).then(|| {
        format!(
            "{:.1} MB, and the server takes {:.1} at once (max_payload in its settings)",
            mb(bytes),
            mb(most)
        )
    })
}

/// Shares the jobs of a store and brings their answers home until `stop` rises; how many came.
///
/// # Errors
/// If the server cannot be joined at first, or the store takes nothing.
pub fn share(server: &Server, store: &Path, stop: &AtomicBool, tell: fn(&str)) -> Result<u64> {
    let mut store = Store::open(store)?;
    let home = name_of(store.connection())?;
    let opened = server.wait(async {
        let jobs = work_queue(server, JOBS, "rotor_edge_jobs.>").await?;
        let answers = work_queue(server, ANSWERS, "rotor_edge_answers.>").await?;
        let consumer =
            consumer(&answers, &format!("home_{home}"), format!("rotor_edge_answers.{home}.*")).await?;
        anyhow::Ok((jobs, consumer))
    });
    let (jobs, answers) = opened.with_context(|| refused(&server.name))?;
    // one that ended before it had sent what it was about to share
    let (mut all_again, mut ended) = (true, 0);
    while !stop.load(Ordering::Relaxed) {
        match round(server, &mut store, &home, (&jobs, &answers), all_again, tell) {
            Ok(number) => {
                ended += number;
                all_again = false;
            }
            Err(Gone::Store(error)) => return Err(error),
            Err(Gone::Server(error)) => {
                if !std::mem::replace(&mut all_again, true) {
                    tell(&format!("{}: {error:#}; trying again", server.name));
                }
                std::thread::sleep(AGAIN);
            }
        }
    }
    Ok(ended)
}

enum Gone {
    Store(anyhow::Error),
    Server(anyhow::Error),
}

fn round(
    server: &Server,
    store: &mut Store,
    home: &str,
    (jobs, answers): (&stream::Stream, &PullConsumer),
    is_all: bool,
    tell: fn(&str),
) -> Result<u64, Gone> {
    let there =
        if is_all { server.wait(known(jobs, home, server)).map_err(Gone::Server)? } else { HashSet::new() };
    for job in to_share(store.connection(), is_all).map_err(Gone::Store)? {
        if there.contains(&job.id) {
            continue;
        }
        let message = task_of(store, &job).and_then(|task| {
            let subject = subject(&task);
            let bytes = packed(&Sent { home: home.into(), task })?;
            too_large(server, bytes.len()).map_or(Ok((subject, bytes)), |why| {
                bail!("its readings are {why}; shorten the period with --from and --to")
            })
        });
        match message {
            Ok((subject, bytes)) => {
                let id = format!("{}:{}", job.id, job.asked_us);
                server.wait(publish(server, subject, &id, bytes)).map_err(Gone::Server)?;
            }
            Err(error) => {
                let why = Ended::Failed(format!("{error:#}"));
                queue::end(store.connection(), SHARED, &job.id, &why, now_us()).map_err(Gone::Store)?;
            }
        }
    }
    for (id, subject) in to_take_back(store.connection()).map_err(Gone::Store)? {
        let purged = server.wait(async { jobs.purge().filter(subject).await });
        purged.map_err(|error| Gone::Server(error.into()))?;
        let sql = "UPDATE job SET worker = NULL WHERE id = ?";
        store.connection().execute(sql, [id]).map_err(|error| Gone::Store(error.into()))?;
    }
    let messages = server.wait(fetched(answers, 100)).map_err(|error| Gone::Server(anyhow!("{error}")))?;
    let mut ended = 0;
    for message in messages {
        match unpacked::<JobAnswer>(&message.payload) {
            Ok(answer) => {
                let is_waited_for =
                    queue::end(store.connection(), SHARED, &answer.id, &answer.ended, now_us())
                        .map_err(Gone::Store)?;
                ended += u64::from(is_waited_for);
                if !is_waited_for {
                    tell(&dropped(&answer.id));
                }
            }
            Err(why) => tell(&format!("set aside: a message that is no answer ({why:#})")),
        }
        server.wait(message.double_ack()).map_err(|error| Gone::Server(anyhow!("{error}")))?;
    }
    Ok(ended)
}

/// Jobs that the server has, or their answers: they are not sent to it again.
async fn known(jobs: &stream::Stream, home: &str, server: &Server) -> Result<HashSet<String>> {
    let answers = server.context.get_stream(ANSWERS).await?;
    let mut all = HashSet::new();
    for (of, subjects) in
        [(jobs, "rotor_edge_jobs.>".to_string()), (&answers, format!("rotor_edge_answers.{home}.*"))]
    {
        let subjects: Vec<(String, usize)> = of.info_with_subjects(subjects).await?.try_collect().await?;
        all.extend(subjects.iter().filter_map(|(subject, _)| Some(subject.rsplit_once('.')?.1.to_string())));
    }
    Ok(all)
}

/// Jobs that wait, which are the server's from now on, and if it is `all` those that are the server's already.
fn to_share(connection: &mut Connection, is_all: bool) -> Result<Vec<Job>> {
    let now_us = now_us();
    let step = connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
    let sql = format!(
        "SELECT {COLUMNS} FROM job j JOIN source s ON s.id = j.source \
         WHERE j.state = 'waiting' OR (?1 AND j.state = 'running' AND j.worker = ?2) ORDER BY j.asked_us, j.id"
    );
    let jobs: Vec<Job> =
        step.prepare(&sql)?.query_map((is_all, SHARED), queue::job)?.collect::<rusqlite::Result<_>>()?;
    // the lease is the server's business
    let sql = "UPDATE job SET state = 'running', tries = 1, worker = ?, lease_us = ?, begun_us = ? WHERE state = 'waiting'";
    step.execute(sql, (SHARED, i64::MAX, now_us))?;
    step.commit()?;
    Ok(jobs)
}

/// Cancelled jobs that the server has, with their subjects.
fn to_take_back(connection: &Connection) -> Result<Vec<(String, String)>> {
    let sql = format!(
        "SELECT {COLUMNS} FROM job j JOIN source s ON s.id = j.source WHERE j.state = 'cancelled' AND j.worker = ?"
    );
    let mut statement = connection.prepare(&sql)?;
    let of = |job: Job| {
        let Job { id, version, command, option, source, rotor, .. } = job;
        let task = Task { id: id.clone(), version, command, option, source, rotor, data: String::new() };
        (id, subject(&task))
    };
    let jobs = statement.query_map([SHARED], queue::job)?;
    Ok(jobs.map(|job| job.map(of)).collect::<rusqlite::Result<_>>()?)
}

/// The name of a file among those that share a server.
fn name_of(connection: &Connection) -> Result<String> {
    connection.execute(
        "INSERT INTO file SELECT lower(hex(randomblob(8))) WHERE NOT EXISTS (SELECT 1 FROM file)",
        [],
    )?;
    Ok(connection.query_row("SELECT name FROM file", [], |row| row.get(0))?)
}

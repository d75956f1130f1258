//! A record, played over a real bus: one reading, its answer, the next reading.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow, bail};
use rotor_edge_core::can::{Counters, Message, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_desktop::measurement::Reading;

use super::{Answer, Replay, ReplayConfig, row_of};
use crate::bus::{CanBus, Traffic, counters};
use crate::deploy::await_heartbeat;
use crate::edge::Deployment;
use crate::node::{Served, serve};

/// Longest time a monitor may take for a reading.
const ANSWER_TIME: Duration = Duration::from_secs(2);
const PATIENCE: Duration = Duration::from_millis(2);
/// Readings in a row without an answer after which the monitor is taken for gone.
const MOST_UNANSWERED: usize = 5;

/// Plays `record` into a monitor of our own that joins the same bus on a connection of its own.
///
/// # Errors
/// If the bus fails, the controller refuses the model, or it does not answer.
pub fn run_with_own_monitor(
    host: &mut dyn CanBus,
    monitor: &mut dyn CanBus,
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    progress: impl FnMut(usize),
) -> Result<Replay> {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let served = scope.spawn(|| serve(monitor, config.node, deployment.edge.clone(), None, &stop));
        let played = play(host, config.node.node, deployment, record, progress);
        stop.store(true, Ordering::Relaxed);
        let served: Served = served.join().map_err(|_| anyhow!("the monitor's thread ended early"))??;
        let (answers, sent, mut received) = played?;
        // what the monitor said last; on a bus of two, the end of it is no error
        while let Ok(Some(_)) = host.receive(PATIENCE) {
            received += 1;
        }
        let (sent, received) = (sent + served.sent, received + served.received);
        let traffic = Traffic { sent, received, lost: sent.saturating_sub(received), ..Traffic::default() };
        Ok(Replay { answers, traffic, counters: served.counters })
    })
}

/// Plays `record` into a monitor that is on the bus already and holds this model.
///
/// # Errors
/// If the bus fails or the monitor does not answer.
pub fn run_with_foreign_monitor(
    host: &mut dyn CanBus,
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    progress: impl FnMut(usize),
) -> Result<Replay> {
    let node = config.node.node;
    let before = counters(host, node)?;
    let (answers, sent, received) = play(host, node, deployment, record, progress)?;
    let counters = since(&before, &counters(host, node)?);
    let traffic = Traffic { sent, received, lost: u64::from(counters.lost), ..Traffic::default() };
    Ok(Replay { answers, traffic, counters })
}

/// Answers, and frames sent and received here.
fn play(
    host: &mut dyn CanBus,
    node: u8,
    deployment: &Deployment,
    record: &[Reading],
    mut progress: impl FnMut(usize),
) -> Result<(Vec<Answer>, u64, u64)> {
    let mut received = await_heartbeat(host, node)?;
    let mut results = ResultAssembler::new();
    let (mut answers, mut sent) = (Vec::with_capacity(record.len()), 0);
    let mut unanswered = 0;
    for (row, measured) in record.iter().enumerate() {
        let reading = deployment.reading(measured);
        for frame in reading_frames(node, &NumberedReading::new(row as u16, reading)) {
            host.send(&frame)?;
            sent += 1;
        }
        let is_answered = reading.is_complete() && deployment.edge.covers(reading.speed_rpm);
        let begun = Instant::now();
        let mut answer = None;
        while is_answered && answer.is_none() && begun.elapsed() < ANSWER_TIME {
            let Some(frame) = host.receive(PATIENCE)? else { continue };
            received += 1;
            if frame.node() == node {
                answer = results.receive(&frame).filter(|result| result.sequence == row as u16);
            }
        }
        answers.extend(answer.map(|result| Answer { row: row_of(result.sequence, row), result }));
        unanswered = if is_answered && answer.is_none() { unanswered + 1 } else { 0 };
        if unanswered == MOST_UNANSWERED {
            bail!(
                "monitor {node} on {} stopped answering at reading {row}: is its number used twice, or is it gone?",
                host.description()
            );
        }
        progress(row);
    }
    Ok((answers, sent, received))
}

/// What the monitor's next heartbeat says.
fn counters(host: &mut dyn CanBus, node: u8) -> Result<Counters> {
    await_heartbeat(host, node)?;
    let mut counters = Counters::default();
    let begun = Instant::now();
    let mut complete = false;
    while !complete && begun.elapsed() < ANSWER_TIME {
        let heard = host.receive(PATIENCE)?.and_then(|frame| Message::decode(&frame).ok());
        let Some((from, message)) = heard else { continue };
        if from == node {
            counters::take(&mut counters, &message);
            complete = matches!(message, Message::Heartbeat { .. });
        }
    }
    Ok(counters)
}

/// Counters wrap; their differences do not mind.
fn since(before: &Counters, after: &Counters) -> Counters {
    let passed = |which: fn(&Counters) -> u16| which(after).wrapping_sub(which(before));
    Counters {
        readings: passed(|c| c.readings),
        lost: passed(|c| c.lost),
        rejected: passed(|c| c.rejected),
        repeated: passed(|c| c.repeated),
        late: passed(|c| c.late),
        incomplete: passed(|c| c.incomplete),
        stray: passed(|c| c.stray),
        skipped: passed(|c| c.skipped),
        resynchronised: passed(|c| c.resynchronised),
        overflowed: passed(|c| c.overflowed),
        unsolved: passed(|c| c.unsolved),
        ..Counters::default()
    }
}

//! A record, played over a real bus: one reading, its answer, the next reading.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use rotor_edge_core::can::{Counters, Message, NumberedReading, ResultAssembler, TYPE_MODEL, reading_frames};
use rotor_edge_core::command::Command;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_desktop::measurement::Reading;

use super::reference::ReferencePipeline;
use super::timing::{Timing, settings};
use super::{AnsweredReading, Replay, ReplayConfig, changes, row_of};
use crate::bus::mac::Authenticator;
use crate::bus::states::States;
use crate::bus::{CanBus, Traffic, counters};
use crate::clock::PlayedTime;
use crate::deploy::{Authority, await_heartbeat};
use crate::edge::{Deployment, encoded};
use crate::node::{Controller, Served, Store, serve};

/// Longest time a monitor may take for a reading.
const ANSWER_TIME: Duration = Duration::from_secs(2);
const PATIENCE: Duration = Duration::from_millis(2);
/// Readings in a row without an answer after which the monitor is taken for gone.
const MOST_UNANSWERED: usize = 5;
/// By what time is compressed for a monitor that lives in real time: readings of days come milliseconds apart, and every
/// time constant shrinks so far that a reading of microseconds ago is as far away as one of days. A power of two, so that
/// no number is rounded in another way.
const COMPRESSION: f32 = 1.0 / (1_u64 << 36) as f32;

struct PlayedRecord {
    answers: Vec<AnsweredReading>,
    /// By the row that was sent last.
    states: States,
    sent: u64,
    received: u64,
}

/// Plays `record` into a monitor of our own that joins the same bus on a connection of its own. Its clock is the record's.
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
    let timing = Timing::of(deployment, record, config);
    let store = Store::in_memory().with_initial_model(encoded(&deployment.edge)?);
    let mut controller = Controller::start(settings(config, record), store, 0)?;
    let (clock, stop) = (PlayedTime::default(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let served = scope.spawn(|| serve(monitor, &mut controller, &clock, &stop, |_| ()));
        clock.set(config.node.listen_us);
        let begin = |time_us| clock.set(time_us);
        let played = play(host, deployment, record, config, None, begin, progress);
        stop.store(true, Ordering::Relaxed);
        let served: Served = served.join().map_err(|_| anyhow!("the monitor's thread ended early"))??;
        let PlayedRecord { answers, sent, mut received, .. } = played?;
        // what the monitor said last; on a bus of two, the end of it is no error
        while let Ok(Some(_)) = host.receive(PATIENCE) {
            received += 1;
        }
        let (sent, received) = (sent + served.sent, received + served.received);
        let traffic = Traffic { sent, received, lost: sent.saturating_sub(received), ..Traffic::default() };
        let states = changes(&served.states, &timing);
        Ok(Replay { answers, states, traffic, counters: served.counters })
    })
}

/// Plays `record` into a monitor that is on the bus already and holds this model. It lives in real time: meanwhile it
/// judges by thresholds for compressed time, and afterwards by those it had.
///
/// # Errors
/// If the bus fails, or the monitor does not answer or refuses the thresholds.
pub fn run_with_foreign_monitor(
    host: &mut dyn CanBus,
    authority: &mut Authority,
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    progress: impl FnMut(usize),
) -> Result<Replay> {
    let usual = authority.thresholds(host)?;
    let set = |host: &mut dyn CanBus, authority: &mut Authority, thresholds: &Thresholds| {
        authority.command(host, Command::SetThresholds, &thresholds.encode(), |_| ())
    };
    let for_record = Thresholds { age_limit_s: usual.age_limit_s, ..compressed(&config.node.thresholds) };
    set(host, authority, &for_record).context(
        "the record cannot be compared: the monitor lives in real time and does not take thresholds for readings in quick succession",
    )?;
    let played = (|| -> Result<Replay> {
        authority.command(host, Command::Restart, &[], |_| ())?;
        let before = counters(host, config.node.node)?;
        let timing = Timing::of(deployment, record, config);
        let mut authenticator = authority.authenticator();
        let played = play(host, deployment, record, config, Some(&mut authenticator), |_| (), progress)?;
        let counters = counters::since(&before, &counters(host, config.node.node)?);
        let traffic = Traffic {
            sent: played.sent,
            received: played.received,
            lost: u64::from(counters.lost),
            ..Traffic::default()
        };
        let states = changes(&played.states, &timing);
        Ok(Replay { answers: played.answers, states, traffic, counters })
    })();
    // whatever became of the record, the monitor must not go on with thresholds that are not its own
    let restored = set(host, authority, &usual);
    let replay = played?;
    restored.context(
        "the monitor still judges by thresholds for a replay: set its own with `rotor-edge thresholds`",
    )?;
    Ok(replay)
}

/// Thresholds of a record of days for readings that come milliseconds apart.
fn compressed(thresholds: &Thresholds) -> Thresholds {
    Thresholds {
        average_s: thresholds.average_s * COMPRESSION,
        persistence_s: thresholds.persistence_s * COMPRESSION,
        level_s: thresholds.level_s * COMPRESSION,
        learning_s: thresholds.learning_s * COMPRESSION,
        growth_s: thresholds.growth_s * COMPRESSION,
        ..*thresholds
    }
}

/// Sends each reading, with its MAC if there is a key, and waits for its answer, if it gets one; `begin` hears when each is judged by the record's clock.
fn play(
    host: &mut dyn CanBus,
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    mut authenticator: Option<&mut Authenticator>,
    begin: impl Fn(u64),
    mut progress: impl FnMut(usize),
) -> Result<PlayedRecord> {
    let node = config.node.node;
    let timing = Timing::of(deployment, record, config);
    let received = await_heartbeat(host, node)?;
    let mut results = ResultAssembler::new();
    let mut reference = ReferencePipeline::new(&deployment.edge, settings(config, record));
    let mut played = PlayedRecord { answers: Vec::new(), states: States::default(), sent: 0, received };
    let mut unanswered = 0;
    for (row, measured) in record.iter().enumerate() {
        let reading = deployment.reading(measured);
        let judged_us = timing.judged_us(row);
        begin(judged_us);
        let frames = reading_frames(node, &NumberedReading::new(row as u16, reading));
        let mac = authenticator.as_mut().map(|authenticator| authenticator.mac(&frames));
        for frame in frames.iter().chain(mac.iter().flatten()) {
            host.send(frame)?;
            played.sent += 1;
        }
        let is_answered = reference.expect(judged_us, &reading).is_some();
        let end = host.now() + ANSWER_TIME;
        let mut answer = None;
        while is_answered && answer.is_none() && host.now() < end {
            let Some(frame) = host.receive(PATIENCE)? else { continue };
            played.received += 1;
            if frame.node() == node {
                answer = results.receive(&frame).filter(|result| result.sequence == row as u16);
                if let Ok((_, message)) = Message::decode(&frame) {
                    played.states.take(judged_us, &message);
                }
            }
        }
        if answer.as_ref().is_some_and(|result| !result.is_trusted()) {
            reference.distrust();
        }
        played
            .answers
            .extend(answer.map(|result| AnsweredReading { row: row_of(result.sequence, row), result }));
        unanswered = if is_answered && answer.is_none() { unanswered + 1 } else { 0 };
        if unanswered == MOST_UNANSWERED {
            bail!(
                "monitor {node} on {} stopped answering at reading {row}: is its number used twice, or is it gone?",
                host.description()
            );
        }
        progress(row);
    }
    Ok(played)
}

/// What the monitor's next heartbeat says.
fn counters(host: &mut dyn CanBus, node: u8) -> Result<Counters> {
    await_heartbeat(host, node)?;
    let mut counters = Counters::default();
    let end = host.now() + ANSWER_TIME;
    let mut complete = false;
    while !complete && host.now() < end {
        let Some(frame) = host.receive(PATIENCE)?.filter(|frame| frame.node() == node) else { continue };
        if let Ok((_, message)) = Message::decode(&frame) {
            counters::take(&mut counters, &message);
            // the last of a heartbeat's frames
            complete = frame.message_type() == TYPE_MODEL;
        }
    }
    Ok(counters)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compressed_thresholds_are_taken_and_what_is_no_time_stays() {
        let compressed = compressed(&Thresholds::DEFAULT);
        assert_eq!(compressed.check(), Ok(()));
        assert_eq!((compressed.rise, compressed.growth), (0.5, 1.2));
        assert_eq!(compressed.level_s / compressed.growth_s, 10.0);
        // a reading two microseconds ago is beyond all of them
        assert!(compressed.growth_s < 2e-6 && 0.1 * compressed.level_s < 2e-6);
    }
}

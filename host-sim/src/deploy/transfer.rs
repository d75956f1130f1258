//! A request and its answer across a bus that may lose frames: in numbered parts, or as one ISO-TP message where a monitor's
//! firmware does not know those.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use rotor_edge_core::can::isotp::{IsoTp, Progress, TransferError};
use rotor_edge_core::can::{Frame, TYPE_TO_HOST, TYPE_TO_NODE, frame_id};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, Key, MAX_REQUEST_BYTES, Outcome, write_request,
};

use super::PATIENCE;
use super::answer::judge;
use super::parts_client::{PartsClient, Standing};
use crate::bus::CanBus;

/// Longest time a monitor may take to check, store and answer.
const ANSWER_TIME: Duration = Duration::from_secs(5);
/// Times that a command is sent, and that a monitor which says nothing at all is asked.
const ATTEMPTS: usize = 20;
const SILENT_ATTEMPTS: usize = 2;
/// Wait after a transfer that broke off: the monitor gives up on it, and on its own answer, after a second.
const BACK_OFF: Duration = Duration::from_millis(1_050);
/// Wait for an answer with the right code after one without it.
const DOUBT_TIME: Duration = Duration::from_millis(500);
/// Answers in parts without the right code, before one of them counts.
const DOUBTS: usize = 3;

/// Sends a command to `node` and waits for its answer; `progress` hears how many bytes are on their way. What is
/// sent again keeps its number, so that it is carried out once.
///
/// # Errors
/// If nobody answers, or the monitor refuses: why, and what to do.
pub fn command(
    bus: &mut dyn CanBus,
    key: &Key,
    node: u8,
    counter: u64,
    command: Command,
    body: &[u8],
    mut progress: impl FnMut(usize),
) -> Result<Answer> {
    let mut request = [0; MAX_REQUEST_BYTES];
    let Some(length) = write_request(&mut request, key, node, command, counter, body) else {
        bail!("the command has {} bytes, more than a monitor takes", body.len());
    };
    let request = &request[..length];
    match in_parts(bus, node, request, key, counter, &mut progress)? {
        InParts::Answer(answer) => judge(node, counter, answer),
        InParts::Lost => bail!(
            "the transfer to monitor {node} broke off: the bus loses too many frames, or the monitor was switched off. {}",
            unknown(counter)
        ),
        InParts::Unheard => as_one_message(bus, node, request, key, counter, &mut progress),
    }
}

fn since_us(bus: &dyn CanBus, started: Duration) -> u64 {
    (bus.now() - started).as_micros() as u64
}

fn unknown(counter: u64) -> String {
    format!(
        "Whether the command was carried out is not known; the same with --counter {counter} does no harm"
    )
}

/// What became of a request in parts.
enum InParts {
    /// An answer, and whether it bears the code of our key; `None` if it is of another version of the protocol.
    Answer(Option<(Answer, bool)>),
    /// The monitor does not know this way, or is not there.
    Unheard,
    /// It fell silent.
    Lost,
}

fn in_parts(
    bus: &mut dyn CanBus,
    node: u8,
    request: &[u8],
    key: &Key,
    counter: u64,
    progress: &mut impl FnMut(usize),
) -> Result<InParts> {
    let started = bus.now();
    let mut client = PartsClient::new(0, node, request).context("a request of less than 64 kB")?;
    let mut doubts = 0;
    loop {
        match client.standing(since_us(bus, started)) {
            Standing::UnderWay => {}
            Standing::Unheard => return Ok(InParts::Unheard),
            Standing::Lost => return Ok(InParts::Lost),
        }
        while let Some(frame) = client.poll(since_us(bus, started)) {
            bus.send(&frame)?;
        }
        let Some(frame) = bus.receive(PATIENCE)? else { continue };
        let Some(answer) = client.receive(since_us(bus, started), &frame) else {
            progress(client.held_bytes());
            continue;
        };
        match Answer::decode(answer, request, key) {
            // what was sent before got across, and the monitor started anew since
            Some((answer, true))
                if client.was_forgotten()
                    && answer.outcome == Outcome::Replayed
                    && answer.counter == counter =>
            {
                return Ok(InParts::Answer(Some((Answer { outcome: Outcome::Accepted, ..answer }, true))));
            }
            Some((answer, false)) if answer.outcome != Outcome::NoKey && doubts < DOUBTS => {
                doubts += 1;
                client.distrust(since_us(bus, started));
            }
            answer => return Ok(InParts::Answer(answer)),
        }
    }
}

fn as_one_message(
    bus: &mut dyn CanBus,
    node: u8,
    request: &[u8],
    key: &Key,
    counter: u64,
    progress: &mut impl FnMut(usize),
) -> Result<Answer> {
    let (mut silent, mut unconfirmed, mut broken) = (0, 0, None);
    // whether an earlier attempt was sent to its end: then the number may have been taken by ourselves
    let (mut was_sent, mut is_sent) = (false, false);
    for _ in 0..ATTEMPTS {
        was_sent |= is_sent;
        let mut told = |bytes: usize| {
            is_sent |= bytes == request.len();
            progress(bytes);
        };
        match transfer(bus, node, request, key, &mut told)? {
            // what was sent before got across, and its answer did not
            AttemptOutcome::Answer(Some((answer, true)))
                if was_sent && answer.outcome == Outcome::Replayed && answer.counter == counter =>
            {
                return Ok(Answer { outcome: Outcome::Accepted, ..answer });
            }
            AttemptOutcome::Answer(Some((answer, false)))
                if answer.outcome != Outcome::NoKey && unconfirmed == 0 =>
            {
                unconfirmed += 1;
            }
            AttemptOutcome::Answer(answer) => return judge(node, counter, answer),
            AttemptOutcome::Nothing if silent == SILENT_ATTEMPTS - 1 => bail!(
                "monitor {node} does not answer on {}: is it on this bus, under this number? (`rotor-edge watch` shows \
                 who is)",
                bus.description()
            ),
            // a monitor that has just started listens before it speaks
            AttemptOutcome::Nothing => silent += 1,
            AttemptOutcome::Broken(error) => {
                broken = Some(error);
                quiet(bus, BACK_OFF)?;
            }
        }
    }
    let why = broken.map_or("its answers were not to be trusted".into(), |error| format!("{error:?}"));
    bail!(
        "{ATTEMPTS} transfers to monitor {node} broke off, the last because of {why}: the bus loses frames. {}",
        unknown(counter)
    )
}

/// What became of one transfer.
enum AttemptOutcome {
    /// An answer, and whether it bears the code of our key; `None` if it is of another version of the protocol.
    Answer(Option<(Answer, bool)>),
    Broken(TransferError),
    /// Nothing at all of the monitor.
    Nothing,
}

/// Lets what is still on its way pass.
fn quiet(bus: &mut dyn CanBus, time: Duration) -> Result<()> {
    let end = bus.now() + time;
    while bus.now() < end {
        bus.receive(PATIENCE)?;
    }
    Ok(())
}

/// Sends a request and waits for the answer to it; one that bears no code of our key may be another's or of an earlier
/// request, and counts only if none follows.
fn transfer(
    bus: &mut dyn CanBus,
    node: u8,
    request: &[u8],
    key: &Key,
    progress: &mut impl FnMut(usize),
) -> Result<AttemptOutcome> {
    let mut link = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
    let started = bus.now();
    if let Err(error) = link.send(0, request) {
        return Ok(AttemptOutcome::Broken(error));
    }
    let (mut sent, mut heard_any, mut doubtful) = (0, false, None);
    while bus.now() - started < ANSWER_TIME {
        while let Some(payload) = link.poll(since_us(bus, started)) {
            let frame = Frame::standard(frame_id(TYPE_TO_NODE, node), &payload);
            bus.send(&frame.context("a node number from 0 to 30")?)?;
            sent += payload.len() - 1;
            progress(sent.min(request.len()));
        }
        let heard = bus.receive(PATIENCE)?;
        if let Some(frame) = heard.filter(|f| f.raw_id() == frame_id(TYPE_TO_HOST, node)) {
            heard_any = true;
            match link.receive(since_us(bus, started), frame.bytes()) {
                Progress::None => {}
                Progress::Complete => match Answer::decode(link.message(), request, key) {
                    Some((answer, false)) => {
                        doubtful.get_or_insert((answer, bus.now()));
                    }
                    answer => return Ok(AttemptOutcome::Answer(answer)),
                },
                Progress::Broken(error) => return Ok(AttemptOutcome::Broken(error)),
            }
        }
        if let Some((answer, since)) = doubtful
            && bus.now() - since > DOUBT_TIME
        {
            return Ok(AttemptOutcome::Answer(Some((answer, false))));
        }
        match link.check_time(since_us(bus, started)) {
            Err(error) if heard_any => return Ok(AttemptOutcome::Broken(error)),
            Err(_) => return Ok(AttemptOutcome::Nothing),
            Ok(_) => {}
        }
    }
    Ok(AttemptOutcome::Broken(TransferError::Timeout))
}

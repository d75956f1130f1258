//! A command to a monitor over a real bus: sent as one ISO-TP message, answered with the monitor's own code.

use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use rotor_edge_core::can::isotp::{IsoTp, Progress, TransferError};
use rotor_edge_core::can::{Frame, Message, TYPE_TO_HOST, TYPE_TO_NODE, frame_id};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, Detail, KEY_BYTES, Key, MAX_COUNTER_STEP, MAX_REQUEST_BYTES, Outcome,
    write_request,
};
use rotor_edge_core::model::ModelError;
use rotor_edge_core::state::{NodeState, Status};
use rotor_edge_core::thresholds::{ThresholdError, Thresholds};

use crate::bus::CanBus;
use crate::node::{from_hex, to_hex};

/// Longest wait for a frame before the clock is looked at.
const PATIENCE: Duration = Duration::from_millis(2);
/// Longest time a monitor may take to check, store and answer.
const ANSWER_TIME: Duration = Duration::from_secs(5);
/// Times that a command is sent, and that a monitor which says nothing at all is asked.
const ATTEMPTS: usize = 20;
const SILENT_ATTEMPTS: usize = 2;
/// Wait after a transfer that broke off: the monitor gives up on it, and on its own answer, after a second.
const BACK_OFF: Duration = Duration::from_millis(1_050);
/// Wait for an answer with the right code after one without it.
const DOUBT_TIME: Duration = Duration::from_millis(500);
/// Longest wait for a sign of life.
pub const HEARTBEAT_TIME: Duration = Duration::from_secs(3);

/// Who may command one monitor: its key, and the number of the next command.
#[derive(Debug, Clone)]
pub struct Authority {
    key: Key,
    node: u8,
    counter: u64,
}

impl Authority {
    /// Commands are numbered from `counter` on; the present time in milliseconds if absent.
    ///
    /// # Errors
    /// If there is none and this machine's clock stands before 1970.
    pub fn new(key: Key, node: u8, counter: Option<u64>) -> Result<Self> {
        let counter = match counter {
            Some(counter) => counter,
            None => {
                let since = SystemTime::now().duration_since(UNIX_EPOCH);
                since.context("this machine's clock stands before 1970: give --counter")?.as_millis() as u64
            }
        };
        Ok(Self { key, node, counter })
    }

    /// Which monitor.
    pub fn node(&self) -> u8 {
        self.node
    }

    /// Number of the next command.
    pub fn counter(&self) -> u64 {
        self.counter
    }

    /// Sends a command and waits for its answer; `progress` hears how many bytes are on their way.
    ///
    /// # Errors
    /// If nobody answers, or the monitor refuses: why, and what to do.
    pub fn command(
        &mut self,
        bus: &mut dyn CanBus,
        what: Command,
        body: &[u8],
        progress: impl FnMut(usize),
    ) -> Result<Answer> {
        let counter = self.counter;
        self.counter = counter.saturating_add(1);
        command(bus, &self.key, self.node, counter, what, body, progress)
    }

    /// What the monitor judges by.
    ///
    /// # Errors
    /// As [`Self::command`].
    pub fn thresholds(&mut self, bus: &mut dyn CanBus) -> Result<Thresholds> {
        let answer = self.command(bus, Command::GetThresholds, &[], |_| ())?;
        answer.thresholds.with_context(|| format!("monitor {} does not tell its thresholds", self.node))
    }
}

/// Sends a command to `node` and waits for its answer; `progress` hears how many bytes are on their way. A transfer that
/// breaks off is made again: the command keeps its number, so that it is carried out once.
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
            Heard::Answer(Some((answer, true)))
                if was_sent && answer.outcome == Outcome::Replayed && answer.counter == counter =>
            {
                return Ok(Answer { outcome: Outcome::Accepted, ..answer });
            }
            Heard::Answer(Some((answer, false))) if answer.outcome != Outcome::NoKey && unconfirmed == 0 => {
                unconfirmed += 1;
            }
            Heard::Answer(answer) => return judge(node, counter, answer),
            Heard::Nothing if silent == SILENT_ATTEMPTS - 1 => bail!(
                "monitor {node} does not answer on {}: is it on this bus, under this number? (`rotor-edge watch` shows \
                 who is)",
                bus.description()
            ),
            // a monitor that has just started listens before it speaks
            Heard::Nothing => silent += 1,
            Heard::Broken(error) => {
                broken = Some(error);
                quiet(bus, BACK_OFF)?;
            }
        }
    }
    let why = broken.map_or("its answers were not to be trusted".into(), |error| format!("{error:?}"));
    bail!(
        "{ATTEMPTS} transfers to monitor {node} broke off, the last because of {why}: the bus loses frames. Whether the command \
         was carried out is not known; the same with --counter {counter} does no harm"
    )
}

/// What became of one transfer.
enum Heard {
    /// An answer, and whether it bears the code of our key; `None` if it is of another version of the protocol.
    Answer(Option<(Answer, bool)>),
    /// It broke off.
    Broken(TransferError),
    /// Nothing at all of the monitor.
    Nothing,
}

/// Lets what is still on its way pass.
fn quiet(bus: &mut dyn CanBus, time: Duration) -> Result<()> {
    let started = Instant::now();
    while started.elapsed() < time {
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
) -> Result<Heard> {
    let mut link = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
    let started = Instant::now();
    let now_us = || started.elapsed().as_micros() as u64;
    if let Err(error) = link.send(now_us(), request) {
        return Ok(Heard::Broken(error));
    }
    let (mut sent, mut heard_any, mut doubtful) = (0, false, None);
    while started.elapsed() < ANSWER_TIME {
        while let Some(payload) = link.poll(now_us()) {
            let frame = Frame::standard(frame_id(TYPE_TO_NODE, node), &payload);
            bus.send(&frame.context("a node number from 0 to 30")?)?;
            sent += payload.len() - 1;
            progress(sent.min(request.len()));
        }
        let heard = bus.receive(PATIENCE)?;
        if let Some(frame) = heard.filter(|f| f.raw_id() == frame_id(TYPE_TO_HOST, node)) {
            heard_any = true;
            match link.receive(now_us(), frame.bytes()) {
                Progress::None => {}
                Progress::Complete => match Answer::decode(link.message(), request, key) {
                    Some((answer, false)) => {
                        doubtful.get_or_insert((answer, Instant::now()));
                    }
                    answer => return Ok(Heard::Answer(answer)),
                },
                Progress::Broken(error) => return Ok(Heard::Broken(error)),
            }
        }
        if let Some((answer, since)) = doubtful
            && since.elapsed() > DOUBT_TIME
        {
            return Ok(Heard::Answer(Some((answer, false))));
        }
        match link.check_time(now_us()) {
            Err(error) if heard_any => return Ok(Heard::Broken(error)),
            Err(_) => return Ok(Heard::Nothing),
            Ok(_) => {}
        }
    }
    Ok(Heard::Broken(TransferError::Timeout))
}

fn judge(node: u8, counter: u64, answer: Option<(Answer, bool)>) -> Result<Answer> {
    let Some((answer, confirmed)) = answer else {
        bail!(
            "monitor {node} answers in another version of the protocol; update its firmware or this program"
        );
    };
    let refusal = match answer.outcome {
        Outcome::NoKey => format!("monitor {node} was given no key, so it takes no commands"),
        // its answer carries the code of the monitor's own key, which is not ours
        _ if !confirmed => format!(
            "monitor {node} has another key (or somebody else answers in its name): use the key that was made for it"
        ),
        Outcome::Accepted => return Ok(answer),
        Outcome::Replayed => format!(
            "monitor {node} has accepted command {} already and {counter} is not above it: \
             set this machine's clock right, or give --counter {}",
            answer.counter,
            answer.counter.saturating_add(1)
        ),
        Outcome::Counter => format!(
            "monitor {node} has accepted command {} and {counter} is too far above it: numbers may rise by {MAX_COUNTER_STEP} at most, give --counter {}",
            answer.counter,
            answer.counter.saturating_add(1)
        ),
        Outcome::Model => {
            format!("monitor {node} refuses the model{}; the old one stays", why_model(answer.detail))
        }
        Outcome::Thresholds => {
            let which = match answer.detail {
                Detail::Thresholds(error) => out_of_bounds(error),
                _ => "they are out of their bounds".into(),
            };
            format!("monitor {node} refuses the thresholds: {which}; the old ones stay")
        }
        Outcome::Malformed => format!(
            "monitor {node} does not know this command: its firmware is older or newer than this program"
        ),
        Outcome::Storage => format!("monitor {node} could not store the command; nothing was changed"),
        outcome => format!("monitor {node} refuses the command: {outcome:?}"),
    };
    bail!(refusal)
}

fn why_model(detail: Detail) -> String {
    let Detail::Model { error, asked, held } = detail else { return String::new() };
    match error {
        ModelError::Probes => format!(": it has {asked} probes, the firmware holds {held}"),
        ModelError::Planes if held > 0 && asked > held => {
            format!(": it has {asked} planes, the firmware holds {held}")
        }
        ModelError::BasisSize => {
            format!(": it has {asked} basis shapes a plane, the firmware needs {held}")
        }
        ModelError::Schema => {
            ": the firmware speaks another version of models; update the older of the two".into()
        }
        error => format!(" because of {error:?}"),
    }
}

/// Which threshold is out of its bounds, and what they are.
pub fn out_of_bounds(error: ThresholdError) -> String {
    let bounds = match error {
        ThresholdError::Encoding => "they are those of another version",
        ThresholdError::Rise => "rise is to be from 0 to 100",
        ThresholdError::RatioLimit => "ratio_limit is to be from 0 to 10",
        ThresholdError::RatioFloor => "ratio_floor is to be from 0 to 1",
        ThresholdError::Floor => "floor_um is to be from 0 to 1000 µm",
        ThresholdError::Average => "average_s is to be from 0 s to an hour",
        ThresholdError::Persistence => {
            "persistence_s is to be from 0 s to 30 days, persistence_readings from 1 to 255"
        }
        ThresholdError::Level => "level_s is to be above 0 s and up to 10 years",
        ThresholdError::Learning => {
            "learning_s is to be from 0 s to 30 days, learning_readings from 1 to 255"
        }
        ThresholdError::Growth => "growth is to be from 1 to 10, growth_s above 0 s and up to a year",
        ThresholdError::AgeLimit => "age_limit_s is to be from 0.1 s to 10 years",
        ThresholdError::GapRange => "gap_range_v is to be two ascending voltages within ±100 V",
        _ => return format!("{error:?} is out of its bounds"),
    };
    bounds.into()
}

/// Waits until `node` shows itself on the bus, ready to answer; how many frames were heard meanwhile.
///
/// # Errors
/// If it does not within [`HEARTBEAT_TIME`], or its number is used twice.
pub fn await_heartbeat(bus: &mut dyn CanBus, node: u8) -> Result<u64> {
    let started = Instant::now();
    let mut heard_frames = 0;
    while started.elapsed() < HEARTBEAT_TIME {
        let Some(frame) = bus.receive(PATIENCE)? else { continue };
        heard_frames += 1;
        match Message::decode(&frame) {
            Ok((from, Message::Heartbeat { state, .. })) if from == node => match state {
                NodeState::Listening => {}
                _ => return Ok(heard_frames),
            },
            // in a conflict, a monitor says nothing else
            Ok((from, Message::State(Status { state: NodeState::Conflict, .. }))) if from == node => bail!(
                "two devices on {} call themselves monitor {node}: give one of them another number",
                bus.description()
            ),
            _ => {}
        }
    }
    bail!(no_monitor(bus, node))
}

/// What `node` says of itself next.
///
/// # Errors
/// If it says nothing within [`HEARTBEAT_TIME`].
pub fn await_status(bus: &mut dyn CanBus, node: u8) -> Result<Status> {
    let started = Instant::now();
    while started.elapsed() < HEARTBEAT_TIME {
        let heard = bus.receive(PATIENCE)?;
        if let Some(Ok((from, Message::State(status)))) = heard.map(|frame| Message::decode(&frame))
            && from == node
        {
            return Ok(status);
        }
    }
    bail!(no_monitor(bus, node))
}

fn no_monitor(bus: &mut dyn CanBus, node: u8) -> String {
    format!(
        "no monitor {node} on {}: start one with `rotor-edge node --bus BUS --rotor ROTOR.toml`, or see who is there with `rotor-edge watch`",
        bus.description()
    )
}

/// Bytes of a memory that nobody wrote a key to.
const EMPTY: [u8; 2] = [0x00, 0xff];

/// Reads a device's key: 64 hexadecimal digits.
///
/// # Errors
/// If the file is missing or holds something else, if it is an empty memory's, or if others than its owner may write
/// it.
pub fn read_key(path: &Path) -> Result<Key> {
    let text = std::fs::read_to_string(path).with_context(|| {
        format!("{}: cannot be read; `rotor-edge key -o FILE` makes a key", path.display())
    })?;
    let bytes = from_hex(text.trim()).and_then(|bytes| <[u8; KEY_BYTES]>::try_from(bytes).ok());
    let Some(bytes) = bytes else {
        bail!("{}: expected a key of {} hexadecimal digits", path.display(), 2 * KEY_BYTES);
    };
    if EMPTY.iter().any(|empty| bytes.iter().all(|byte| byte == empty)) {
        bail!("{}: expected a key made at random, as `rotor-edge key -o FILE` makes it", path.display());
    }
    check_writers(path)?;
    Ok(Key(bytes))
}

/// Who can write a key can replace it by one of his own.
#[cfg(unix)]
fn check_writers(path: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    const OTHERS_WRITE: u32 = 0o022;
    if std::fs::metadata(path)?.permissions().mode() & OTHERS_WRITE != 0 {
        bail!("{}: can be written by others than its owner; chmod 600 it, or make a new key", path.display());
    }
    Ok(())
}

#[cfg(not(unix))]
fn check_writers(_: &Path) -> Result<()> {
    Ok(())
}

/// Writes a new random key, readable by its owner alone; never over an old one.
///
/// # Errors
/// If there is such a file, or it cannot be written.
pub fn write_new_key(path: &Path) -> Result<()> {
    use std::io::Write as _;
    let mut bytes = [0; KEY_BYTES];
    getrandom::fill(&mut bytes).context("the system gives no random numbers")?;
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).with_context(|| format!("{}: cannot be written", path.display()))?;
    writeln!(file, "{}", to_hex(&bytes))?;
    Ok(file.sync_all()?)
}

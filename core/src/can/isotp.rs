//! ISO-TP (ISO 15765-2, normal addressing, classic CAN): messages of up to 4095 bytes over frames of eight.
//!
//! Nothing here sends: payloads and times come in, payloads to send come out of [`IsoTp::poll`]. One [`IsoTp`] is one end
//! of a pair of identifiers, so that a request and its answer may overlap.
//!
//! The standard breaks a message off when a frame comes twice. Gateways do repeat frames, so here the consecutive frame that
//! came last is passed over when it comes again, byte for byte, and a first frame that comes again is answered again: its
//! sender may not have heard the flow control.

use heapless::Vec;

/// Consecutive frames between two flow controls that this end asks for.
pub const BLOCK_SIZE: u8 = 8;
/// Longest wait for the other end's next frame, µs (N_Bs and N_Cr of the standard).
pub const TIMEOUT_US: u64 = 1_000_000;
/// Flow controls in a row that may say "wait".
pub const MAX_WAITS: u8 = 10;
/// Longest message: the length has twelve bits.
pub const MAX_LENGTH: usize = 0xfff;

const PADDING: u8 = 0xcc;
const SINGLE_BYTES: usize = 7;
const FIRST_BYTES: usize = 6;

/// Why a message did not get across.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TransferError {
    /// A consecutive frame is missing or out of order.
    Sequence,
    /// The other end fell silent.
    Timeout,
    /// Longer than the receiver's buffer, or empty.
    Length,
    /// Another message began before this one ended.
    Interrupted,
    /// The receiver's flow control is not one of the standard's, or asked to wait too often.
    FlowControl,
    /// A message is still being sent.
    Busy,
    /// The parts do not make the message that was offered.
    Checksum,
}

/// What a received payload led to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    None,
    /// A message is whole: see [`IsoTp::message`].
    Complete,
    /// The message under way is lost.
    Broken(TransferError),
}

pub type Payload = [u8; 8];

/// One end of a connection that receives up to `RX` and sends up to `TX` bytes.
///
/// ```
/// use rotor_edge_core::can::isotp::{IsoTp, Progress};
/// let (mut host, mut node) = (IsoTp::<16, 64>::new(), IsoTp::<64, 16>::new());
/// host.send(0, b"twenty bytes of text").unwrap();
/// for time_us in 0..4 {
///     while let Some(payload) = host.poll(time_us) {
///         if node.receive(time_us, &payload) == Progress::Complete {
///             assert_eq!(node.message(), b"twenty bytes of text");
///         }
///     }
///     while let Some(payload) = node.poll(time_us) {
///         host.receive(time_us, &payload);
///     }
/// }
/// assert!(!host.is_sending());
/// ```
#[derive(Debug, Clone)]
pub struct IsoTp<const RX: usize, const TX: usize> {
    incoming: Incoming<RX>,
    outgoing: Outgoing<TX>,
}

impl<const RX: usize, const TX: usize> Default for IsoTp<RX, TX> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const RX: usize, const TX: usize> IsoTp<RX, TX> {
    pub fn new() -> Self {
        Self { incoming: Incoming::new(), outgoing: Outgoing::new() }
    }

    /// Begins to send a message.
    ///
    /// Errors: [`TransferError::Busy`], and [`TransferError::Length`] if it is empty or longer than `TX` or 4095 bytes.
    pub fn send(&mut self, time_us: u64, message: &[u8]) -> Result<(), TransferError> {
        self.outgoing.begin(time_us, message)
    }

    /// A message is on its way out.
    pub fn is_sending(&self) -> bool {
        !matches!(self.outgoing.stage, Sending::Idle)
    }

    /// Takes a payload of the other end, of any length.
    pub fn receive(&mut self, time_us: u64, payload: &[u8]) -> Progress {
        match payload.split_first() {
            Some((&first, rest)) if first >> 4 == 3 => self
                .outgoing
                .flow_control(time_us, first & 0xf, rest)
                .map_or_else(Progress::Broken, |()| Progress::None),
            _ => self.incoming.receive(time_us, payload),
        }
    }

    /// The message last completed; empty once another begins.
    pub fn message(&self) -> &[u8] {
        match self.incoming.stage {
            Receiving::Complete => &self.incoming.bytes,
            _ => &[],
        }
    }

    /// Room for a message that comes in another way; one that is under way in this way is lost.
    #[cfg(feature = "command")]
    pub(crate) fn buffer(&mut self) -> &mut Vec<u8, RX> {
        self.incoming.stage = Receiving::Idle;
        &mut self.incoming.bytes
    }

    #[cfg(feature = "command")]
    pub(crate) fn buffered(&self) -> &[u8] {
        &self.incoming.bytes
    }

    /// Gives up on an end that fell silent; to be called often while a message is under way.
    pub fn check_time(&mut self, time_us: u64) -> Result<(), TransferError> {
        let received = self.incoming.check_time(time_us);
        self.outgoing.check_time(time_us).and(received)
    }

    /// When [`IsoTp::check_time`] or [`IsoTp::poll`] has something to do; `None` while nothing is under way.
    pub fn poll_at(&self) -> Option<u64> {
        if self.incoming.flow_control.is_some() {
            return Some(0);
        }
        let received = match self.incoming.stage {
            Receiving::Open { since_us, .. } => Some(timed_out_us(since_us)),
            _ => None,
        };
        let sent = match self.outgoing.stage {
            Sending::Idle => None,
            Sending::Waiting { since_us, .. } => Some(timed_out_us(since_us)),
            Sending::Block { next_us, .. } => Some(next_us),
            Sending::Begin => Some(0),
        };
        match (received, sent) {
            (Some(received), Some(sent)) => Some(received.min(sent)),
            _ => received.or(sent),
        }
    }

    /// The next payload to send, if one is due.
    pub fn poll(&mut self, time_us: u64) -> Option<Payload> {
        self.incoming.flow_control.take().or_else(|| self.outgoing.next(time_us))
    }
}

#[derive(Debug, Clone, Copy)]
enum Receiving {
    Idle,
    Open { length: usize, index: u8, left_in_block: u8, since_us: u64 },
    Complete,
}

#[derive(Debug, Clone)]
struct Incoming<const RX: usize> {
    bytes: Vec<u8, RX>,
    stage: Receiving,
    flow_control: Option<Payload>,
}

impl<const RX: usize> Incoming<RX> {
    fn new() -> Self {
        Self { bytes: Vec::new(), stage: Receiving::Idle, flow_control: None }
    }

    fn receive(&mut self, time_us: u64, payload: &[u8]) -> Progress {
        match *payload {
            [first, ref data @ ..] if first >> 4 == 0 => self.single(usize::from(first & 0xf), data),
            [first, second, ref data @ ..] if first >> 4 == 1 => {
                self.first(time_us, usize::from(first & 0xf) << 8 | usize::from(second), data)
            }
            [first, ref data @ ..] if first >> 4 == 2 => self.consecutive(time_us, first & 0xf, data),
            // reserved kinds are ignored, as the standard asks
            _ => Progress::None,
        }
    }

    fn single(&mut self, length: usize, data: &[u8]) -> Progress {
        let Some(message) = data.get(..length).filter(|message| !message.is_empty()) else {
            return Progress::None;
        };
        self.bytes.clear();
        if self.bytes.extend_from_slice(message).is_err() {
            return self.broken(TransferError::Length);
        }
        // a message it interrupts is lost, which its sender learns by time-out
        self.stage = Receiving::Complete;
        Progress::Complete
    }

    fn first(&mut self, time_us: u64, length: usize, data: &[u8]) -> Progress {
        let comes_again = |begun: usize| begun == length && self.bytes.as_slice() == data;
        let interrupted = matches!(self.stage, Receiving::Open { length: begun, .. } if !comes_again(begun));
        if length <= SINGLE_BYTES || data.len() != FIRST_BYTES {
            return Progress::None;
        }
        self.bytes.clear();
        if length > RX || self.bytes.extend_from_slice(data).is_err() {
            self.flow_control = Some(padded(&[0x32, 0, 0]));
            return self.broken(TransferError::Length);
        }
        self.flow_control = Some(padded(&[0x30, BLOCK_SIZE, 0]));
        self.stage = Receiving::Open { length, index: 1, left_in_block: BLOCK_SIZE, since_us: time_us };
        if interrupted { Progress::Broken(TransferError::Interrupted) } else { Progress::None }
    }

    fn consecutive(&mut self, time_us: u64, number: u8, data: &[u8]) -> Progress {
        let Receiving::Open { length, index, left_in_block, .. } = self.stage else {
            return Progress::None;
        };
        let came_last = index.wrapping_sub(1) & 0xf;
        if number == came_last && self.bytes.len() > FIRST_BYTES && self.bytes.ends_with(data) {
            return Progress::None;
        }
        let missing = length.saturating_sub(self.bytes.len());
        let part = missing.min(SINGLE_BYTES);
        let Some(data) = data.get(..part) else {
            return self.broken(TransferError::Sequence);
        };
        if number != index || self.bytes.extend_from_slice(data).is_err() {
            return self.broken(TransferError::Sequence);
        }
        if part == missing {
            self.stage = Receiving::Complete;
            return Progress::Complete;
        }
        let left_in_block = match left_in_block.saturating_sub(1) {
            0 => {
                self.flow_control = Some(padded(&[0x30, BLOCK_SIZE, 0]));
                BLOCK_SIZE
            }
            left => left,
        };
        let index = index.wrapping_add(1) & 0xf;
        self.stage = Receiving::Open { length, index, left_in_block, since_us: time_us };
        Progress::None
    }

    fn check_time(&mut self, time_us: u64) -> Result<(), TransferError> {
        match self.stage {
            Receiving::Open { since_us, .. } if time_us.saturating_sub(since_us) > TIMEOUT_US => {
                self.stage = Receiving::Idle;
                Err(TransferError::Timeout)
            }
            _ => Ok(()),
        }
    }

    fn broken(&mut self, error: TransferError) -> Progress {
        self.stage = Receiving::Idle;
        Progress::Broken(error)
    }
}

#[derive(Debug, Clone, Copy)]
enum Sending {
    Idle,
    /// The whole message, or its first frame, is to be sent.
    Begin,
    Waiting {
        since_us: u64,
        waits: u8,
    },
    /// `left_in_block` is `None` where the receiver set no limit.
    Block {
        left_in_block: Option<u8>,
        separation_us: u64,
        next_us: u64,
    },
}

#[derive(Debug, Clone)]
struct Outgoing<const TX: usize> {
    bytes: Vec<u8, TX>,
    sent: usize,
    index: u8,
    stage: Sending,
}

impl<const TX: usize> Outgoing<TX> {
    fn new() -> Self {
        Self { bytes: Vec::new(), sent: 0, index: 0, stage: Sending::Idle }
    }

    fn begin(&mut self, time_us: u64, message: &[u8]) -> Result<(), TransferError> {
        self.check_time(time_us)?;
        if !matches!(self.stage, Sending::Idle) {
            return Err(TransferError::Busy);
        }
        if message.is_empty() || message.len() > MAX_LENGTH {
            return Err(TransferError::Length);
        }
        self.bytes.clear();
        self.bytes.extend_from_slice(message).map_err(|_| TransferError::Length)?;
        (self.sent, self.index, self.stage) = (0, 0, Sending::Begin);
        Ok(())
    }

    fn next(&mut self, time_us: u64) -> Option<Payload> {
        match self.stage {
            Sending::Begin if self.bytes.len() <= SINGLE_BYTES => {
                self.stage = Sending::Idle;
                Some(headed(self.bytes.len() as u8, &self.bytes))
            }
            Sending::Begin => {
                self.stage = Sending::Waiting { since_us: time_us, waits: 0 };
                let [low, high, ..] = self.bytes.len().to_le_bytes();
                let [a, b, c, d, e, f] = *self.bytes.first_chunk::<FIRST_BYTES>()?;
                self.sent = FIRST_BYTES;
                Some([0x10 | high, low, a, b, c, d, e, f])
            }
            Sending::Block { left_in_block, separation_us, next_us } if time_us >= next_us => {
                let rest = self.bytes.get(self.sent..)?;
                let part = rest.get(..rest.len().min(SINGLE_BYTES))?;
                self.index = self.index.wrapping_add(1) & 0xf;
                let payload = headed(0x20 | self.index, part);
                self.sent = self.sent.saturating_add(part.len());
                let left_in_block = left_in_block.map(|left| left.saturating_sub(1));
                self.stage = if self.sent >= self.bytes.len() {
                    Sending::Idle
                } else if left_in_block == Some(0) {
                    Sending::Waiting { since_us: time_us, waits: 0 }
                } else {
                    let next_us = time_us.saturating_add(separation_us);
                    Sending::Block { left_in_block, separation_us, next_us }
                };
                Some(payload)
            }
            _ => None,
        }
    }

    fn flow_control(&mut self, time_us: u64, status: u8, rest: &[u8]) -> Result<(), TransferError> {
        let Sending::Waiting { waits, .. } = self.stage else {
            return Ok(());
        };
        let (block, separation) = match *rest {
            [block, separation, ..] => (block, separation),
            _ => (0, 0),
        };
        self.stage = match status {
            0 => Sending::Block {
                left_in_block: (block > 0).then_some(block),
                separation_us: separation_us(separation),
                next_us: time_us,
            },
            1 if waits < MAX_WAITS => Sending::Waiting { since_us: time_us, waits: waits.saturating_add(1) },
            _ => Sending::Idle,
        };
        match (status, self.stage) {
            (2, _) => Err(TransferError::Length),
            (_, Sending::Idle) => Err(TransferError::FlowControl),
            _ => Ok(()),
        }
    }

    fn check_time(&mut self, time_us: u64) -> Result<(), TransferError> {
        match self.stage {
            Sending::Waiting { since_us, .. } if time_us.saturating_sub(since_us) > TIMEOUT_US => {
                self.stage = Sending::Idle;
                Err(TransferError::Timeout)
            }
            _ => Ok(()),
        }
    }
}

/// The first time at which an end that was heard last at `since_us` has been silent for too long.
fn timed_out_us(since_us: u64) -> u64 {
    since_us.saturating_add(TIMEOUT_US).saturating_add(1)
}

/// The shortest time between consecutive frames that a receiver asked for; reserved values mean the longest.
fn separation_us(code: u8) -> u64 {
    match code {
        0..=0x7f => u64::from(code) * 1000,
        0xf1..=0xf9 => u64::from(code & 0xf) * 100,
        _ => 127_000,
    }
}

fn padded(bytes: &[u8]) -> Payload {
    let mut payload = [PADDING; 8];
    for (place, &byte) in payload.iter_mut().zip(bytes) {
        *place = byte;
    }
    payload
}

fn headed(head: u8, data: &[u8]) -> Payload {
    let mut payload = padded(&[head]);
    for (place, &byte) in payload.iter_mut().skip(1).zip(data) {
        *place = byte;
    }
    payload
}

#[cfg(test)]
mod tests;

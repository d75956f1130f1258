//! ISO-TP (ISO 15765-2, normal addressing, classic CAN): messages of up to 4095 bytes over frames of eight.
//!
//! Nothing here sends: payloads and times come in, payloads to send come out of [`IsoTp::poll`]. One [`IsoTp`] is one end
//! of a pair of identifiers, so that a request and its answer may overlap.
//!
//! The standard breaks a message off when a frame comes twice. Gateways do repeat frames, so here the consecutive frame that
//! came last is passed over when it comes again, byte for byte, and a first frame that comes again is answered again: its
//! sender may not have heard the flow control.

mod incoming;
mod outgoing;
#[cfg(test)]
mod tests;

use core::error::Error;
use core::fmt;

#[cfg(feature = "command")]
use heapless::Vec;

use incoming::{Incoming, Receiving};
use outgoing::{Outgoing, Sending};

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

impl fmt::Display for TransferError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Sequence => "a consecutive frame is missing or out of order",
            Self::Timeout => "the other end sent nothing for too long",
            Self::Length => "the message is empty or longer than the receiver's buffer",
            Self::Interrupted => "another message began before this one ended",
            Self::FlowControl => {
                "the receiver's flow control is invalid, or it asked to wait more than ten times"
            }
            Self::Busy => "an earlier message is still being sent",
            Self::Checksum => "the parts do not have the checksum of the message that was offered",
        })
    }
}

impl Error for TransferError {}

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

/// The first time at which an end that was heard last at `since_us` has been silent for too long.
fn timed_out_us(since_us: u64) -> u64 {
    since_us.saturating_add(TIMEOUT_US).saturating_add(1)
}

fn padded(bytes: &[u8]) -> Payload {
    let mut payload = [PADDING; 8];
    for (place, &byte) in payload.iter_mut().zip(bytes) {
        *place = byte;
    }
    payload
}

//! A classic CAN data frame with a standard identifier.

use embedded_can::{Id, StandardId};

use super::message::{
    TYPE_ACK, TYPE_ANSWER_PART, TYPE_HEARTBEAT, TYPE_MODEL, TYPE_RESULT_END, TYPE_STATUS, TYPE_TO_HOST,
    TYPE_TO_NODE, TYPE_VERSION,
};
#[cfg(feature = "mac")]
use super::message::{TYPE_READING_CODE, TYPE_READING_NONCE, TYPE_TOLD_CODE, TYPE_TOLD_NONCE};

/// Highest number of a node.
pub const MAX_NODE: u8 = 30;
/// Reserved: every node.
pub const BROADCAST_NODE: u8 = 31;

const NODE_BITS: u32 = 5;
const NODE_MASK: u16 = (1 << NODE_BITS) - 1;
const TYPE_MASK: u16 = 0x3f;

/// Identifier of a message type (6 bits) for a node (5 bits).
#[inline]
pub const fn frame_id(message_type: u8, node: u8) -> u16 {
    ((message_type as u16 & TYPE_MASK) << NODE_BITS) | (node as u16 & NODE_MASK)
}

/// A data frame: 11-bit identifier, up to eight bytes. Always valid; no remote frames, no extended identifiers.
///
/// ```
/// use rotor_edge_core::can::{Frame, frame_id};
/// let frame = Frame::standard(frame_id(8, 3), &[1, 2, 3]).unwrap();
/// assert_eq!((frame.message_type(), frame.node(), frame.bytes()), (8, 3, &[1, 2, 3][..]));
/// assert!(Frame::standard(0x800, &[]).is_none());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    id: StandardId,
    length: u8,
    payload: [u8; 8],
}

impl Frame {
    /// `None` if the identifier exceeds 0x7FF or there are more than eight bytes.
    pub fn standard(id: u16, bytes: &[u8]) -> Option<Self> {
        let id = StandardId::new(id)?;
        let mut payload = [0; 8];
        if bytes.len() > payload.len() {
            return None;
        }
        for (place, &byte) in payload.iter_mut().zip(bytes) {
            *place = byte;
        }
        Some(Self { id, length: bytes.len() as u8, payload })
    }

    /// A frame of eight bytes; only the low bits of type and node count.
    pub fn full(message_type: u8, node: u8, payload: [u8; 8]) -> Self {
        let id = StandardId::new(frame_id(message_type, node)).unwrap_or(StandardId::MAX);
        Self { id, length: 8, payload }
    }

    pub(crate) fn empty(message_type: u8, node: u8) -> Self {
        Self { length: 0, ..Self::full(message_type, node, [0; 8]) }
    }

    /// The 11-bit identifier.
    pub fn raw_id(&self) -> u16 {
        self.id.as_raw()
    }

    /// Upper six bits of the identifier.
    pub fn message_type(&self) -> u8 {
        (self.raw_id() >> NODE_BITS) as u8
    }

    /// Lower five bits of the identifier.
    pub fn node(&self) -> u8 {
        (self.raw_id() & NODE_MASK) as u8
    }

    /// Only a monitor with this node number sends frames of this type.
    pub(crate) fn is_from_node(&self) -> bool {
        #[cfg(feature = "mac")]
        if matches!(self.message_type(), TYPE_TOLD_NONCE | TYPE_TOLD_CODE) {
            return true;
        }
        matches!(
            self.message_type(),
            TYPE_STATUS..=TYPE_RESULT_END
                | TYPE_HEARTBEAT..=TYPE_MODEL
                | TYPE_TO_HOST
                | TYPE_ACK..=TYPE_ANSWER_PART
                | TYPE_VERSION
        )
    }

    /// Whether this frame is one of the two that carry a MAC, in either direction. [`Message`](super::Message) does not
    /// decode it.
    #[cfg(feature = "mac")]
    pub fn is_mac(&self) -> bool {
        matches!(
            self.message_type(),
            TYPE_READING_NONCE | TYPE_READING_CODE | TYPE_TOLD_NONCE | TYPE_TOLD_CODE
        )
    }

    /// It carries a command or an answer, in either way: no [`Message`](super::Message) of its own.
    pub fn is_transfer(&self) -> bool {
        (TYPE_TO_NODE..=TYPE_ANSWER_PART).contains(&self.message_type())
    }

    pub fn bytes(&self) -> &[u8] {
        self.payload.get(..usize::from(self.length)).unwrap_or_default()
    }

    /// All eight bytes, `None` for a shorter frame.
    pub fn full_payload(&self) -> Option<&[u8; 8]> {
        (self.length == 8).then_some(&self.payload)
    }
}

impl embedded_can::Frame for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        match id.into() {
            Id::Standard(id) => Self::standard(id.as_raw(), data),
            Id::Extended(_) => None,
        }
    }

    /// Always `None`: this protocol has no remote frames.
    fn new_remote(_: impl Into<Id>, _: usize) -> Option<Self> {
        None
    }

    fn is_extended(&self) -> bool {
        false
    }

    fn is_remote_frame(&self) -> bool {
        false
    }

    fn id(&self) -> Id {
        Id::Standard(self.id)
    }

    fn dlc(&self) -> usize {
        usize::from(self.length)
    }

    fn data(&self) -> &[u8] {
        self.bytes()
    }
}

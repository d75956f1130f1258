//! Frames on a CAN bus: identifiers, messages, and how readings and results are put together from them.
//!
//! | type | message | type | message |
//! |---|---|---|---|
//! | 8 | reading start | 16 | status |
//! | 9 to 12 | probe vector 1X 1Y 2X 2Y | 17, 18 | unbalance of plane 1, 2 |
//! | 13 | reading end | 19, 20 | static, dynamic unbalance |
//! | 32 | heartbeat | 21 | residual |
//! | 33, 34 | counters, discards | 22 | result end |
//! | 35, 36 | commands, transfers | 48, 49 | ISO-TP to the node, to the host |
//! | 62 | version | 63 | version query |
//!
//! The same as a DBC file: `rotor-edge.dbc` beside this crate's manifest; tests hold the two against each other.
//!
//! Identifier = type·32 + node: a lower type wins the bus whatever the node, and the frames of one reading have rising
//! identifiers in the order of sending. All numbers are little endian.

mod assembler;
mod counters;
mod frame;
pub mod isotp;
mod message;
mod result;
pub mod slcan;
#[cfg(test)]
mod tests;

pub use assembler::{Assembler, NumberedReading, READING_FRAMES, RESYNCHRONISE_AFTER, reading_frames};
pub use counters::Counters;
pub use frame::{BROADCAST_NODE, Frame, MAX_NODE, frame_id};
pub use message::{
    CanError, FLAG_AT_BOUND_1, FLAG_AT_BOUND_2, FLAG_FLAGGED, FLAG_SUSPICIOUS, Keyphasor, Message, NodeState,
    OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION, TYPE_READING_END, TYPE_READING_START, TYPE_RESULT_END,
    TYPE_STATUS, TYPE_TO_HOST, TYPE_TO_NODE, TYPE_VERSION, TYPE_VERSION_QUERY,
};
pub use result::{MonitorResult, RESULT_FRAMES, ResultAssembler, result_frames};

/// zlib's CRC-32 (Python: `binascii.crc32`) over whole payloads.
pub(crate) fn crc32<'a>(payloads: impl Iterator<Item = &'a [u8; 8]>) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = CRC.digest();
    for payload in payloads {
        digest.update(payload);
    }
    digest.finalize()
}

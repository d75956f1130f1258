//! Frames on a CAN bus: identifiers, messages, and how readings and results are put together from them.
//!
//! | type | message | type | message |
//! |---|---|---|---|
//! | 8 | reading start | 20 | status |
//! | 9 to 16 | vector of probe 1 to 8 | 21 to 24 | unbalance of plane 1 to 4 |
//! | 17, 18 | gap voltages of probes 1 to 4, 5 to 8 | 25, 26 | static, dynamic unbalance |
//! | 19 | reading end | 27, 28 | residual, limits |
//! | 32 | heartbeat | 29 | result end |
//! | 33 | state | 48, 49 | ISO-TP to the node, to the host |
//! | 34 to 43 | counters, two each | 62 | version |
//! | 44 | model | 50 to 53 | commands and answers in [numbered parts](parts) |
//! | 45, 46 | MAC of what a node tells | 30, 31 | MAC of a reading |
//! | | | 63 | version query |
//!
//! A reading has as many vectors as the machine has probes, and gap voltages only if some are stated; a result has as
//! many unbalances as the model has planes. The same as a DBC file: [`DBC`], which is `rotor-edge.dbc` beside this crate's
//! manifest; tests hold the two against each other.
//!
//! Identifier = type·32 + node: a lower type wins the bus whatever the node, and the frames of one reading have rising
//! identifiers in the order of sending. All numbers are little endian. Message authentication codes (MACs) are an option, the module `mac` of the
//! feature of that name.

mod assembler;
mod codec;
mod counters;
mod frame;
pub mod isotp;
#[cfg(feature = "mac")]
pub mod mac;
mod message;
pub mod parts;
mod result;
pub mod slcan;
#[cfg(test)]
mod tests;

use crate::checksum;
pub use crate::reading::Keyphasor;
pub use assembler::{Assembler, MAX_READING_FRAMES, NumberedReading, RESYNCHRONISE_AFTER, reading_frames};
pub use counters::{COUNTER_PAIRS, Counters};
pub use frame::{BROADCAST_NODE, Frame, MAX_NODE, frame_id};
pub use message::{
    CanError, FLAG_FLAGGED, FLAG_SUSPICIOUS, GAP_NOT_STATED_MV, Message, OLDEST_PROTOCOL_VERSION,
    PROTOCOL_VERSION, TYPE_ACK, TYPE_ANSWER_PART, TYPE_HEARTBEAT, TYPE_MODEL, TYPE_OFFER, TYPE_PART,
    TYPE_READING_END, TYPE_READING_START, TYPE_RESULT_END, TYPE_STATE, TYPE_STATUS, TYPE_TO_HOST,
    TYPE_TO_NODE, TYPE_VERSION, TYPE_VERSION_QUERY, flag_at_bound,
};
pub use result::{MAX_RESULT_FRAMES, MonitorResult, ResultAssembler, result_frames};

/// The frames of node 0 as a DBC file, for CAN tools.
pub const DBC: &str = include_str!("../rotor-edge.dbc");

/// zlib's CRC-32 (Python: `binascii.crc32`) over whole payloads.
pub(crate) fn crc32<'a>(payloads: impl Iterator<Item = &'a [u8; 8]>) -> u32 {
    let mut digest = checksum::begin();
    for payload in payloads {
        digest.update(payload);
    }
    digest.finalize()
}

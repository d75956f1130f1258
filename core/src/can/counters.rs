//! What became of the readings and commands sent to a node.

/// Counts since start; each wraps at 65,536.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Readings evaluated.
    pub readings: u16,
    /// Sequence numbers that never arrived whole, known from the gap when the next one did.
    pub lost: u16,
    /// Transmissions that ended but cannot be believed: wrong checksum or sequence at the end, or a speed or feature that
    /// cannot be.
    pub rejected: u16,
    /// Transmissions of the sequence number already received.
    pub repeated: u16,
    /// Transmissions of an older sequence number.
    pub late: u16,
    /// Transmissions cut short: time-out, a vector missing, or another start before the end.
    pub incomplete: u16,
    /// Vectors and ends without a start, and frames of a known type that cannot be decoded.
    pub stray: u16,
    /// Whole readings not evaluated because a probe or the keyphasor was lost, or while the
    /// node may not answer: just started, or its number in use by another.
    pub skipped: u16,
    /// Times a sender that started anew at an older sequence number was followed.
    pub resynchronised: u16,
    /// Frames not sent because the queue was full.
    pub overflowed: u16,
    /// Readings for which the model had no finite response.
    pub unsolved: u16,
    /// Commands carried out.
    pub accepted: u16,
    /// Commands that could not be carried out: malformed, a model that was refused, storage that failed, no key.
    pub refused: u16,
    /// Commands without the right authentication code.
    pub forged: u16,
    /// Commands with a counter that was used before.
    pub replayed: u16,
    /// Transfers of a command that never became whole.
    pub broken: u16,
    /// Frames that only this node may send, received from somebody else.
    pub conflicts: u16,
}

/// Adds to a counter that wraps.
pub(crate) fn count(counter: &mut u16, number: u16) {
    *counter = counter.wrapping_add(number);
}

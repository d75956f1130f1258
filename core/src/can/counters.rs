//! What became of the readings and commands sent to a node.

/// Messages that carry the counters beside the heartbeat's.
pub const COUNTER_PAIRS: usize = 10;

/// Counts since start; each wraps at 2³².
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Readings evaluated; carried by the heartbeat.
    pub readings: u32,
    /// Sequence numbers that never arrived whole, known from the gap when the next one did.
    pub lost: u32,
    /// Transmissions that ended but cannot be believed: wrong checksum or sequence at the end, or a speed or feature that
    /// cannot be.
    pub rejected: u32,
    /// Transmissions of the sequence number already received.
    pub repeated: u32,
    /// Transmissions of an older sequence number.
    pub late: u32,
    /// Transmissions cut short: time-out, a frame missing, or another start before the end.
    pub incomplete: u32,
    /// Frames of a reading without a start, and frames of a known type that cannot be decoded.
    pub stray: u32,
    /// Whole readings not evaluated because the keyphasor or every probe was lost, or while the node may not answer: just
    /// started, or its number in use by another.
    pub skipped: u32,
    /// Times a sender that started anew at an older sequence number was followed.
    pub resynchronised: u32,
    /// Frames not sent because the queue was full.
    pub overflowed: u32,
    /// Readings for which the model had no finite response, or whose rows do not determine the planes.
    pub unsolved: u32,
    /// Commands carried out.
    pub accepted: u32,
    /// Commands that could not be carried out: malformed, a model that was refused, storage that failed, no key.
    pub refused: u32,
    /// Commands without the right authentication code.
    pub forged: u32,
    /// Commands with a counter that was used before, or one too far ahead.
    pub replayed: u32,
    /// Transfers of a command that never became whole.
    pub broken: u32,
    /// Frames that only this node may send, received from somebody else.
    pub conflicts: u32,
    /// Readings evaluated although probes were missing.
    pub partial: u32,
    /// Whole readings heard while there was no model.
    pub unmodelled: u32,
    /// Times that what must survive a loss of power could not be stored.
    pub unsaved: u32,
    /// Changes of state that were announced.
    pub changes: u32,
}

impl Counters {
    /// All but the readings, in the order of sending.
    pub fn pairs(&self) -> [[u32; 2]; COUNTER_PAIRS] {
        [
            [self.lost, self.rejected],
            [self.repeated, self.late],
            [self.incomplete, self.stray],
            [self.skipped, self.resynchronised],
            [self.overflowed, self.unsolved],
            [self.accepted, self.refused],
            [self.forged, self.replayed],
            [self.broken, self.conflicts],
            [self.partial, self.unmodelled],
            [self.unsaved, self.changes],
        ]
    }

    /// Takes over what a message carries; a pair that is none changes nothing.
    pub fn set_pair(&mut self, pair: u8, [first, second]: [u32; 2]) {
        let places = match pair {
            0 => [&mut self.lost, &mut self.rejected],
            1 => [&mut self.repeated, &mut self.late],
            2 => [&mut self.incomplete, &mut self.stray],
            3 => [&mut self.skipped, &mut self.resynchronised],
            4 => [&mut self.overflowed, &mut self.unsolved],
            5 => [&mut self.accepted, &mut self.refused],
            6 => [&mut self.forged, &mut self.replayed],
            7 => [&mut self.broken, &mut self.conflicts],
            8 => [&mut self.partial, &mut self.unmodelled],
            9 => [&mut self.unsaved, &mut self.changes],
            _ => return,
        };
        let [one, two] = places;
        (*one, *two) = (first, second);
    }
}

/// Adds to a counter that wraps.
pub(crate) fn count(counter: &mut u32, number: u32) {
    *counter = counter.wrapping_add(number);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_counter_but_the_readings_travels_once() {
        let mut counters = Counters::default();
        for pair in 0..COUNTER_PAIRS as u8 {
            counters.set_pair(pair, [100 + 2 * u32::from(pair), 101 + 2 * u32::from(pair)]);
        }
        let sent = counters.pairs();
        assert!(sent.as_flattened().iter().copied().eq(100..120));
        counters.set_pair(COUNTER_PAIRS as u8, [1, 2]);
        assert_eq!(counters.pairs(), sent);
    }
}

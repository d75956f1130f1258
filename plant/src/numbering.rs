//! A monitor numbers its readings with 16 bits that wrap within two hours, and begins again when it restarts. With an epoch
//! that grows at either, every reading of years has its own number.

/// The same number within this time is the same reading, sent again; µs.
const REPEAT_US: i64 = 10_000_000;
/// A result is of one of the last so many readings.
const ANSWERED: i16 = 1_000;

/// The last number that was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Last {
    pub epoch: u64,
    pub sequence: u16,
    /// When, µs since 1970.
    pub time_us: i64,
}

/// Gives the readings and results of one monitor their epochs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Numbering {
    last: Option<Last>,
}

impl Numbering {
    /// Goes on behind what was given before.
    pub fn behind(last: Option<Last>) -> Self {
        Self { last }
    }

    /// Epoch of a reading. A number that is not ahead of the last one begins an epoch: whoever puts readings together has
    /// dropped late ones, so the sender has restarted or its numbers have wrapped.
    pub fn reading(&mut self, sequence: u16, time_us: i64) -> u64 {
        let epoch = match self.last {
            None => 0,
            Some(last) if sequence == last.sequence && time_us - last.time_us < REPEAT_US => last.epoch,
            Some(last) => last.epoch + u64::from(sequence <= last.sequence),
        };
        self.last = Some(Last { epoch, sequence, time_us });
        epoch
    }

    /// Epoch of a result: that of the reading which it answers, or its own where readings are not heard.
    pub fn result(&mut self, sequence: u16, time_us: i64) -> u64 {
        if let Some(last) = self.last {
            let behind = last.sequence.wrapping_sub(sequence) as i16;
            if (0..ANSWERED).contains(&behind) {
                // the reading may be from before a wrap
                return last.epoch.saturating_sub(u64::from(sequence > last.sequence));
            }
        }
        self.reading(sequence, time_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_US: i64 = 1_000_000;

    fn at(epoch: u64, sequence: u16) -> Numbering {
        Numbering::behind(Some(Last { epoch, sequence, time_us: 0 }))
    }

    #[test]
    fn numbers_go_on_over_a_wrap_a_restart_and_a_gap() {
        let mut numbers = Numbering::default();
        let given = [65_533, 65_535, 1, 2, 0, 1, 40_000, 5].map(|s| numbers.reading(s, SECOND_US));
        assert_eq!(given, [0, 0, 1, 1, 2, 2, 2, 3]);
    }

    #[test]
    fn same_number_soon_is_same_reading_and_later_another() {
        assert_eq!(at(4, 9).reading(9, SECOND_US), 4);
        assert_eq!(at(4, 9).reading(9, 3_600 * SECOND_US), 5);
    }

    #[test]
    fn a_result_has_the_epoch_of_its_reading_over_a_wrap_too() {
        assert_eq!(at(4, 9).result(9, SECOND_US), 4);
        assert_eq!(at(4, 9).result(3, SECOND_US), 4);
        assert_eq!(at(4, 1).result(65_535, SECOND_US), 3);
        assert_eq!(Numbering::default().result(7, SECOND_US), 0, "readings that are not heard");
        let mut alone = at(4, 9);
        assert_eq!([10, 11].map(|s| alone.result(s, SECOND_US)), [4, 4]);
    }
}

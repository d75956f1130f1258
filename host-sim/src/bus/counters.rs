//! A monitor's counters, as the frames of its heartbeat tell them.

use rotor_edge_core::can::{COUNTER_PAIRS, Counters, Message};

/// Names of the counters in the order of [`Counters::pairs`].
pub const NAMES: [[&str; 2]; COUNTER_PAIRS] = [
    ["lost", "rejected"],
    ["repeated", "late"],
    ["incomplete", "stray"],
    ["skipped", "resynchronised"],
    ["overflowed", "unsolved"],
    ["accepted", "refused"],
    ["forged", "replayed"],
    ["broken", "conflicts"],
    ["partial", "unmodelled"],
    ["unsaved", "changes"],
];

/// Puts what one frame tells into its place; other messages change nothing.
pub fn take(counters: &mut Counters, message: &Message) {
    match *message {
        Message::Heartbeat { readings, .. } => counters.readings = readings,
        Message::Counters { pair, values } => counters.set_pair(pair, values),
        _ => {}
    }
}

/// Every counter with its name, the readings first.
pub fn named(counters: &Counters) -> impl Iterator<Item = (&'static str, u32)> {
    let pairs = NAMES.into_iter().zip(counters.pairs());
    let others = pairs.flat_map(|(names, values)| names.into_iter().zip(values));
    std::iter::once(("readings", counters.readings)).chain(others)
}

/// What was counted between two times. Counters wrap; their differences do not mind.
pub fn since(before: &Counters, after: &Counters) -> Counters {
    each(after, before, u32::wrapping_sub)
}

/// What was counted in two lives.
pub fn sum(one: &Counters, other: &Counters) -> Counters {
    each(one, other, u32::wrapping_add)
}

fn each(left: &Counters, right: &Counters, of_two: fn(u32, u32) -> u32) -> Counters {
    let mut result = Counters { readings: of_two(left.readings, right.readings), ..Counters::default() };
    for (pair, (left, right)) in (0..).zip(left.pairs().into_iter().zip(right.pairs())) {
        result.set_pair(pair, [0, 1].map(|k| of_two(left[k], right[k])));
    }
    result
}

/// More than a bus can carry between two heartbeats, and in half an hour in which none is heard.
const MOST_BETWEEN: u32 = 1 << 24;

/// Counters over wraps and over restarts of the monitor, from its own count at the first heartbeat that is heard on. A restart
/// after which it has counted beyond what it was before the next heartbeat looks like none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CounterTotals {
    last: Counters,
    sums: [u64; 1 + 2 * COUNTER_PAIRS],
}

impl CounterTotals {
    /// Takes what one frame tells; other messages change nothing.
    pub fn take(&mut self, message: &Message) {
        let before = self.last;
        take(&mut self.last, message);
        let now = named(&self.last).zip(named(&before));
        for (sum, ((_, after), (_, before))) in self.sums.iter_mut().zip(now) {
            *sum += u64::from(passed(before, after));
        }
    }

    /// As the monitor told them last.
    pub fn told(&self) -> &Counters {
        &self.last
    }

    /// Every counter with its name, the readings first.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, u64)> {
        named(&self.last).zip(self.sums).map(|((name, _), sum)| (name, sum))
    }
}

/// What was counted between two frames. A counter that is lower than before went over the top if that is near, and began again
/// if not.
fn passed(before: u32, after: u32) -> u32 {
    let ahead = after.wrapping_sub(before);
    if after >= before || ahead < MOST_BETWEEN { ahead } else { after }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_go_on_over_a_wrap_and_over_a_restart() {
        let mut totals = CounterTotals::default();
        let mut tell = |lost: u32| {
            totals.take(&Message::Counters { pair: 0, values: [lost, 7] });
            totals.named().nth(1).unwrap()
        };
        assert_eq!(tell(5), ("lost", 5));
        assert_eq!(tell(2_000_000_000), ("lost", 2_000_000_000));
        assert_eq!(tell(4_000_000_000), ("lost", 4_000_000_000));
        assert_eq!(tell(u32::MAX), ("lost", u64::from(u32::MAX)));
        assert_eq!(tell(4), ("lost", u64::from(u32::MAX) + 5), "over the top");
        assert_eq!(tell(4), ("lost", u64::from(u32::MAX) + 5), "heard twice");
        assert_eq!(tell(1), ("lost", u64::from(u32::MAX) + 6), "a restart, and one lost since");
        assert_eq!(tell(3_000_000_001), ("lost", u64::from(u32::MAX) + 3_000_000_006));
        assert_eq!(tell(2), ("lost", u64::from(u32::MAX) + 3_000_000_008), "a restart far below the top");
        assert_eq!(totals.told().lost, 2);
        assert_eq!(totals.named().nth(2).unwrap(), ("rejected", 7));
    }

    #[test]
    fn counter_names_match_and_differences_survive_wrap() {
        let before = Counters { lost: u32::MAX, changes: 7, readings: 1, ..Counters::default() };
        let after = Counters { lost: 1, changes: 9, readings: 4, forged: 5, ..Counters::default() };
        let passed = since(&before, &after);
        let counted: Vec<_> = named(&passed).filter(|(_, number)| *number > 0).collect();
        assert_eq!(counted, [("readings", 3), ("lost", 2), ("forged", 5), ("changes", 2)]);
        assert_eq!(named(&passed).count(), 1 + 2 * COUNTER_PAIRS);
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_belong_to_their_counters_and_differences_survive_a_wrap() {
        let before = Counters { lost: u32::MAX, changes: 7, readings: 1, ..Counters::default() };
        let after = Counters { lost: 1, changes: 9, readings: 4, forged: 5, ..Counters::default() };
        let passed = since(&before, &after);
        let counted: Vec<_> = named(&passed).filter(|(_, number)| *number > 0).collect();
        assert_eq!(counted, [("readings", 3), ("lost", 2), ("forged", 5), ("changes", 2)]);
        assert_eq!(named(&passed).count(), 1 + 2 * COUNTER_PAIRS);
    }
}

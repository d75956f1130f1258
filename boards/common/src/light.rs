//! What the status light shows: one second of short flashes, read from across a hall.

use rotor_edge_core::can::NodeState;

const SECOND_US: u64 = 1_000_000;
/// A flash, and the pause to the next.
const FLASH_US: u64 = 100_000;

/// Whether the light is on: one flash a second while waiting, two while tracking, three when suspicious, steadily on with
/// the flag up, half a second on and off in a conflict over the node's number, dark while the node only listens.
pub fn is_on(state: NodeState, time_us: u64) -> bool {
    let within_us = time_us % SECOND_US;
    let flashes = match state {
        NodeState::Waiting => 1,
        NodeState::Tracking => 2,
        NodeState::Suspicious => 3,
        NodeState::Listening => 0,
        NodeState::Flagged => return true,
        NodeState::Conflict => return within_us < SECOND_US / 2,
    };
    within_us < flashes * 2 * FLASH_US && within_us % (2 * FLASH_US) < FLASH_US
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_state_looks_different_within_a_second_and_repeats() {
        let states = [
            NodeState::Listening,
            NodeState::Waiting,
            NodeState::Tracking,
            NodeState::Suspicious,
            NodeState::Flagged,
            NodeState::Conflict,
        ];
        let pattern = |state, from_us: u64| -> Vec<bool> {
            (0..SECOND_US).step_by(10_000).map(|t| is_on(state, from_us + t)).collect()
        };
        for (number, &one) in states.iter().enumerate() {
            assert_eq!(pattern(one, 0), pattern(one, 7 * SECOND_US));
            for &other in &states[number + 1..] {
                assert_ne!(pattern(one, 0), pattern(other, 0), "{one:?} {other:?}");
            }
        }
    }

    #[test]
    fn flashes_are_counted_by_their_beginnings() {
        for (state, flashes) in
            [(NodeState::Waiting, 1), (NodeState::Tracking, 2), (NodeState::Suspicious, 3)]
        {
            let on = |t| is_on(state, t);
            let beginnings = (1..=100).filter(|&t| on(t * 10_000) && !on(t * 10_000 - 10_000)).count();
            assert_eq!(beginnings, flashes);
        }
    }
}

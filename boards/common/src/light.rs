//! What the status light shows, read from across a hall: mostly dark while the node judges or is about to, mostly lit when
//! somebody must come.

use rotor_edge_core::state::{NodeState, Reason, Status};

/// A pattern repeats after this.
const PERIOD_US: u64 = 2_000_000;
const FLASH_US: u64 = 100_000;
/// From the beginning of a flash to that of the next.
const FLASH_STEP_US: u64 = 300_000;
const GAP_US: u64 = 200_000;
const GAP_STEP_US: u64 = 400_000;
const FLICKER_US: u64 = 100_000;
const HALF_US: u64 = 500_000;

/// What there is to be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// The node works, and is in this state.
    State(NodeState),
    /// The node works, and what it learns cannot be stored.
    Storage,
    /// The clocks are not good enough for the node to work.
    NoClock,
}

impl Sign {
    /// The sign of a node's status. A flag has priority over storage: an engineer comes to the machine anyway.
    pub fn of(status: &Status) -> Self {
        match status {
            Status { state: NodeState::Flagged, .. } => Self::State(NodeState::Flagged),
            Status { reason: Reason::Storage, .. } => Self::Storage,
            Status { state, .. } => Self::State(*state),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pattern {
    Dark,
    Lit,
    /// So many short flashes, then a pause.
    Flashes(u64),
    /// Lit but for so many short gaps, then a pause.
    Gaps(u64),
    Flicker,
    /// As long on as off.
    Halves,
}

fn pattern(sign: Sign) -> Pattern {
    match sign {
        Sign::State(NodeState::Listening) => Pattern::Dark,
        Sign::State(NodeState::Tracking) => Pattern::Flashes(1),
        Sign::State(NodeState::Learning) => Pattern::Flashes(2),
        Sign::State(NodeState::Waiting) => Pattern::Flashes(3),
        Sign::Storage => Pattern::Flashes(4),
        Sign::State(NodeState::Suspicious) => Pattern::Flicker,
        Sign::State(NodeState::Flagged) => Pattern::Lit,
        Sign::State(NodeState::Conflict) => Pattern::Halves,
        Sign::State(NodeState::Stale) => Pattern::Gaps(1),
        Sign::State(NodeState::NoModel) => Pattern::Gaps(3),
        Sign::NoClock => Pattern::Gaps(4),
        // Blind; and a state that the core learns later looks no better until it has a sign of its own.
        Sign::State(_) => Pattern::Gaps(2),
    }
}

/// Whether the light is on.
pub fn is_on(sign: Sign, time_us: u64) -> bool {
    let within_us = time_us % PERIOD_US;
    let is_within =
        |count, step_us, length_us| within_us < count * step_us && within_us % step_us < length_us;
    match pattern(sign) {
        Pattern::Dark => false,
        Pattern::Lit => true,
        Pattern::Flashes(count) => is_within(count, FLASH_STEP_US, FLASH_US),
        Pattern::Gaps(count) => !is_within(count, GAP_STEP_US, GAP_US),
        Pattern::Flicker => within_us % (2 * FLICKER_US) < FLICKER_US,
        Pattern::Halves => within_us % (2 * HALF_US) < HALF_US,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn signs() -> impl Iterator<Item = Sign> {
        NodeState::ALL.into_iter().map(Sign::State).chain([Sign::Storage, Sign::NoClock])
    }

    fn shown(sign: Sign, from_us: u64) -> Vec<bool> {
        (0..PERIOD_US).step_by(10_000).map(|t| is_on(sign, from_us + t)).collect()
    }

    #[test]
    fn every_sign_repeats_after_two_seconds() {
        for sign in signs() {
            assert_eq!(shown(sign, 0), shown(sign, 7 * PERIOD_US));
        }
    }

    /// Told apart by an eye that counts changes and sees how long the light is on, not when it began to look.
    #[test]
    fn light_signs_differ_in_changes_and_duty_cycle() {
        let seen = |sign| {
            let shown = shown(sign, 0);
            let changes = shown.iter().zip(shown.iter().cycle().skip(1)).filter(|(a, b)| a != b).count();
            let tenths = shown.iter().filter(|&&on| on).count() * 10 / shown.len();
            (changes / 2, tenths)
        };
        let mut known: Vec<_> = signs().map(seen).collect();
        known.sort_unstable();
        known.dedup();
        assert_eq!(known.len(), signs().count());
    }

    #[test]
    fn only_tracking_is_a_single_flash() {
        let beginnings = |sign| {
            let shown = shown(sign, 0);
            shown.iter().zip(shown.iter().cycle().skip(1)).filter(|&(&a, &b)| !a && b).count()
        };
        let is_short = |sign| shown(sign, 0).iter().filter(|&&on| on).count() <= 20;
        let single: Vec<_> = signs().filter(|&sign| beginnings(sign) == 1 && is_short(sign)).collect();
        assert_eq!(single, [Sign::State(NodeState::Tracking)]);
    }

    #[test]
    fn memory_that_cannot_be_written_shows_unless_flagged() {
        let of = |state, reason| Sign::of(&Status { state, reason, ..Status::default() });
        for state in [NodeState::Tracking, NodeState::Learning, NodeState::Waiting] {
            assert_eq!(of(state, Reason::Storage), Sign::Storage);
            assert_eq!(of(state, Reason::None), Sign::State(state));
        }
        assert_eq!(of(NodeState::Flagged, Reason::Storage), Sign::State(NodeState::Flagged));
    }

    #[test]
    fn nothing_lasts_too_short_to_be_seen() {
        for sign in signs() {
            let shown: Vec<bool> = shown(sign, 0).into_iter().chain(shown(sign, 0)).collect();
            let lengths: Vec<usize> = shown.chunk_by(|a, b| a == b).map(<[bool]>::len).collect();
            // The first and the last are cut off.
            assert!(lengths.iter().rev().skip(1).rev().skip(1).all(|&tens_ms| tens_ms >= 10), "{sign:?}");
        }
    }
}

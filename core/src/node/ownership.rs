//! Whether this node's number is its own.
//!
//! A monitor listens before it sends for the first time, and falls silent when it hears frames that only it may send: on a
//! wire, two frames of one identifier with other data destroy each other until both senders have left the bus. It then
//! sends nothing but its state, at times of its own that the other one's will hardly meet, which tells the other one, until
//! one of them is gone.

use rand_core::Rng;
use rand_core::SeedableRng;
use rand_xoshiro::SplitMix64;

use crate::state::{NodeState, Reason};

/// Heartbeat periods without a foreign frame after which the number counts as free again: two more than the longest
/// time between two states.
const QUIET_PERIODS: u64 = 3;

/// What was heard of others with the same number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ownership {
    listen_us: u64,
    period_us: u64,
    started_us: Option<u64>,
    listened: bool,
    conflict: Option<Conflict>,
    seed: u64,
}

#[derive(Debug, Clone, Copy)]
struct Conflict {
    heard_us: u64,
    next_state_us: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Due {
    Nothing,
    /// The node may send from now on.
    MaySend,
    /// The state, in a conflict.
    State,
}

impl Ownership {
    pub fn new(listen_us: u64, heartbeat_period_us: u64, seed: u64) -> Self {
        let listened = listen_us == 0;
        Self { listen_us, period_us: heartbeat_period_us, started_us: None, listened, conflict: None, seed }
    }

    /// Somebody else sent what only this node may; `true` if that is news.
    pub fn heard_other(&mut self, time_us: u64) -> bool {
        if let Some(conflict) = &mut self.conflict {
            conflict.heard_us = time_us;
            return false;
        }
        let next_state_us = time_us.saturating_add(self.up_to_a_period(time_us));
        self.conflict = Some(Conflict { heard_us: time_us, next_state_us });
        true
    }

    pub fn poll(&mut self, time_us: u64) -> Due {
        let started_us = *self.started_us.get_or_insert(time_us);
        let had_listened = self.listened;
        self.listened |= time_us.saturating_sub(started_us) >= self.listen_us;
        let Some(mut conflict) = self.conflict else {
            return if self.listened == had_listened { Due::Nothing } else { Due::MaySend };
        };
        if time_us >= self.quiet_at(&conflict) {
            self.conflict = None;
            return Due::MaySend;
        }
        if time_us < conflict.next_state_us {
            return Due::Nothing;
        }
        let pause_us = (self.period_us / 2).saturating_add(self.up_to_a_period(time_us));
        conflict.next_state_us = time_us.saturating_add(pause_us);
        self.conflict = Some(conflict);
        Due::State
    }

    /// When [`Ownership::poll`] has something to do.
    pub fn poll_at(&self) -> Option<u64> {
        match (&self.conflict, self.started_us) {
            (Some(conflict), _) => Some(conflict.next_state_us.min(self.quiet_at(conflict))),
            (None, Some(started_us)) if !self.listened => Some(started_us.saturating_add(self.listen_us)),
            (None, None) => Some(0),
            _ => None,
        }
    }

    /// Why nothing may be sent now.
    pub fn silence(&self) -> Option<(NodeState, Reason)> {
        if self.conflict.is_some() {
            Some((NodeState::Conflict, Reason::NumberInUse))
        } else if !self.listened {
            Some((NodeState::Listening, Reason::None))
        } else {
            None
        }
    }

    fn quiet_at(&self, conflict: &Conflict) -> u64 {
        conflict.heard_us.saturating_add(self.period_us.saturating_mul(QUIET_PERIODS)).saturating_add(1)
    }

    /// A random part of a heartbeat period: of the node's own seed, and of the instant, for nodes with the same seed.
    fn up_to_a_period(&self, time_us: u64) -> u64 {
        let random = SplitMix64::seed_from_u64(self.seed ^ time_us).next_u64();
        ((u128::from(random) * u128::from(self.period_us)) >> 64) as u64
    }
}

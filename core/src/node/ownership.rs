//! Whether this node's number is its own.
//!
//! A monitor listens before it answers for the first time, and falls silent when it hears frames that only it may send:
//! two monitors with one number would otherwise mix their results. Both say so in their heartbeats, which tells the
//! other one, until one of them is gone.

use crate::state::NodeState;

/// Heartbeat periods without a foreign frame after which the number counts as free again.
const QUIET_PERIODS: u64 = 3;

/// What was heard of others with the same number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ownership {
    listen_us: u64,
    quiet_us: u64,
    started_us: Option<u64>,
    listened: bool,
    conflict_since_us: Option<u64>,
}

impl Ownership {
    pub fn new(listen_us: u64, heartbeat_period_us: u64) -> Self {
        let quiet_us = heartbeat_period_us.saturating_mul(QUIET_PERIODS);
        Self { listen_us, quiet_us, started_us: None, listened: listen_us == 0, conflict_since_us: None }
    }

    /// Somebody else sent what only this node may; `true` if that is news.
    pub fn heard_other(&mut self, time_us: u64) -> bool {
        self.conflict_since_us.replace(time_us).is_none()
    }

    /// Ends listening and a conflict when their time is up; `true` if one ended now.
    pub fn poll(&mut self, time_us: u64) -> bool {
        let started_us = *self.started_us.get_or_insert(time_us);
        let listened = self.listened;
        self.listened |= time_us.saturating_sub(started_us) >= self.listen_us;
        let conflict = self.conflict_since_us;
        self.conflict_since_us =
            conflict.filter(|since_us| time_us.saturating_sub(*since_us) <= self.quiet_us);
        self.listened != listened || self.conflict_since_us != conflict
    }

    /// Why readings may not be answered now.
    pub fn silence(&self) -> Option<NodeState> {
        if self.conflict_since_us.is_some() {
            Some(NodeState::Conflict)
        } else if !self.listened {
            Some(NodeState::Listening)
        } else {
            None
        }
    }
}

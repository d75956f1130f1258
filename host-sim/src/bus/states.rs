//! What a monitor says of itself over time.

use std::fmt::Debug;

use rotor_edge_core::can::Message;
use rotor_edge_core::state::Status;

use super::timed::Timed;

/// The changes of state or reason that a monitor told, and its last word.
#[derive(Debug, Clone, Default)]
pub struct States {
    changes: Vec<Timed<Status>>,
    last: Option<Timed<Status>>,
}

impl States {
    /// Takes a message of the monitor; all but [`Message::State`] are passed over.
    pub fn take(&mut self, time_us: u64, message: &Message) {
        let Message::State(what) = *message else { return };
        let timed = Timed { time_us, what };
        let before = self.changes.last().map(|timed| (timed.what.state, timed.what.reason));
        if before != Some((what.state, what.reason)) {
            self.changes.push(timed);
        }
        self.last = Some(timed);
    }

    /// Each state and reason when it was first told.
    pub fn changes(&self) -> &[Timed<Status>] {
        &self.changes
    }

    pub fn last(&self) -> Option<&Timed<Status>> {
        self.last.as_ref()
    }
}

/// The name of a state or a reason where programs read it: `NoModel` is `no_model`, `Unknown(30)` is `reason_30`.
pub fn name(of: impl Debug) -> String {
    let written = format!("{of:?}");
    if let Some(code) = written.strip_prefix("Unknown(") {
        return format!("reason_{}", code.trim_end_matches(')'));
    }
    let mut name = String::new();
    for letter in written.chars() {
        if letter.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(letter.to_lowercase());
    }
    name
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::state::{NodeState, Reason};

    use super::*;

    #[test]
    fn repetitions_are_no_changes_and_another_reason_is_one() {
        let mut states = States::default();
        let told = [
            (0, NodeState::Waiting, Reason::NoReading),
            (1, NodeState::Waiting, Reason::NoReading),
            (2, NodeState::Tracking, Reason::None),
            (3, NodeState::Tracking, Reason::Probes),
            (4, NodeState::Tracking, Reason::Probes),
            (5, NodeState::Tracking, Reason::None),
        ];
        for (time_us, state, reason) in told {
            states.take(time_us, &Message::State(Status { state, reason, ..Status::default() }));
            states.take(time_us, &Message::VersionQuery);
        }
        let times: Vec<u64> = states.changes().iter().map(|timed| timed.time_us).collect();
        assert_eq!(times, [0, 2, 3, 5]);
        assert_eq!(states.last().unwrap().what.reason, Reason::None);
    }

    #[test]
    fn names_are_words_joined_by_underscores() {
        let states: Vec<String> = NodeState::ALL.into_iter().map(name).collect();
        let expected = [
            "waiting",
            "tracking",
            "suspicious",
            "flagged",
            "conflict",
            "listening",
            "no_model",
            "learning",
            "blind",
            "stale",
        ];
        assert_eq!(states, expected);
        assert_eq!(name(Reason::NumberInUse), "number_in_use");
        assert_eq!(name(Reason::from_code(30)), "reason_30");
    }
}

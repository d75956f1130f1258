//! A monitor's state in words, and what to do next.

use rotor_edge_core::can::PROTOCOL_VERSION;
use rotor_edge_core::state::{NodeState, Reason, Status};
use rotor_edge_desktop::units::SECONDS_A_DAY;

use super::lists::listed;
use super::monitor::Monitor;
use super::reasons::{Why, why};
use crate::bus::mac::RefusalCounts;
use crate::bus::numbers::bearing_number;

/// Readings without an answer that are no coincidence.
const MOST_UNANSWERED: u32 = 3;
const FORGER: &str = "if the refused ones grow in number: find who else sends under its number";
/// Results in a row at the bound that are no coincidence. Under a model that no longer fits, the sample's results are at
/// it by scatter in 6 % of the readings, three in a row then in 0.02 %; while a jump is followed, all are.
const LEAST_AT_BOUND: u16 = 3;

/// How much a state matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    Good,
    /// Nothing is judged at the moment, as is to be expected.
    Idle,
    Attention,
    /// Something is to be done.
    Alarm,
}

/// What to tell somebody who watches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Words {
    pub level: Level,
    /// One or two words, at most ten characters.
    pub short: &'static str,
    pub state: String,
    /// What to do next; empty if nothing.
    pub next: String,
}

impl Words {
    fn new(level: Level, short: &'static str, state: impl Into<String>, next: impl Into<String>) -> Self {
        Self { level, short, state: state.into(), next: next.into() }
    }

    /// Of monitor `node`; the most urgent first.
    pub fn of(node: u8, monitor: &Monitor, now_us: u64) -> Self {
        let words = Self::of_believed(node, monitor, now_us);
        match monitor.refused().filter(RefusalCounts::any) {
            Some(refused) if monitor.heard_us().is_none() => Self::new(
                Level::Alarm,
                "NO MAC",
                format!("no frame under its number has a valid message authentication code (MAC); {refused}"),
                "start it with `node --sealed`, give the right key, or find who else sends under its number",
            ),
            Some(refused) => Self {
                level: if words.level == Level::Alarm { Level::Alarm } else { Level::Attention },
                state: format!("{}; {refused}", words.state),
                next: if words.next.is_empty() { FORGER.into() } else { words.next },
                ..words
            },
            None => words,
        }
    }

    fn of_believed(node: u8, monitor: &Monitor, now_us: u64) -> Self {
        if let Some(version) = monitor.foreign_version() {
            return Self::new(
                Level::Alarm,
                "version?",
                format!("speaks version {version} of the protocol, this program {PROTOCOL_VERSION}"),
                "update the older of the two; until then none of its numbers can be trusted",
            );
        }
        let Some(heard_us) = monitor.heard_us() else {
            return Self::new(
                Level::Alarm,
                "absent",
                format!("readings are sent to monitor {node}, and nobody with that number was heard"),
                "check its power, wiring and bit rate, or the number that the readings are sent to",
            );
        };
        if monitor.is_silent(now_us) {
            return Self::new(
                Level::Alarm,
                "SILENT",
                format!("not heard for {}", span(now_us - heard_us)),
                "check its power, wiring and bit rate",
            );
        }
        if monitor.is_in_conflict(now_us) {
            return Self::new(
                Level::Alarm,
                "CONFLICT",
                format!("two devices call themselves monitor {node}, and neither answers readings"),
                "give one of them another number, or switch it off",
            );
        }
        match monitor.status() {
            Some(status) => Self::of_status(node, monitor, status, now_us).with_trial(monitor),
            None => Self::new(Level::Idle, "heard", "it has not told its state yet", ""),
        }
    }

    fn with_trial(mut self, monitor: &Monitor) -> Self {
        if monitor.model().is_some_and(|model| model.on_trial) {
            self.state
                .push_str("; its model is on trial, and the one before comes back unless it is confirmed");
        }
        self
    }

    fn of_status(node: u8, monitor: &Monitor, status: &Status, now_us: u64) -> Self {
        let because = why(status.reason, status.missing_mask);
        let judged = judged(monitor, now_us);
        match status.state {
            NodeState::Flagged => flagged(node, status, &because, &judged),
            NodeState::NoModel => {
                Self::new(Level::Alarm, "NO MODEL", format!("judges nothing: {}", because.what), because.next)
            }
            NodeState::Blind => Self::new(
                Level::Alarm,
                "BLIND",
                format!("readings arrive and cannot be judged: {}; {judged}", because.what),
                because.next,
            ),
            NodeState::Stale => Self::new(
                Level::Alarm,
                "STALE",
                format!("says nothing of the machine any more: {}; {judged}", because.what),
                because.next,
            ),
            NodeState::Listening => {
                Self::new(Level::Idle, "starting", "just started: listens whether its number is free", "")
            }
            _ if monitor.unanswered() >= MOST_UNANSWERED => unanswered(monitor),
            // an old conflict that has not been followed by another word yet
            NodeState::Waiting | NodeState::Conflict => {
                idle("waiting", "no reading judged since its start", status.reason, because)
            }
            NodeState::Learning => idle(
                "learning",
                "takes the residual's reference after the deployment",
                status.reason,
                because,
            ),
            NodeState::Suspicious => suspicious(monitor, because),
            NodeState::Tracking => tracking(monitor, status, because),
            _ => Self::new(
                Level::Alarm,
                "UNKNOWN",
                "its state is one that this program does not know",
                "watch with a newer program",
            ),
        }
    }
}

/// Nothing is to be done, unless its memory cannot be written.
fn idle(short: &'static str, state: &str, reason: Reason, because: Why) -> Words {
    match reason {
        Reason::Storage => {
            Words::new(Level::Attention, short, format!("{state}; but {}", because.what), because.next)
        }
        _ => Words::new(Level::Idle, short, state, because.next),
    }
}

fn flagged(node: u8, status: &Status, at_present: &Why, judged: &str) -> Words {
    let suspect =
        status.suspect.map_or(String::new(), |b| format!(", suspect bearing {}", bearing_number(b)));
    let cause = why(status.cause, 0);
    let present = match status.reason {
        Reason::None => String::new(),
        reason if reason == status.cause => String::new(),
        _ => format!("; at present: {}", at_present.what),
    };
    Words::new(
        Level::Alarm,
        "FLAGGED",
        format!("{}{suspect}{present}; {judged}", cause.what),
        format!("{}; then `rotor-edge acknowledge --node {node}`", cause.next),
    )
}

fn suspicious(monitor: &Monitor, because: Why) -> Words {
    let state = match monitor.last() {
        Some(last) => format!("{}, for {}", because.what, readings(last.what.streak)),
        None => because.what,
    };
    let next = match jumping(monitor) {
        Some(plane) => format!(
            "{plane}: after balancing or repair `rotor-edge acknowledge`, else wait for more readings"
        ),
        None => "one reading may be a disturbance; wait for more".into(),
    };
    Words::new(Level::Attention, "suspicious", state, next)
}

fn tracking(monitor: &Monitor, status: &Status, because: Why) -> Words {
    if status.reason != Reason::None {
        let state = format!("the model describes the machine; but {}", because.what);
        return Words::new(Level::Attention, "tracking", state, because.next);
    }
    match jumping(monitor) {
        None => Words::new(Level::Good, "tracking", "the model describes the machine", ""),
        Some(plane) => Words::new(
            Level::Attention,
            "tracking",
            format!("the model describes the machine; {plane}"),
            "if it goes on: look for lost material or a loose part",
        ),
    }
}

fn unanswered(monitor: &Monitor) -> Words {
    Words::new(
        Level::Alarm,
        "skips",
        format!("the last {} readings were not answered", monitor.unanswered()),
        "see the counters: rejected and incomplete: frames are lost or damaged; overflowed: the bus is full",
    )
}

/// How old the evidence is.
fn judged(monitor: &Monitor, now_us: u64) -> String {
    match monitor.evidence_age_us(now_us) {
        Some(age_us) => format!("last judged {} ago", span(age_us)),
        None => "nothing judged since its start".into(),
    }
}

/// Which planes' unbalance may have jumped.
fn jumping(monitor: &Monitor) -> Option<String> {
    let at_bound = monitor.at_bound().into_iter().zip(1..);
    let planes: Vec<u8> = at_bound.filter(|(times, _)| *times >= LEAST_AT_BOUND).map(|(_, n)| n).collect();
    match &planes[..] {
        [] => None,
        [plane] => Some(format!("plane {plane} grows as fast as it may")),
        several => Some(format!("planes {} grow as fast as they may", listed(several))),
    }
}

fn readings(number: u16) -> String {
    if number == 1 { "1 reading".into() } else { format!("{number} readings") }
}

/// A span of time, short.
pub fn span(time_us: u64) -> String {
    let seconds = time_us as f64 * 1e-6;
    match seconds {
        s if s < 9.95 => format!("{s:.1} s"),
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7_200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h", s / 3_600.0),
        s => format!("{:.0} d", s / SECONDS_A_DAY),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::numbers::probe_numbers;

    #[test]
    fn spans_are_short_and_never_fall_between_two_forms() {
        let cases = [
            (0, "0.0 s"),
            (9_940_000, "9.9 s"),
            (9_960_000, "10 s"),
            (119_000_000, "119 s"),
            (120_000_000, "2 min"),
            (7_200_000_000, "2 h"),
            (172_800_000_000, "2 d"),
        ];
        for (time_us, text) in cases {
            assert_eq!(span(time_us), text);
        }
    }

    #[test]
    fn numbers_are_listed_as_people_write_them() {
        for (mask, text) in [(0, ""), (0b100, "3"), (0b101, "1 and 3"), (0b1000_0011, "1, 2 and 8")] {
            assert_eq!(listed(&probe_numbers(mask)), text);
        }
    }
}

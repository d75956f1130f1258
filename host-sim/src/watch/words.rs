//! A monitor's state in words, and what to do next.

use rotor_edge_core::can::{Keyphasor, MonitorResult, NodeState, PROTOCOL_VERSION};
use rotor_edge_core::residual::Bearing;

use super::monitor::Monitor;

/// Names of the probes, in the order of a reading.
pub const PROBE_NAMES: [&str; 4] = ["1X", "1Y", "2X", "2Y"];
/// Readings without an answer that are no coincidence.
const MOST_UNANSWERED: u32 = 3;
/// Results in a row at the bound that are no coincidence. Under a model that no longer fits, the sample's results are at
/// it by scatter in 6 % of the readings, three in a row then in 0.02 %; while a jump is followed, all are.
const LEAST_AT_BOUND: u16 = 3;

/// How much a state matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// All is well.
    Good,
    /// Nothing is judged at the moment.
    Idle,
    /// Worth a look.
    Attention,
    /// Something is to be done.
    Alarm,
}

/// What to tell somebody who watches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Words {
    /// How much it matters.
    pub level: Level,
    /// One or two words, at most ten characters.
    pub short: &'static str,
    /// What is the matter.
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
        let listening = monitor.state() == Some(NodeState::Listening);
        if !listening && let Some(trouble) = trouble_with_readings(monitor) {
            return trouble;
        }
        of_state(monitor)
    }
}

/// Why readings that arrive are not answered.
fn trouble_with_readings(monitor: &Monitor) -> Option<Words> {
    let reading = &monitor.reading()?.what;
    let skipped = |state: String, next: &str| {
        (monitor.unanswered() > 0).then(|| Words::new(Level::Alarm, "skips", state, next))
    };
    let speed_rpm = reading.reading.speed_rpm;
    let lost: Vec<&str> = PROBE_NAMES
        .into_iter()
        .zip(&reading.reading.probes)
        .filter(|(_, probe)| !probe.is_finite())
        .map(|(name, _)| name)
        .collect();
    match reading.keyphasor {
        Keyphasor::Missing => skipped(
            "keyphasor missing: without it speed and phase mean nothing, and readings are skipped".into(),
            "check the keyphasor's probe, its gap and the mark on the shaft",
        ),
        Keyphasor::Unsteady => skipped(
            "keyphasor unsteady: readings are skipped".into(),
            "wait until the speed is constant; if it is, check the keyphasor's probe and mark",
        ),
        _ if !lost.is_empty() => skipped(
            format!("probe {} gives no value: readings are skipped", lost.join(", ")),
            "check the probe, its cable and its proximitor (1X: bearing 1, direction X)",
        ),
        _ if monitor.unanswered() >= MOST_UNANSWERED => skipped(
            format!("the last {} readings, at {speed_rpm:.0} rpm, were not answered", monitor.unanswered()),
            "see the counters: rejected: speed outside the model's range or values that cannot be; unsolved: the model has \
             no finite response; neither: frames are lost",
        ),
        _ => None,
    }
}

fn of_state(monitor: &Monitor) -> Words {
    let last = monitor.last().map(|timed| &timed.what);
    match monitor.state() {
        Some(NodeState::Flagged) => flagged(monitor, last),
        Some(NodeState::Suspicious) => Words::new(
            Level::Attention,
            "suspicious",
            match last {
                Some(result) => format!("residual high for {}", readings(result.streak)),
                None => "residual high".into(),
            },
            match jumping(monitor) {
                Some(plane) => format!("{plane}: its unbalance may have jumped; wait for more readings"),
                None => "one reading may be a disturbance; wait for more".into(),
            },
        ),
        Some(NodeState::Tracking) => match jumping(monitor) {
            None => Words::new(Level::Good, "tracking", "the model describes the machine", ""),
            Some(plane) => Words::new(
                Level::Attention,
                "tracking",
                format!("the model describes the machine; {plane}"),
                "if it goes on: look for lost material or a loose part",
            ),
        },
        Some(NodeState::Listening) => {
            Words::new(Level::Idle, "starting", "just started: listens whether its number is free", "")
        }
        // an old conflict that has not been followed by another word yet
        Some(NodeState::Waiting | NodeState::Conflict) | None => Words::new(
            Level::Idle,
            "waiting",
            "no reading judged since its start or its last model",
            "send readings",
        ),
    }
}

fn flagged(monitor: &Monitor, last: Option<&MonitorResult>) -> Words {
    let state = match last {
        Some(result) => {
            let suspect = match result.suspect {
                Some(bearing) => format!(", suspect bearing {}", bearing_number(bearing)),
                None => String::new(),
            };
            format!("residual high for {}{suspect}", readings(result.streak))
        }
        None => "residual high, the flag is up".into(),
    };
    let next = match jumping(monitor) {
        Some(plane) => {
            format!("{plane}: its unbalance may have jumped; wait until the estimate has caught up")
        }
        None => "record a run-up and run `rotor-edge improve`".into(),
    };
    Words::new(Level::Alarm, "FLAGGED", state, next)
}

/// Which plane's unbalance may have jumped.
fn jumping(monitor: &Monitor) -> Option<&'static str> {
    match monitor.at_bound().map(|in_a_row| in_a_row >= LEAST_AT_BOUND) {
        [true, true] => Some("both planes grow as fast as they may"),
        [true, false] => Some("plane 1 grows as fast as it may"),
        [false, true] => Some("plane 2 grows as fast as it may"),
        [false, false] => None,
    }
}

/// 1 or 2.
pub fn bearing_number(bearing: Bearing) -> u8 {
    match bearing {
        Bearing::One => 1,
        Bearing::Two => 2,
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
        s => format!("{:.0} d", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}

//! Whether the monitor was right, by nothing but times, states and the unbalance that it told.

use std::fmt;

use rotor_edge_core::state::{Reason, Status};

use super::machine::UnbalanceError;
use super::monitor::claims_health;

/// An unbalance that is further off than this in any plane is wrong.
pub const WRONG: UnbalanceError = UnbalanceError { size: 0.3, angle_deg: 30.0 };

/// What was to be seen at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Observation {
    /// Since the fault began, s; negative before.
    pub since_s: f64,
    /// The unbalance that the user has is wrong.
    pub is_wrong: bool,
    pub status: Status,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The unbalance never was wrong.
    Harmless,
    /// It was wrong, and the monitor said within the age limit and until the end that something is the matter.
    Seen,
    /// Later than the age limit, and then until the end.
    Late,
    /// The monitor claimed health again while the fault lasted.
    Returned,
    /// The monitor claimed health throughout.
    Missed,
    /// Something was the matter before the fault.
    FalseAlarm,
}

impl Verdict {
    pub fn is_right(self) -> bool {
        matches!(self, Self::Harmless | Self::Seen)
    }

    /// The fault made the unbalance wrong.
    pub fn matters(self) -> bool {
        self != Self::Harmless
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Harmless => "harmless",
            Self::Seen => "seen",
            Self::Late => "LATE",
            Self::Returned => "RETURNED",
            Self::Missed => "MISSED",
            Self::FalseAlarm => "FALSE ALARM",
        })
    }
}

/// A verdict with its reasons.
#[derive(Debug, Clone, Copy)]
pub struct Judgement {
    pub verdict: Verdict,
    /// From the fault to the first wrong unbalance, s.
    pub wrong_s: Option<f64>,
    /// From the fault to the first state that does not claim health, s.
    pub left_s: Option<f64>,
    /// What it said then, and at the end.
    pub told: Option<Status>,
    pub last: Status,
}

/// Judges observations in the order of time; those before the fault tell whether the scenario stands.
pub fn judge(observations: &[Observation], age_limit_s: f64) -> Judgement {
    let (before, during): (Vec<&Observation>, Vec<&Observation>) =
        observations.iter().partition(|o| o.since_s < 0.0);
    let wrong_s = during.iter().find(|o| o.is_wrong).map(|o| o.since_s);
    let left = during.iter().find(|o| !claims_health(&o.status));
    let is_sound_before = before.last().is_some_and(|o| claims_health(&o.status) && !o.is_wrong)
        && before.iter().all(|o| o.status.cause == Reason::None);
    // times are sums of floats
    let is_due = |o: &&&Observation| wrong_s.is_some_and(|s| o.since_s >= s + age_limit_s - 1e-3);
    let claims_late = || during.iter().filter(is_due).any(|o| claims_health(&o.status));
    let ends_in_claim = during.last().is_none_or(|o| claims_health(&o.status));
    let verdict = match (wrong_s, left) {
        _ if !is_sound_before => Verdict::FalseAlarm,
        (None, _) => Verdict::Harmless,
        (Some(_), None) => Verdict::Missed,
        (Some(_), Some(_)) if !claims_late() => Verdict::Seen,
        (Some(wrong_s), Some(left)) => {
            let leaves_once =
                during.iter().skip_while(|o| claims_health(&o.status)).all(|o| !claims_health(&o.status));
            let is_late = left.since_s > wrong_s + age_limit_s;
            if is_late && leaves_once && !ends_in_claim { Verdict::Late } else { Verdict::Returned }
        }
    };
    Judgement {
        verdict,
        wrong_s,
        left_s: left.map(|o| o.since_s),
        told: left.map(|o| o.status),
        last: during.last().map_or(Status::default(), |o| o.status),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rotor_edge_core::state::NodeState;

    /// One letter a second: `.` healthy, `s` suspicious, upper case or `!` the same with a wrong unbalance; the fault begins at `|`.
    fn verdict(story: &str) -> Verdict {
        let fault = story.find('|').unwrap();
        let observations: Vec<Observation> = story
            .replace('|', "")
            .chars()
            .enumerate()
            .map(|(second, letter)| {
                let state = if ".!".contains(letter) { NodeState::Tracking } else { NodeState::Suspicious };
                let status = Status { state, ..Status::default() };
                Observation { since_s: second as f64 - fault as f64, is_wrong: "!S".contains(letter), status }
            })
            .collect();
        judge(&observations, 3.0).verdict
    }

    #[test]
    fn story_of_states_has_its_verdict() {
        for (story, expected) in [
            ("....|.......", Verdict::Harmless),
            ("....|..sss..", Verdict::Harmless),
            ("....|!!!!!!!", Verdict::Missed),
            ("....|!!!SSSS", Verdict::Seen),
            ("....|!.!S.SS", Verdict::Returned),
            ("....|!s!SSSS", Verdict::Seen),
            ("....|!!!!!SS", Verdict::Late),
            ("....|SSSSS..", Verdict::Returned),
            ("....|SSSSSSS", Verdict::Seen),
            ("....|..!..ss", Verdict::Seen),
            ("....|..!...s", Verdict::Late),
            ("..s.|.......", Verdict::Harmless),
            ("...s|SSSSSSS", Verdict::FalseAlarm),
            ("...!|SSSSSSS", Verdict::FalseAlarm),
        ] {
            assert_eq!(verdict(story), expected, "{story}");
        }
    }
}

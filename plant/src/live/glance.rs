//! What a person who walks past wants to know of each monitor, the worst first.

use std::collections::HashMap;
use std::sync::Arc;

use rotor_edge::bus::states::name;
use rotor_edge::watch::reasons::why;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::state::Reason;
use serde::Serialize;

use super::alarm::{Acknowledged, Key};
use super::recent::Recent;
use crate::names::Names;
use crate::store::Newest;

/// Heartbeats missed after which a monitor is silent.
const QUIET_PERIODS: u64 = 3;
/// States from the worst to the best; what is not listed stands at the beginning.
const ORDER: [&str; 10] = [
    "conflict",
    "flagged",
    "silent",
    "blind",
    "stale",
    "suspicious",
    "no_model",
    "waiting",
    "learning",
    "tracking",
];

/// States in which nobody is needed.
const CALM: [&str; 3] = ["waiting", "learning", "tracking"];

/// One monitor at a glance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Glance {
    #[serde(flatten)]
    pub newest: Newest,
    /// Its state now: what it said of itself, or `silent` where it says nothing any more.
    pub state_now: String,
    /// Why, in words, and what to do about it.
    pub why: String,
    /// Since its last sign of life, s; none if there was none, and never below zero.
    pub age_s: Option<f64>,
    /// Whether somebody is needed.
    pub is_alarm: bool,
    /// Since when it is in this state, µs since 1970: when it told so, or was heard last; 0 if that was not heard.
    pub state_since_us: i64,
    /// Who has seen it in this state since then.
    pub acknowledged: Option<Acknowledged>,
    /// What its machine is called, where that was stated.
    pub machine: Option<String>,
    #[serde(skip)]
    pub known: Known,
}

/// What is known of a monitor besides what it told last.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Known {
    pub names: Arc<Names>,
    pub recent: Arc<Recent>,
}

impl Glance {
    /// The alarm of a monitor that needs somebody.
    pub fn alarm(&self) -> Option<Key> {
        self.is_alarm.then(|| (self.newest.source, self.state_now.clone(), self.state_since_us))
    }

    /// The same while nobody has acknowledged it.
    pub fn unseen_alarm(&self) -> Option<Key> {
        self.alarm().filter(|_| self.acknowledged.is_none())
    }
}

/// All of them as they are at a time, the worst first; of those in one state, first what nobody has seen.
pub fn all(
    newest: &[Newest],
    acknowledged: &HashMap<Key, Acknowledged>,
    known: &HashMap<i64, Known>,
    now_us: i64,
) -> Vec<Glance> {
    let known = |one: &Newest| known.get(&one.source).cloned().unwrap_or_default();
    let mut all: Vec<Glance> = newest.iter().map(|one| of(one, acknowledged, known(one), now_us)).collect();
    let place = |glance: &Glance| ORDER.iter().position(|state| *state == glance.state_now);
    all.sort_by_key(|glance| {
        (place(glance).map_or(0, |place| place + 1), glance.is_alarm && glance.acknowledged.is_some())
    });
    all
}

fn of(newest: &Newest, acknowledged: &HashMap<Key, Acknowledged>, known: Known, now_us: i64) -> Glance {
    let quiet_us = (QUIET_PERIODS * NodeConfig::HEARTBEAT_PERIOD_US) as i64;
    let age_us = newest.heard_us.map(|heard_us| now_us - heard_us);
    let is_silent = age_us.is_none_or(|age_us| age_us > quiet_us);
    let state = newest.state.as_deref().unwrap_or("silent");
    let why = match is_silent {
        true => {
            let last = newest.state.as_deref().map_or_else(
                || "no message was ever received".into(),
                |state| format!("no message is received any more; its last state was {state}"),
            );
            format!("{last}: check its supply, its bus and the gateway")
        }
        false => in_words(newest, &known.names),
    };
    let state_now: String = if is_silent { "silent" } else { state }.into();
    let state_since_us = if is_silent { newest.heard_us } else { newest.since_us }.unwrap_or(0);
    let acknowledged = acknowledged.get(&(newest.source, state_now.clone(), state_since_us)).cloned();
    // commands stand in backticks, which a terminal's readers know
    let why = why.replace('`', "");
    Glance {
        newest: newest.clone(),
        is_alarm: !CALM.contains(&state_now.as_str()),
        state_now,
        why,
        age_s: age_us.map(|us| us.max(0) as f64 * 1e-6),
        state_since_us,
        acknowledged,
        machine: known.names.machine.clone(),
        known,
    }
}

/// What its reason means and what to do about it; of one that is flagged, what raised the flag and at which bearing, and what is
/// the matter now if that is something else.
fn in_words(newest: &Newest, names: &Names) -> String {
    let is_flagged = newest.state.as_deref() == Some("flagged");
    let Some(told) = told(is_flagged, &newest.reason, &newest.cause) else { return String::new() };
    let next = why(told, 0).next;
    let next = if next.is_empty() { String::new() } else { format!(": {next}") };
    let words =
        change_in_words(newest.state.as_deref(), &newest.reason, &newest.cause, newest.suspect, names);
    format!("{words}{next}")
}

/// The reason by its word.
fn meant(word: &Option<String>) -> Option<Reason> {
    (1..=u8::MAX).map(Reason::from_code).find(|reason| Some(name(reason)) == *word)
}

/// What is told of a state first: of a flag what raised it, else the reason.
fn told(is_flagged: bool, reason: &Option<String>, cause: &Option<String>) -> Option<Reason> {
    meant(cause).filter(|_| is_flagged).or(meant(reason))
}

/// Why a monitor is or was in a state; of a flag what raised it, at which bearing, and what is the matter besides.
pub fn change_in_words(
    state: Option<&str>,
    reason: &Option<String>,
    cause: &Option<String>,
    suspect: Option<u8>,
    names: &Names,
) -> String {
    let is_flagged = state == Some("flagged");
    let Some(told) = told(is_flagged, reason, cause) else { return String::new() };
    let suspect = suspect.filter(|_| is_flagged);
    let suspect = suspect.map_or(String::new(), |bearing| format!(", suspect {}", names.bearing(bearing)));
    let besides = meant(reason).filter(|reason| *reason != told);
    let besides = besides.map_or(String::new(), |reason| format!("; at present {}", why(reason, 0).what));
    format!("{}{suspect}{besides}", why(told, 0).what)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(node: u8, state: &str, reason: &str, heard_us: i64) -> Newest {
        Newest {
            source: i64::from(node),
            since_us: (state == "flagged").then_some(7),
            plant: "north".into(),
            bus: "hall1".into(),
            node,
            heard_us: Some(heard_us),
            state: Some(state.into()),
            reason: Some(reason.into()),
            cause: None,
            result_us: None,
            flagged: None,
            suspect: None,
            residual_um: None,
            ratio: None,
        }
    }

    #[test]
    fn the_worst_stands_first_and_silence_is_no_health() {
        let now_us = 100_000_000;
        let newest = [
            told(1, "tracking", "none", now_us - 1_000_000),
            told(2, "tracking", "none", now_us - 4_000_000),
            told(3, "flagged", "rise", now_us),
            told(6, "flagged", "rise", now_us),
            told(4, "blind", "keyphasor", now_us + 1_000_000),
            Newest { heard_us: None, state: None, ..told(5, "", "none", 0) },
        ];
        let ada = || Acknowledged { who: "Ada".into(), time_us: 8 };
        let earlier = (2, "silent".to_string(), 1);
        let acknowledged = HashMap::from([((3, "flagged".to_string(), 7), ada()), (earlier, ada())]);
        let seen = all(&newest, &acknowledged, &HashMap::new(), now_us);
        let shown: Vec<(u8, &str)> = seen.iter().map(|g| (g.newest.node, g.state_now.as_str())).collect();
        assert_eq!(
            shown,
            [(6, "flagged"), (3, "flagged"), (2, "silent"), (5, "silent"), (4, "blind"), (1, "tracking")]
        );
        assert!(
            seen[0].why.starts_with("the residual rose above its level: record a run-up"),
            "{}",
            seen[0].why
        );
        assert!(seen[2].why.contains("last state was tracking"));
        assert_eq!((seen[4].age_s, seen[3].age_s), (Some(0.0), None), "a clock that is ahead");
        assert_eq!(seen[5].why, "");
        let who = |glance: &Glance| glance.acknowledged.as_ref().map(|seen| seen.who.clone());
        assert_eq!(seen.iter().map(who).collect::<Vec<_>>()[..3], [None, Some("Ada".into()), None]);
        assert_eq!(
            seen.iter().map(|g| g.is_alarm).collect::<Vec<_>>(),
            [true, true, true, true, true, false]
        );
    }

    #[test]
    fn flag_shows_cause_bearing_and_present_state() {
        let risen = Newest { suspect: Some(2), cause: Some("rise".into()), ..told(3, "flagged", "rise", 0) };
        assert_eq!(
            in_words(&risen, &Names::default()),
            "the residual rose above its level, suspect bearing 2: record a run-up and run `rotor-edge improve`"
        );
        let stopped = Newest { reason: Some("age".into()), ..risen.clone() };
        let words = in_words(&stopped, &Names::default());
        assert!(
            words.starts_with(
                "the residual rose above its level, suspect bearing 2; at present the last judged reading is too old: "
            ),
            "{words}"
        );
        let newer = Newest { reason: Some("reason_30".into()), ..told(3, "tracking", "none", 0) };
        assert_eq!(
            in_words(&newer, &Names::default()),
            "reason 30, which this program does not know: watch with a newer program"
        );
        let later = Newest { state: Some("tracking".into()), reason: Some("none".into()), ..risen };
        assert_eq!(in_words(&later, &Names::default()), "", "a cause is one of the flag");
    }
}

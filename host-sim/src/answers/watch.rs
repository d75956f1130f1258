//! Answer of `watch`: everything that was heard.

use rotor_edge_core::can::Keyphasor;
use rotor_edge_core::state::Reason;
use serde::Serialize;
use serde_json::{Map, Value};

use super::monitor_result::TimedResult;
use crate::bus::mac::RefusalCounts;
use crate::bus::numbers::{bearing_number, probe_numbers};
use crate::bus::states::name;
use crate::watch::Watch;
use crate::watch::monitor::{FlagPeriod, Monitor, Version};
use crate::watch::view;
use crate::watch::words::Words;

#[derive(Serialize)]
pub struct WatchAnswer {
    bus: WatchedBus,
    monitors: Vec<WatchedMonitor>,
}

#[derive(Serialize)]
struct WatchedBus {
    name: String,
    bit_rate: u32,
    seconds: f64,
    frames: u64,
    /// Frames of another protocol.
    foreign: u64,
    /// Extended, remote and error frames.
    passed_over: u64,
    /// Mean over the time listened, every frame stuffed at its worst.
    load_percent: f64,
}

#[derive(Serialize)]
struct WatchedMonitor {
    node: u8,
    state: Option<String>,
    reason: Option<String>,
    missing_probes: Vec<u8>,
    evidence_age_s: Option<f64>,
    latched: Option<Latched>,
    silent: bool,
    conflict: bool,
    says: String,
    next: String,
    heard_seconds_ago: Option<f64>,
    heartbeats: u64,
    version: Option<Version>,
    /// Its own, in the order of its heartbeat.
    counters: Option<Map<String, Value>>,
    damaged_results: u16,
    /// What was not believed; null without a key.
    refused: Option<RefusalCounts>,
    model_checksum: Option<String>,
    model_probes: Option<u8>,
    model_planes: Option<u8>,
    model_on_trial: Option<bool>,
    model_replaced: Vec<ModelChange>,
    reading: Option<WatchedReading>,
    unanswered_readings: u32,
    readings_a_second: Option<f64>,
    flags: Vec<WatchedFlag>,
    last: Option<TimedResult>,
    history: Vec<TimedResult>,
}

/// A flag that stays until it is acknowledged.
#[derive(Serialize)]
struct Latched {
    cause: String,
    suspect: Option<u8>,
}

#[derive(Serialize)]
struct ModelChange {
    time_s: f64,
    from: String,
    to: String,
}

/// The last reading that was sent to the monitor.
#[derive(Serialize)]
struct WatchedReading {
    time_s: f64,
    sequence: u16,
    speed_rpm: f32,
    keyphasor: &'static str,
    lost_probes: Vec<u8>,
    gaps_v: Vec<Option<f32>>,
}

/// A time with the flag up.
#[derive(Serialize)]
struct WatchedFlag {
    from_s: f64,
    to_s: f64,
    from_sequence: u16,
    to_sequence: u16,
    lasts: bool,
    suspect: Option<u8>,
}

impl WatchAnswer {
    pub fn of(watch: &Watch, place: &view::WatchedBus, passed_over: u64) -> Self {
        let now_us = watch.now_us();
        let bus = WatchedBus {
            name: place.bus.clone(),
            bit_rate: place.bit_rate,
            seconds: seconds(now_us),
            frames: watch.frames(),
            foreign: watch.foreign(),
            passed_over,
            load_percent: 100.0 * watch.load().mean_bits_a_second(now_us) / f64::from(place.bit_rate),
        };
        Self {
            bus,
            monitors: watch.monitors().map(|(node, m)| WatchedMonitor::of(node, m, now_us)).collect(),
        }
    }
}

impl WatchedMonitor {
    fn of(node: u8, monitor: &Monitor, now_us: u64) -> Self {
        let words = Words::of(node, monitor, now_us);
        let replaced = monitor.replacements().map(|timed| ModelChange {
            time_s: seconds(timed.time_us),
            from: checksum(timed.what.from),
            to: checksum(timed.what.to),
        });
        let status = monitor.status();
        let latched = status.filter(|status| status.cause != Reason::None);
        Self {
            node,
            state: status.map(|status| name(status.state)),
            reason: status.map(|status| name(status.reason)),
            missing_probes: status.map_or(vec![], |status| probe_numbers(status.missing_mask)),
            evidence_age_s: monitor.evidence_age_us(now_us).map(seconds),
            latched: latched.map(|status| Latched {
                cause: name(status.cause),
                suspect: status.suspect.map(bearing_number),
            }),
            silent: monitor.is_silent(now_us),
            conflict: monitor.is_in_conflict(now_us),
            says: words.state,
            next: words.next,
            heard_seconds_ago: monitor.heard_us().map(|heard_us| seconds(now_us - heard_us)),
            heartbeats: monitor.heartbeats(),
            version: monitor.version(),
            counters: monitor.totals().map(|t| t.named().map(|(n, c)| (n.into(), c.into())).collect()),
            damaged_results: monitor.damaged(),
            refused: monitor.refused(),
            model_checksum: monitor.model().map(|model| checksum(model.checksum)),
            model_probes: monitor.model().map(|model| model.probes),
            model_planes: monitor.model().map(|model| model.planes),
            model_on_trial: monitor.model().map(|model| model.on_trial),
            model_replaced: replaced.collect(),
            reading: WatchedReading::of(monitor),
            unanswered_readings: monitor.unanswered(),
            readings_a_second: monitor.readings_a_second(now_us),
            flags: monitor.flagged().iter().map(WatchedFlag::of).collect(),
            last: monitor.last().map(|timed| TimedResult::of(timed, 0)),
            history: monitor.history().iter().map(|timed| TimedResult::of(timed, 0)).collect(),
        }
    }
}

impl WatchedReading {
    fn of(monitor: &Monitor) -> Option<Self> {
        let timed = monitor.reading()?;
        let reading = &timed.what.reading;
        Some(Self {
            time_s: seconds(timed.time_us),
            sequence: timed.what.sequence,
            speed_rpm: reading.speed_rpm,
            keyphasor: match timed.what.keyphasor {
                Keyphasor::NotStated => "not stated",
                Keyphasor::Locked => "locked",
                Keyphasor::Missing => "missing",
                Keyphasor::Unsteady => "unsteady",
            },
            lost_probes: probe_numbers(!reading.valid_mask())
                .into_iter()
                .filter(|number| usize::from(*number) <= reading.probes().len())
                .collect(),
            gaps_v: reading.gaps_v().iter().map(|gap_v| gap_v.is_finite().then_some(*gap_v)).collect(),
        })
    }
}

impl WatchedFlag {
    fn of(flagged: &FlagPeriod) -> Self {
        Self {
            from_s: seconds(flagged.first.time_us),
            to_s: seconds(flagged.last.time_us),
            from_sequence: flagged.first.what,
            to_sequence: flagged.last.what,
            lasts: flagged.lasts,
            suspect: flagged.suspect.map(bearing_number),
        }
    }
}

fn seconds(time_us: u64) -> f64 {
    time_us as f64 * 1e-6
}

fn checksum(checksum: u32) -> String {
    format!("{checksum:08x}")
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::can::{Message, PROTOCOL_VERSION};
    use rotor_edge_core::state::{NodeState, Status};

    use super::*;

    /// What is printed of monitor 1 after a heartbeat, its state and its model.
    fn printed(status: Status, model: Message) -> Value {
        let Status { state, reason, missing_mask, .. } = status;
        let heartbeat =
            Message::Heartbeat { version: PROTOCOL_VERSION, state, reason, missing_mask, readings: 0 };
        let mut watch = Watch::new(Some(1));
        for (time_us, message) in (0..).zip([heartbeat, Message::State(status), model]) {
            watch.receive(time_us, &message.encode(1));
        }
        let place = view::WatchedBus { bus: "x".into(), bit_rate: 500_000 };
        serde_json::to_value(WatchAnswer::of(&watch, &place, 0)).unwrap()["monitors"][0].clone()
    }

    #[test]
    fn latched_flag_is_printed_with_its_cause_bearing_and_next_step() {
        let (state, cause) = (NodeState::Flagged, Reason::Rise);
        let flagged = Status { state, cause, reason: cause, suspect: Some(1), ..Status::default() };
        let model = Message::Model { checksum: 0x1f, probes: 4, planes: 2, on_trial: true };
        let monitor = printed(flagged, model);
        assert_eq!(monitor["state"], "flagged");
        assert_eq!(monitor["latched"], serde_json::json!({"cause": "rise", "suspect": 2}));
        assert!(monitor["next"].as_str().unwrap().contains("rotor-edge acknowledge --node 1"), "{monitor}");
        assert!(monitor["says"].as_str().unwrap().contains("its model is on trial"), "{monitor}");
        assert_eq!(monitor["model_checksum"], "0000001f");
        let told = ["model_on_trial", "model_probes", "model_planes"].map(|name| monitor[name].clone());
        assert_eq!(told, [Value::from(true), 4.into(), 2.into()]);
    }

    #[test]
    fn monitor_without_a_model_is_printed_with_its_reason() {
        let (state, reason) = (NodeState::NoModel, Reason::NothingStored);
        let model = Message::Model { checksum: 0, probes: 0, planes: 0, on_trial: false };
        let monitor = printed(Status { state, reason, ..Status::default() }, model);
        assert_eq!((&monitor["state"], &monitor["reason"]), (&"no_model".into(), &"nothing_stored".into()));
        let absent = ["latched", "model_checksum", "model_on_trial"].map(|name| monitor[name].is_null());
        assert_eq!(absent, [true; 3]);
    }
}

//! What `watch --json` prints: everything that was heard.

use rotor_edge_core::can::{Counters, Keyphasor};
use serde::Serialize;

use super::answer::{Answer, state_name};
use crate::watch::Watch;
use crate::watch::monitor::{Flagged, Monitor, Version};
use crate::watch::view::Place;
use crate::watch::words::{PROBE_NAMES, Words, bearing_number};

#[derive(Serialize)]
pub struct Summary {
    bus: Bus,
    monitors: Vec<Node>,
}

#[derive(Serialize)]
struct Bus {
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
struct Node {
    node: u8,
    state: Option<&'static str>,
    silent: bool,
    conflict: bool,
    says: String,
    next: String,
    heard_seconds_ago: Option<f64>,
    heartbeats: u64,
    version: Option<Version>,
    counters: Option<Counted>,
    damaged_results: u16,
    model_checksum: Option<String>,
    model_replaced: Vec<Replaced>,
    reading: Option<Reading>,
    unanswered_readings: u32,
    readings_a_second: Option<f64>,
    flags: Vec<Flag>,
    last: Option<Answer>,
    history: Vec<Answer>,
}

/// A monitor's own counters, in the order of its heartbeat.
#[derive(Serialize)]
struct Counted {
    readings: u16,
    lost: u16,
    rejected: u16,
    repeated: u16,
    late: u16,
    incomplete: u16,
    stray: u16,
    skipped: u16,
    resynchronised: u16,
    overflowed: u16,
    unsolved: u16,
    accepted: u16,
    refused: u16,
    forged: u16,
    replayed: u16,
    broken: u16,
    conflicts: u16,
}

#[derive(Serialize)]
struct Replaced {
    time_s: f64,
    from: String,
    to: String,
}

/// The last reading that was sent to the monitor.
#[derive(Serialize)]
struct Reading {
    time_s: f64,
    sequence: u16,
    speed_rpm: f32,
    keyphasor: &'static str,
    lost_probes: Vec<&'static str>,
}

/// A time with the flag up.
#[derive(Serialize)]
struct Flag {
    from_s: f64,
    to_s: f64,
    from_sequence: u16,
    to_sequence: u16,
    lasts: bool,
    suspect: Option<u8>,
}

impl Summary {
    pub fn of(watch: &Watch, place: &Place, passed_over: u64) -> Self {
        let now_us = watch.now_us();
        let bus = Bus {
            name: place.bus.clone(),
            bit_rate: place.bit_rate,
            seconds: seconds(now_us),
            frames: watch.frames(),
            foreign: watch.foreign(),
            passed_over,
            load_percent: 100.0 * watch.load().mean_bits_a_second(now_us) / f64::from(place.bit_rate),
        };
        Self { bus, monitors: watch.monitors().map(|(node, m)| Node::of(node, m, now_us)).collect() }
    }
}

impl Node {
    fn of(node: u8, monitor: &Monitor, now_us: u64) -> Self {
        let words = Words::of(node, monitor, now_us);
        let replaced = monitor.replacements().map(|timed| Replaced {
            time_s: seconds(timed.time_us),
            from: checksum(timed.what.from),
            to: checksum(timed.what.to),
        });
        Self {
            node,
            state: monitor.state().map(state_name),
            silent: monitor.is_silent(now_us),
            conflict: monitor.is_in_conflict(now_us),
            says: words.state,
            next: words.next,
            heard_seconds_ago: monitor.heard_us().map(|heard_us| seconds(now_us - heard_us)),
            heartbeats: monitor.heartbeats(),
            version: monitor.version(),
            counters: monitor.counters().map(Counted::from),
            damaged_results: monitor.damaged(),
            model_checksum: monitor.model_checksum().map(checksum),
            model_replaced: replaced.collect(),
            reading: Reading::of(monitor),
            unanswered_readings: monitor.unanswered(),
            readings_a_second: monitor.readings_a_second(now_us),
            flags: monitor.flagged().iter().map(Flag::of).collect(),
            last: monitor.last().map(|timed| Answer::of(timed, 0)),
            history: monitor.history().iter().map(|timed| Answer::of(timed, 0)).collect(),
        }
    }
}

impl Reading {
    fn of(monitor: &Monitor) -> Option<Self> {
        let timed = monitor.reading()?;
        let reading = &timed.what.reading;
        let lost = PROBE_NAMES.into_iter().zip(&reading.probes).filter(|(_, probe)| !probe.is_finite());
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
            lost_probes: lost.map(|(name, _)| name).collect(),
        })
    }
}

impl Flag {
    fn of(flagged: &Flagged) -> Self {
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

impl From<&Counters> for Counted {
    fn from(c: &Counters) -> Self {
        Self {
            readings: c.readings,
            lost: c.lost,
            rejected: c.rejected,
            repeated: c.repeated,
            late: c.late,
            incomplete: c.incomplete,
            stray: c.stray,
            skipped: c.skipped,
            resynchronised: c.resynchronised,
            overflowed: c.overflowed,
            unsolved: c.unsolved,
            accepted: c.accepted,
            refused: c.refused,
            forged: c.forged,
            replayed: c.replayed,
            broken: c.broken,
            conflicts: c.conflicts,
        }
    }
}

fn seconds(time_us: u64) -> f64 {
    time_us as f64 * 1e-6
}

fn checksum(checksum: u32) -> String {
    format!("{checksum:08x}")
}

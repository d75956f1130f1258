//! What was heard of one monitor.

use std::collections::VecDeque;

use rotor_edge_core::can::{
    Assembler, Counters, FLAG_FLAGGED, Frame, Message, MonitorResult, NumberedReading,
    OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION, ResultAssembler, flag_at_bound,
};
use rotor_edge_core::model::MAX_PLANES;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::state::{NodeState, Status};
use serde::Serialize;

use crate::bus::counters::CounterTotals;
use crate::bus::decoded::Timed;
use crate::bus::mac::RefusalCounts;

pub const HISTORY: usize = 1_000;
/// Changes of the model remembered.
const REPLACEMENTS: usize = 8;
/// Results over which their rate is averaged.
const RATE_RESULTS: usize = 50;
/// Heartbeats missed after which a monitor counts as silent, and a conflict as over.
const QUIET_PERIODS: u64 = 3;

/// Answer to a version query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Version {
    /// Version of the protocol that it speaks.
    pub protocol: u8,
    /// Oldest version whose frames still mean the same to it.
    pub oldest: u8,
    /// Version of the models that it takes.
    pub model_schema: u8,
    /// Basis shapes of its model.
    pub shapes: u8,
    /// Probes that it can hold.
    pub probes: u8,
    /// Planes that it can hold.
    pub planes: u8,
}

/// The model that a monitor runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelInUse {
    pub checksum: u32,
    pub probes: u8,
    pub planes: u8,
    /// It is on trial: the one before comes back unless it is confirmed.
    pub on_trial: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Replacement {
    /// Checksum before.
    pub from: u32,
    /// Checksum since.
    pub to: u32,
}

/// A time during which the flag was up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlagPeriod {
    /// First result with the flag.
    pub first: Timed<u16>,
    /// Last result with it.
    pub last: Timed<u16>,
    /// Whether the flag is still up in the latest result.
    pub lasts: bool,
    /// Bearing suspected at the end, from 0.
    pub suspect: Option<u8>,
}

/// One monitor, and the readings that somebody sends it.
#[derive(Debug, Clone, Default)]
pub struct Monitor {
    heard_us: Option<u64>,
    heartbeats: u64,
    heartbeat_version: Option<u8>,
    asked_at_version: Option<u8>,
    version: Option<Version>,
    status: Option<Timed<Status>>,
    conflict_us: Option<u64>,
    totals: CounterTotals,
    model: Option<ModelInUse>,
    replacements: VecDeque<Timed<Replacement>>,
    results: ResultAssembler,
    last: Option<Timed<MonitorResult>>,
    history: VecDeque<Timed<MonitorResult>>,
    at_bound: [u16; MAX_PLANES],
    arrivals: VecDeque<u64>,
    readings: Assembler,
    reading: Option<Timed<NumberedReading>>,
    unanswered: u32,
    refused: Option<RefusalCounts>,
}

impl Monitor {
    /// Takes a frame with its number; `true` if the monitor should be asked for its version.
    pub(super) fn receive(&mut self, time_us: u64, frame: &Frame, message: &Message) -> bool {
        if is_told(message) {
            self.hear_reading(time_us, frame);
            return false;
        }
        self.heard_us = Some(time_us);
        self.totals.take(message);
        match *message {
            Message::Heartbeat { version, state, reason, missing_mask, .. } => {
                self.heartbeats += 1;
                self.heartbeat_version = Some(version);
                // what it does not carry stays, with the age of its evidence
                let unknown = Timed { time_us, what: Status { age_s: f32::INFINITY, ..Status::default() } };
                let before = self.status.unwrap_or(unknown);
                let what = Status { state, reason, missing_mask, ..before.what };
                self.hear_status(Timed { what, ..before }, time_us);
            }
            Message::State(what) => self.hear_status(Timed { time_us, what }, time_us),
            Message::Model { checksum, probes, planes, on_trial } => {
                self.hear_model(time_us, ModelInUse { checksum, probes, planes, on_trial });
            }
            Message::Version { protocol, oldest, model_schema, shapes, probes, planes } => {
                self.version = Some(Version { protocol, oldest, model_schema, shapes, probes, planes });
            }
            _ => {
                if let Some(result) = self.results.receive(frame) {
                    self.hear_result(time_us, result);
                }
            }
        }
        self.must_be_asked()
    }

    /// Once for each version that its heartbeats carry.
    fn must_be_asked(&mut self) -> bool {
        let unknown = self.heartbeat_version != self.version.map(|version| version.protocol);
        let ask =
            self.heartbeat_version.is_some() && unknown && self.asked_at_version != self.heartbeat_version;
        if ask {
            self.asked_at_version = self.heartbeat_version;
        }
        ask
    }

    fn hear_reading(&mut self, time_us: u64, frame: &Frame) {
        let timeout_us = NodeConfig::READING_TIMEOUT_US;
        if let Some(what) = self.readings.receive(timeout_us, time_us, frame) {
            self.reading = Some(Timed { time_us, what });
            self.unanswered = self.unanswered.saturating_add(1);
        }
    }

    fn hear_status(&mut self, status: Timed<Status>, now_us: u64) {
        if status.what.state == NodeState::Conflict {
            self.conflict_us = Some(now_us);
        }
        self.status = Some(status);
    }

    fn hear_model(&mut self, time_us: u64, model: ModelInUse) {
        let to = model.checksum;
        if let Some(from) = self.model.replace(model).map(|before| before.checksum).filter(|from| *from != to)
        {
            keep(&mut self.replacements, REPLACEMENTS, Timed { time_us, what: Replacement { from, to } });
        }
    }

    fn hear_result(&mut self, time_us: u64, what: MonitorResult) {
        self.unanswered = 0;
        for (plane, in_a_row) in (0..).zip(&mut self.at_bound) {
            let is_at_bound = what.flags & flag_at_bound(plane) != 0;
            *in_a_row = if is_at_bound { in_a_row.saturating_add(1) } else { 0 };
        }
        self.last = Some(Timed { time_us, what });
        keep(&mut self.history, HISTORY, Timed { time_us, what });
        keep(&mut self.arrivals, RATE_RESULTS, time_us);
    }

    /// It is believed by its MACs, and so much was not.
    pub(super) fn refuse(&mut self, refused: RefusalCounts) {
        self.refused = Some(refused);
    }

    /// What was heard under its number and not believed; `None` where no MACs are checked.
    pub fn refused(&self) -> Option<RefusalCounts> {
        self.refused
    }

    pub(super) fn clear(&mut self) {
        self.history.clear();
    }

    /// Whether anything of it can only come from our protocol: a checksum that fits, a version, or a heartbeat.
    pub(super) fn is_known(&self) -> bool {
        let known = |version| (OLDEST_PROTOCOL_VERSION..=PROTOCOL_VERSION).contains(&version);
        self.last.is_some()
            || self.refused.is_some_and(|refused| refused.any())
            || self.reading.is_some()
            || self.heartbeat_version.is_some_and(known)
            || self.version.is_some_and(|version| Some(version.protocol) == self.heartbeat_version)
    }

    /// The version that it speaks, if its frames mean something else than we know.
    pub fn foreign_version(&self) -> Option<u8> {
        let protocol = self.version.map(|version| version.protocol).or(self.heartbeat_version)?;
        let means_the_same = match self.version {
            Some(v) if v.protocol > PROTOCOL_VERSION => v.oldest <= PROTOCOL_VERSION,
            _ => (OLDEST_PROTOCOL_VERSION..=PROTOCOL_VERSION).contains(&protocol),
        };
        (!means_the_same).then_some(protocol)
    }

    /// When it was last heard, µs; `None` if somebody sends it readings and it was never heard.
    pub fn heard_us(&self) -> Option<u64> {
        self.heard_us
    }

    /// Nothing was heard of it for three heartbeat periods.
    pub fn is_silent(&self, now_us: u64) -> bool {
        self.heard_us.is_some_and(|heard_us| is_over(heard_us, now_us))
    }

    /// Two devices use its number: one of them said so, whatever the other says.
    pub fn is_in_conflict(&self, now_us: u64) -> bool {
        self.conflict_us.is_some_and(|conflict_us| !is_over(conflict_us, now_us))
    }

    /// What it is doing, by its last word.
    pub fn state(&self) -> Option<NodeState> {
        self.status().map(|status| status.state)
    }

    /// All that it said of itself last.
    pub fn status(&self) -> Option<&Status> {
        self.status.as_ref().map(|timed| &timed.what)
    }

    /// Age of the evidence for its state, µs; `None` if it has judged no reading.
    pub fn evidence_age_us(&self, now_us: u64) -> Option<u64> {
        let Timed { time_us, what } = self.status?;
        let told_us = what.age_s.is_finite().then(|| (f64::from(what.age_s.max(0.0)) * 1e6) as u64)?;
        let told = told_us.saturating_add(now_us.saturating_sub(time_us));
        // a result is younger evidence, if it was judged
        let last = self.last.filter(|last| last.what.is_judged());
        let since_result = last.map(|last| now_us.saturating_sub(last.time_us));
        Some(since_result.map_or(told, |since| since.min(told)))
    }

    /// Its answer to a version query.
    pub fn version(&self) -> Option<Version> {
        self.version
    }

    pub fn heartbeats(&self) -> u64 {
        self.heartbeats
    }

    /// As it counts itself; `None` before its first heartbeat.
    pub fn counters(&self) -> Option<&Counters> {
        self.totals().map(CounterTotals::told)
    }

    /// What it has counted since it is listened to; `None` before its first heartbeat.
    pub fn totals(&self) -> Option<&CounterTotals> {
        (self.heartbeats > 0).then_some(&self.totals)
    }

    /// Results begun and never completed, or with a wrong checksum.
    pub fn damaged(&self) -> u16 {
        self.results.damaged()
    }

    /// Which model it runs; `None` if it has none or has not told yet.
    pub fn model(&self) -> Option<ModelInUse> {
        self.model.filter(|model| model.planes > 0)
    }

    /// The last changes of its model.
    pub fn replacements(&self) -> impl DoubleEndedIterator<Item = &Timed<Replacement>> {
        self.replacements.iter()
    }

    pub fn last(&self) -> Option<&Timed<MonitorResult>> {
        self.last.as_ref()
    }

    /// Its last results, at most [`HISTORY`] and none from before they were cleared.
    pub fn history(&self) -> &VecDeque<Timed<MonitorResult>> {
        &self.history
    }

    /// The last reading that was sent to it.
    pub fn reading(&self) -> Option<&Timed<NumberedReading>> {
        self.reading.as_ref()
    }

    /// Whole readings since its last result.
    pub fn unanswered(&self) -> u32 {
        self.unanswered
    }

    /// Results in a row, up to the last, in which each plane's unbalance was at the bound of its growth.
    pub fn at_bound(&self) -> [u16; MAX_PLANES] {
        self.at_bound
    }

    /// Readings answered a second, averaged over the last results and the silence since; `None` before the second.
    pub fn readings_a_second(&self, now_us: u64) -> Option<f64> {
        let intervals = self.arrivals.len().checked_sub(1).filter(|intervals| *intervals > 0)?;
        let time_us = now_us.saturating_sub(*self.arrivals.front()?);
        (time_us > 0).then(|| intervals as f64 * 1e6 / time_us as f64)
    }

    /// The times in the history during which the flag was up.
    pub fn flagged(&self) -> Vec<FlagPeriod> {
        let mut stretches: Vec<FlagPeriod> = Vec::new();
        for timed in &self.history {
            let here = Timed { time_us: timed.time_us, what: timed.what.sequence };
            match (timed.what.flags & FLAG_FLAGGED != 0, stretches.last_mut()) {
                (true, Some(stretch)) if stretch.lasts => {
                    (stretch.last, stretch.suspect) = (here, timed.what.suspect);
                }
                (true, _) => stretches.push(FlagPeriod {
                    first: here,
                    last: here,
                    lasts: true,
                    suspect: timed.what.suspect,
                }),
                (false, Some(stretch)) => stretch.lasts = false,
                (false, None) => {}
            }
        }
        stretches
    }
}

/// Frames that others send to a monitor.
fn is_told(message: &Message) -> bool {
    matches!(
        message,
        Message::ReadingStart { .. }
            | Message::ProbeVector { .. }
            | Message::Gaps { .. }
            | Message::ReadingEnd { .. }
            | Message::VersionQuery
    )
}

fn is_over(since_us: u64, now_us: u64) -> bool {
    now_us.saturating_sub(since_us) > QUIET_PERIODS * NodeConfig::HEARTBEAT_PERIOD_US
}

fn keep<T>(memory: &mut VecDeque<T>, most: usize, what: T) {
    if memory.len() == most {
        memory.pop_front();
    }
    memory.push_back(what);
}

//! Frames in, frames out: all that a board calls.
//!
//! The board hands in every frame and the time, sends what [`Node::transmit`] gives it and stores what [`Node::to_save`]
//! asks for; nothing here does I/O.

#[cfg(test)]
mod command_tests;
mod commands;
mod ownership;
#[cfg(test)]
mod tests;

use heapless::Deque;

use crate::can::{
    Assembler, BROADCAST_NODE, COUNTER_PAIRS, Counters, FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame, MAX_NODE,
    MAX_RESULT_FRAMES, Message, MonitorResult, NumberedReading, OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION,
    TYPE_TO_NODE, flag_at_bound, result_frames,
};
use crate::command::{CODE_BYTES, HEAD_BYTES, Key, MAX_REQUEST_BYTES};
use crate::model::{MODEL_SCHEMA, Model, ModelError};
use crate::reading::Reading;
use crate::residual::{ResidualConfig, ResidualMonitor, Verdict};
use crate::state::{NodeState, Reason, Status};
use crate::track::{Estimate, TrackConfig, TrackError, Tracker};
use commands::Desk;
pub use commands::Save;
use ownership::Ownership;

/// Frames waiting to be sent, at most.
pub const QUEUE_FRAMES: usize = 32;
/// No probe reads more than this, µm: a feature beyond it is a fault of transmission or scaling.
pub const ABSURD_UM: f32 = 10_000.0;

/// Frames of a heartbeat.
pub const HEARTBEAT_FRAMES: usize = COUNTER_PAIRS + 3;

/// Settings of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodeConfig {
    /// Its number on the bus, 0 to [`MAX_NODE`].
    pub node: u8,
    /// How the unbalance is followed.
    pub track: TrackConfig,
    /// When a residual is suspicious.
    pub residual: ResidualConfig,
    /// From a reading's start to its end at most, µs.
    pub reading_timeout_us: u64,
    /// Time between heartbeats, µs.
    pub heartbeat_period_us: u64,
    /// From the first [`Node::poll`] to the first answer: time to learn that somebody else uses the number, µs.
    pub listen_us: u64,
    /// Without a key, the node takes no commands.
    pub key: Option<Key>,
}

impl NodeConfig {
    /// Usual settings: 200 ms for a reading, a heartbeat every second, 100 ms of listening, no key.
    pub fn new(node: u8) -> Self {
        Self {
            node,
            track: TrackConfig::default(),
            residual: ResidualConfig::default(),
            reading_timeout_us: 200_000,
            heartbeat_period_us: 1_000_000,
            listen_us: 100_000,
            key: None,
        }
    }
}

/// Why a node cannot start or take a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NodeError {
    /// The node's number is above [`MAX_NODE`].
    Node,
    /// The model was refused by [`Model::check`], which says why.
    Model,
}

impl From<ModelError> for NodeError {
    fn from(_: ModelError) -> Self {
        Self::Model
    }
}

/// A monitor: model, state of phase II, residuals, and its place on the bus.
#[derive(Debug, Clone)]
pub struct Node<const N: usize, const PROBES: usize, const PLANES: usize> {
    config: NodeConfig,
    model: Model<N, PROBES, PLANES>,
    assembler: Assembler,
    tracker: Tracker<PLANES>,
    monitor: ResidualMonitor,
    estimate: Option<Estimate>,
    verdict: Option<Verdict>,
    next_heartbeat_us: u64,
    ownership: Ownership,
    desk: Desk,
    queue: Deque<Frame, QUEUE_FRAMES>,
}

impl<const N: usize, const PROBES: usize, const PLANES: usize> Node<N, PROBES, PLANES> {
    /// A node with a model, waiting for its first reading.
    ///
    /// Errors: [`NodeError`].
    pub fn new(config: NodeConfig, model: Model<N, PROBES, PLANES>) -> Result<Self, NodeError> {
        const {
            assert!(
                HEAD_BYTES + Model::<N, PROBES, PLANES>::max_size_bytes() + CODE_BYTES <= MAX_REQUEST_BYTES
            );
        }
        if config.node > MAX_NODE {
            return Err(NodeError::Node);
        }
        model.check()?;
        let tracker = Tracker::new(&model);
        let desk = Desk::new(model.checksum());
        Ok(Self {
            config,
            model,
            assembler: Assembler::new(),
            tracker,
            monitor: ResidualMonitor::new(),
            estimate: None,
            verdict: None,
            next_heartbeat_us: 0,
            ownership: Ownership::new(config.listen_us, config.heartbeat_period_us),
            desk,
            queue: Deque::new(),
        })
    }

    /// Takes any frame of the bus but the node's own; those of other nodes are ignored. The frame that completes a
    /// reading has it evaluated at once and its result queued.
    pub fn receive(&mut self, time_us: u64, frame: &Frame) {
        let asked = Message::decode(frame).map(|(_, message)| message) == Ok(Message::VersionQuery);
        if asked && [self.config.node, BROADCAST_NODE].contains(&frame.node()) {
            return self.tell_version();
        }
        if frame.node() != self.config.node {
            return;
        }
        if frame.is_from_node() {
            self.count(|c| &mut c.conflicts);
            if self.ownership.heard_other(time_us) {
                self.heartbeat();
            }
        } else if frame.message_type() == TYPE_TO_NODE {
            self.transfer(time_us, frame.bytes());
        } else if let Some(reading) = self.assembler.receive(self.config.reading_timeout_us, time_us, frame) {
            self.evaluate(&reading);
        }
    }

    /// Time-outs, transfers and heartbeat; to be called a few times per heartbeat or more often, from the start on.
    pub fn poll(&mut self, time_us: u64) {
        self.assembler.poll(self.config.reading_timeout_us, time_us);
        let may_answer_again = self.ownership.poll(time_us);
        self.poll_transfer(time_us);
        if may_answer_again || time_us >= self.next_heartbeat_us {
            self.next_heartbeat_us = time_us.saturating_add(self.config.heartbeat_period_us);
            self.heartbeat();
        }
    }

    /// The next frame to send.
    pub fn transmit(&mut self) -> Option<Frame> {
        self.queue.pop_front()
    }

    /// What became of the readings.
    pub fn counters(&self) -> Counters {
        *self.assembler.counters()
    }

    /// The last estimate.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }

    /// The last verdict on the residual.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.verdict.as_ref()
    }

    /// The model in use.
    pub fn model(&self) -> &Model<N, PROBES, PLANES> {
        &self.model
    }

    /// What the node is doing.
    pub fn state(&self) -> NodeState {
        self.ownership.silence().unwrap_or(match &self.verdict {
            None => NodeState::Waiting,
            Some(verdict) if verdict.flagged => NodeState::Flagged,
            Some(verdict) if verdict.suspicious => NodeState::Suspicious,
            Some(_) => NodeState::Tracking,
        })
    }

    /// Changes to a better model. Tracking goes on from the unbalance last found (see [`Node::restart`]); the
    /// residuals begin a new level, for the old one belongs to the old model.
    ///
    /// Errors: [`NodeError::Model`], and the old model stays.
    pub fn replace_model(&mut self, model: Model<N, PROBES, PLANES>) -> Result<(), NodeError> {
        model.check()?;
        self.adopt(model);
        Ok(())
    }

    fn adopt(&mut self, model: Model<N, PROBES, PLANES>) {
        self.desk.model_replaced(model.checksum());
        self.model = model;
        self.tracker.forget_amplitudes();
        self.forget_verdict();
    }

    /// Begins a new record: the model's initial unbalance, no residual level, any sequence number next. Counters go on.
    pub fn restart(&mut self) {
        self.tracker = Tracker::new(&self.model);
        self.forget_verdict();
        self.assembler.restart();
    }

    fn forget_verdict(&mut self) {
        self.monitor = ResidualMonitor::new();
        self.estimate = None;
        self.verdict = None;
    }

    fn evaluate(&mut self, numbered: &NumberedReading) {
        let reading = &numbered.reading;
        if is_absurd(reading) || !self.model.covers(reading.speed_rpm) {
            return self.count(|c| &mut c.rejected);
        }
        let usable = reading.is_complete() && numbered.keyphasor.is_usable();
        if !usable || self.ownership.silence().is_some() {
            return self.count(|c| &mut c.skipped);
        }
        let Ok((estimate, verdict)) = self.judge(reading) else {
            return self.count(|c| &mut c.unsolved);
        };
        self.count(|c| &mut c.readings);
        let result = result(numbered.sequence, &estimate, &verdict);
        self.queue_all::<MAX_RESULT_FRAMES>(result_frames(self.config.node, &result));
        self.estimate = Some(estimate);
        self.verdict = Some(verdict);
    }

    fn count(&mut self, which: impl FnOnce(&mut Counters) -> &mut u32) {
        let counter = which(self.assembler.counters_mut());
        *counter = counter.wrapping_add(1);
    }

    fn judge(&mut self, reading: &Reading) -> Result<(Estimate, Verdict), TrackError> {
        let estimate = self.tracker.update(&self.config.track, &self.model, reading, 1.2)?;
        let verdict = self.monitor.update(&self.config.residual, estimate.residual);
        Ok((estimate, verdict.map_err(|_| TrackError::Response)?))
    }

    fn heartbeat(&mut self) {
        let c = self.counters();
        let state = self.state();
        let status = Status { state, age_s: f32::INFINITY, ..Status::default() };
        let heartbeat = Message::Heartbeat {
            version: PROTOCOL_VERSION,
            state,
            reason: Reason::None,
            missing_mask: 0,
            readings: c.readings,
        };
        let model = Message::Model {
            checksum: self.desk.model_checksum(),
            probes: self.model.probes.len() as u8,
            planes: self.model.planes.len() as u8,
        };
        let counters = (0..).zip(c.pairs()).map(|(pair, values)| Message::Counters { pair, values });
        let messages = [heartbeat, Message::State(status)].into_iter().chain(counters).chain([model]);
        let node = self.config.node;
        self.queue_all::<HEARTBEAT_FRAMES>(messages.map(|message| message.encode(node)));
    }

    fn tell_version(&mut self) {
        let version = Message::Version {
            protocol: PROTOCOL_VERSION,
            oldest: OLDEST_PROTOCOL_VERSION,
            model_schema: MODEL_SCHEMA as u8,
            shapes: N as u8,
            probes: PROBES as u8,
            planes: PLANES as u8,
        };
        self.queue_all::<1>([version.encode(self.config.node)]);
    }

    /// Queues all frames or, lacking room, none: half a result is of no use.
    fn queue_all<const COUNT: usize>(&mut self, frames: impl IntoIterator<Item = Frame>) {
        if QUEUE_FRAMES.saturating_sub(self.queue.len()) < COUNT {
            let counters = self.assembler.counters_mut();
            counters.overflowed = counters.overflowed.wrapping_add(COUNT as u32);
            return;
        }
        for frame in frames {
            let _ = self.queue.push_back(frame);
        }
    }
}

/// A feature no probe can show. A lost probe (NaN) is not absurd.
fn is_absurd(reading: &Reading) -> bool {
    reading.probes().iter().any(|probe| probe.cos_um.abs() > ABSURD_UM || probe.sin_um.abs() > ABSURD_UM)
}

fn result(sequence: u16, estimate: &Estimate, verdict: &Verdict) -> MonitorResult {
    let verdict_bits = [(verdict.suspicious, FLAG_SUSPICIOUS), (verdict.flagged, FLAG_FLAGGED)];
    let bound_bits = (0..).zip(estimate.at_bound).map(|(plane, at_bound)| (at_bound, flag_at_bound(plane)));
    let bits = verdict_bits.into_iter().chain(bound_bits);
    MonitorResult {
        sequence,
        flags: bits.fold(0, |flags, (set, bit)| if set { flags | bit } else { flags }),
        suspect: verdict.suspect.map(|bearing| bearing as u8),
        redundancy: estimate.redundancy,
        streak: verdict.streak,
        used_mask: 0,
        reason: Reason::None,
        planes: estimate.planes,
        unbalance_g_mm: estimate.unbalance_g_mm,
        static_g_mm: estimate.static_g_mm,
        dynamic_g_mm: estimate.dynamic_g_mm,
        e_um: estimate.residual.e_um,
        ratio: estimate.residual.ratio,
        floor_um: 0.0,
        level_um: verdict.level_um,
    }
}

//! Frames in, frames out: all that a board calls.
//!
//! The board hands in every frame and the time, and sends what [`Node::transmit`] gives it; nothing here does I/O.

#[cfg(test)]
mod tests;

use heapless::Deque;

use crate::can::{
    Assembled, Assembler, Counters, FLAG_AT_BOUND_1, FLAG_AT_BOUND_2, FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame,
    MAX_NODE, Message, MonitorResult, NodeState, PROTOCOL_VERSION, RESULT_FRAMES, result_frames,
};
use crate::model::{Model, ModelError};
use crate::reading::Reading;
use crate::residual::{ResidualConfig, ResidualMonitor, Verdict};
use crate::track::{Estimate, TrackConfig, TrackError, Tracker};

/// Frames waiting to be sent, at most.
pub const QUEUE_FRAMES: usize = 32;
/// No probe reads more than this, µm: a feature beyond it is a fault of transmission or scaling.
pub const ABSURD_UM: f32 = 10_000.0;

const HEARTBEAT_FRAMES: usize = 3;

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
}

impl NodeConfig {
    /// Usual settings: 200 ms for a reading, a heartbeat every second.
    pub fn new(node: u8) -> Self {
        Self {
            node,
            track: TrackConfig::default(),
            residual: ResidualConfig::default(),
            reading_timeout_us: 200_000,
            heartbeat_period_us: 1_000_000,
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
pub struct Node<const N: usize> {
    config: NodeConfig,
    model: Model<N>,
    assembler: Assembler,
    tracker: Tracker,
    monitor: ResidualMonitor,
    estimate: Option<Estimate>,
    verdict: Option<Verdict>,
    next_heartbeat_us: u64,
    queue: Deque<Frame, QUEUE_FRAMES>,
}

impl<const N: usize> Node<N> {
    /// A node with a model, waiting for its first reading.
    ///
    /// Errors: [`NodeError`].
    pub fn new(config: NodeConfig, model: Model<N>) -> Result<Self, NodeError> {
        if config.node > MAX_NODE {
            return Err(NodeError::Node);
        }
        model.check()?;
        let tracker = Tracker::new(&model);
        Ok(Self {
            config,
            model,
            assembler: Assembler::new(),
            tracker,
            monitor: ResidualMonitor::new(),
            estimate: None,
            verdict: None,
            next_heartbeat_us: 0,
            queue: Deque::new(),
        })
    }

    /// Takes any frame of the bus; those of other nodes are ignored. The frame that completes a reading has it evaluated
    /// at once and its result queued.
    pub fn receive(&mut self, time_us: u64, frame: &Frame) {
        if frame.node() != self.config.node {
            return;
        }
        if let Some(assembled) = self.assembler.receive(self.config.reading_timeout_us, time_us, frame) {
            self.evaluate(&assembled);
        }
    }

    /// Time-outs and heartbeat; to be called a few times per heartbeat or more often.
    pub fn poll(&mut self, time_us: u64) {
        self.assembler.poll(self.config.reading_timeout_us, time_us);
        if time_us >= self.next_heartbeat_us {
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
    pub fn model(&self) -> &Model<N> {
        &self.model
    }

    /// What the node is doing.
    pub fn state(&self) -> NodeState {
        match &self.verdict {
            None => NodeState::Waiting,
            Some(verdict) if verdict.flagged => NodeState::Flagged,
            Some(verdict) if verdict.suspicious => NodeState::Suspicious,
            Some(_) => NodeState::Tracking,
        }
    }

    /// Changes to a better model. Tracking goes on from the unbalance last found (see [`Node::restart_tracker`]); the
    /// residuals begin a new level, for the old one belongs to the old model.
    ///
    /// Errors: [`NodeError::Model`], and the old model stays.
    pub fn replace_model(&mut self, model: Model<N>) -> Result<(), NodeError> {
        model.check()?;
        self.model = model;
        self.tracker.forget_amplitudes();
        self.monitor = ResidualMonitor::new();
        self.estimate = None;
        self.verdict = None;
        Ok(())
    }

    /// Forgets the unbalance last found and starts from the model's initial one.
    pub fn restart_tracker(&mut self) {
        self.tracker = Tracker::new(&self.model);
    }

    fn evaluate(&mut self, &Assembled { sequence, reading }: &Assembled) {
        let counters = self.assembler.counters_mut();
        if is_absurd(&reading) || !self.model.covers(reading.speed_rpm) {
            counters.rejected = counters.rejected.wrapping_add(1);
            return;
        }
        if !reading.is_complete() {
            counters.skipped = counters.skipped.wrapping_add(1);
            return;
        }
        match self.judge(&reading) {
            Ok((estimate, verdict)) => {
                let counters = self.assembler.counters_mut();
                counters.readings = counters.readings.wrapping_add(1);
                self.queue_all::<RESULT_FRAMES>(result_frames(
                    self.config.node,
                    &result(sequence, &estimate, &verdict),
                ));
                self.estimate = Some(estimate);
                self.verdict = Some(verdict);
            }
            Err(_) => {
                let counters = self.assembler.counters_mut();
                counters.unsolved = counters.unsolved.wrapping_add(1);
            }
        }
    }

    fn judge(&mut self, reading: &Reading) -> Result<(Estimate, Verdict), TrackError> {
        let estimate = self.tracker.update(&self.config.track, &self.model, reading)?;
        let verdict = self.monitor.update(&self.config.residual, estimate.residual);
        Ok((estimate, verdict.map_err(|_| TrackError::Response)?))
    }

    fn heartbeat(&mut self) {
        let c = self.counters();
        let state = self.state();
        let messages = [
            Message::Heartbeat {
                version: PROTOCOL_VERSION,
                state,
                readings: c.readings,
                lost: c.lost,
                rejected: c.rejected,
            },
            Message::Counters {
                repeated: c.repeated,
                late: c.late,
                incomplete: c.incomplete,
                stray: c.stray,
            },
            Message::Discards {
                skipped: c.skipped,
                resynchronised: c.resynchronised,
                overflowed: c.overflowed,
                unsolved: c.unsolved,
            },
        ];
        let node = self.config.node;
        self.queue_all::<HEARTBEAT_FRAMES>(messages.map(|message| message.encode(node)));
    }

    /// Queues all frames or, lacking room, none: half a result is of no use.
    fn queue_all<const COUNT: usize>(&mut self, frames: impl IntoIterator<Item = Frame>) {
        if QUEUE_FRAMES.saturating_sub(self.queue.len()) < COUNT {
            let counters = self.assembler.counters_mut();
            counters.overflowed = counters.overflowed.wrapping_add(COUNT as u16);
            return;
        }
        for frame in frames {
            let _ = self.queue.push_back(frame);
        }
    }
}

/// A feature no probe can show. A lost probe (NaN) is not absurd.
fn is_absurd(reading: &Reading) -> bool {
    reading.features().iter().any(|feature| feature.abs() > ABSURD_UM)
}

fn result(sequence: u16, estimate: &Estimate, verdict: &Verdict) -> MonitorResult {
    let [first, second] = estimate.at_bound;
    let bits = [
        (verdict.suspicious, FLAG_SUSPICIOUS),
        (verdict.flagged, FLAG_FLAGGED),
        (first, FLAG_AT_BOUND_1),
        (second, FLAG_AT_BOUND_2),
    ];
    MonitorResult {
        sequence,
        flags: bits.iter().fold(0, |flags, &(set, bit)| if set { flags | bit } else { flags }),
        suspect: verdict.suspect,
        streak: verdict.streak,
        unbalance_g_mm: estimate.unbalance_g_mm,
        static_g_mm: estimate.static_g_mm,
        dynamic_g_mm: estimate.dynamic_g_mm,
        e_um: estimate.residual.e_um,
        ratio: estimate.residual.ratio,
    }
}

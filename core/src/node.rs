//! Frames in, frames out: all that a board calls. Nothing here does I/O, and time is an argument (µs since the start).
//!
//! # Life of a node
//! 1. [`Node::new`], without a model. Where a node is to lie in static memory, hand [`Node::new`] to the place itself
//!    (`StaticCell::init_with(|| Node::new(config))`), so that it is never on the stack as well.
//! 2. What was stored: `Node::restore_counter` (with the feature `command`), [`Node::restore_thresholds`], then [`Node::load`] with the model's bytes
//!    or with the reason why there are none, then [`Node::restore`] with the memory. Each of them may be missing: the node
//!    then says so, and can be reached for a deployment.
//! 3. Again and again: [`Node::receive`] with every frame, [`Node::poll`] at [`Node::poll_at`] or earlier,
//!    [`Node::to_save`] and [`Node::saved`] until nothing is to be saved, [`Node::transmit`] until nothing is to be sent.
//!
//! What is to be stored comes as [`Save`]: the counter of a command together with what the command brings, or the memory.
//! They may be stored in different places; within one [`Save`], all or nothing. A model on trial is not stored: when
//! `Node::is_trial_over` says so, the board starts anew as after a loss of power, and the node begins this life with the model
//! before. A board sends readings under its node's number only while [`Node::may_send`].

#[cfg(all(test, feature = "command"))]
mod command_tests;
#[cfg(feature = "command")]
mod commands;
#[cfg(all(test, feature = "command"))]
mod common_fault_tests;
mod config;
#[cfg(test)]
mod conflict_tests;
#[cfg(test)]
mod fault_tests;
#[cfg(feature = "mac")]
mod mac;
#[cfg(all(test, feature = "mac"))]
mod mac_tests;
#[cfg(not(feature = "command"))]
mod no_command;
#[cfg(not(feature = "mac"))]
mod no_mac;
mod ownership;
#[cfg(all(test, feature = "command"))]
mod parts_tests;
#[cfg(test)]
mod raw_tests;
mod save;
#[cfg(test)]
mod simulation;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod transmit;
#[cfg(all(test, feature = "command"))]
mod trial_tests;

use heapless::Deque;

use crate::can::{
    Assembler, BROADCAST_NODE, COUNTER_PAIRS, Counters, Frame, MAX_NODE, MAX_RESULT_FRAMES, Message,
    NumberedReading, TYPE_OFFER, TYPE_PART, TYPE_TO_NODE, result_frames,
};
#[cfg(feature = "command")]
use crate::command::{CODE_BYTES, HEAD_BYTES, MAX_REQUEST_BYTES, TRIAL_BYTES};
use crate::detector::ResidualVerdict;
use crate::memory::Memory;
use crate::model::Model;
use crate::monitor::{Monitor, Taken};
use crate::numerics::{InPlace, Numerics};
pub use crate::stages::MAX_PLAUSIBLE_UM;
use crate::state::{NodeState, Reason, Status};
use crate::thresholds::{ThresholdError, Thresholds};
use crate::track::Estimate;
#[cfg(feature = "command")]
use commands::CommandHandler;
pub use config::{NodeConfig, NodeError};
#[cfg(feature = "mac")]
use mac::Mac;
#[cfg(not(feature = "command"))]
use no_command::CommandHandler;
use ownership::{Due, Ownership};
pub use save::Save;
use save::SaveScheduler;
use transmit::result_of;

/// Frames waiting to be sent, at most.
pub const QUEUE_FRAMES: usize = 32;

pub const HEARTBEAT_FRAMES: usize = COUNTER_PAIRS + 3;

/// A monitor for machines of up to `PROBES` probes and `PLANES` planes, modelled by `SHAPES` basis shapes: what it knows of
/// the machine, and its place on the bus. `C`: what it calculates with.
#[derive(Debug, Clone)]
pub struct Node<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C = InPlace> {
    config: NodeConfig,
    monitor: Monitor<SHAPES, PROBES, PLANES, C>,
    assembler: Assembler,
    ownership: Ownership,
    save_scheduler: SaveScheduler,
    handler: CommandHandler,
    #[cfg(feature = "mac")]
    mac: Mac,
    next_heartbeat_us: u64,
    announced: Status,
    /// Whether the evidence was too old when that was last looked at.
    outdated: bool,
    queue: Deque<Frame, QUEUE_FRAMES>,
}

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    /// A node without a model.
    ///
    /// Errors: [`NodeError::Node`], [`NodeError::Thresholds`].
    #[inline] // made where it stays: a second node would not fit on the stack
    pub fn new(config: NodeConfig) -> Result<Self, NodeError> {
        const {
            #[cfg(feature = "command")]
            assert!(
                HEAD_BYTES + TRIAL_BYTES + Model::<SHAPES, PROBES, PLANES>::max_size_bytes() + CODE_BYTES
                    <= MAX_REQUEST_BYTES
            );
            assert!(
                SHAPES < 256 && PROBES <= crate::reading::MAX_PROBES && PLANES <= crate::model::MAX_PLANES
            );
        }
        if config.node > MAX_NODE {
            return Err(NodeError::Node);
        }
        config.thresholds.check().map_err(NodeError::Thresholds)?;
        Ok(Self {
            config,
            monitor: Monitor::with_checked(config.track, config.thresholds),
            assembler: Assembler::new(),
            ownership: Ownership::new(config.listen_us, config.heartbeat_period_us, config.seed),
            save_scheduler: SaveScheduler::default(),
            handler: CommandHandler::new(),
            #[cfg(feature = "mac")]
            mac: Mac::new(),
            next_heartbeat_us: 0,
            announced: Status::default(),
            outdated: false,
            queue: Deque::new(),
        })
    }

    /// Takes up the thresholds stored last, after a restart.
    ///
    /// Errors: [`ThresholdError`], and those of the settings stay.
    pub fn restore_thresholds(&mut self, bytes: &[u8]) -> Result<(), ThresholdError> {
        self.monitor.set_thresholds(Thresholds::decode(bytes)?)
    }

    /// Takes up the stored model, or why there is none; a model that cannot be used is a reason too, which is returned.
    /// Without a model the node says [`NodeState::NoModel`] and the reason.
    pub fn load(&mut self, stored: Result<&[u8], Reason>) -> Result<(), Reason> {
        self.monitor.load(stored)
    }

    /// Takes up the memory stored last, after [`Node::load`]; `false` if the bytes are damaged or belong to another model.
    pub fn restore(&mut self, memory: &[u8]) -> bool {
        Memory::decode(memory).is_some_and(|memory| self.monitor.restore(&memory))
    }

    /// Takes any frame of the bus but the node's own; those of other nodes are ignored. The frame that completes a
    /// reading has it evaluated at once and its result queued.
    #[inline(never)]
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
            // A MAC tells the node's frames from others': the node need not fall silent when another sender uses its number.
            if !self.is_authenticated() && self.ownership.heard_other(time_us) {
                // What waits here would meet the other one's frames on the wire.
                self.queue.clear();
            }
        } else {
            match frame.message_type() {
                TYPE_TO_NODE => self.transfer(time_us, frame.bytes()),
                TYPE_OFFER => self.offered(frame.bytes()),
                TYPE_PART => self.part(time_us, frame.bytes()),
                _ if self.is_authenticated() => self.take_authenticated(time_us, frame),
                _ => self.take_up(time_us, frame),
            }
        }
        self.save_scheduler.poll(time_us);
        self.announce(time_us);
    }

    fn take_up(&mut self, time_us: u64, frame: &Frame) {
        if let Some(reading) = self.assembler.receive(self.config.reading_timeout_us, time_us, frame) {
            self.evaluate(time_us, &reading);
        }
    }

    /// Time-outs, transfers, age of the evidence and heartbeat; to be called from the start on, at [`Node::poll_at`] or
    /// earlier.
    #[inline(never)]
    pub fn poll(&mut self, time_us: u64) {
        self.assembler.poll(self.config.reading_timeout_us, time_us);
        let due = self.ownership.poll(time_us);
        self.save_scheduler.poll(time_us);
        if due == Due::State {
            self.tell_state(time_us);
        }
        if self.may_send() {
            self.poll_transfer(time_us);
            if due == Due::MaySend || time_us >= self.next_heartbeat_us {
                self.next_heartbeat_us = time_us.saturating_add(self.config.heartbeat_period_us);
                self.heartbeat(time_us);
            }
        }
        self.announce(time_us);
    }

    /// When [`Node::poll`] has something to do next, µs; it may lie in the past.
    pub fn poll_at(&self) -> u64 {
        let waits = !self.queue.is_full();
        let mut earliest_us = if self.may_send() {
            self.next_heartbeat_us.min(self.handler.poll_at().filter(|_| waits).unwrap_or(u64::MAX))
        } else {
            u64::MAX
        };
        for at_us in [
            self.assembler.poll_at(self.config.reading_timeout_us),
            self.ownership.poll_at(),
            self.save_scheduler.poll_at(),
            self.handler.trial_until_us(),
            self.outdated_at(),
        ] {
            earliest_us = earliest_us.min(at_us.unwrap_or(u64::MAX));
        }
        earliest_us
    }

    /// The memory of a model on trial is not stored: that of the model before would be lost.
    fn memory_to_save(&self) -> Option<Save<'_>> {
        let is_on_trial = self.handler.trial_until_us().is_some();
        let is_wanted = self.save_scheduler.is_wanted() && self.model().is_some() && !is_on_trial;
        is_wanted.then(|| Save::Memory(self.monitor.memory().encode()))
    }

    fn memory_saved(&mut self, time_us: u64, stored: bool) {
        self.save_scheduler.saved(time_us, stored);
        if !stored {
            self.count(|c| &mut c.unsaved);
        }
    }

    /// The next frame to send.
    pub fn transmit(&mut self) -> Option<Frame> {
        self.queue.pop_front()
    }

    /// The node's number is its own, as far as it knows: readings may be sent under it.
    pub fn may_send(&self) -> bool {
        self.ownership.silence().is_none()
    }

    /// What became of the readings.
    pub fn counters(&self) -> Counters {
        *self.assembler.counters()
    }

    pub fn estimate(&self) -> Option<&Estimate> {
        self.monitor.estimate()
    }

    /// The last verdict on the residual; [`Node::status`] tells whether it still stands.
    pub fn verdict(&self) -> Option<&ResidualVerdict> {
        self.monitor.verdict()
    }

    pub fn model(&self) -> Option<&Model<SHAPES, PROBES, PLANES>> {
        self.monitor.model()
    }

    /// What the node judges by.
    pub fn thresholds(&self) -> &Thresholds {
        self.monitor.thresholds()
    }

    /// What the node says of itself.
    pub fn status(&self, time_us: u64) -> Status {
        let status = self.monitor.status(time_us);
        // Beside these the state says all, and beside a flag that is up so does the flag.
        let says_little = matches!(status.reason, Reason::None | Reason::NoReading | Reason::Learning)
            || status.state == NodeState::Flagged && self.monitor.is_suspicious(time_us);
        let is_unsaved = self.save_scheduler.is_failing() || self.is_nonce_unsaved();
        let reason = if is_unsaved && says_little { Reason::Storage } else { status.reason };
        let (state, reason) = self.ownership.silence().unwrap_or((status.state, reason));
        Status { state, reason, ..status }
    }

    /// Changes to a better model. Tracking goes on from the unbalance last found (see [`Node::restart`]); the
    /// residuals begin a new level and a new reference, for the old ones belong to the old model, and a latched flag is
    /// lowered.
    ///
    /// Errors: [`NodeError::Model`], and the old model stays.
    pub fn replace_model(
        &mut self,
        time_us: u64,
        model: Model<SHAPES, PROBES, PLANES>,
    ) -> Result<(), NodeError> {
        self.monitor.set_model(model)?;
        self.save_scheduler.changed_much(time_us);
        self.save_scheduler.poll(time_us);
        Ok(())
    }

    /// Begins a new record: the model's initial unbalance, no residual level and no reference, any sequence number next.
    /// Counters go on, and a latched flag stays up.
    pub fn restart(&mut self, time_us: u64) {
        self.monitor.restart();
        self.assembler.restart();
        self.save_scheduler.changed_much(time_us);
        self.save_scheduler.poll(time_us);
    }

    /// Not inlined: its stack is not that of a command as well.
    #[inline(never)]
    fn evaluate(&mut self, time_us: u64, numbered: &NumberedReading) {
        if self.ownership.silence().is_some() {
            return self.count(|c| &mut c.skipped);
        }
        match self.monitor.take(time_us, &numbered.reading, numbered.keyphasor) {
            Taken::Unmodelled => self.count(|c| &mut c.unmodelled),
            Taken::Rejected => self.count(|c| &mut c.rejected),
            Taken::Skipped => self.count(|c| &mut c.skipped),
            Taken::Unsolved => self.count(|c| &mut c.unsolved),
            Taken::Estimated(judgement) => {
                self.count(|c| &mut c.readings);
                if judgement.why_missing != Reason::None {
                    self.count(|c| &mut c.partial);
                }
                if judgement.is_news {
                    self.save_scheduler.changed_much(time_us);
                } else {
                    self.save_scheduler.changed(time_us, self.config.memory_period_us);
                }
                if let Some(estimate) = self.monitor.estimate() {
                    let result = result_of(numbered.sequence, estimate, &judgement);
                    self.tell(&result_frames(self.config.node, &result), MAX_RESULT_FRAMES);
                }
            }
        }
    }

    fn count(&mut self, which: impl FnOnce(&mut Counters) -> &mut u32) {
        let counter = which(self.assembler.counters_mut());
        *counter = counter.wrapping_add(1);
    }

    /// When evidence that still counts will be too old.
    fn outdated_at(&self) -> Option<u64> {
        self.monitor.outdated_at().filter(|_| !self.outdated)
    }
}

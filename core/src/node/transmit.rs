//! The frames a node sends of itself: state, heartbeat, version; and the queue of all it sends.

use heapless::Vec;

use super::{HEARTBEAT_FRAMES, Node, QUEUE_FRAMES};
use crate::can::{
    FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame, Message, MonitorResult, OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION,
    flag_at_bound,
};
use crate::model::MODEL_SCHEMA;
use crate::monitor::Judgement;
use crate::numerics::Numerics;
use crate::state::Status;
use crate::track::Estimate;

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    /// Tells a change of state at once. In a conflict the state is told at other times.
    pub(super) fn announce(&mut self, time_us: u64) {
        self.outdated = self.monitor.is_outdated(time_us);
        let status = self.status(time_us);
        let known = Status { age_s: status.age_s, ..self.announced };
        if self.may_send() && status != known && !self.queue.is_full() && self.tell_state(time_us) {
            self.count(|c| &mut c.changes);
        }
    }

    /// Whether the queue had room for it.
    pub(super) fn tell_state(&mut self, time_us: u64) -> bool {
        let status = self.status(time_us);
        let told = self.tell(&[Message::State(status).encode(self.config.node)], 1);
        if told {
            self.announced = status;
        }
        told
    }

    pub(super) fn heartbeat(&mut self, time_us: u64) {
        let (node, counters) = (self.config.node, self.counters());
        let status = self.status(time_us);
        let Status { state, reason, missing_mask, .. } = status;
        let readings = counters.readings;
        let heartbeat =
            Message::Heartbeat { version: PROTOCOL_VERSION, state, reason, missing_mask, readings };
        let (probes, planes) =
            self.model().map_or((0, 0), |model| (model.probes.len() as u8, model.planes.len() as u8));
        let on_trial = self.handler.trial_until_us().is_some();
        let model = Message::Model { checksum: self.monitor.checksum(), probes, planes, on_trial };
        let mut frames: Vec<Frame, HEARTBEAT_FRAMES> = Vec::new();
        let mut add = |message: Message| {
            // Cannot be full: the capacity is that of a whole heartbeat.
            let _ = frames.push(message.encode(node));
        };
        add(heartbeat);
        add(Message::State(status));
        for (pair, values) in (0..).zip(counters.pairs()) {
            add(Message::Counters { pair, values });
        }
        add(model);
        if self.tell(&frames, HEARTBEAT_FRAMES) {
            self.announced = status;
        }
    }

    pub(super) fn tell_version(&mut self) {
        let version = Message::Version {
            protocol: PROTOCOL_VERSION,
            oldest: OLDEST_PROTOCOL_VERSION,
            model_schema: MODEL_SCHEMA as u8,
            shapes: SHAPES as u8,
            probes: PROBES as u8,
            planes: PLANES as u8,
        };
        if self.may_send() {
            self.queue_all(&[version.encode(self.config.node)], 1);
        }
    }

    /// Queues all frames or, where there is room for fewer than `most`, none: half a result is of no use. Whether they were
    /// queued.
    #[inline(never)] // once in flash
    pub(super) fn queue_all(&mut self, frames: &[Frame], most: usize) -> bool {
        if QUEUE_FRAMES.saturating_sub(self.queue.len()) < most {
            let counters = self.assembler.counters_mut();
            counters.overflowed = counters.overflowed.wrapping_add(most as u32);
            return false;
        }
        for frame in frames {
            let _ = self.queue.push_back(*frame);
        }
        true
    }
}

/// The estimate of a reading as a result, with its verdict or why it has none.
pub(super) fn result_of(sequence: u16, estimate: &Estimate, judgement: &Judgement) -> MonitorResult {
    let mut result = MonitorResult {
        sequence,
        flags: 0,
        suspect: None,
        redundancy: estimate.redundancy,
        streak: 0,
        used_mask: judgement.used_mask,
        reason: judgement.why_missing,
        planes: estimate.planes,
        unbalance_g_mm: estimate.unbalance_g_mm,
        static_g_mm: estimate.static_g_mm,
        dynamic_g_mm: estimate.dynamic_g_mm,
        e_um: estimate.residual.e_um,
        ratio: estimate.residual.ratio,
        floor_um: judgement.floor_um,
        level_um: 0.0,
    };
    for (plane, at_bound) in (0..).zip(estimate.at_bound) {
        result.flags |= if at_bound { flag_at_bound(plane) } else { 0 };
    }
    match &judgement.verdict {
        Err(reason) => result.reason = *reason,
        Ok(verdict) => {
            if verdict.is_suspicious() {
                result.flags |= FLAG_SUSPICIOUS | if verdict.flagged { FLAG_FLAGGED } else { 0 };
                result.reason = verdict.reason;
            }
            (result.suspect, result.streak, result.level_um) =
                (verdict.suspect, verdict.streak, verdict.level_um);
        }
    }
    result
}

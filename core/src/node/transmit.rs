//! The frames a node sends of itself: state, heartbeat, version; and the queue of all it sends.

use super::{HEARTBEAT_FRAMES, Node, QUEUE_FRAMES};
use crate::can::{Frame, Message, OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION};
use crate::model::MODEL_SCHEMA;
use crate::numerics::Numerics;
use crate::state::Status;

impl<const SHAPES: usize, const PROBES: usize, const PLANES: usize, C: Numerics<SHAPES, PROBES, PLANES>>
    Node<SHAPES, PROBES, PLANES, C>
{
    /// Tells a change of state at once. In a conflict the state is told at other times.
    pub(super) fn announce(&mut self, time_us: u64) {
        self.outdated = self.age_us(time_us).is_some_and(|age_us| age_us > self.age_limit_us());
        let status = self.status(time_us);
        let known = Status { age_s: status.age_s, ..self.announced };
        if self.may_send() && status != known && !self.queue.is_full() && self.tell_state(time_us) {
            self.count(|c| &mut c.changes);
        }
    }

    /// Whether the queue had room for it.
    pub(super) fn tell_state(&mut self, time_us: u64) -> bool {
        let status = self.status(time_us);
        let told = self.tell::<1>([Message::State(status).encode(self.config.node)]);
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
        let pairs = (0..).zip(counters.pairs()).map(|(pair, values)| Message::Counters { pair, values });
        let messages = [heartbeat, Message::State(status)].into_iter().chain(pairs).chain([model]);
        if self.tell::<HEARTBEAT_FRAMES>(messages.map(|message| message.encode(node))) {
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
            self.queue_all::<1>([version.encode(self.config.node)]);
        }
    }

    /// Queues all frames or, lacking room, none: half a result is of no use. Whether they were queued.
    pub(super) fn queue_all<const COUNT: usize>(&mut self, frames: impl IntoIterator<Item = Frame>) -> bool {
        if QUEUE_FRAMES.saturating_sub(self.queue.len()) < COUNT {
            let counters = self.assembler.counters_mut();
            counters.overflowed = counters.overflowed.wrapping_add(COUNT as u32);
            return false;
        }
        for frame in frames {
            let _ = self.queue.push_back(frame);
        }
        true
    }
}

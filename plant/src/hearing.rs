//! What is said on one bus, put together.

use std::collections::BTreeMap;

use rotor_edge_core::can::{Assembler, BROADCAST_NODE, Frame, Message, ResultAssembler};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::state::{NodeState, Reason};

use crate::item::{Body, Heartbeat, Item, Kind, ReadingItem, SCHEMA, Source, StateItem};
use crate::numbering::{Last, Numbering};
use rotor_edge::answers::monitor_result::ResultAnswer;

/// A clock that says less is wrong: 2024-01-01, µs.
const EARLIEST_US: i64 = 1_704_067_200_000_000;
/// A clock may be set back by so much without a word, µs.
const SET_BACK_US: i64 = 1_000_000;

/// Everything heard on one bus.
pub struct Hearing {
    plant: String,
    bus: String,
    nodes: BTreeMap<u8, MonitorStream>,
    latest_us: i64,
}

/// One monitor, and who sends it readings.
#[derive(Default)]
struct MonitorStream {
    readings: Assembler,
    results: ResultAssembler,
    numbering: Numbering,
    /// Of what the monitor does not number itself.
    states: Counted,
    heartbeats: Counted,
    state: Option<(NodeState, Reason)>,
}

/// Numbers that this program gives.
#[derive(Default)]
struct Counted(Option<Last>);

impl Counted {
    fn next(&mut self, time_us: i64) -> (u64, u16) {
        let (epoch, sequence) = match self.0 {
            None => (0, 0),
            Some(Last { epoch, sequence: u16::MAX, .. }) => (epoch + 1, 0),
            Some(Last { epoch, sequence, .. }) => (epoch, sequence + 1),
        };
        self.0 = Some(Last { epoch, sequence, time_us });
        (epoch, sequence)
    }
}

impl Hearing {
    /// Of a bus, behind what was kept of it before.
    pub fn new(plant: &str, bus: &str, kept: impl IntoIterator<Item = (u8, Kind, Last)>) -> Self {
        let mut nodes: BTreeMap<u8, MonitorStream> = BTreeMap::new();
        let mut latest_us = i64::MIN;
        let mut newest: BTreeMap<u8, Last> = BTreeMap::new();
        for (number, kind, last) in kept {
            latest_us = latest_us.max(last.time_us);
            let node = nodes.entry(number).or_default();
            match kind {
                Kind::State => node.states = Counted(Some(last)),
                Kind::Heartbeat => node.heartbeats = Counted(Some(last)),
                Kind::Reading | Kind::Result => {
                    let place = |l: &Last| (l.epoch, l.sequence);
                    let before = newest.get(&number).filter(|before| place(before) >= place(&last));
                    newest.insert(number, before.copied().unwrap_or(last));
                }
            }
        }
        for (number, last) in newest {
            nodes.entry(number).or_default().numbering = Numbering::behind(Some(last));
        }
        Self { plant: plant.into(), bus: bus.into(), nodes, latest_us }
    }

    /// Takes a frame. `elapsed_us` never goes back; `time_us` is what the clock on the wall says, and may.
    pub fn receive(&mut self, elapsed_us: u64, time_us: i64, frame: &Frame) -> Option<Item> {
        let (number, message) = Message::decode(frame).ok()?;
        if number == BROADCAST_NODE {
            return None;
        }
        let node = self.nodes.entry(number).or_default();
        let ((epoch, sequence), body) = node.take(elapsed_us, time_us, frame, &message)?;
        let is_clock_doubtful = time_us < EARLIEST_US || time_us < self.latest_us.saturating_sub(SET_BACK_US);
        self.latest_us = self.latest_us.max(time_us);
        let source = Source { plant: self.plant.clone(), bus: self.bus.clone(), node: number };
        Some(Item { schema: SCHEMA, source, epoch, sequence, time_us, is_clock_doubtful, body })
    }
}

impl MonitorStream {
    fn take(
        &mut self,
        elapsed_us: u64,
        time_us: i64,
        frame: &Frame,
        message: &Message,
    ) -> Option<((u64, u16), Body)> {
        match *message {
            Message::Heartbeat { version, state, reason, readings, .. } => {
                let body = Body::Heartbeat(Heartbeat::new(version, state, reason, readings));
                return Some((self.heartbeats.next(time_us), body));
            }
            Message::State(status) => {
                let is_news = self.state.replace((status.state, status.reason)) != self.state;
                return is_news.then(|| (self.states.next(time_us), Body::State(StateItem::from(&status))));
            }
            _ => {}
        }
        let timeout_us = NodeConfig::READING_TIMEOUT_US;
        if let Some(whole) = self.readings.receive(timeout_us, elapsed_us, frame) {
            let epoch = self.numbering.reading(whole.sequence, time_us);
            return Some(((epoch, whole.sequence), Body::Reading(ReadingItem::from(&whole))));
        }
        let result = self.results.receive(frame)?;
        let epoch = self.numbering.result(result.sequence, time_us);
        Some(((epoch, result.sequence), Body::Result(ResultAnswer::from(&result))))
    }
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::can::{NumberedReading, reading_frames};
    use rotor_edge_core::reading::{ProbeVector, Reading as Measured};
    use rotor_edge_core::state::Status;

    use super::*;

    const NOW_US: i64 = 1_800_000_000_000_000;

    fn reading(hearing: &mut Hearing, sequence: u16, time_us: i64) -> Vec<Item> {
        let vector = ProbeVector { cos_um: 1.0, sin_um: 2.0 };
        let numbered = NumberedReading::new(sequence, Measured::new(9_000.0, &[vector; 4]).unwrap());
        let frames = reading_frames(5, &numbered);
        frames.iter().filter_map(|frame| hearing.receive(1_000, time_us, frame)).collect()
    }

    #[test]
    fn repeated_reading_is_one_and_restarted_gateway_continues() {
        let mut hearing = Hearing::new("north", "can0", []);
        let first = reading(&mut hearing, 65_535, NOW_US);
        assert_eq!((first.len(), first[0].epoch, first[0].source.node), (1, 0, 5));
        assert_eq!(reading(&mut hearing, 65_535, NOW_US), []);
        assert_eq!(reading(&mut hearing, 0, NOW_US)[0].epoch, 1);
        let kept = Last { epoch: 1, sequence: 0, time_us: NOW_US };
        let mut again = Hearing::new("north", "can0", [(5, Kind::Reading, kept)]);
        assert_eq!(reading(&mut again, 1, NOW_US)[0].epoch, 1);
    }

    #[test]
    fn numbering_continues_behind_newest_reading_or_result() {
        let last = |epoch, sequence| Last { epoch, sequence, time_us: NOW_US };
        for kinds in [[Kind::Reading, Kind::Result], [Kind::Result, Kind::Reading]] {
            let kept = [(5, kinds[0], last(2, 7)), (5, kinds[1], last(2, 6))];
            let mut hearing = Hearing::new("north", "can0", kept);
            assert_eq!(reading(&mut hearing, 8, NOW_US)[0].epoch, 2);
            assert_eq!(reading(&mut hearing, 7, NOW_US), [], "late");
            // one of them ended a whole round of numbers before the other
            let kept = [(5, kinds[0], last(2, 7)), (5, kinds[1], last(1, 6))];
            let mut hearing = Hearing::new("north", "can0", kept);
            assert_eq!(reading(&mut hearing, 8, NOW_US)[0].epoch, 2);
        }
    }

    #[test]
    fn state_is_told_on_change_and_clock_set_back_is_marked() {
        let mut hearing = Hearing::new("north", "can0", []);
        let tell = |hearing: &mut Hearing, state, time_us| {
            let frame = Message::State(Status { state, ..Status::default() }).encode(5);
            hearing.receive(0, time_us, &frame)
        };
        let first = tell(&mut hearing, NodeState::Tracking, NOW_US).unwrap();
        assert!(!first.is_clock_doubtful);
        assert_eq!(tell(&mut hearing, NodeState::Tracking, NOW_US), None);
        let changed = tell(&mut hearing, NodeState::Blind, NOW_US - 3_600_000_000).unwrap();
        assert_eq!((changed.epoch, changed.sequence, changed.is_clock_doubtful), (0, 1, true));
        let old = tell(&mut Hearing::new("north", "can0", []), NodeState::Blind, 0).unwrap();
        assert!(old.is_clock_doubtful, "1970");
    }
}

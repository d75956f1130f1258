//! Message authentication codes (MACs) of the readings that are sent, and a check of those that are heard.

use std::collections::VecDeque;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::Result;
use rotor_edge_core::can::Frame;
use rotor_edge_core::can::mac::{Direction, Gate, MAC_FRAMES, MacError, mac_frames};
use rotor_edge_core::command::Key;
use rotor_edge_core::node::NodeConfig;
use serde::Serialize;

use super::CanBus;

/// Longest wait for a frame.
const PATIENCE: Duration = Duration::from_millis(20);

/// This machine's clock, µs since 1970.
pub fn present_us() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_micros() as u64)
}

/// Makes the MACs of the readings for one monitor.
#[derive(Debug, Clone)]
pub struct Authenticator {
    key: Key,
    node: u8,
    last: u64,
}

impl Authenticator {
    pub fn new(key: Key, node: u8) -> Self {
        Self { key, node, last: 0 }
    }

    /// What is to follow these frames of a reading: fresher than all before, and by this machine's clock.
    pub fn mac(&mut self, reading: &[Frame]) -> [Frame; MAC_FRAMES] {
        self.mac_at(present_us(), reading)
    }

    /// The same by a clock that shows `time_us` since 1970.
    pub fn mac_at(&mut self, time_us: u64, reading: &[Frame]) -> [Frame; MAC_FRAMES] {
        self.last = time_us.max(self.last + 1);
        mac_frames(&self.key, Direction::ToNode, self.node, self.last, reading)
    }
}

/// Groups of frames that were not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct RefusalCounts {
    /// Without a MAC, or with frames missing.
    #[serde(rename = "unsealed")]
    pub without_mac: u64,
    /// With a code that is not one by the key.
    pub forged: u64,
    /// With the right code, and no fresher than what was heard before.
    pub replayed: u64,
}

impl RefusalCounts {
    pub fn any(&self) -> bool {
        *self != Self::default()
    }

    fn count(&mut self, error: MacError) {
        match error {
            MacError::Forged => self.forged += 1,
            MacError::Replayed => self.replayed += 1,
            _ => self.without_mac += 1,
        }
    }
}

impl std::fmt::Display for RefusalCounts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { without_mac, forged, replayed } = self;
        write!(
            f,
            "refused: {forged} with a wrong MAC, {replayed} replayed, {without_mac} without a complete MAC"
        )
    }
}

/// Lets through what one monitor and those who send readings to it say under its key.
#[derive(Debug, Clone)]
pub struct Checker {
    key: Key,
    node: u8,
    gates: [Gate; 2],
    refused: RefusalCounts,
}

impl Checker {
    /// Believes any nonce at first.
    pub fn new(key: Key, node: u8) -> Self {
        let gates = [Direction::ToNode, Direction::ToHost].map(|direction| Gate::new(direction, 0));
        Self { key, node, gates, refused: RefusalCounts::default() }
    }

    pub fn node(&self) -> u8 {
        self.node
    }

    /// What was not believed so far.
    pub fn refused(&self) -> RefusalCounts {
        self.refused
    }

    /// Takes any frame: those that may be believed now. Frames of other monitors, and those that no MAC covers, are.
    pub fn take(&mut self, time_us: u64, frame: &Frame) -> Vec<Frame> {
        let is_covered =
            [Direction::ToNode, Direction::ToHost].iter().any(|d| d.covers(frame.message_type()));
        if frame.node() != self.node || !(is_covered || frame.is_mac()) {
            return vec![*frame];
        }
        let timeout_us = NodeConfig::READING_TIMEOUT_US;
        let mut believed = Vec::new();
        for gate in &mut self.gates {
            match gate.receive(&self.key, timeout_us, time_us, frame) {
                Ok(group) => believed.extend(group.into_iter().flatten()),
                Err(error) => self.refused.count(error),
            }
        }
        believed
    }
}

/// A bus on which one monitor's words count only under its MAC, if it sends MACs: it is listened to for a heartbeat before
/// anything of it counts. A monitor without MACs is believed as it is.
pub struct AuthenticatedBus<'a> {
    bus: &'a mut dyn CanBus,
    checker: Checker,
    is_authenticated: bool,
    believed: VecDeque<Frame>,
    since: Duration,
}

impl<'a> AuthenticatedBus<'a> {
    /// With the monitor's key; listens for a MAC for this time.
    ///
    /// # Errors
    /// If the bus fails.
    pub fn listen(bus: &'a mut dyn CanBus, checker: Checker, time: Duration) -> Result<Self> {
        let since = bus.now();
        let mut own = Self { bus, checker, is_authenticated: false, believed: VecDeque::new(), since };
        while !own.is_authenticated && own.now() - own.since < time {
            own.receive(PATIENCE)?;
        }
        Ok(own)
    }

    /// What was not believed of a monitor that sends MACs.
    pub fn refused(&self) -> RefusalCounts {
        if self.is_authenticated { self.checker.refused() } else { RefusalCounts::default() }
    }
}

impl CanBus for AuthenticatedBus<'_> {
    fn send(&mut self, frame: &Frame) -> Result<()> {
        self.bus.send(frame)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Frame>> {
        if let Some(frame) = self.believed.pop_front() {
            return Ok(Some(frame));
        }
        let Some(frame) = self.bus.receive(timeout)? else { return Ok(None) };
        let time_us = (self.now() - self.since).as_micros() as u64;
        let believed = self.checker.take(time_us, &frame);
        if self.is_authenticated {
            self.believed.extend(believed);
            return Ok(self.believed.pop_front());
        }
        // what this MAC covers has been passed on already
        self.is_authenticated = frame.is_mac() && !believed.is_empty();
        Ok(Some(frame))
    }

    fn description(&self) -> String {
        self.bus.description()
    }

    fn passed_over(&self) -> u64 {
        self.bus.passed_over()
    }

    fn now(&self) -> Duration {
        self.bus.now()
    }
}

#[cfg(test)]
mod tests {
    use rotor_edge_core::can::Message;
    use rotor_edge_core::state::{NodeState, Status};

    use super::*;

    const KEY: Key = Key([7; rotor_edge_core::command::KEY_BYTES]);
    const NODE: u8 = 3;

    /// Frames as they come, then silence.
    struct Script(VecDeque<Frame>);

    impl CanBus for Script {
        fn send(&mut self, _: &Frame) -> Result<()> {
            Ok(())
        }

        fn receive(&mut self, _: Duration) -> Result<Option<Frame>> {
            Ok(self.0.pop_front())
        }

        fn description(&self) -> String {
            "a script".into()
        }
    }

    fn state(state: NodeState) -> Frame {
        Message::State(Status { state, ..Status::default() }).encode(NODE)
    }

    /// A state with its MAC.
    fn authenticated(what: NodeState, nonce: u64) -> Vec<Frame> {
        let frame = state(what);
        let mac = mac_frames(&KEY, Direction::ToHost, NODE, nonce, &[frame]);
        std::iter::once(frame).chain(mac).collect()
    }

    /// States that were passed on, and what was refused.
    fn heard(frames: Vec<Frame>, time: Duration) -> (Vec<NodeState>, RefusalCounts) {
        let count = frames.len();
        let mut script = Script(frames.into());
        let mut bus = AuthenticatedBus::listen(&mut script, Checker::new(KEY, NODE), time).unwrap();
        let mut states = Vec::new();
        for _ in 0..2 * count {
            let Some(frame) = bus.receive(Duration::ZERO).unwrap() else { continue };
            if let Ok((_, Message::State(status))) = Message::decode(&frame) {
                states.push(status.state);
            }
        }
        (states, bus.refused())
    }

    #[test]
    fn authenticated_monitor_is_believed_only_with_its_mac() {
        let forged = state(NodeState::Flagged);
        let genuine = [authenticated(NodeState::Learning, 1), authenticated(NodeState::Tracking, 2)];
        let with_forgeries = [&[forged], &genuine[0][..], &[forged], &genuine[1], &genuine[0]].concat();
        let (states, refused) = heard(with_forgeries, Duration::from_secs(1));
        assert_eq!(
            states,
            [NodeState::Tracking],
            "frames before the first MAC are not believed, and later only frames with one"
        );
        assert!(refused.replayed == 1 && refused.any(), "{refused:?}");
        assert_eq!(heard(vec![forged], Duration::ZERO), (vec![NodeState::Flagged], RefusalCounts::default()));
    }
}

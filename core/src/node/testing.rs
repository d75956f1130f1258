//! What the node's tests share: a machine, its readings, and a host.

use std::vec::Vec;

use super::*;
use crate::can::isotp::{IsoTp, Progress};
use crate::can::{Keyphasor, MonitorResult, ResultAssembler, TYPE_TO_HOST, frame_id, reading_frames};
use crate::command::{ANSWER_BYTES, Answer, Command, KEY_BYTES, Key, Outcome, write_request};
use crate::model::Pair;
use crate::model::tests::rigid_rotor;
use crate::reading::{ProbeVector, Reading, rad_s};
use crate::response::{SupportAmplitudes, response};
use crate::state::NodeState;
use crate::testing::{Random, normal};

pub type TestModel = Model<2, 4, 2>;
pub type TestNode = Node<2, 4, 2>;

pub const NODE: u8 = 4;
pub const KEY: Key = Key([9; KEY_BYTES]);
pub const SPEED_RPM: f32 = 9000.0;
/// 11.5 readings a second, as a board makes them.
pub const PERIOD_US: u64 = 87_000;
pub const SECOND_US: u64 = 1_000_000;
pub const DAY_US: u64 = 86_400 * SECOND_US;

/// Answers from the first reading on.
pub fn config() -> NodeConfig {
    NodeConfig { listen_us: 0, key: Some(KEY), ..NodeConfig::new(NODE) }
}

pub fn encoded<const SHAPES: usize, const PROBES: usize, const PLANES: usize>(
    model: &Model<SHAPES, PROBES, PLANES>,
) -> Vec<u8> {
    let mut bytes = std::vec![0; Model::<SHAPES, PROBES, PLANES>::max_size_bytes()];
    let length = model.encode(&mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

/// A node with that model.
pub fn node_with(model: &TestModel) -> TestNode {
    let mut node = Node::new(config()).unwrap();
    assert_eq!(node.load(Ok(&encoded(model))), Ok(()));
    node
}

pub fn node() -> TestNode {
    node_with(&rigid_rotor())
}

/// A machine whose first bearing has lost part of its stiffness along x. (Lost alike along x and y, it would mostly look
/// like a greater unbalance.)
pub fn worn(part: f32) -> TestModel {
    let mut model = rigid_rotor();
    model.supports[0].stiffness_n_m[0][0] *= 1.0 - part;
    model
}

/// What a machine shows at a speed for its initial unbalance times a factor.
pub fn shown(machine: &TestModel, speed_rpm: f32, factor: f32) -> Reading {
    let unbalance: Vec<Pair> =
        machine.initial_unbalance_g_mm.iter().map(|plane| plane.map(|part| factor * part)).collect();
    let at_speed = response(machine, rad_s(speed_rpm), &SupportAmplitudes::default()).unwrap();
    let vector = |probe: &crate::response::Linear<2>| ProbeVector::from_phasor(probe.phasor(&unbalance));
    let vectors: Vec<_> = at_speed.probes().iter().map(vector).collect();
    Reading::new(speed_rpm, &vectors).unwrap()
}

pub fn reading(factor: f32) -> Reading {
    shown(&rigid_rotor(), SPEED_RPM, factor)
}

/// The same reading with normally distributed noise on each feature.
pub fn noisy(reading: &Reading, sigma_um: f32, random: &mut Random) -> Reading {
    let mut part = |value: f32| value + sigma_um * normal(random);
    let vectors: Vec<_> = reading
        .probes()
        .iter()
        .map(|p| ProbeVector { cos_um: part(p.cos_um), sin_um: part(p.sin_um) })
        .collect();
    Reading::new(reading.speed_rpm, &vectors).unwrap().with_gaps_v(reading.gaps_v())
}

pub fn lacking(mut reading: Reading, mask: u8) -> Reading {
    reading.lose(mask);
    reading
}

pub fn send_numbered(node: &mut TestNode, time_us: u64, numbered: &NumberedReading) {
    for frame in reading_frames(NODE, numbered) {
        node.receive(time_us, &frame);
    }
}

/// Sends a reading with a hundredth of the noise of [`rigid_rotor`], since no two are the same.
pub fn send(node: &mut TestNode, time_us: u64, sequence: u16, reading: &Reading) {
    let mut random = Random::new(time_us ^ u64::from(sequence) << 40);
    send_exactly(node, time_us, sequence, &noisy(reading, 1e-3, &mut random));
}

pub fn send_exactly(node: &mut TestNode, time_us: u64, sequence: u16, reading: &Reading) {
    send_numbered(node, time_us, &NumberedReading::new(sequence, *reading));
}

pub fn without_keyphasor(sequence: u16) -> NumberedReading {
    let reading = Reading::new(f32::NAN, &[ProbeVector::LOST; 4]).unwrap();
    NumberedReading { keyphasor: Keyphasor::Missing, ..NumberedReading::new(sequence, reading) }
}

/// Everything the node sends now.
pub fn sent(node: &mut TestNode) -> Vec<Frame> {
    core::iter::from_fn(|| node.transmit()).collect()
}

pub fn results(node: &mut TestNode) -> Vec<MonitorResult> {
    let mut assembler = ResultAssembler::new();
    sent(node).iter().filter_map(|frame| assembler.receive(frame)).collect()
}

/// The states told among these frames.
pub fn states(frames: &[Frame]) -> Vec<Status> {
    let told = frames.iter().filter_map(|frame| match Message::decode(frame) {
        Ok((_, Message::State(status))) => Some(status),
        _ => None,
    });
    told.collect()
}

/// A node that has tracked for a minute, and the time.
pub fn tracking() -> (TestNode, Store, u64) {
    let (mut node, mut store) = (node(), Store::with(&rigid_rotor()));
    let time_us = run(&mut node, &mut store, 0, 62.0, |_| reading(1.0));
    assert_eq!(node.status(time_us).state, NodeState::Tracking);
    (node, store, time_us)
}

pub fn now(node: &TestNode, time_us: u64) -> (NodeState, Reason, u8) {
    let status = node.status(time_us);
    (status.state, status.reason, status.missing_mask)
}

/// Feeds readings of one kind for `seconds` from `time_us` on, polls in between, and gives the time after that. What is
/// to be stored goes to `store`.
pub fn run(
    node: &mut TestNode,
    store: &mut Store,
    time_us: u64,
    seconds: f64,
    reading: impl Fn(u64) -> Reading,
) -> u64 {
    let end_us = time_us + (seconds * 1e6) as u64;
    let mut now_us = time_us;
    while now_us < end_us {
        node.poll(now_us);
        send(node, now_us, (now_us / PERIOD_US) as u16, &reading(now_us));
        store.serve(node, now_us);
        sent(node);
        now_us += PERIOD_US;
    }
    now_us
}

/// What a board keeps.
#[derive(Debug, Clone, Default)]
pub struct Store {
    pub counter: u64,
    pub model: Option<Vec<u8>>,
    pub thresholds: Option<Vec<u8>>,
    pub memory: Option<Vec<u8>>,
    pub nonce: u64,
    pub savings: usize,
    pub fails: bool,
}

impl Store {
    pub fn with(model: &TestModel) -> Self {
        Self { model: Some(encoded(model)), ..Self::default() }
    }

    pub fn serve(&mut self, node: &mut TestNode, time_us: u64) {
        while let Some(save) = node.to_save() {
            if !self.fails {
                self.keep(&save);
            }
            node.saved(time_us, !self.fails);
        }
    }

    pub fn keep(&mut self, save: &Save<'_>) {
        self.savings += 1;
        match save {
            Save::Command { counter, model, thresholds } => {
                self.counter = *counter;
                if let Some(model) = model {
                    self.model = Some(model.to_vec());
                }
                if let Some(thresholds) = thresholds {
                    self.thresholds = Some(thresholds.to_vec());
                }
            }
            Save::Memory(memory) => self.memory = Some(memory.to_vec()),
            Save::Nonce(nonce) => self.nonce = *nonce,
        }
    }

    /// A node after a loss of power.
    pub fn start(&self) -> TestNode {
        let mut node = Node::new(config()).unwrap();
        node.restore_counter(self.counter);
        if let Some(thresholds) = &self.thresholds {
            assert_eq!(node.restore_thresholds(thresholds), Ok(()));
        }
        let _ = node.load(self.model.as_deref().ok_or(Reason::NothingStored));
        if let Some(memory) = &self.memory {
            node.restore(memory);
        }
        node
    }
}

pub fn request(command: Command, counter: u64, body: &[u8]) -> Vec<u8> {
    signed(KEY, command, counter, body)
}

pub fn signed(key: Key, command: Command, counter: u64, body: &[u8]) -> Vec<u8> {
    let mut request = std::vec![0; MAX_REQUEST_BYTES];
    let length = write_request(&mut request, &key, NODE, command, counter, body).unwrap();
    request.truncate(length);
    request
}

pub fn deploy(model: &TestModel, counter: u64) -> Vec<u8> {
    request(Command::Deploy, counter, &encoded(model))
}

/// Sends a request and lets the store keep what the node wants kept; `lost` decides which frame towards or from the node is
/// dropped. Gives the number of frames and the answer, if one came.
pub fn transfer(
    node: &mut TestNode,
    store: &mut Store,
    time_us: u64,
    request: &[u8],
    lost: impl Fn(usize) -> bool,
) -> (usize, Option<(Answer, bool)>) {
    let mut host = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
    host.send(time_us, request).unwrap();
    let (mut frames, mut answer) = (0, None);
    let mut arrives = || {
        frames += 1;
        !lost(frames - 1)
    };
    loop {
        let mut quiet = true;
        while let Some(payload) = host.poll(time_us) {
            quiet = false;
            if arrives() {
                let id = frame_id(TYPE_TO_NODE, NODE);
                node.receive(time_us, &Frame::standard(id, &payload).unwrap());
            }
        }
        store.serve(node, time_us);
        while let Some(frame) = node.transmit() {
            quiet = false;
            if frame.message_type() == TYPE_TO_HOST
                && arrives()
                && host.receive(time_us, frame.bytes()) == Progress::Complete
            {
                answer = Answer::decode(host.message(), request, &KEY);
            }
        }
        if quiet {
            return (frames, answer);
        }
    }
}

/// The confirmed answer to a request that arrives.
pub fn answer(node: &mut TestNode, store: &mut Store, time_us: u64, request: &[u8]) -> Answer {
    let (answer, confirmed) = transfer(node, store, time_us, request, |_| false).1.unwrap();
    assert!(confirmed || answer.outcome == Outcome::NoKey);
    answer
}

//! A node among everything that can happen to it.

use rotor_edge_core::can::isotp::IsoTp;
use rotor_edge_core::can::{
    BROADCAST_NODE, Frame, Message, NumberedReading, TYPE_TO_HOST, TYPE_TO_NODE, frame_id, reading_frames,
};
use rotor_edge_core::command::{ANSWER_BYTES, Command, MAX_REQUEST_BYTES, write_request};
use rotor_edge_core::node::{Node, NodeConfig, QUEUE_FRAMES, Save};
use rotor_edge_core::state::{NodeState, Reason};

use super::command::{KEY, NODE, any_command};
use super::model::{encoded, machine};
use super::{Bytes, with_crc32};

type SmallNode = Node<2, 4, 2>;

fn empty() -> SmallNode {
    let mut config = NodeConfig::new(NODE);
    config.key = Some(KEY);
    config.listen_us = 0;
    SmallNode::new(config).expect("these settings are in order")
}

/// What stands in the first byte of a step; the other bytes of the step follow.
#[derive(Clone, Copy)]
pub enum Step {
    AnyFrame,
    OwnFrame,
    Reading,
    Command,
    Poll,
    Saved,
    Query,
    Restore,
    Load,
    Thresholds,
    Restart,
    Replace,
}

const STEPS: [Step; 12] = [
    Step::AnyFrame,
    Step::OwnFrame,
    Step::Reading,
    Step::Command,
    Step::Poll,
    Step::Saved,
    Step::Query,
    Step::Restore,
    Step::Load,
    Step::Thresholds,
    Step::Restart,
    Step::Replace,
];

struct Run {
    node: SmallNode,
    time_us: u64,
    sequence: u16,
}

impl Run {
    /// What must hold whatever happened.
    fn look(&mut self) {
        let status = self.node.status(self.time_us);
        let limit_s = self.node.thresholds().age_limit_s;
        // f32 seconds of integral microseconds
        let is_fresh = status.age_s <= limit_s * 1.001;
        let says_well = matches!(status.state, NodeState::Tracking | NodeState::Learning);
        assert!(!says_well || is_fresh, "{status:?} with a limit of {limit_s} s");
        assert!(status.state != NodeState::NoModel || self.node.model().is_none());
        let mut number = 0;
        while let Some(frame) = self.node.transmit() {
            assert_eq!(frame.node(), NODE);
            assert!(frame.is_transfer() || Message::decode(&frame).is_ok(), "{frame:?}");
            number += 1;
        }
        assert!(number <= QUEUE_FRAMES);
    }

    fn receive(&mut self, frame: &Frame) {
        self.node.receive(self.time_us, frame);
        self.look();
    }

    fn reading(&mut self, bytes: &mut Bytes) {
        self.sequence = self.sequence.wrapping_add(u16::from(bytes.u8() % 4));
        for frame in reading_frames(NODE, &NumberedReading::new(self.sequence, bytes.reading())) {
            self.receive(&frame);
        }
    }

    /// A signed command, transferred without a fault.
    fn command(&mut self, bytes: &mut Bytes) {
        let command = any_command(bytes.u8());
        let counter = self.node.command_counter().saturating_add(bytes.u8().into());
        let own = match command {
            Command::Deploy | Command::DeployAnother => encoded(&machine()),
            Command::Trial => [&[5, 0, 0, 0][..], &encoded(&machine())].concat(),
            Command::SetThresholds => self.node.thresholds().encode().to_vec(),
            _ => Vec::new(),
        };
        let given = usize::from(bytes.u16()) % 600;
        let body = if given == 0 { own } else { bytes.slice(given).to_vec() };
        let mut request = [0; MAX_REQUEST_BYTES];
        let length = write_request(&mut request, &KEY, NODE, command, counter, &body).expect("there is room");
        let mut host = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
        host.send(self.time_us, &request[..length]).expect("it was idle");
        while host.is_sending() {
            while let Some(payload) = host.poll(self.time_us) {
                let frame = Frame::full(TYPE_TO_NODE, NODE, payload);
                self.node.receive(self.time_us, &frame);
            }
            self.node.poll(self.time_us);
            while let Some(frame) = self.node.transmit() {
                if frame.message_type() == TYPE_TO_HOST {
                    host.receive(self.time_us, frame.bytes());
                }
            }
            self.time_us += 50_000;
            let _ = host.check_time(self.time_us);
        }
    }

    /// Stored or not; what was stored is what a node takes up again.
    fn saved(&mut self, stored: bool) {
        match self.node.to_save() {
            Some(Save::Memory(memory)) => {
                let mut again = empty();
                let model = self.node.model().map(encoded).expect("only what was learned is remembered");
                assert_eq!(again.load(Ok(&model)), Ok(()));
                assert!(again.restore(&memory));
            }
            Some(Save::Command { model, thresholds, .. }) => {
                assert!(model.is_none_or(|model| empty().load(Ok(model)).is_ok()));
                assert!(thresholds.is_none_or(|bytes| empty().restore_thresholds(&bytes).is_ok()));
            }
            _ => {}
        }
        self.node.saved(self.time_us, stored);
    }

    fn step(&mut self, bytes: &mut Bytes) {
        let first = bytes.u8();
        self.time_us += u64::from(bytes.u8()) << (first >> 4);
        match STEPS[usize::from(first & 0xf) % STEPS.len()] {
            Step::AnyFrame => self.receive(&bytes.frame()),
            Step::OwnFrame => {
                let message_type = bytes.u8();
                let length = usize::from(bytes.u8() % 9);
                let id = frame_id(message_type, NODE);
                self.receive(&Frame::standard(id, bytes.slice(length)).expect("eleven bits, eight bytes"));
            }
            Step::Reading => self.reading(bytes),
            Step::Command => self.command(bytes),
            Step::Poll => self.node.poll(self.time_us),
            Step::Saved => self.saved(bytes.u8() & 1 == 0),
            Step::Query => self.receive(&Message::VersionQuery.encode(BROADCAST_NODE)),
            Step::Restore => {
                let length = usize::from(bytes.u8());
                self.node.restore(&with_crc32(bytes.slice(length).to_vec()));
            }
            Step::Load => {
                let why = Reason::from_code(bytes.u8());
                let model = encoded(&machine());
                let _ = self.node.load(if why == Reason::None { Ok(&model) } else { Err(why) });
            }
            Step::Thresholds => {
                let length = usize::from(bytes.u8());
                let _ = self.node.restore_thresholds(bytes.slice(length));
            }
            Step::Restart => self.node.restart(self.time_us),
            Step::Replace => {
                let _ = self.node.replace_model(self.time_us, machine());
            }
        }
        self.look();
        self.node.poll(self.time_us);
        self.look();
    }
}

/// Steps of any kind at any time, on a node that starts with its model.
pub fn node(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let mut run = Run { node: empty(), time_us: 0, sequence: 0 };
    assert_eq!(run.node.load(Ok(&encoded(&machine()))), Ok(()));
    while !bytes.is_empty() {
        run.step(&mut bytes);
    }
}

/// A stored memory, its checksum put right, for a node that then goes on.
pub fn memory(bytes: &[u8]) {
    let model = encoded(&machine());
    let mut run = Run { node: empty(), time_us: 0, sequence: 0 };
    assert_eq!(run.node.load(Ok(&model)), Ok(()));
    // damaged, but for one chance in four milliards
    run.node.restore(bytes);
    run.node.restore(&with_crc32(bytes.to_vec()));
    run.look();
    for _ in 0..3 {
        run.time_us += 1_000_000;
        run.reading(&mut Bytes(&[1, 0x10, 0x27, 3, 0, 8, 0, 2, 0, 4, 0, 250, 0, 6, 0, 9, 0, 1, 0, 7, 0]));
        run.saved(true);
    }
}

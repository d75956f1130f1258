//! The node on any CAN driver that speaks `embedded_can`: all that a board has to do.
//!
//! `cargo run -p rotor-edge-core --example on_a_can_driver`. The driver here is a pair of queues, with a sender of readings
//! at their other end.

mod machine;

use std::collections::VecDeque;

use embedded_can::nb::Can;
use embedded_can::{ErrorKind, Frame as _};
use machine::{model, reading, seen};
use rotor_edge_core::can::{Frame, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_core::node::{Node, NodeConfig, Save};
use rotor_edge_core::state::{NodeState, Reason};

/// The node's number on the bus.
const NODE: u8 = 7;

/// Where a board keeps what must survive a loss of power.
#[derive(Default)]
struct Flash {
    model: Option<Vec<u8>>,
    memory: Vec<u8>,
}

/// A node for two shapes, four probes and two planes with what was stored.
fn start(flash: &Flash) -> Node<2, 4, 2> {
    let mut node =
        Node::new(NodeConfig::new(NODE)).expect("a number up to 30, thresholds within their bounds");
    // Without a model it says so, and can be reached for a deployment.
    let _ = node.load(flash.model.as_deref().ok_or(Reason::NothingStored));
    node.restore(&flash.memory);
    node
}

/// One turn of a board's loop. Between two of them it may sleep until a frame arrives or [`Node::poll_at`].
fn turn<C: Can>(node: &mut Node<2, 4, 2>, bus: &mut C, flash: &mut Flash, time_us: u64) {
    while let Ok(heard) = bus.receive() {
        // frames with 29-bit identifiers are none of ours
        if let Some(frame) = Frame::new(heard.id(), heard.data()) {
            node.receive(time_us, &frame);
        }
    }
    node.poll(time_us);
    while let Some(save) = node.to_save() {
        let stored = match save {
            Save::Memory(memory) => {
                flash.memory = memory.to_vec();
                true
            }
            // A board that takes commands stores counter, model and thresholds here, and starts anew when
            // `Node::is_trial_over` says so; this one has no key.
            _ => false,
        };
        node.saved(time_us, stored);
    }
    while let Some(frame) = node.transmit() {
        let frame = C::Frame::new(frame.id(), frame.data()).expect("every driver has classic frames");
        // A driver whose mailboxes are full gives the frame back: keep it and come back later.
        let _ = bus.transmit(&frame);
    }
}

/// Two queues instead of a controller.
#[derive(Default)]
struct Queues {
    to_node: VecDeque<Frame>,
    from_node: VecDeque<Frame>,
}

impl Can for Queues {
    type Frame = Frame;
    type Error = ErrorKind;

    fn transmit(&mut self, frame: &Frame) -> nb::Result<Option<Frame>, ErrorKind> {
        self.from_node.push_back(*frame);
        Ok(None)
    }

    fn receive(&mut self) -> nb::Result<Frame, ErrorKind> {
        self.to_node.pop_front().ok_or(nb::Error::WouldBlock)
    }
}

fn main() {
    let mut encoded = vec![0; machine::MachineModel::max_size_bytes()];
    let length = model().encode(&mut encoded).expect("the largest fits");
    encoded.truncate(length);
    let mut flash = Flash { model: Some(encoded), ..Flash::default() };
    let mut node = start(&flash);
    let mut bus = Queues::default();
    let mut results = ResultAssembler::new();
    let mut time_us = 0;
    for second in 0..90 {
        time_us = second * 1_000_000;
        let reading = reading(&model(), 9000.0, &seen([[2900.0, 4100.0], [-1100.0, 1900.0]], second));
        bus.to_node.extend(reading_frames(NODE, &NumberedReading::new(second as u16, reading)));
        turn(&mut node, &mut bus, &mut flash, time_us);
        for frame in bus.from_node.drain(..) {
            if let Some(result) = results.receive(&frame)
                && second % 30 == 0
            {
                let [x, y] = result.static_g_mm;
                println!(
                    "{second:3} s: static unbalance [{x:.0}, {y:.0}] g·mm, residual {:.2} µm",
                    result.e_um
                );
            }
        }
    }
    let status = node.status(time_us);
    println!("{:?}, evidence {:.1} s old", status.state, status.age_s);
    assert_eq!(status.state, NodeState::Tracking);
    // Ten seconds without readings, and nothing is said of the machine any more.
    turn(&mut node, &mut bus, &mut flash, time_us + 11_000_000);
    assert_eq!(node.status(time_us + 11_000_000).state, NodeState::Stale);
    // After a power cut it first listens whether its number is its own; what it had learned is there.
    assert!(start(&flash).restore(&flash.memory));
}

#[test]
fn it_tracks_and_falls_stale() {
    main();
}

//! What the tests of this folder share: a monitor of the sample's machine, and who listens to it.

use rotor_edge_core::can::{Frame, Keyphasor, Message, MonitorResult, NumberedReading, reading_frames};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::{ProbeVector, Reading, rad_s};
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_core::state::{NodeState, Reason, Status};

use super::Watch;
use crate::edge::{Deployment, EdgeModel, EdgeNode};
use crate::sample;

const SPEED_RPM: f32 = 9_000.0;
const STEP_US: u64 = 10_000;
/// From a reading to the next, ten a second.
const READING_US: u64 = 100_000;

/// The sample's machine with an unbalance in each plane.
pub fn model() -> EdgeModel {
    let (mut rotor, ..) = sample::load().unwrap();
    for (plane, unbalance) in rotor.plane.iter_mut().zip([900.0, 700.0]) {
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(unbalance), Some(40.0));
    }
    Deployment::new(&rotor, 11_500.0).unwrap().edge
}

/// What the machine shows as long as the model fits.
pub fn healthy(model: &EdgeModel) -> Reading {
    let at_speed = response(model, rad_s(SPEED_RPM), &SupportAmplitudes::default()).unwrap();
    let description = model.description();
    let shown = at_speed.probes().iter().map(|probe| probe.phasor(description.initial_unbalance_g_mm));
    let vectors: Vec<ProbeVector> = shown.map(ProbeVector::from_phasor).collect();
    Reading::new(SPEED_RPM, &vectors[..description.probes.len()]).unwrap()
}

/// The same with the probes of bearing 2 the other way round, which no unbalance explains.
pub fn faulty(model: &EdgeModel) -> Reading {
    let healthy = healthy(model);
    let turned = |v: ProbeVector| ProbeVector { cos_um: -v.cos_um, sin_um: -v.sin_um };
    let [a, b, c, d] = healthy.probes().try_into().unwrap();
    Reading::new(healthy.speed_rpm, &[a, b, turned(c), turned(d)]).unwrap()
}

/// A result without anything special, of so many planes.
pub fn plain_result(sequence: u16, planes: u8) -> MonitorResult {
    MonitorResult {
        sequence,
        flags: 0,
        suspect: None,
        redundancy: 4,
        streak: 0,
        used_mask: 0b1111,
        reason: Reason::None,
        planes,
        unbalance_g_mm: [[3.0, 4.0], [-1.0, 0.0], [0.0; 2], [0.0; 2]],
        static_g_mm: [2.0, 4.0],
        dynamic_g_mm: [2.0, 2.0],
        e_um: 1.0,
        ratio: 0.1,
        floor_um: 0.5,
        level_um: 0.9,
    }
}

/// What a monitor tells of itself.
pub fn told(state: NodeState, reason: Reason) -> Message {
    Message::State(Status { state, reason, age_s: 0.5, ..Status::default() })
}

/// Monitors and a listener on one bus.
pub struct Bench {
    pub watch: Watch,
    pub nodes: Vec<EdgeNode>,
    pub model: EdgeModel,
    pub sequence: u16,
    now_us: u64,
}

impl Bench {
    /// One monitor for each number.
    pub fn new(numbers: &[u8]) -> Self {
        let model = model();
        let node = |(place, number): (u64, &u8)| {
            // nothing is averaged or waited for, so that each reading counts
            let mut config = NodeConfig::new(*number);
            config.seed = place;
            let thresholds = &mut config.thresholds;
            (thresholds.average_s, thresholds.persistence_s, thresholds.learning_s) = (0.0, 0.0, 0.0);
            let mut node = EdgeNode::new(config).unwrap();
            node.replace_model(0, model.clone()).unwrap();
            node
        };
        let nodes = (0..).zip(numbers).map(node).collect();
        Self { watch: Watch::new(None), nodes, model, sequence: 0, now_us: 0 }
    }

    /// A frame for all but the node that sent it.
    fn publish(&mut self, from: Option<usize>, frame: &Frame) {
        for (number, node) in self.nodes.iter_mut().enumerate() {
            if Some(number) != from {
                node.receive(self.now_us, frame);
            }
        }
        self.watch.receive(self.now_us, frame);
    }

    fn exchange(&mut self) {
        for question in self.watch.questions() {
            self.nodes.iter_mut().for_each(|node| node.receive(self.now_us, &question));
        }
        for number in 0..self.nodes.len() {
            self.nodes[number].poll(self.now_us);
            while let Some(frame) = self.nodes[number].transmit() {
                self.publish(Some(number), &frame);
            }
        }
    }

    /// Lets time pass.
    pub fn run(&mut self, time_us: u64) {
        for _ in 0..time_us / STEP_US {
            self.now_us += STEP_US;
            self.watch.pass(self.now_us);
            self.exchange();
        }
    }

    /// Sends a reading to monitor `to` and lets time pass until the next is due.
    pub fn send(&mut self, to: u8, keyphasor: Keyphasor, reading: Reading) {
        let numbered = NumberedReading { sequence: self.sequence, keyphasor, reading };
        for frame in reading_frames(to, &numbered) {
            self.publish(None, &frame);
        }
        self.sequence += 1;
        self.exchange();
        self.run(READING_US);
    }

    /// Sends so many healthy readings.
    pub fn send_healthy(&mut self, to: u8, number: usize) {
        let reading = healthy(&self.model);
        (0..number).for_each(|_| self.send(to, Keyphasor::Locked, reading));
    }

    /// Sends so many faulty readings.
    pub fn send_faulty(&mut self, to: u8, number: usize) {
        let reading = faulty(&self.model);
        (0..number).for_each(|_| self.send(to, Keyphasor::Locked, reading));
    }
}

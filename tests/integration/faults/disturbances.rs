//! What can go wrong on a bus beside lost and damaged frames.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rotor_edge::bus::VirtualBus;
use rotor_edge::edge::{EdgeModel, EdgeNode};
use rotor_edge_core::can::{Frame, frame_id};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_tests::with_supports;

use super::scene::{Disturbance, MONITOR, NODE, OTHER, Watched};

/// Sends frames with the highest priority of all, `per_period` in each period (370 fill it).
pub struct Babbler {
    pub per_period: usize,
}

impl Disturbance for Babbler {
    fn act(&mut self, bus: &mut VirtualBus, _: &mut Watched, _: usize, _: u64) {
        for _ in 0..self.per_period {
            bus.send(OTHER, Frame::standard(0, &[0xaa; 8]).unwrap());
        }
    }
}

/// Sends arbitrary bytes under the identifiers that a host uses towards the monitor.
pub struct Impostor {
    pub per_period: usize,
    pub random: Xoshiro256PlusPlus,
}

impl Impostor {
    pub fn new(per_period: usize) -> Self {
        Self { per_period, random: Xoshiro256PlusPlus::seed_from_u64(5) }
    }
}

/// Types of what is told to a monitor of four probes: reading start, vectors, gaps, end, and transfers.
const TOLD: [u8; 8] = [8, 9, 10, 11, 12, 17, 19, 48];

impl Disturbance for Impostor {
    fn act(&mut self, bus: &mut VirtualBus, _: &mut Watched, _: usize, _: u64) {
        for _ in 0..self.per_period {
            let message_type = TOLD[(self.random.next_u64() % TOLD.len() as u64) as usize];
            let bytes = self.random.next_u64().to_le_bytes();
            bus.send(OTHER, Frame::standard(frame_id(message_type, NODE), &bytes).unwrap());
        }
    }
}

/// Fills what the others leave of the bus with frames of the lowest priority.
pub struct Flood;

impl Disturbance for Flood {
    fn act(&mut self, bus: &mut VirtualBus, _: &mut Watched, _: usize, _: u64) {
        for _ in 0..370 {
            bus.send(OTHER, Frame::standard(0x7fe, &[0x55; 8]).unwrap());
        }
    }
}

/// The monitor's controller goes bus-off for three of every twenty periods.
pub struct BusOff;

impl Disturbance for BusOff {
    fn act(&mut self, bus: &mut VirtualBus, _: &mut Watched, row: usize, _: u64) {
        match row % 20 {
            10 => bus.switch_off(MONITOR),
            13 => bus.switch_on(MONITOR),
            _ => {}
        }
    }
}

/// The monitor loses its power every fifty periods, in the middle of whatever was on the bus.
pub struct PowerCuts;

impl Disturbance for PowerCuts {
    fn act(&mut self, _: &mut VirtualBus, watched: &mut Watched, row: usize, time_us: u64) {
        if row % 50 == 49 {
            watched.restart(time_us);
        }
    }
}

/// A second monitor with the same number and another model is plugged in for half of every two hundred periods.
pub struct Namesake {
    model: EdgeModel,
    node: Option<EdgeNode>,
}

impl Namesake {
    pub fn new(model: &EdgeModel) -> Self {
        Self { model: with_supports(model, |supports| supports[0].mass_kg += 5.0), node: None }
    }

    fn plugged_in(&self, time_us: u64) -> EdgeNode {
        let mut node = EdgeNode::new({
            let mut config = NodeConfig::new(NODE);
            config.seed = 1;
            config
        })
        .unwrap();
        node.replace_model(time_us, self.model.clone()).unwrap();
        node
    }

    fn speak(&mut self, bus: &mut VirtualBus) {
        while let Some(frame) = self.node.as_mut().and_then(EdgeNode::transmit) {
            bus.send(OTHER, frame);
        }
    }
}

impl Disturbance for Namesake {
    fn act(&mut self, bus: &mut VirtualBus, _: &mut Watched, row: usize, time_us: u64) {
        match row % 200 {
            50 => self.node = Some(self.plugged_in(time_us)),
            150 => self.node = None,
            _ => {}
        }
        if let Some(node) = &mut self.node {
            node.poll(time_us);
        }
        self.speak(bus);
    }

    fn hear(&mut self, bus: &mut VirtualBus, time_us: u64, frame: &Frame) {
        if let Some(node) = &mut self.node {
            node.receive(time_us, frame);
            node.poll(time_us);
        }
        self.speak(bus);
    }
}

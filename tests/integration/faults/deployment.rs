//! Deployment under faults: cut at every frame, damaged, forged, replayed. The model changes whole or not at all.

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rotor_edge::bus::{BusConfig, VirtualBus};
use rotor_edge::edge::{EdgeModel, EdgeNode};
use rotor_edge_core::can::isotp::{IsoTp, TIMEOUT_US};
use rotor_edge_core::can::{Frame, TYPE_TO_HOST, TYPE_TO_NODE, frame_id};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, Key, MAX_REQUEST_BYTES, Outcome, write_request,
};
use rotor_edge_core::node::{NodeConfig, Save};
use rotor_edge_tests::with_supports;

use super::machine;
use super::scene::{HOST, MONITOR, NODE};

pub const KEY: Key = Key([0x42; 32]);

pub struct Lab {
    pub old: EdgeModel,
    pub better: EdgeModel,
    pub node: EdgeNode,
    pub now_us: u64,
}

impl Lab {
    pub fn new() -> Self {
        let (old, _) = machine(1);
        let better = with_supports(&old, |supports| supports[1].mass_kg += 2.0);
        let mut config = NodeConfig::new(NODE);
        config.key = Some(KEY);
        let mut node = EdgeNode::new(config).unwrap();
        node.replace_model(0, old.clone()).unwrap();
        let mut lab = Self { old, better, node, now_us: 0 };
        // it answers once it has listened
        lab.poll(0);
        lab.now_us = config.listen_us;
        lab.poll(lab.now_us);
        while lab.node.transmit().is_some() {}
        lab
    }

    /// Polls the node, and stores what it wants stored.
    pub fn poll(&mut self, time_us: u64) {
        self.node.poll(time_us);
        store_all(&mut self.node, time_us);
    }

    pub fn request(&self, key: &Key, node: u8, counter: u64) -> Vec<u8> {
        let (mut body, mut request) = (vec![0; EdgeModel::max_size_bytes()], vec![0; MAX_REQUEST_BYTES]);
        let length = self.better.encode(&mut body).unwrap();
        let command = Command::Deploy;
        let length = write_request(&mut request, key, node, command, counter, &body[..length]).unwrap();
        request.truncate(length);
        request
    }

    /// Sends a request over the bus until both ends are silent; `passes` is asked for each frame on the wire.
    fn transfer(
        &mut self,
        request: &[u8],
        faults: BusConfig,
        mut passes: impl FnMut(usize) -> bool,
    ) -> (usize, Option<Answer>) {
        let mut bus = VirtualBus::new(faults, 2);
        bus.wait_until(self.now_us);
        let mut host = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
        host.send(self.now_us, request).unwrap();
        let (mut frames, mut answer) = (0, None);
        let end_us = self.now_us + 4 * TIMEOUT_US;
        while bus.now_us() < end_us && (host.is_sending() || answer.is_none()) {
            while let Some(payload) = host.poll(bus.now_us()) {
                bus.send(HOST, Frame::standard(frame_id(TYPE_TO_NODE, NODE), &payload).unwrap());
            }
            if bus.transmit_one().is_none() {
                bus.wait_until(bus.now_us() + 10_000);
            }
            while let Some((time_us, frame)) = bus.receive(MONITOR) {
                frames += 1;
                if passes(frames - 1) {
                    self.node.receive(time_us, &frame);
                }
            }
            self.poll(bus.now_us());
            while let Some(frame) = self.node.transmit() {
                if frame.message_type() == TYPE_TO_HOST {
                    frames += 1;
                    if passes(frames - 1) {
                        bus.send(MONITOR, frame);
                    }
                }
            }
            while let Some((time_us, frame)) = bus.receive(HOST) {
                host.receive(time_us, frame.bytes());
                if !host.message().is_empty() {
                    answer =
                        Answer::decode(host.message(), request, &KEY).filter(|(_, own)| *own).map(|(a, _)| a);
                }
            }
            let _ = host.check_time(bus.now_us());
        }
        self.now_us = bus.now_us();
        (frames, answer)
    }
}

fn store_all(node: &mut EdgeNode, time_us: u64) {
    while node.to_save().is_some() {
        node.saved(time_us, true);
    }
}

/// What a command asks to be stored; the memory is not one's business here.
fn wants_command_stored(node: &EdgeNode) -> bool {
    matches!(node.to_save(), Some(Save::Command { .. }))
}

#[test]
fn deployment_cut_at_any_frame_leaves_whole_model() {
    let clean = BusConfig::default();
    let mut lab = Lab::new();
    let request = lab.request(&KEY, NODE, 1);
    let (frames, answer) = lab.transfer(&request, clean, |_| true);
    assert_eq!(answer.unwrap().outcome, Outcome::Accepted);
    assert!(frames > request.len() / 7, "{frames} frames");
    let mut lab = Lab::new();
    let mut counter = 1;
    for cut in 0..frames {
        let request = lab.request(&KEY, NODE, counter);
        let before = lab.node.model().cloned();
        let (_, answer) = lab.transfer(&request, clean, |frame| frame < cut);
        assert_eq!(answer, None, "cut at frame {cut}");
        let changed = lab.node.command_counter() == counter;
        let expected = if changed { Some(lab.better.clone()) } else { before };
        assert_eq!(lab.node.model(), expected.as_ref(), "cut at frame {cut}");
        counter += 1;
        let request = lab.request(&KEY, NODE, counter);
        let (_, answer) = lab.transfer(&request, clean, |_| true);
        assert_eq!(answer.map(|a| a.outcome), Some(Outcome::Accepted), "after a cut at frame {cut}");
        counter += 1;
        let old = lab.old.clone();
        lab.node.replace_model(lab.now_us, old).unwrap();
    }
}

#[test]
fn deployment_over_bad_bus_changes_whole_model_or_nothing() {
    let (mut accepted, mut refused) = (0, 0);
    for seed in 0..200 {
        let mut lab = Lab::new();
        let faults = BusConfig { loss: 0.002, repetition: 0.002, flip: 0.002, seed, ..BusConfig::default() };
        let request = lab.request(&KEY, NODE, 1);
        let (_, answer) = lab.transfer(&request, faults, |_| true);
        let changed = lab.node.command_counter() == 1;
        assert_eq!(lab.node.model(), Some(if changed { &lab.better } else { &lab.old }), "seed {seed}");
        if answer.is_some_and(|a| a.outcome == Outcome::Accepted) {
            assert!(changed, "seed {seed}: told as accepted");
            accepted += 1;
        } else {
            refused += 1;
        }
    }
    assert!(accepted > 20 && refused > 20, "both happen: {accepted} accepted, {refused} not");
}

#[test]
fn of_twenty_thousand_forgeries_none_is_accepted() {
    let mut lab = Lab::new();
    let genuine = lab.request(&KEY, NODE, 5);
    let (_, answer) = lab.transfer(&genuine, BusConfig::default(), |_| true);
    assert_eq!(answer.unwrap().outcome, Outcome::Accepted);
    let before = lab.node.model().cloned();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(9);
    let mut any = |below: usize| (random.next_u64() % below as u64) as usize;
    let mut kinds = [0; 5];
    for attempt in 0..20_000 {
        let kind = attempt % kinds.len();
        let mut forged = match kind {
            // recorded and sent again
            0 => genuine.clone(),
            // another device's key, a later counter
            1 => lab.request(&Key(std::array::from_fn(|_| any(256) as u8)), NODE, 6 + attempt as u64),
            // meant for another device that has the same key
            2 => lab.request(&KEY, NODE + 1, 6 + attempt as u64),
            // a genuine one with a later counter and the code guessed, or some bits changed
            _ => genuine.clone(),
        };
        if kind == 3 {
            forged[4..12].copy_from_slice(&(6 + attempt as u64).to_le_bytes());
            let length = forged.len();
            forged[length - 16..].iter_mut().for_each(|byte| *byte = any(256) as u8);
        } else if kind == 4 {
            let bit = any(forged.len() * 8);
            forged[bit / 8] ^= 1 << (bit % 8);
        }
        kinds[kind] += 1;
        deliver(&mut lab.node, lab.now_us, &forged);
        assert!(!wants_command_stored(&lab.node), "attempt {attempt} of kind {kind} was accepted");
    }
    let c = lab.node.counters();
    assert_eq!((lab.node.model(), lab.node.command_counter(), c.accepted), (before.as_ref(), 5, 1));
    assert_eq!(c.replayed as usize, kinds[0]);
    assert_eq!((c.forged + c.refused) as usize, 20_000 - kinds[0], "each is counted");
}

/// Hands a whole message to the node, frame by frame.
fn deliver(node: &mut EdgeNode, time_us: u64, request: &[u8]) {
    let mut host = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
    host.send(time_us, request).unwrap();
    loop {
        let mut quiet = true;
        while let Some(payload) = host.poll(time_us) {
            quiet = false;
            node.receive(time_us, &Frame::standard(frame_id(TYPE_TO_NODE, NODE), &payload).unwrap());
        }
        while let Some(frame) = node.transmit() {
            if frame.message_type() == TYPE_TO_HOST {
                quiet = false;
                host.receive(time_us, frame.bytes());
            }
        }
        if quiet {
            return;
        }
    }
}

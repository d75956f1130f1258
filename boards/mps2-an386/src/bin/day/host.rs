//! The other end of the bus: it plays the scenes and knows what is true.

use cortex_m_semihosting::hprintln;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro128PlusPlus;
use rotor_edge_boards::monitor::Monitor;
use rotor_edge_core::can::isotp::IsoTp;
use rotor_edge_core::can::{
    BROADCAST_NODE, Counters, Frame, Message, NumberedReading, TYPE_TO_HOST, TYPE_TO_NODE, frame_id,
    reading_frames,
};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, KEY_BYTES, Key, MAX_REQUEST_BYTES, Outcome, write_request,
};
use rotor_edge_core::reading::Reading;
use rotor_edge_core::state::{NodeState, Reason};
use rotor_edge_mps2_an386::sample::{self, BETTER, KEY, MODEL, NUMBER};

use super::machine;
use super::power::{self, Powered};
use super::truth::{AGE_LIMIT_S, Scene, Table, Truth};

pub type Link = IsoTp<ANSWER_BYTES, MAX_REQUEST_BYTES>;

const READING_S: u64 = 4;
const SECOND_US: u64 = 1_000_000;
const SEED: u64 = 20_261_121;
const FOREIGN_KEY: Key = Key([0xa5; KEY_BYTES]);
/// Frames a second of a bus without a pause, 500 kbit/s.
const FLOOD_FRAMES: usize = 400;

pub struct Host {
    monitor: Monitor<Powered>,
    random: Xoshiro128PlusPlus,
    truth: Truth,
    pub table: &'static mut Table,
    /// Of a machine that is as each model says.
    good: [Reading; 2],
    is_better: bool,
    /// Last used, and last that was answered with "accepted".
    counter: u64,
    accepted: u64,
    sequence: u16,
    /// Present time, and when the board was started, µs of the whole day.
    now_us: u64,
    started_us: u64,
    request: &'static mut [u8; MAX_REQUEST_BYTES],
    link: &'static mut Link,
}

impl Host {
    pub fn new(
        monitor: Monitor<Powered>,
        request: &'static mut [u8; MAX_REQUEST_BYTES],
        link: &'static mut Link,
        table: &'static mut Table,
    ) -> Self {
        let truth = Truth {
            has_model: false,
            deployed_s: 0,
            judged_s: None,
            can_be_judged: None,
            is_faulty: false,
            faulty_since_s: None,
            is_flagged: false,
            other_s: None,
        };
        table.starts = 1;
        Self {
            monitor,
            random: Xoshiro128PlusPlus::seed_from_u64(SEED),
            truth,
            table,
            good: [MODEL, BETTER].map(machine::healthy),
            is_better: false,
            counter: 0,
            accepted: 0,
            sequence: 0,
            now_us: 0,
            started_us: 0,
            request,
            link,
        }
    }

    pub fn below(&mut self, end: usize) -> usize {
        self.random.next_u32() as usize % end
    }

    /// Time of the board.
    fn time_us(&self) -> u64 {
        self.now_us - self.started_us
    }

    /// What happens from `second` on, for a second, and a look at the state then.
    #[inline(never)]
    pub fn pass_a_second(&mut self, second: u64, now: Scene, scene: Scene) {
        self.now_us = second * SECOND_US;
        self.run();
        match now {
            Scene::OtherNode => {
                let status = self.monitor.node.status(self.time_us());
                self.send(&Message::State(status).encode(NUMBER));
                self.truth.other_s = Some(second);
            }
            Scene::Flood => self.flood(),
            Scene::PowerCuts if second.is_multiple_of(50) => self.cut_a_deployment(second),
            // In the middle of a fault.
            Scene::Fault if second % 300 == 50 => self.restart(second),
            _ => {}
        }
        if second.is_multiple_of(READING_S) && now != Scene::Silence {
            self.read(second, now);
        }
        self.now_us = second * SECOND_US + SECOND_US / 2;
        self.run();
        self.now_us = (second + 1) * SECOND_US - 1;
        self.run();
        self.look(second, scene);
    }

    /// Lets the board poll whenever it wants to until now.
    fn run(&mut self) {
        let time_us = self.time_us();
        loop {
            let at_us = self.monitor.node.poll_at().min(time_us);
            self.monitor.poll(at_us, true);
            self.hear(at_us);
            if at_us == time_us {
                return;
            }
        }
    }

    #[inline(never)]
    fn look(&mut self, second: u64, scene: Scene) {
        let state = self.monitor.node.status(self.time_us()).state;
        let truth = &mut self.truth;
        let faulty_s = truth.faulty_since_s.map(|since_s| second - since_s);
        if state == NodeState::Flagged
            && !truth.is_flagged
            && let Some(faulty_s) = faulty_s
        {
            truth.is_flagged = true;
            self.table.slowest_flag_s = self.table.slowest_flag_s.max(faulty_s);
        }
        if !truth.is_flagged && truth.has_model {
            self.table.slowest_flag_s = self.table.slowest_flag_s.max(faulty_s.unwrap_or(0));
        }
        let is_allowed = truth.allows(second, state);
        let age_s = truth.judged_s.map_or(u64::MAX, |judged_s| second - judged_s);
        self.table.saw(scene, state);
        if state == NodeState::Tracking && age_s >= AGE_LIMIT_S {
            self.table.healthy_while_blind_s += 1;
        }
        if !is_allowed {
            self.table.wrong_s += 1;
            hprintln!("second {}: {:?}, last judged {} s before", second, state, age_s);
            hprintln!("    {:?}", self.monitor.node.verdict());
        }
    }

    /// Takes everything that the node sends.
    fn hear(&mut self, time_us: u64) {
        while let Some(frame) = self.monitor.node.transmit() {
            if frame.message_type() == TYPE_TO_HOST {
                self.link.receive(time_us, frame.bytes());
            }
        }
    }

    fn send(&mut self, frame: &Frame) {
        let time_us = self.time_us();
        self.monitor.receive(time_us, frame, true);
        self.hear(time_us);
    }

    #[inline(never)]
    fn read(&mut self, second: u64, now: Scene) {
        let before = self.monitor.node.counters();
        self.sequence = self.sequence.wrapping_add(1);
        let good = &self.good[usize::from(self.is_better)];
        let numbered = machine::reading(&mut self.random, good, now, self.sequence);
        let arrives = self.transmit(now, &numbered);
        let may_answer = self.monitor.node.may_send();
        let after = self.monitor.node.counters();
        if arrives {
            assert_eq!(told(&after), told(&before) + 1, "a reading unaccounted for in second {second}");
        }
        if !arrives || !may_answer || !self.truth.has_model {
            return;
        }
        self.truth.can_be_judged = Some(now.can_be_judged());
        if now.can_be_judged() {
            self.truth.judged_s = Some(second);
            self.truth.is_faulty = now == Scene::Fault;
        }
        if now == Scene::Fault && !self.truth.is_flagged && self.truth.faulty_since_s.is_none() {
            self.truth.faulty_since_s = Some(second);
            self.table.faults += 1;
        }
    }

    /// Sends the frames, on a bad bus with a fault every other time; whether a whole reading arrives.
    fn transmit(&mut self, now: Scene, numbered: &NumberedReading) -> bool {
        let mut frames = reading_frames(NUMBER, numbered);
        let fault = if now == Scene::BadBus { self.below(8) } else { 7 };
        let victim = self.below(frames.len());
        let mut copies = 1;
        match fault {
            0 => return false,
            1 => {
                frames.remove(victim);
            }
            2 => {
                let bit = self.below(32);
                let mut bytes = [0; 8];
                bytes.copy_from_slice(frames[victim].bytes());
                bytes[4 + bit / 8] ^= 1 << (bit % 8);
                let Some(flipped) = Frame::standard(frames[victim].raw_id(), &bytes) else { unreachable!() };
                frames[victim] = flipped;
            }
            3 => copies = 2,
            4 => frames.swap(1 + victim % 4, 1 + self.below(4)),
            _ => {}
        }
        for frame in &frames {
            for _ in 0..copies {
                self.send(frame);
            }
        }
        !matches!(fault, 1 | 2)
    }

    /// Frames of others, of which some are addressed to this node and mean nothing.
    fn flood(&mut self) {
        for _ in 0..FLOOD_FRAMES {
            let payload = [self.random.next_u32(), self.random.next_u32()].map(u32::to_le_bytes);
            let node = if self.below(4) == 0 { NUMBER } else { self.below(BROADCAST_NODE.into()) as u8 };
            // Not a frame that only a node may send, nor one that begins a reading or a transfer.
            let message_type = [0, 5, 17, 18][self.below(4)];
            if let Some(frame) = Frame::standard(frame_id(message_type, node), payload.as_flattened()) {
                self.send(&frame);
            }
        }
    }

    fn other(&self) -> &'static [u8] {
        if self.is_better { MODEL } else { BETTER }
    }

    /// The model that is not in use, in one of four ways.
    #[inline(never)]
    pub fn deploy_in_some_way(&mut self, hour: u64) {
        match hour % 4 {
            1 => {
                let forged =
                    self.command(&FOREIGN_KEY, Command::Deploy, self.counter + 1, self.other(), None);
                assert_eq!(forged, Some(Outcome::Forged));
            }
            3 => {
                let lost = 2 + self.below(60);
                let cut = self.command(&KEY, Command::Deploy, self.counter + 1, self.other(), Some(lost));
                assert_eq!(cut, None);
            }
            way => {
                self.deploy();
                if way == 2 {
                    let again = self.command(&KEY, Command::Deploy, self.counter, self.other(), None);
                    assert_eq!(again, Some(Outcome::Replayed));
                }
            }
        }
    }

    fn deploy(&mut self) {
        self.counter += 1;
        let outcome = self.command(&KEY, Command::Deploy, self.counter, self.other(), None);
        assert_eq!(outcome, Some(Outcome::Accepted));
        self.deployed();
    }

    fn deployed(&mut self) {
        self.is_better = !self.is_better;
        let deployed_s = self.now_us / SECOND_US;
        let other_s = self.truth.other_s;
        self.truth = Truth {
            has_model: true,
            deployed_s,
            judged_s: None,
            can_be_judged: None,
            is_faulty: false,
            faulty_since_s: None,
            is_flagged: false,
            other_s,
        };
    }

    pub fn acknowledge(&mut self) {
        self.truth.faulty_since_s = None;
        if self.truth.is_flagged {
            self.counter += 1;
            let outcome = self.command(&KEY, Command::Acknowledge, self.counter, &[], None);
            assert_eq!(outcome, Some(Outcome::Accepted));
            self.truth.is_flagged = false;
        }
    }

    /// Power fails somewhere in a deployment: one of the two models is left, and a counter that is not lower.
    #[inline(never)]
    fn cut_a_deployment(&mut self, second: u64) {
        let steps = 1 + self.below(400) as u32;
        power::fails_after(steps);
        self.counter += 1;
        let old = self.monitor.node.model().map(|model| model.checksum());
        let outcome = self.command(&KEY, Command::Deploy, self.counter, self.other(), None);
        self.restart(second);
        let new = self.monitor.node.model().map(|model| model.checksum());
        assert!(new.is_some(), "the model is gone");
        if new != old {
            self.deployed();
        } else {
            assert_ne!(outcome, Some(Outcome::Accepted), "an accepted model is gone");
        }
        assert!(self.monitor.node.command_counter() >= self.accepted, "the counter went back");
        // It has listened then, and answers.
        self.now_us += SECOND_US / 5;
        self.run();
        let again = self.command(&KEY, Command::Deploy, self.accepted, self.other(), None);
        assert_eq!(again, Some(Outcome::Replayed), "a command that was accepted is taken again");
    }

    /// The board loses power for a moment.
    #[inline(never)]
    fn restart(&mut self, second: u64) {
        power::is_back();
        self.started_us = self.now_us;
        self.table.starts += 1;
        assert!(self.monitor.restart(sample::config()).is_ok());
        self.truth.judged_s = None;
        self.truth.can_be_judged = None;
        let was_flagged = self.truth.is_flagged;
        let is_flagged = self.monitor.node.status(0).cause != Reason::None;
        assert_eq!(is_flagged, was_flagged, "the flag in second {second}");
    }

    /// Sends a request; without the host's frame number `lost`, if any. What became of it.
    fn command(
        &mut self,
        key: &Key,
        command: Command,
        counter: u64,
        body: &[u8],
        lost: Option<usize>,
    ) -> Option<Outcome> {
        let Some(length) = write_request(self.request, key, NUMBER, command, counter, body) else {
            panic!("no room for the request")
        };
        *self.link = IsoTp::new();
        let time_us = self.time_us();
        assert!(self.link.send(time_us, &self.request[..length]).is_ok());
        let id = frame_id(TYPE_TO_NODE, NUMBER);
        let mut number = 0;
        while let Some(payload) = self.link.poll(time_us) {
            number += 1;
            if lost == Some(number) {
                continue;
            }
            let Some(frame) = Frame::standard(id, &payload) else { unreachable!() };
            self.send(&frame);
        }
        let (answer, confirmed) = Answer::decode(self.link.message(), &self.request[..length], &KEY)?;
        assert!(confirmed || answer.outcome == Outcome::Forged, "an answer that the node did not sign");
        if answer.outcome == Outcome::Accepted {
            self.accepted = counter;
        }
        Some(answer.outcome)
    }
}

/// Readings of which the node has said what became of them; a gap is told when the next one arrives.
fn told(c: &Counters) -> u32 {
    c.readings + c.skipped + c.rejected + c.unsolved + c.unmodelled + c.repeated + c.late
}

//! Random lives of a machine and its monitor, beside an oracle that knows what was true.
//!
//! Each life is a sequence of hours, minutes and seconds in which readings stop, probes or the keyphasor are lost, the speed
//! leaves its range, a bearing wears, the power goes, storage fails, somebody uses the number. After every step the node's
//! state is held against what the oracle knows of the evidence it was given; nothing of the node's own is asked but its
//! status.

use std::vec::Vec;

use super::testing::*;
use super::*;
use crate::can::{Keyphasor, TYPE_HEARTBEAT, frame_id};
use crate::command::{Command, Key, Outcome};
use crate::model::tests::rigid_rotor;
use crate::reading::Reading;
use crate::state::NodeState;
use crate::testing::Random;

const NOISE_UM: f32 = 0.2;
const AGE_LIMIT_US: u64 = 10 * SECOND_US;

/// What is going on for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Episode {
    Healthy,
    Worn,
    Silence,
    NoKeyphasor,
    OutOfSpeed,
    Probes(u8),
    /// No readings follow.
    PowerCut,
    StorageFails,
    Foreign,
    Acknowledge,
    Forged,
}

struct Life {
    node: TestNode,
    store: Store,
    random: Random,
    time_us: u64,
    sequence: u16,
    counter: u64,
    healthy: Vec<Reading>,
    worn: Vec<Reading>,
    /// When the node was last given a reading that is entitled to a verdict; `None` since the last start.
    evidence_us: Option<u64>,
    /// The cause that is in storage.
    stored_cause: Reason,
    /// Time without a break, and readings, in which the machine was worn and the node was given it.
    worn_s: f64,
    states: [u32; 10],
}

impl Life {
    fn new(seed: u64) -> Self {
        let mut machine = rigid_rotor();
        machine.noise.floor_um = NOISE_UM;
        let store = Store::with(&machine);
        let speeds = [3000.0, 6000.0, 9000.0];
        Self {
            node: store.start(),
            store,
            random: Random::new(seed),
            time_us: 0,
            sequence: 0,
            counter: 0,
            healthy: speeds.map(|speed_rpm| shown(&machine, speed_rpm, 1.0)).to_vec(),
            worn: speeds.map(|speed_rpm| shown(&worn(0.8), speed_rpm, 1.0)).to_vec(),
            evidence_us: None,
            stored_cause: Reason::None,
            worn_s: 0.0,
            states: [0; 10],
        }
    }

    /// Uniform from 0 to 1.
    fn chance(&mut self) -> f64 {
        0.5 * (f64::from(self.random.signed()) + 1.0)
    }

    fn below(&mut self, number: usize) -> usize {
        ((self.chance() * number as f64) as usize).min(number - 1)
    }

    fn episode(&mut self) -> Episode {
        match self.below(16) {
            0..=4 => Episode::Healthy,
            5 => Episode::Worn,
            6 => Episode::Silence,
            7 => Episode::NoKeyphasor,
            8 => Episode::OutOfSpeed,
            9 | 10 => Episode::Probes(1 + self.below(15) as u8),
            11 => Episode::PowerCut,
            12 => Episode::StorageFails,
            13 => Episode::Foreign,
            14 => Episode::Acknowledge,
            _ => Episode::Forged,
        }
    }

    fn live(&mut self, episodes: usize) {
        for _ in 0..episodes {
            let episode = self.episode();
            let seconds = [0.3, 3.0, 15.0, 90.0][self.below(4)];
            let speed = self.below(3);
            match episode {
                Episode::PowerCut => self.cut(),
                Episode::Acknowledge => self.acknowledge(KEY),
                Episode::Forged => self.acknowledge(Key([1; 32])),
                _ => {}
            }
            self.store.fails = episode == Episode::StorageFails;
            let end_us = self.time_us + (seconds * 1e6) as u64;
            while self.time_us < end_us {
                self.step(episode, speed);
            }
            self.store.fails = false;
        }
    }

    fn step(&mut self, episode: Episode, speed: usize) {
        self.time_us += PERIOD_US;
        self.node.poll(self.time_us);
        self.node.receive(self.time_us, &Message::VersionQuery.encode(NODE));
        if episode == Episode::Foreign {
            let foreign = frame_id(TYPE_HEARTBEAT, NODE);
            self.node.receive(self.time_us, &Frame::standard(foreign, &[0; 8]).unwrap());
        }
        let may_answer = self.node.may_send();
        let source = if episode == Episode::Worn { self.worn[speed] } else { self.healthy[speed] };
        let mut reading = noisy(&source, NOISE_UM, &mut self.random);
        let mut keyphasor = Keyphasor::Locked;
        let mut is_evidence = may_answer;
        match episode {
            Episode::Silence | Episode::PowerCut => is_evidence = false,
            Episode::NoKeyphasor => (keyphasor, is_evidence) = (Keyphasor::Missing, false),
            Episode::OutOfSpeed => {
                reading = Reading::new(100.0, reading.probes()).unwrap();
                is_evidence = false;
            }
            Episode::Probes(mask) => {
                reading.lose(mask);
                // Four rows fit any unbalance of two planes, fewer even more.
                is_evidence &= mask.count_ones() < 2;
            }
            _ => {}
        }
        if !matches!(episode, Episode::Silence | Episode::PowerCut) {
            self.sequence = self.sequence.wrapping_add(1);
            let numbered = NumberedReading { sequence: self.sequence, keyphasor, reading };
            send_numbered(&mut self.node, self.time_us, &numbered);
        }
        if is_evidence {
            self.evidence_us = Some(self.time_us);
        }
        // The average of a second must be free of what was before.
        self.worn_s = match (episode, is_evidence) {
            (Episode::Worn, true) => self.worn_s + 0.087,
            _ => 0.0,
        };
        self.serve();
        sent(&mut self.node);
        self.judge(episode);
    }

    fn serve(&mut self) {
        let before = self.store.savings;
        self.store.serve(&mut self.node, self.time_us);
        if self.store.savings != before {
            self.stored_cause = self.store.start().status(0).cause;
        }
    }

    fn cut(&mut self) {
        self.node = self.store.start();
        self.time_us = 0;
        self.evidence_us = None;
        self.worn_s = 0.0;
        assert_eq!(self.node.status(0).cause, self.stored_cause, "what was stored is still known");
    }

    fn acknowledge(&mut self, key: Key) {
        self.time_us += SECOND_US;
        self.node.poll(self.time_us);
        if !self.node.may_send() {
            return;
        }
        sent(&mut self.node);
        self.counter += 1;
        let before = self.node.status(self.time_us).cause;
        let request = signed(key, Command::Acknowledge, self.counter, &[]);
        let outcome = answer(&mut self.node, &mut self.store, self.time_us, &request).outcome;
        let after = self.node.status(self.time_us).cause;
        if key == KEY {
            assert_eq!((outcome, after), (Outcome::Accepted, Reason::None));
            self.worn_s = 0.0;
        } else {
            assert_eq!((outcome, after), (Outcome::Forged, before));
        }
        self.stored_cause = self.store.start().status(0).cause;
        assert_eq!(self.stored_cause, after);
    }

    fn judge(&mut self, episode: Episode) {
        let status = self.node.status(self.time_us);
        let context = std::format!("{episode:?} at {} us: {status:?}", self.time_us);
        self.states[usize::from(status.state as u8)] += 1;
        let age_us = self.evidence_us.map(|evidence_us| self.time_us - evidence_us);
        let claims_health = matches!(status.state, NodeState::Tracking | NodeState::Learning);
        if claims_health {
            assert!(
                age_us.is_some_and(|age_us| age_us <= AGE_LIMIT_US),
                "healthy without evidence: {context}"
            );
            assert_eq!(status.cause, Reason::None, "healthy in spite of a flag: {context}");
            assert!(episode != Episode::Silence || age_us > Some(0), "{context}");
        }
        if age_us.is_none_or(|age_us| age_us > AGE_LIMIT_US) {
            let entitled = [
                NodeState::Stale,
                NodeState::Blind,
                NodeState::Waiting,
                NodeState::Flagged,
                NodeState::Conflict,
            ];
            assert!(entitled.contains(&status.state), "{context}");
        }
        if matches!(episode, Episode::NoKeyphasor | Episode::OutOfSpeed) {
            assert!(!claims_health && status.state != NodeState::Suspicious, "{context}");
        }
        if let Episode::Probes(mask) = episode
            && status.state != NodeState::Conflict
        {
            assert_eq!(status.missing_mask, mask, "{context}");
            assert!(mask.count_ones() < 2 || !claims_health, "{context}");
        }
        // Two seconds for the average to turn over, ten for persistence, one for counting.
        if self.worn_s > 14.0 {
            assert_ne!(status.cause, Reason::None, "a worn machine without a flag: {context}");
        }
        if self.stored_cause != Reason::None && !self.store.fails {
            assert_eq!(status.cause, self.stored_cause, "a stored flag is lost: {context}");
        }
        if episode == Episode::Foreign {
            assert_eq!(status.state, NodeState::Conflict, "{context}");
        }
    }
}

#[test]
fn no_fault_history_makes_monitor_healthy_without_evidence() {
    let mut states = [0; 10];
    for seed in 0..30 {
        let mut life = Life::new(seed);
        life.live(60);
        for (sum, seen) in states.iter_mut().zip(life.states) {
            *sum += seen;
        }
    }
    // All but NoModel and Listening come up often, or the oracle has looked at nothing.
    for state in [0, 1, 2, 3, 4, 7, 8, 9] {
        assert!(states[state] > 40, "{:?}: {}", NodeState::ALL[state], states[state]);
    }
}

#[test]
fn healthy_machine_with_failing_probes_and_bus_is_not_flagged() {
    for seed in 100..110 {
        let mut life = Life::new(seed);
        life.worn = life.healthy.clone();
        for _ in 0..60 {
            let episode = match life.episode() {
                Episode::Worn => Episode::Healthy,
                other => other,
            };
            if episode == Episode::PowerCut {
                life.cut();
            }
            let speed = life.below(3);
            for _ in 0..100 {
                life.step(episode, speed);
                assert_eq!(life.node.status(life.time_us).cause, Reason::None, "seed {seed}, {episode:?}");
            }
        }
    }
}

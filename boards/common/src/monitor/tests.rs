//! A board that is deployed to, sees a fault, and loses power.

use std::boxed::Box;
use std::vec::Vec;

use rotor_edge_core::can::isotp::{IsoTp, Progress};
use rotor_edge_core::can::{NumberedReading, TYPE_TO_HOST, TYPE_TO_NODE, frame_id, reading_frames};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, Key, MAX_REQUEST_BYTES, Outcome, write_request,
};
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::state::{NodeState, Status};
use rotor_edge_core::thresholds::Thresholds;

use super::*;
use crate::testing::Flash as TestFlash;

const NODE: u8 = 7;
const KEY: Key = Key([3; 32]);
const MODEL: &[u8] = include_bytes!("../../../sample/model.bin");
const BETTER: &[u8] = include_bytes!("../../../sample/better.bin");
const READINGS: &[u8] = include_bytes!("../../../sample/readings.bin");
const SECOND_US: u64 = 1_000_000;
const PAGE: usize = 2048;

type Flash = TestFlash<PAGE>;

/// A monitor, and the time.
struct Board {
    monitor: Monitor<Flash>,
    time_us: u64,
    sequence: u16,
}

fn blank() -> [Flash; 2] {
    [Flash::new(4, || 0), Flash::new(2, || 0)]
}

impl Board {
    fn start([slots, journal]: [Flash; 2]) -> (Self, Start) {
        let mut config = NodeConfig::new(NODE);
        config.key = Some(KEY);
        let place = Box::leak(Box::new(Place::new()));
        let (monitor, start) = Monitor::start(place, slots, journal, config).unwrap();
        let mut board = Self { monitor, time_us: 0, sequence: 0 };
        // It listens before it answers.
        for _ in 0..3 {
            board.pass(SECOND_US, true);
        }
        (board, start)
    }

    /// Off, with what it has stored.
    fn stop(self) -> [Flash; 2] {
        [self.monitor.slots.into_flash().restarted(), self.monitor.journal.into_flash().restarted()]
    }

    fn status(&self) -> Status {
        self.monitor.node.status(self.time_us)
    }

    fn pass(&mut self, us: u64, may_write: bool) {
        self.time_us += us;
        self.monitor.poll(self.time_us, may_write);
        while self.monitor.node.transmit().is_some() {}
    }

    /// So many readings, one a second.
    fn read(&mut self, reading: &Reading, count: usize) {
        for _ in 0..count {
            self.sequence = self.sequence.wrapping_add(1);
            for frame in
                &reading_frames(NODE, &NumberedReading::new(self.sequence, moved(reading, self.sequence)))
            {
                self.monitor.receive(self.time_us, frame, true);
            }
            self.pass(SECOND_US, true);
        }
    }

    /// Whether it answered, and how.
    fn command(&mut self, command: Command, counter: u64, body: &[u8], may_write: bool) -> Option<Outcome> {
        let mut request = [0; MAX_REQUEST_BYTES];
        let length = write_request(&mut request, &KEY, NODE, command, counter, body).unwrap();
        let mut host = IsoTp::<ANSWER_BYTES, MAX_REQUEST_BYTES>::new();
        host.send(self.time_us, &request[..length]).unwrap();
        while let Some(payload) = host.poll(self.time_us) {
            let frame = Frame::standard(frame_id(TYPE_TO_NODE, NODE), &payload).unwrap();
            self.monitor.receive(self.time_us, &frame, may_write);
            while let Some(frame) = self.monitor.node.transmit() {
                if frame.message_type() == TYPE_TO_HOST
                    && host.receive(self.time_us, frame.bytes()) == Progress::Complete
                {
                    let (answer, confirmed) = Answer::decode(host.message(), &request[..length], &KEY)?;
                    assert!(confirmed);
                    return Some(answer.outcome);
                }
            }
        }
        None
    }

    fn deploy(&mut self, counter: u64, model: &[u8]) -> Option<Outcome> {
        self.command(Command::Deploy, counter, model, true)
    }

    fn checksum(&self) -> Option<u32> {
        self.monitor.node.model().map(|model| model.checksum())
    }
}

/// The reading times a factor of 1 to 1.0001 that differs from number to number: measured readings do not repeat to the bit.
fn moved(reading: &Reading, number: u16) -> Reading {
    let factor = 1.0 + 1e-4 * (f32::from(number.wrapping_mul(40_503)) / f32::from(u16::MAX));
    let part =
        |probe: &ProbeVector| ProbeVector { cos_um: factor * probe.cos_um, sin_um: factor * probe.sin_um };
    let vectors: Vec<_> = reading.probes().iter().map(part).collect();
    Reading::new(reading.speed_rpm, &vectors).unwrap()
}

/// The record's first row.
fn reading() -> Reading {
    let (words, _) = READINGS[..36].as_chunks::<4>();
    let values: Vec<f32> = words.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let probes: Vec<_> =
        values[1..].chunks(2).map(|pair| ProbeVector { cos_um: pair[0], sin_um: pair[1] }).collect();
    Reading::new(values[0], &probes).unwrap()
}

/// One probe's vector five times as long and turned about: no unbalance does that.
fn faulty() -> Reading {
    let good = reading();
    let mut probes = good.probes().to_vec();
    probes[0] = ProbeVector { cos_um: -5.0 * probes[0].cos_um, sin_um: -5.0 * probes[0].sin_um };
    Reading::new(good.speed_rpm, &probes).unwrap()
}

/// A board with the model, past its learning.
fn tracking() -> Board {
    let (mut board, _) = Board::start(blank());
    assert_eq!(board.deploy(5, MODEL), Some(Outcome::Accepted));
    board.read(&reading(), 70);
    assert_eq!(board.status().state, NodeState::Tracking);
    board
}

#[test]
fn monitor_without_model_accepts_deployment_on_any_flash() {
    for fill in [0x00, 0xff, 0x55] {
        let (mut board, start) = Board::start([Flash::new(4, || fill), Flash::new(2, || fill)]);
        let lack = Err(Reason::NothingStored);
        assert_eq!(start, Start { counter: 0, model: lack, has_thresholds: false, is_remembered: false });
        board.read(&reading(), 5);
        let status = board.status();
        assert_eq!((status.state, status.reason), (NodeState::NoModel, Reason::NothingStored));
        assert_eq!(
            (board.monitor.node.counters().readings, board.monitor.node.estimate().is_none()),
            (0, true)
        );
        assert_eq!(board.deploy(5, MODEL), Some(Outcome::Accepted));
        assert_eq!(board.status().state, NodeState::Waiting);
    }
}

#[test]
fn model_counter_thresholds_and_memory_outlive_a_restart() {
    let mut board = tracking();
    let set = Thresholds { rise: 0.75, ..Thresholds::DEFAULT };
    assert_eq!(board.command(Command::SetThresholds, 6, &set.encode(), true), Some(Outcome::Accepted));
    let checksum = board.checksum();
    let (mut restarted, start) = Board::start(board.stop());
    assert_eq!(start, Start { counter: 6, model: Ok(()), has_thresholds: true, is_remembered: true });
    assert_eq!(restarted.checksum(), checksum);
    assert_eq!(restarted.monitor.node.thresholds(), &set);
    // It has learned already.
    restarted.read(&reading(), 2);
    assert_eq!(restarted.status().state, NodeState::Tracking);
    assert_eq!(restarted.deploy(6, BETTER), Some(Outcome::Replayed));
    assert_eq!(restarted.deploy(7, BETTER), Some(Outcome::Accepted));
    assert_eq!(restarted.monitor.node.thresholds(), &set);
}

#[test]
fn flag_is_raised_again_after_restart_until_acknowledged() {
    let mut board = tracking();
    board.read(&faulty(), 20);
    let before = board.status();
    assert_eq!(before.state, NodeState::Flagged);
    for _ in 0..3 {
        board = Board::start(board.stop()).0;
        let status = board.status();
        assert_eq!(
            (status.state, status.cause, status.suspect),
            (before.state, before.cause, before.suspect)
        );
    }
    assert_eq!(board.command(Command::Acknowledge, 6, &[], true), Some(Outcome::Accepted));
    let (board, start) = Board::start(board.stop());
    assert_eq!((start.counter, board.status().state), (6, NodeState::Waiting));
}

#[test]
fn low_supply_blocks_writes_and_preserves_state() {
    let mut board = tracking();
    board.read(&faulty(), 20);
    let checksum = board.checksum();
    let before = [board.monitor.slots.load().counter, board.monitor.journal.last().unwrap().counter];
    let set = Thresholds { rise: 0.75, ..Thresholds::DEFAULT }.encode();
    for (command, body) in [
        (Command::Deploy, BETTER),
        (Command::SetThresholds, &set),
        (Command::Acknowledge, &[]),
        (Command::Restart, &[]),
    ] {
        assert_eq!(board.command(command, 9, body, false), Some(Outcome::Storage), "{command:?}");
    }
    assert_eq!((board.checksum(), board.status().state), (checksum, NodeState::Flagged));
    assert_eq!(board.monitor.node.thresholds(), &Thresholds::DEFAULT);
    let after = [board.monitor.slots.load().counter, board.monitor.journal.last().unwrap().counter];
    assert_eq!(after, before);
    // The supply is back.
    assert_eq!(board.command(Command::Acknowledge, 9, &[], true), Some(Outcome::Accepted));
}

#[test]
fn damaged_model_keeps_counter_and_accepts_deployment() {
    let stored = tracking().stop();
    // The model is behind the slot's head of 32 bytes; its first byte is the schema's.
    for (place, flipped) in [(32, 1), (200, 1), (36, 0x80)] {
        let [mut slots, journal] = stored.clone();
        slots.bytes[place] ^= flipped;
        let (mut board, start) = Board::start([slots, journal]);
        assert_eq!((start.counter, start.model), (5, Err(Reason::Damaged)));
        assert_eq!((board.status().state, board.status().reason), (NodeState::NoModel, Reason::Damaged));
        assert_eq!(board.deploy(5, MODEL), Some(Outcome::Replayed));
        assert_eq!(board.deploy(6, MODEL), Some(Outcome::Accepted));
    }
    // Stored as it is, by a firmware of another schema.
    let mut other = MODEL.to_vec();
    other[0] ^= 3;
    let mut slots = Slots::new(Flash::new(4, || 0));
    slots.save(41, Change { model: Some(&other), thresholds: None }).unwrap();
    let (mut board, start) = Board::start([slots.into_flash(), Flash::new(2, || 0)]);
    assert_eq!((start.counter, start.model), (41, Err(Reason::Schema)));
    assert_eq!(board.deploy(42, MODEL), Some(Outcome::Accepted));
}

#[test]
fn the_counter_is_the_highest_of_slots_and_journal() {
    let mut board = tracking();
    for counter in 6..9 {
        assert_eq!(board.command(Command::Restart, counter, &[], true), Some(Outcome::Accepted));
    }
    let [slots, journal] = board.stop();
    assert_eq!(Board::start([slots.clone(), journal.clone()]).1.counter, 8);
    assert_eq!(Board::start([Flash::new(4, || 0), journal]).1.counter, 8);
    assert_eq!(Board::start([slots, Flash::new(2, || 0)]).1.counter, 5);
}

/// What happens between two restarts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    Deployment,
    Thresholds,
    Acknowledgement,
    Flag,
}

/// Each event with power cut at each write and erasure that it brings, in slots and journal alike.
#[test]
fn power_cut_keeps_flag_counter_and_old_or_new_state() {
    let flagged = {
        let mut board = tracking();
        board.read(&faulty(), 20);
        board.stop()
    };
    let quiet = tracking().stop();
    let set = Thresholds { rise: 0.75, ..Thresholds::DEFAULT }.encode();
    for (event, before) in [
        (Event::Deployment, &flagged),
        (Event::Thresholds, &flagged),
        (Event::Acknowledgement, &flagged),
        (Event::Flag, &quiet),
    ] {
        let known = |board: &Board| {
            let is_flagged = board.status().state == NodeState::Flagged;
            (board.checksum(), *board.monitor.node.thresholds(), is_flagged)
        };
        let mut cuts = 0;
        for power in (1..300).map(|n| [n, usize::MAX]).chain((1..60).map(|n| [usize::MAX, n])) {
            let [slots, journal] = before.clone();
            let (mut board, _) =
                Board::start([Flash { power: power[0], ..slots }, Flash { power: power[1], ..journal }]);
            let old = known(&board);
            let is_done = match event {
                Event::Deployment => board.deploy(6, BETTER) == Some(Outcome::Accepted),
                Event::Thresholds => {
                    board.command(Command::SetThresholds, 6, &set, true) == Some(Outcome::Accepted)
                }
                Event::Acknowledgement => {
                    board.command(Command::Acknowledge, 6, &[], true) == Some(Outcome::Accepted)
                }
                Event::Flag => {
                    board.read(&faulty(), 20);
                    board.monitor.node.counters().unsaved == 0
                }
            };
            let new = known(&board);
            let (restarted, start) = Board::start(board.stop());
            let now = known(&restarted);
            assert_eq!(start.model, Ok(()), "{event:?} {power:?}");
            if is_done {
                assert_eq!(now, new, "{event:?} {power:?}");
            } else {
                cuts += 1;
            }
            if event != Event::Flag {
                // What takes effect uses its counter up, though its answer may be lost with the power.
                assert!(start.counter == 6 || (!is_done && now == old), "{event:?} {power:?} {start:?}");
                assert!(start.counter >= 5, "{event:?} {power:?} {start:?}");
            }
        }
        assert!(cuts >= 15, "{event:?}: {cuts} cuts");
    }
}

#[test]
fn trial_model_is_never_stored_but_counter_and_baseline_are() {
    let mut board = tracking();
    let before = board.checksum();
    let body = [&60_u32.to_le_bytes()[..], BETTER].concat();
    assert_eq!(board.command(Command::Trial, 6, &body, true), Some(Outcome::Accepted));
    assert_ne!(board.checksum(), before);
    board.read(&reading(), 59);
    assert!(!board.monitor.node.is_trial_over(board.time_us));
    board.read(&reading(), 1);
    assert!(board.monitor.node.is_trial_over(board.time_us));
    let (mut again, start) = Board::start(board.stop());
    assert_eq!(start, Start { counter: 6, model: Ok(()), has_thresholds: false, is_remembered: true });
    assert_eq!(again.checksum(), before);
    assert_eq!(again.command(Command::Trial, 6, &body, true), Some(Outcome::Replayed));

    assert_eq!(again.command(Command::Trial, 7, &body, true), Some(Outcome::Accepted));
    assert_eq!(again.deploy(8, BETTER), Some(Outcome::Accepted));
    let (confirmed, start) = Board::start(again.stop());
    assert_eq!((start.counter, start.model), (8, Ok(())));
    assert_ne!(confirmed.checksum(), before);
}

#[test]
fn nonce_outlives_counters_and_memories_stored_after_it() {
    let [slots, journal] = blank();
    let (mut slots, mut journal) = (Slots::new(slots), Journal::new(journal));
    let last = |journal: &Journal<Flash>| {
        let record = journal.last().unwrap();
        (record.counter, record.nonce, record.memory.to_vec())
    };
    let memory = [7; 60].into_iter().collect();
    keep(&mut slots, &mut journal, &Save::Memory(memory), 3).unwrap();
    assert_eq!(last(&journal), (3, 0, std::vec![7; 60]));
    keep(&mut slots, &mut journal, &Save::Nonce(1 << 40), 3).unwrap();
    assert_eq!(last(&journal), (3, 1 << 40, std::vec![7; 60]));
    let counter = Save::Command { counter: 4, model: None, thresholds: None };
    keep(&mut slots, &mut journal, &counter, 3).unwrap();
    assert_eq!(last(&journal), (4, 1 << 40, std::vec![7; 60]));
    keep(&mut slots, &mut journal, &Save::Memory([8; 9].into_iter().collect()), 4).unwrap();
    assert_eq!(last(&journal), (4, 1 << 40, std::vec![8; 9]));
}

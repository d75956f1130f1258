//! A day of the node in simulated time, on a bad bus: every reading is accounted for, every answer is the one that the
//! core gives without a bus, and memory does not creep.
//!
//! A reading every four seconds, one in eight with a fault; every six hours the sender starts anew; every hour a
//! deployment, in turn as it should be, with a foreign key, sent twice, and cut short.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro128PlusPlus;
use rotor_edge_boards::monitor::{BoardModel, ModelCell, Monitor, OWN_MODEL, Place, decode};
use rotor_edge_core::can::isotp::IsoTp;
use rotor_edge_core::can::{
    Frame, MonitorResult, NumberedReading, READING_FRAMES, RESYNCHRONISE_AFTER, ResultAssembler,
    TYPE_TO_HOST, TYPE_TO_NODE, frame_id, reading_frames,
};
use rotor_edge_core::command::{
    ANSWER_BYTES, Answer, Command, KEY_BYTES, Key, MAX_REQUEST_BYTES, Outcome, write_request,
};
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::track::{TrackConfig, Tracker};
use rotor_edge_mps2_an386::sample::{BETTER, KEY, NUMBER};
use rotor_edge_mps2_an386::state::StateMemory;
use rotor_edge_mps2_an386::{sample, stack};
use static_cell::StaticCell;

const DAY_S: u64 = 86_400;
const PERIOD_S: u64 = 4;
const HOUR_S: u64 = 3_600;
/// The sender starts anew this often.
const RESTART_S: u64 = 6 * HOUR_S;
/// After this every kind of event has happened, and the stack must not grow any further.
const SETTLED_S: u64 = 8 * HOUR_S;
const SECOND_US: u64 = 1_000_000;
const SEED: u64 = 20_261_121;
const FOREIGN_KEY: Key = Key([0xa5; KEY_BYTES]);

static PLACE: Place = Place::new();
static FIRST: ModelCell = ModelCell::new();
static SECOND: ModelCell = ModelCell::new();
static REQUEST: StaticCell<[u8; MAX_REQUEST_BYTES]> = StaticCell::new();
static LINK: StaticCell<IsoTp<ANSWER_BYTES, MAX_REQUEST_BYTES>> = StaticCell::new();

/// What happens to a reading on its way.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    FrameLost,
    BitFlipped,
    FramesTwice,
    FramesSwapped,
    ProbeLost,
    Absurd,
    Missing,
    ReadingTwice,
}

impl Fault {
    const ALL: [Self; 8] = [
        Self::FrameLost,
        Self::BitFlipped,
        Self::FramesTwice,
        Self::FramesSwapped,
        Self::ProbeLost,
        Self::Absurd,
        Self::Missing,
        Self::ReadingTwice,
    ];
    /// One reading in so many has each of the faults.
    const RARITY: usize = 64;
}

/// What the node's counters must come to.
#[derive(Debug, Default, PartialEq)]
struct Tally {
    readings: u16,
    skipped: u16,
    lost: u16,
    resynchronised: u16,
    accepted: u16,
    forged: u16,
    replayed: u16,
    broken: u16,
    refused: u16,
    overflowed: u16,
    unsolved: u16,
}

/// The other end of the bus, and what it expects.
struct Host {
    monitor: Monitor<StateMemory>,
    random: Xoshiro128PlusPlus,
    results: ResultAssembler,
    answer: Option<MonitorResult>,
    models: [&'static BoardModel; 2],
    tracker: Tracker,
    better: bool,
    sequence: u16,
    restarted: u8,
    expected: Tally,
    sent: u32,
    absurd: u32,
    late: u32,
    request: &'static mut [u8; MAX_REQUEST_BYTES],
    link: &'static mut IsoTp<ANSWER_BYTES, MAX_REQUEST_BYTES>,
}

#[entry]
fn main() -> ! {
    stack::paint();
    let (Ok(first), Ok(second)) = (decode(&FIRST, OWN_MODEL), decode(&SECOND, BETTER)) else {
        panic!("the sample's models are refused")
    };
    // SAFETY: once, here.
    let (flash, _journal) = unsafe { StateMemory::take() };
    let Ok((monitor, _)) = Monitor::start(&PLACE, flash, sample::config()) else {
        panic!("the node does not start")
    };
    let mut host = Host {
        monitor,
        random: Xoshiro128PlusPlus::seed_from_u64(SEED),
        results: ResultAssembler::new(),
        answer: None,
        models: [first, second],
        tracker: Tracker::new(first),
        better: false,
        sequence: 0,
        restarted: 0,
        expected: Tally::default(),
        sent: 0,
        absurd: 0,
        late: 0,
        request: REQUEST.init_with(|| [0; MAX_REQUEST_BYTES]),
        link: LINK.init_with(IsoTp::new),
    };
    let mut settled_bytes = 0;
    let mut record = sample::readings().filter(Reading::is_complete).cycle();
    // The node listens before it answers.
    host.poll(0);
    host.poll(SECOND_US);
    for second in (PERIOD_S..=DAY_S).step_by(PERIOD_S as usize) {
        let time_us = second * SECOND_US;
        let Some(reading) = record.next() else { panic!("no record") };
        // The last reading arrives, so that no gap stays unseen.
        host.play(time_us, &reading, second % RESTART_S == 0 && second < DAY_S, second == DAY_S);
        for tenth in 1..10 * PERIOD_S {
            host.poll(time_us + tenth * SECOND_US / 10);
        }
        if second % HOUR_S == HOUR_S / 2 {
            host.deploy(time_us + PERIOD_S * SECOND_US - 1, second / HOUR_S);
        }
        if second == SETTLED_S {
            settled_bytes = stack::high_water_bytes();
        }
    }
    host.check();
    assert_eq!(stack::high_water_bytes(), settled_bytes, "the stack grew after hour {}", SETTLED_S / HOUR_S);
    hprintln!("stack {} of {} bytes", settled_bytes, stack::size_bytes());
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}

impl Host {
    fn poll(&mut self, time_us: u64) {
        self.monitor.node.poll(time_us);
        self.hear(time_us);
    }

    /// Takes everything that the node sends.
    fn hear(&mut self, time_us: u64) {
        while let Some(frame) = self.monitor.node.transmit() {
            if frame.message_type() == TYPE_TO_HOST {
                self.link.receive(time_us, frame.bytes());
            }
            if let Some(result) = self.results.receive(&frame) {
                assert!(self.answer.replace(result).is_none(), "two answers to one reading");
            }
        }
    }

    fn send(&mut self, time_us: u64, frame: &Frame) {
        self.monitor.receive(time_us, frame, true);
        self.hear(time_us);
    }

    fn below(&mut self, end: usize) -> usize {
        self.random.next_u32() as usize % end
    }

    /// Plays one reading with or without a fault and checks what comes of it.
    #[inline(never)]
    fn play(&mut self, time_us: u64, reading: &Reading, restart: bool, last: bool) {
        self.sequence = if restart { 0 } else { self.sequence.wrapping_add(1) };
        if restart {
            self.restarted = RESYNCHRONISE_AFTER;
        }
        let drawn = self.below(Fault::RARITY);
        let fault = match Fault::ALL.get(drawn) {
            Some(&fault) if self.restarted == 0 && !last => fault,
            _ => Fault::None,
        };
        let mut reading = *reading;
        if fault == Fault::ProbeLost {
            reading.probes[self.below(4)] = ProbeVector::LOST;
        }
        if fault == Fault::Absurd {
            reading.probes[self.below(4)].cos_um = 1e6;
        }
        let arrives = self.transmit(time_us, fault, &reading);
        self.sent += 1;
        self.expect(fault, arrives, &reading);
    }

    /// Sends the frames; whether a whole reading arrives.
    #[inline(never)]
    fn transmit(&mut self, time_us: u64, fault: Fault, reading: &Reading) -> bool {
        let numbered = NumberedReading::new(self.sequence, *reading);
        let mut frames = reading_frames(NUMBER, &numbered);
        let victim = self.below(READING_FRAMES);
        let mut arrives = true;
        match fault {
            Fault::Missing => return false,
            Fault::FrameLost => {
                frames.remove(victim);
                arrives = false;
            }
            Fault::BitFlipped => {
                let bit = self.below(64);
                let mut bytes = [0; 8];
                bytes.copy_from_slice(frames[victim].bytes());
                bytes[bit / 8] ^= 1 << (bit % 8);
                let Some(flipped) = Frame::standard(frames[victim].raw_id(), &bytes) else { unreachable!() };
                frames[victim] = flipped;
                // The end says how many vectors there were and has a spare byte; nothing hangs on them.
                arrives = victim == READING_FRAMES - 1 && (2..4).contains(&(bit / 8));
            }
            Fault::FramesSwapped => frames.swap(1 + victim % 4, 1 + self.below(4)),
            _ => {}
        }
        let copies = if fault == Fault::FramesTwice { 2 } else { 1 };
        let rounds = if fault == Fault::ReadingTwice { 2 } else { 1 };
        for _ in 0..rounds {
            for frame in &frames {
                for _ in 0..copies {
                    self.send(time_us, frame);
                }
            }
        }
        arrives
    }

    /// Counts what the node must have counted, and compares its answer with what the core finds without a bus.
    #[inline(never)]
    fn expect(&mut self, fault: Fault, arrives: bool, reading: &Reading) {
        let answer = self.answer.take();
        let followed = self.restarted <= 1;
        if self.restarted > 0 {
            self.restarted -= 1;
            self.expected.resynchronised += u16::from(followed);
        }
        let evaluated = match fault {
            _ if !followed => {
                self.late += 1;
                false
            }
            _ if !arrives => {
                self.expected.lost += 1;
                false
            }
            Fault::ProbeLost => {
                self.expected.skipped += 1;
                false
            }
            Fault::Absurd => {
                self.absurd += 1;
                false
            }
            _ => true,
        };
        assert_eq!(answer.is_some(), evaluated, "reading {}", self.sent);
        let Some(answer) = answer else { return };
        self.expected.readings += 1;
        assert_eq!(answer.sequence, self.sequence);
        let model = self.models[usize::from(self.better)];
        let Ok(estimate) = self.tracker.update(&TrackConfig::default(), model, reading) else {
            panic!("reading {} has no estimate", self.sent)
        };
        assert_eq!(answer.unbalance_g_mm, estimate.unbalance_g_mm, "reading {}", self.sent);
        assert_eq!((answer.e_um, answer.ratio), (estimate.residual.e_um, estimate.residual.ratio));
    }

    /// Sends the model that is not in use, in one of four ways.
    #[inline(never)]
    fn deploy(&mut self, time_us: u64, hour: u64) {
        let (body, key) = match hour % 4 {
            1 => (self.other(), FOREIGN_KEY),
            _ => (self.other(), KEY),
        };
        let counter = 1 + hour;
        let Some(length) = write_request(self.request, &key, NUMBER, Command::Deploy, counter, body) else {
            panic!("no room for the request")
        };
        match hour % 4 {
            1 => {
                assert_eq!(self.transfer(time_us, length, None), Some(Outcome::Forged));
                self.expected.forged += 1;
            }
            3 => {
                let cut = 2 + self.below(60);
                assert_eq!(self.transfer(time_us, length, Some(cut)), None);
                self.expected.broken += 1;
            }
            way => {
                assert_eq!(self.transfer(time_us, length, None), Some(Outcome::Accepted));
                self.expected.accepted += 1;
                self.better = !self.better;
                self.tracker.forget_amplitudes();
                let model = self.models[usize::from(self.better)];
                assert_eq!(self.monitor.node.model().checksum(), model.checksum());
                if way == 2 {
                    assert_eq!(self.transfer(time_us, length, None), Some(Outcome::Replayed));
                    self.expected.replayed += 1;
                }
            }
        }
    }

    fn other(&self) -> &'static [u8] {
        if self.better { OWN_MODEL } else { BETTER }
    }

    /// Sends the request; without the host's frame number `lost`, if any. What became of it.
    fn transfer(&mut self, time_us: u64, length: usize, lost: Option<usize>) -> Option<Outcome> {
        *self.link = IsoTp::new();
        assert!(self.link.send(time_us, &self.request[..length]).is_ok());
        let id = frame_id(TYPE_TO_NODE, NUMBER);
        let mut number = 0;
        while let Some(payload) = self.link.poll(time_us) {
            number += 1;
            if lost == Some(number) {
                continue;
            }
            let Some(frame) = Frame::standard(id, &payload) else { unreachable!() };
            self.send(time_us, &frame);
        }
        let (answer, confirmed) = Answer::decode(self.link.message(), &self.request[..length], &KEY)?;
        assert!(confirmed, "an answer that the node did not sign");
        Some(answer.outcome)
    }

    #[inline(never)]
    fn check(&self) {
        let c = self.monitor.node.counters();
        let counted = Tally {
            readings: c.readings,
            skipped: c.skipped,
            lost: c.lost,
            resynchronised: c.resynchronised,
            accepted: c.accepted,
            forged: c.forged,
            replayed: c.replayed,
            broken: c.broken,
            refused: c.refused,
            overflowed: c.overflowed,
            unsolved: c.unsolved,
        };
        assert_eq!(counted, self.expected);
        let Tally { readings, skipped, lost, .. } = counted;
        let told = u32::from(readings) + u32::from(skipped) + u32::from(lost) + self.absurd + self.late;
        assert_eq!(told, self.sent, "readings unaccounted for");
        hprintln!(
            "24 hours, {} readings sent: {} evaluated, {} lost, {} without a probe, {} absurd, {} while the sender's restart was not yet believed",
            self.sent,
            readings,
            lost,
            skipped,
            self.absurd,
            self.late
        );
        hprintln!(
            "deployments: {} accepted, {} forged, {} replayed, {} broken off",
            c.accepted,
            c.forged,
            c.replayed,
            c.broken
        );
    }
}

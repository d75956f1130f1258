//! A host, monitors and disturbers on one simulated bus, and a referee who knows what every result should be.

use std::collections::HashMap;

use rotor_edge::bus::{BusConfig, Port, VirtualBus, counters};
use rotor_edge::edge::{EdgeModel, encoded};
use rotor_edge::node::{Controller, Store};
use rotor_edge_core::can::{
    Counters, Frame, Message, MonitorResult, NumberedReading, ResultAssembler, reading_frames,
};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::Reading;

pub const NODE: u8 = 1;
pub const PERIOD_US: u64 = 100_000;
pub const HOST: Port = 0;
pub const MONITOR: Port = 1;
pub const OTHER: Port = 2;

/// What a scene saw.
#[derive(Debug, Default)]
pub struct Outcome {
    pub readings: usize,
    pub evaluated: usize,
    pub results: usize,
    /// Results that are not, to the bit, what the core makes of the readings sent under these numbers.
    pub wrong: usize,
    /// Copies of frames that were lost, late, repeated or damaged.
    pub disturbed: u64,
    /// Those of them that were lost, repeated or damaged.
    pub faulty: u64,
    /// What monitor and host counted; that a reading stays without an answer the host sees as well.
    pub noticed: u64,
}

/// The monitor under test, and a referee without a bus that gets the readings as they were sent.
pub struct Watched {
    pub controller: Controller,
    referee: Referee,
    config: NodeConfig,
    sent: HashMap<u16, Reading>,
    expected: HashMap<u16, MonitorResult>,
    /// Of lives before the present one.
    past: Counters,
}

/// The same core with nothing between it and the host.
struct Referee {
    controller: Controller,
    results: ResultAssembler,
    sequence: u16,
}

fn started(config: NodeConfig, model: &EdgeModel) -> Controller {
    let store = Store::in_memory().with_initial_model(encoded(model).unwrap());
    Controller::start(config, store, 0).unwrap()
}

/// It never has to listen, and nobody else is there.
fn of_referee(config: NodeConfig) -> NodeConfig {
    let mut config = config;
    config.listen_us = 0;
    config
}

impl Referee {
    fn judge(&mut self, time_us: u64, reading: Reading) -> MonitorResult {
        while self.controller.poll_next(time_us).is_some() {
            while self.controller.transmit().is_some() {}
        }
        self.sequence = self.sequence.wrapping_add(1);
        for frame in reading_frames(NODE, &NumberedReading::new(self.sequence, reading)) {
            self.controller.receive(time_us, &frame);
        }
        let frames = std::iter::from_fn(|| self.controller.transmit());
        frames.filter_map(|frame| self.results.receive(&frame)).last().expect("the referee answers")
    }
}

impl Watched {
    pub fn new(model: &EdgeModel) -> Self {
        let config = NodeConfig::new(NODE);
        let referee = Referee {
            controller: started(of_referee(config), model),
            results: ResultAssembler::new(),
            sequence: 0,
        };
        Self {
            controller: started(config, model),
            referee,
            config,
            sent: HashMap::new(),
            expected: HashMap::new(),
            past: Counters::default(),
        }
    }

    /// Loses its power and comes back with what it had stored.
    pub fn restart(&mut self, time_us: u64) {
        self.past = self.counters();
        self.controller.cut_power(self.config, time_us).unwrap();
        self.referee.controller.cut_power(of_referee(self.config), time_us).unwrap();
    }

    pub fn sends(&mut self, sequence: u16, reading: Reading) {
        self.sent.insert(sequence, reading);
    }

    /// Lets it do what is due.
    pub fn poll(&mut self, time_us: u64) {
        while self.controller.poll_next(time_us).is_some() {}
    }

    /// Hands a frame to the monitor; if that completed a reading, the referee judges the one that was sent under its number.
    pub fn receive(&mut self, time_us: u64, frame: &Frame) {
        let before = self.controller.node().counters().readings;
        self.controller.receive(time_us, frame);
        if self.controller.node().counters().readings == before {
            return;
        }
        let Ok((_, Message::ReadingEnd { sequence, .. })) = Message::decode(frame) else {
            panic!("only the end of a reading completes one");
        };
        // a reading under a number that was never sent has no right result
        let Some(reading) = self.sent.get(&sequence) else { return };
        let expected = MonitorResult { sequence, ..self.referee.judge(time_us, *reading) };
        self.expected.insert(sequence, expected);
    }

    /// Every number the same, to the bit.
    pub fn is_right(&self, result: &MonitorResult) -> bool {
        self.expected.get(&result.sequence) == Some(result)
    }

    pub fn counters(&self) -> Counters {
        counters::sum(&self.past, &self.controller.node().counters())
    }
}

/// What else happens on the bus in each period; `time_us` is its beginning.
pub trait Disturbance {
    fn act(&mut self, _bus: &mut VirtualBus, _watched: &mut Watched, _row: usize, _time_us: u64) {}
    /// Frames for the third participant.
    fn hear(&mut self, _bus: &mut VirtualBus, _time_us: u64, _frame: &Frame) {}
}

/// Nothing but what the bus does by itself.
pub struct Quiet;
impl Disturbance for Quiet {}

/// Plays all readings; the host sends each in its period whether or not the last one was answered.
pub fn play(
    model: &EdgeModel,
    readings: &[Reading],
    config: BusConfig,
    disturbance: &mut dyn Disturbance,
) -> Outcome {
    let mut bus = VirtualBus::new(config, 3);
    let mut watched = Watched::new(model);
    let mut results = ResultAssembler::new();
    let mut outcome = Outcome { readings: readings.len(), ..Outcome::default() };
    for (row, reading) in readings.iter().enumerate() {
        let begins_us = watched_from() + PERIOD_US * row as u64;
        bus.wait_until(begins_us);
        disturbance.act(&mut bus, &mut watched, row, begins_us);
        watched.sends(row as u16, *reading);
        for frame in reading_frames(NODE, &NumberedReading::new(row as u16, *reading)) {
            bus.send(HOST, frame);
        }
        let until_us = begins_us + PERIOD_US;
        loop {
            let moved = bus.transmit_one().is_some();
            if !moved {
                bus.wait_until(until_us);
            }
            while let Some((time_us, frame)) = bus.receive(MONITOR) {
                watched.receive(time_us, &frame);
            }
            watched.poll(bus.now_us());
            let mut answered = false;
            while let Some(frame) = watched.controller.transmit() {
                bus.send(MONITOR, frame);
                answered = true;
            }
            while let Some((time_us, frame)) = bus.receive(OTHER) {
                disturbance.hear(&mut bus, time_us, &frame);
            }
            while let Some((_, frame)) = bus.receive(HOST) {
                if let Some(result) = results.receive(&frame) {
                    outcome.results += 1;
                    outcome.wrong += usize::from(!watched.is_right(&result));
                }
            }
            if bus.now_us() >= until_us || (!moved && !answered) {
                break;
            }
        }
    }
    let c = watched.counters();
    outcome.evaluated = c.readings as usize;
    let noticed = [c.rejected, c.repeated, c.late, c.incomplete, c.stray, c.skipped, c.lost, c.conflicts];
    outcome.noticed = noticed.into_iter().map(u64::from).sum();
    outcome.noticed += u64::from(results.damaged());
    let traffic = bus.traffic();
    outcome.faulty = traffic.lost + traffic.repeated + traffic.damaged;
    outcome.disturbed = outcome.faulty + traffic.late;
    outcome
}

/// When the monitor has listened long enough to answer.
fn watched_from() -> u64 {
    NodeConfig::new(NODE).listen_us
}

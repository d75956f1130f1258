//! The monitor under test: a controller in simulated time that gets readings as frames and answers in frames.

use nalgebra::DVector;
use rotor_edge::edge::{Deployment, encoded};
use rotor_edge::node::{Controller, Store};
use rotor_edge_core::can::{Keyphasor, MonitorResult, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::state::{NodeState, Reason, Status};
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::unbalance::G_MM;

use super::fault::Measured;
use super::machine::C;

const NODE: u8 = 1;
/// Readings missing in a row that make the evidence too old, where the default would not hold one.
const AGE_LIMIT_PERIODS: f64 = 3.0;
/// Heartbeats are as rare as in a replay, or a scenario of months is nothing but heartbeats.
const HEARTBEAT_PERIODS: f64 = 10.0;
/// The monitor starts so long before the first reading, s.
const LEAD_S: f64 = 1.0;

/// How often readings come, and how many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    pub name: &'static str,
    pub period_s: f64,
    /// Healthy readings before a fault: the reference is taken within them.
    pub healthy: usize,
    /// Readings under a fault.
    pub faulty: usize,
}

impl Pace {
    pub const ALL: [Self; 5] = [
        Self { name: "10/s", period_s: 0.1, healthy: 800, faulty: 600 },
        Self { name: "1/s", period_s: 1.0, healthy: 120, faulty: 180 },
        Self { name: "1/min", period_s: 60.0, healthy: 80, faulty: 90 },
        Self { name: "1/h", period_s: 3_600.0, healthy: 80, faulty: 72 },
        Self { name: "1/d", period_s: 86_400.0, healthy: 60, faulty: 45 },
    ];

    /// What a user of this pace sets: the defaults, and an age limit of three readings at least.
    pub fn thresholds(self) -> Thresholds {
        let usual = Thresholds::DEFAULT;
        let age_limit_s = usual.age_limit_s.max((AGE_LIMIT_PERIODS * self.period_s) as f32);
        Thresholds { age_limit_s, ..usual }
    }

    pub fn age_limit_s(self) -> f64 {
        f64::from(self.thresholds().age_limit_s)
    }
}

/// A monitor, and the host that hears it.
pub struct Monitor<'a> {
    controller: Controller,
    config: NodeConfig,
    deployment: &'a Deployment,
    results: ResultAssembler,
    told: Option<MonitorResult>,
    sequence: u16,
    /// When it was last switched on, by the scenario's clock, s.
    since_s: f64,
}

impl<'a> Monitor<'a> {
    pub fn new(deployment: &'a Deployment, pace: Pace) -> Self {
        let usual = NodeConfig::new(NODE);
        let heartbeat_us = (HEARTBEAT_PERIODS * pace.period_s * 1e6) as u64;
        let mut config = usual;
        config.thresholds = pace.thresholds();
        config.heartbeat_period_us = usual.heartbeat_period_us.max(heartbeat_us);
        let store = Store::in_memory().with_initial_model(encoded(&deployment.edge).unwrap());
        Self {
            controller: Controller::start(config, store, 0).unwrap(),
            config,
            deployment,
            results: ResultAssembler::new(),
            told: None,
            sequence: 0,
            since_s: -LEAD_S,
        }
    }

    /// Loses its power at a time and is there again just before another: with its memory, and a clock that begins anew.
    pub fn cut_power(&mut self, back_s: f64) {
        self.controller.cut_power(self.config, 0).unwrap();
        self.since_s = back_s - LEAD_S;
    }

    fn clock_us(&self, time_s: f64) -> u64 {
        ((time_s - self.since_s) * 1e6).round() as u64
    }

    fn hear(&mut self) {
        while let Some(frame) = self.controller.transmit() {
            self.told = self.results.receive(&frame).or(self.told);
        }
    }

    /// Lets it do what is due.
    pub fn poll(&mut self, time_s: f64) {
        let now_us = self.clock_us(time_s);
        while self.controller.poll_next(now_us).is_some() {
            self.hear();
        }
    }

    pub fn take(&mut self, time_s: f64, measured: &Measured) {
        let measured = measurement::Reading {
            speed_rpm: measured.speed_rpm,
            probes: measured.probes.clone(),
            ..measurement::Reading::default()
        };
        let reading = self.deployment.reading(&measured);
        self.send(time_s, Keyphasor::Locked, reading);
    }

    /// A reading of a machine that stands still: no mark, no speed, no vectors.
    pub fn take_standstill(&mut self, time_s: f64) {
        let lost = vec![ProbeVector::LOST; self.deployment.edge.description().probes.len()];
        self.send(time_s, Keyphasor::Missing, Reading::new(f32::NAN, &lost).unwrap());
    }

    fn send(&mut self, time_s: f64, keyphasor: Keyphasor, reading: Reading) {
        self.poll(time_s);
        self.sequence = self.sequence.wrapping_add(1);
        let numbered = NumberedReading { sequence: self.sequence, keyphasor, reading };
        let now_us = self.clock_us(time_s);
        for frame in reading_frames(NODE, &numbered) {
            self.controller.receive(now_us, &frame);
        }
        self.hear();
    }

    pub fn status(&self, time_s: f64) -> Status {
        self.controller.node().status(self.clock_us(time_s))
    }

    /// The unbalance last told, kg·m.
    pub fn unbalance_kg_m(&self) -> Option<DVector<C>> {
        let told = self.told?;
        let planes = told.unbalance_g_mm.iter().take(usize::from(told.planes));
        let phasor = |[cos, sin]: &[f32; 2]| C::new(f64::from(*cos), f64::from(*sin)) / G_MM;
        Some(DVector::from_iterator(usize::from(told.planes), planes.map(phasor)))
    }
}

/// The user is told that the model describes the machine and that nothing is the matter.
pub fn claims_health(status: &Status) -> bool {
    match status.state {
        NodeState::Tracking => status.reason == Reason::None,
        // a reference that is taken from what is wrong is a claim as well
        NodeState::Learning => true,
        _ => false,
    }
}

//! A monitor without a bus: a reading in, what it answers and says of itself out.

use anyhow::{Result, bail};
use rotor_edge_core::can::{MonitorResult, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::Reading;
use rotor_edge_core::state::Status;

use super::{Controller, Store};
use crate::edge::{EdgeModel, encoded};

/// A heartbeat that nobody hears comes so seldom, µs: a hundred years.
const NO_HEARTBEAT_US: u64 = 100 * 365 * 86_400 * 1_000_000;

/// A monitor and its clock.
pub struct Bench {
    controller: Controller,
    config: NodeConfig,
    results: ResultAssembler,
    readings: u16,
    time_us: u64,
}

impl Bench {
    /// A monitor that remembers nothing and has listened long enough to answer, with a deployed model; its time is zero.
    ///
    /// # Errors
    /// If it refuses the settings or the model.
    pub fn new(model: &EdgeModel, config: NodeConfig) -> Result<Self> {
        let mut config = config;
        config.heartbeat_period_us = NO_HEARTBEAT_US;
        let controller =
            Controller::start(config, Store::in_memory().with_initial_model(encoded(model)?), 0)?;
        if let Some(reason) = controller.lacks_model() {
            bail!("the controller refuses the model: {reason:?}");
        }
        let mut bench = Self { controller, config, results: ResultAssembler::new(), readings: 0, time_us: 0 };
        bench.wait(0);
        Ok(bench)
    }

    /// Time of the last reading, or until which it waited, µs.
    pub fn time_us(&self) -> u64 {
        self.time_us
    }

    /// What it says of itself when no reading has come until a time; an earlier time than before is the time before.
    pub fn wait(&mut self, time_us: u64) -> Status {
        self.time_us = self.time_us.max(time_us);
        while self.controller.poll_next(self.now_us()).is_some() {
            self.hear();
        }
        self.controller.node().status(self.now_us())
    }

    /// What it answers to a reading, nothing if it cannot judge it, and what it then says of itself.
    pub fn read(&mut self, time_us: u64, reading: &Reading) -> (Option<MonitorResult>, Status) {
        self.wait(time_us);
        let numbered = NumberedReading::new(self.readings, *reading);
        self.readings = self.readings.wrapping_add(1);
        let mut result = None;
        for frame in reading_frames(self.config.node, &numbered) {
            self.controller.receive(self.now_us(), &frame);
            result = self.hear().or(result);
        }
        (result, self.controller.node().status(self.now_us()))
    }

    /// By the controller's own clock, which began when it started to listen.
    fn now_us(&self) -> u64 {
        self.config.listen_us.saturating_add(self.time_us)
    }

    fn hear(&mut self) -> Option<MonitorResult> {
        let mut heard = None;
        while let Some(frame) = self.controller.transmit() {
            heard = self.results.receive(&frame).or(heard);
        }
        heard
    }
}

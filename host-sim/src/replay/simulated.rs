//! The record in simulated time: host and controller on the virtual bus.

use anyhow::{Result, bail};
use rotor_edge_core::can::{Counters, Frame, Message, NumberedReading, ResultAssembler, reading_frames};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_desktop::measurement::Reading;

use super::timing::{Timing, settings};
use super::{AnsweredReading, Replay, ReplayConfig, changes, row_of};
use crate::bus::states::States;
use crate::bus::{VirtualBus, counters};
use crate::edge::{Deployment, encoded};
use crate::node::{Controller, Store};

const HOST: usize = 0;
const MONITOR: usize = 1;
/// How long the end waits for frames that are late.
const SETTLING_US: u64 = 100_000;

/// Both ends of the bus.
struct Scene<'a, F> {
    config: &'a ReplayConfig,
    node: NodeConfig,
    bus: VirtualBus,
    controller: Controller,
    /// Counted in lives before the present one.
    past: Counters,
    results: ResultAssembler,
    answers: Vec<AnsweredReading>,
    states: States,
    overhear: F,
}

pub fn play<F: FnMut(u64, &Frame) -> Result<()>>(
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    mut progress: impl FnMut(usize),
    overhear: F,
) -> Result<Replay> {
    let timing = Timing::of(deployment, record, config);
    let node = settings(config, record);
    let store = Store::in_memory().with_initial_model(encoded(&deployment.edge)?);
    let controller = Controller::start(node, store, 0)?;
    if controller.node().model().is_none() {
        bail!("the controller refuses the model: {:?}", controller.node().status(0).reason);
    }
    let mut scene = Scene {
        config,
        node,
        bus: VirtualBus::new(config.bus, 2),
        controller,
        past: Counters::default(),
        results: ResultAssembler::new(),
        answers: Vec::with_capacity(record.len()),
        states: States::default(),
        overhear,
    };
    let mut cuts: Vec<u64> = config.power_cuts_d.iter().map(|day| timing.at(*day)).collect();
    cuts.sort_unstable();
    let mut cuts = cuts.into_iter().peekable();
    for (row, measured) in record.iter().enumerate() {
        while let Some(cut_us) = cuts.next_if(|cut_us| *cut_us <= timing.sent_us(row)) {
            scene.cut_power(cut_us, row)?;
        }
        scene.idle_until(timing.sent_us(row), row)?;
        let numbered = NumberedReading::new(row as u16, deployment.reading(measured));
        for frame in reading_frames(node.node, &numbered) {
            scene.bus.send(HOST, frame);
        }
        scene.exchange(timing.judged_us(row), row)?;
        progress(row);
    }
    if let Some(last) = record.len().checked_sub(1) {
        scene.idle_until(timing.sent_us(last).saturating_add(SETTLING_US), last)?;
    }
    Ok(Replay {
        answers: scene.answers,
        states: changes(&scene.states, &timing),
        traffic: scene.bus.traffic(),
        counters: counters::sum(&scene.past, &scene.controller.node().counters()),
    })
}

impl<F: FnMut(u64, &Frame) -> Result<()>> Scene<'_, F> {
    /// Loses all but what is stored, just so long before a time that the controller has listened by then.
    fn cut_power(&mut self, back_us: u64, row: usize) -> Result<()> {
        let cut_us = back_us.saturating_sub(self.node.listen_us);
        self.idle_until(cut_us, row)?;
        self.past = counters::sum(&self.past, &self.controller.node().counters());
        self.controller.cut_power(self.node, self.bus.now_us())?;
        self.idle_until(back_us, row)
    }

    /// Lets the controller do what becomes due, and frames arrive that are late.
    fn idle_until(&mut self, until_us: u64, row: usize) -> Result<()> {
        loop {
            let due_us = self.controller.due_us().min(self.bus.next_arrival_us().unwrap_or(u64::MAX));
            if due_us >= until_us {
                self.bus.wait_until(until_us);
                return Ok(());
            }
            self.bus.wait_until(due_us);
            self.exchange(due_us, row)?;
        }
    }

    /// Lets frames flow until the bus is idle. Within an exchange the controller's clock stands still: a record knows days,
    /// and a clock that ran with the bus would make its results depend on who else is on it.
    fn exchange(&mut self, time_us: u64, row: usize) -> Result<()> {
        while self.controller.poll_next(time_us).is_some() {
            self.speak();
        }
        loop {
            let moved = self.bus.transmit_one();
            if let Some(frame) = &moved {
                (self.overhear)(self.bus.now_us(), frame)?;
            }
            let mut heard = false;
            while let Some((arrival_us, frame)) = self.bus.receive(MONITOR) {
                heard = true;
                let is_late = self.config.bus.longest_delay_us > 0;
                self.controller.receive(if is_late { arrival_us.max(time_us) } else { time_us }, &frame);
            }
            let answered = self.speak();
            while let Some((heard_us, frame)) = self.bus.receive(HOST) {
                heard = true;
                self.hear(heard_us, row, &frame);
            }
            if moved.is_none() && !answered && !heard {
                return Ok(());
            }
        }
    }

    fn speak(&mut self) -> bool {
        let mut spoke = false;
        while let Some(frame) = self.controller.transmit() {
            self.bus.send(MONITOR, frame);
            spoke = true;
        }
        spoke
    }

    fn hear(&mut self, heard_us: u64, row: usize, frame: &Frame) {
        if let Some(result) = self.results.receive(frame) {
            self.answers.push(AnsweredReading { row: row_of(result.sequence, row), result });
        }
        if let Ok((_, message)) = Message::decode(frame) {
            self.states.take(heard_us, &message);
        }
    }
}

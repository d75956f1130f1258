//! A record, played frame by frame over the virtual bus into the controller's core.
//!
//! The host sends each reading as frames and knows of the answer only what comes back as frames; [`live`] does the same
//! over a real bus.
//! [`check`] then holds every answer against the desktop crate.

pub mod check;
pub mod live;

use anyhow::{Result, anyhow};
use rotor_edge_core::can::{
    Counters, FLAG_FLAGGED, FLAG_SUSPICIOUS, Frame, MonitorResult, NumberedReading, ResultAssembler,
    reading_frames,
};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::residual::Bearing;
use rotor_edge_desktop::measurement::Reading;

use crate::bus::{BusConfig, Traffic, VirtualBus};
use crate::edge::{Deployment, EdgeNode};

/// Simulated time between readings, µs.
const READING_PERIOD_US: u64 = 100_000;
const HOST: usize = 0;
const MONITOR: usize = 1;

/// Settings of a replay.
#[derive(Debug, Clone, Copy)]
pub struct ReplayConfig {
    /// The controller.
    pub node: NodeConfig,
    /// The bus between host and controller.
    pub bus: BusConfig,
}

impl Default for ReplayConfig {
    fn default() -> Self {
        Self { node: NodeConfig::new(1), bus: BusConfig::default() }
    }
}

/// One reading that the controller answered.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// Row of the record.
    pub row: usize,
    /// What came back.
    pub result: MonitorResult,
}

impl Answer {
    /// Whether the controller says that the model no longer fits.
    pub fn flagged(&self) -> bool {
        self.result.flags & FLAG_FLAGGED != 0
    }

    /// Whether this reading alone looked wrong.
    pub fn suspicious(&self) -> bool {
        self.result.flags & FLAG_SUSPICIOUS != 0
    }
}

/// Everything a replay saw.
#[derive(Debug, Clone)]
pub struct Replay {
    /// Answers in the order of the record.
    pub answers: Vec<Answer>,
    /// What the bus carried.
    pub traffic: Traffic,
    /// The controller's own count of what became of the readings.
    pub counters: Counters,
}

/// A time during which the controller flagged the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flag {
    /// First suspicious reading of the streak, days (row number without a `time_d` column).
    pub since_d: f64,
    /// Reading at which the flag went up, days.
    pub time_d: f64,
    /// The bearing whose probes misfit most, 0 or 1.
    pub suspect: Option<usize>,
    /// Readings from the flag's rise to its fall.
    pub readings: usize,
}

/// Plays `record` into a fresh controller that holds the deployed model; `progress` hears of every row.
///
/// # Errors
/// If the controller refuses the model.
pub fn run(
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    progress: impl FnMut(usize),
) -> Result<Replay> {
    run_overheard(deployment, record, config, progress, |_, _| Ok(()))
}

/// The same; `overhear` gets every frame on the bus, with the simulated time in µs.
///
/// # Errors
/// If the controller refuses the model, or `overhear` fails.
pub fn run_overheard(
    deployment: &Deployment,
    record: &[Reading],
    config: &ReplayConfig,
    mut progress: impl FnMut(usize),
    mut overhear: impl FnMut(u64, &Frame) -> Result<()>,
) -> Result<Replay> {
    let mut node = EdgeNode::new(config.node, deployment.edge.clone())
        .map_err(|e| anyhow!("the controller refuses to start: {e:?}"))?;
    let mut bus = VirtualBus::new(config.bus, 2);
    // begins to listen
    node.poll(bus.now_us());
    let mut results = ResultAssembler::new();
    let mut answers = Vec::with_capacity(record.len());
    for (row, measured) in record.iter().enumerate() {
        let begins_us = config.node.listen_us + READING_PERIOD_US * row as u64;
        bus.wait_until(begins_us);
        node.poll(bus.now_us());
        let numbered = NumberedReading::new(row as u16, deployment.reading(measured));
        for frame in reading_frames(config.node.node, &numbered) {
            bus.send(HOST, frame);
        }
        let until_us = begins_us + READING_PERIOD_US;
        exchange(&mut bus, &mut node, until_us, &mut overhear, |frame| {
            if let Some(result) = results.receive(frame) {
                let row = row_of(result.sequence, row);
                answers.push(Answer { row, result });
            }
        })?;
        progress(row);
    }
    Ok(Replay { answers, traffic: bus.traffic(), counters: node.counters() })
}

/// Lets frames flow until the bus is idle and everything delayed has arrived, or the time is up.
fn exchange(
    bus: &mut VirtualBus,
    node: &mut EdgeNode,
    until_us: u64,
    overhear: &mut impl FnMut(u64, &Frame) -> Result<()>,
    mut hear: impl FnMut(&Frame),
) -> Result<()> {
    loop {
        let moved = bus.transmit_one();
        match &moved {
            Some(frame) => overhear(bus.now_us(), frame)?,
            // idle: frames that are still under way arrive before the next reading
            None => bus.wait_until(until_us),
        }
        while let Some((arrival_us, frame)) = bus.receive(MONITOR) {
            node.receive(arrival_us, &frame);
        }
        let mut answered = false;
        while let Some(frame) = node.transmit() {
            bus.send(MONITOR, frame);
            answered = true;
        }
        while let Some((_, frame)) = bus.receive(HOST) {
            hear(&frame);
        }
        if moved.is_none() && !answered {
            return Ok(());
        }
    }
}

/// The row that a 16-bit sequence number stands for, not later than the last one sent.
fn row_of(sequence: u16, last: usize) -> usize {
    last - usize::from((last as u16).wrapping_sub(sequence))
}

/// Day of a row; its number where the record has no days.
pub fn day(record: &[Reading], row: usize) -> f64 {
    record[row].time_d.unwrap_or(row as f64)
}

/// The times during which the flag was up.
pub fn flags(record: &[Reading], answers: &[Answer]) -> Vec<Flag> {
    let mut flags: Vec<Flag> = Vec::new();
    let mut since = 0;
    for (i, answer) in answers.iter().enumerate() {
        let before = i.checked_sub(1).map(|k| &answers[k]);
        if answer.suspicious() && !before.is_some_and(Answer::suspicious) {
            since = answer.row;
        }
        if !answer.flagged() {
            continue;
        }
        if before.is_some_and(Answer::flagged) {
            if let Some(flag) = flags.last_mut() {
                flag.readings += 1;
            }
        } else {
            let suspect = answer.result.suspect.map(|b| match b {
                Bearing::One => 0,
                Bearing::Two => 1,
            });
            flags.push(Flag {
                since_d: day(record, since),
                time_d: day(record, answer.row),
                suspect,
                readings: 1,
            });
        }
    }
    flags
}

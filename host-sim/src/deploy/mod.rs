//! A command to a monitor over a real bus, answered with the monitor's own code.

mod acknowledge;
mod answer;
mod key;
mod parts_client;
mod transfer;
pub mod trial;

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail};
use rotor_edge_core::can::Message;
use rotor_edge_core::command::{Answer, Command, Key};
use rotor_edge_core::state::{NodeState, Status};
use rotor_edge_core::thresholds::Thresholds;

use crate::bus::CanBus;
use crate::bus::mac::{Authenticator, Checker};
pub use acknowledge::acknowledge;
pub use answer::{ended, ended_json, out_of_bounds, suspected};
pub use key::{read_key, write_new_key, write_secret};
pub use parts_client::{PartsClient, Standing};
pub use transfer::command;

/// Longest wait for a frame before the clock is looked at.
const PATIENCE: Duration = Duration::from_millis(2);
/// Longest wait for a sign of life.
pub const HEARTBEAT_TIME: Duration = Duration::from_secs(3);

/// Who may command one monitor: its key, and the number of the next command.
#[derive(Debug, Clone)]
pub struct Authority {
    key: Key,
    node: u8,
    counter: u64,
}

impl Authority {
    /// Commands are numbered from `counter` on; the present time in milliseconds if absent.
    ///
    /// # Errors
    /// If there is none and this machine's clock stands before 1970.
    pub fn new(key: Key, node: u8, counter: Option<u64>) -> Result<Self> {
        let counter = match counter {
            Some(counter) => counter,
            None => {
                let since = SystemTime::now().duration_since(UNIX_EPOCH);
                since.context("this machine's clock stands before 1970: give --counter")?.as_millis() as u64
            }
        };
        Ok(Self { key, node, counter })
    }

    pub fn node(&self) -> u8 {
        self.node
    }

    /// Makes the MACs of readings for the monitor.
    pub fn authenticator(&self) -> Authenticator {
        Authenticator::new(self.key, self.node)
    }

    /// Believes what the monitor says under its MAC.
    pub fn checker(&self) -> Checker {
        Checker::new(self.key, self.node)
    }

    /// Number of the next command.
    pub fn counter(&self) -> u64 {
        self.counter
    }

    /// Sends a command and waits for its answer; `progress` hears how many bytes are on their way.
    ///
    /// # Errors
    /// If nobody answers, or the monitor refuses: why, and what to do.
    pub fn command(
        &mut self,
        bus: &mut dyn CanBus,
        what: Command,
        body: &[u8],
        progress: impl FnMut(usize),
    ) -> Result<Answer> {
        let counter = self.counter;
        self.counter = counter.saturating_add(1);
        command(bus, &self.key, self.node, counter, what, body, progress)
    }

    /// What the monitor judges by.
    ///
    /// # Errors
    /// As [`Self::command`].
    pub fn thresholds(&mut self, bus: &mut dyn CanBus) -> Result<Thresholds> {
        let answer = self.command(bus, Command::GetThresholds, &[], |_| ())?;
        answer.thresholds.with_context(|| format!("monitor {} does not tell its thresholds", self.node))
    }
}

/// Waits until `node` shows itself on the bus, ready to answer; how many frames were heard meanwhile.
///
/// # Errors
/// If it does not within [`HEARTBEAT_TIME`], or its number is used twice.
pub fn await_heartbeat(bus: &mut dyn CanBus, node: u8) -> Result<u64> {
    let end = bus.now() + HEARTBEAT_TIME;
    let mut heard_frames = 0;
    while bus.now() < end {
        let Some(frame) = bus.receive(PATIENCE)? else { continue };
        heard_frames += 1;
        match Message::decode(&frame) {
            Ok((from, Message::Heartbeat { state, .. })) if from == node => match state {
                NodeState::Listening => {}
                _ => return Ok(heard_frames),
            },
            // in a conflict, a monitor says nothing else
            Ok((from, Message::State(Status { state: NodeState::Conflict, .. }))) if from == node => bail!(
                "two devices on {} call themselves monitor {node}: give one of them another number",
                bus.description()
            ),
            _ => {}
        }
    }
    bail!(no_monitor(bus, node))
}

/// What `node` says of itself next.
///
/// # Errors
/// If it says nothing within [`HEARTBEAT_TIME`].
pub fn await_status(bus: &mut dyn CanBus, node: u8) -> Result<Status> {
    let end = bus.now() + HEARTBEAT_TIME;
    while bus.now() < end {
        let heard = bus.receive(PATIENCE)?;
        if let Some(Ok((from, Message::State(status)))) = heard.map(|frame| Message::decode(&frame))
            && from == node
        {
            return Ok(status);
        }
    }
    bail!(no_monitor(bus, node))
}

fn no_monitor(bus: &mut dyn CanBus, node: u8) -> String {
    format!(
        "no monitor {node} on {}: start one with `rotor-edge node --bus BUS --rotor ROTOR.toml`, or see who is there with `rotor-edge watch`",
        bus.description()
    )
}

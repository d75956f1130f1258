//! A monitor as a process: the controller's core on a real bus, with a file in place of flash.

mod bench;
mod controller;
mod hex;
mod mac;
mod store;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Result;
use rotor_edge_core::can::{Counters, Message};

use crate::bus::CanBus;
use crate::bus::states::States;
use crate::clock::Clock;
pub use bench::Bench;

pub use controller::Controller;
pub(crate) use hex::{from_hex, to_hex};
pub use store::Store;

/// Longest wait for a frame before the node's clock is looked at.
const PATIENCE: Duration = Duration::from_millis(5);
/// Longest time for frames under way at the end.
const AFTER_STOP: Duration = Duration::from_millis(200);

/// What a monitor did until it was stopped.
#[derive(Debug, Clone, Default)]
pub struct Served {
    /// What became of readings and commands.
    pub counters: Counters,
    /// What it said of itself, by its own clock.
    pub states: States,
    /// Frames it put on the bus.
    pub sent: u64,
    /// Frames it heard.
    pub received: u64,
    /// Checksum of the model that its last heartbeat told, and whether that is on trial.
    model: Option<(u32, bool)>,
}

/// What became of a monitor's model, as its heartbeats tell it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelChange {
    /// Another is in use and stays.
    Deployed,
    OnTrial,
    /// The one on trial stays.
    Confirmed,
    /// The one before the trial is in use again.
    TakenBack,
}

impl ModelChange {
    /// From one heartbeat's checksum and whether it is on trial to the next's.
    fn between(before: (u32, bool), now: (u32, bool)) -> Option<Self> {
        match (before, now) {
            ((_, false), (_, true)) => Some(Self::OnTrial),
            ((old, true), (new, false)) if old == new => Some(Self::Confirmed),
            ((_, true), (_, false)) => Some(Self::TakenBack),
            ((old, _), (new, _)) if old != new => Some(if now.1 { Self::OnTrial } else { Self::Deployed }),
            _ => None,
        }
    }

    pub fn words(self, checksum: u32) -> String {
        match self {
            Self::Deployed => format!("Model {checksum:08x} was deployed and is stored."),
            Self::OnTrial => format!(
                "Model {checksum:08x} is on trial; unless it is confirmed, the one before is taken back."
            ),
            Self::Confirmed => format!("Model {checksum:08x} was confirmed and is stored."),
            Self::TakenBack => format!(
                "The trial is over without a confirmation: model {checksum:08x}, the one before, is in use again."
            ),
        }
    }
}

/// What a monitor's process has to say while it runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// What became of its model, and the checksum of the one in use.
    Model(ModelChange, u32),
    /// What it learned cannot be stored: why.
    Unsaved(String),
    /// It can be stored again, and is.
    SavedAgain,
}

impl Event {
    pub fn words(&self) -> String {
        match self {
            Self::Model(change, checksum) => change.words(*checksum),
            Self::Unsaved(why) => format!(
                "What the monitor learned cannot be stored, and a restart would lose it, a flag too: {why}; it is tried \
                 again, every minute at least."
            ),
            Self::SavedAgain => "What the monitor learned is stored again.".into(),
        }
    }
}

/// Runs a monitor on `bus` until `stop`, and a little longer for frames that are under way; `tell` hears what becomes of its
/// model and its memory.
///
/// # Errors
/// If the bus fails.
pub fn serve(
    bus: &mut dyn CanBus,
    controller: &mut Controller,
    clock: &impl Clock,
    stop: &AtomicBool,
    mut tell: impl FnMut(Event),
) -> Result<Served> {
    let mut served = Served::default();
    let mut model = None;
    let mut is_unsaved = false;
    let mut stopped: Option<Duration> = None;
    while stopped.is_none_or(|stopped| bus.now() - stopped < AFTER_STOP) {
        let heard = bus.receive(PATIENCE)?;
        if stop.load(Ordering::Relaxed) {
            stopped.get_or_insert_with(|| bus.now());
        }
        let now_us = clock.now_us();
        while let Some(due_us) = controller.poll_next(now_us) {
            served.send(bus, controller, due_us)?;
        }
        match heard {
            Some(frame) => {
                served.received += 1;
                controller.receive(now_us, &frame);
                served.send(bus, controller, now_us)?;
            }
            None if stopped.is_some() => break,
            None => {}
        }
        if let Some(now) = served.model
            && let Some(before) = model.replace(now)
            && let Some(change) = ModelChange::between(before, now)
        {
            tell(Event::Model(change, now.0));
        }
        let unsaved = controller.unsaved();
        if unsaved.is_some() != is_unsaved {
            is_unsaved = unsaved.is_some();
            tell(unsaved.map_or(Event::SavedAgain, |why| Event::Unsaved(why.into())));
        }
    }
    served.counters = controller.node().counters();
    Ok(served)
}

impl Served {
    fn send(&mut self, bus: &mut dyn CanBus, controller: &mut Controller, time_us: u64) -> Result<()> {
        while let Some(frame) = controller.transmit() {
            bus.send(&frame)?;
            self.sent += 1;
            if let Ok((_, message)) = Message::decode(&frame) {
                self.states.take(time_us, &message);
                if let Message::Model { checksum, on_trial, .. } = message {
                    self.model = Some((checksum, on_trial));
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn confirmed_trial_is_distinct_from_revoked_and_deployed() {
        let between = ModelChange::between;
        assert_eq!(between((1, false), (2, true)), Some(ModelChange::OnTrial));
        assert_eq!(between((2, true), (2, false)), Some(ModelChange::Confirmed));
        assert_eq!(between((2, true), (1, false)), Some(ModelChange::TakenBack));
        assert_eq!(between((2, true), (3, true)), Some(ModelChange::OnTrial));
        assert_eq!(between((1, false), (2, false)), Some(ModelChange::Deployed));
        assert_eq!(between((1, false), (1, false)), None);
    }
}

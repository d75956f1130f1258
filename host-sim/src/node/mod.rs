//! A monitor as a process: the controller's core on a real bus, with a file in place of flash.

mod bench;
mod clock;
mod controller;
mod seal;
mod store;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Result;
use rotor_edge_core::can::{Counters, Message};

use crate::bus::CanBus;
use crate::bus::states::States;
pub use bench::Bench;
pub use clock::{Clock, PlayedTime, RealTime};
pub use controller::Controller;
pub use store::Store;
pub(crate) use store::{from_hex, to_hex};

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
}

/// Runs a monitor on `bus` until `stop`, and a little longer for frames that are under way.
///
/// # Errors
/// If the bus fails.
pub fn serve(
    bus: &mut dyn CanBus,
    controller: &mut Controller,
    clock: &impl Clock,
    stop: &AtomicBool,
) -> Result<Served> {
    let mut served = Served::default();
    let mut stopped: Option<Instant> = None;
    while stopped.is_none_or(|stopped| stopped.elapsed() < AFTER_STOP) {
        let heard = bus.receive(PATIENCE)?;
        if stop.load(Ordering::Relaxed) {
            stopped.get_or_insert_with(Instant::now);
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
            }
        }
        Ok(())
    }
}

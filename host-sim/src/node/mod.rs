//! A monitor as a process: the controller's core on a real bus, with a file in place of flash.

mod store;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use rotor_edge_core::can::Counters;
use rotor_edge_core::node::NodeConfig;

use crate::bus::CanBus;
use crate::edge::{EdgeModel, EdgeNode};
pub use store::Store;
pub(crate) use store::{from_hex, to_hex};

/// Longest wait for a frame before the node's clock is looked at.
const PATIENCE: Duration = Duration::from_millis(5);
/// Longest time for frames under way at the end.
const AFTER_STOP_US: u64 = 200_000;

/// What a monitor did until it was stopped.
#[derive(Debug, Clone, Copy, Default)]
pub struct Served {
    /// What became of readings and commands.
    pub counters: Counters,
    /// Frames it put on the bus.
    pub sent: u64,
    /// Frames it heard.
    pub received: u64,
}

/// Runs a monitor on `bus` until `stop`, and a little longer for frames that are under way. A model in the store goes
/// before `model`.
///
/// # Errors
/// If the node refuses its number or its model, or the bus fails.
pub fn serve(
    bus: &mut dyn CanBus,
    config: NodeConfig,
    model: EdgeModel,
    mut store: Option<Store>,
    stop: &AtomicBool,
) -> Result<Served> {
    let stored = store.as_ref().and_then(Store::model).cloned();
    let mut node = EdgeNode::new(config, stored.unwrap_or(model))
        .map_err(|e| anyhow!("the controller refuses to start: {e:?}"))?;
    if let Some(store) = &store {
        node.restore_counter(store.counter());
    }
    let started = Instant::now();
    let now_us = || started.elapsed().as_micros() as u64;
    let mut served = Served::default();
    let mut left_us = AFTER_STOP_US;
    while left_us > 0 {
        let begun_us = now_us();
        match bus.receive(PATIENCE)? {
            Some(frame) => {
                served.received += 1;
                node.receive(now_us(), &frame);
            }
            None if stop.load(Ordering::Relaxed) => break,
            None => {}
        }
        node.poll(now_us());
        if let Some(save) = node.to_save() {
            let stored = match &mut store {
                Some(store) => store.save(save.counter, save.model).is_ok(),
                // nothing to lose: without a file the monitor forgets everything when it ends
                None => true,
            };
            node.saved(now_us(), stored);
        }
        while let Some(frame) = node.transmit() {
            bus.send(&frame)?;
            served.sent += 1;
        }
        if stop.load(Ordering::Relaxed) {
            left_us = left_us.saturating_sub(now_us() - begun_us);
        }
    }
    served.counters = node.counters();
    Ok(served)
}

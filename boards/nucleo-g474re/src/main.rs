//! The node on a NUCLEO-G474RE: FDCAN1 at 500 kbit/s, model and counter in flash, a watchdog, a light.
//!
//! One loop does everything: it sleeps until a frame arrives or ten milliseconds have passed. Interrupts only move frames
//! and time. A reading takes about 210,000 instructions, 1.5 ms; a deployment stops the loop for the 45 ms in which two
//! pages of flash are erased, while frames wait in the controller's ring.

#![no_std]
#![no_main]

mod board;
mod can;
mod supply;

use defmt_rtt as _;
use embassy_futures::select::{Either, select};
use embassy_stm32::can::Frame as BusFrame;
use embassy_time::{Duration, Instant, Ticker};
use panic_probe as _;
use rotor_edge_boards::light;
use rotor_edge_boards::monitor::{Monitor, Place};
use rotor_edge_boards::settings;
use rotor_edge_boards::watchdog::{Part, Progress};
use rotor_edge_core::command::Key;
use rotor_edge_core::node::NodeConfig;

use board::{Board, State};
use can::Can;

const NODE: u8 = settings::node(option_env!("ROTOR_EDGE_NODE"), 1);
const KEY: Option<Key> = settings::key(option_env!("ROTOR_EDGE_KEY"));
const TICK: Duration = Duration::from_millis(10);

static PLACE: Place = Place::new();

#[embassy_executor::main]
async fn main(_spawner: embassy_executor::Spawner) {
    let config = NodeConfig { key: KEY, ..NodeConfig::new(NODE) };
    let Board { can, state, mut light, mut watchdog } = Board::start(NODE);
    let Ok((mut monitor, started)) = Monitor::start(&PLACE, state, config) else {
        defmt::panic!("the node does not start")
    };
    defmt::info!("node {} with counter {}, deployed model: {}", NODE, started.counter, started.deployed);
    if KEY.is_none() {
        defmt::warn!("no key: this node takes no commands (ROTOR_EDGE_KEY)");
    }
    let mut bus = Can::new(can);
    let mut progress = Progress::new();
    let mut ticker = Ticker::every(TICK);
    watchdog.unleash();
    loop {
        match select(bus.receive(), ticker.next()).await {
            Either::First(frame) => {
                take(&mut monitor, frame);
                while let Some(frame) = bus.try_receive() {
                    take(&mut monitor, frame);
                }
            }
            Either::Second(()) => {
                let time_us = Instant::now().as_micros();
                monitor.node.poll(time_us);
                progress.polled(time_us);
                bus.poll(time_us);
                light.set_level(light::is_on(monitor.node.state(), time_us).into());
            }
        }
        progress.made(Part::Receive);
        if bus.send_all(|| monitor.node.transmit()) {
            progress.made(Part::Send);
        }
        if progress.may_feed() {
            watchdog.pet();
        }
    }
}

fn take(monitor: &mut Monitor<State>, frame: BusFrame) {
    let Some(frame) = can::to_core(&frame) else { return };
    let accepted = monitor.node.counters().accepted;
    monitor.receive(Instant::now().as_micros(), &frame, !supply::is_low());
    if monitor.node.counters().accepted != accepted {
        defmt::info!("command {} carried out", monitor.node.command_counter());
    }
}

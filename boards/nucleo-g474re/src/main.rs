//! The node on a NUCLEO-G474RE: probes by DMA, FDCAN1 at 500 kbit/s, model and memory in flash, a watchdog, a light.
//!
//! One task makes readings of samples. One loop does everything else: it sleeps until a reading or a frame arrives, the node
//! wants to be polled, or 50 ms have passed. Interrupts only move frames, samples, marks and time. A deployment stops the
//! loop for the 45 ms in which two pages of flash are erased, while frames wait in the controller's ring and samples are
//! lost; so does, for 22 ms, every thirteenth record of memory.

#![no_std]
#![no_main]

mod board;
mod can;
mod fault;
mod probes;
mod state;
mod supply;

use defmt_rtt as _;
use embassy_futures::select::{Either3, select3};
use embassy_stm32::can::Frame as BusFrame;
use embassy_stm32::gpio::Output;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Duration, Instant, Ticker, Timer};
use rotor_edge_boards::light::{self, Sign};
use rotor_edge_boards::monitor::{Monitor, Place};
use rotor_edge_boards::settings;
use rotor_edge_boards::watchdog::{Part, Progress};
use rotor_edge_core::can::reading_frames;
use rotor_edge_core::command::Key;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::state::{NodeState, Reason};

use board::{Board, Oscillator};
use can::Can;
use fault::Cause;
use probes::READINGS;
use state::State;

const NODE: u8 = settings::node(option_env!("ROTOR_EDGE_NODE"), 1);
const KEY: Option<Key> = settings::key(option_env!("ROTOR_EDGE_KEY"));
/// A crystal that did not start is looked at again after this.
const CRYSTAL_AGAIN_US: u64 = 1_000_000;
/// The light and the watchdog want the loop to come round at least so often.
const TICK_US: u64 = 50_000;
/// Between two rounds without a frame or a reading, at least: the probes' task runs then.
const REST_US: u64 = 1_000;

static PLACE: Place = Place::new();

#[embassy_executor::main]
async fn main(spawner: embassy_executor::Spawner) {
    let mut watchdog = board::watchdog();
    fault::report();
    let Board { can, slots, journal, mut light, probes, oscillator } = Board::start(NODE);
    let mut config = NodeConfig::new(NODE);
    config.key = KEY;
    config.seed = board::serial_number();
    let Ok((mut monitor, started)) = Monitor::start(&PLACE, slots, journal, config) else { unreachable!() };
    let lack = started.model.map_or_else(|reason| reason.code(), |()| 0);
    defmt::info!("node {} with counter {}, no model for reason {}", NODE, started.counter, lack);
    defmt::info!("thresholds set: {}, remembered: {}", started.has_thresholds, started.is_remembered);
    if KEY.is_none() {
        defmt::warn!("no key: this node takes no commands (ROTOR_EDGE_KEY)");
    }
    if oscillator == Oscillator::Internal {
        defmt::error!("the crystal does not swing: no readings, and silent on the bus");
        // Silent, it listens for ever; a flag of before counts all the same.
        let status = monitor.node.status(0);
        let state = if status.cause == Reason::None { status.state } else { NodeState::Flagged };
        wait_for_crystal(watchdog, light, state).await
    }
    let mut bus = Can::new(can);
    let Ok(task) = probes::sample(probes) else { unreachable!() };
    spawner.spawn(task);
    // A reading's frames that are still to be sent.
    let mut own = None.into_iter().flatten();
    let mut progress = Progress::new();
    loop {
        let now_us = Instant::now().as_micros();
        let wake_us = monitor.node.poll_at().clamp(now_us + REST_US, now_us + TICK_US);
        let wake = Timer::at(Instant::from_micros(wake_us));
        match select3(bus.receive(), wake, READINGS.receive()).await {
            Either3::First(frame) => {
                take(&mut monitor, frame);
                while let Some(frame) = bus.try_receive() {
                    take(&mut monitor, frame);
                }
            }
            Either3::Second(()) => {}
            // Others on the bus get the reading as well as the result.
            Either3::Third(reading) => {
                if own.next().is_some() {
                    defmt::warn!("the bus has not taken the reading before {}", reading.sequence);
                }
                let frames = reading_frames(NODE, &reading);
                let time_us = Instant::now().as_micros();
                for frame in &frames {
                    monitor.receive(time_us, frame, !supply::is_low());
                }
                own = Some(frames).into_iter().flatten();
            }
        }
        progress.made(Part::Receive);
        let time_us = Instant::now().as_micros();
        if time_us >= monitor.node.poll_at() {
            monitor.poll(time_us, !supply::is_low());
        }
        if monitor.node.is_trial_over(time_us) {
            fault::stop(Cause::TrialOver, 0);
        }
        progress.polled(time_us);
        bus.poll(time_us);
        light.set_level(light::is_on(Sign::of(&monitor.node.status(time_us)), time_us).into());
        if !monitor.node.may_send() {
            // Under a number that is somebody else's as well they would meet on the wire.
            own = None.into_iter().flatten();
        }
        if bus.send_all(time_us, || own.next().or_else(|| monitor.node.transmit())) {
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

/// With the clocks 1 % off, nothing that the node could say is right: the light says so, a flag stays to be seen, and once
/// the crystal swings the program starts anew.
async fn wait_for_crystal(
    mut watchdog: IndependentWatchdog<'static, IWDG>,
    mut light: Output<'static>,
    state: NodeState,
) -> ! {
    let sign = match state {
        NodeState::Flagged => Sign::State(state),
        _ => Sign::NoClock,
    };
    let mut ticker = Ticker::every(Duration::from_micros(TICK_US));
    loop {
        ticker.next().await;
        let time_us = Instant::now().as_micros();
        light.set_level(light::is_on(sign, time_us).into());
        if time_us > CRYSTAL_AGAIN_US && board::crystal_swings() {
            fault::stop(Cause::CrystalBack, 0);
        }
        watchdog.pet();
    }
}

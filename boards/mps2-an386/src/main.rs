//! The node on the emulated board: SLCAN on the first UART, a log on the second.
//!
//! Everything happens in the loop of `main`; interrupts only move bytes and time. The longest pass is the evaluation of a
//! reading, about 200,000 instructions.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use rotor_edge_boards::monitor::{Monitor, Place};
use rotor_edge_core::can::slcan::{self, ACCEPTED, Decoder, REFUSED, SlcanLine, encode};
use rotor_edge_mps2_an386::log::report_and_reset;
use rotor_edge_mps2_an386::state::StateMemory;
use rotor_edge_mps2_an386::uart::{self, UART0};
use rotor_edge_mps2_an386::{clock, log, sample, stack};

/// The stack's high-water mark is looked up this often.
const STACK_PERIOD_US: u64 = 1_000_000;

static PLACE: Place = Place::new();

#[entry]
fn main() -> ! {
    stack::paint();
    let Some(peripherals) = cortex_m::Peripherals::take() else { unreachable!() };
    clock::start(peripherals.SYST);
    uart::start();
    // SAFETY: once, here.
    let (slots, journal) = unsafe { StateMemory::take() };
    let (mut monitor, started) = match Monitor::start(&PLACE, slots, journal, sample::config()) {
        Ok(started) => started,
        Err(error) => panic!("the node does not start: {error:?}"),
    };
    log!("{:?}", started);
    let mut wire = Wire { decoder: Decoder::new(), open: false };
    let mut look = Look { due_us: 0, deepest_bytes: 0 };
    loop {
        let time_us = clock::now_us();
        if time_us >= monitor.node.poll_at() {
            monitor.poll(time_us, true);
        }
        if monitor.node.is_trial_over(time_us) {
            cortex_m::peripheral::SCB::sys_reset();
        }
        while let Some(byte) = UART0.read() {
            wire.take(&mut monitor, byte);
        }
        wire.send(&mut monitor);
        look.at_stack(time_us);
        // Every byte and every millisecond ends it.
        cortex_m::asm::wfi();
    }
}

type BoardMonitor = Monitor<StateMemory>;

/// The adapter that SLCAN supposes between the wire and the bus.
struct Wire {
    decoder: Decoder,
    open: bool,
}

impl Wire {
    fn take(&mut self, monitor: &mut BoardMonitor, byte: u8) {
        let Some(line) = self.decoder.push(byte) else { return };
        let answer = match line {
            SlcanLine::Frame(frame) if self.open => {
                monitor.receive(clock::now_us(), &frame, true);
                ACCEPTED
            }
            SlcanLine::OtherFrame if self.open => ACCEPTED,
            SlcanLine::Open => {
                self.open = true;
                ACCEPTED
            }
            SlcanLine::Close => {
                self.open = false;
                ACCEPTED
            }
            SlcanLine::Setting(letter) => slcan::answer(letter),
            SlcanLine::BitRate | SlcanLine::Empty => ACCEPTED,
            _ => REFUSED,
        };
        answer.bytes().for_each(|byte| UART0.write(byte));
        self.send(monitor);
    }

    /// Sends what the node has to say; with the channel closed it speaks to nobody.
    fn send(&mut self, monitor: &mut BoardMonitor) {
        while let Some(frame) = monitor.node.transmit() {
            if self.open {
                encode(&frame).iter().for_each(|&byte| UART0.write(byte));
            }
        }
    }
}

/// Says when the stack has grown.
struct Look {
    due_us: u64,
    deepest_bytes: usize,
}

impl Look {
    fn at_stack(&mut self, time_us: u64) {
        if time_us < self.due_us {
            return;
        }
        self.due_us = time_us + STACK_PERIOD_US;
        let bytes = stack::high_water_bytes();
        if bytes > self.deepest_bytes {
            self.deepest_bytes = bytes;
            log!("stack {} of {} bytes", bytes, stack::size_bytes());
        }
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    report_and_reset(info)
}

//! A node on CAN that takes authenticated commands, for a Cortex-M4F: frames in, frames out. The controller's registers are those
//! of an invented board; `tests/foreign-firmware` builds this file for `thumbv7em-none-eabihf` and asserts its size.

#![no_std]
#![no_main]

use core::panic::PanicInfo;
use core::ptr;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use rotor_edge_core::can::Frame;
use rotor_edge_core::command::{KEY_BYTES, Key};
use rotor_edge_core::node::{Node, NodeConfig, Save};
use rotor_edge_core::state::Reason;

const NUMBER: u8 = 7;
const CLOCK_HZ: u32 = 170_000_000;
/// A page of flash that a real board fills when it is made.
const KEY: *const [u8; KEY_BYTES] = 0x0801_f000 as *const [u8; KEY_BYTES];
const MAILBOX: *mut u32 = 0x4000_6580 as *mut u32;
const RECEIVED: *mut u32 = 0x4000_65b0 as *mut u32;
const TRANSMIT: u32 = 1;

static MILLISECONDS: AtomicU32 = AtomicU32::new(0);

#[exception]
fn SysTick() {
    MILLISECONDS.store(MILLISECONDS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// No path of the core leads here; a fault of this file resets.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}

#[entry]
fn main() -> ! {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(CLOCK_HZ / 1_000 - 1);
        core.SYST.enable_interrupt();
        core.SYST.enable_counter();
    }
    let mut config = NodeConfig::new(NUMBER);
    // SAFETY: mapped flash.
    config.key = Some(Key(unsafe { ptr::read_volatile(KEY) }));
    let Ok(mut node) = Node::<6, 4, 2>::new(config) else { cortex_m::peripheral::SCB::sys_reset() };
    let _ = node.load(Err(Reason::NothingStored));
    let mut milliseconds = 0;
    loop {
        let counted = MILLISECONDS.load(Ordering::Relaxed);
        milliseconds += u64::from(counted.wrapping_sub(milliseconds as u32));
        let time_us = milliseconds * 1_000;
        while let Some(frame) = received() {
            node.receive(time_us, &frame);
        }
        node.poll(time_us);
        while let Some(save) = node.to_save() {
            let is_stored = store(&save);
            node.saved(time_us, is_stored);
        }
        if node.is_trial_over(time_us) {
            cortex_m::peripheral::SCB::sys_reset();
        }
        while let Some(frame) = node.transmit() {
            send(&frame);
        }
        cortex_m::asm::wfi();
    }
}

/// Two pages in turn, each with a checksum, are what a real board has here.
fn store(save: &Save) -> bool {
    let bytes = match save {
        Save::Command { model, .. } => model.unwrap_or_default(),
        Save::Memory(memory) => memory,
        Save::Nonce(_) => return false,
    };
    // SAFETY: a page of flash that holds no code.
    bytes.iter().for_each(|byte| unsafe { ptr::write_volatile(0x0801_e000 as *mut u8, *byte) });
    true
}

fn received() -> Option<Frame> {
    // SAFETY: registers of the CAN controller.
    let [identifier, length, low, high] =
        [0, 1, 2, 3].map(|place| unsafe { ptr::read_volatile(RECEIVED.add(place)) });
    let bytes = (u64::from(high) << 32 | u64::from(low)).to_le_bytes();
    Frame::standard((identifier >> 21) as u16, bytes.get(..(length & 15) as usize)?)
}

fn send(frame: &Frame) {
    let mut bytes = [0; 8];
    bytes.iter_mut().zip(frame.bytes()).for_each(|(to, from)| *to = *from);
    let data = u64::from_le_bytes(bytes);
    // SAFETY: registers of the CAN controller.
    unsafe {
        ptr::write_volatile(MAILBOX.add(1), frame.bytes().len() as u32);
        ptr::write_volatile(MAILBOX.add(2), data as u32);
        ptr::write_volatile(MAILBOX.add(3), (data >> 32) as u32);
        ptr::write_volatile(MAILBOX, u32::from(frame.raw_id()) << 21 | TRANSMIT);
    }
}
